//! The striker of a clip: its prescribed motion, and its impacts after the first one.

pub(crate) mod further_strikes;
pub(crate) mod path;
