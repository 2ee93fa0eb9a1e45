//! What does a caller get to see of a rollout?

pub(crate) mod mjcf;
pub(crate) mod near_miss;
pub(crate) mod outcome;
pub(crate) mod trajectory;
