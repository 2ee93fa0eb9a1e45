//! The frames of a clip around the path of a strike: kept while the film is read, chosen afterwards.

use crate::statistics::median;
use crate::uncertain::Measured;

/// Largest memory of a clip's crops (bytes); in longer films every second crop is dropped.
const MOST_BYTES: usize = 32 << 20;
/// Side of the blocks that are compared with the first frame (px), and the distance of the pixels that are read.
const BLOCK_PX: usize = 8;
const READ_EVERY_PX: usize = 2;
/// Difference of a block's mean from which something has changed (grey levels): noise and compression change it by one or two.
const CHANGED_LEVELS: f64 = 4.0;
/// Blocks that must have changed, in so many frames one after the other.
const LEAST_BLOCKS: usize = 3;
const LEAST_FRAMES: usize = 3;
/// Difference of a pixel from which it counts as change (grey levels): noise changes few by so much.
const PIXEL_LEVELS: u8 = 8;
/// Frames in motion that show how the change grows with the displacement.
const MOVING_FRAMES: usize = 3;
/// Standard deviations of the onset (intervals of the frames): by so many frames, and by the change of two frames alone. Films of twelve cells with a known
/// onset showed 0.06 and 0.13.
const ONSET_STD: f64 = 0.06;
const LINEAR_ONSET_STD: f64 = 0.15;
/// Largest number of frames that are searched for the striker.
const MOST_FRAMES: usize = 32;

/// A frame's part around the path.
pub(super) struct Crop {
    pub time_s: f64,
    pub pixels: Vec<u8>,
    /// Whether something in it has moved since the first frame.
    changed: bool,
}

/// See the [module](self).
pub(super) struct Crops {
    width: usize,
    kept: Vec<Crop>,
    /// Every so many frames are kept.
    every: usize,
    frames: usize,
}

impl Crops {
    /// No crops yet, of this width (px).
    pub(super) fn new(width: usize) -> Self {
        Self { width, kept: Vec::new(), every: 1, frames: 0 }
    }

    /// Whether the next frame is to be kept; counts it.
    pub(super) fn wants_next(&mut self) -> bool {
        self.frames += 1;
        (self.frames - 1).is_multiple_of(self.every)
    }

    /// Keeps a crop.
    pub(super) fn push(&mut self, time_s: f64, pixels: Vec<u8>) {
        let changed =
            self.kept.first().is_some_and(|first| changed_blocks(&first.pixels, &pixels, self.width));
        self.kept.push(Crop { time_s, pixels, changed });
        if self.kept.len() > 2 && self.kept.len() * self.kept[0].pixels.len() > MOST_BYTES {
            let mut number = 0..self.kept.len();
            self.kept.retain(|_| number.next().is_some_and(|k| k.is_multiple_of(2)));
            self.every *= 2;
        }
    }

    /// The first crop, with which the others are compared.
    pub(super) fn first(&self) -> Option<&Crop> {
        self.kept.first()
    }

    /// Number of the first crop in which something has moved.
    pub(super) fn onset(&self) -> Option<usize> {
        let from = |k: usize| self.kept[k..].iter().take(LEAST_FRAMES).all(|crop| crop.changed);
        (1..self.kept.len()).find(|k| from(*k))
    }

    /// The crops from the onset on that are searched: around the impact, if there is one at this time (s).
    pub(super) fn chosen(&self, impact_s: Option<f64>) -> Vec<&Crop> {
        let Some(onset) = self.onset() else { return Vec::new() };
        let onset_s = self.kept[onset].time_s;
        let until_s = impact_s.map_or(f64::INFINITY, |impact_s| {
            let interval_s = onset_s - self.kept[onset - 1].time_s;
            impact_s + (impact_s - onset_s).max((LEAST_FRAMES as f64) * interval_s)
        });
        let moving: Vec<&Crop> =
            self.kept[onset..].iter().take_while(|crop| crop.time_s <= until_s).collect();
        let every = moving.len().div_ceil(MOST_FRAMES).max(1);
        moving.into_iter().step_by(every).collect()
    }

