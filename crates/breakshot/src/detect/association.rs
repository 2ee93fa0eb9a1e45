//! Which marker belongs to which object when the clip begins?
//!
//! The size and shape of the marker, the visibility of the object's outline around it and the prior knowledge of the
//! layout each contribute to the cost of a pair of object and candidate; the assignment of least total cost is
//! chosen.

use super::assignment::assignment;
use super::candidates::{Candidate, OUTLINE_TOLERANCE};
use super::marker::blob::Blob;
use super::marker::dot::{DiscAndDot, DotPrediction};
use super::marker::outline::{Appearance, MarkerView};
use super::marker::target::Target;
use super::markerless;
use super::markerless::edge_fit::{OutlineFit, SearchRange};
use super::markerless::edge_visibility::OutlineView;
use super::threshold::Level;
use crate::campaign::ClipStart;
use crate::capture::{Camera, GreyImage};
use crate::geometry::moments::principal_axes;
use crate::geometry::outline::Outline;
use crate::geometry::{Pixel, Point, Pose, Vec2, wrapped_rad};
use crate::object::{Shape, kind};
use crate::scene::Placed;
use crate::statistics::argsort;
use std::f64::consts::{PI, TAU};

/// What is known in advance about the positions of the objects in the first frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Layout {
    /// Nothing: markers and outlines alone identify the objects.
    Unknown,
    /// The objects are in the given order along the strike, the struck one first.
    AlongStrike {
        /// Direction of the strike (rad).
        heading_rad: f64,
        /// Start of the striker's centre, if known.
        start_m: Option<Point>,
    },
    /// The pose of each object when the clip begins.
    Placed(Vec<Placed>),
    /// Where some of the objects are in the first frame, as a person has seen it: each is the marker or the outline near its place.
    Started {
        /// The objects that were seen.
        starts: Vec<ClipStart>,
        /// What is known beside that; the starts are believed where they contradict it.
        others: Box<Self>,
    },
}

impl Layout {
    /// What is known beside the starts that a person has seen.
    fn beside_starts(&self) -> &Self {
        match self {
            Self::Started { others, .. } => others.beside_starts(),
            other => other,
        }
    }

    /// Where a person has seen a target.
    pub(super) fn start(&self, target: &Target) -> Option<&ClipStart> {
        let Self::Started { starts, .. } = self else { return None };
        starts.iter().find(|start| start.object == target.name)
    }

    /// Whether a target at this position is where a person has seen it, if one has: its outline covers that place, so that no other
    /// object's does.
    fn admits(&self, target: &Target, position: Point) -> bool {
        let reach_m = target.object.shape.area_m2().sqrt() / 2.0;
        self.start(target).is_none_or(|start| start.position_m.distance(position) < reach_m)
    }
}

/// A target's marker and pose in the first frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub candidate: Candidate,
    pub pose: Pose,
    /// Whether the outline distinguishes the yaw from the one that is half a turn off, or half a turn changes nothing.
    pub half_turn_known: bool,
}

/// One candidate as the marker of one target.
#[derive(Clone, Copy, Debug)]
struct Match {
    pose: Pose,
    /// Half of the sum of squared deviations of marker and outline (standard deviations).
    cost: f64,
    /// The marker, or the silhouette of an object without one.
    blob: Blob,
    /// The other one of two equal dots, which is another candidate but the same marker.
    other_dot: Option<Pixel>,
    /// The cost that half a turn would add; infinite if the marker determines the yaw, or half a turn changes nothing.
    yaw_margin: f64,
}

impl Match {
    /// Whether the outline distinguishes the yaw from the one that is half a turn off, or half a turn changes nothing.
    fn is_half_turn_known(&self) -> bool {
        self.yaw_margin >= CLEAR_MARGIN
    }
}

