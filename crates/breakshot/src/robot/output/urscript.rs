//! The strike as a URScript program for arms of Universal Robots.

use crate::error::{Error, Result};
use crate::robot::command::Command;
use crate::robot::phase::PhaseName;
use std::fmt::Write;

impl Command {
    /// A URScript program: approach, lowering, the strike as one `movel`, draw-back, raising, return.
    ///
    /// Targets are joint angles, which do not depend on the controller's base frame or tool settings. The controller plans its
    /// own trapezoidal profile with the strike's largest acceleration, so that the tip has its speed at the contact.
    ///
    /// # Errors
    /// An arm without six joints.
    pub fn urscript(&self) -> Result<String> {
        /// Acceleration and speed of the straight transfers (m/s2, m/s).
        const SLOW: &str = "a=0.5, v=0.1";
        /// Acceleration and speed of the joint-space motions (rad/s2, rad/s).
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
