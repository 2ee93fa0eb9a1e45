//! The commands that turn a planned strike into a motion of the arm.

pub(crate) mod command;
pub(crate) mod strike;
mod touch;
