//! What is the pose of an object that is found by its own outline?
//!
//! The steepest step of grey level is searched along the normal of each point of the outline, and the pose is
//! corrected until the outline coincides with these edges (compare the contour tracking of Harris 1992). A robust fit
//! ignores occlusions of parts of the outline.

use super::edge_visibility::{EdgePoint, OutlineView, ReducedImage};
use super::side_band::{Band, band_widths_px, parabola_minimum};
use crate::geometry::{Pixel, Pose, Vec2, wrapped_rad};
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, sorted_by_value, upper_median};
use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};
use std::borrow::Cow;

/// An outline fitted to the image.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct OutlineFit {
    pub pose: Pose,
    /// Fraction of the outline with an edge at the fitted position, in the direction in which it is smallest: 0 to 1.
    pub visible_fraction: f64,
    /// The same without edges that are visible and do not determine a position, such as those of a side that merges with the top.
    pub measured_fraction: f64,
    /// Standard deviation of the centre along the direction in which it is largest (px).
    pub std_px: f64,
    /// By how much the edges lie outside the outline (px).
    pub enlargement_px: f64,
}

/// How far around a pose an outline is searched.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct SearchRange {
    /// Largest distance from the pose (m).
    pub radius_m: f64,
    /// Largest rotation to either side (rad).
    pub angle_rad: f64,
}

/// Distance from the outline within which edges are searched, in each round (px).
const REACHES_PX: [f64; 5] = [5.0, 4.0, 3.0, 3.0, 3.0];
/// Largest correction of a round over the reach: at edges that cross at a small angle it can exceed the distance of
/// the edges.
const LARGEST_CORRECTION: f64 = 3.0;
/// Number of rounds with the steepest edges only; afterwards the outline is close enough for the model of the side
/// bands.
const STEEPEST_ROUNDS: usize = 2;
/// Step of the profiles across the outline (px).
const STEP_PX: f64 = 0.5;
/// Neighbours on either side whose signed steps are averaged.
const NEIGHBOURS: usize = 3;
/// Smaller steps (grey levels) are noise.
const LEAST_STEP: f64 = 5.0;
/// Distance from the fitted outline within which an edge belongs to it (px).
const ON_OUTLINE_PX: f64 = 1.0;
/// Distance of an outlier (standard deviations), for Tukey's biweight.
const OUTLIER_STDS: f64 = 3.0;
/// Least scatter of edges (px).
const LEAST_SCATTER_PX: f64 = 0.1;
/// Number of neighbouring edges that count as one, because they share pixels.
const CORRELATED: f64 = 4.0;
/// Compression leaves an error that does not average out along an outline (px).
const FLOOR_STD_PX: f64 = 0.02;
/// Rounds of the robust fit; more have no visible effect.
const ROBUST_ROUNDS: usize = 4;
/// Standard deviation of an object's radius measured with a ruler (m): half a millimetre over both sides.
const RULER_STD_M: f64 = 0.25e-3;
/// Displacement for numerical derivatives of the projection (m).
const DERIVATIVE_STEP_M: f64 = 1e-4;
/// An edge displaces the steepest one if it is at least this fraction as steep.
const RIVAL: f64 = 0.3;
/// Range of widths of the visible side (px) within which its two edges merge.
const SIDE_HIDDEN_PX: f64 = 0.15;
const SIDE_SEPARATE_PX: f64 = 4.0;
/// Weight of merged edges.
const MERGED_WEIGHT: f64 = 0.02;

/// An edge of a smaller weight does not determine a position.
const LEAST_WEIGHT: f64 = 0.1;
/// A position is doubtful if less than this fraction of the outline was measured, in the direction in which this is least: clearly more than
/// one of two opposite sides, since one side of an object and the other side of its shadow may be all that the image shows.
pub(in crate::detect) const LEAST_MEASURED: f64 = 0.7;
/// Weight of a top edge that is known from its foot.
const FOOT_WEIGHT: f64 = 0.3;

