//! What the fitted motion of one clip measures: friction, restitution, mass ratios and contact friction.

pub(crate) mod contact;
pub(crate) mod contact_friction;
pub(crate) mod friction;
pub(crate) mod impulse_ratio;
pub(crate) mod quantity;
pub(crate) mod restitution;
pub(crate) mod screening;
