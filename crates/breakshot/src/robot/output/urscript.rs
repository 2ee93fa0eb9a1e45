//! The strike as a URScript program for arms of Universal Robots.

use crate::error::{Error, Result};
use crate::robot::command::Command;
use crate::robot::phase::PhaseName;
use std::fmt::Write;

impl Command {
    /// A URScript program: to the start of the run-up, the strike as one `movel`, back, up, home.
    ///
    /// Targets are joint angles, which do not depend on the controller's base frame or tool settings.  The controller plans
    /// its own trapezoid: its acceleration is the strike's largest, so that it gains its speed before and brakes after the
    /// contact as planned.
    ///
    /// # Errors
    /// An arm without six joints.
    pub fn urscript(&self) -> Result<String> {
        /// The slow parts (m/s, m/s2) and the joint moves (rad/s, rad/s2).
        const SLOW: &str = "a=0.5, v=0.1";
        const JOINTS: &str = "a=0.8, v=0.5";
        if self.joints.len() != 6 {
            return Err(Error::invalid(&self.arm, "joints", self.joints.len(), "six, for URScript"));
        }
        let mut text = String::from("def breakshot_strike():\n");
        for phase in &self.phases {
            let Some(target) = phase.q_rad.last() else { continue };
            let angles: Vec<String> = target.iter().map(|q| format!("{q:.9}")).collect();
            let angles = format!("[{}]", angles.join(", "));
            let _ = match phase.name {
                PhaseName::Approach | PhaseName::Home => writeln!(text, "  movej({angles}, {JOINTS})"),
                PhaseName::Lower | PhaseName::Raise => writeln!(text, "  movel({angles}, {SLOW})"),
                PhaseName::Strike => {
                    let (a, v) = (self.stroke.acceleration_m_s2, self.strike.speed_m_s);
                    writeln!(text, "  sleep(0.5)\n  movel({angles}, a={a}, v={v})")
                }
                PhaseName::DrawBack => {
                    writeln!(text, "  movel({angles}, a=0.8, v={})", self.stroke.draw_back_m_s)
                }
            };
        }
        text.push_str("end\n");
        Ok(text)
    }
}
