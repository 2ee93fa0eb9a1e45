//! How does the arm carry out the strike?
//!
//! An [`Arm`] comes from a URDF file or is the built-in Indy 7.  It knows its kinematics, its dynamics and what
//! impulse its tip can give in which direction (Eq. 8, Fig. 10).

mod body;
mod dynamics;
mod indy7;
mod inverse;
mod kinematics;
mod model;
mod urdf;

pub use body::Body;
pub use kinematics::Jacobian;
pub use model::{Arm, Base, Capsule, Joint, Link, Tool};

/// A rigid motion: `parent_from_joint * point_in_joint` is the point in the parent's frame.
pub type Frame = nalgebra::IsometryMatrix3<f64>;
