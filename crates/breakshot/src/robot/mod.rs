//! How does the arm carry out the strike?
//!
//! An [`Arm`] comes from a URDF file or is the built-in Indy 7.  It knows its kinematics, its dynamics and what
//! impulse its tip can give in which direction (Eq. 8, Fig. 10).  [`command()`] turns a strike into a joint path that
//! keeps all of the arm's limits, or says which one it cannot keep.

mod body;
mod capsule;
mod checks;
mod command;
mod course;
mod dynamics;
mod ellipsoid;
mod export;
mod failure;
mod figure;
mod indy7;
mod inverse;
mod kinematics;
mod model;
mod motion;
mod path;
mod posture;
mod profile;
mod recording;
mod review;
mod safety;
#[cfg(test)]
mod tests;
mod touch;
mod urdf;

pub use body::Body;
pub use checks::{Check, Limits, Quantity};
pub use command::{Command, JointState, Phase, PhaseName, Stroke};
pub use ellipsoid::{Direction, HeadingImpulse, Hit, ImpulseGeometry};
pub use export::{FollowJointTrajectory, JointTrajectory, RosDuration, TrajectoryPoint};
pub use figure::impulse_figure;
pub use kinematics::Jacobian;
pub use model::{Arm, Base, Capsule, Joint, Link, Tool};
pub use posture::{Capability, Station};
pub use recording::{Level, Recording};
pub use safety::{ContactSpeed, SLOW_M_S};
pub use touch::{Touch, TouchFit, base_from_table};

use crate::cell::Cell;
use crate::error::{Error, Result};
use crate::scene::{Scene, Strike};
use serde::{Deserialize, Serialize};

/// A rigid motion: `parent_from_joint * point_in_joint` is the point in the parent's frame.
pub type Frame = nalgebra::IsometryMatrix3<f64>;

/// How to command.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// What the arm may use of what it can.
    pub limits: Limits,
}

/// Whether the arm can carry out the strike.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// It can: this is how.
    Ready(Box<Command>),
    /// It cannot: this is why.
    Refused(Refusal),
}

/// Why the arm cannot carry out a strike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refusal {
    /// The limit that the best attempt breaks, what was found and what is allowed.
    pub reason: String,
    /// The joint or part of the arm that is to blame, if one is.
    pub part: Option<String>,
    /// The fastest strike on this line that no joint is too slow for (m/s), if the line can be reached.
    pub fastest_m_s: Option<f64>,
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
    path::command(cell, strike, scene, &options.limits)
}
