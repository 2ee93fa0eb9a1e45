//! Where is a marker of which a part is covered or shaded, or beside which something looks like it?
//!
//! The edges of the marker are searched along the normals of its own outline, with the sign that they have where the whole marker is
//! visible (compare the contour tracking of Harris 1992). A robust fit of position and yaw ignores the edges of other things, and its
//! covariance states how much of the outline was seen, in each direction and in angle.

use super::target::Target;
use crate::capture::{Camera, GreyImage};
use crate::detect::markerless::edge_fit::local_maximum;
use crate::detect::markerless::edge_visibility::outline_points;
use crate::detect::markerless::side_band::parabola_minimum;
use crate::geometry::{Pixel, Point, Pose, Vec2};
use crate::object::Shape;
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, upper_median};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// A marker's outline fitted to the image.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct MarkerFit {
    /// The object's pose.
    pub pose: Pose,
    /// What the visible part of the outline contributes to position and yaw, over what the whole outline does, in the direction in
    /// which this is least: 0 to 1.
    pub visible_fraction: f64,
    /// Standard deviation of the object's centroid along the direction in which it is largest (m).
    pub std_m: f64,
    /// Standard deviation of the yaw (rad); [`UNKNOWN_YAW_STD_RAD`] where the marker does not determine it.
    pub yaw_std_rad: f64,
}

/// Yaws that a marker does not determine have about this standard deviation (rad).
pub(super) const UNKNOWN_YAW_STD_RAD: f64 = 0.3;
/// A yaw is measured if its standard deviation is below this (rad).
const KNOWN_YAW_STD_RAD: f64 = 0.06;
/// A position by a part of the marker's outline is doubtful if its standard deviation is larger than this (px), or that of its yaw (rad).
const TRUSTED_STD_PX: f64 = 0.25;
const TRUSTED_STD_RAD: f64 = 0.02;
/// Distance between points of an outline (px): closer ones share their pixels.
const SPACING_PX: f64 = 2.0;
/// Distance between the points in a search (px).
const ROUGH_SPACING_PX: f64 = 3.0;
/// Distance from the outline within which edges are searched, in each round (px).
const REACHES_PX: [f64; 3] = [OUTLINE_REACH_PX, 3.0, 2.5];
/// The largest of them: a marker of which no outline is found is elsewhere by about this distance, or by more.
pub(in crate::detect) const OUTLINE_REACH_PX: f64 = 4.0;
/// The same around a pose that is known to a pixel.
const NEAR_REACHES_PX: [f64; 2] = [2.5, 2.5];
/// A round that moves no point of the outline by more than this (px) is the last one.
const SETTLED_PX: f64 = 0.2;
/// Step of the profiles across the outline (px).
const STEP_PX: f64 = 0.5;
/// Half of the distance over which a step of grey level is measured (px), without motion blur: about the blur of a lens.
const HALF_STEP_PX: f64 = 1.0;
/// Neighbouring points are averaged where the cosine of the angle between their normals is above this.
const SAME_DIRECTION: f64 = 0.8;
/// A smaller step (grey levels) is noise, ...
const LEAST_STEP: f64 = 5.0;
/// ... and a step of a smaller part of the marker's usual contrast is not its edge: in the shade of lamps that give three quarters of the
/// light, a quarter remains.
const LEAST_CONTRAST: f64 = 0.2;
/// Distance from the fitted outline within which an edge belongs to it (px).
const ON_OUTLINE_PX: f64 = 1.0;
/// Distance of an outlier (standard deviations), for Tukey's biweight.
const OUTLIER_STDS: f64 = 3.0;
/// Least scatter of edges (px).
const LEAST_SCATTER_PX: f64 = 0.1;
/// Standard deviation of a blurred edge as a part of the blur across it: what else is near the edge displaces it.
const BLURRED_STD: f64 = 0.15;
/// Number of neighbouring edges that count as one, because they share pixels.
const CORRELATED: f64 = 4.0;
/// Rounds of the robust fit.
const ROBUST_ROUNDS: usize = 4;
/// Displacement for numerical derivatives of the projection (m).
const DERIVATIVE_STEP_M: f64 = 1e-4;
/// Steps of a search in position (px) and in yaw (rad).
const SEARCH_STEP_PX: f64 = 2.0;
const SEARCH_STEP_RAD: f64 = 0.1;
/// Number of poses of a search that are fitted.
const FITTED_POSES: usize = 4;