/// Steps of a search in position (px) and in yaw (rad).
const SEARCH_STEP_PX: f64 = 3.0;
const SEARCH_STEP_RAD: f64 = 0.1;
/// Number of poses of a search that are fitted. A pose a few pixels off the object can be more visible than the nearest one of the grid, and
/// the far edge of a shadow more than both: there are enough for all of these.
const FITTED_POSES: usize = 16;
/// Poses nearer to each other than this many steps of the search lead to the same fit.
const NEAR_STEPS: f64 = 1.5;
/// A search starts in a reduced image, as long as the outline has this radius there (px) and up to this factor; so
/// many of its best poses are tried again in the full image.
const REDUCED_RADIUS_PX: f64 = 10.0;
const LARGEST_REDUCTION: usize = 2;
const RETRIED_POSES: usize = 128;

/// An edge in the image near an outline.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct MeasuredEdge {
    pub at: Pixel,
    /// Distance outside the outline (px).
    pub off_px: f64,
    /// Weight in a fit, 0 to 1.
    pub weight: f64,
}

/// An edge near a point of the outline.
#[derive(Clone, Copy)]
struct Edge {
    /// Distance outside the outline (px).
    off_px: f64,
    /// Weight in the fit, 0 to 1.
    weight: f64,
}

/// A pose of a search and its visibility.
type Scored = (f64, Pose);