    /// When something near the path has begun to move (s), by frames before the struck object moves at `struck_s`.
    ///
    /// The change between two frames shows how far the striker and its arm have moved between them. It does not grow in proportion: less where
    /// parts move by more than their width, and more where contrasts are little more than noise; and it grows from frame to frame while more of
    /// the arm comes into the crop. The frames in motion show how it grows.
    pub(super) fn onset_s(&self, struck_s: Option<f64>) -> Option<Measured> {
        let onset = self.onset()?;
        let (still, noise) = (&self.kept[onset - 1], change(&self.kept[0], &self.kept[onset - 1]));
        let changed = |one: &Crop, other: &Crop| change(one, other) - noise;
        let is_before = |crop: &&Crop| struck_s.is_none_or(|struck_s| crop.time_s < struck_s);
        let moving: Vec<&Crop> =
            self.kept[onset..].iter().take_while(is_before).take(MOVING_FRAMES).collect();
        let (&first, &second) = (moving.first()?, moving.get(1)?);
        let interval_s = second.time_s - first.time_s;
        let growth = if let [a, b, c] = moving[..] {
            let changes = [(a, b), (b, c), (a, c)].map(|(one, other)| changed(one, other));
            Growth::of(changes, interval_s, c.time_s - b.time_s)
        } else {
            None
        };
        let (value, std_s) = if let Some(growth) = growth {
            let moved_s = growth.duration_s(changed(still, first), 0.0);
            // What the change until the second frame differs from the one expected, as a duration until the first
            let misfit = changed(still, second) - growth.change(moved_s + interval_s, interval_s);
            let misfit_s = misfit / growth.rate(moved_s, 0.0);
            (first.time_s - moved_s, (ONSET_STD * interval_s).hypot(misfit_s))
        } else {
            let [one, two] = [first, second].map(|crop| changed(still, crop));
            let back_s = if two > one { one / (two - one) * interval_s } else { f64::INFINITY };
            (first.time_s - back_s, LINEAR_ONSET_STD * interval_s)
        };
        // The motion begins between these two frames, also where changes that do not grow show nothing more.
        let (from_s, to_s) = (still.time_s, first.time_s);
        Some(Measured { value: value.clamp(from_s, to_s), std: std_s.min(to_s - from_s) })
    }

    /// The time of the last crop before something moved (s).
    pub(super) fn still_s(&self) -> Option<f64> {
        self.onset().map(|k| self.kept[k - 1].time_s)
    }
}

/// How the change between two frames of a motion at constant speed grows with the duration `d` between them: by `linear * d + square * d^2`, and
/// by `later` times the integral of the time from the first frame in motion on, as more comes into the crop.
struct Growth {
    linear: f64,
    square: f64,
    later: f64,
}

impl Growth {
    /// By the changes from the first frame in motion to the second, from the second to the third and from the first to the third, and the two
    /// intervals between them (s); `None` if the changes do not grow.
    fn of([one, two, both]: [f64; 3], one_s: f64, two_s: f64) -> Option<Self> {
        let square = (both - one - two) / (2.0 * one_s * two_s);
        let (one_rate, two_rate) = (one / one_s - square * one_s, two / two_s - square * two_s);
        let later = (two_rate - one_rate) / f64::midpoint(one_s, two_s);
        let linear = one_rate - later * one_s / 2.0;
        (linear > 0.0 && square.is_finite() && later.is_finite()).then_some(Self { linear, square, later })
    }

    /// The change after a duration up to a time (s after the first frame in motion).
    fn change(&self, duration_s: f64, at_s: f64) -> f64 {
        let [linear, square] = self.until(at_s);
        duration_s * (linear + square * duration_s)
    }

    /// Its derivative with respect to the duration.
    fn rate(&self, duration_s: f64, at_s: f64) -> f64 {
        let [linear, square] = self.until(at_s);
        linear + 2.0 * square * duration_s
    }

    /// The duration after which there is this change at a time (s after the first frame in motion), at most twice that at which it would be in
    /// proportion.
    fn duration_s(&self, change: f64, at_s: f64) -> f64 {
        let [linear, square] = self.until(at_s);
        let rate = (linear.powi(2) + 4.0 * square * change).max(0.0).sqrt();
        change / f64::midpoint(linear, rate)
    }