/// Standard deviation of a marker's lengths (ratio's logarithm): cut by hand and measured with a ruler.
const LENGTH_STD: f64 = 0.05;
/// Cost of an invisible outline: the visibility of the right outline is at least a half, of a wrong one about a
/// fifth, and the difference should cost as much as a marker that deviates by three standard deviations.
const INVISIBLE_OUTLINE_COST: f64 = 15.0;
/// Standard deviation of the distance between the outline fitted to the image and the one that the marker implies (m):
/// markers are placed by hand.
const DISPLACED_STD_M: f64 = 0.5e-3;
/// A larger distance (standard deviations) costs no more: the edges belong to something else.
const LARGEST_DISPLACEMENT_STDS: f64 = 3.0;
/// Two assignments whose costs differ by less (a visibility of one tenth) are ambiguous.
const CLEAR_MARGIN: f64 = 1.5;
/// Standard deviation of the positions in a scene file made by hand (m).
const PLACED_STD_M: f64 = 0.01;
/// A distance of this many standard deviations from the scene file's position gives a warning.
const MISPLACED_STDS: f64 = 3.0;
/// Standard deviations of the distance from the line of the strike (m), of the struck object and of the others.
const STRUCK_LATERAL_STD_M: f64 = 0.03;
const OTHERS_LATERAL_STD_M: f64 = 0.2;
/// Range of the search for an outline around its silhouette, which sides and shadow displace.
const OUTLINE_SEARCH: SearchRange = SearchRange { radius_m: 0.015, angle_rad: 0.3 };
/// Step of the search for a yaw around one that a person has seen (rad): a third of a pixel at a corner 30 px from the centre.
const START_YAW_STEP_RAD: f64 = 0.01;
/// An outline, of an object or of a marker across which the light changes, of which a smaller fraction is visible is not there.
const LEAST_VISIBLE: f64 = 0.5;

/// The assignment of candidates to targets of least cost, with `None` for a target without candidate, and warnings.
pub(super) fn starts(
    image: &GreyImage,
    camera: &Camera,
    targets: &[Target],
    candidates: &[Candidate],
    layout: &Layout,
) -> (Vec<Option<Start>>, Vec<String>) {
    // Costs of all pairs by appearance
    let row = |target| {
        let row = candidates.iter().map(|c| {
            matched(image, camera, target, c, layout).filter(|m| layout.admits(target, m.pose.position))
        });
        let row = row.collect();
        with_merged_outlines(target, with_merged_dots(row, candidates))
    };
    let mut matches: Vec<Vec<Option<Match>>> = targets.iter().map(row).collect();

    // Assignment by appearance and layout, without overlaps
    let (assigned, order_warning) = loop {
        let (assigned, order_warning) = least_cost_assignment(targets, &matches, layout);
        let Some((row, column)) = overlapping(targets, &matches, &assigned) else {
            break (assigned, order_warning);
        };
        matches[row][column] = None;
    };
    let by_appearance = costs(&matches, |_, m| m.cost);
    let mut warnings = ambiguities(targets, &by_appearance, &assigned, layout.beside_starts());
    warnings.extend(order_warning);

    // Poses
    let starts: Vec<Option<Start>> = assigned
        .iter()
        .enumerate()
        .map(|(row, column)| {
            let column = (*column)?;
            let found = matches[row][column]?;
            let candidate = Candidate { blob: found.blob, ..candidates[column] };
            Some(Start { candidate, pose: found.pose, half_turn_known: found.is_half_turn_known() })
        })
        .collect();
    warnings.extend(misplacements(targets, &starts, layout));
    warnings.extend(ambiguous_yaws(targets, &matches, &assigned));
    (in_canonical_order(targets, starts, layout), warnings)
}

/// The column of each row by appearance and layout, and a warning if they do not have the given order along the strike.
fn least_cost_assignment(
    targets: &[Target],
    matches: &[Vec<Option<Match>>],
    layout: &Layout,
) -> (Vec<Option<usize>>, Option<String>) {
    let placed_cost = |row: usize, m: &Match| m.cost + placement_cost(layout, &targets[row], m.pose);
    let Layout::AlongStrike { heading_rad, start_m } = layout.beside_starts() else {
        return (assignment(&costs(matches, placed_cost)), None);
    };
    let ahead = Vec2::from_heading(*heading_rad);
    let by_line = costs(matches, |row, m| {
        let start_m = start_m.filter(|_| layout.start(&targets[row]).is_none());
        placed_cost(row, m) + line_cost(row, m.pose, start_m, ahead)
    });
    if let Some(ordered) = ordered_assignment(&by_line, matches, ahead) {
        return (ordered, None);
    }
    let warning = "doubtful: the markers are not in the given order along the strike";
    (assignment(&by_line), Some(warning.to_string()))
}

