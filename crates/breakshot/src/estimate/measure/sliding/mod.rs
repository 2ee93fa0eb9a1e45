//! What does one clip show of how the table brakes its objects, beside their friction?

pub(crate) mod drag;
pub(crate) mod support;
pub(crate) mod tilt;
