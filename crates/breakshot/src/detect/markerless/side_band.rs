//! Where does the rim lie where an object's side shows as a narrow strip below it?
//!
//! Top, side and table are three greys there, and the smear of the two edges between them runs together.  How wide the
//! strip is follows from the object's height and the camera; so both edges are laid onto the picture at once, a strip
//! apart, with the three greys that fit best, smeared as fits the whole outline best.  A shadow along the foot makes the
//! strip wider.  A strip too narrow to tell its grey from its place says so by its own variance.

use super::edge_visibility::{EdgePoint, SPACING_PX, Scene};
use crate::geometry::Pixel;
use crate::statistics::upper_median;

/// A rim found above its strip.
#[derive(Clone, Copy, Debug)]
pub(super) struct StripEdge {
    /// How far outside the expected rim it lies (px).
    pub off_px: f64,
    /// One standard deviation of that, as far as the greys tell (px).
    pub std_px: f64,
    /// Variance of what three greys do not explain.
    misfit: f64,
}

/// A rim and its strip as they are expected.
#[derive(Clone, Copy)]
pub(super) struct Strip<'a> {
    pub point: &'a EdgePoint,
    pub width_px: f64,
    /// How far the point moved outward or inward while the shutter was open (px).
    pub motion_px: f64,
}

/// Greys are read in these steps (px).
const READ_STEP_PX: f64 = 0.5;
/// Places are tried in these steps (px); a parabola goes between them.
const STEP_PX: f64 = 0.25;
/// Greys are whole numbers, and compression leaves more than their rounding (grey levels, one standard deviation).
const LEAST_NOISE: f64 = 1.0;
/// Three greys and a place are fitted.
const UNKNOWNS: usize = 4;

/// Lens, pixels and compression smear an edge like a tent that reaches this far to either side (px): the sharpest that
/// is tried, and by how much each of the others is less sharp.
const SHARPEST_PX: f64 = 1.0;
const LESS_SHARP: f64 = 1.25;
const SMEARS: i32 = 6;
/// Where no strip tells.
const USUAL_SMEAR_PX: f64 = 1.6;
/// Something of the greys on both sides of every place that is tried has to be seen (px).
const MARGIN_PX: f64 = 1.0;

/// Shadows along the foot that are tried (px): wider ones show as what is beyond.
const SHADOWS_PX: [f64; 4] = [0.5, 1.0, 1.5, 2.0];
/// A shadow is believed if it leaves less than this part of the misfit: on a strip without one noise alone hardly does.
const SHADOW_MISFIT: f64 = 0.5;

impl Scene<'_> {
    /// How far edges are smeared here (px): the tent with which the strips fit best.
    pub(super) fn smear_px(&self, strips: &[Strip], reach_px: f64) -> f64 {
        let smear_px = |step: f64| SHARPEST_PX * LESS_SHARP.powf(step);
        let read: Vec<(Strip, Vec<(f64, f64)>)> =
            strips.iter().filter_map(|strip| Some((*strip, self.greys(*strip, reach_px)?))).collect();
        let misfit = |step: i32| {
            let edge = |(strip, greys): &(Strip, Vec<(f64, f64)>)| {
                Levels::new(greys, *strip, smear_px(f64::from(step))).edge(reach_px)
            };
            upper_median(read.iter().filter_map(edge).map(|edge| edge.misfit))
        };
        let misfits: Option<Vec<f64>> = (0..SMEARS).map(misfit).collect();
        misfits.and_then(|misfits| lowest(&misfits)).map_or(USUAL_SMEAR_PX, smear_px)
    }

    /// The rim near where it is expected, at most `reach_px` off, with a shadow along its foot if there seems to be one;
    /// none past the picture's edge, or where the greys tell no place.
    pub(super) fn strip_edge(&self, strip: Strip, reach_px: f64, smear_px: f64) -> Option<StripEdge> {
        let greys = self.greys(strip, reach_px)?;
        let levels = Levels::new(&greys, strip, smear_px);
        let plain = levels.edge(reach_px)?;
        let widened = SHADOWS_PX
            .iter()
            .filter_map(|shadow_px| Levels { width_px: strip.width_px + shadow_px, ..levels }.edge(reach_px));
        let shadowed = widened.filter(|edge| edge.misfit < SHADOW_MISFIT * plain.misfit);
        Some(shadowed.min_by(|a, b| a.misfit.total_cmp(&b.misfit)).unwrap_or(plain))
    }

    /// Ways outward from the expected rim (px) as far as the strip and `reach_px` go, and the greys there.
    fn greys(&self, Strip { point, width_px, .. }: Strip, reach_px: f64) -> Option<Vec<(f64, f64)>> {
        let [nx, ny] = point.outward;
        let read = |i: usize| {
            let way_px = i as f64 * READ_STEP_PX - reach_px;
            let grey = self.image.grey_at(Pixel::new(point.at.x + nx * way_px, point.at.y + ny * way_px));
            grey.map(|grey| (way_px, grey))
        };
        (0..=((2.0 * reach_px + width_px) / READ_STEP_PX) as usize).map(read).collect()
    }
}

