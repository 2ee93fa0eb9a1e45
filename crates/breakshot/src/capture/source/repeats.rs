//! Does the film repeat frames during motion?
//!
//! A film that was converted from 30 to 60 frames a second repeats every second frame; speeds measured in it are wrong.

use super::timestamps;
use crate::capture::image::Frame;

/// Side of the square blocks in which frames are compared (px); every [`ROW_STEP`]th row is used.
const BLOCK_PX: usize = 16;
const ROW_STEP: usize = 4;
/// Mean grey difference of a block that counts as motion: noise and coding cause smaller differences.
const MOVING: f64 = 4.0;
/// Largest change of a repeated frame, as a fraction of the change before and after it.
const STILL_FRACTION: f64 = 0.25;
/// Smallest ratio of the smaller to the larger change before and after a repeated frame.
const STEADY_FRACTION: f64 = 0.25;
/// Number of frames before and after that are searched for motion: converting 24 to 60 frames a second repeats a frame
/// up to twice.
const NEIGHBOURS: usize = 3;

/// Smallest number of repeats, and smallest fraction of them among the frames from the first to the last repeat, of a film
/// that is called re-timed.
const RETIMED_COUNT: usize = 4;
const RETIMED_FRACTION: f64 = 0.05;

/// Collects the changes from frame to frame of a film.
#[derive(Debug, Default)]
pub(crate) struct RepeatedFrames {
    /// The period of the film's clock (s), if the times are known only frame by frame.
    tick_s: Option<f64>,
    /// The sampled rows of the last frame and of this one.
    last: Vec<u8>,
    rows: Vec<u8>,
    /// Time (s) and largest change of a block since the previous frame, for each frame.
    changes: Vec<(f64, f64)>,
}

impl RepeatedFrames {
    /// With the clock's period `tick_s` for a film whose times have not been checked yet.
    pub(crate) fn new(tick_s: Option<f64>) -> Self {
        Self { tick_s, ..Self::default() }
    }

    /// Adds the next frame.
    pub(crate) fn push(&mut self, frame: &Frame) {
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

    /// The warnings about the film, after its last frame.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let times_s: Vec<f64> = self.changes.iter().map(|(time_s, _)| *time_s).collect();
        let irregular = self.tick_s.map(|tick_s| timestamps::warnings(&times_s, tick_s));
        irregular.unwrap_or_default().into_iter().chain(self.warning()).collect()
    }

    fn warning(&self) -> Option<String> {
        let repeated: Vec<usize> = (1..self.changes.len()).filter(|&n| self.is_repeat(n)).collect();
        let (&first, &last) = (repeated.first()?, repeated.last()?);
        let (count, frames, first_s) = (repeated.len(), self.changes.len(), self.changes[first].0);
        let fraction = (count - 1) as f64 / (last - first).max(1) as f64;
        let retimed = if count >= RETIMED_COUNT && fraction >= RETIMED_FRACTION {
            self.retimed(fraction)
        } else {
            String::new()
        };
        Some(format!(
            "{count} of {frames} frames repeat the one before, the first at {first_s:.3} s{retimed}"
        ))
    }

    /// The consequence of this fraction of repeated frames, for the warning.
    fn retimed(&self, fraction: f64) -> String {
        let often = match (100.0 * fraction).round() {
            46.0..=54.0 => "every second frame".into(),
            percent => format!("{percent} % of the frames"),
        };
        let rate_hz = self.changes.last().map_or(0.0, |(last_s, _)| (self.changes.len() - 1) as f64 / last_s);
        let filmed_hz = rate_hz * (1.0 - fraction);
        format!(
            " ({often} while things move): re-timed from about {filmed_hz:.0} to {rate_hz:.0} frames/s, so speeds read \
             from it are wrong"
        )
    }

    /// Whether frame `n` shows no motion between frames that do.
    fn is_repeat(&self, n: usize) -> bool {
        let greatest =
            |frames: &[(f64, f64)]| frames.iter().fold(0.0, |most: f64, (_, change)| most.max(*change));
        let before = greatest(&self.changes[n.saturating_sub(NEIGHBOURS)..n]);
        let after = greatest(&self.changes[n + 1..(n + 1 + NEIGHBOURS).min(self.changes.len())]);
        let (least, most) = (before.min(after), before.max(after));
        least >= MOVING && least >= STEADY_FRACTION * most && self.changes[n].1 <= STILL_FRACTION * least
    }
}

/// The largest mean grey difference of a block between the sampled rows of two frames.
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

/// The sum of the absolute differences; vectorized for the fixed length of a block.
#[inline]
fn difference(one: &[u8], other: &[u8]) -> u32 {
    one.iter().zip(other).map(|(a, b)| u32::from(a.abs_diff(*b))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::image::GreyImage;

    /// A dark square at `x_px` on a textured table.
    fn frame(n: usize, x_px: usize) -> Frame {
        let (width, height) = (160, 96);
        let pixels = (0..width * height).map(|at| {
            let (x, y) = (at % width, at / width);
            let grain = (at * 7919 + n * 104_729) % 5;
            if (x_px..x_px + 20).contains(&x) && (40..60).contains(&y) { 30 } else { 180 + grain as u8 }
        });
        Frame { time_s: n as f64 / 60.0, image: GreyImage { width, height, pixels: pixels.collect() } }
    }

    fn warning(positions_px: impl Iterator<Item = usize>) -> Option<String> {
        let mut repeats = RepeatedFrames::default();
        positions_px.enumerate().for_each(|(n, x_px)| repeats.push(&frame(n, x_px)));
        repeats.warning()
    }

    #[test]
    fn a_film_that_repeats_every_second_frame_is_called_re_timed() {
        let text = warning((0..40).map(|n| 3 * (n / 2))).unwrap();
        assert!(text.contains("every second frame"), "warning: {text}");
        assert!(text.contains("from about 30 to 60 frames/s"), "warning: {text}");
    }

    #[test]
    fn one_repeated_frame_is_found() {
        let text = warning((0..40).map(|n| if n < 20 { 3 * n } else { 3 * (n - 1) })).unwrap();
        assert!(text.starts_with("1 of 40 frames"), "warning: {text}");
        assert!(text.contains("at 0.333 s") && !text.contains("re-timed"), "warning: {text}");
    }

    #[test]
    fn an_object_at_rest_before_and_after_its_slide_repeats_nothing() {
        assert_eq!(warning((0..60_usize).map(|n| n.clamp(20, 40) * 2)), None);
        assert_eq!(warning((0..60).map(|_| 30)), None);
        assert_eq!(warning(std::iter::once(30)), None);
    }
}
