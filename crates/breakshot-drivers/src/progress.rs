//! Is the arm where the path is at this time, and no faster?

use crate::fault::Fault;
use crate::motion::{Motion, largest_difference};
use crate::robot::arm::ArmState;
use std::collections::VecDeque;

/// Largest time by which the arm may be ahead of its path (s).
const AHEAD_S: f64 = 0.1;
/// Largest ratio of a joint's speed to its planned one.
const FASTER: f64 = 1.1;
/// The time over which speeds are measured (s).
const WINDOW_S: f64 = 0.3;
/// Poses nearer than this count as the same (rad): the sensors' noise, and the path at rest.
const SAME_RAD: f64 = 0.005;
/// Time before and after two readings in which planned speeds are looked up (s).
const AROUND_S: f64 = 0.05;

/// One reading of the joint angles.
struct Reading {
    /// The earliest time at which they were measured, since the motion was sent (s).
    earliest_s: f64,
    /// The time of the path at which it passes them (s).
    path_s: f64,
    q_rad: Vec<f64>,
}

/// Follows the arm along a motion.
pub(crate) struct Progress<'a> {
    motion: &'a Motion,
    joints: &'a [String],
    /// Speed of the controller's clock over ours.
    pace: f64,
    /// The sample that the arm has passed.
    passed: usize,
    readings: VecDeque<Reading>,
}

impl<'a> Progress<'a> {
    pub(crate) fn new(motion: &'a Motion, joints: &'a [String], pace: f64) -> Self {
        Self { motion, joints, pace, passed: 0, readings: VecDeque::new() }
    }

    /// Checks a reading that arrived `elapsed_s` after the motion was sent.
    ///
    /// # Errors
    /// The arm is ahead of its path, or a joint is faster than planned.
    pub(crate) fn check(&mut self, state: &ArmState, elapsed_s: f64) -> Result<(), Fault> {
        self.pass(&state.q_rad);
        let times_s = &self.motion.phase.time_s;
        let path_s = times_s[self.passed] - times_s[0];
        let ahead_s = path_s - elapsed_s * self.pace;
        if ahead_s > AHEAD_S {
            return Err(Fault::Ahead { motion: self.motion.name.into(), ahead_s });
        }
        while self.readings.front().is_some_and(|reading| elapsed_s - reading.earliest_s > WINDOW_S) {
            self.readings.pop_front();
        }
        if let Some(first) = self.readings.front() {
            self.check_speeds(first, state, [path_s, elapsed_s])?;
        }
        let earliest_s = elapsed_s - state.age_s;
        self.readings.push_back(Reading { earliest_s, path_s, q_rad: state.q_rad.clone() });
        Ok(())
    }

    /// The first sample from the last one on that is as near to the angles as any: the draw-back passes the stroke's poses again.
    fn pass(&mut self, q_rad: &[f64]) {
        let distance_rad = |sample: &Vec<f64>| largest_difference(sample, q_rad).1;
        let rest = &self.motion.phase.q_rad[self.passed..];
        let nearest_rad = rest.iter().map(distance_rad).fold(f64::INFINITY, f64::min);
        let ahead = rest.iter().position(|sample| distance_rad(sample) <= nearest_rad + SAME_RAD);
        self.passed += ahead.unwrap_or(0);
    }

    /// Compares the mean speeds since an earlier reading with the planned ones.
    fn check_speeds(
        &self,
        first: &Reading,
        state: &ArmState,
        [path_s, elapsed_s]: [f64; 2],
    ) -> Result<(), Fault> {
        // The longest time in which the joints can have moved.
        let duration_s = elapsed_s - first.earliest_s;
        let phase = &self.motion.phase;
        let around_s = [first.path_s - AROUND_S, path_s + AROUND_S].map(|s| s + phase.time_s[0]);
        let [from, to] = around_s.map(|s| phase.time_s.partition_point(|&t| t < s));
        for joint in 0..state.q_rad.len() {
            let moved_rad = (state.q_rad[joint] - first.q_rad[joint]).abs();
            let speeds = phase.qd_rad_s[from..to].iter().map(|row| row[joint].abs());
            let planned_rad_s = self.pace * speeds.fold(0.0, f64::max);
            if moved_rad > FASTER * planned_rad_s * duration_s + 2.0 * SAME_RAD {
                let joint = self.joints.get(joint).cloned().unwrap_or_default();
                let speed_rad_s = moved_rad / duration_s;
                return Err(Fault::TooFast { joint, speed_rad_s, planned_rad_s });
            }
        }
        Ok(())
    }
}
