//! Which impacts a clip shows: who starts to move when, and what was near.

use super::motion_model::{Body, Cause, Event, Exposure, Layout, Model, Path, Sight, friction_of_a_stop};
use super::sliding::patch_radius_m;
use super::striker_path::StrikerRun;
use crate::detect::Track;
use crate::estimate::closest_points::{Outline, touch_apart};
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{Object, Shape};

/// A first guess of a clip's story: its events, and the parameters to start the fit from.
#[derive(Clone, Debug)]
pub(crate) struct Draft {
    pub(crate) model: Model,
    pub(crate) layout: Layout,
    pub(crate) parameters: Vec<f64>,
}

/// How a track begins.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Onset {
    Never,
    AtStart,
    At(f64),
}

/// A body moves once it is this many deviations of the noise away from where it lay.
const MOVED_NOISES: f64 = 8.0;
/// A doubtful sight's deviation is taken this many times larger.
const DOUBT: f64 = 5.0;
/// A body takes part in an impact if the gap is below this (m): outlines are measured with a ruler, and the
/// first guess of the instant is half a frame wrong.
const NEAR_M: f64 = 0.006;

/// The bodies of a clip, ready to be fitted; sights that are no numbers are dropped.
pub(crate) fn bodies(tracks: &[Track], objects: &[&Object]) -> Vec<Body> {
    tracks.iter().zip(objects).map(|(track, object)| body(track, object)).collect()
}

fn body(track: &Track, object: &Object) -> Body {
    let good = |s: &&crate::detect::Sample| s.time_s.is_finite() && s.position().is_finite() && s.std_m > 0.0;
    let mut sights: Vec<_> = (track.samples.iter().filter(good))
        .map(|s| Sight {
            time_s: s.time_s,
            position: s.position(),
            yaw_rad: s.yaw_rad.filter(|yaw| yaw.is_finite()),
            std_m: if s.doubtful { DOUBT * s.std_m } else { s.std_m },
            ignored: false,
        })
        .collect();
    sights.sort_by(|p, q| p.time_s.total_cmp(&q.time_s));
    sights.dedup_by_key(|s| s.time_s);
    let with_yaw = sights.iter().filter(|s| s.yaw_rad.is_some()).count();
    // A disc looks the same from all sides: its spin is seen only if its marker tells.
    let sees_yaw = sights.len() >= SIGHTS_NEEDED && 2 * with_yaw > sights.len();
    let mut body = Body {
        object: track.object.clone(),
        shape: object.shape.clone(),
        patch_radius_m: patch_radius_m(&object.shape),
        gyration_m: object.shape.radius_of_gyration_m(),
        height_m: object.height_m,
        sights,
        sees_yaw,
        moves_at_start: false,
    };
    body.moves_at_start = onset(&body) == Onset::AtStart;
    body
}

/// Fewer sights tell of no motion.
pub(crate) const SIGHTS_NEEDED: usize = 4;

/// The deviation of the noise along one axis (m): what the track claims, or what its third differences show.
pub(crate) fn noise_m(sights: &[Sight]) -> f64 {
    // The length of a plane Gaussian has the median 1.177; third differences add variances 1 + 9 + 9 + 1.
    const LENGTH_OVER_STD: f64 = 1.177 * 4.472;
    let thirds = sights.windows(4).map(|w| {
        let [p, q, r, s] = [w[0], w[1], w[2], w[3]].map(|s| s.position.to_vec());
        (s - r * 3.0 + q * 3.0 - p).length() / LENGTH_OVER_STD
    });
    median(sights.iter().map(|s| s.std_m)).max(median(thirds))
}

/// How far from where it lay a body is seen to have moved (m).
pub(crate) fn moved_m(sights: &[Sight]) -> f64 {
    MOVED_NOISES * noise_m(sights)
}

/// The middle value; zero of none.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    match all.len() {
        0 => 0.0,
        n => f64::midpoint(all[(n - 1) / 2], all[n / 2]),
    }
}