/// What is known about a marker before its outline is fitted.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct Appearance {
    /// Whether the marker is darker than the surface around it.
    pub dark: bool,
    /// Its usual difference from that surface (grey levels).
    pub contrast: f64,
    /// Its motion in the image during the exposure (px).
    pub blur_px: [f64; 2],
}

/// How far around a pose a marker is searched.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct Range {
    /// Largest distance from the pose (m).
    pub radius_m: f64,
    /// Largest rotation to either side (rad).
    pub angle_rad: f64,
}

/// A point of an outline in the image.
#[derive(Clone, Copy)]
struct OutlinePoint {
    at: Pixel,
    /// Unit vector outward, in the image.
    outward: [f64; 2],
    /// The point in the object's frame.
    body: Point,
}

/// An equation of the fit: the distance of an edge from the outline, and its derivatives by x, y (px / m) and yaw (px / rad).
#[derive(Clone, Copy)]
struct Row {
    derivatives: Vector3<f64>,
    off_px: f64,
    weight: f64,
    /// The standard deviation of an edge that moves during the exposure over that of one that does not.
    spread: f64,
}

/// A marker, the image in which it is searched, and its appearance.
#[derive(Clone, Copy)]
pub(in crate::detect) struct MarkerView<'a> {
    pub image: &'a GreyImage,
    pub camera: &'a Camera,
    pub target: &'a Target<'a>,
    pub appearance: Appearance,
}

impl MarkerFit {
    /// Whether the yaw was measured.
    pub(in crate::detect) fn knows_yaw(&self) -> bool {
        self.yaw_std_rad < KNOWN_YAW_STD_RAD
    }

    /// Whether the position is known well.
    pub(in crate::detect) fn has_known_position(&self, scale_m_per_px: f64) -> bool {
        self.std_m <= TRUSTED_STD_PX * scale_m_per_px
    }

    /// Whether the yaw was measured, but badly.
    pub(in crate::detect) fn has_rough_yaw(&self) -> bool {
        self.yaw_std_rad > TRUSTED_STD_RAD && self.knows_yaw()
    }
}