/// Where among even steps the lowest of the values lies, a parabola through its neighbours if it has two.
fn lowest(values: &[f64]) -> Option<f64> {
    let best = (0..values.len()).min_by(|&a, &b| values[a].total_cmp(&values[b]))?;
    if best == 0 || best + 1 == values.len() {
        return Some(best as f64);
    }
    Some(best as f64 + vertex([values[best - 1], values[best], values[best + 1]]))
}

/// Where the parabola through three even steps is lowest, counted from the middle one; 0 if it is nowhere.
pub(super) fn vertex([before, here, after]: [f64; 3]) -> f64 {
    let bend = before - 2.0 * here + after;
    if bend > 0.0 && bend.is_finite() { 0.5 * (before - after) / bend } else { 0.0 }
}

/// How wide the side shows beyond each point of the rim, along the rim's normal (px); 0 where it is hidden.
///
/// The side's picture is made of the quadrilaterals between rim and foot; the way out of them counts, which on a
/// curved rim is not where the foot of this point is.
pub(super) fn strips_px(points: &[EdgePoint]) -> Vec<f64> {
    let n = points.len();
    let strip_px = |k: usize| {
        let point = &points[k];
        let shift_px = point.foot.distance_px(point.at);
        if !shift_px.is_finite() {
            return 0.0;
        }
        // No further along the rim than the foot is from it.
        let near = ((shift_px / SPACING_PX).ceil() as usize + 1).min(n / 2);
        let quads = (0..=2 * near).map(|j| (k + n + j - near) % n).flat_map(|j| {
            let (this, next) = (&points[j], &points[(j + 1) % n]);
            [(this.at, this.foot), (this.foot, next.foot)]
        });
        quads.filter_map(|side| crossing_px(point, side)).fold(0.0, f64::max)
    };
    (0..n).map(strip_px).collect()
}

/// How far outside a point of the rim its normal leaves a piece of the side's border, if it does.
fn crossing_px(point: &EdgePoint, (from, to): (Pixel, Pixel)) -> Option<f64> {
    let [nx, ny] = point.outward;
    let (qx, qy) = (from.x - point.at.x, from.y - point.at.y);
    let (ex, ey) = (to.x - from.x, to.y - from.y);
    let across = nx * ey - ny * ex;
    let part = (qx * ny - qy * nx) / across;
    (across != 0.0 && (0.0..=1.0).contains(&part)).then(|| (qx * ey - qy * ex) / across)
}

/// Greys read across a rim and its strip, which are to be explained by three levels.
#[derive(Clone, Copy)]
struct Levels<'a> {
    /// See [`Scene::greys`].
    greys: &'a [(f64, f64)],
    width_px: f64,
    /// How far to either side an edge is smeared, like a tent (px).
    smear_px: f64,
}