impl OutlineView<'_> {
    /// The outline fitted to the edges near a pose; `blur_px` is its motion in the image during the exposure.
    pub(in crate::detect) fn fitted(&self, guess: Pose, blur_px: [f64; 2]) -> Option<OutlineFit> {
        self.fitted_after(STEEPEST_ROUNDS, guess, blur_px)
    }

    /// The same with the model of the side bands only after this number of rounds.
    fn fitted_after(&self, steepest_rounds: usize, guess: Pose, blur_px: [f64; 2]) -> Option<OutlineFit> {
        // Corrections of the pose
        let mut pose = guess;
        let (mut enlargement_px, mut blur_radius_px) = (0.0, None);
        for (round, reach_px) in REACHES_PX.into_iter().enumerate() {
            let contour = Contour::new(self.edge_points(pose), blur_px);
            if round == steepest_rounds {
                blur_radius_px = Some(self.blur_radius_px(&contour.merged_bands(), reach_px));
            }
            let edges = self.edges(&contour, reach_px, blur_radius_px);
            let before = pose;
            (pose, enlargement_px) = self.corrected(pose, &contour.points, &edges)?;
            // Edges of a single direction leave the pose undetermined.
            if self.displacement_px(before, pose) > LARGEST_CORRECTION * reach_px {
                return None;
            }
        }

        // Visibility and uncertainty at the final pose
        let contour = Contour::new(self.edge_points(pose), blur_px);
        let mut edges = self.edges(&contour, REACHES_PX[REACHES_PX.len() - 1], blur_radius_px);
        edges.iter_mut().flatten().for_each(|edge| edge.off_px -= enlargement_px);
        let on: Vec<bool> = contour
            .widths_px
            .iter()
            .zip(&edges)
            .map(|(width_px, edge)| is_on_outline(*width_px, edge.as_ref()))
            .collect();
        let is_measured = |edge: &Edge| edge.weight > LEAST_WEIGHT && edge.off_px.abs() < ON_OUTLINE_PX;
        let measured: Vec<bool> = edges.iter().map(|edge| edge.as_ref().is_some_and(is_measured)).collect();
        let residuals_px = edges.iter().flatten().map(|e| e.off_px).filter(|o| o.abs() < ON_OUTLINE_PX);
        let (count, squares) =
            residuals_px.fold((0.0, 0.0), |(n, sum), off_px| (n + 1.0, sum + off_px * off_px));
        let least = least_eigenvalue(normals(&contour.points, &measured));
        let std_px = (squares / count * CORRELATED / least.max(1.0)).sqrt();
        (count > 0.0).then(|| OutlineFit {
            pose,
            visible_fraction: least_fraction(&contour.points, &on),
            measured_fraction: least_fraction(&contour.points, &measured),
            std_px: std_px.max(FLOOR_STD_PX),
            enlargement_px,
        })
    }

    /// The most visible fit around a pose; `free` excludes poses.
    pub(in crate::detect) fn searched(
        &self,
        around: Pose,
        range: SearchRange,
        free: impl Fn(Pose) -> bool,
    ) -> Option<OutlineFit> {
        let reach_m = range.radius_m + self.shape.outer_radius_m();
        let pixel_m = self.camera.scale_where_shown(around.position, self.height_m, reach_m)?;
        let distance_m = |pose: &Pose| pose.position.distance(around.position);
        // By decreasing visibility; of equal ones the nearest first.
        let sorted = |tried: Vec<Scored>| {
            let nearest_first = sorted_by_value(tried, |(_, pose)| distance_m(pose));
            sorted_by_value(nearest_first, |&(visibility, _)| -visibility)
        };

        // A grid of poses in a reduced image
        let factor = (self.shape.outer_radius_m() / pixel_m / REDUCED_RADIUS_PX) as usize;
        let factor = factor.clamp(1, LARGEST_REDUCTION);
        let image =
            if factor > 1 { Cow::Owned(self.image.shrunk(factor)) } else { Cow::Borrowed(self.image) };
        let reduced = ReducedImage { image: &image, factor };
        let rotations = if self.has_yaw() { (range.angle_rad / SEARCH_STEP_RAD).ceil() as i32 } else { 0 };
        let step_m = SEARCH_STEP_PX * factor as f64 * pixel_m;
        let steps = (range.radius_m / step_m).ceil() as i32;
        let poses = grid(around, steps, step_m, rotations).filter(|&pose| free(pose));
        let mut tried = sorted(poses.map(|pose| (self.rough_visibility(reduced, pose), pose)).collect());

        // Around the best of them a finer grid in the full image
        if factor > 1 {
            let full = ReducedImage { image: self.image, factor: 1 };
            let near = |pose: Pose| grid(pose, 1, step_m / SEARCH_STEP_PX, 0);
            let best = distinct(&tried, RETRIED_POSES, NEAR_STEPS * step_m);
            let poses = best.into_iter().flat_map(near).filter(|&p| free(p));
            tried = sorted(poses.map(|pose| (self.rough_visibility(full, pose), pose)).collect());
        }

        // Fits of the best, without side bands: these take time and do not distinguish poses
        let fit =
            |pose: Pose| self.fitted_after(REACHES_PX.len(), pose, [0.0, 0.0]).filter(|fit| free(fit.pose));
        let fits = distinct(&tried, FITTED_POSES, NEAR_STEPS * step_m).into_iter().filter_map(fit);
        let best = fits.max_by(|a, b| a.visible_fraction.total_cmp(&b.visible_fraction))?;
        self.fitted(best.pose, [0.0, 0.0]).filter(|fit| free(fit.pose)).or(Some(best))
    }

    /// The edge within `reach_px` of each point of the outline at a pose, `None` where there is none.
    ///
    /// `solid` objects have a visible side below the outline; the ink of a marker has none.
    pub(in crate::detect) fn measured_edges(
        &self,
        pose: Pose,
        reach_px: f64,
        solid: bool,
    ) -> Vec<Option<MeasuredEdge>> {
        let mut contour = Contour::new(self.edge_points(pose), [0.0, 0.0]);
        if !solid {
            contour.widths_px.fill(0.0);
        }
        let blur_radius_px = self.blur_radius_px(&contour.merged_bands(), reach_px);
        let edges = self.edges(&contour, reach_px, Some(blur_radius_px));
        let measured = |(k, edge): (usize, Option<Edge>)| {
            let Edge { off_px, weight } = edge?;
            Some(MeasuredEdge { at: contour.points[k].outward_by(off_px), off_px, weight })
        };
        edges.into_iter().enumerate().map(measured).collect()
    }

    /// The top edge of a side as light as the top, from the steepest step near its foot; `None` where foot and top are no separate edges.
    fn foot_edge(&self, contour: &Contour, k: usize, reach_px: f64) -> Option<Edge> {
        let (point, width_px) = (&contour.points[k], contour.widths_px[k]);
        if width_px < SIDE_SEPARATE_PX {
            return None;
        }
        let foot = EdgePoint { at: point.outward_by(width_px), ..*point };
        let band = Band { point: &foot, ..contour.band(k) };
        let profile: Vec<f64> = self.steps_across(&band, reach_px).into_iter().map(f64::abs).collect();
        let highest = (0..profile.len()).max_by(|&a, &b| profile[a].total_cmp(&profile[b]))?;
        let best = local_maximum(&profile, highest).filter(|&best| profile[best] >= LEAST_STEP)?;
        let shift = parabola_minimum([-profile[best - 1], -profile[best], -profile[best + 1]]);
        Some(Edge { off_px: (best as f64 + shift) * STEP_PX - reach_px, weight: FOOT_WEIGHT })
    }

    /// Upper bound of the displacement of a point of the outline between two poses (px).
    fn displacement_px(&self, from: Pose, to: Pose) -> f64 {
        let displacement_m = from.position.distance(to.position)
            + (to.yaw_rad - from.yaw_rad).abs() * self.shape.outer_radius_m();
        let at = self.camera.pixel_from_table(from.position, self.height_m);
        displacement_m / self.camera.scale_m_per_px(at, self.height_m)
    }

    /// Whether the outline determines the yaw.
    fn has_yaw(&self) -> bool {
        self.shape.rotation_symmetry_rad() != Some(0.0)
    }

    /// The edge near each point, if there is one: the steepest, or if another edge is near, of a visible side or a
    /// shadow, the top edge of the side band.
    fn edges(&self, contour: &Contour, reach_px: f64, blur_radius_px: Option<f64>) -> Vec<Option<Edge>> {
        let n = contour.points.len();
        let profiles: Vec<Vec<f64>> = (0..n).map(|k| self.steps_across(&contour.band(k), reach_px)).collect();
        let mean = |k: usize, i: usize| {
            let near = (0..=2 * NEIGHBOURS).map(|j| profiles[(k + n + j - NEIGHBOURS) % n][i]);
            near.sum::<f64>() / (2 * NEIGHBOURS + 1) as f64
        };
        let count = (reach_px / STEP_PX) as usize * 2 + 1;
        // The steepest edge, and whether it is the only one
        let steepest = |k: usize| {
            let profile: Vec<f64> = (0..count).map(|i| mean(k, i).abs()).collect();
            let off_px = |i: f64| i * STEP_PX - reach_px;
            // Of two equal ones the nearer.
            let weight = |i: usize| profile[i] * (1.0 - 0.5 * off_px(i as f64).abs() / reach_px);
            let highest = (0..count).max_by(|&a, &b| weight(a).total_cmp(&weight(b)))?;
            let best = local_maximum(&profile, highest).filter(|&best| profile[best] >= LEAST_STEP)?;
            let here = profile[best];
            let rival = |i: usize| local_maximum(&profile, i) == Some(i) && profile[i] > RIVAL * here;
            let single = !(0..count).any(|i| i.abs_diff(best) > 1 && rival(i));
            let shift = parabola_minimum([-profile[best - 1], -here, -profile[best + 1]]);
            let single = single && !contour.is_merged(k);
            let factor = if single { 1.0 } else { MERGED_WEIGHT };
            let weight = factor * here / (here + LEAST_STEP);
            Some((single, Edge { off_px: off_px(best as f64 + shift), weight }))
        };
        // The top edge of the side band
        let above_band = |k: usize| {
            let found = self.band_edge(contour.band(k), reach_px, blur_radius_px?)?;
            let weight = 1.0 / (1.0 + (found.std_px / LEAST_SCATTER_PX).powi(2));
            let determined = found.std_px < ON_OUTLINE_PX / OUTLIER_STDS;
            determined.then_some(Edge { off_px: found.off_px, weight })
        };
        let best = |k: usize| match steepest(k) {
            Some((true, edge)) => Some(edge),
            other => {
                let top = above_band(k).or(other.map(|(_, edge)| edge));
                top.or_else(|| self.foot_edge(contour, k, reach_px))
            }
        };
        (0..n).map(best).collect()
    }

    /// Steps of grey level across a point of the outline, outside minus inside; NaN beyond the border of the image.
    fn steps_across(&self, band: &Band, reach_px: f64) -> Vec<f64> {
        // An edge with motion blur has its largest step between the ends of the motion.
        let half_px = (0.5 * band.motion_px).max(1.0);
        let read =
            |distance_px: f64| self.image.grey_at(band.point.outward_by(distance_px)).unwrap_or(f64::NAN);
        let count = (reach_px / STEP_PX) as usize * 2 + 1;
        let off_px = |i: usize| i as f64 * STEP_PX - reach_px;
        (0..count).map(|i| read(off_px(i) + half_px) - read(off_px(i) - half_px)).collect()
    }

    /// The pose corrected by robust least squares so that the outline coincides with the edges, and the enlargement
    /// of the outline that is estimated with it (px): an error of the measured size must not displace an object of
    /// which one side is more visible.
    fn corrected(&self, pose: Pose, points: &[EdgePoint], edges: &[Option<Edge>]) -> Option<(Pose, f64)> {
        // Derivatives of the image position by the object's position (px per m)
        let pixel = |at: Vec2| self.camera.pixel_from_table(pose.position + at, self.height_m);
        let at = pixel(Vec2::ZERO);
        let (right, up) =
            (pixel(Vec2::new(DERIVATIVE_STEP_M, 0.0)), pixel(Vec2::new(0.0, DERIVATIVE_STEP_M)));
        let [ax, ay] =
            [right, up].map(|p| [(p.x - at.x) / DERIVATIVE_STEP_M, (p.y - at.y) / DERIVATIVE_STEP_M]);
        let ruler_std_px = RULER_STD_M / self.camera.scale_m_per_px(at, self.height_m);

        // One equation per edge in x, y, yaw and enlargement
        let rows: Vec<(Vector4<f64>, Edge)> = points
            .iter()
            .zip(edges)
            .filter_map(|(point, edge)| {
                let (edge, [nx, ny]) = ((*edge)?, point.outward);
                let (along_x, along_y) = (nx * ax[0] + ny * ax[1], nx * ay[0] + ny * ay[1]);
                let arm = point.body.to_vec().rotated(pose.yaw_rad).perpendicular();
                let rotation = if self.has_yaw() { along_x * arm.x + along_y * arm.y } else { 0.0 };
                Some((Vector4::new(along_x, along_y, rotation, 1.0), edge))
            })
            .collect();

        // Iteratively reweighted least squares
        let mut change = Vector4::zeros();
        for _ in 0..ROBUST_ROUNDS {
            let residual = |(row, edge): &(Vector4<f64>, Edge)| edge.off_px - row.dot(&change);
            let middle_px = upper_median(rows.iter().map(|r| residual(r).abs()).chain([0.0]))?;
            let scatter_px = (STD_OVER_MEDIAN_ABSOLUTE * middle_px).max(LEAST_SCATTER_PX);
            let (mut matrix, mut side) = (Matrix4::zeros(), Vector4::zeros());
            for row in &rows {
                // Tukey's biweight.
                let square = (residual(row) / (OUTLIER_STDS * scatter_px)).powi(2);
                let weight = row.1.weight * (1.0 - square).max(0.0).powi(2);
                matrix += row.0 * row.0.transpose() * weight;
                side += row.0 * (row.1.off_px * weight);
            }
            if !self.has_yaw() {
                matrix[(2, 2)] = 1.0;
            }
            matrix[(3, 3)] += CORRELATED * (scatter_px / ruler_std_px).powi(2);
            change = matrix.try_inverse()? * side;
        }
        let corrected = Pose {
            position: pose.position + Vec2::new(change[0], change[1]),
            yaw_rad: pose.yaw_rad + change[2],
        };
        corrected.position.is_finite().then_some((corrected, change[3]))
    }
}

