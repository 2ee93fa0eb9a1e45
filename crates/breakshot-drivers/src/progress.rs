//! Is the arm where the path is at this time, no faster, and has it moved along the whole path?

use crate::fault::Fault;
use crate::motion::{Motion, largest_difference};
use crate::robot::arm::ArmState;
use std::collections::VecDeque;

/// Largest deviation of a joint from the path (rad).
pub(crate) const OFF_PATH_RAD: f64 = 0.05;
/// Largest deviation from a pose that counts as reached (rad).
pub(crate) const ARRIVED_RAD: f64 = 0.01;
/// Largest time by which the arm may be ahead of its path (s).
const AHEAD_S: f64 = 0.1;
/// Largest time by which the arm may be behind its path, the deviation of a servo (s).
const BEHIND_S: f64 = 0.1;
/// Largest time from the acceptance of a motion to its begin (s).
const START_S: f64 = 0.2;
/// A joint that has moved this far shows that the motion has begun (rad).
const BEGUN_RAD: f64 = 0.01;
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
    /// The latest time at which the motion has begun, since it was sent (s); `None` before it was accepted.
    begun_s: Option<f64>,
    readings: VecDeque<Reading>,
}

impl<'a> Progress<'a> {
    pub(crate) fn new(motion: &'a Motion, joints: &'a [String], pace: f64) -> Self {
        Self { motion, joints, pace, passed: 0, begun_s: None, readings: VecDeque::new() }
    }

    /// The robot has accepted the motion, `elapsed_s` after it was sent.
    pub(crate) fn accepted(&mut self, elapsed_s: f64) {
        self.begins_by(elapsed_s + START_S);
    }

    fn begins_by(&mut self, latest_s: f64) {
        self.begun_s = Some(self.begun_s.map_or(latest_s, |known_s| known_s.min(latest_s)));
    }

    /// Checks a reading that arrived `elapsed_s` after the motion was sent.
    ///
    /// # Errors
    /// The arm is ahead of its path or behind it, or a joint is faster than planned.
    pub(crate) fn check(&mut self, state: &ArmState, elapsed_s: f64) -> Result<(), Fault> {
        self.pass(&state.q_rad);
        let times_s = &self.motion.phase.time_s;
        let path_s = times_s[self.passed] - times_s[0];
        let ahead_s = path_s - elapsed_s * self.pace;
        if ahead_s > AHEAD_S {
            return Err(Fault::Ahead { motion: self.motion.name.into(), ahead_s });
        }
        if self.has_begun(state) {
            self.begins_by((elapsed_s - path_s / self.pace).max(0.0));
        }
        self.check_delay(state, elapsed_s)?;
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

    /// Whether the arm has left the start of the path.
    pub(crate) fn has_begun(&self, state: &ArmState) -> bool {
        largest_difference(&state.q_rad, self.motion.start()).1 > BEGUN_RAD
    }

    /// Whether the arm has passed all of the path but its end.
    pub(crate) fn has_ended(&self) -> bool {
        let end = self.motion.end();
        let away_rad = |samples: &[Vec<f64>]| {
            samples.iter().map(|sample| largest_difference(sample, end).1).fold(0.0, f64::max)
        };
        let samples = &self.motion.phase.q_rad;
        // A motion may end where it starts; one that is too small to be seen counts as made.
        let near_rad = (2.0 * ARRIVED_RAD + SAME_RAD).min((away_rad(samples) / 2.0).max(1.5 * SAME_RAD));
        away_rad(&samples[self.passed..]) <= near_rad
    }

    /// The arm must be near the path where it was at most [`BEHIND_S`] ago: it may be slow where that hardly moves it.
    fn check_delay(&self, state: &ArmState, elapsed_s: f64) -> Result<(), Fault> {
        let Some(begun_s) = self.begun_s else { return Ok(()) };
        let times_s = &self.motion.phase.time_s;
        let index = |path_s: f64| times_s.partition_point(|&t| t - times_s[0] < path_s);
        let least_s = (elapsed_s - state.age_s - begun_s) * self.pace - BEHIND_S;
        let from = index(least_s).min(times_s.len() - 1);
        let to = index(elapsed_s * self.pace + AHEAD_S).clamp(from + 1, times_s.len());
        let samples = &self.motion.phase.q_rad[from..to];
        let off_rad = samples.iter().map(|sample| largest_difference(sample, &state.q_rad).1);
        if off_rad.fold(f64::INFINITY, f64::min) <= OFF_PATH_RAD {
            return Ok(());
        }
        let behind_s =
            (least_s + BEHIND_S).min(self.motion.duration_s()) - (times_s[self.passed] - times_s[0]);
        Err(Fault::Behind { motion: self.motion.name.into(), behind_s })
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