impl MarkerView<'_> {
    /// The outline of the marker and of its dot fitted to the edges near a pose; `None` if there are too few.
    pub(in crate::detect) fn fitted(&self, guess: Pose) -> Option<MarkerFit> {
        self.fitted_within(guess, &REACHES_PX)
    }

    /// The same from a pose that is known to a pixel.
    pub(in crate::detect) fn fitted_near(&self, guess: Pose) -> Option<MarkerFit> {
        self.fitted_within(guess, &NEAR_REACHES_PX)
    }

    fn fitted_within(&self, guess: Pose, reaches_px: &[f64]) -> Option<MarkerFit> {
        let mut pose = guess;
        let mut fit = None;
        for &reach_px in reaches_px {
            let points = self.points(pose, SPACING_PX);
            let rows = self.rows(pose, &points, reach_px)?;
            let solution = Solution::of(&rows)?;
            pose = Pose {
                position: pose.position + Vec2::new(solution.change[0], solution.change[1]),
                yaw_rad: pose.yaw_rad + solution.change[2],
            };
            if !pose.position.is_finite() || solution.largest_px > 2.0 * reach_px {
                return None;
            }
            fit = Some(MarkerFit { pose, ..solution.fit });
            if solution.largest_px < SETTLED_PX {
                break;
            }
        }
        fit
    }

    /// The most visible fit around a pose; `blur_px` gives the motion during the exposure of an object that has moved to a pose, and none
    /// for a pose at which it cannot be.
    pub(in crate::detect) fn searched(
        &self,
        around: Pose,
        range: Range,
        blur_px: impl Fn(Pose) -> Option<[f64; 2]>,
    ) -> Option<MarkerFit> {
        let at_pose = |pose: Pose| {
            let appearance = Appearance { blur_px: blur_px(pose)?, ..self.appearance };
            Some(Self { appearance, ..*self })
        };
        let reach_m = range.radius_m + self.target.feature.shape.outer_radius_m();
        let pixel_m = self.camera.scale_where_shown(around.position, self.target.height_m(), reach_m)?;
        let step_m = SEARCH_STEP_PX * pixel_m;
        let steps = (range.radius_m / step_m).ceil() as i32;
        let turns =
            if self.target.has_observable_yaw() { (range.angle_rad / SEARCH_STEP_RAD) as i32 } else { 0 };
        let mut best: Vec<(f64, Pose)> = Vec::new();
        for (i, j) in (-steps..=steps).flat_map(|i| (-steps..=steps).map(move |j| (i, j))) {
            if i * i + j * j > steps * steps {
                continue;
            }
            let position = around.position + Vec2::new(f64::from(i), f64::from(j)) * step_m;
            for turn in -turns..=turns {
                let pose = Pose { position, yaw_rad: around.yaw_rad + f64::from(turn) * SEARCH_STEP_RAD };
                let Some(view) = at_pose(pose) else { continue };
                let visibility = view.rough_visibility(pose);
                if best.len() < FITTED_POSES || visibility > best[best.len() - 1].0 {
                    // Of neighbours the best remains.
                    let near = |other: &(f64, Pose)| other.1.position.distance(position) < 2.5 * step_m;
                    match best.iter().position(near) {
                        Some(k) if best[k].0 >= visibility => continue,
                        Some(k) => drop(best.remove(k)),
                        None => {}
                    }
                    best.push((visibility, pose));
                    best.sort_by(|a, b| b.0.total_cmp(&a.0));
                    best.truncate(FITTED_POSES);
                }
            }
        }
        let fits = best.into_iter().filter_map(|(_, pose)| at_pose(pose)?.fitted(pose));
        let fits = fits.filter(|fit| blur_px(fit.pose).is_some());
        fits.max_by(|a, b| a.visible_fraction.total_cmp(&b.visible_fraction))
    }

    /// Mean over the outline of the step across it, as a part of the usual contrast.
    fn rough_visibility(&self, pose: Pose) -> f64 {
        let points = self.points(pose, ROUGH_SPACING_PX);
        let step = |point: &OutlinePoint| {
            let step = self.step(point, 0.0, (0.5 * self.motion_px(point)).max(1.5 * HALF_STEP_PX));
            if step.is_finite() { (step / self.appearance.contrast).clamp(0.0, 1.0) } else { 0.0 }
        };
        points.iter().map(step).sum::<f64>() / points.len().max(1) as f64
    }

    /// Points of the outlines of the marker and its dot; none where the camera does not see them.
    fn points(&self, pose: Pose, spacing_px: f64) -> Vec<OutlinePoint> {
        let feature = &self.target.feature;
        let height_m = self.target.height_m();
        let pixel = |body: Point| self.camera.pixel_from_table(pose.table_from_body(body), height_m);
        let spacing_m = spacing_px * self.camera.scale_m_per_px(pixel(feature.at_m), height_m);
        if !spacing_m.is_finite() {
            return Vec::new();
        }
        let marker = outline_points(&feature.shape, spacing_m).into_iter().map(|(p, n)| (p, n, feature.at_m));
        let dot = feature.dot.iter().flat_map(|dot| {
            let points = outline_points(&Shape::Disc { radius_m: dot.radius_m }, spacing_m);
            points.into_iter().map(|(p, n)| (p, n, dot.at_m))
        });
        let projected = |(point, normal, at_m): (Point, Vec2, Point)| {
            let body = point + at_m.to_vec();
            let (at, ahead) = (pixel(body), pixel(body + normal * spacing_m));
            let (dx, dy) = (ahead.x - at.x, ahead.y - at.y);
            let length = dx.hypot(dy);
            (length > 0.0).then(|| OutlinePoint { at, outward: [dx / length, dy / length], body })
        };
        marker.chain(dot).filter_map(projected).collect()
    }

    /// How much more the marker differs from its surroundings inside a point of its outline than outside (grey levels); NaN beyond the
    /// border of the image.
    fn step(&self, point: &OutlinePoint, off_px: f64, half_px: f64) -> f64 {
        let [nx, ny] = point.outward;
        let read = |distance_px: f64| {
            let at = Pixel::new(point.at.x + nx * distance_px, point.at.y + ny * distance_px);
            self.image.grey_at(at).unwrap_or(f64::NAN)
        };
        let step = read(off_px + half_px) - read(off_px - half_px);
        if self.appearance.dark { step } else { -step }
    }

    /// The equations of all points of an outline, those without an edge of weight zero; `None` without any.
    fn rows(&self, pose: Pose, points: &[OutlinePoint], reach_px: f64) -> Option<Vec<Row>> {
        let height_m = self.target.height_m();
        let pixel = |at: Vec2| self.camera.pixel_from_table(pose.position + at, height_m);
        let at = pixel(Vec2::ZERO);
        let (right, up) =
            (pixel(Vec2::new(DERIVATIVE_STEP_M, 0.0)), pixel(Vec2::new(0.0, DERIVATIVE_STEP_M)));
        let [ax, ay] =
            [right, up].map(|p| [(p.x - at.x) / DERIVATIVE_STEP_M, (p.y - at.y) / DERIVATIVE_STEP_M]);
        let turns = self.target.has_observable_yaw();
        let count = (reach_px / STEP_PX) as usize * 2 + 1;
        let profiles: Vec<Vec<f64>> = points
            .iter()
            .map(|point| {
                let half_px = (0.5 * self.motion_px(point)).max(HALF_STEP_PX);
                (0..count).map(|i| self.step(point, i as f64 * STEP_PX - reach_px, half_px)).collect()
            })
            .collect();
        let row = |(k, point): (usize, &OutlinePoint)| {
            let [nx, ny] = point.outward;
            let arm = point.body.to_vec().rotated(pose.yaw_rad).perpendicular();
            let (along_x, along_y) = (nx * ax[0] + ny * ax[1], nx * ay[0] + ny * ay[1]);
            let rotation = if turns { along_x * arm.x + along_y * arm.y } else { 0.0 };
            let derivatives = Vector3::new(along_x, along_y, rotation);
            let edge = self.edge(&mean_profile(points, &profiles, k), reach_px);
            let (off_px, weight) = edge.unwrap_or((0.0, 0.0));
            let spread = (BLURRED_STD * self.motion_px(point) / LEAST_SCATTER_PX).hypot(1.0);
            Row { derivatives, off_px, weight, spread }
        };
        let rows: Vec<Row> = points.iter().enumerate().map(row).collect();
        rows.iter().any(|row| row.weight > 0.0).then_some(rows)
    }

    /// Motion of a point of the outline along its normal during the exposure (px).
    fn motion_px(&self, point: &OutlinePoint) -> f64 {
        let ([bx, by], [nx, ny]) = (self.appearance.blur_px, point.outward);
        (bx * nx + by * ny).abs()
    }

    /// The strongest edge of a profile, of two equal ones the nearer: its distance outside the outline (px) and its weight.
    fn edge(&self, profile: &[f64], reach_px: f64) -> Option<(f64, f64)> {
        let off_px = |i: f64| i * STEP_PX - reach_px;
        let rank = |i: usize| profile[i] * (1.0 - 0.5 * off_px(i as f64).abs() / reach_px);
        let highest = (0..profile.len()).max_by(|&a, &b| rank(a).total_cmp(&rank(b)))?;
        let best = local_maximum(profile, highest)?;
        let here = profile[best];
        if here < LEAST_STEP.max(LEAST_CONTRAST * self.appearance.contrast) {
            return None;
        }
        let shift = parabola_minimum([-profile[best - 1], -here, -profile[best + 1]]);
        Some((off_px(best as f64 + shift), here / (here + LEAST_STEP)))
    }
}