    /// The factors of the duration and of its square in the change up to a time (s after the first frame in motion).
    fn until(&self, at_s: f64) -> [f64; 2] {
        [self.linear + self.later * at_s, self.square - self.later / 2.0]
    }
}

/// The sum of what pixels differ by more than noise (grey levels).
fn change(one: &Crop, other: &Crop) -> f64 {
    one.pixels
        .iter()
        .zip(&other.pixels)
        .map(|(a, b)| f64::from(a.abs_diff(*b).saturating_sub(PIXEL_LEVELS)))
        .sum()
}

/// Whether blocks have changed beside what has changed everywhere, as the light.
fn changed_blocks(one: &[u8], other: &[u8], width: usize) -> bool {
    let mut differences = Vec::new();
    let rows = |pixels| <[u8]>::chunks_exact(pixels, width * BLOCK_PX);
    for (a, b) in rows(one).zip(rows(other)) {
        for left in (0..width.saturating_sub(BLOCK_PX - 1)).step_by(BLOCK_PX) {
            let mut sum = 0_i32;
            for y in (0..BLOCK_PX).step_by(READ_EVERY_PX) {
                let from = y * width + left;
                let (a, b) = (&a[from..from + BLOCK_PX], &b[from..from + BLOCK_PX]);
                let pairs = a.iter().zip(b).step_by(READ_EVERY_PX);
                sum += pairs.map(|(a, b)| i32::from(*b) - i32::from(*a)).sum::<i32>();
            }
            let read = (BLOCK_PX / READ_EVERY_PX).pow(2);
            differences.push(f64::from(sum) / read as f64);
        }
    }
    let Some(everywhere) = median(differences.iter().copied()) else { return false };
    differences.iter().filter(|d| (**d - everywhere).abs() > CHANGED_LEVELS).count() >= LEAST_BLOCKS
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A crop of 200 x 160 px with the front part of an arm that widens backwards and is cut by the crop's left edge, its front in this column.
    fn widening_arm(front_px: f64) -> Vec<u8> {
        const HALF_HEIGHT_PX: f64 = 80.0;
        let pixel = |row: i32, column: i32| {
            let (across_px, behind_px) =
                ((f64::from(row) + 0.5 - HALF_HEIGHT_PX).abs(), front_px - f64::from(column) - 0.5);
            // The part of the pixel that the arm covers, about
            let covered =
                (8.0 + 0.8 * behind_px - across_px + 0.5).clamp(0.0, 1.0) * (behind_px + 0.5).clamp(0.0, 1.0);
            (60.0 + 100.0 * covered).round() as u8
        };
        (0..160).flat_map(|row| (0..200).map(move |column| pixel(row, column))).collect()
    }

    /// From frame to frame more changes, as more of the arm comes into the crop.
    #[test]
    fn the_onset_of_an_arm_that_comes_into_the_crop_is_measured() {
        const PX_PER_FRAME: f64 = 6.3;
        for onset_frames in [1.2, 1.5, 1.8] {
            let mut crops = Crops::new(200);
            for frame in (0..6).map(f64::from) {
                crops.push(frame, widening_arm(60.0 + PX_PER_FRAME * (frame - onset_frames).max(0.0)));
            }
            let found = crops.onset_s(None).expect("a motion");
            assert!((found.value - onset_frames).abs() < 0.04, "{onset_frames}: {found:?}");
        }
    }

    /// Beside the motion something has vanished at once: no duration of a motion explains the first change.
    #[test]
    fn an_onset_that_the_changes_do_not_show_is_known_to_a_frame() {
        let mut crops = Crops::new(200);
        for frame in (0..6).map(f64::from) {
            let moving_px = 6.3 * (frame - 1.5).max(0.0);
            let mut pixels = widening_arm(60.0 + moving_px);
            if frame < 1.5 {
                pixels.chunks_exact_mut(200).for_each(|row| row[140..].fill(200));
            }
            crops.push(frame, pixels);
        }
        let found = crops.onset_s(None).expect("a motion");
        assert!(found.std <= 1.0 && (1.0..=2.0).contains(&found.value), "{found:?}");
    }
}