/// A body is fitted to no more sights than about this: cost grows with them, and what they tell does not.
const MOST_SIGHTS: usize = 300;

/// At high frame rates, the means of so many successive sights: each is a sight whose shutter was open for all of them.
///
/// Gives the time that each of them spans; `None` if the sights are few enough as they are.
pub(crate) fn bin(bodies: &mut [Body]) -> Option<f64> {
    let most = bodies.iter().map(|b| b.sights.len()).max()?;
    let count = most.div_ceil(MOST_SIGHTS);
    if count < 2 {
        return None;
    }
    let frame_s = frame_s(bodies);
    let span_s = frame_s * count as f64;
    for body in bodies {
        let block = |s: &Sight| (s.time_s / span_s + 1e-6).floor();
        // A block that misses sights has its middle elsewhere.
        let whole = body.sights.chunk_by(|p, q| block(p) == block(q)).filter(|b| b.len() == count);
        body.sights = whole.map(mean_sight).collect();
    }
    Some(span_s)
}

fn mean_sight(sights: &[Sight]) -> Sight {
    let n = sights.len() as f64;
    let sum = sights.iter().fold(Vec2::ZERO, |sum, s| sum + s.position.to_vec());
    let yaws: Option<f64> = sights.iter().map(|s| s.yaw_rad).sum();
    Sight {
        time_s: sights.iter().map(|s| s.time_s).sum::<f64>() / n,
        position: Point::ORIGIN + sum / n,
        yaw_rad: yaws.map(|sum| sum / n),
        std_m: sights.iter().map(|s| s.std_m * s.std_m).sum::<f64>().sqrt() / n,
        ignored: false,
    }
}

fn onset(body: &Body) -> Onset {
    let sights = &body.sights;
    if sights.len() < SIGHTS_NEEDED {
        return Onset::Never;
    }
    let moved_m = moved_m(sights);
    let mut place = sights[0].position;
    for k in 1..sights.len() - 1 {
        let (away, further) = (sights[k].position - place, sights[k + 1].position - place);
        if away.length() > moved_m && further.length() > moved_m {
            let (now, next) = (sights[k], sights[k + 1]);
            let speed = (next.position - now.position).length() / (next.time_s - now.time_s);
            let back_s = if speed > 0.0 { away.length() / speed } else { f64::INFINITY };
            let earliest_s = sights[k - 1].time_s;
            let time_s = (now.time_s - back_s).max(earliest_s);
            let rested = k >= 2 && (now.time_s - back_s) > sights[0].time_s;
            return if rested { Onset::At(time_s) } else { Onset::AtStart };
        }
        // The place of rest is the mean so far.
        let share = 1.0 / (k + 1) as f64;
        if away.length() <= moved_m {
            place += away * share;
        }
    }
    Onset::Never
}

/// Where a body was seen at a time, between its sights on a straight line.
pub(crate) fn seen_at(body: &Body, time_s: f64) -> Pose {
    let sights = &body.sights;
    let next = sights.partition_point(|s| s.time_s < time_s);
    let (from, to) = match (next.checked_sub(1).and_then(|k| sights.get(k)), sights.get(next)) {
        (Some(from), Some(to)) => (from, to),
        (Some(only), None) | (None, Some(only)) => (only, only),
        (None, None) => return Pose::default(),
    };
    let span_s = to.time_s - from.time_s;
    let part = if span_s > 0.0 { (time_s - from.time_s) / span_s } else { 0.0 };
    let position = from.position + (to.position - from.position) * part;
    let yaw_rad = match (from.yaw_rad, to.yaw_rad) {
        (Some(p), Some(q)) => p + (q - p) * part,
        (p, q) => p.or(q).unwrap_or(0.0),
    };
    Pose { position, yaw_rad }
}

/// The typical time between two sights (s).
pub(crate) fn frame_s(bodies: &[Body]) -> f64 {
    let steps = bodies.iter().flat_map(|b| b.sights.windows(2).map(|w| w[1].time_s - w[0].time_s));
    median(steps)
}