/// Row and column of an assigned outline without a marker that lies on another assigned object: it is the other one's. Of two outlines it is the
/// less visible one.
fn overlapping(
    targets: &[Target],
    matches: &[Vec<Option<Match>>],
    assigned: &[Option<usize>],
) -> Option<(usize, usize)> {
    let found = |row: usize| matches[row][assigned[row]?].as_ref();
    let covers = |row: usize, one: &Match, other: &Match| {
        Outline::new(&targets[row].object.shape, one.pose).contains(other.pose.position)
    };
    let yields = |row: usize, other_row: usize| {
        let (Some(one), Some(other)) = (found(row), found(other_row)) else { return false };
        row != other_row
            && (covers(row, one, other) || covers(other_row, other, one))
            && (!targets[other_row].is_markerless() || one.cost >= other.cost)
    };
    let rows = 0..targets.len();
    let mut outlines = rows.clone().filter(|&row| targets[row].is_markerless());
    let row = outlines.find(|&row| rows.clone().any(|other_row| yields(row, other_row)))?;
    Some((row, assigned[row]?))
}

fn half_squared(deviation: f64) -> f64 {
    deviation * deviation / 2.0
}

/// The matrix of costs; infinite for a pair that does not match.
fn costs(matches: &[Vec<Option<Match>>], cost: impl Fn(usize, &Match) -> f64) -> Vec<Vec<f64>> {
    let row = |(k, row): (usize, &Vec<Option<Match>>)| {
        row.iter().map(|m| m.as_ref().map_or(f64::INFINITY, |m| cost(k, m))).collect()
    };
    matches.iter().enumerate().map(row).collect()
}

/// The row of matches with two equal dots merged: they are two candidates but one marker, and the better match of the
/// two moves to the column of the first one.
fn with_merged_dots(mut row: Vec<Option<Match>>, candidates: &[Candidate]) -> Vec<Option<Match>> {
    for first in 0..row.len() {
        let Some(Match { other_dot: Some(other_dot), cost, .. }) = row[first] else { continue };
        let reach_px = candidates[first].blob.area_px2.sqrt() / 2.0;
        let is_other = |c: &Candidate| c.blob.centroid.distance_px(other_dot) < reach_px;
        if let Some(second) = candidates.iter().position(is_other)
            && second > first
            && let Some(other) = row[second].take()
            && other.cost < cost
        {
            row[first] = Some(other);
        }
    }
    row
}

/// The row of matches with equal poses merged: of several silhouettes of one object the best match moves to the column of
/// the first one.
fn with_merged_outlines(target: &Target, mut row: Vec<Option<Match>>) -> Vec<Option<Match>> {
    if !target.is_markerless() {
        return row;
    }
    let reach_m = target.object.shape.area_m2().sqrt() / 2.0;
    for first in 0..row.len() {
        for second in first + 1..row.len() {
            if let (Some(one), Some(other)) = (row[first], row[second])
                && one.pose.position.distance(other.pose.position) < reach_m
            {
                row[first] = Some(if other.cost < one.cost { other } else { one });
                row[second] = None;
            }
        }
    }
    row
}

