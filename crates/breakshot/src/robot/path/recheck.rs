//! Is a command read from a file still a valid motion of its arm? Files can be damaged, edited or outdated.

use super::limit_monitor::PathConstraints;
use super::limits::{LimitCheck, Limits};
use crate::error::{Error, Result};
use crate::robot::command::Command;
use crate::robot::phase::{Phase, PhaseName};

/// Largest time between two samples (s), with an allowance for rounding.
const STEP_S: f64 = 0.002 + 1e-9;
/// Largest jump between phases (rad), and largest joint velocity at their ends (rad/s).
const JOINT_TOLERANCE: f64 = 1e-6;
/// Largest difference between a step and the integral of its velocities (rad); jerk accounts for at most 2e-6.
const SLOPE_RAD: f64 = 1e-4;

/// Largest differences between the derivatives of a file and those of its angles: jerk explains a fifth of them.
const SPEED_RAD_S: f64 = 0.02;
const ACCELERATION_RAD_S2: f64 = 2.0;
/// Largest difference of the accelerations at an end and one sample before (rad/s2), from the largest jerk.
const END_JUMP_RAD_S2: f64 = 10.0;

impl Command {
    /// Checks that the samples are one continuous motion of this arm, at rest between its phases.
    ///
    /// # Errors
    /// Missing or extra numbers, times that decrease or leave gaps, jumps, velocities and accelerations that are not the
    /// derivatives of the angles.
    pub fn check(&self) -> Result<()> {
        let bad =
            |what: &str, found: String, needed: &str| Err(Error::invalid("command", what, found, needed));
        if self.version != 1 {
            return bad("version", self.version.to_string(), "1");
        }
        self.strike.check("command: strike")?;
        let names: Vec<PhaseName> = self.phases.iter().map(|phase| phase.name).collect();
        if names != PhaseName::ALL {
            return bad("phases", format!("{names:?}"), "all six in their order");
        }
        let mounted = self.mounted_arm()?;
        if mounted.arm().joint_names() != self.joints {
            return bad("joints", format!("{:?}", self.joints), "the arm's joint names");
        }
        for phase in &self.phases {
            phase.check(self.joints.len())?;
        }
        for pair in self.phases.windows(2) {
            let (before, after) = (pair[0].q_rad.len() - 1, &pair[1]);
            let apart = pair[0].q_rad[before].iter().zip(&after.q_rad[0]).map(|(a, b)| (a - b).abs());
            let gap_s = (after.time_s[0] - pair[0].span_s()[1]).abs();
            if apart.fold(gap_s, f64::max) > JOINT_TOLERANCE {
                return bad(
                    "phases",
                    format!("a jump before the {}", after.name.label()),
                    "phases that join",
                );
            }
        }
        Ok(())
    }

    /// The worst check of each quantity over all samples, recomputed with the default limits. Call [`Command::check`] first.
    ///
    /// # Errors
    /// An arm model that cannot be built; a command without a scene, whose workspace is not known.
    pub fn checked_again(&self) -> Result<Vec<LimitCheck>> {
        let mounted = self.mounted_arm()?;
        let scene = self
            .scene
            .as_ref()
            .ok_or_else(|| Error::invalid("command", "scene", "missing", "a scene with the workspace"))?;
        let limits = Limits::default();
        let constraints = PathConstraints::new(&mounted, &scene.cell, Some(scene), &limits);
        let mut monitor = constraints.monitor();
        for phase in &self.phases {
            for (k, &time_s) in phase.time_s.iter().enumerate() {
                monitor.record(phase.name, time_s, &phase.sample(k));
            }
        }
        Ok(monitor.worst.into_values().collect())
    }

    /// The tip's largest speed in the strike and outside it (m/s), from the joint angles and velocities.
    ///
    /// # Errors
    /// An arm model that cannot be built.
    pub fn tip_speeds_m_s(&self) -> Result<[f64; 2]> {
        let mounted = self.mounted_arm()?;
        let mut fastest = [0.0_f64; 2];
        for phase in &self.phases {
            let which = usize::from(phase.name != PhaseName::Strike);
            for k in 0..phase.time_s.len() {
                let speed_m_s = mounted.arm.tip_velocity(&phase.sample(k)).norm();
                fastest[which] = fastest[which].max(speed_m_s);
            }
        }
        Ok(fastest)
    }
}

