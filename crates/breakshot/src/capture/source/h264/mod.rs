//! H.264 by the built-in decoder.

mod bitstream;
mod catch_panic;
pub(super) mod decoder;
pub(super) mod parameters;