/// The best of the poses, each further than `near_m` from the better ones or turned by some steps, so that the neighbours of
/// one maximum do not hide the others.
fn distinct(tried: &[Scored], most: usize, near_m: f64) -> Vec<Pose> {
    let mut kept: Vec<Pose> = Vec::new();
    for (_, pose) in tried {
        let is_near = |other: &Pose| {
            let turned_rad = wrapped_rad(other.yaw_rad - pose.yaw_rad).abs();
            other.position.distance(pose.position) < near_m && turned_rad < NEAR_STEPS * SEARCH_STEP_RAD
        };
        if !kept.iter().any(is_near) {
            kept.push(*pose);
        }
        if kept.len() == most {
            break;
        }
    }
    kept
}

/// Poses within `n` steps of one, each with this number of rotations to either side.
fn grid(around: Pose, n: i32, step_m: f64, rotations: i32) -> impl Iterator<Item = Pose> {
    let steps = (-n..=n).flat_map(move |i| (-n..=n).map(move |j| (i, j)));
    // A disc of positions; for a single step all eight neighbours.
    let near = steps.filter(move |(i, j)| i * i + j * j <= n * n.max(2));
    near.flat_map(move |(i, j)| {
        let position = around.position + Vec2::new(f64::from(i), f64::from(j)) * step_m;
        let rotated = move |k: i32| around.yaw_rad + f64::from(k) * SEARCH_STEP_RAD;
        (-rotations..=rotations).map(move |k| Pose { position, yaw_rad: rotated(k) })
    })
}

