//! When can the circles around two bodies touch?
//!
//! Speeds decrease along straight paths, so cheap bounds exclude most pairs: the circles around the remaining paths, the ray
//! of a body against a resting circle, and the gap along the line between the centres.

use super::time_of_impact::{MovingBody, TimeOfImpact, safe_time_s};
use crate::geometry::Vec2;
use crate::physics::sliding::motion::State;

/// A lower bound of the time of impact from the circles around both bodies.
pub(super) fn lower_bound(a: MovingBody, b: MovingBody, from_s: f64) -> TimeOfImpact {
    let reach_m = a.body.shape.outer_radius_m + b.body.shape.outer_radius_m;
    let (state_a, state_b) = (a.motion.state(from_s, a.body), b.motion.state(from_s, b.body));
    match free_time_s([a, b], [&state_a, &state_b], reach_m, from_s) {
        f64::INFINITY => TimeOfImpact::Never,
        time => TimeOfImpact::NotBefore(from_s + time),
    }
}

/// A time for which the circles do not touch (s): zero if they overlap now, infinite if they never touch.
pub(super) fn free_time_s(
    [a, b]: [MovingBody; 2],
    [state_a, state_b]: [&State; 2],
    reach_m: f64,
    from_s: f64,
) -> f64 {
    let between = state_b.position - state_a.position;
    let squared = between.length_squared();
    if squared <= reach_m * reach_m {
        return 0.0;
    }
    match (a.motion.stop_s > from_s, b.motion.stop_s > from_s) {
        (true, false) => time_to_circle(a, state_a, between, reach_m),
        (false, true) => time_to_circle(b, state_b, -between, reach_m),
        (false, false) => f64::INFINITY,
        (true, true) => {
            let distance_m = squared.sqrt();
            let normal = between / distance_m;
            let change = normal.dot(state_b.velocity - state_a.velocity);
            // Braking closes the gap only where it slows a body that moves away from the other.
            let deceleration = braking_along(b, normal) + braking_along(a, -normal);
            safe_time_s(distance_m - reach_m, change, deceleration)
        }
    }
}

/// The component of a body's braking against a direction (m/s2).
fn braking_along(moving: MovingBody, direction: Vec2) -> f64 {
    (moving.motion.direction.dot(direction) * moving.motion.deceleration_m_s2[1]).max(0.0)
}

/// The least time in which a body reaches a resting circle whose centre is `to_circle` from it (s).
fn time_to_circle(moving: MovingBody, state: &State, to_circle: Vec2, reach_m: f64) -> f64 {
    let direction = moving.motion.direction;
    let (along, across) = (to_circle.dot(direction), to_circle.cross(direction));
    let room = reach_m * reach_m - across * across;
    if along <= 0.0 || room <= 0.0 {
        return f64::INFINITY;
    }
    let distance_m = along - room.sqrt();
    let remaining = moving.motion.end.position - state.position;
    if distance_m > remaining.dot(direction) {
        return f64::INFINITY;
    }
    distance_m / moving.motion.greatest_speeds(state).0
}
