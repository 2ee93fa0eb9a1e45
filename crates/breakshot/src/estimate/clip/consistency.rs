//! Is a clip consistent with itself?
//!
//! A clip is inconsistent if a body starts to move with nothing near it, if bodies at rest jump from one frame to the
//! next, if two bodies hit each other without touching, or if frames repeat earlier ones.

use super::fit::MotionFit;
use super::initial_guess::{frame_s, noise_m, observed_pose};
use super::motion_model::{Body, Cause, EventIndices, Observation};
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
    let events = || fitted.model.events.iter().zip(&fitted.layout.events);
    let time_s = |indices: &EventIndices| fitted.minimum.parameters[indices.time];
    events().filter(|(event, _)| event.cause == Cause::Unknown && event.members.len() == 1).find_map(
        |(event, indices)| {
            let (k, at_s) = (event.members[0], time_s(indices));
            let at_rest = fitted.paths[k].motion_before(at_s).velocity == Vec2::ZERO;
            let explained = events().any(|(other, indices)| {
                other.cause != Cause::Unknown
                    && other.members.contains(&k)
                    && time_s(indices) < at_s - within_s
            });
            let object = &fitted.model.bodies[k].object;
            (at_rest || !explained)
                .then(|| format!("`{object}` is set in motion at {at_s:.3} s with nothing near it"))
        },
    )
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
