//! What do the first frames show, as long as nothing moves?

use crate::capture::{Frame, GreyImage};
use crate::error::{Error, Result};

/// The first frames are averaged against noise, as long as nothing moves.
const OPENING_FRAMES: usize = 5;
/// The first frames, as long as they show the same.
pub(super) fn opening(clip: &str, frames: &mut dyn Iterator<Item = Result<Frame>>) -> Result<Vec<Frame>> {
    let first = frames.next().ok_or_else(|| Error::Markers {
        clip: clip.into(),
        found: "no frame".into(),
        needed: "a film or a picture".into(),
    })??;
    let mut opening = vec![first];
    while opening.len() < OPENING_FRAMES {
        let Some(frame) = frames.next() else { break };
        let frame = frame?;
        let still = same_picture(&opening[0].image, &frame.image);
        opening.push(frame);
        if !still {
            break;
        }
    }
    Ok(opening)
}

/// Blocks of this side (px) are compared by their means, which noise leaves within a level or two.
const STILL_BLOCK_PX: usize = 16;
const STILL_LEVELS: u32 = 6;

fn same_picture(one: &GreyImage, other: &GreyImage) -> bool {
    let rows = one.pixels.chunks_exact(one.width).zip(other.pixels.chunks_exact(other.width));
    rows.step_by(STILL_BLOCK_PX).all(|(a, b)| {
        a.chunks_exact(STILL_BLOCK_PX).zip(b.chunks_exact(STILL_BLOCK_PX)).all(|(a, b)| {
            let sum = |row: &[u8]| row.iter().map(|&p| u32::from(p)).sum::<u32>();
            sum(a).abs_diff(sum(b)) < STILL_LEVELS * STILL_BLOCK_PX as u32
        })
    })
}

/// The mean picture of all frames but a last one that differs.
pub(super) fn mean(frames: &[Frame]) -> GreyImage {
    let first = &frames[0].image;
    let still = frames.iter().take_while(|f| same_picture(first, &f.image)).count().max(1);
    let mut sums = vec![(still / 2) as u16; first.pixels.len()];
    for frame in &frames[..still] {
        for (sum, &p) in sums.iter_mut().zip(&frame.image.pixels) {
            *sum += u16::from(p);
        }
    }
    // Whole numbers this small are divided exactly, and many at a time.
    let count = still as f32;
    GreyImage { pixels: sums.into_iter().map(|sum| (f32::from(sum) / count) as u8).collect(), ..*first }
}
