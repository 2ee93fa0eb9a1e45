//! Where is the edge along an outline, to a fraction of a pixel?

use crate::capture::{Camera, GreyImage};
use crate::geometry::{Pixel, Point, Vec2};

/// An image, its camera and the height of the plane in which an outline lies (m).
#[derive(Clone, Copy)]
pub(super) struct TopView<'a> {
    pub image: &'a GreyImage,
    pub camera: &'a Camera,
    pub height_m: f64,
}

/// Step of the profiles across the outline (px), and half the distance over which a step of grey level is measured.
const STEP_PX: f64 = 0.25;
const HALF_STEP_PX: f64 = 1.0;
/// Distances along the outline at which profiles are averaged (px).
const ALONG_PX: [f64; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];
/// An edge is at least this fraction as steep as the steepest: of several, the innermost belongs to the top, the others to its side and its shadow.
const RIVAL: f64 = 0.3;
/// Smaller steps (grey levels) are noise.
const LEAST_STEP: f64 = 4.0;

impl TopView<'_> {
    /// The side of a pixel at the height of the outline (m).
    pub(super) fn pixel_m(&self, at: Point) -> f64 {
        self.camera.scale_m_per_px(self.camera.pixel_from_table(at, self.height_m), self.height_m)
    }

    /// The points of the plane seen at these pixels.
    pub(super) fn points(&self, pixels: &[Pixel]) -> Vec<Point> {
        let points = pixels.iter().map(|&pixel| self.camera.table_from_pixel(pixel, self.height_m));
        points.filter(|point| point.is_finite()).collect()
    }

    /// The edges within `reach_px` of a closed counter-clockwise outline, in its order.
    ///
    /// Of either sign: the side of a dark object may be darker than its top.
    pub(super) fn edges(&self, outline: &[Point], reach_px: f64) -> Vec<Point> {
        let n = outline.len();
        let point = |k: usize| {
            let (before, here, after) = (outline[(k + n - 1) % n], outline[k], outline[(k + 1) % n]);
            let along = (after - before).direction()?;
            let scale_m = self.pixel_m(here);
            let outward = along.perpendicular() * -scale_m;
            let off_px = self.edge_px([here.to_vec(), outward, along * scale_m], reach_px)?;
            Some(here + outward * off_px)
        };
        (0..n).filter_map(point).collect()
    }

    /// How far outside a point the edge is (px).
    fn edge_px(&self, [at, outward, along]: [Vec2; 3], reach_px: f64) -> Option<f64> {
        let grey = |out_px: f64| {
            let sum = ALONG_PX.iter().map(|&along_px| {
                let point = Point::ORIGIN + at + outward * out_px + along * along_px;
                self.image.grey_at(self.camera.pixel_from_table(point, self.height_m)).unwrap_or(f64::NAN)
            });
            sum.sum::<f64>() / ALONG_PX.len() as f64
        };
        let count = (2.0 * reach_px / STEP_PX) as usize + 1;
        let off_px = |k: f64| k * STEP_PX - reach_px;
        let step =
            |k: usize| (grey(off_px(k as f64) + HALF_STEP_PX) - grey(off_px(k as f64) - HALF_STEP_PX)).abs();
        let steps: Vec<f64> = (0..count).map(step).collect();
        let highest = steps.iter().copied().fold(0.0, f64::max);
        if highest < LEAST_STEP || steps.iter().any(|step| step.is_nan()) {
            return None;
        }
        let peak =
            |&k: &usize| steps[k] >= RIVAL * highest && steps[k] > steps[k - 1] && steps[k] >= steps[k + 1];
        let best = (1..count - 1).find(peak)?;
        let [before, here, after] = [steps[best - 1], steps[best], steps[best + 1]];
        let bend = before - 2.0 * here + after;
        let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
        Some(off_px(best as f64 + shift))
    }
}