/// The three levels at one place of the rim.
#[derive(Clone, Copy)]
struct Fitted {
    /// From the top to the side, and from the side to what is beyond (grey levels).
    steps: [f64; 2],
    /// The sum of squares of what they do not explain.
    misfit: f64,
    /// Second moments of how far rim and foot are past: the normal equations.
    moments: [f64; 3],
}

impl<'a> Levels<'a> {
    fn new(greys: &'a [(f64, f64)], Strip { width_px, motion_px, .. }: Strip, smear_px: f64) -> Self {
        // Variances add up: a tent's is a sixth of its reach's square, that of an even motion a twelfth of its way's.
        Self { greys, width_px, smear_px: smear_px.hypot(motion_px / 2_f64.sqrt()) }
    }

    /// The place at which three levels explain the greys best, clear of both ends.
    fn edge(&self, reach_px: f64) -> Option<StripEdge> {
        let steps = ((reach_px - MARGIN_PX) / STEP_PX) as i32;
        let off_px = |step: f64| (step - f64::from(steps)) * STEP_PX;
        let misfits: Vec<f64> = (0..=2 * steps)
            .map(|k| self.fitted(off_px(f64::from(k))).map_or(f64::INFINITY, |fit| fit.misfit))
            .collect();
        let step = lowest(&misfits)?;
        if step <= 0.0 || step >= f64::from(2 * steps) {
            return None;
        }
        let best = self.fitted(off_px(step))?;
        let misfit = best.misfit / self.greys.len().saturating_sub(UNKNOWNS).max(1) as f64;
        let noise = misfit + LEAST_NOISE * LEAST_NOISE;
        let std_px = (noise / self.information(&best, off_px(step))?).sqrt();
        Some(StripEdge { off_px: off_px(step), std_px, misfit })
    }

    /// How far a place is past the rim and past the foot, 0 to 1.
    fn past(&self, way_px: f64, off_px: f64) -> [f64; 2] {
        let past = |edge_px: f64| {
            let way = ((way_px - edge_px) / self.smear_px).clamp(-1.0, 1.0);
            0.5 + way - 0.5 * way * way.abs()
        };
        [past(off_px), past(off_px + self.width_px)]
    }

    /// The levels that explain the greys best (least squares); none where nothing of a rim is in sight.
    fn fitted(&self, off_px: f64) -> Option<Fitted> {
        let sums = self.greys.iter().fold([0.0; 9], |mut sums, &(way_px, grey)| {
            let [rim, foot] = self.past(way_px, off_px);
            let terms =
                [rim, foot, grey, rim * rim, rim * foot, foot * foot, rim * grey, foot * grey, grey * grey];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            sums
        });
        let [rim, foot, grey, rim_rim, rim_foot, foot_foot, rim_grey, foot_grey, grey_grey] = sums;
        let n = self.greys.len() as f64;
        let moments = [rim_rim - rim * rim / n, rim_foot - rim * foot / n, foot_foot - foot * foot / n];
        let with_greys = [rim_grey - rim * grey / n, foot_grey - foot * grey / n];
        let steps = solved(moments, with_greys)?;
        let explained = steps[0] * with_greys[0] + steps[1] * with_greys[1];
        let misfit = (grey_grey - grey * grey / n - explained).max(0.0);
        Some(Fitted { steps, misfit, moments })
    }

    /// What the greys tell of the place beside their levels (1 / px2, for noise of one grey level).
    fn information(&self, fitted: &Fitted, off_px: f64) -> Option<f64> {
        let slope = |way_px: f64| {
            let [near, far] = [-STEP_PX, STEP_PX].map(|d| self.past(way_px, off_px + d));
            let rises = [0, 1].map(|k| fitted.steps[k] * (far[k] - near[k]));
            (rises[0] + rises[1]) / (2.0 * STEP_PX)
        };
        let sums = self.greys.iter().fold([0.0; 6], |mut sums, &(way_px, _)| {
            let (slope, [rim, foot]) = (slope(way_px), self.past(way_px, off_px));
            let terms = [slope, slope * slope, slope * rim, slope * foot, rim, foot];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            sums
        });
        let n = self.greys.len() as f64;
        let [slope, square, with_rim, with_foot, rim, foot] = sums;
        let shared = [with_rim - slope * rim / n, with_foot - slope * foot / n];
        let [by_rim, by_foot] = solved(fitted.moments, shared)?;
        let left = square - slope * slope / n - by_rim * shared[0] - by_foot * shared[1];
        (left > 0.0).then_some(left)
    }
}

