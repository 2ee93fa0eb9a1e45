//! How does the table brake the objects, over all clips?

pub(crate) mod friction;
pub(crate) mod support;
pub(crate) mod tilt;
