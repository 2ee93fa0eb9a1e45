//! A command that was read from a file, looked at again: a file can be damaged, edited or old.

use super::limit_monitor::Watch;
use super::limits::{Check, Limits};
use super::search::tip_box;
use crate::error::{Error, Result};
use crate::robot::arm::self_collision::SelfCollision;
use crate::robot::command::Command;
use crate::robot::phase::{Phase, PhaseName};
use std::collections::BTreeMap;

/// Samples are at most so far apart (s), but for rounding.
const STEP_S: f64 = 0.002 + 1e-9;
/// Phases join, and stand still at their ends, up to this (rad, rad/s).
const JOINED: f64 = 1e-6;
/// How far a step may be from what its speeds tell (rad): jerk makes up for 2e-6 at most.
const SLOPE_RAD: f64 = 1e-4;

impl Command {
    /// An error that names what is wrong unless the samples are one motion of this arm, from rest to rest in every phase.
    ///
    /// # Errors
    /// Missing or extra numbers, times that go back or leave gaps, jumps, speeds that are not the slope of the angles.
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
        let station = self.station()?;
        if station.arm().joint_names() != self.joints {
            return bad("joints", format!("{:?}", self.joints), "those of the arm");
        }
        for phase in &self.phases {
            phase.check(self.joints.len())?;
        }
        for pair in self.phases.windows(2) {
            let (before, after) = (pair[0].q_rad.len() - 1, &pair[1]);
            let apart = pair[0].q_rad[before].iter().zip(&after.q_rad[0]).map(|(a, b)| (a - b).abs());
            let gap_s = (after.time_s[0] - pair[0].span_s()[1]).abs();
            if apart.fold(gap_s, f64::max) > JOINED {
                return bad("phases", format!("a jump before the {}", after.name.text()), "phases that join");
            }
        }
        Ok(())
    }

    /// The worst of each quantity over all samples, worked out again with the usual limits; see [`Command::check`] first.
    ///
    /// # Errors
    /// An arm that cannot be read again, a command without a scene: then the workspace is not known.
    pub fn checked_again(&self) -> Result<Vec<Check>> {
        let station = self.station()?;
        let scene = self.scene.as_ref().ok_or_else(|| {
            Error::invalid("command", "scene", "missing", "what lies on the table, and its workspace")
        })?;
        let (limits, collision) =
            (Limits::default(), SelfCollision::of(&station.arm, station.striker.outer_radius_m()));
        let mut watch = Watch {
            arm: &station.arm,
            table_from_base: station.base_from_table.inverse(),
            collision: &collision,
            limits: &limits,
            tip_box: tip_box(&scene.cell),
            worst: BTreeMap::new(),
        };
        for phase in &self.phases {
            for (k, &time_s) in phase.time_s.iter().enumerate() {
                watch.look(phase.name, time_s, &phase.sample(k));
            }
        }
        Ok(watch.worst.into_values().collect())
    }

    /// The tip's largest speed in the strike, and in everything else (m/s), from the joints' angles and speeds.
    ///
    /// # Errors
    /// An arm that cannot be read again.
    pub fn tip_speeds_m_s(&self) -> Result<[f64; 2]> {
        let station = self.station()?;
        let mut fastest = [0.0_f64; 2];
        for phase in &self.phases {
            let which = usize::from(phase.name != PhaseName::Strike);
            for k in 0..phase.time_s.len() {
                let speed_m_s = station.arm.tip_velocity(&phase.sample(k)).norm();
                fastest[which] = fastest[which].max(speed_m_s);
            }
        }
        Ok(fastest)
    }
}

impl Phase {
    fn check(&self, joints: usize) -> Result<()> {
        let name = || format!("command: {}", self.name.text());
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
                    let found = format!("{off_rad:.1e} rad off its speed at {:.3} s", pair[1]);
                    return bad("q_rad", found, "angles whose slope is the speed");
                }
            }
        }
        for row in [&self.qd_rad_s[0], &self.qd_rad_s[count - 1]] {
            if row.iter().any(|speed| speed.abs() > JOINED) {
                return bad("qd_rad_s", format!("{row:?} at an end"), "rest at both ends");
            }
        }
        Ok(())
    }
}