/// The candidate as the target's marker: its cost by appearance and the object's pose.
fn matched(
    image: &GreyImage,
    camera: &Camera,
    target: &Target,
    candidate: &Candidate,
    layout: &Layout,
) -> Option<Match> {
    let blob = &candidate.blob;
    let target = &target.clone().with_polarity_of(blob);
    let view = OutlineView::of_target(image, camera, target);
    let mismatch = target.mismatch(camera, blob);
    if target.is_markerless() {
        return mismatch
            .is_within(OUTLINE_TOLERANCE)
            .then(|| matched_outline(&view, target, candidate, layout))
            .flatten();
    }
    if !mismatch.is_tolerable() {
        return None;
    }

    // The dot beside the marker
    let known_yaw_rad = known_yaw_rad(layout, target);
    let prediction = DotPrediction { level: candidate.level, yaw_rad: known_yaw_rad, blur_px: [0.0, 0.0] };
    let pair = target.disc_and_dot(image, camera, blob, prediction);
    if target.feature.dot.is_some() && pair.is_none() {
        return None;
    }
    let disc = pair.map_or(*blob, |pair| pair.disc);
    let equal = pair.filter(|_| target.feature.has_equal_dots());
    let other_dot = equal.map(
        |DiscAndDot { disc, dot, .. }| {
            if disc.centroid == blob.centroid { dot.centroid } else { disc.centroid }
        },
    );

    // The yaw: of those that the marker leaves open the one with the most visible outline
    let pose = |yaw_rad: f64| target.pose(camera, disc.image_pose(), yaw_rad);
    let yaws_rad: Vec<f64> = match pair.map(|pair| pair.yaw_rad).or(known_yaw_rad) {
        Some(yaw_rad) if pair.is_none() && !target.has_axis() && layout.start(target).is_some() => {
            yaws_around(yaw_rad)
        }
        Some(yaw_rad) => vec![yaw_rad],
        None if target.has_axis() => vec![pose(0.0).yaw_rad, wrapped_rad(pose(0.0).yaw_rad + PI)],
        None if matches!(target.object.shape, Shape::Disc { .. }) && !target.is_off_centre() => vec![0.0],
        None => Vec::new(),
    };
    let turned = match yaws_rad[..] {
        [one, other] if target.changes_by_half_turn() => Some([pose(one), pose(other)]),
        _ => None,
    };
    let (pose, visibility, yaw_margin) = if let Some(poses) = turned {
        better_turned(&view, poses)
    } else {
        let (yaw_rad, visibility) = view.best_yaw(pose, &yaws_rad);
        (pose(yaw_rad), visibility, f64::INFINITY)
    };
    let pose = if candidate.is_unevenly_lit {
        let appearance =
            Appearance { dark: blob.contrast > 0.0, contrast: blob.contrast.abs(), blur_px: [0.0, 0.0] };
        let fit = MarkerView { image, camera, target, appearance }.fitted(pose)?;
        if fit.visible_fraction < LEAST_VISIBLE {
            return None;
        }
        fit.pose
    } else {
        pose
    };
    let cost = half_squared(mismatch.largest() / LENGTH_STD) + INVISIBLE_OUTLINE_COST * (1.0 - visibility);
    Some(Match { pose, cost, blob: disc, other_dot, yaw_margin })
}

/// Yaws around one that a person has seen, the nearest first: the outline in the image decides.
fn yaws_around(yaw_rad: f64) -> Vec<f64> {
    let steps = (OUTLINE_SEARCH.angle_rad / START_YAW_STEP_RAD) as i32;
    let offsets = std::iter::once(0).chain((1..=steps).flat_map(|k| [k, -k]));
    offsets.map(|k| wrapped_rad(yaw_rad + f64::from(k) * START_YAW_STEP_RAD)).collect()
}

/// Of two poses half a turn apart the one whose outline is more visible and nearer to the edges of the image: the pose,
/// the visibility of its outline, and the difference of the costs.
///
/// The border of a shadow may be as visible as the outline, but no outline fits it where the marker is.
fn better_turned(view: &OutlineView, poses: [Pose; 2]) -> (Pose, f64, f64) {
    let [one, other] = poses.map(|pose| {
        let visibility = view.visibility(pose);
        let fit = view.fitted(pose, [0.0, 0.0]);
        let displacement =
            fit.map_or(f64::INFINITY, |fit| fit.pose.position.distance(pose.position) / DISPLACED_STD_M);
        let cost = INVISIBLE_OUTLINE_COST * (1.0 - visibility)
            + half_squared(displacement.min(LARGEST_DISPLACEMENT_STDS));
        (pose, visibility, cost)
    });
    let (better, worse) = if one.2 <= other.2 { (one, other) } else { (other, one) };
    (better.0, better.1, worse.2 - better.2)
}

/// The object's own outline fitted near a silhouette.
fn matched_outline(
    view: &OutlineView,
    target: &Target,
    candidate: &Candidate,
    layout: &Layout,
) -> Option<Match> {
    let position = view.camera.table_from_pixel(candidate.blob.centroid, view.height_m);
    let rough = |yaw_rad: f64| Pose { position, yaw_rad };
    let (yaw_rad, angle_rad) = if let Some(yaw_rad) = known_yaw_rad(layout, target) {
        (yaw_rad, OUTLINE_SEARCH.angle_rad)
    } else {
        // Where a shadow hides a part of it, the silhouette's centroid is too far off for a yaw.
        let period_rad = view.shape.rotation_symmetry_rad().unwrap_or(TAU);
        (view.best_yaw(rough, &[]).0, period_rad / 2.0)
    };
    let radius_m = OUTLINE_SEARCH.radius_m + shadow_m(view.camera, target, rough(yaw_rad), &candidate.blob);
    let fit = view.searched(rough(yaw_rad), SearchRange { radius_m, angle_rad }, |_| true)?;
    let cost = INVISIBLE_OUTLINE_COST * (1.0 - fit.visible_fraction);
    let blob = markerless::silhouette(target, view.camera, &fit);
    (fit.visible_fraction > LEAST_VISIBLE).then_some(Match {
        pose: fit.pose,
        cost,
        blob,
        other_dot: None,
        yaw_margin: f64::INFINITY,
    })
}

