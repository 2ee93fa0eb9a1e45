//! The strike as a URScript program for arms of Universal Robots.

use crate::error::{Error, Result};
use crate::robot::arm::model::serial_arm::Arm;
use crate::robot::command::Command;
use crate::robot::path::joint_path::tip_travel_m;
use crate::robot::path::safety::SLOW_M_S;
use crate::robot::phase::{Phase, PhaseName};
use std::fmt::Write;

/// Acceleration and speed of the straight transfers (m/s2, m/s).
const SLOW: &str = "a=0.5, v=0.1";
/// Acceleration of the joint-space motions (rad/s2), and their largest speed (rad/s).
const JOINT_RAD_S2: f64 = 0.8;
const JOINT_RAD_S: f64 = 0.5;
/// Fraction of the tip's speed limit that joint-space motions use, so that the rounded speed is below it.
const SPEED_FRACTION: f64 = 0.99;
/// Largest deviation from home at the start of the program (rad): further away, no path to the first target was checked.
const AT_HOME_RAD: f64 = 0.02;

impl Command {
    /// A URScript program: approach, lowering, the strike as one `movel`, draw-back, raising, return.
    ///
    /// Targets are joint angles, which do not depend on the controller's base frame or tool settings. Joint-space motions pass
    /// the same detours as the checked path, and the tip exceeds 0.25 m/s in the strike alone. The controller plans its own
    /// trapezoidal profile with the strike's largest acceleration, so that the tip has its speed at the contact. The program
    /// ends with a message if the arm is not at its home pose.
    ///
    /// # Errors
    /// An arm without six joints, or whose model cannot be built.
    pub fn urscript(&self) -> Result<String> {
        if self.joints.len() != 6 {
            return Err(Error::invalid(&self.arm, "joints", self.joints.len(), "six, for URScript"));
        }
        let mounted = self.mounted_arm()?;
        let mut text = String::from("def breakshot_strike():\n");
        let Some(home) = self.phases.first().and_then(|phase| phase.q_rad.first()) else {
            return Err(Error::invalid(&self.arm, "phases", "none", "the phases of a command"));
        };
        text += &at_home(home);
        for phase in &self.phases {
            let Some(target) = phase.q_rad.last() else { continue };
            let angles = list(target);
            let _ = match phase.name {
                PhaseName::Approach | PhaseName::Home => {
                    text += &joint_moves(&mounted.arm, phase);
                    Ok(())
                }
                PhaseName::Lower | PhaseName::Raise => writeln!(text, "  movel({angles}, {SLOW})"),
                PhaseName::Strike => {
                    let (a, v) = (self.stroke.acceleration_m_s2, self.strike.speed_m_s);
                    writeln!(text, "  sleep(0.5)\n  movel({angles}, a={a}, v={v})")
                }
                PhaseName::DrawBack => {
                    writeln!(text, "  movel({angles}, a=0.8, v={})", self.stroke.draw_back_m_s.min(SLOW_M_S))
                }
            };
        }
        text.push_str("end\n");
        Ok(text)
    }
}

fn list(angles_rad: &[f64]) -> String {
    let angles: Vec<String> = angles_rad.iter().map(|q| format!("{q:.9}")).collect();
    format!("[{}]", angles.join(", "))
}

/// Ends the program unless the arm is at its home pose.
fn at_home(home_rad: &[f64]) -> String {
    let away = (0..home_rad.len()).map(|k| format!("norm(now[{k}] - home[{k}]) > {AT_HOME_RAD}"));
    let away: Vec<String> = away.collect();
    format!(
        "  home = {}\n  now = get_actual_joint_positions()\n  if {}:\n    popup(\"the arm is not at the strike's home pose\", \
         error=True, blocking=True)\n    halt\n  end\n",
        list(home_rad),
        away.join(" or ")
    )
}

/// The motions of a phase in joint space, from one pose of rest to the next.
fn joint_moves(arm: &Arm, phase: &Phase) -> String {
    let mut text = String::new();
    let mut from = &phase.q_rad[0];
    for k in 1..phase.q_rad.len() {
        let at_rest = phase.qd_rad_s[k].iter().all(|speed| speed.abs() < REST_RAD_S);
        if at_rest || k + 1 == phase.q_rad.len() {
            let to = &phase.q_rad[k];
            // `v` is the speed of the joint that moves most; the others are slower in proportion.
            let offsets = from.iter().zip(to).map(|(from, to)| to - from).collect::<Vec<f64>>();
            let most_rad = offsets.iter().fold(0.0, |most: f64, offset| most.max(offset.abs()));
            let by_tip = SPEED_FRACTION * SLOW_M_S * most_rad / tip_travel_m(arm, from, &offsets);
            let v = JOINT_RAD_S.min(by_tip);
            let _ = writeln!(text, "  movej({}, a={JOINT_RAD_S2}, v={v:.6})", list(to));
            from = to;
        }
    }
    text
}

/// Joint speeds below this are rest: rounding of the end of a profile (rad/s).
const REST_RAD_S: f64 = 1e-9;
