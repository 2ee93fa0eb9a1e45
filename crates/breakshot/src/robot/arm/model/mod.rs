//! What an arm is made of: links, joints, limits, inertias and shapes.

pub(crate) mod capsule;
pub(crate) mod frame;
mod indy7;
pub(crate) mod inertia;
pub(crate) mod serial_arm;
mod source;
mod urdf;
