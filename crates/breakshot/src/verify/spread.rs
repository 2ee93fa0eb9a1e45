//! Which clips differ from their files otherwise than the other clips do?

use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, median};

/// A clip is reported if it differs by this many standard deviations of the clips.
pub(super) const STDS: f64 = 6.0;
/// Directions that differ less than this are not reported: robots and rulers are that accurate (rad).
pub(super) const LEAST_TURN_RAD: f64 = 0.026;

/// An angle for people, with its side.
pub(super) fn degrees(angle_rad: f64) -> String {
    let side = if angle_rad > 0.0 { "left" } else { "right" };
    format!("{:.1} degrees to the {side}", angle_rad.abs().to_degrees())
}

/// The median of one number over the clips, and their spread about it.
pub(super) struct Spread {
    pub n: usize,
    pub median: f64,
    std: f64,
}

impl Spread {
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.collect();
        let middle = median(values.iter().copied()).unwrap_or(0.0);
        let deviation = median(values.iter().map(|v| (v - middle).abs())).unwrap_or(0.0);
        Self { n: values.len(), median: middle, std: STD_OVER_MEDIAN_ABSOLUTE * deviation }
    }

    /// Largest difference from the median that is not reported.
    pub(super) fn tolerance(&self, least: f64) -> f64 {
        least.max(STDS * self.std)
    }
}
