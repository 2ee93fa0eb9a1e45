//! Which marker belongs to which object when the clip begins?
//!
//! Marker size and shape, the object's own outline around it, and what the layout says each speak for or against a
//! pair of object and marker; the best total decides.

use super::assignment::assignment;
use super::candidates::{Candidate, OUTLINE_TOLERANCE};
use super::marker::blob::Blob;
use super::marker::dot::Pair;
use super::marker::target::Target;
use super::markerless::edge_fit::Fit;
use super::markerless::edge_visibility::Scene;
use super::threshold::Level;
use crate::capture::{Camera, GreyImage};
use crate::geometry::{Pixel, Point, Pose, Vec2, wrapped_rad};
use crate::object::{Shape, kind};
use crate::scene::Placed;
use std::f64::consts::PI;

/// What is known about which marker belongs to which object.
#[derive(Clone, Debug, PartialEq)]
pub enum Layout {
    /// Nothing: marker shapes and object outlines must tell.
    Unknown,
    /// The struck object comes first along the strike, the others in their order behind it.
    AlongStrike {
        /// The strike's direction (rad).
        heading_rad: f64,
        /// Where the striker's centre starts, if known.
        start_m: Option<Point>,
    },
    /// Each object lay here when the clip began.
    Placed(Vec<Placed>),
}

/// A target's marker and pose in the first picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub candidate: Candidate,
    pub pose: Pose,
}

/// One candidate as one target's marker.
#[derive(Clone, Copy, Debug)]
struct Match {
    pose: Pose,
    /// How badly marker and outline fit: half a square of standard deviations.
    cost: f64,
    /// The marker; what an outline would measure as, of an object without one.
    blob: Blob,
    /// The dot beside the candidate, if they are equal: another candidate, but the same marker.
    twin: Option<Pixel>,
}

/// Cut by hand and measured by ruler, a marker's lengths are right within this part (one standard deviation).
const LENGTH_STD: f64 = 0.05;
/// What an outline that does not show at all costs: true ones show by half at least, false ones by a fifth, and the
/// difference should weigh as much as a marker wrong by three standard deviations.
const UNSEEN_OUTLINE: f64 = 15.0;
/// Two answers whose costs differ by less (a visibility of a tenth) are a guess.
const CLEAR_MARGIN: f64 = 1.5;
/// A scene made by hand is right within this (m, one standard deviation).
const PLACED_STD_M: f64 = 0.01;
/// How far the struck object may lie beside the strike's line (m, one standard deviation), and the others.
const BESIDE_STRUCK_STD_M: f64 = 0.03;
const BESIDE_OTHERS_STD_M: f64 = 0.2;

/// The best way to give every target a candidate, or nothing where some target finds none; with what to warn of.
pub(super) fn starts(
    image: &GreyImage,
    camera: &Camera,
    targets: &[Target],
    candidates: &[Candidate],
    layout: &Layout,
) -> (Vec<Option<Start>>, Vec<String>) {
    let row = |target| {
        let row = candidates.iter().map(|c| fit(image, camera, target, c, layout)).collect();
        without_twins(row, candidates)
    };
    let matches: Vec<Vec<Option<Match>>> = targets.iter().map(row).collect();
    let fits = costs(&matches, |_, m| m.cost);
    let mut out_of_order = None;
    let given = match layout {
        Layout::Unknown => assignment(&fits),
        Layout::Placed(_) => {
            assignment(&costs(&matches, |row, m| m.cost + misplaced(layout, &targets[row], m.pose)))
        }
        Layout::AlongStrike { heading_rad, start_m } => {
            let ahead = Vec2::from_heading(*heading_rad);
            let way = |pose: Pose| pose.position - start_m.unwrap_or_default();
            let beside = costs(&matches, |row, m| {
                let std_m = if row == 0 { BESIDE_STRUCK_STD_M } else { BESIDE_OTHERS_STD_M };
                let known = if start_m.is_some() { 1.0 } else { 0.0 };
                let behind = start_m.is_some() && way(m.pose).dot(ahead) < 0.0;
                if behind {
                    f64::INFINITY
                } else {
                    m.cost + known * half_square(way(m.pose).cross(ahead) / std_m)
                }
            });
            in_order(&beside, &matches, ahead).unwrap_or_else(|| {
                out_of_order =
                    Some("doubtful: the markers do not lie in the order given along the strike".to_string());
                assignment(&beside)
            })
        }
    };
    let mut warnings = doubts(targets, &fits, &given, layout);
    warnings.extend(out_of_order);
    let starts: Vec<Option<Start>> = given
        .iter()
        .enumerate()
        .map(|(row, column)| {
            let column = (*column)?;
            let Match { pose, blob, .. } = matches[row][column]?;
            Some(Start { candidate: Candidate { blob, ..candidates[column] }, pose })
        })
        .collect();
    warnings.extend(moved(targets, &starts, layout));
    (in_canonical_order(targets, starts, layout), warnings)
}