impl Draft {
    /// The first guess from the tracks alone; every body that starts to move was hit by what was near.
    pub(crate) fn new(bodies: Vec<Body>, striker: Option<&StrikerRun>, exposure: Exposure) -> Self {
        let mut onsets: Vec<(f64, usize)> = (0..bodies.len())
            .filter_map(|k| match onset(&bodies[k]) {
                Onset::At(time_s) => Some((time_s, k)),
                _ => None,
            })
            .collect();
        onsets.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
        let frame_s = frame_s(&bodies);
        let mut model = Model::new(bodies, exposure);
        let mut times: Vec<f64> = Vec::new();
        for (n, &(time_s, k)) in onsets.iter().enumerate() {
            let cause = match partner(&model.bodies, k, time_s, &onsets[..n]) {
                _ if n == 0 && striker.is_some() => (Cause::Striker, None),
                Some(other) => (Cause::Contact, Some(other)),
                None => (Cause::Unknown, None),
            };
            // Too soon after the partner's own impact for a sight in between: one event moves all three.
            if let Some(other) = cause.1
                && let Some(same) = (0..model.events.len())
                    .rfind(|&e| model.events[e].members.contains(&other) && time_s - times[e] < frame_s)
            {
                model.events[same].members.push(k);
                continue;
            }
            let members = cause.1.into_iter().chain([k]).collect();
            model.events.push(Event { cause: cause.0, members });
            times.push(time_s);
        }
        Self::from_times(model, &times)
    }

    /// When its events are.
    pub(crate) fn times_s(&self) -> impl Iterator<Item = f64> + '_ {
        self.layout.events.iter().map(|slots| self.parameters[slots.time])
    }

    /// The parameters that the sights suggest for events at these times.
    pub(crate) fn from_times(model: Model, times: &[f64]) -> Self {
        let layout = model.layout();
        let mut parameters = vec![0.0; layout.steps.len()];
        for (k, (body, slots)) in model.bodies.iter().zip(&layout.bodies).enumerate() {
            let mine =
                || model.events.iter().zip(times).filter(|(e, _)| e.members.contains(&k)).map(|(_, t)| *t);
            let first_s = mine().next().unwrap_or(f64::INFINITY);
            let rest = rest_pose(body, if body.moves_at_start { f64::NEG_INFINITY } else { first_s });
            parameters[slots.position] = rest.position.x;
            parameters[slots.position + 1] = rest.position.y;
            if let Some(slot) = slots.yaw {
                parameters[slot] = rest.yaw_rad;
            }
            let last_s = mine().next_back().unwrap_or_else(|| body.sights.first().map_or(0.0, |s| s.time_s));
            let friction = friction_guess(body, last_s);
            if let Some(slot) = slots.friction {
                parameters[slot] = friction;
            }
            if let Some(slot) = slots.velocity {
                let start_s = body.sights.first().map_or(0.0, |s| s.time_s);
                set_velocity(&mut parameters, slot, body, start_s);
            }
        }
        for ((event, slots), time_s) in model.events.iter().zip(&layout.events).zip(times) {
            parameters[slots.time] = *time_s;
            for (&member, &slot) in event.members.iter().zip(&slots.velocities) {
                set_velocity(&mut parameters, slot, &model.bodies[member], *time_s);
            }
        }
        Self { model, layout, parameters }
    }
}

/// The mean of the sights before a time; the first sight if there are none.
fn rest_pose(body: &Body, until_s: f64) -> Pose {
    let rest: Vec<_> = body.sights.iter().filter(|s| s.time_s < until_s).collect();
    let Some(first) = body.sights.first() else { return Pose::default() };
    if rest.is_empty() {
        return Pose { position: first.position, yaw_rad: first.yaw_rad.unwrap_or(0.0) };
    }
    let n = rest.len() as f64;
    let sum = rest.iter().fold(Vec2::ZERO, |sum, s| sum + s.position.to_vec());
    let yaws: Vec<f64> = rest.iter().filter_map(|s| s.yaw_rad).collect();
    let yaw_rad = if yaws.is_empty() { 0.0 } else { yaws.iter().sum::<f64>() / yaws.len() as f64 };
    Pose { position: Point::ORIGIN + sum / n, yaw_rad }
}

