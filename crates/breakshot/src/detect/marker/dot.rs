//! What is the yaw of an object whose disc marker has a dot beside it?
//!
//! The dot is searched all around the disc at its known distance. Both centroids are measured to hundredths of a
//! pixel, so the direction between them determines the yaw without ambiguity. If dot and disc are equal, the
//! predicted yaw decides which is which.

use super::super::label::{Labeller, Window};
use super::super::threshold::Level;
use super::blob::{self, Blob};
use super::target::Target;
use crate::capture::{Camera, GreyImage};
use crate::geometry::{Point, Pose, half_turn_wrapped_rad, wrapped_rad};
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::RangeInclusive;

/// Range of a component's area over the dot's expected area: motion blur changes it.
const AREA_RATIOS: RangeInclusive<f64> = 0.4..=1.8;
/// Largest difference of a dot's distance from the disc, as a ratio's logarithm: dots are placed by hand.
const DISTANCE_TOLERANCE: f64 = 0.2;
/// Standard deviations of the logarithms of a dot's area in whole pixels and of its distance ...
const AREA_STD: f64 = 0.2;
const DISTANCE_STD: f64 = 0.05;
/// ... and of the error of the predicted yaw (rad).
const YAW_STD_RAD: f64 = 0.5;

/// A disc, its dot and the yaw of the object.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct DiscAndDot {
    pub disc: Blob,
    pub dot: Blob,
    pub yaw_rad: f64,
}

/// What is known about an object before its dot is searched.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct DotPrediction {
    /// The level at which marker and dot are separate from their background.
    pub level: Level,
    /// The predicted yaw (rad), if there is one.
    pub yaw_rad: Option<f64>,
    /// Motion of the marker in the image during the exposure (px).
    pub blur_px: [f64; 2],
}

impl Target<'_> {
    /// The disc with the dot that fits best to the known size and distance and to the predicted yaw.
    ///
    /// `disc` may be either of two equal dots. `None` if no dot is visible.
    pub(in crate::detect) fn disc_and_dot(
        &self,
        image: &GreyImage,
        camera: &Camera,
        disc: &Blob,
        prediction: DotPrediction,
    ) -> Option<DiscAndDot> {
        let dot = self.feature.dot?;
        let DotPrediction { level, yaw_rad: predicted_rad, blur_px } = prediction;
        let equal = self.feature.has_equal_dots();
        let arm = dot.at_m - self.feature.at_m;
        let height_m = self.height_m();
        let table = |pixel| camera.table_from_pixel(pixel, height_m);
        let scale_m_per_px = camera.scale_m_per_px(disc.centroid, height_m);
        let area_px2 = PI * (dot.radius_m / scale_m_per_px).powi(2);
        let reach_px = ((1.0 + DISTANCE_TOLERANCE) * arm.length() + dot.radius_m) / scale_m_per_px;
        if !reach_px.is_finite() {
            return None;
        }

        // The component of least cost around the disc
        let centre = table(disc.centroid);
        let cost = |at: Point, area_px: u64| {
            let offset = at - centre;
            let distance = (offset.length() / arm.length()).ln();
            let wrapped = if equal { half_turn_wrapped_rad } else { wrapped_rad };
            let yaw_error_rad = predicted_rad.map_or(0.0, |predicted_rad| {
                wrapped(offset.heading_rad() - arm.heading_rad() - predicted_rad)
            });
            let area = (area_px as f64 / area_px2).ln();
            let squares =
                [area / AREA_STD, distance / DISTANCE_STD, yaw_error_rad / YAW_STD_RAD].map(|d| d * d);
            (distance.abs() < DISTANCE_TOLERANCE).then(|| squares.iter().sum::<f64>())
        };
        let areas_px = (AREA_RATIOS.start() * area_px2).ceil() as u64..=(AREA_RATIOS.end() * area_px2) as u64;
        let window = Window::around(disc.centroid, reach_px, image);
        let mut labeller = Labeller::default();
        let found = labeller.components(image, window, level, &areas_px);
        let costs = found.iter().filter_map(|c| Some((cost(table(c.centroid()), c.area_px)?, c)));
        let (_, best) = costs.min_by(|a, b| a.0.total_cmp(&b.0))?;

        // The yaw from the direction between the centroids
        let dot = blob::measured(image, best, level, blur_px)?;
        let yaw_rad = wrapped_rad((table(dot.centroid) - centre).heading_rad() - arm.heading_rad());
        let exchanged = |predicted_rad: f64| equal && wrapped_rad(yaw_rad - predicted_rad).abs() > FRAC_PI_2;
        Some(if predicted_rad.is_some_and(exchanged) {
            DiscAndDot { disc: dot, dot: *disc, yaw_rad: wrapped_rad(yaw_rad + PI) }
        } else {
            DiscAndDot { disc: *disc, dot, yaw_rad }
        })
    }

    /// Whether a blob could as well be the dot of the object at its predicted pose, because the dot is as wide as the
    /// disc.
    pub(in crate::detect) fn may_be_dot(&self, camera: &Camera, blob: &Blob, predicted: Pose) -> bool {
        let at = camera.table_from_pixel(blob.centroid, self.height_m());
        let distance_m = |feature: Point| predicted.table_from_body(feature).distance(at);
        self.feature.has_equal_dots()
            && self.feature.dot.is_some_and(|dot| distance_m(dot.at_m) < distance_m(self.feature.at_m))
    }
}
