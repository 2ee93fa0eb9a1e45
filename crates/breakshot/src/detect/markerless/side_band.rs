//! Where is the top edge of an object whose side is visible as a narrow band?
//!
//! Top, side and table have three grey levels, and the blur merges the two edges between them. The width of the band
//! follows from the object's height and the camera. So both edges are fitted at once, one band width apart, with the
//! three grey levels that fit best and with one blur radius for the whole outline. A shadow along the foot widens the
//! band. Where the band is too narrow to separate its grey level from its position, the result has a large variance.

use super::edge_visibility::{EdgePoint, OutlineView, SPACING_PX};
use crate::geometry::Pixel;
use crate::statistics::upper_median;

/// The top edge found above a band.
#[derive(Clone, Copy, Debug)]
pub(super) struct BandEdge {
    /// Distance outside the expected edge (px).
    pub off_px: f64,
    /// Its standard deviation (px).
    pub std_px: f64,
    /// Variance of the residuals of the three grey levels.
    residual: f64,
}

/// A point of the outline and the expected band beyond it.
#[derive(Clone, Copy)]
pub(super) struct Band<'a> {
    pub point: &'a EdgePoint,
    pub width_px: f64,
    /// Motion of the point along its normal during the exposure (px).
    pub motion_px: f64,
}

/// A grey level at a distance outward from the expected edge.
#[derive(Clone, Copy)]
struct GreyAt {
    distance_px: f64,
    grey: f64,
}

/// Step of the profile of grey levels (px).
const READ_STEP_PX: f64 = 0.5;
/// Step of the edge positions that are tried (px), before interpolation by a parabola.
const STEP_PX: f64 = 0.25;
/// Standard deviation of the grey levels due to rounding and compression.
const LEAST_NOISE: f64 = 1.0;
/// Number of unknowns: three grey levels and a position.
const UNKNOWNS: usize = 4;
/// Radii of the blur by lens, pixels and compression, as a triangular kernel: the smallest (px), the ratio of
/// successive ones and their number.
const SHARPEST_PX: f64 = 1.0;
const BLUR_RATIO: f64 = 1.25;
const BLUR_STEPS: i32 = 6;
/// The blur radius where no band determines it (px).
const USUAL_BLUR_PX: f64 = 1.6;
/// Length of the profile beyond every position that is tried (px).
const MARGIN_PX: f64 = 1.0;
/// Widths of shadows along the foot that are tried (px); a wider shadow is the third grey level.
const SHADOWS_PX: [f64; 4] = [0.5, 1.0, 1.5, 2.0];
/// Largest residual variance with a shadow over that without one: noise alone rarely reduces it as much.
const SHADOW_RESIDUAL: f64 = 0.5;
/// A determinant below this fraction of its upper bound is rounding error.
const SINGULAR: f64 = 1e-9;

impl OutlineView<'_> {
    /// Radius of the blur with which the bands fit best in the median (px).
    pub(super) fn blur_radius_px(&self, bands: &[Band], reach_px: f64) -> f64 {
        let radius_px = |step: f64| SHARPEST_PX * BLUR_RATIO.powf(step);
        let profiles: Vec<(Band, Vec<GreyAt>)> =
            bands.iter().filter_map(|band| Some((*band, self.profile(*band, reach_px)?))).collect();
        let residual = |step: i32| {
            let edge = |(band, profile): &(Band, Vec<GreyAt>)| {
                BandModel::new(profile, *band, radius_px(f64::from(step))).edge(reach_px)
            };
            upper_median(profiles.iter().filter_map(edge).map(|edge| edge.residual))
        };
        let residuals: Option<Vec<f64>> = (0..BLUR_STEPS).map(residual).collect();
        residuals.and_then(|residuals| lowest(&residuals)).map_or(USUAL_BLUR_PX, radius_px)
    }

    /// The top edge within `reach_px` of the expected one, with a shadow along the foot if that fits better.
    ///
    /// `None` beyond the border of the image or where the grey levels do not determine a position.
    pub(super) fn band_edge(&self, band: Band, reach_px: f64, blur_radius_px: f64) -> Option<BandEdge> {
        let profile = self.profile(band, reach_px)?;
        let model = BandModel::new(&profile, band, blur_radius_px);
        let plain = model.edge(reach_px)?;
        let widened = SHADOWS_PX.iter().filter_map(|shadow_px| {
            BandModel { width_px: band.width_px + shadow_px, ..model }.edge(reach_px)
        });
        let shadowed = widened.filter(|edge| edge.residual < SHADOW_RESIDUAL * plain.residual);
        Some(shadowed.min_by(|a, b| a.residual.total_cmp(&b.residual)).unwrap_or(plain))
    }

    /// Grey levels along the normal, from `reach_px` inside the expected edge to `reach_px` beyond the band.
    fn profile(&self, Band { point, width_px, .. }: Band, reach_px: f64) -> Option<Vec<GreyAt>> {
        let read = |i: usize| {
            let distance_px = i as f64 * READ_STEP_PX - reach_px;
            let grey = self.image.grey_at(point.outward_by(distance_px));
            grey.map(|grey| GreyAt { distance_px, grey })
        };
        (0..=((2.0 * reach_px + width_px) / READ_STEP_PX) as usize).map(read).collect()
    }
}