/// By how much a silhouette is longer than an object at a pose (m): its shadow on one side displaces its centroid by about as much.
fn shadow_m(camera: &Camera, target: &Target, pose: Pose, silhouette: &Blob) -> f64 {
    let half_axis_px = |covariance_px2| 2.0 * principal_axes(covariance_px2).0.sqrt();
    let expected_px = half_axis_px(target.projection(camera, pose).covariance);
    let scale_m_per_px = camera.scale_m_per_px(silhouette.centroid, target.height_m());
    scale_m_per_px * (half_axis_px(silhouette.covariance_px2) - expected_px).max(0.0)
}

/// Candidates at the positions of the objects without markers that the layout gives.
pub(super) fn placed_candidates(camera: &Camera, targets: &[Target], layout: &Layout) -> Vec<Candidate> {
    let known = targets.iter().filter(|t| t.is_markerless()).filter_map(|t| Some((t, placed(layout, t)?)));
    let candidate = |(target, pose): (&Target, Pose)| {
        let fit = OutlineFit {
            pose,
            visible_fraction: 1.0,
            measured_fraction: 1.0,
            std_px: 1.0,
            enlargement_px: 0.0,
        };
        Candidate {
            blob: markerless::silhouette(target, camera, &fit),
            level: Level::Below(1),
            is_unevenly_lit: false,
        }
    };
    known.map(candidate).collect()
}

/// The pose that the layout gives for a target; a yaw that a person has not seen is zero.
fn placed(layout: &Layout, target: &Target) -> Option<Pose> {
    if let Some(ClipStart { position_m, yaw_rad, .. }) = layout.start(target) {
        return Some(Pose { position: *position_m, yaw_rad: yaw_rad.unwrap_or(0.0) });
    }
    let Layout::Placed(placed) = layout.beside_starts() else { return None };
    placed.iter().find(|p| p.object == target.name).map(Placed::pose)
}

/// The yaw that the layout gives for a target.
fn known_yaw_rad(layout: &Layout, target: &Target) -> Option<f64> {
    match layout.start(target) {
        Some(start) => start.yaw_rad,
        None => placed(layout, target).map(|pose| pose.yaw_rad),
    }
}

/// Cost of the distance from the position that the layout gives.
fn placement_cost(layout: &Layout, target: &Target, pose: Pose) -> f64 {
    placed(layout, target)
        .map_or(0.0, |given| half_squared(given.position.distance(pose.position) / PLACED_STD_M))
}

/// Cost of the distance from the line of the strike, if its start is known; infinite behind the start.
fn line_cost(row: usize, pose: Pose, start_m: Option<Point>, ahead: Vec2) -> f64 {
    let std_m = if row == 0 { STRUCK_LATERAL_STD_M } else { OTHERS_LATERAL_STD_M };
    start_m.map_or(0.0, |start_m| {
        let from_start = pose.position - start_m;
        let behind = from_start.dot(ahead) < 0.0;
        if behind { f64::INFINITY } else { half_squared(from_start.cross(ahead) / std_m) }
    })
}

