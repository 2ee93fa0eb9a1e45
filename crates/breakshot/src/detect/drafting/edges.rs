//! Where is the edge of an outline, to a fraction of a pixel?

use super::regions::Region;
use super::shape_fit::{BorderPoint, Fitted, fitted, refitted, simplest};
use crate::capture::{Camera, GreyImage};
use crate::detect::markerless::edge_visibility::OutlineView;
use crate::geometry::{Pixel, Point};

/// An image, its camera and the height of the plane in which outlines lie (m).
#[derive(Clone, Copy)]
pub(super) struct TopView<'a> {
    pub image: &'a GreyImage,
    pub camera: &'a Camera,
    pub height_m: f64,
    /// Whether the outline is that of a body, with a side below it, or of ink.
    pub solid: bool,
}

/// Distances from the outline within which edges are searched, round by round (px).
const REACHES_PX: [f64; 5] = [5.0, 4.0, 3.0, 3.0, 3.0];
/// The border of a region, in whole pixels, is at most this far from the outline (px, rms).
const BORDER_RMS_PX: f64 = 2.0;
/// Its area is that of the outline within this factor.
const SAME_AREA: f64 = 1.6;
/// An outline that is corrected grows by at most this factor.
const MOST_GROWN: f64 = 1.5;
/// An edge within this distance belongs to the outline (px), and this fraction of an outline has one.
const ON_OUTLINE_PX: f64 = 1.0;
const LEAST_VISIBLE: f64 = 0.8;
/// A simpler outline is taken if its points are at most this factor as far off, or this far (px), and hardly less of it is visible.
const SIMPLER_FACTOR: f64 = 1.3;
const SIMPLER_PX: f64 = 0.15;
const SIMPLER_VISIBLE: f64 = 0.03;
/// A line of the outline moves by at most this much when a side or a corner is left out (px); its edges are searched again within these distances (px),
/// as long as its points are at most this factor too far off.
const MOST_CHANGE_PX: f64 = 12.0;
const SIMPLER_REACHES_PX: [f64; 3] = [5.0, 3.0, 3.0];
const SIMPLER_NEAR: f64 = 4.0;

