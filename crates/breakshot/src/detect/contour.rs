//! Where exactly does an object lie that is seen by its own outline?
//!
//! Along the normal of each point of the outline the steepest step of grey is looked for, and the pose moves until the
//! outline lies on these steps; whatever lies across part of it is left out.

use super::blob::{NORMAL_PER_MEDIAN, median};
use super::outline::{EdgePoint, Scene};
use crate::geometry::{Pixel, Pose, Vec2};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// An outline laid onto the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub pose: Pose,
    /// The part of the outline along which there is an edge where it should be, 0 to 1.
    pub shown: f64,
    /// One standard deviation of the centre's noise along each axis (px).
    pub std_px: f64,
}

/// How far from the outline edges are looked for, round by round (px).
const REACHES_PX: [f64; 5] = [5.0, 4.0, 3.0, 3.0, 3.0];
/// Profiles across the outline are read in these steps (px).
const STEP_PX: f64 = 0.5;
/// Steps of this many neighbours on either side are averaged with their signs.
const NEIGHBOURS: usize = 3;
/// A step of fewer grey levels is noise.
const LEAST_STEP: f64 = 5.0;
/// An edge this near to the fitted outline belongs to it (px).
const ON_OUTLINE_PX: f64 = 1.0;
/// Edges further off than this many standard deviations are something else's.
const OUTLIER_STDS: f64 = 3.0;
/// Edges are not found more finely than this (px).
const LEAST_SCATTER_PX: f64 = 0.1;
/// Edges of neighbouring points come from the same pixels: so many count as one.
const ALIKE: f64 = 4.0;
/// Compression leaves an error that does not average out over an outline (px).
const FLOOR_STD_PX: f64 = 0.02;
/// A search tries places this far apart (px) and directions this far apart (rad).
const SEARCH_STEP_PX: f64 = 3.0;
const SEARCH_TURN_RAD: f64 = 0.1;
/// Of a search's places so many are looked at closely.
const CLOSE_LOOKS: usize = 4;

/// An edge beside a point of the outline.
#[derive(Clone, Copy)]
struct Edge {
    /// How far outside the outline it lies (px).
    off_px: f64,
    step: f64,
    /// Whether no other edge is near: two that run together are both moved.
    alone: bool,
}