/// The points of an outline, and the width of the visible side beyond each (px).
struct Contour {
    points: Vec<EdgePoint>,
    widths_px: Vec<f64>,
    blur_px: [f64; 2],
}

impl Contour {
    fn new(points: Vec<EdgePoint>, blur_px: [f64; 2]) -> Self {
        Self { widths_px: band_widths_px(&points), points, blur_px }
    }

    /// A point with its band, of width zero where the edges are separate or the side is hidden.
    fn band(&self, k: usize) -> Band<'_> {
        let (point, [bx, by]) = (&self.points[k], self.blur_px);
        let [nx, ny] = point.outward;
        let width_px = if self.is_merged(k) { self.widths_px[k] } else { 0.0 };
        Band { point, width_px, motion_px: (bx * nx + by * ny).abs() }
    }

    /// Whether the side is so narrow that its two edges merge.
    fn is_merged(&self, k: usize) -> bool {
        (SIDE_HIDDEN_PX..SIDE_SEPARATE_PX).contains(&self.widths_px[k])
    }

    fn merged_bands(&self) -> Vec<Band<'_>> {
        (0..self.points.len()).filter(|&k| self.is_merged(k)).map(|k| self.band(k)).collect()
    }
}

/// Whether the edge near a point is that of the outline, or of the side band that merges with it.
fn is_on_outline(width_px: f64, edge: Option<&Edge>) -> bool {
    let width_px = if width_px < SIDE_SEPARATE_PX { width_px } else { 0.0 };
    edge.is_some_and(|e| e.off_px > -ON_OUTLINE_PX && e.off_px < ON_OUTLINE_PX + width_px)
}

