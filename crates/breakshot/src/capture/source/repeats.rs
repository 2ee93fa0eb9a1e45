//! Does the film show the same picture twice while things move?
//!
//! A film that was re-timed (30 to 60 frames a second) stands still every second frame; speeds read from it are wrong.

use crate::capture::{Frame, GreyImage};

/// Pictures are compared block by block: this wide, and as high, of which every [`ROW_STEP`]th row is looked at.
const BLOCK_PX: usize = 16;
const ROW_STEP: usize = 4;
/// Something moves where a block changes by this mean grey difference: noise and coding change a block by less.
const MOVING: f64 = 4.0;
/// A repeated picture changes by less than this part of the change before and behind it.
const STILL_SHARE: f64 = 0.25;
/// How many frames before and behind are looked at for motion (24 to 60 frames a second repeats up to twice).
const NEIGHBOURS: usize = 3;

/// Watches a film go by.
#[derive(Debug, Default)]
pub(crate) struct Repeats {
    last: Vec<u8>,
    /// Of each frame its time (s) and the greatest change of a block since the frame before.
    changes: Vec<(f64, f64)>,
}

impl Repeats {
    /// Looks at the next frame.
    pub(crate) fn see(&mut self, frame: &Frame) {
        let rows = sampled_rows(&frame.image);
        let change = if rows.len() == self.last.len() {
            greatest_change(&self.last, &rows, frame.image.width)
        } else {
            0.0
        };
        self.changes.push((frame.time_s, change));
        self.last = rows;
    }

    /// What the user should know, once all frames went by.
    pub(crate) fn warning(&self) -> Option<String> {
        let moving = self.changes.iter().filter(|(_, change)| *change >= MOVING).count();
        let repeated: Vec<usize> = (1..self.changes.len()).filter(|&n| self.is_repeat(n)).collect();
        let first = repeated.first()?;
        let (count, span) = (repeated.len(), repeated.len() + moving);
        let frames = self.changes.len();
        let rate = if 20 * count < span {
            String::new()
        } else {
            let share = count as f64 / span as f64;
            let often = if share > 0.4 {
                "every second frame".into()
            } else {
                format!("{:.0} % of them", 100.0 * share)
            };
            format!(
                ": while things move, {often} repeats, so the film was re-timed and speeds read from it are wrong"
            )
        };
        let time_s = self.changes[*first].0;
        Some(format!("{count} of {frames} frames repeat the one before (first at {time_s:.3} s){rate}"))
    }

    /// Whether frame `n` stands still between frames that move.
    fn is_repeat(&self, n: usize) -> bool {
        let greatest =
            |frames: &[(f64, f64)]| frames.iter().fold(0.0, |most: f64, (_, change)| most.max(*change));
        let before = greatest(&self.changes[n.saturating_sub(NEIGHBOURS)..n]);
        let behind = greatest(&self.changes[n + 1..(n + 1 + NEIGHBOURS).min(self.changes.len())]);
        let motion = before.min(behind);
        motion >= MOVING && self.changes[n].1 <= STILL_SHARE * motion
    }
}

/// Every [`ROW_STEP`]th row.
fn sampled_rows(image: &GreyImage) -> Vec<u8> {
    image.pixels.chunks(image.width.max(1)).step_by(ROW_STEP).flatten().copied().collect()
}

/// The greatest mean difference of a block between two pictures' sampled rows.
fn greatest_change(before: &[u8], now: &[u8], width: usize) -> f64 {
    let rows = BLOCK_PX / ROW_STEP;
    let mut sums = vec![0_u32; width.div_ceil(BLOCK_PX)];
    let mut greatest = 0;
    for (band_before, band_now) in before.chunks(rows * width).zip(now.chunks(rows * width)) {
        sums.fill(0);
        for (row_before, row_now) in band_before.chunks(width).zip(band_now.chunks(width)) {
            let blocks = row_before.chunks(BLOCK_PX).zip(row_now.chunks(BLOCK_PX));
            for (sum, (a, b)) in sums.iter_mut().zip(blocks) {
                *sum += a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum::<u32>();
            }
        }
        greatest = greatest.max(sums.iter().copied().max().unwrap_or(0));
    }
    f64::from(greatest) / (rows * BLOCK_PX) as f64
}
