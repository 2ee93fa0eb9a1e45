//! Clips whose story does not hold together: a body that nothing sets in motion, a picture that jumps or comes twice.

use super::fit::Fitted;
use super::initial_guess::{frame_s, noise_m, seen_at};
use super::motion_model::{Body, Cause, EventSlots, Sight};
use crate::geometry::{Point, Vec2};
use crate::outline::Outline;

/// So many sights on either side tell that a body rests.
const STILL_SIGHTS: usize = 3;
/// A jump is longer than this (m), and than this many deviations of the noise.
const JUMP_M: f64 = 2e-4;
const JUMP_NOISES: f64 = 8.0;
/// Sights of a body at rest lie this many deviations together.
const STILL_NOISES: f64 = 4.0;
/// A body this near to another one may have been pushed by it (m).
const NEAR_M: f64 = 0.01;

/// Why nothing that the clip tells can be believed, if so; `struck`: whether the robot was told to strike.
pub(crate) fn contradiction(fitted: &Fitted, struck: bool) -> Option<String> {
    let bodies = &fitted.model.bodies;
    let why = pictures_repeat(bodies)
        .or_else(|| picture_jumps(bodies))
        .or_else(|| set_off_by_nothing(fitted, struck))?;
    Some(format!("left out: {why}"))
}

/// A body that is hit by nothing filmed or told although no impact before explains its motion: names or outlines are
/// not those of the clip.
fn set_off_by_nothing(fitted: &Fitted, struck: bool) -> Option<String> {
    /// An impact so long before is one of its own, not the same one told twice.
    const FRAMES_BEFORE: f64 = 2.0;
    if !struck {
        return None;
    }
    let within_s = FRAMES_BEFORE * frame_s(&fitted.model.bodies);
    let events = || fitted.model.events.iter().zip(&fitted.layout.events);
    let time_s = |slots: &EventSlots| fitted.minimum.parameters[slots.time];
    events().filter(|(event, _)| event.cause == Cause::Unknown && event.members.len() == 1).find_map(
        |(event, slots)| {
            let (k, at_s) = (event.members[0], time_s(slots));
            let rested = fitted.paths[k].motion_before(at_s).velocity == Vec2::ZERO;
            let explained = events().any(|(other, slots)| {
                other.cause != Cause::Unknown && other.members.contains(&k) && time_s(slots) < at_s - within_s
            });
            let object = &fitted.model.bodies[k].object;
            (rested || !explained)
                .then(|| format!("`{object}` is set in motion at {at_s:.3} s with nothing near it"))
        },
    )
}

/// A body under way stands still from one frame to the next, and goes on: the film shows old pictures again.
fn pictures_repeat(bodies: &[Body]) -> Option<String> {
    /// A picture or two may be lost.
    const FEWEST: usize = 4;
    /// Steps so long (m), with one between them that is shorter than this part of either.
    const STEP_M: f64 = 4e-4;
    const STANDS: f64 = 0.1;
    bodies.iter().find_map(|body| {
        let steps_m: Vec<f64> =
            body.sights.windows(2).map(|w| w[1].position.distance(w[0].position)).collect();
        let stands = |w: &&[f64]| w[0].min(w[2]) > STEP_M && w[1] < STANDS * w[0].min(w[2]);
        let again = steps_m.windows(3).filter(stands).count();
        let object = &body.object;
        (again >= FEWEST)
            .then(|| format!("{again} pictures show `{object}` under way where it was the picture before"))
    })
}

/// Everything that rests lies elsewhere from one frame to the next: the camera or the table was moved.
fn picture_jumps(bodies: &[Body]) -> Option<String> {
    bodies.iter().find_map(|body| {
        let (at_s, jump) = jump_at_rest(body)?;
        let others = || bodies.iter().filter(|o| o.object != body.object);
        let mut still = others().filter_map(|other| Some((other, still_step(other, at_s)?))).peekable();
        let alone = still.peek().is_none();
        let alike = still.all(|(other, step)| step.length() > least_jump_m(other));
        let outline = |b: &Body| Outline::new(&b.shape, seen_at(b, at_s));
        let pushed = alone && others().any(|other| outline(body).gap_m(&outline(other)) < NEAR_M);
        let far_mm = jump.length() * 1e3;
        (alike && !pushed).then(|| {
            format!("what rests jumps by {far_mm:.1} mm at {at_s:.3} s: the camera or the table was moved")
        })
    })
}

fn least_jump_m(body: &Body) -> f64 {
    (JUMP_NOISES * noise_m(&body.sights)).max(JUMP_M)
}

/// The first jump of a body that rests before and after it.
fn jump_at_rest(body: &Body) -> Option<(f64, Vec2)> {
    let least_m = least_jump_m(body);
    (1..body.sights.len()).find_map(|k| {
        // Most sights are refused by this.
        let apart_m = body.sights[k].position.distance(body.sights[k - 1].position);
        let step = if apart_m > least_m { step_between(body, k)? } else { Vec2::ZERO };
        (step.length() > least_m).then(|| (body.sights[k].time_s, step))
    })
}

/// By how much a body steps at a time, if it rests on both sides.
fn still_step(body: &Body, at_s: f64) -> Option<Vec2> {
    step_between(body, body.sights.partition_point(|s| s.time_s < at_s))
}

fn step_between(body: &Body, k: usize) -> Option<Vec2> {
    let noise_m = noise_m(&body.sights);
    let place = |sights: &[Sight]| {
        let sum = sights.iter().fold(Vec2::ZERO, |sum, s| sum + s.position.to_vec());
        let mean = Point::ORIGIN + sum / sights.len() as f64;
        let still = sights.iter().all(|s| s.position.distance(mean) < STILL_NOISES * noise_m);
        still.then_some(mean)
    };
    let before = body.sights.get(k.checked_sub(STILL_SIGHTS)?..k)?;
    let after = body.sights.get(k..k + STILL_SIGHTS)?;
    Some(place(after)? - place(before)?)
}
