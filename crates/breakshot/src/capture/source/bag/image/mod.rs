//! The luma of the images in messages.

mod bayer;
pub(super) mod compressed;
pub(super) mod pixels;
pub(super) mod video;
