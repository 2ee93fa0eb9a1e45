//! How is an object turned whose disc marker has a smaller dot beside it?
//!
//! The dot is looked for all the way round, as far from the disc as it was put; both centroids are good to hundredths of a
//! pixel, so the direction between them tells the angle, and which way round.

use super::blob::{self, Blob};
use super::label::{Labeller, Window};
use super::marker::Target;
use crate::capture::{Camera, GreyImage};
use crate::geometry::{Point, wrapped_rad};
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// Parts of the dot's area between which a component may be it: smeared by motion it shows more or less.
const AREA_RATIOS: RangeInclusive<f64> = 0.4..=1.8;
/// Put on by hand, a dot lies within this part of its distance of where the file says.
const DISTANCE_TOLERANCE: f64 = 0.2;
/// A dot's area in whole pixels differs by about this part (its logarithm's standard deviation), its distance by this ...
const AREA_STD: f64 = 0.2;
const DISTANCE_STD: f64 = 0.05;
/// ... and the object has turned by about this since the last frame (rad).
const TURN_STD_RAD: f64 = 0.5;

impl Target<'_> {
    /// How the object is turned if `disc` is its marker (rad): by the dot that fits best, and is nearest to where it is
    /// due if that is known.  None where no dot shows.
    pub(super) fn yaw_by_dot_rad(
        &self,
        image: &GreyImage,
        camera: &Camera,
        disc: &Blob,
        (due_rad, blur_px): (Option<f64>, [f64; 2]),
    ) -> Option<f64> {
        let dot = self.feature.dot?;
        let arm = dot.at_m - self.feature.at_m;
        let height_m = self.height_m();
        let table = |pixel| camera.table_from_pixel(pixel, height_m);
        let scale_m_per_px = camera.scale_m_per_px(disc.centroid, height_m);
        let area_px2 = PI * (dot.radius_m / scale_m_per_px).powi(2);
        let reach_px = ((1.0 + DISTANCE_TOLERANCE) * arm.length() + dot.radius_m) / scale_m_per_px;
        if !reach_px.is_finite() {
            return None;
        }
        let middle = table(disc.centroid);
        let cost = |at: Point, area_px: u64| {
            let way = at - middle;
            let distance = (way.length() / arm.length()).ln();
            let turned_rad =
                due_rad.map_or(0.0, |due_rad| wrapped_rad(way.heading_rad() - arm.heading_rad() - due_rad));
            let area = (area_px as f64 / area_px2).ln();
            let squares =
                [area / AREA_STD, distance / DISTANCE_STD, turned_rad / TURN_STD_RAD].map(|d| d * d);
            (distance.abs() < DISTANCE_TOLERANCE).then(|| squares.iter().sum::<f64>())
        };
        let areas_px = (AREA_RATIOS.start() * area_px2).ceil() as u64..=(AREA_RATIOS.end() * area_px2) as u64;
        let window = Window::around(disc.centroid, reach_px, image);
        let level = disc.level();
        let mut labeller = Labeller::default();
        let found = labeller.components(image, window, level, &areas_px);
        let costs = found.iter().filter_map(|c| Some((cost(table(c.centroid()), c.area_px)?, c)));
        let (_, nearest) = costs.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let way = table(blob::measured(image, nearest, level, blur_px)?.centroid) - middle;
        Some(wrapped_rad(way.heading_rad() - arm.heading_rad()))
    }
}
