//! How large a film and its pictures may be.

use super::error::Refusal;

/// No side of a picture is longer: a header that says more lies, or asks for more memory than is sane.
const MAX_SIDE_PX: u64 = 16_384;
/// No picture is larger (an 8K picture has 33 million pixels).
pub(super) const MAX_PIXELS: u64 = 40_000_000;
/// No film is longer: two hours at 240 frames a second.
pub(super) const MAX_FRAMES: u64 = 2_000_000;

/// An error unless a picture of this size can be worked on.
pub(super) fn check_size(width: u64, height: u64) -> Result<(), Refusal> {
    let sane = 1..=MAX_SIDE_PX;
    if sane.contains(&width) && sane.contains(&height) && width * height <= MAX_PIXELS {
        return Ok(());
    }
    Err(Refusal::unfit(
        format!("pictures of {width} x {height} px"),
        format!("1 to {MAX_SIDE_PX} px a side and at most {} million pixels", MAX_PIXELS / 1_000_000),
    ))
}
