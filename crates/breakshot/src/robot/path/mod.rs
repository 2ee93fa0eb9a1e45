//! From the strike to the arm's joint path, checked against all limits.

mod assembly;
mod failure;
pub(crate) mod joint_path;
mod limit_monitor;
pub(crate) mod limits;
mod profile;
mod recheck;
pub(crate) mod safety;
pub(crate) mod search;
pub(crate) mod striker_path;
pub(crate) mod tool_solid;
