//! Where exactly does an object lie that is seen by its own outline?
//!
//! Along the normal of each point of the outline the steepest step of grey is looked for, and the pose moves until the
//! outline lies on these steps; whatever lies across part of it is left out.

use super::edge_visibility::{EdgePoint, Scene};
use super::side_band::{Strip, strips_px, vertex};
use crate::geometry::{Pixel, Pose, Vec2};
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, upper_median};
use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};
use std::borrow::Cow;

/// An outline laid onto the picture.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct Fit {
    pub pose: Pose,
    /// The part of the outline along which there is an edge where it should be, 0 to 1.
    pub shown: f64,
    /// One standard deviation of the centre's noise along each axis (px).
    pub std_px: f64,
}

/// How far from the outline edges are looked for, round by round (px).
const REACHES_PX: [f64; 5] = [5.0, 4.0, 3.0, 3.0, 3.0];
/// No outline moves further in a round than this many times as far as its edges lie: two that cross askew are further off.
const FURTHEST: f64 = 3.0;
/// For so many rounds the steepest edges have to do; then strips of side are close enough to be looked at.
const STEEPEST_ROUNDS: usize = 2;
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
/// A search goes through the picture made smaller, as long as the outline reaches this far from its middle there (px),
/// at most so many times; of its places so many are looked at again in the picture itself.
const SMALL_RADIUS_PX: f64 = 10.0;
const MOST_SHRUNK: usize = 2;
const SECOND_LOOKS: usize = 32;

/// An edge beside a point of the outline.
#[derive(Clone, Copy)]
struct Edge {
    /// How far outside the outline it lies (px).
    off_px: f64,
    /// What it counts, 0 to 1.
    weight: f64,
}