impl TopView<'_> {
    /// The side of a pixel at the height of the outlines (m).
    pub(super) fn pixel_m(&self, at: Pixel) -> f64 {
        self.camera.scale_m_per_px(at, self.height_m)
    }

    /// The outlines that fit the edges near a region's border: its own, and if it is the silhouette of a body, that of its top.
    pub(super) fn outlines(&self, region: &Region) -> Vec<Fitted> {
        let own = self.nearest(region);
        if !self.solid {
            return own.into_iter().collect();
        }
        let foot = |pixel: Pixel| {
            self.camera.pixel_from_table(self.camera.table_from_pixel(pixel, self.height_m), 0.0)
        };
        let top = region.shared_with_shifted(self.image, foot).and_then(|top| self.nearest(&top));
        own.into_iter().chain(top).collect()
    }

    /// The simplest of the outlines that fit; without one that fits, the nearest.
    pub(super) fn outline(&self, region: &Region) -> Option<Fitted> {
        simplest(self.outlines(region), self.pixel_m(region.centroid))
    }

    /// The simplest outline that fits the edges near a region's border.
    pub(super) fn nearest(&self, region: &Region) -> Option<Fitted> {
        let pixel_m = self.pixel_m(region.centroid);
        let border: Vec<BorderPoint> = smooth(&self.points(&region.border))
            .into_iter()
            .map(|at| BorderPoint { at, weight: 1.0 })
            .collect();
        let area_m2 = region.area_px as f64 * pixel_m * pixel_m;
        let is_near = |fit: &Fitted| {
            let ratio = fit.shape.area_m2() / area_m2;
            fit.rms_m < BORDER_RMS_PX * pixel_m && (1.0 / SAME_AREA..SAME_AREA).contains(&ratio)
        };
        let refined = |fit: Fitted| self.refined(fit, &REACHES_PX, pixel_m, is_near);
        simplest(fitted(&border, pixel_m).into_iter().filter(is_near).filter_map(refined).collect(), pixel_m)
    }

    /// An outline corrected until it lies on the edges near it.
    fn refined(
        &self,
        mut fit: Fitted,
        reaches_px: &[f64],
        pixel_m: f64,
        is_near: impl Fn(&Fitted) -> bool,
    ) -> Option<Fitted> {
        // Sides that are nearly parallel meet far away.
        let most_m = MOST_GROWN * fit.shape.outer_radius_m();
        let is_bounded = |fit: &Fitted| fit.shape.outer_radius_m() <= most_m;
        for &reach_px in reaches_px {
            let border = self.border(&fit, reach_px).0;
            fit = refitted(&fit, &border, pixel_m).filter(|fit| is_bounded(fit) && is_near(fit))?;
        }
        let (border, visible_fraction) = self.border(&fit, REACHES_PX[REACHES_PX.len() - 1]);
        let fits = fit.fits && visible_fraction >= LEAST_VISIBLE && !border.is_empty();
        Some(Fitted { fits, visible_fraction, ..fit })
    }

    /// An outline corrected until it lies on the edges near it, wherever it began.
    pub(super) fn corrected(&self, fit: Fitted, pixel_m: f64) -> Option<Fitted> {
        self.refined(fit, &REACHES_PX, pixel_m, |fit| fit.rms_m < BORDER_RMS_PX * pixel_m)
    }

    /// A polygon without the sides that it does not need: those of a silhouette, or of a corner that is rounded.
    pub(super) fn simplified(&self, mut fit: Fitted, pixel_m: f64) -> Fitted {
        loop {
            let n = fit.shape.corners().len();
            let limit_m = (SIMPLER_FACTOR * fit.rms_m).max(SIMPLER_PX * pixel_m);
            let holds = |simpler: &Fitted| {
                simpler.fits
                    && simpler.rms_m <= limit_m
                    && simpler.visible_fraction >= fit.visible_fraction - SIMPLER_VISIBLE
                    && simpler.complexity() < fit.complexity()
            };
            let most_m = MOST_CHANGE_PX * pixel_m;
            let fewer = (0..n).flat_map(|k| [fit.without_side(k, most_m), fit.without_corner(k, most_m)]);
            let near = |fit: &Fitted| fit.rms_m < SIMPLER_NEAR * limit_m;
            let simpler = |fewer| self.refined(fewer, &SIMPLER_REACHES_PX, pixel_m, near).filter(holds);
            let simpler = fewer.flatten().filter_map(simpler);
            match simpler.min_by(|a, b| a.rms_m.total_cmp(&b.rms_m)) {
                Some(simpler) => fit = simpler,
                None => return fit,
            }
        }
    }

    /// The edges near an outline, and the fraction of the outline that lies on one.
    fn border(&self, fit: &Fitted, reach_px: f64) -> (Vec<BorderPoint>, f64) {
        let view = OutlineView {
            image: self.image,
            camera: self.camera,
            shape: &fit.shape,
            height_m: self.height_m,
        };
        let edges = view.measured_edges(fit.pose, reach_px, self.solid);
        let on = edges.iter().flatten().filter(|edge| edge.off_px.abs() < ON_OUTLINE_PX).count();
        let visible_fraction = on as f64 / edges.len().max(1) as f64;
        let point = |pixel: Pixel| self.camera.table_from_pixel(pixel, self.height_m);
        let points =
            edges.iter().flatten().map(|edge| BorderPoint { at: point(edge.at), weight: edge.weight });
        (points.filter(|point| point.at.is_finite()).collect(), visible_fraction)
    }

    /// The points of the plane seen at the pixels of a clockwise walk, counter-clockwise: a camera does not mirror.
    fn points(&self, pixels: &[Pixel]) -> Vec<Point> {
        let points = pixels.iter().rev().map(|&pixel| self.camera.table_from_pixel(pixel, self.height_m));
        points.filter(|point| point.is_finite()).collect()
    }
}

/// A closed line, each point the mean of its neighbours: a border of whole pixels has steps. A small region would shrink if many were averaged.
fn smooth(border: &[Point]) -> Vec<Point> {
    const MOST_NEIGHBOURS: usize = 2;
    const LEAST_POINTS_PER_NEIGHBOUR: usize = 16;
    let n = border.len();
    let neighbours = (n / LEAST_POINTS_PER_NEIGHBOUR).min(MOST_NEIGHBOURS);
    let mean = |k: usize| {
        let near = (0..=2 * neighbours).map(|i| border[(k + n + i - neighbours) % n].to_vec());
        Point::ORIGIN
            + near.fold(crate::geometry::Vec2::ZERO, |sum, p| sum + p) * (1.0 / (2 * neighbours + 1) as f64)
    };
    (0..n).map(mean).collect()
}
