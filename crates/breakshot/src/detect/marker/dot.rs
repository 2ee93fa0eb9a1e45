//! How is an object turned whose disc marker has a dot beside it?
//!
//! The dot is looked for all the way round, as far from the disc as it was put; both centroids are good to hundredths of a
//! pixel, so the direction between them tells the angle, and which way round.  If dot and disc are equal, what was due tells
//! which is which.

use super::super::label::{Labeller, Window};
use super::blob::{self, Blob};
use super::target::Target;
use crate::capture::{Camera, GreyImage};
use crate::geometry::{Point, Pose, half_turn_wrapped_rad, wrapped_rad};
use std::f64::consts::{FRAC_PI_2, PI};
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

/// A disc, its dot, and how the object is turned that wears them.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct Pair {
    pub disc: Blob,
    pub dot: Blob,
    pub yaw_rad: f64,
}

impl Target<'_> {
    /// The marker of which `disc` is the disc: with the dot that fits best, and is nearest to where it is due if that is
    /// known.  Of two equal dots `disc` may then be either.  None where no dot shows.
    pub(in crate::detect) fn pair(
        &self,
        image: &GreyImage,
        camera: &Camera,
        disc: &Blob,
        (due_rad, blur_px): (Option<f64>, [f64; 2]),
    ) -> Option<Pair> {
        let dot = self.feature.dot?;
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
        let middle = table(disc.centroid);
        let cost = |at: Point, area_px: u64| {
            let way = at - middle;
            let distance = (way.length() / arm.length()).ln();
            let wrapped = if equal { half_turn_wrapped_rad } else { wrapped_rad };
            let turned_rad =
                due_rad.map_or(0.0, |due_rad| wrapped(way.heading_rad() - arm.heading_rad() - due_rad));
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
        let dot = blob::measured(image, nearest, level, blur_px)?;
        let yaw_rad = wrapped_rad((table(dot.centroid) - middle).heading_rad() - arm.heading_rad());
        let other_way = |due_rad: f64| equal && wrapped_rad(yaw_rad - due_rad).abs() > FRAC_PI_2;
        Some(if due_rad.is_some_and(other_way) {
            Pair { disc: dot, dot: *disc, yaw_rad: wrapped_rad(yaw_rad + PI) }
        } else {
            Pair { disc: *disc, dot, yaw_rad }
        })
    }

    /// Whether a blob may as well be the dot of an object that is due there, because it is as wide as the disc.
    pub(in crate::detect) fn may_be_dot(&self, camera: &Camera, blob: &Blob, due: Pose) -> bool {
        let at = camera.table_from_pixel(blob.centroid, self.height_m());
        let off_m = |part: Point| due.table_from_body(part).distance(at);
        self.feature.has_equal_dots()
            && self.feature.dot.is_some_and(|dot| off_m(dot.at_m) < off_m(self.feature.at_m))
    }
}
