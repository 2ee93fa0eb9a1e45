//! The striker of a clip: its prescribed motion, and its impacts after the first one.

mod further_strikes;
pub(crate) mod path;