/// The answer of two normal equations whose symmetric matrix is given by its (xx, xy, yy); of the first alone where the
/// second says nothing of its own: no strip shows, or no end of it.
fn solved([xx, xy, yy]: [f64; 3], [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let determinant = xx * yy - xy * xy;
    if determinant > SINGULAR * xx * yy {
        return Some([(yy * x - xy * y) / determinant, (xx * y - xy * x) / determinant]);
    }
    (xx > 0.0).then(|| [x / xx, 0.0])
}

/// Below this part of what it could be a determinant is rounding.
const SINGULAR: f64 = 1e-9;

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
    fn a_strip_ends_on_the_hull_of_the_circles_of_rim_and_foot() {
        let camera = camera();
        let image = GreyImage { width: 640, height: 480, pixels: vec![0; 640 * 480] };
        let scene = Scene { image: &image, camera: &camera, shape: &DISC, height_m: HEIGHT_M };
        for pose in [Pose::new(0.1, 0.05, 0.0), Pose::new(0.2, -0.1, 0.0), Pose::new(0.03, 0.0, 0.0)] {
            let points = scene.edge_points(pose);
            let circle = |height_m: f64| {
                (camera.pixel_from_table(pose.position, height_m), 1000.0 * 0.03 / (1.0 - height_m))
            };
            let circles = [circle(0.0), circle(HEIGHT_M)];
            for (point, width_px) in points.iter().zip(strips_px(&points)) {
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

    /// Where a rim lies by its strips (mean, px), and how wide they are, for an edge blurred like this.
    fn mean_off_px(place_m: f64, blur_px: f64) -> (f64, f64) {
        let camera = camera();
        let pose = Pose::new(place_m, 0.0, 0.0);
        let body =
            Thing { thickness_m: HEIGHT_M, side_grey: 60.0, ..Thing::flat(DISC, pose, HEIGHT_M, 170.0) };
        let image = picture(&View { blur_px, noise: 2.0, ..View::new(camera.clone()) }, &[body]);
        let scene = Scene { image: &image, camera: &camera, shape: &DISC, height_m: HEIGHT_M };
        // Towards the middle of the picture.
        let points: Vec<EdgePoint> =
            scene.edge_points(pose).into_iter().filter(|p| p.body.x < -0.025).collect();
        let widths_px = strips_px(&points);
        let strip = |(point, &width_px)| Strip { point, width_px, motion_px: 0.0 };
        let strips: Vec<Strip> = points.iter().zip(&widths_px).map(strip).collect();
        let smear_px = scene.smear_px(&strips, 3.0);
        let edges: Vec<StripEdge> =
            strips.iter().filter_map(|s| scene.strip_edge(*s, 3.0, smear_px)).collect();
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        (mean(edges.iter().map(|e| e.off_px).collect()), mean(widths_px))
    }

    #[test]
    fn a_rim_is_found_above_a_strip_of_its_side_however_sharp_the_picture() {
        for place_m in [0.07, 0.09, 0.13] {
            for blur_px in [0.5, 0.7, 1.0] {
                let (off_px, width_px) = mean_off_px(place_m, blur_px);
                println!("strip of {width_px:.2} px, blur of {blur_px} px: off by {off_px:.3} px");
                assert!(off_px.abs() < 0.06, "{off_px} px off above {width_px} px, blurred by {blur_px} px");
            }
        }
    }
}
