//! Which results of a rollout does a caller get?

pub(crate) mod mjcf;
pub(crate) mod near_miss;
pub(crate) mod outcome;
pub(crate) mod recorder;
pub(crate) mod segments;
pub(crate) mod thinning;
pub(crate) mod trajectory;
