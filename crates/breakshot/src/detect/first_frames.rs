//! What do the first frames of a clip show, as long as nothing moves?
//!
//! Their mean has less noise than one frame, which makes the initial identification of the objects more reliable.

use crate::capture::{Frame, GreyImage};
use crate::error::{Error, Result};

/// At most this many frames are averaged.
pub(super) const MOST_FRAMES: usize = 5;
/// Side of the blocks whose means are compared between frames (px), and the difference from which something has moved
/// (grey levels): noise leaves the mean of a block within one or two levels.
const BLOCK_PX: usize = 16;
const MOTION_LEVELS: u32 = 6;

/// The first frames up to and including the first one that differs from the very first.
///
/// # Errors
/// A film without frames, and frames that cannot be decoded.
pub(super) fn first_frames(
    clip: &str,
    frames: &mut dyn Iterator<Item = Result<Frame>>,
) -> Result<Vec<Frame>> {
    let first = frames.next().ok_or_else(|| Error::Markers {
        clip: clip.into(),
        found: "no frame".into(),
        needed: "a film or a picture".into(),
    })??;
    let mut collected = vec![first];
    while collected.len() < MOST_FRAMES {
        let Some(frame) = frames.next() else { break };
        let frame = frame?;
        let still = is_same_image(&collected[0].image, &frame.image);
        collected.push(frame);
        if !still {
            break;
        }
    }
    Ok(collected)
}

/// Whether the block means of two images of equal size agree within [`MOTION_LEVELS`], in every 16th row.
fn is_same_image(one: &GreyImage, other: &GreyImage) -> bool {
    let rows = one.pixels.chunks_exact(one.width).zip(other.pixels.chunks_exact(other.width));
    rows.step_by(BLOCK_PX).all(|(a, b)| {
        a.chunks_exact(BLOCK_PX).zip(b.chunks_exact(BLOCK_PX)).all(|(a, b)| {
            let sum = |row: &[u8]| row.iter().map(|&p| u32::from(p)).sum::<u32>();
            sum(a).abs_diff(sum(b)) < MOTION_LEVELS * BLOCK_PX as u32
        })
    })
}

/// The mean image of the leading frames that show the same as the first one.
pub(super) fn mean_image(frames: &[Frame]) -> GreyImage {
    let first = &frames[0].image;
    let still = frames.iter().take_while(|f| is_same_image(first, &f.image)).count().max(1);
    let mut sums = vec![(still / 2) as u16; first.pixels.len()];
    for frame in &frames[..still] {
        for (sum, &p) in sums.iter_mut().zip(&frame.image.pixels) {
            *sum += u16::from(p);
        }
    }
    // Single precision divides integers of this size exactly and vectorises.
    let count = still as f32;
    GreyImage { pixels: sums.into_iter().map(|sum| (f32::from(sum) / count) as u8).collect(), ..*first }
}
