//! The program beside others.

pub(crate) mod decode;
pub(crate) mod physics;