fn half_square(deviation: f64) -> f64 {
    deviation * deviation / 2.0
}

fn costs(matches: &[Vec<Option<Match>>], cost: impl Fn(usize, &Match) -> f64) -> Vec<Vec<f64>> {
    let row = |(k, row): (usize, &Vec<Option<Match>>)| {
        row.iter().map(|m| m.as_ref().map_or(f64::INFINITY, |m| cost(k, m))).collect()
    };
    matches.iter().enumerate().map(row).collect()
}

/// Two equal dots are two candidates, but one marker: the better of its two matches stands in the first one's column.
fn without_twins(mut row: Vec<Option<Match>>, candidates: &[Candidate]) -> Vec<Option<Match>> {
    for first in 0..row.len() {
        let Some(Match { twin: Some(twin), cost, .. }) = row[first] else { continue };
        let reach_px = candidates[first].blob.area_px2.sqrt() / 2.0;
        let is_twin = |c: &Candidate| c.blob.centroid.distance_px(twin) < reach_px;
        if let Some(second) = candidates.iter().position(is_twin)
            && second > first
            && let Some(other) = row[second].take()
            && other.cost < cost
        {
            row[first] = Some(other);
        }
    }
    row
}

/// How well a candidate goes as the target's marker, and the pose it would give the object.
fn fit(
    image: &GreyImage,
    camera: &Camera,
    target: &Target,
    candidate: &Candidate,
    layout: &Layout,
) -> Option<Match> {
    let blob = &candidate.blob;
    let target = &target.clone().with_marker(blob);
    let mismatch = target.mismatch(camera, blob);
    if target.markerless() {
        return mismatch
            .within(OUTLINE_TOLERANCE)
            .then(|| laid(image, camera, target, candidate, layout))
            .flatten();
    }
    if !mismatch.tolerable() {
        return None;
    }
    let object = target.object;
    let known_yaw_rad = placed(layout, target).map(|pose| pose.yaw_rad);
    let pair = target.pair(image, camera, blob, (known_yaw_rad, [0.0, 0.0]));
    if target.feature.dot.is_some() && pair.is_none() {
        return None;
    }
    let disc = pair.map_or(*blob, |pair| pair.disc);
    let pose = |yaw_rad: f64| target.pose(camera, disc.aim(), yaw_rad);
    let yaws_rad: Vec<f64> = match pair.map(|pair| pair.yaw_rad).or(known_yaw_rad) {
        Some(yaw_rad) => vec![yaw_rad],
        None if target.tells_axis() => vec![pose(0.0).yaw_rad, wrapped_rad(pose(0.0).yaw_rad + PI)],
        None if matches!(object.shape, Shape::Disc { .. }) && !target.off_centre() => vec![0.0],
        None => Vec::new(),
    };
    let scene = Scene { image, camera, shape: &object.shape, height_m: object.height_m };
    let (yaw_rad, visibility) = scene.best_yaw(pose, &yaws_rad);
    let cost = half_square(mismatch.worst() / LENGTH_STD) + UNSEEN_OUTLINE * (1.0 - visibility);
    let equal = pair.filter(|_| target.feature.has_equal_dots());
    let twin = equal.map(
        |Pair { disc, dot, .. }| {
            if disc.centroid == blob.centroid { dot.centroid } else { disc.centroid }
        },
    );
    Some(Match { pose: pose(yaw_rad), cost, blob: disc, twin })
}

/// How well an object's own outline lies near a candidate, and the pose it would have.
fn laid(
    image: &GreyImage,
    camera: &Camera,
    target: &Target,
    candidate: &Candidate,
    layout: &Layout,
) -> Option<Match> {
    let object = target.object;
    let scene = Scene { image, camera, shape: &object.shape, height_m: object.height_m };
    let place = camera.table_from_pixel(candidate.blob.centroid, object.height_m);
    let rough = |yaw_rad: f64| Pose { position: place, yaw_rad };
    let yaw_rad = match placed(layout, target) {
        Some(pose) => pose.yaw_rad,
        None => scene.best_yaw(rough, &[]).0,
    };
    let fit = scene.searched(rough(yaw_rad), (LAID_REACH_M, LAID_TURN_RAD), |_| true)?;
    let cost = UNSEEN_OUTLINE * (1.0 - fit.shown);
    (fit.shown > LEAST_SHOWN).then_some(Match {
        pose: fit.pose,
        cost,
        blob: target.blob(camera, &fit),
        twin: None,
    })
}

