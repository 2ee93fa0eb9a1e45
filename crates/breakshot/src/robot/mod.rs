//! How does the arm carry out the strike?
//!
//! An [`Arm`] comes from a URDF file or is the built-in Indy 7.  It knows its kinematics, its dynamics and what
//! impulse its tip can give in which direction (Eq. 8, Fig. 10).  [`command()`] turns a strike into a joint path that
//! keeps all of the arm's limits, or says which one it cannot keep.

mod arm;
mod command;
mod output;
mod path;
mod phase;
#[cfg(test)]
mod tests;

pub use arm::base_registration::{Touch, TouchFit, base_from_table};
pub use arm::ik_solution::Capability;
pub use arm::impulse_geometry::{Direction, HeadingImpulse, Hit, ImpulseGeometry};
pub use arm::joint_state::JointState;
pub use arm::kinematics::Jacobian;
pub use arm::model::capsule::Capsule;
pub use arm::model::frame::Frame;
pub use arm::model::inertia::Body;
pub use arm::model::serial_arm::{Arm, Base, Joint, Link, Tool};
pub use arm::mounted_arm::Station;
pub use command::{Answer, Command, Refusal, Stroke};
pub use output::impulse_figure::impulse_figure;
pub use output::recording::{Level, Recording};
pub use output::ros::{FollowJointTrajectory, JointTrajectory, RosDuration, TrajectoryPoint};
pub use path::limits::{Check, Limits, Quantity};
pub use path::safety::{ContactSpeed, SLOW_M_S};
pub use phase::{Phase, PhaseName};

use crate::cell::Cell;
use crate::error::{Error, Result};
use crate::scene::{Scene, Strike};

/// How to command.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// What the arm may use of what it can.
    pub limits: Limits,
}

/// The fastest that any strike may be (m/s): what the arm's maker allows its tip.
pub const FASTEST_M_S: f64 = 1.0;

/// The joint path of a strike, checked against all limits every 2 ms.
///
/// With a `scene` the path keeps clear of its objects until the contact, and the strike starts to slow down only after it.
///
/// # Errors
/// A cell without an arm, an arm that cannot be read, a strike faster than [`FASTEST_M_S`] or starting inside an
/// object; that the arm cannot carry it out is an answer, not an error.
pub fn command(cell: &Cell, strike: &Strike, scene: Option<&Scene>, options: &Options) -> Result<Answer> {
    strike.check("strike")?;
    if strike.speed_m_s > FASTEST_M_S {
        let needed = format!("at most {FASTEST_M_S} m/s");
        return Err(Error::invalid("strike", "speed_m_s", strike.speed_m_s, needed));
    }
    path::search::command(cell, strike, scene, &options.limits)
}