/// Position of the lowest of some values at uniform steps, interpolated by a parabola if it is not the first or last.
fn lowest(values: &[f64]) -> Option<f64> {
    let best = (0..values.len()).min_by(|&a, &b| values[a].total_cmp(&values[b]))?;
    if best == 0 || best + 1 == values.len() {
        return Some(best as f64);
    }
    Some(best as f64 + parabola_minimum([values[best - 1], values[best], values[best + 1]]))
}

/// Position of the minimum of the parabola through three values at uniform steps, relative to the middle one; 0 if
/// there is none.
pub(in crate::detect) fn parabola_minimum([before, here, after]: [f64; 3]) -> f64 {
    let curvature = before - 2.0 * here + after;
    if curvature > 0.0 && curvature.is_finite() { 0.5 * (before - after) / curvature } else { 0.0 }
}

/// Width of the visible side beyond each point of the outline, along its normal (px); 0 where the side is hidden.
///
/// The side's image is the union of the quadrilaterals between top edge and foot. The width is where the normal
/// leaves this union, which on a curved outline is not at the foot of the same point.
pub(super) fn band_widths_px(points: &[EdgePoint]) -> Vec<f64> {
    let n = points.len();
    let width_px = |k: usize| {
        let point = &points[k];
        let shift_px = point.foot.distance_px(point.at);
        if !shift_px.is_finite() {
            return 0.0;
        }
        // Only neighbours along the outline that are as near as the foot.
        let near = ((shift_px / SPACING_PX).ceil() as usize + 1).min(n / 2);
        let sides = (0..=2 * near).map(|j| (k + n + j - near) % n).flat_map(|j| {
            let (this, next) = (&points[j], &points[(j + 1) % n]);
            [(this.at, this.foot), (this.foot, next.foot)]
        });
        sides.filter_map(|side| crossing_px(point, side)).fold(0.0, f64::max)
    };
    (0..n).map(width_px).collect()
}

/// Distance outward at which the normal of a point crosses a segment, if it does (px).
fn crossing_px(point: &EdgePoint, (from, to): (Pixel, Pixel)) -> Option<f64> {
    let [nx, ny] = point.outward;
    let (qx, qy) = (from.x - point.at.x, from.y - point.at.y);
    let (ex, ey) = (to.x - from.x, to.y - from.y);
    let across = nx * ey - ny * ex;
    let fraction = (qx * ny - qy * nx) / across;
    (across != 0.0 && (0.0..=1.0).contains(&fraction)).then(|| (qx * ey - qy * ex) / across)
}

/// The model of a profile: three grey levels with two blurred edges between them.
#[derive(Clone, Copy)]
struct BandModel<'a> {
    profile: &'a [GreyAt],
    width_px: f64,
    /// Radius of the triangular blur kernel (px).
    blur_radius_px: f64,
}

/// The three grey levels of best fit at one position of the edge.
#[derive(Clone, Copy)]
struct FittedLevels {
    /// Differences of grey levels from top to side and from side to table.
    steps: [f64; 2],
    /// Sum of squared residuals.
    residual: f64,
    /// The matrix of the normal equations (xx, xy, yy).
    moments: [f64; 3],
}

impl<'a> BandModel<'a> {
    fn new(profile: &'a [GreyAt], Band { width_px, motion_px, .. }: Band, lens_radius_px: f64) -> Self {
        // Variances add: a triangular kernel's is a sixth of its squared radius, that of uniform motion a twelfth of
        // its squared length.
        Self { profile, width_px, blur_radius_px: lens_radius_px.hypot(motion_px / 2_f64.sqrt()) }
    }

