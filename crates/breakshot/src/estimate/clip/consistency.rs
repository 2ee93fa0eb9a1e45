//! Is a clip consistent with itself?
//!
//! A clip is inconsistent if a body starts to move with nothing near it, if bodies at rest jump from one frame to the
//! next, if two bodies hit each other without touching, or if frames repeat earlier ones.

use super::fit::MotionFit;
use super::initial_guess::{frame_s, noise_m, observed_pose};
use super::motion_model::{Body, Cause, Event, Observation};
use crate::estimate::closest_points::closest_points;
use crate::geometry::outline::Outline;
use crate::geometry::{Point, Vec2};

/// A body is at rest if this number of observations before or after an instant agree within the noise.
const REST_OBSERVATIONS: usize = 3;
/// Observations of a body at rest are within this many standard deviations of their mean.
const REST_NOISES: f64 = 4.0;
/// A jump is longer than this (m), and than this many standard deviations of the noise.
const JUMP_M: f64 = 2e-4;
const JUMP_NOISES: f64 = 8.0;
/// A body nearer than this to another one may have been pushed by it (m).
const NEAR_M: f64 = 0.01;

/// Outlines that are farther apart at an impact than this (m) do not touch: rulers and cameras are more accurate.
pub(crate) const MAX_GAP_M: f64 = 0.003;
/// A nearer approach has to be nearer by this factor.
const NEARER: f64 = 0.5;

/// Why the clip is inconsistent, if it is; `with_strike`: whether a strike is specified for it.
pub(crate) fn inconsistency(fitted: &MotionFit, with_strike: bool) -> Option<String> {
    let bodies = &fitted.model.bodies;
    let reason = repeated_frames(bodies)
        .or_else(|| jump_of_all_at_rest(bodies))
        .or_else(|| motion_without_cause(fitted, with_strike))
        .or_else(|| impact_without_contact(fitted))?;
    Some(format!("left out: {reason}"))
}

/// A body that is set in motion by something that is neither filmed nor specified, without an earlier impact that
/// explains it: names or outlines are not those of the clip.
fn motion_without_cause(fitted: &MotionFit, with_strike: bool) -> Option<String> {
    /// An impact explains the motion only if it is earlier by this; a nearer one may be the same impact, fitted as two.
    const FRAMES_BEFORE: f64 = 2.0;
    if !with_strike {
        return None;
    }
    let within_s = FRAMES_BEFORE * frame_s(&fitted.model.bodies);
    let unknown = |(event, _): &(&Event, f64)| event.cause == Cause::Unknown && event.members.len() == 1;
    fitted.timed_events().filter(unknown).find_map(|(event, at_s)| {
        let k = event.members[0];
        let at_rest = fitted.paths[k].motion_before(at_s).velocity == Vec2::ZERO;
        let explained = fitted.timed_events().any(|(other, time_s)| {
            other.cause != Cause::Unknown && other.members.contains(&k) && time_s < at_s - within_s
        });
        let object = &fitted.model.bodies[k].object;
        (at_rest || !explained)
            .then(|| format!("`{object}` is set in motion at {at_s:.3} s with nothing near it"))
    })
}

/// Two moving bodies that change their motion while they are apart: the sequence of their impacts is not the one that was found, and
/// frictions and impulses take its place.
fn impact_without_contact(fitted: &MotionFit) -> Option<String> {
    let (pair, time_s, gap_m) = fitted.hit_without_contact()?;
    let [a, b] = pair.map(|k| &fitted.model.bodies[k].object);
    Some(format!(
        "`{a}` and `{b}` change their motion at {time_s:.3} s with their outlines {:.1} mm apart: their impacts follow too fast, or positions are wrong",
        1e3 * gap_m
    ))
}

// Positions alone date an impact between two frames that are far apart badly, and a later impact of the same bodies can be taken for an
// earlier one with other frictions. The outlines decide: bodies that hit each other touch.
impl MotionFit {
    /// The gap between the outlines of two bodies at a time (m); 0 if they overlap.
    fn gap_m(&self, [a, b]: [usize; 2], time_s: f64) -> f64 {
        let placed = |k: usize| self.placed(k, self.paths[k].motion_before(time_s).pose);
        closest_points(placed(a), placed(b)).map_or(0.0, |closest| closest.gap_m)
    }

    /// The observation's time at which two bodies approach each other most, while no other impact of theirs comes between it and
    /// `time_s` (s); `None` if they touch at `time_s`, or come no nearer.
    pub(super) fn nearer_approach_s(&self, event: &Event, time_s: f64) -> Option<f64> {
        let &[a, b] = &event.members[..] else { return None };
        let gap_m = self.gap_m([a, b], time_s);
        if event.cause != Cause::Contact || gap_m < MAX_GAP_M {
            return None;
        }
        let of_pair = |other: &Event| other.members.contains(&a) || other.members.contains(&b);
        let times = || self.timed_events().filter(|(other, _)| of_pair(other)).map(|(_, at_s)| at_s);
        let after_s = times().filter(|&t| t < time_s).fold(f64::NEG_INFINITY, f64::max);
        let before_s = times().filter(|&t| t > time_s).fold(f64::INFINITY, f64::min);
        let stop_s = self.paths[a].stop_s().max(self.paths[b].stop_s()).min(before_s);
        let observed = self.model.bodies[b].observations.iter().map(|o| o.time_s);
        let gaps = observed.filter(|t| (after_s..stop_s).contains(t)).map(|t| (self.gap_m([a, b], t), t));
        // Of equal gaps the first: bodies that touch may stay together.
        let nearest = gaps.min_by(|p, q| p.0.total_cmp(&q.0))?;
        (nearest.0 < NEARER * gap_m).then_some(nearest.1)
    }