impl Scene<'_> {
    /// The outline laid onto the edges near `guess`; `blur_px` is how far it moved while the shutter was open.
    pub(super) fn laid(&self, guess: Pose, blur_px: [f64; 2]) -> Option<Fit> {
        let mut pose = guess;
        for reach_px in REACHES_PX {
            let points = self.edge_points(pose);
            let edges = self.edges(&points, reach_px, blur_px);
            pose = self.moved(pose, &points, &edges)?;
        }
        let points = self.edge_points(pose);
        let edges = self.edges(&points, REACHES_PX[REACHES_PX.len() - 1], blur_px);
        let on: Vec<bool> =
            points.iter().zip(&edges).map(|(point, edge)| on_outline(point, edge.as_ref())).collect();
        let offs_px = edges.iter().flatten().map(|e| e.off_px).filter(|o| o.abs() < ON_OUTLINE_PX);
        let (count, squares) = offs_px.fold((0.0, 0.0), |(n, sum), off_px| (n + 1.0, sum + off_px * off_px));
        let std_px = (squares / count * 2.0 * ALIKE / count).sqrt();
        (count > 0.0).then(|| Fit { pose, shown: shown(&points, &on), std_px: std_px.max(FLOOR_STD_PX) })
    }

    /// The best of the outlines laid at most `reach_m` and `turn_rad` from a pose; `free` says where it may lie.
    pub(super) fn searched(
        &self,
        around: Pose,
        (reach_m, turn_rad): (f64, f64),
        free: impl Fn(Pose) -> bool,
    ) -> Option<Fit> {
        let at = self.camera.pixel_from_table(around.position, self.height_m);
        let step_m = SEARCH_STEP_PX * self.camera.scale_m_per_px(at, self.height_m);
        if !step_m.is_finite() {
            return None;
        }
        let turns = if self.turns() { (turn_rad / SEARCH_TURN_RAD).ceil() as i32 } else { 0 };
        let n = (reach_m / step_m).ceil() as i32;
        let mut tried: Vec<(f64, Pose)> = Vec::new();
        for (i, j) in
            (-n..=n).flat_map(|i| (-n..=n).map(move |j| (i, j))).filter(|(i, j)| i * i + j * j <= n * n)
        {
            for turn in -turns..=turns {
                let position = around.position + Vec2::new(f64::from(i), f64::from(j)) * step_m;
                let pose = Pose { position, yaw_rad: around.yaw_rad + f64::from(turn) * SEARCH_TURN_RAD };
                if free(pose) {
                    tried.push((self.rough_visibility(pose), pose));
                }
            }
        }
        // The nearer of two that are alike.
        let far = |pose: &Pose| pose.position.distance(around.position);
        tried.sort_by(|a, b| b.0.total_cmp(&a.0).then(far(&a.1).total_cmp(&far(&b.1))));
        let looks = tried.iter().take(CLOSE_LOOKS).filter_map(|(_, pose)| self.laid(*pose, [0.0, 0.0]));
        looks.filter(|fit| free(fit.pose)).max_by(|a, b| a.shown.total_cmp(&b.shown))
    }

    /// Whether the outline tells how the object is turned.
    pub(super) fn turns(&self) -> bool {
        self.shape.rotation_symmetry_rad() != Some(0.0)
    }

    /// The steepest edge beside each point, if there is one.
    fn edges(&self, points: &[EdgePoint], reach_px: f64, blur_px: [f64; 2]) -> Vec<Option<Edge>> {
        let n = points.len();
        let profiles: Vec<Vec<f64>> = points.iter().map(|p| self.profile(p, reach_px, blur_px)).collect();
        let mean = |k: usize, i: usize| {
            let near = (0..=2 * NEIGHBOURS).map(|j| profiles[(k + n + j - NEIGHBOURS) % n][i]);
            near.sum::<f64>() / (2 * NEIGHBOURS + 1) as f64
        };
        let steps = (reach_px / STEP_PX) as usize * 2 + 1;
        let edge = |k: usize| {
            let profile: Vec<f64> = (0..steps).map(|i| mean(k, i).abs()).collect();
            let off_px = |i: f64| i * STEP_PX - reach_px;
            // The nearer one of two that are alike.
            let weight = |i: usize| profile[i] * (1.0 - 0.5 * off_px(i as f64).abs() / reach_px);
            let steepest = (0..steps).max_by(|&a, &b| weight(a).total_cmp(&weight(b)))?;
            let best = summit(&profile, steepest).filter(|&best| profile[best] >= LEAST_STEP)?;
            let [before, here, after] = [profile[best - 1], profile[best], profile[best + 1]];
            let rival = |i: usize| summit(&profile, i) == Some(i) && profile[i] > RIVAL * here;
            let alone = !(0..steps).any(|i| i.abs_diff(best) > 1 && rival(i));
            let bend = before - 2.0 * here + after;
            let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
            Some(Edge { off_px: off_px(best as f64 + shift), step: here, alone })
        };
        (0..n).map(edge).collect()
    }

    /// Steps of grey across a point of the outline, outside minus inside; NaN past the picture's edge.
    fn profile(&self, point: &EdgePoint, reach_px: f64, blur_px: [f64; 2]) -> Vec<f64> {
        let [nx, ny] = point.outward;
        // An edge smeared over some way steps most between the ends of that way.
        let half_px = (0.5 * (blur_px[0] * nx + blur_px[1] * ny).abs()).max(1.0);
        let read = |way_px: f64| {
            let place = Pixel::new(point.at.x + nx * way_px, point.at.y + ny * way_px);
            self.image.grey_at(place).unwrap_or(f64::NAN)
        };
        let steps = (reach_px / STEP_PX) as usize * 2 + 1;
        let off_px = |i: usize| i as f64 * STEP_PX - reach_px;
        (0..steps).map(|i| read(off_px(i) + half_px) - read(off_px(i) - half_px)).collect()
    }

    /// The pose moved so that the outline lies on the edges (robust least squares).
    fn moved(&self, pose: Pose, points: &[EdgePoint], edges: &[Option<Edge>]) -> Option<Pose> {
        let step_m = 1e-4;
        let pixel = |at: Vec2| self.camera.pixel_from_table(pose.position + at, self.height_m);
        let (at, right, up) =
            (pixel(Vec2::ZERO), pixel(Vec2::new(step_m, 0.0)), pixel(Vec2::new(0.0, step_m)));
        // How the picture moves with the object (px per m).
        let [ax, ay] = [right, up].map(|p| [(p.x - at.x) / step_m, (p.y - at.y) / step_m]);
        let rows: Vec<(Vector3<f64>, f64, f64)> = points
            .iter()
            .zip(edges)
            .filter_map(|(point, edge)| {
                let (edge, [nx, ny]) = ((*edge)?, point.outward);
                let (along_x, along_y) = (nx * ax[0] + ny * ax[1], nx * ay[0] + ny * ay[1]);
                let arm = point.body.to_vec().rotated(pose.yaw_rad).perpendicular();
                let turning = if self.turns() { along_x * arm.x + along_y * arm.y } else { 0.0 };
                let merged = (SIDE_HIDDEN_PX..SIDE_APART_PX).contains(&point.side_px);
                let alone = if edge.alone && !merged { 1.0 } else { TOGETHER };
                let weight = alone * edge.step / (edge.step + LEAST_STEP);
                Some((Vector3::new(along_x, along_y, turning), edge.off_px, weight))
            })
            .collect();
        let mut change = Vector3::zeros();
        for _ in 0..ROBUST_ROUNDS {
            let off = |(row, off_px, _): &(Vector3<f64>, f64, f64)| off_px - row.dot(&change);
            let scatter =
                NORMAL_PER_MEDIAN * median(rows.iter().map(|r| off(r).abs()).chain([0.0]).collect());
            let limit_px = OUTLIER_STDS * scatter.max(LEAST_SCATTER_PX);
            let (mut matrix, mut side) = (Matrix3::zeros(), Vector3::zeros());
            for row in &rows {
                // Tukey's weights.
                let part = (off(row) / limit_px).powi(2);
                let weight = row.2 * (1.0 - part).max(0.0).powi(2);
                matrix += row.0 * row.0.transpose() * weight;
                side += row.0 * (row.1 * weight);
            }
            if !self.turns() {
                matrix[(2, 2)] = 1.0;
            }
            change = matrix.try_inverse()? * side;
        }
        let moved = Pose {
            position: pose.position + Vec2::new(change[0], change[1]),
            yaw_rad: pose.yaw_rad + change[2],
        };
        moved.position.is_finite().then_some(moved)
    }
}

