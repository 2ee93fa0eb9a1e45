//! How wide do the tags look, where lengths are those between their centres?

use super::camera::Camera;
use super::tags::DetectedTag;
use crate::cell::Tag;
use std::f64::consts::SQRT_2;

/// The width of the black square of each tag over `size_m`.
pub(super) struct WidthRatios {
    pub(super) all: Vec<f64>,
    pub(super) mean: f64,
    /// The standard error of the mean, by the differences of the tags; not a number for a single one.
    pub(super) standard_error: f64,
}

impl WidthRatios {
    /// The widths of detected tags as a camera sees them, each with the cell's own.
    pub(super) fn of<'a>(camera: &Camera, tags: impl Iterator<Item = (&'a DetectedTag, &'a Tag)>) -> Self {
        let ratio = |(detected, tag): (&DetectedTag, &Tag)| {
            let [a, b, c, d] = detected.corners_px.map(|corner| camera.table_from_pixel(corner, 0.0));
            (a.distance(c) + b.distance(d)) / (2.0 * SQRT_2 * tag.size_m)
        };
        let all: Vec<f64> = tags.map(ratio).collect();
        let count = all.len() as f64;
        let mean = all.iter().sum::<f64>() / count;
        let squares: f64 = all.iter().map(|ratio| (ratio - mean).powi(2)).sum();
        Self { all, mean, standard_error: (squares / (count - 1.0) / count).sqrt() }
    }
}
