//! Where is a sliding body between two impacts?

pub(crate) mod body;
pub(crate) mod limit_surface;
pub(crate) mod motion;
pub(crate) mod patch_friction;
pub(crate) mod slide_curve;
