//! When do two circles touch?
//!
//! A moving disc and a resting one: the path is straight, so the place of contact is that of a ray and a circle, and the
//! time follows from the way.  Two moving discs: the squared distance is a quartic in time until the first of them stops.

use crate::geometry::Vec2;
use crate::physics::evolve::{Law, Motion};
use crate::physics::roots::first_crossing;

/// The time at which the centres of two discs that do not curve come within `reach_m` of each other.
pub(crate) fn first_contact_discs(a: &Motion, b: &Motion, reach_m: f64, from_s: f64) -> Option<f64> {
    let (first, last) = if a.stop_s <= b.stop_s { (a, b) } else { (b, a) };
    if first.stop_s > from_s
        && let Some(time_s) = both_moving(first, last, reach_m, from_s)
    {
        return Some(time_s);
    }
    let alone_s = from_s.max(first.stop_s);
    if last.stop_s <= alone_s { None } else { one_moving(last, first, reach_m, alone_s) }
}

/// Place, velocity and half the acceleration at a time before the stop.
fn parabola(motion: &Motion, time_s: f64) -> (Vec2, Vec2, Vec2) {
    let deceleration = deceleration_m_s2(motion);
    let time = time_s - motion.start_s;
    let way_m = time * (motion.speed_m_s - 0.5 * deceleration * time);
    let speed_m_s = motion.speed_m_s - deceleration * time;
    let along = motion.direction;
    (motion.start.position.to_vec() + along * way_m, along * speed_m_s, along * (-0.5 * deceleration))
}

fn deceleration_m_s2(motion: &Motion) -> f64 {
    match motion.law {
        Law::Even { deceleration_m_s2, .. } => deceleration_m_s2,
        _ => 0.0,
    }
}

/// Until the first of the two stops: the squared distance less the squared reach is a quartic.
fn both_moving(first: &Motion, last: &Motion, reach_m: f64, from_s: f64) -> Option<f64> {
    let ((p, v, h), (q, u, g)) = (parabola(first, from_s), parabola(last, from_s));
    let (way, speed, half) = (p - q, v - u, h - g);
    let quartic = [
        way.length_squared() - reach_m * reach_m,
        2.0 * way.dot(speed),
        speed.length_squared() + 2.0 * way.dot(half),
        2.0 * speed.dot(half),
        half.length_squared(),
    ];
    first_crossing(&quartic, first.stop_s - from_s).map(|time| from_s + time)
}

/// A disc that runs straight on against one that rests: ray and circle.
fn one_moving(moving: &Motion, resting: &Motion, reach_m: f64, from_s: f64) -> Option<f64> {
    let passed_m = match moving.law {
        Law::Even { deceleration_m_s2, .. } => {
            let time = from_s - moving.start_s;
            time * (moving.speed_m_s - 0.5 * deceleration_m_s2 * time)
        }
        _ => 0.0,
    };
    let way = resting.end.position - moving.start.position;
    let along = way.dot(moving.direction);
    let across = way.cross(moving.direction);
    let room = reach_m * reach_m - across * across;
    if along <= passed_m || room <= 0.0 {
        return None;
    }
    let way_m = (along - room.sqrt()).max(passed_m);
    time_of_way(moving, way_m).map(|time_s| time_s.max(from_s))
}

/// When a body has gone a way along its path; none if it stops before.
fn time_of_way(motion: &Motion, way_m: f64) -> Option<f64> {
    let square = motion.speed_m_s * motion.speed_m_s - 2.0 * deceleration_m_s2(motion) * way_m;
    (square > 0.0).then(|| motion.start_s + 2.0 * way_m / (motion.speed_m_s + square.sqrt()))
}
