//! How does the arm execute the strike?
//!
//! An [`Arm`] is read from a URDF or is the built-in Indy 7. `arm/` computes its kinematics, its dynamics and the impulse that
//! its tip can transfer in each direction (Eq. 8, Fig. 10); `path/` searches for a joint path of the strike within all
//! limits of the arm; `output/` writes it in the formats of other programs. [`command()`] returns the joint path, or the limit
//! that every attempt breaks.

mod arm;
mod command;
mod output;
mod path;
mod phase;
mod striker_mass;
#[cfg(test)]
mod tests;

pub use arm::base_registration::{BaseRegistration, TouchedPoint, base_registration};
pub use arm::ik_solution::Capability;
pub use arm::impulse_geometry::{Direction, HeadingImpulse, ImpulseConditions, ImpulseGeometry};
pub use arm::joint_state::JointState;
pub use arm::kinematics::Jacobian;
pub use arm::model::capsule::Capsule;
pub use arm::model::frame::Frame;
pub use arm::model::inertia::LinkInertia;
pub use arm::model::serial_arm::{Arm, Base, Joint, Link, Tool};
pub use arm::mounted_arm::MountedArm;
pub use command::{Answer, Command, Refusal, Stroke};
pub use output::impulse_figure::impulse_figure;
pub use output::impulse_map::impulse_map;
pub use output::recording::{LogLevel, Recording};
pub use output::ros::{FollowJointTrajectory, JointTolerance, JointTrajectory, RosDuration, TrajectoryPoint};
pub use path::limits::{FASTEST_M_S, LimitCheck, LimitedQuantity, Limits};
pub use path::safety::{ContactSpeed, SLOW_M_S};
pub(crate) use path::striker_path::least_follow_through_m;
pub use phase::{Phase, PhaseName};

use crate::cell::Cell;
use crate::error::Result;
use crate::scene::{Scene, Strike};

/// Options of [`command()`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// The limits of the path.
    pub limits: Limits,
}

/// The joint path of a strike, checked against all limits every 2 ms.
///
/// With a `scene`, the run-up avoids its objects and the deceleration starts after the contact.
///
/// # Errors
/// A cell without an arm, an arm that cannot be read, a strike faster than [`FASTEST_M_S`] or starting inside an object. A
/// strike that the arm cannot execute is an answer, not an error.
///
/// ```
/// use breakshot::cell::{Cell, RobotSpec, Striker, Transform, Workspace};
/// use breakshot::geometry::Point;
/// use breakshot::robot::{self, Answer};
/// use breakshot::scene::Strike;
///
/// let striker = Striker::rod(0.015, [0.05, 1.0]);
/// let mut cell = Cell::from_above(1000.0, Workspace::centred([0.6, 0.4]), striker);
/// cell.robot = Some(RobotSpec {
///     arm: "indy7".into(),
///     base_from_table: Some(Transform { position_m: [0.45, 0.0, 0.0], rpy_rad: [0.0, 0.0, 1.5708] }),
///     tool_offset_m: [0.0, 0.0, 0.15],
///     ..RobotSpec::default()
/// });
/// let start_m = Point::new(-0.1, 0.0);
/// let strike = Strike { object: None, start_m, heading_rad: 0.0, speed_m_s: 0.3, travel_m: 0.08 };
/// let answer = robot::command(&cell, &strike, None, &robot::Options::default())?;
/// let Answer::Ready(command) = answer else { panic!("refused: {answer:?}") };
/// assert!((command.stroke.contact_speed_m_s - 0.3).abs() < 0.003, "{} m/s", command.stroke.contact_speed_m_s);
/// # Ok::<(), breakshot::Error>(())
/// ```
pub fn command(cell: &Cell, strike: &Strike, scene: Option<&Scene>, options: &Options) -> Result<Answer> {
    MountedArm::of_cell(cell)?.command(cell, strike, scene, &options.limits)
}
