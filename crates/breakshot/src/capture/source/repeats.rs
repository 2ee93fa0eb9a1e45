//! Does the film show the same picture twice while things move?
//!
//! A film that was re-timed (30 to 60 frames a second) stands still every second frame; speeds read from it are wrong.

use super::timestamps;
use crate::capture::image::Frame;

/// Pictures are compared block by block: this wide, and as high, of which every [`ROW_STEP`]th row is looked at.
const BLOCK_PX: usize = 16;
const ROW_STEP: usize = 4;
/// Something moves where a block changes by this mean grey difference: noise and coding change a block by less.
const MOVING: f64 = 4.0;
/// A repeated picture changes by less than this part of the change before and behind it.
const STILL_SHARE: f64 = 0.25;
/// Motion before and behind is of a kind: the lesser is more than this part of the greater.
const STEADY_SHARE: f64 = 0.25;
/// How many frames before and behind are looked at for motion (24 to 60 frames a second repeats up to twice).
const NEIGHBOURS: usize = 3;

/// So many repeats, and such a share of the frames between the first and the last one, make a film re-timed.
const RETIMED_COUNT: usize = 4;
const RETIMED_SHARE: f64 = 0.05;

/// Watches a film go by.
#[derive(Debug, Default)]
pub(crate) struct Repeats {
    /// The step of the film's clock (s), if the frames' times are only known once they come.
    tick_s: Option<f64>,
    /// The rows that are looked at, of the last frame and of this one.
    last: Vec<u8>,
    rows: Vec<u8>,
    /// Of each frame its time (s) and the greatest change of a block since the frame before.
    changes: Vec<(f64, f64)>,
}

impl Repeats {
    /// For a film whose times were not checked when it was opened, if there is a `tick_s`.
    pub(crate) fn new(tick_s: Option<f64>) -> Self {
        Self { tick_s, ..Self::default() }
    }

    /// Looks at the next frame.
    pub(crate) fn see(&mut self, frame: &Frame) {
        let width = frame.image.width.max(1);
        self.rows.clear();
        for row in frame.image.pixels.chunks(width).step_by(ROW_STEP) {
            self.rows.extend_from_slice(row);
        }
        let comparable = self.rows.len() == self.last.len();
        let change = if comparable { greatest_change(&self.last, &self.rows, width) } else { 0.0 };
        self.changes.push((frame.time_s, change));
        std::mem::swap(&mut self.last, &mut self.rows);
    }

    /// What the user should know, once all frames went by.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let times_s: Vec<f64> = self.changes.iter().map(|(time_s, _)| *time_s).collect();
        let odd = self.tick_s.map(|tick_s| timestamps::warnings(&times_s, tick_s));
        odd.unwrap_or_default().into_iter().chain(self.warning()).collect()
    }

    fn warning(&self) -> Option<String> {
        let repeated: Vec<usize> = (1..self.changes.len()).filter(|&n| self.is_repeat(n)).collect();
        let (&first, &last) = (repeated.first()?, repeated.last()?);
        let (count, frames, first_s) = (repeated.len(), self.changes.len(), self.changes[first].0);
        let share = (count - 1) as f64 / (last - first).max(1) as f64;
        let retimed = if count >= RETIMED_COUNT && share >= RETIMED_SHARE {
            self.retimed(share)
        } else {
            String::new()
        };
        Some(format!(
            "{count} of {frames} frames repeat the one before, the first at {first_s:.3} s{retimed}"
        ))
    }

    /// That a share of the frames repeats, and what that means.
    fn retimed(&self, share: f64) -> String {
        let often = match (100.0 * share).round() {
            46.0..=54.0 => "every second frame".into(),
            percent => format!("{percent} % of the frames"),
        };
        let rate_hz = self.changes.last().map_or(0.0, |(last_s, _)| (self.changes.len() - 1) as f64 / last_s);
        let filmed_hz = rate_hz * (1.0 - share);
        format!(
            " ({often} while things move): re-timed from about {filmed_hz:.0} to {rate_hz:.0} frames/s, so speeds read \
             from it are wrong"
        )
    }

    /// Whether frame `n` stands still between frames that move.
    fn is_repeat(&self, n: usize) -> bool {
        let greatest =
            |frames: &[(f64, f64)]| frames.iter().fold(0.0, |most: f64, (_, change)| most.max(*change));
        let before = greatest(&self.changes[n.saturating_sub(NEIGHBOURS)..n]);
        let behind = greatest(&self.changes[n + 1..(n + 1 + NEIGHBOURS).min(self.changes.len())]);
        let (least, most) = (before.min(behind), before.max(behind));
        least >= MOVING && least >= STEADY_SHARE * most && self.changes[n].1 <= STILL_SHARE * least
    }
}