impl Scene<'_> {
    /// The outline laid onto the edges near `guess`; `blur_px` is how far it moved while the shutter was open.
    pub(in crate::detect) fn laid(&self, guess: Pose, blur_px: [f64; 2]) -> Option<Fit> {
        self.fitted(guess, blur_px, STEEPEST_ROUNDS)
    }

    fn fitted(&self, guess: Pose, blur_px: [f64; 2], steepest_rounds: usize) -> Option<Fit> {
        let mut pose = guess;
        let (mut larger_px, mut smear_px) = (0.0, None);
        for (round, reach_px) in REACHES_PX.into_iter().enumerate() {
            let rim = Rim::new(self.edge_points(pose), blur_px);
            if round == steepest_rounds {
                smear_px = Some(self.smear_px(&rim.strips(), reach_px));
            }
            let edges = self.edges(&rim, reach_px, smear_px);
            let before = pose;
            (pose, larger_px) = self.moved(pose, &rim.points, &edges)?;
            // Edges along one direction alone hold nothing.
            if self.way_px(before, pose) > FURTHEST * reach_px {
                return None;
            }
        }
        let rim = Rim::new(self.edge_points(pose), blur_px);
        let mut edges = self.edges(&rim, REACHES_PX[REACHES_PX.len() - 1], smear_px);
        edges.iter_mut().flatten().for_each(|edge| edge.off_px -= larger_px);
        let on: Vec<bool> = rim
            .strips_px
            .iter()
            .zip(&edges)
            .map(|(strip_px, edge)| on_outline(*strip_px, edge.as_ref()))
            .collect();
        let offs_px = edges.iter().flatten().map(|e| e.off_px).filter(|o| o.abs() < ON_OUTLINE_PX);
        let (count, squares) = offs_px.fold((0.0, 0.0), |(n, sum), off_px| (n + 1.0, sum + off_px * off_px));
        let std_px = (squares / count * 2.0 * ALIKE / count).sqrt();
        (count > 0.0).then(|| Fit { pose, shown: shown(&rim.points, &on), std_px: std_px.max(FLOOR_STD_PX) })
    }

    /// The best of the outlines laid at most `reach_m` and `turn_rad` from a pose; `free` says where it may lie.
    pub(in crate::detect) fn searched(
        &self,
        around: Pose,
        (reach_m, turn_rad): (f64, f64),
        free: impl Fn(Pose) -> bool,
    ) -> Option<Fit> {
        let at = self.camera.pixel_from_table(around.position, self.height_m);
        let pixel_m = self.camera.scale_m_per_px(at, self.height_m);
        if !pixel_m.is_finite() {
            return None;
        }
        let far = |pose: &Pose| pose.position.distance(around.position);
        // The nearer of two that are alike.
        let sorted = |mut tried: Vec<(f64, Pose)>| {
            tried.sort_by(|a, b| b.0.total_cmp(&a.0).then(far(&a.1).total_cmp(&far(&b.1))));
            tried
        };
        let factor = (self.shape.outer_radius_m() / pixel_m / SMALL_RADIUS_PX) as usize;
        let factor = factor.clamp(1, MOST_SHRUNK);
        let small =
            if factor > 1 { Cow::Owned(self.image.shrunk(factor)) } else { Cow::Borrowed(self.image) };
        let turns = if self.turns() { (turn_rad / SEARCH_TURN_RAD).ceil() as i32 } else { 0 };
        let step_m = SEARCH_STEP_PX * factor as f64 * pixel_m;
        let poses = grid(around, (reach_m / step_m).ceil() as i32, step_m, turns).filter(|&pose| free(pose));
        let mut tried =
            sorted(poses.map(|pose| (self.rough_visibility((&small, factor), pose), pose)).collect());
        if factor > 1 {
            let near = |pose: Pose| grid(pose, 1, step_m / SEARCH_STEP_PX, 0);
            let poses =
                tried.iter().take(SECOND_LOOKS).flat_map(|(_, pose)| near(*pose)).filter(|&p| free(p));
            tried = sorted(poses.map(|pose| (self.rough_visibility((self.image, 1), pose), pose)).collect());
        }
        // Strips of side take time, and do not tell one place from another.
        let look = |pose: Pose| self.fitted(pose, [0.0, 0.0], REACHES_PX.len()).filter(|fit| free(fit.pose));
        let looks = tried.iter().take(CLOSE_LOOKS).filter_map(|(_, pose)| look(*pose));
        let best = looks.max_by(|a, b| a.shown.total_cmp(&b.shown))?;
        self.laid(best.pose, [0.0, 0.0]).filter(|fit| free(fit.pose)).or(Some(best))
    }

    /// How far a point of the outline moves from one pose to another, at most (px).
    fn way_px(&self, from: Pose, to: Pose) -> f64 {
        let way_m = from.position.distance(to.position)
            + (to.yaw_rad - from.yaw_rad).abs() * self.shape.outer_radius_m();
        let at = self.camera.pixel_from_table(from.position, self.height_m);
        way_m / self.camera.scale_m_per_px(at, self.height_m)
    }

    /// Whether the outline tells how the object is turned.
    pub(in crate::detect) fn turns(&self) -> bool {
        self.shape.rotation_symmetry_rad() != Some(0.0)
    }

    /// The edge beside each point, if there is one: the steepest, or where another is near, of a strip of side or
    /// shadow, the rim above it.
    fn edges(&self, rim: &Rim, reach_px: f64, smear_px: Option<f64>) -> Vec<Option<Edge>> {
        let n = rim.points.len();
        let profiles: Vec<Vec<f64>> = (0..n).map(|k| self.profile(&rim.strip(k), reach_px)).collect();
        let mean = |k: usize, i: usize| {
            let near = (0..=2 * NEIGHBOURS).map(|j| profiles[(k + n + j - NEIGHBOURS) % n][i]);
            near.sum::<f64>() / (2 * NEIGHBOURS + 1) as f64
        };
        let steps = (reach_px / STEP_PX) as usize * 2 + 1;
        let steepest = |k: usize| {
            let profile: Vec<f64> = (0..steps).map(|i| mean(k, i).abs()).collect();
            let off_px = |i: f64| i * STEP_PX - reach_px;
            // The nearer one of two that are alike.
            let weight = |i: usize| profile[i] * (1.0 - 0.5 * off_px(i as f64).abs() / reach_px);
            let highest = (0..steps).max_by(|&a, &b| weight(a).total_cmp(&weight(b)))?;
            let best = summit(&profile, highest).filter(|&best| profile[best] >= LEAST_STEP)?;
            let here = profile[best];
            let rival = |i: usize| summit(&profile, i) == Some(i) && profile[i] > RIVAL * here;
            let alone = !(0..steps).any(|i| i.abs_diff(best) > 1 && rival(i));
            let shift = vertex([-profile[best - 1], -here, -profile[best + 1]]);
            let alone = alone && !rim.merged(k);
            let part = if alone { 1.0 } else { TOGETHER };
            Some((
                alone,
                Edge { off_px: off_px(best as f64 + shift), weight: part * here / (here + LEAST_STEP) },
            ))
        };
        let above_strip = |k: usize| {
            let found = self.strip_edge(rim.strip(k), reach_px, smear_px?)?;
            let weight = 1.0 / (1.0 + (found.std_px / LEAST_SCATTER_PX).powi(2));
            let tells = found.std_px < ON_OUTLINE_PX / OUTLIER_STDS;
            tells.then_some(Edge { off_px: found.off_px, weight })
        };
        let best = |k: usize| match steepest(k) {
            Some((true, edge)) => Some(edge),
            other => above_strip(k).or(other.map(|(_, edge)| edge)),
        };
        (0..n).map(best).collect()
    }

    /// Steps of grey across a point of the outline, outside minus inside; NaN past the picture's edge.
    fn profile(&self, strip: &Strip, reach_px: f64) -> Vec<f64> {
        let (point, [nx, ny]) = (strip.point, strip.point.outward);
        // An edge smeared over some way steps most between the ends of that way.
        let half_px = (0.5 * strip.motion_px).max(1.0);
        let read = |way_px: f64| {
            let place = Pixel::new(point.at.x + nx * way_px, point.at.y + ny * way_px);
            self.image.grey_at(place).unwrap_or(f64::NAN)
        };
        let steps = (reach_px / STEP_PX) as usize * 2 + 1;
        let off_px = |i: usize| i as f64 * STEP_PX - reach_px;
        (0..steps).map(|i| read(off_px(i) + half_px) - read(off_px(i) - half_px)).collect()
    }

    /// The pose moved so that the outline lies on the edges (robust least squares), and how much larger all round than
    /// told the outline then is (px): what a ruler read wrongly must not move it where one side shows better.
    fn moved(&self, pose: Pose, points: &[EdgePoint], edges: &[Option<Edge>]) -> Option<(Pose, f64)> {
        let step_m = 1e-4;
        let pixel = |at: Vec2| self.camera.pixel_from_table(pose.position + at, self.height_m);
        let (at, right, up) =
            (pixel(Vec2::ZERO), pixel(Vec2::new(step_m, 0.0)), pixel(Vec2::new(0.0, step_m)));
        // How the picture moves with the object (px per m).
        let [ax, ay] = [right, up].map(|p| [(p.x - at.x) / step_m, (p.y - at.y) / step_m]);
        let ruler_std_px = RULER_STD_M / self.camera.scale_m_per_px(at, self.height_m);
        let rows: Vec<(Vector4<f64>, Edge)> = points
            .iter()
            .zip(edges)
            .filter_map(|(point, edge)| {
                let (edge, [nx, ny]) = ((*edge)?, point.outward);
                let (along_x, along_y) = (nx * ax[0] + ny * ax[1], nx * ay[0] + ny * ay[1]);
                let arm = point.body.to_vec().rotated(pose.yaw_rad).perpendicular();
                let turning = if self.turns() { along_x * arm.x + along_y * arm.y } else { 0.0 };
                Some((Vector4::new(along_x, along_y, turning, 1.0), edge))
            })
            .collect();
        let mut change = Vector4::zeros();
        for _ in 0..ROBUST_ROUNDS {
            let off = |(row, edge): &(Vector4<f64>, Edge)| edge.off_px - row.dot(&change);
            let middle_px = upper_median(rows.iter().map(|r| off(r).abs()).chain([0.0]))?;
            let scatter = STD_OVER_MEDIAN_ABSOLUTE * middle_px;
            let scatter_px = scatter.max(LEAST_SCATTER_PX);
            let (mut matrix, mut side) = (Matrix4::zeros(), Vector4::zeros());
            for row in &rows {
                // Tukey's weights.
                let part = (off(row) / (OUTLIER_STDS * scatter_px)).powi(2);
                let weight = row.1.weight * (1.0 - part).max(0.0).powi(2);
                matrix += row.0 * row.0.transpose() * weight;
                side += row.0 * (row.1.off_px * weight);
            }
            if !self.turns() {
                matrix[(2, 2)] = 1.0;
            }
            matrix[(3, 3)] += ALIKE * (scatter_px / ruler_std_px).powi(2);
            change = matrix.try_inverse()? * side;
        }
        let moved = Pose {
            position: pose.position + Vec2::new(change[0], change[1]),
            yaw_rad: pose.yaw_rad + change[2],
        };
        moved.position.is_finite().then_some((moved, change[3]))
    }
}