    /// The position of the edge with the smallest sum of squared residuals; `None` if it is at an end of the range.
    fn edge(&self, reach_px: f64) -> Option<BandEdge> {
        let steps = ((reach_px - MARGIN_PX) / STEP_PX) as i32;
        let off_px = |step: f64| (step - f64::from(steps)) * STEP_PX;
        let residuals: Vec<f64> = (0..=2 * steps)
            .map(|k| self.fitted(off_px(f64::from(k))).map_or(f64::INFINITY, |fit| fit.residual))
            .collect();
        let step = lowest(&residuals)?;
        if step <= 0.0 || step >= f64::from(2 * steps) {
            return None;
        }
        let best = self.fitted(off_px(step))?;
        let residual = best.residual / self.profile.len().saturating_sub(UNKNOWNS).max(1) as f64;
        let noise = residual + LEAST_NOISE * LEAST_NOISE;
        let std_px = (noise / self.information(&best, off_px(step))?).sqrt();
        Some(BandEdge { off_px: off_px(step), std_px, residual })
    }

    /// The blurred unit steps at the top edge and at the foot: 0 inside, 1 outside.
    fn unit_steps(&self, distance_px: f64, off_px: f64) -> [f64; 2] {
        let step = |edge_px: f64| {
            let u = ((distance_px - edge_px) / self.blur_radius_px).clamp(-1.0, 1.0);
            0.5 + u - 0.5 * u * u.abs()
        };
        [step(off_px), step(off_px + self.width_px)]
    }

    /// The grey levels of best fit (least squares) for an edge at this position; `None` if no edge is in the profile.
    fn fitted(&self, off_px: f64) -> Option<FittedLevels> {
        let sums = self.profile.iter().fold([0.0; 9], |mut sums, &GreyAt { distance_px, grey }| {
            let [top, foot] = self.unit_steps(distance_px, off_px);
            let terms =
                [top, foot, grey, top * top, top * foot, foot * foot, top * grey, foot * grey, grey * grey];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            sums
        });
        let [top, foot, grey, top_top, top_foot, foot_foot, top_grey, foot_grey, grey_grey] = sums;
        let n = self.profile.len() as f64;
        let moments = [top_top - top * top / n, top_foot - top * foot / n, foot_foot - foot * foot / n];
        let with_greys = [top_grey - top * grey / n, foot_grey - foot * grey / n];
        let steps = solution(moments, with_greys)?;
        let explained = steps[0] * with_greys[0] + steps[1] * with_greys[1];
        let residual = (grey_grey - grey * grey / n - explained).max(0.0);
        Some(FittedLevels { steps, residual, moments })
    }

    /// Information about the position with unknown grey levels (1 / px2, for noise of one grey level): the Schur
    /// complement of the normal equations.
    fn information(&self, fitted: &FittedLevels, off_px: f64) -> Option<f64> {
        let slope = |distance_px: f64| {
            let [near, far] = [-STEP_PX, STEP_PX].map(|d| self.unit_steps(distance_px, off_px + d));
            let rises = [0, 1].map(|k| fitted.steps[k] * (far[k] - near[k]));
            (rises[0] + rises[1]) / (2.0 * STEP_PX)
        };
        let sums = self.profile.iter().fold([0.0; 6], |mut sums, &GreyAt { distance_px, .. }| {
            let (slope, [top, foot]) = (slope(distance_px), self.unit_steps(distance_px, off_px));
            let terms = [slope, slope * slope, slope * top, slope * foot, top, foot];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            sums
        });
        let n = self.profile.len() as f64;
        let [slope, square, with_top, with_foot, top, foot] = sums;
        let shared = [with_top - slope * top / n, with_foot - slope * foot / n];
        let [by_top, by_foot] = solution(fitted.moments, shared)?;
        let left = square - slope * slope / n - by_top * shared[0] - by_foot * shared[1];
        (left > 0.0).then_some(left)
    }
}

