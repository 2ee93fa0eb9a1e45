//! How large may a film and its frames be?

use super::error::SourceError;

/// The longest side of a frame (px); a header with a larger number is damaged or would need too much memory.
pub(super) const MAX_SIDE_PX: u64 = 16_384;
/// The largest frame (px); an 8K frame has 33 million pixels.
const MAX_PIXELS: u64 = 40_000_000;
/// The longest film: two hours at 240 frames a second.
pub(super) const MAX_FRAMES: u64 = 2_000_000;

/// An error unless frames of this size (px) can be processed.
pub(super) fn check_size(width: u64, height: u64) -> Result<(), SourceError> {
    let sides = 1..=MAX_SIDE_PX;
    if sides.contains(&width) && sides.contains(&height) && width * height <= MAX_PIXELS {
        return Ok(());
    }
    Err(SourceError::unsuitable(
        format!("pictures of {width} x {height} px"),
        format!("1 to {MAX_SIDE_PX} px a side and at most {} million pixels", MAX_PIXELS / 1_000_000),
    ))
}