/// An edge as steep as this part of the steepest one moves it.
const RIVAL: f64 = 0.3;
/// Where an object's side shows as a strip between these widths (px), its two edges run into one.
const SIDE_HIDDEN_PX: f64 = 0.15;
const SIDE_APART_PX: f64 = 4.0;
/// Edges that run together count little.
const TOGETHER: f64 = 0.02;

/// Whether the edge beside a point is the outline's, or that of the strip of side that runs into it.
fn on_outline(point: &EdgePoint, edge: Option<&Edge>) -> bool {
    let strip_px = if point.side_px < SIDE_APART_PX { point.side_px.max(0.0) } else { 0.0 };
    edge.is_some_and(|e| e.off_px > -ON_OUTLINE_PX && e.off_px < ON_OUTLINE_PX + strip_px)
}

/// The part of the outline that shows, in the direction in which the least of it does: two sides of a bar alone do not
/// tell where along them it lies.
fn shown(points: &[EdgePoint], on: &[bool]) -> f64 {
    let sum = |counts: &dyn Fn(usize) -> bool| {
        let normals =
            points.iter().enumerate().filter(|(k, _)| counts(*k)).map(|(_, p)| Vector2::from(p.outward));
        normals.map(|n| n * n.transpose()).sum::<Matrix2<f64>>()
    };
    let Some(inverse) = sum(&|_| true).try_inverse() else { return 0.0 };
    let parts = inverse * sum(&|k| on[k]);
    let half = parts.trace() / 2.0;
    half - (half * half - parts.determinant()).max(0.0).sqrt()
}

/// The top of the hill on which a place lies; none at an end of the profile, or where there is no picture.
fn summit(profile: &[f64], mut at: usize) -> Option<usize> {
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

/// Weights and fits by turns; more change nothing visible.
const ROBUST_ROUNDS: usize = 4;
