//! The program beside others.

pub(crate) mod build;
pub(crate) mod decode;
pub(crate) mod detect;
mod films;
pub(crate) mod physics;
pub(crate) mod plan;

/// How often vision is timed; medians are printed.
const ROUNDS: usize = 7;
/// How often a build is timed; medians are printed.
const BUILDS: usize = 3;
