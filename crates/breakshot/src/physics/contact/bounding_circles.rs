//! When can the circles around two bodies touch?
//!
//! All paths are straight and all speeds fall, so that cheap bounds rule out most pairs: the circles that hold the
//! remaining paths, the ray of a body against a resting circle, and a line across the way between the centres.

use super::{Mover, Outlook, time_apart_s};
use crate::geometry::Vec2;
use crate::physics::sliding::motion::State;

/// A lower bound of the time of contact from circles around both bodies.
pub(super) fn first_look(a: Mover, b: Mover, from_s: f64) -> Outlook {
    let reach_m = a.body.plate.outer_radius_m + b.body.plate.outer_radius_m;
    let (state_a, state_b) = (a.motion.state(from_s, a.body), b.motion.state(from_s, b.body));
    match time_apart((a, &state_a), (b, &state_b), reach_m, from_s) {
        f64::INFINITY => Outlook::Never,
        time => Outlook::NotBefore(from_s + time),
    }
}

/// How long circles surely stay apart (s): zero if they overlap now, infinite if they never meet.
pub(super) fn time_apart(a: (Mover, &State), b: (Mover, &State), reach_m: f64, from_s: f64) -> f64 {
    let between = b.1.position - a.1.position;
    let squared = between.length_squared();
    if squared <= reach_m * reach_m {
        return 0.0;
    }
    match (a.0.motion.stop_s > from_s, b.0.motion.stop_s > from_s) {
        (true, false) => time_to_circle(a, between, reach_m),
        (false, true) => time_to_circle(b, -between, reach_m),
        (false, false) => f64::INFINITY,
        (true, true) => {
            let distance_m = squared.sqrt();
            let normal = between / distance_m;
            let change = normal.dot(b.1.velocity - a.1.velocity);
            // Only the braking of the one that runs away can bring the two together.
            let bend = braking_along(b.0, normal) + braking_along(a.0, -normal);
            time_apart_s(distance_m - reach_m, change, bend)
        }
    }
}

/// How fast a body's braking pulls it against a direction (m/s2).
fn braking_along(mover: Mover, direction: Vec2) -> f64 {
    (mover.motion.direction.dot(direction) * mover.motion.deceleration_m_s2[1]).max(0.0)
}

/// How long a body needs at least to a circle that rests `way` from it (s).
fn time_to_circle((mover, state): (Mover, &State), way: Vec2, reach_m: f64) -> f64 {
    let direction = mover.motion.direction;
    let (along, across) = (way.dot(direction), way.cross(direction));
    let room = reach_m * reach_m - across * across;
    if along <= 0.0 || room <= 0.0 {
        return f64::INFINITY;
    }
    let way_m = along - room.sqrt();
    let left = mover.motion.end.position - state.position;
    if way_m > left.dot(direction) {
        return f64::INFINITY;
    }
    way_m / mover.motion.greatest_speeds(state).0
}