/// The friction of the last slide from its length and duration; of one without an end, from nothing.
fn friction_guess(body: &Body, from_s: f64) -> f64 {
    const UNKNOWN: f64 = 0.2;
    let Some(last) = body.sights.last() else { return UNKNOWN };
    let moved_m = moved_m(&body.sights);
    let stop = body.sights.iter().find(|s| s.position.distance(last.position) < moved_m);
    let distance_m = seen_at(body, from_s).position.distance(last.position);
    match stop {
        Some(stop) if stop.time_s > from_s && stop.time_s < last.time_s => {
            friction_of_a_stop(distance_m, stop.time_s - from_s).clamp(0.01, 2.0)
        }
        _ => UNKNOWN,
    }
}

/// The mean velocity over the next moments.
fn set_velocity(parameters: &mut [f64], slot: usize, body: &Body, time_s: f64) {
    // Two frames, and no less than this: at high frame rates two frames are all noise.
    const SPAN_S: f64 = 0.02;
    let after: Vec<_> = body.sights.iter().filter(|s| s.time_s > time_s).collect();
    let Some(to) =
        after.iter().enumerate().find(|(k, s)| *k >= 1 && s.time_s >= time_s + SPAN_S).map(|(_, s)| s)
    else {
        return;
    };
    let (from, to_pose) = (seen_at(body, time_s), seen_at(body, to.time_s));
    let velocity = (to_pose.position - from.position) / (to.time_s - time_s);
    parameters[slot] = velocity.x;
    parameters[slot + 1] = velocity.y;
    if body.sees_yaw {
        parameters[slot + 2] = (to_pose.yaw_rad - from.yaw_rad) / (to.time_s - time_s);
    }
}

/// Which of the bodies that already move is nearest to body `k`, if near enough to hit it.
fn partner(bodies: &[Body], k: usize, time_s: f64, moving: &[(f64, usize)]) -> Option<usize> {
    let at_start = (0..bodies.len()).filter(|&j| bodies[j].moves_at_start);
    let mut candidates: Vec<usize> =
        moving.iter().map(|(_, j)| *j).chain(at_start).filter(|&j| j != k).collect();
    candidates.sort_unstable();
    let here = seen_at(&bodies[k], time_s);
    nearest(bodies, k, here, &candidates, |j| seen_at(&bodies[j], time_s))
}

/// The nearest of the candidates, if its gap is below [`NEAR_M`].
fn nearest(
    bodies: &[Body],
    k: usize,
    here: Pose,
    candidates: &[usize],
    pose: impl Fn(usize) -> Pose,
) -> Option<usize> {
    let gap = |j: usize| {
        let there = pose(j);
        let away = (there.position - here.position).direction()?;
        let own = Outline { shape: &bodies[k].shape, pose: here };
        touch_apart(own, Outline { shape: &bodies[j].shape, pose: there }, away).map(|t| t.gap_m.abs())
    };
    let (gap_m, j) = candidates
        .iter()
        .filter_map(|&j| gap(j).map(|gap_m| (gap_m, j)))
        .min_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)))?;
    let slack_m = match &bodies[j].shape {
        Shape::Disc { .. } => NEAR_M,
        // An outline whose turn is unknown may reach out farther than it seems.
        shape if !bodies[j].sees_yaw => NEAR_M + shape.outer_radius_m() / 2.0,
        _ => NEAR_M,
    };
    (gap_m < slack_m).then_some(j)
}

/// The body nearest to body `k` on the fitted paths, if near enough to hit it.
pub(crate) fn fitted_partner(bodies: &[Body], paths: &[Path], k: usize, time_s: f64) -> Option<usize> {
    let candidates: Vec<usize> = (0..bodies.len()).filter(|&j| j != k).collect();
    let here = paths[k].motion(time_s).pose;
    nearest(bodies, k, here, &candidates, |j| paths[j].motion(time_s).pose)
}