impl Phase {
    /// Derives velocities and accelerations again from the angles and compares them with those of the file.
    fn check_derivatives(&self, joints: usize) -> Result<()> {
        for k in 1..self.time_s.len() - 1 {
            let steps_s = [self.time_s[k] - self.time_s[k - 1], self.time_s[k + 1] - self.time_s[k]];
            for joint in 0..joints {
                let [before, now, after] = [k - 1, k, k + 1].map(|k| self.q_rad[k][joint]);
                let slopes = [(now - before) / steps_s[0], (after - now) / steps_s[1]];
                let both_s = steps_s[0] + steps_s[1];
                let speed_rad_s = (slopes[0] * steps_s[1] + slopes[1] * steps_s[0]) / both_s;
                let acceleration_rad_s2 = 2.0 * (slopes[1] - slopes[0]) / both_s;
                for (what, stated, derived, allowed) in [
                    ("qd_rad_s", self.qd_rad_s[k][joint], speed_rad_s, SPEED_RAD_S),
                    ("qdd_rad_s2", self.qdd_rad_s2[k][joint], acceleration_rad_s2, ACCELERATION_RAD_S2),
                ] {
                    if (stated - derived).abs() > allowed {
                        let name = format!("command: {}", self.name.label());
                        let found = format!("{stated:.4} at {:.3} s", self.time_s[k]);
                        let needed = format!("the derivative of the angles, {derived:.4}");
                        return Err(Error::invalid(name, what, found, needed));
                    }
                }
            }
        }
        let last = self.time_s.len() - 1;
        for (end, next) in [(0, 1), (last, last - 1)] {
            let pairs = self.qdd_rad_s2[end].iter().zip(&self.qdd_rad_s2[next]);
            let jump = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if jump > END_JUMP_RAD_S2 {
                let name = format!("command: {}", self.name.label());
                let found = format!("{jump:.4} rad/s2 off its neighbour's at an end");
                return Err(Error::invalid(name, "qdd_rad_s2", found, "accelerations without jumps"));
            }
        }
        Ok(())
    }

    /// Checks the samples of one phase.
    fn check(&self, joints: usize) -> Result<()> {
        let name = || format!("command: {}", self.name.label());
        let bad = |what: &str, found: String, needed: &str| Err(Error::invalid(name(), what, found, needed));
        let count = self.time_s.len();
        let tables = [("q_rad", &self.q_rad), ("qd_rad_s", &self.qd_rad_s), ("qdd_rad_s2", &self.qdd_rad_s2)];
        for (what, rows) in tables {
            if rows.len() != count || count < 2 {
                return bad(what, format!("{} rows", rows.len()), "as many rows as times, and two or more");
            }
            if let Some(row) =
                rows.iter().find(|row| row.len() != joints || !row.iter().all(|x| x.is_finite()))
            {
                return bad(what, format!("a row {row:?}"), "one number per joint");
            }
        }
        for (k, pair) in self.time_s.windows(2).enumerate() {
            let step_s = pair[1] - pair[0];
            if !(step_s > 0.0 && step_s <= STEP_S) {
                return bad(
                    "time_s",
                    format!("{step_s} s between two samples"),
                    "more than 0 and at most 0.002 s",
                );
            }
            for joint in 0..joints {
                let slope = f64::midpoint(self.qd_rad_s[k][joint], self.qd_rad_s[k + 1][joint]);
                let off_rad = self.q_rad[k + 1][joint] - self.q_rad[k][joint] - slope * step_s;
                if off_rad.abs() > SLOPE_RAD {
                    let found =
                        format!("{off_rad:.1e} rad off the integral of its velocity at {:.3} s", pair[1]);
                    return bad("q_rad", found, "angles whose slope is the velocity");
                }
            }
        }
        self.check_derivatives(joints)?;
        for row in [&self.qd_rad_s[0], &self.qd_rad_s[count - 1]] {
            if row.iter().any(|speed| speed.abs() > JOINT_TOLERANCE) {
                return bad("qd_rad_s", format!("{row:?} at an end"), "rest at both ends");
            }
        }
        Ok(())
    }
}