/// The greatest mean difference of a block between two pictures' sampled rows.
fn greatest_change(before: &[u8], now: &[u8], width: usize) -> f64 {
    let rows = BLOCK_PX / ROW_STEP;
    let mut sums = vec![0_u32; width.div_ceil(BLOCK_PX)];
    let mut greatest = 0;
    for (band_before, band_now) in before.chunks(rows * width).zip(now.chunks(rows * width)) {
        sums.fill(0);
        for (row_before, row_now) in band_before.chunks(width).zip(band_now.chunks(width)) {
            let ((whole_before, rest_before), (whole_now, rest_now)) =
                (row_before.as_chunks::<BLOCK_PX>(), row_now.as_chunks::<BLOCK_PX>());
            let mut sums = sums.iter_mut();
            for ((a, b), sum) in whole_before.iter().zip(whole_now).zip(sums.by_ref()) {
                *sum += difference(a, b);
            }
            if let Some(last) = sums.next() {
                *last += difference(rest_before, rest_now);
            }
        }
        greatest = greatest.max(sums.iter().copied().max().unwrap_or(0));
    }
    f64::from(greatest) / (rows * BLOCK_PX) as f64
}

/// The sum of the absolute differences; of a block's fixed length a few instructions.
#[inline]
fn difference(one: &[u8], other: &[u8]) -> u32 {
    one.iter().zip(other).map(|(a, b)| u32::from(a.abs_diff(*b))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::image::GreyImage;

    /// A dark square at `x_px` on a grainy table.
    fn frame(n: usize, x_px: usize) -> Frame {
        let (width, height) = (160, 96);
        let pixels = (0..width * height).map(|at| {
            let (x, y) = (at % width, at / width);
            let grain = (at * 7919 + n * 104_729) % 5;
            if (x_px..x_px + 20).contains(&x) && (40..60).contains(&y) { 30 } else { 180 + grain as u8 }
        });
        Frame { time_s: n as f64 / 60.0, image: GreyImage { width, height, pixels: pixels.collect() } }
    }

    fn said(places_px: impl Iterator<Item = usize>) -> Option<String> {
        let mut repeats = Repeats::default();
        places_px.enumerate().for_each(|(n, x_px)| repeats.see(&frame(n, x_px)));
        repeats.warning()
    }

    #[test]
    fn a_film_that_stands_still_every_second_frame_is_named() {
        let words = said((0..40).map(|n| 3 * (n / 2))).unwrap();
        assert!(words.contains("every second frame"), "said: {words}");
        assert!(words.contains("from about 30 to 60 frames/s"), "said: {words}");
    }

    #[test]
    fn one_repeated_frame_is_found() {
        let words = said((0..40).map(|n| if n < 20 { 3 * n } else { 3 * (n - 1) })).unwrap();
        assert!(words.starts_with("1 of 40 frames"), "said: {words}");
        assert!(words.contains("at 0.333 s") && !words.contains("re-timed"), "said: {words}");
    }

    #[test]
    fn an_object_at_rest_before_and_after_its_slide_repeats_nothing() {
        assert_eq!(said((0..60_usize).map(|n| n.clamp(20, 40) * 2)), None);
        assert_eq!(said((0..60).map(|_| 30)), None);
        assert_eq!(said(std::iter::once(30)), None);
    }
}