/// Sides and shadow move a blob from its object by less than this.
const LAID_REACH_M: f64 = 0.015;
const LAID_TURN_RAD: f64 = 0.3;
/// An outline that shows less is not there.
const LEAST_SHOWN: f64 = 0.5;

/// Candidates for objects without markers whose places are known.
pub(super) fn outlines_placed(camera: &Camera, targets: &[Target], layout: &Layout) -> Vec<Candidate> {
    let known = targets.iter().filter(|t| t.markerless()).filter_map(|t| Some((t, placed(layout, t)?)));
    let candidate = |(target, pose): (&Target, Pose)| {
        let blob = target.blob(camera, &Fit { pose, shown: 1.0, std_px: 1.0 });
        Candidate { blob, level: Level::Below(1) }
    };
    known.map(candidate).collect()
}

fn placed(layout: &Layout, target: &Target) -> Option<Pose> {
    let Layout::Placed(placed) = layout else { return None };
    placed.iter().find(|p| p.object == target.name).map(Placed::pose)
}

fn misplaced(layout: &Layout, target: &Target, pose: Pose) -> f64 {
    placed(layout, target).map_or(0.0, |due| half_square(due.position.distance(pose.position) / PLACED_STD_M))
}

/// The cheapest way to give the rows columns that lie one behind the other along `ahead`, if there is any.
fn in_order(costs: &[Vec<f64>], matches: &[Vec<Option<Match>>], ahead: Vec2) -> Option<Vec<Option<usize>>> {
    let columns = costs.first().map_or(0, Vec::len);
    let along = |column: usize| {
        let pose = matches.iter().find_map(|row| row[column]).map(|m| m.pose.position.to_vec().dot(ahead));
        pose.unwrap_or(f64::INFINITY)
    };
    let mut order: Vec<usize> = (0..columns).collect();
    order.sort_by(|&a, &b| along(a).total_cmp(&along(b)));
    // best[k]: total of the rows so far with their columns among the first k of the order, and which these are.
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

/// Pairs of objects that could as well be the other way round.
fn doubts(targets: &[Target], fits: &[Vec<f64>], given: &[Option<usize>], layout: &Layout) -> Vec<String> {
    let mut doubts = Vec::new();
    for i in 0..targets.len() {
        for k in i + 1..targets.len() {
            let (Some(at_i), Some(at_k)) = (given[i], given[k]) else { continue };
            if kind(targets[i].name) == kind(targets[k].name) {
                continue;
            }
            let swapped_costs_more = fits[i][at_k] + fits[k][at_i] - fits[i][at_i] - fits[k][at_k];
            let (one, other) = (targets[i].name, targets[k].name);
            if matches!(layout, Layout::Unknown) {
                if swapped_costs_more < CLEAR_MARGIN {
                    doubts.push(format!(
                        "doubtful: `{one}` and `{other}` could as well be the other way round (markers and outlines fit almost alike)"
                    ));
                }
            } else if swapped_costs_more < -CLEAR_MARGIN {
                doubts.push(format!(
                    "doubtful: `{one}` and `{other}` seem swapped: markers and outlines fit better the other way round"
                ));
            }
        }
    }
    doubts
}

/// Three standard deviations from where the scene says is worth a word.
fn moved(targets: &[Target], starts: &[Option<Start>], layout: &Layout) -> Vec<String> {
    let off = targets.iter().zip(starts).filter_map(|(target, start)| {
        let off_m = placed(layout, target)?.position.distance(start.as_ref()?.pose.position);
        (off_m > 3.0 * PLACED_STD_M).then(|| {
            format!("doubtful: `{}` lies {:.0} mm from where the scene says", target.name, off_m * 1e3)
        })
    });
    off.collect()
}

/// Copies of one kind cannot be told apart: they are numbered from left to right, from below where that is equal.
fn in_canonical_order(
    targets: &[Target],
    mut starts: Vec<Option<Start>>,
    layout: &Layout,
) -> Vec<Option<Start>> {
    if !matches!(layout, Layout::Unknown) {
        return starts;
    }
    for i in 0..targets.len() {
        for k in i + 1..targets.len() {
            if kind(targets[i].name) == kind(targets[k].name)
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
