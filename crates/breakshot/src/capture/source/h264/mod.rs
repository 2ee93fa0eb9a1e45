//! H.264 pictures by the built-in decoder.

mod bitstream;
mod catch_panic;
pub(super) mod config;
pub(super) mod decoder;
mod slice_header;

pub use catch_panic::is_decoding;
