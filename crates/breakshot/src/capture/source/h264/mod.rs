//! H.264 pictures by the built-in decoder.

mod bitstream;
pub(super) mod config;
pub(super) mod decoder;
mod slice_header;