    /// Two bodies that are fitted to hit each other, again, with their outlines apart: their indices, the time (s) and the gap (m).
    pub(super) fn hit_without_contact(&self) -> Option<([usize; 2], f64, f64)> {
        let later = self.timed_events().filter_map(|(event, time_s)| {
            let &[a, b] = &event.members[..] else { return None };
            let both_move = [a, b].iter().all(|&k| self.paths[k].onset_s() < time_s);
            (event.cause == Cause::Contact && both_move).then_some(([a, b], time_s))
        });
        later
            .map(|(pair, time_s)| (pair, time_s, self.gap_m(pair, time_s)))
            .find(|&(.., gap_m)| gap_m > MAX_GAP_M)
    }
}

/// A moving body that does not move from one frame to the next, several times: the film repeats frames.
fn repeated_frames(bodies: &[Body]) -> Option<String> {
    /// One to three repetitions are accepted as lost frames.
    const MIN_REPETITIONS: usize = 4;
    /// A repetition is a step shorter than this fraction of both neighbours, which are at least this long (m).
    const STEP_M: f64 = 4e-4;
    const REPEATED_FRACTION: f64 = 0.1;
    bodies.iter().find_map(|body| {
        let steps_m: Vec<f64> =
            body.observations.windows(2).map(|w| w[1].position.distance(w[0].position)).collect();
        let repeated = |w: &&[f64]| w[0].min(w[2]) > STEP_M && w[1] < REPEATED_FRACTION * w[0].min(w[2]);
        let count = steps_m.windows(3).filter(repeated).count();
        let object = &body.object;
        (count >= MIN_REPETITIONS).then(|| {
            format!("in {count} frames `{object}` is in motion but where the previous frame shows it")
        })
    })
}

/// All bodies at rest jump from one frame to the next: the camera or the table was moved.
fn jump_of_all_at_rest(bodies: &[Body]) -> Option<String> {
    bodies.iter().find_map(|body| {
        let (at_s, jump) = jump_at_rest(body)?;
        let others = || bodies.iter().filter(|o| o.object != body.object);
        let mut at_rest = others().filter_map(|other| Some((other, step_at(other, at_s)?))).peekable();
        let alone = at_rest.peek().is_none();
        let all_jump = at_rest.all(|(other, step)| step.length() > min_jump_m(other));
        let outline = |b: &Body| Outline::new(&b.shape, observed_pose(b, at_s));
        let pushed = alone && others().any(|other| outline(body).gap_m(&outline(other)) < NEAR_M);
        let jump_mm = jump.length() * 1e3;
        (all_jump && !pushed).then(|| {
            format!("all at rest jumps by {jump_mm:.1} mm at {at_s:.3} s: the camera or the table was moved")
        })
    })
}

fn min_jump_m(body: &Body) -> f64 {
    (JUMP_NOISES * noise_m(&body.observations)).max(JUMP_M)
}

/// The first jump of a body that is at rest before and after it: time (s) and displacement.
fn jump_at_rest(body: &Body) -> Option<(f64, Vec2)> {
    let min_m = min_jump_m(body);
    (1..body.observations.len()).find_map(|k| {
        // This test of one frame is cheap and excludes most of them.
        let apart_m = body.observations[k].position.distance(body.observations[k - 1].position);
        let step = if apart_m > min_m { step_before(body, k)? } else { Vec2::ZERO };
        (step.length() > min_m).then(|| (body.observations[k].time_s, step))
    })
}

/// The displacement of a body at a time; `None` unless it is at rest before and after it.
fn step_at(body: &Body, at_s: f64) -> Option<Vec2> {
    step_before(body, body.observations.partition_point(|o| o.time_s < at_s))
}

/// The displacement between observations `k - 1` and `k`; `None` unless the body is at rest before and after it, and no
/// observation is doubtful.
fn step_before(body: &Body, k: usize) -> Option<Vec2> {
    let noise_m = noise_m(&body.observations);
    let rest_position = |observations: &[Observation]| {
        let sum = observations.iter().fold(Vec2::ZERO, |sum, o| sum + o.position.to_vec());
        let mean = Point::ORIGIN + sum / observations.len() as f64;
        let at_rest = observations.iter().all(|o| o.position.distance(mean) < REST_NOISES * noise_m);
        at_rest.then_some(mean)
    };
    let before = body.observations.get(k.checked_sub(REST_OBSERVATIONS)?..k)?;
    let after = body.observations.get(k..k + REST_OBSERVATIONS)?;
    if before.iter().chain(after).any(|o| o.doubtful) {
        return None;
    }
    Some(rest_position(after)? - rest_position(before)?)
}