/// Poses at most `n` steps from one, and so many turns to either side.
fn grid(around: Pose, n: i32, step_m: f64, turns: i32) -> impl Iterator<Item = Pose> {
    let steps = (-n..=n).flat_map(move |i| (-n..=n).map(move |j| (i, j)));
    // A disc of places; of a single step all eight around it.
    let near = steps.filter(move |(i, j)| i * i + j * j <= n * n.max(2));
    near.flat_map(move |(i, j)| {
        let position = around.position + Vec2::new(f64::from(i), f64::from(j)) * step_m;
        let turned = move |turn: i32| around.yaw_rad + f64::from(turn) * SEARCH_TURN_RAD;
        (-turns..=turns).map(move |turn| Pose { position, yaw_rad: turned(turn) })
    })
}

/// An outline's points, and how wide the side shows beyond each (px).
struct Rim {
    points: Vec<EdgePoint>,
    strips_px: Vec<f64>,
    blur_px: [f64; 2],
}

impl Rim {
    fn new(points: Vec<EdgePoint>, blur_px: [f64; 2]) -> Self {
        Self { strips_px: strips_px(&points), points, blur_px }
    }

    fn strip(&self, k: usize) -> Strip<'_> {
        let (point, [bx, by]) = (&self.points[k], self.blur_px);
        let [nx, ny] = point.outward;
        let width_px = if self.merged(k) { self.strips_px[k] } else { 0.0 };
        Strip { point, width_px, motion_px: (bx * nx + by * ny).abs() }
    }

    /// Whether rim and foot are so near that their edges run into one.
    fn merged(&self, k: usize) -> bool {
        (SIDE_HIDDEN_PX..SIDE_APART_PX).contains(&self.strips_px[k])
    }

    fn strips(&self) -> Vec<Strip<'_>> {
        (0..self.points.len()).filter(|&k| self.merged(k)).map(|k| self.strip(k)).collect()
    }
}

/// An outline read off a ruler, to half a millimetre on either side, is right within this (m, one standard deviation).
const RULER_STD_M: f64 = 0.25e-3;
/// An edge as steep as this part of the steepest one moves it.
const RIVAL: f64 = 0.3;
/// Where an object's side shows as a strip between these widths (px), its two edges run into one.
const SIDE_HIDDEN_PX: f64 = 0.15;
const SIDE_APART_PX: f64 = 4.0;
/// Edges that run together count little.
const TOGETHER: f64 = 0.02;

/// Whether the edge beside a point is the outline's, or that of the strip of side that runs into it.
fn on_outline(strip_px: f64, edge: Option<&Edge>) -> bool {
    let strip_px = if strip_px < SIDE_APART_PX { strip_px } else { 0.0 };
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