/// The solution of two normal equations with the symmetric matrix (xx, xy, yy); of the first one alone where the
/// matrix is singular, because no band or no end of it is in the profile.
fn solution([xx, xy, yy]: [f64; 3], [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let determinant = xx * yy - xy * xy;
    if determinant > SINGULAR * xx * yy {
        return Some([(yy * x - xy * y) / determinant, (xx * y - xy * x) / determinant]);
    }
    (xx > 0.0).then(|| [x / xx, 0.0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{Camera, GreyImage, Lens};
    use crate::cell::Transform;
    use crate::geometry::Pose;
    use crate::object::Shape;
    use crate::synthetic::film::{Thing, View, picture};

    const HEIGHT_M: f64 = 0.04;
    const DISC: Shape = Shape::Disc { radius_m: 0.03 };

    fn camera() -> Camera {
        let at = Transform { position_m: [0.0, 0.0, 1.0], rpy_rad: [0.0; 3] };
        Camera::new([640, 480], Lens::pinhole([640, 480], 1000.0), at)
    }

    #[test]
    fn a_band_ends_at_the_convex_hull_of_the_circles_of_top_and_foot() {
        let camera = camera();
        let image = GreyImage { width: 640, height: 480, pixels: vec![0; 640 * 480] };
        let view = OutlineView { image: &image, camera: &camera, shape: &DISC, height_m: HEIGHT_M };
        for pose in [Pose::new(0.1, 0.05, 0.0), Pose::new(0.2, -0.1, 0.0), Pose::new(0.03, 0.0, 0.0)] {
            let points = view.edge_points(pose);
            let circle = |height_m: f64| {
                (camera.pixel_from_table(pose.position, height_m), 1000.0 * 0.03 / (1.0 - height_m))
            };
            let circles = [circle(0.0), circle(HEIGHT_M)];
            for (point, width_px) in points.iter().zip(band_widths_px(&points)) {
                let [nx, ny] = point.outward;
                let end = Pixel::new(point.at.x + nx * width_px, point.at.y + ny * width_px);
                let outside_px = |angle: f64| {
                    let along = |p: Pixel| p.x * angle.cos() + p.y * angle.sin();
                    along(end) - circles.iter().map(|(c, r)| along(*c) + r).fold(f64::MIN, f64::max)
                };
                let angles = (0..3600).map(|k| f64::from(k) * std::f64::consts::TAU / 3600.0);
                let off_px = angles.map(outside_px).fold(f64::MIN, f64::max);
                assert!(off_px.abs() < 0.05, "{width_px} px wide, {off_px} px outside the hull at {pose:?}");
            }
        }
    }

    /// Mean error of the top edge (px) and mean width of the band (px), of a disc at this x with this blur.
    fn mean_error_px(x_m: f64, blur_px: f64) -> (f64, f64) {
        let camera = camera();
        let pose = Pose::new(x_m, 0.0, 0.0);
        let body =
            Thing { thickness_m: HEIGHT_M, side_grey: 60.0, ..Thing::flat(DISC, pose, HEIGHT_M, 170.0) };
        let image = picture(&View { blur_px, noise: 2.0, ..View::new(camera.clone()) }, &[body]);
        let view = OutlineView { image: &image, camera: &camera, shape: &DISC, height_m: HEIGHT_M };
        // The part nearest to the centre of the image.
        let points: Vec<EdgePoint> =
            view.edge_points(pose).into_iter().filter(|p| p.body.x < -0.025).collect();
        let widths_px = band_widths_px(&points);
        let band = |(point, &width_px)| Band { point, width_px, motion_px: 0.0 };
        let bands: Vec<Band> = points.iter().zip(&widths_px).map(band).collect();
        let blur_radius_px = view.blur_radius_px(&bands, 3.0);
        let edges: Vec<BandEdge> =
            bands.iter().filter_map(|b| view.band_edge(*b, 3.0, blur_radius_px)).collect();
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        (mean(edges.iter().map(|e| e.off_px).collect()), mean(widths_px))
    }

    #[test]
    fn the_top_edge_is_found_above_a_band_of_the_side_for_any_blur() {
        for x_m in [0.07, 0.09, 0.13] {
            for blur_px in [0.5, 0.7, 1.0] {
                let (off_px, width_px) = mean_error_px(x_m, blur_px);
                println!("band of {width_px:.2} px, blur of {blur_px} px: off by {off_px:.3} px");
                assert!(off_px.abs() < 0.06, "{off_px} px off above {width_px} px, blurred by {blur_px} px");
            }
        }
    }
}