/// The assignment of least cost whose columns are in the order of the rows along `ahead`, if there is one.
fn ordered_assignment(
    costs: &[Vec<f64>],
    matches: &[Vec<Option<Match>>],
    ahead: Vec2,
) -> Option<Vec<Option<usize>>> {
    let columns = costs.first().map_or(0, Vec::len);
    let along = |column: usize| {
        let pose = matches.iter().find_map(|row| row[column]).map(|m| m.pose.position.to_vec().dot(ahead));
        pose.unwrap_or(f64::INFINITY)
    };
    let order = argsort(&(0..columns).map(along).collect::<Vec<_>>());
    // Dynamic programming: best[k] is the least cost of the rows so far with columns among the first k of the order,
    // and these columns.
    let mut best: Vec<(f64, Vec<usize>)> = vec![(0.0, Vec::new()); columns + 1];
    for row in costs {
        let mut next = vec![(f64::INFINITY, Vec::new()); columns + 1];
        for k in 0..columns {
            let total = best[k].0 + row[order[k]];
            next[k + 1] = if total < next[k].0 {
                (total, best[k].1.iter().copied().chain([order[k]]).collect())
            } else {
                next[k].clone()
            };
        }
        best = next;
    }
    let (total, columns) = best.pop()?;
    total.is_finite().then(|| columns.into_iter().map(Some).collect())
}

/// Warnings of pairs of objects that appearance does not distinguish, or that it would exchange.
fn ambiguities(
    targets: &[Target],
    by_appearance: &[Vec<f64>],
    assigned: &[Option<usize>],
    layout: &Layout,
) -> Vec<String> {
    let mut warnings = Vec::new();
    for i in 0..targets.len() {
        for k in i + 1..targets.len() {
            let (Some(at_i), Some(at_k)) = (assigned[i], assigned[k]) else { continue };
            if kind(targets[i].name) == kind(targets[k].name) {
                continue;
            }
            let costs = by_appearance;
            let added_by_exchange = costs[i][at_k] + costs[k][at_i] - costs[i][at_i] - costs[k][at_k];
            let (one, other) = (targets[i].name, targets[k].name);
            if matches!(layout, Layout::Unknown) {
                if added_by_exchange < CLEAR_MARGIN {
                    warnings.push(format!(
                        "doubtful: `{one}` and `{other}` may be exchanged: markers and outlines fit both assignments almost equally"
                    ));
                }
            } else if added_by_exchange < -CLEAR_MARGIN {
                warnings.push(format!(
                    "doubtful: `{one}` and `{other}` seem swapped: markers and outlines fit better with the two exchanged"
                ));
            }
        }
    }
    warnings
}

/// Warnings of objects whose outline does not distinguish two yaws half a turn apart.
fn ambiguous_yaws(
    targets: &[Target],
    matches: &[Vec<Option<Match>>],
    assigned: &[Option<usize>],
) -> Vec<String> {
    let ambiguous = targets.iter().zip(matches).zip(assigned).filter_map(|((target, row), column)| {
        let found = row[(*column)?].as_ref()?;
        (!found.is_half_turn_known()).then(|| {
            let name = target.name;
            format!(
                "doubtful: `{name}` may be turned by half a turn: its outline fits both yaws almost equally"
            )
        })
    });
    ambiguous.collect()
}

/// Warnings of objects far from the position that the scene file gives; a start is never far.
fn misplacements(targets: &[Target], starts: &[Option<Start>], layout: &Layout) -> Vec<String> {
    let far = targets.iter().zip(starts).filter_map(|(target, start)| {
        let distance_m = placed(layout, target)?.position.distance(start.as_ref()?.pose.position);
        (distance_m > MISPLACED_STDS * PLACED_STD_M).then(|| {
            format!(
                "doubtful: `{}` is {:.0} mm from the position that the scene gives",
                target.name,
                distance_m * 1e3
            )
        })
    });
    far.collect()
}

/// The starts with the copies of one kind, which look the same, numbered by increasing x, then by increasing y.
fn in_canonical_order(
    targets: &[Target],
    mut starts: Vec<Option<Start>>,
    layout: &Layout,
) -> Vec<Option<Start>> {
    if !matches!(layout.beside_starts(), Layout::Unknown) {
        return starts;
    }
    // Where a person has seen a copy, its name is given.
    let is_named = |k: usize| layout.start(&targets[k]).is_some();
    for i in 0..targets.len() {
        for k in i + 1..targets.len() {
            if kind(targets[i].name) == kind(targets[k].name)
                && !(is_named(i) || is_named(k))
                && let (Some(one), Some(other)) = (starts[i], starts[k])
            {
                let (p, q) = (one.pose.position, other.pose.position);
                if (q.x, q.y) < (p.x, p.y) {
                    starts.swap(i, k);
                }
            }
        }
    }
    starts
}