/// The mean profile of a point and of its neighbours with about the same normal.
fn mean_profile(points: &[OutlinePoint], profiles: &[Vec<f64>], k: usize) -> Vec<f64> {
    let n = points.len();
    let [nx, ny] = points[k].outward;
    let is_same = |&j: &usize| {
        let ([mx, my], apart_px) = (points[j].outward, points[j].at.distance_px(points[k].at));
        nx * mx + ny * my > SAME_DIRECTION && apart_px < 2.0 * SPACING_PX
    };
    let near: Vec<usize> = [(k + n - 1) % n, k, (k + 1) % n].into_iter().filter(is_same).collect();
    (0..profiles[k].len())
        .map(|i| near.iter().map(|&j| profiles[j][i]).sum::<f64>() / near.len() as f64)
        .collect()
}

/// The solution of the equations of a fit.
struct Solution {
    /// Changes of x, y (m) and yaw (rad).
    change: Vector3<f64>,
    /// The largest displacement of a point of the outline (px).
    largest_px: f64,
    /// The fit, at the pose without the change.
    fit: MarkerFit,
}

impl Solution {
    fn of(rows: &[Row]) -> Option<Self> {
        // Iteratively reweighted least squares, with a weak prior on the yaw: a disc does not determine it
        let mut change = Vector3::zeros();
        let mut scatter_px = LEAST_SCATTER_PX;
        let edges = || rows.iter().filter(|row| row.weight > 0.0);
        for _ in 0..ROBUST_ROUNDS {
            let residual = |row: &Row| row.off_px - row.derivatives.dot(&change);
            let middle_px = upper_median(edges().map(|row| residual(row).abs() / row.spread))?;
            scatter_px = (STD_OVER_MEDIAN_ABSOLUTE * middle_px).max(LEAST_SCATTER_PX);
            let (mut matrix, mut side) = (Matrix3::zeros(), Vector3::zeros());
            for row in edges() {
                let square = (residual(row) / (OUTLIER_STDS * scatter_px * row.spread)).powi(2);
                let weight = row.weight * (1.0 - square).max(0.0).powi(2) / (row.spread * row.spread);
                matrix += row.derivatives * row.derivatives.transpose() * weight;
                side += row.derivatives * (row.off_px * weight);
            }
            matrix[(2, 2)] += CORRELATED * (scatter_px / UNKNOWN_YAW_STD_RAD).powi(2);
            change = matrix.try_inverse()? * side;
        }

        // What was seen, and how well that determines the pose
        let is_on = |row: &&Row| {
            row.weight > 0.0
                && (row.off_px - row.derivatives.dot(&change)).abs() < ON_OUTLINE_PX * row.spread.sqrt()
        };
        let information = |rows: &mut dyn Iterator<Item = &Row>| {
            let mut matrix: Matrix3<f64> =
                rows.map(|row| row.derivatives * row.derivatives.transpose() / row.spread.powi(2)).sum();
            matrix[(2, 2)] += CORRELATED * (scatter_px / UNKNOWN_YAW_STD_RAD).powi(2);
            matrix
        };
        let whole = information(&mut rows.iter());
        let seen = information(&mut rows.iter().filter(is_on));
        let residuals_px =
            rows.iter().filter(is_on).map(|row| (row.off_px - row.derivatives.dot(&change)) / row.spread);
        let (count, squares) =
            residuals_px.fold((0.0, 0.0), |(n, sum), off_px| (n + 1.0, sum + off_px * off_px));
        let on_px = f64::sqrt(squares / f64::max(count, 1.0)).max(LEAST_SCATTER_PX);
        let covariance = seen.try_inverse()? * (on_px * on_px * CORRELATED);
        let (std_m, yaw_std_rad) = pose_stds(&covariance);
        let largest_px = rows.iter().map(|row| row.derivatives.dot(&change).abs()).fold(0.0, f64::max);
        let fit = MarkerFit {
            pose: Pose::default(),
            visible_fraction: least_ratio(whole, seen)?,
            std_m,
            yaw_std_rad,
        };
        Some(Self { change, largest_px, fit })
    }
}

/// Standard deviations of the position, along the direction in which it is largest (m), and of the yaw (rad), by a covariance whose first
/// three rows are those of x, y and yaw.
pub(super) fn pose_stds<const N: usize>(covariance: &SMatrix<f64, N, N>) -> (f64, f64) {
    let (xx, xy, yy) = (covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]);
    let half = f64::midpoint(xx, yy);
    let variance_m2 = half + (half * half - xx * yy + xy * xy).max(0.0).sqrt();
    (variance_m2.sqrt(), covariance[(2, 2)].max(0.0).sqrt())
}

/// The least of the ratios x.seen.x / x.whole.x over all directions x.
fn least_ratio(whole: Matrix3<f64>, seen: Matrix3<f64>) -> Option<f64> {
    let inverse = whole.cholesky()?.l().try_inverse()?;
    Some((inverse * seen * inverse.transpose()).symmetric_eigenvalues().min().clamp(0.0, 1.0))
}