/// The fraction of the points of an outline that are on it, in the direction in which it is smallest: two parallel sides alone leave the
/// position along them undetermined.
fn least_fraction(points: &[EdgePoint], on: &[bool]) -> f64 {
    let all = vec![true; points.len()];
    let Some(inverse) = normals(points, &all).try_inverse() else { return 0.0 };
    least_eigenvalue(inverse * normals(points, on))
}

/// The sum of the outer products of the normals of those points that are on the outline: how well they determine a position, by direction.
fn normals(points: &[EdgePoint], on: &[bool]) -> Matrix2<f64> {
    let normals = points.iter().zip(on).filter(|(_, on)| **on).map(|(point, _)| Vector2::from(point.outward));
    normals.map(|n| n * n.transpose()).sum()
}

/// The smaller one of the real eigenvalues of a matrix, which need not be symmetric.
fn least_eigenvalue(matrix: Matrix2<f64>) -> f64 {
    let half = matrix.trace() / 2.0;
    half - (half * half - matrix.determinant()).max(0.0).sqrt()
}

/// The local maximum uphill of an index; `None` at an end of the profile or next to NaN.
pub(in crate::detect) fn local_maximum(profile: &[f64], mut at: usize) -> Option<usize> {
    loop {
        let (before, after) = (*profile.get(at.checked_sub(1)?)?, *profile.get(at + 1)?);
        if before.is_nan() || after.is_nan() || profile[at].is_nan() {
            return None;
        }
        if before > profile[at] && before >= after {
            at -= 1;
        } else if after > profile[at] {
            at += 1;
        } else {
            return Some(at);
        }
    }
}
