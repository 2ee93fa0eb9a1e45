//! The arm: its model, its kinematics and dynamics, and what it can do at its table.

pub(crate) mod base_registration;
mod dynamics;
pub(crate) mod ik_solution;
pub(crate) mod impulse_geometry;
mod inverse;
pub(crate) mod joint_state;
pub(crate) mod kinematics;
pub(crate) mod model;
pub(crate) mod mounted_arm;
pub(crate) mod self_collision;
