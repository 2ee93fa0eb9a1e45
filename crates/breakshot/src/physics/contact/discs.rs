//! When do two discs touch?
//!
//! A moving disc and a resting one: the path is straight, so the place of contact is that of a ray and a circle, and the
//! time follows from the way.  Two moving discs without spin: the squared distance is a quartic in time until the first
//! of them stops.  Two moving discs of which one spins: the line across the way between the centres, again and again.

use super::{CONTACT_GAP_M, Mover, Outlook, PRESSING_M_S, time_apart_s};
use crate::geometry::Vec2;
use crate::physics::contact::roots::first_crossing;
use crate::physics::sliding::motion::{Law, Motion};

/// The first contact of two discs from a time on; one that presses is overlooked until `pressing_s`.
pub(super) fn first_contact(a: Mover, b: Mover, from_s: f64, pressing_s: f64) -> Outlook {
    let reach_m = a.body.plate.outer_radius_m + b.body.plate.outer_radius_m;
    let from_s = if pressing_s > from_s && presses(a, b, reach_m, from_s) { pressing_s } else { from_s };
    let (first, last) = if a.motion.stop_s <= b.motion.stop_s { (a, b) } else { (b, a) };
    if first.motion.stop_s > from_s {
        let curved = |m: &Motion| matches!(m.law, Law::Curved { .. });
        let found = if curved(first.motion) || curved(last.motion) {
            both_moving_curved(first, last, reach_m, from_s)
        } else {
            both_moving(first.motion, last.motion, reach_m, from_s).map_or(Outlook::Never, Outlook::Touch)
        };
        if found != Outlook::Never {
            return found;
        }
    }
    let alone_s = from_s.max(first.motion.stop_s);
    if last.motion.stop_s <= alone_s {
        return Outlook::Never;
    }
    one_moving(last, first.motion, reach_m, alone_s).map_or(Outlook::Never, Outlook::Touch)
}

/// Whether two discs touch and approach no faster than contacts press.
fn presses(a: Mover, b: Mover, reach_m: f64, time_s: f64) -> bool {
    let (p, q) = (a.motion.state(time_s, a.body), b.motion.state(time_s, b.body));
    let between = q.position - p.position;
    let distance_m = between.length_squared().sqrt();
    let approach = between.dot(p.velocity - q.velocity) / distance_m;
    distance_m < reach_m + CONTACT_GAP_M && approach < PRESSING_M_S
}

/// Place, velocity and half the acceleration at a time before the stop.
fn parabola(motion: &Motion, time_s: f64) -> (Vec2, Vec2, Vec2) {
    let deceleration = motion.deceleration_m_s2[0];
    let time = time_s - motion.start_s;
    let way_m = time * (motion.speed_m_s - 0.5 * deceleration * time);
    let speed_m_s = motion.speed_m_s - deceleration * time;
    let along = motion.direction;
    (motion.start.position.to_vec() + along * way_m, along * speed_m_s, along * (-0.5 * deceleration))
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

/// Lines tried before the search answers "ask again".
const STEPS: usize = 30;

/// Until the first of the two stops, for speeds that do not fall evenly.
fn both_moving_curved(first: Mover, last: Mover, reach_m: f64, from_s: f64) -> Outlook {
    let mut time_s = from_s;
    for _ in 0..STEPS {
        let (p, q) = (first.motion.state(time_s, first.body), last.motion.state(time_s, last.body));
        let between = q.position - p.position;
        let distance_m = between.length_squared().sqrt();
        let normal = between / distance_m;
        let (gap_m, change) = (distance_m - reach_m, normal.dot(q.velocity - p.velocity));
        if gap_m <= CONTACT_GAP_M && change < 0.0 {
            return Outlook::Touch(time_s);
        }
        let braking = |m: Mover, along: f64| {
            along * if along > 0.0 { m.motion.deceleration_m_s2[1] } else { m.motion.deceleration_m_s2[0] }
        };
        let bend = braking(last, last.motion.direction.dot(normal))
            + braking(first, -first.motion.direction.dot(normal));
        time_s += time_apart_s(gap_m.max(SMALLEST_GAP_M), change, bend);
        if time_s >= first.motion.stop_s {
            return Outlook::Never;
        }
    }
    Outlook::NotBefore(time_s)
}

/// A gap of rounding's size counts as this (m), so that discs that move along together are not asked about for ever.
pub(super) const SMALLEST_GAP_M: f64 = 1e-9;

/// A disc that runs straight on against one that rests: ray and circle.
fn one_moving(moving: Mover, resting: &Motion, reach_m: f64, from_s: f64) -> Option<f64> {
    let Mover { body, motion } = moving;
    let here = motion.state(from_s, body).position;
    let way = resting.end.position - here;
    let (along, across) = (way.dot(motion.direction), way.cross(motion.direction));
    let room = reach_m * reach_m - across * across;
    if along <= 0.0 || room <= 0.0 {
        return None;
    }
    let way_m = (along - room.sqrt()).max(0.0);
    motion.time_of_way_s(way_m, from_s, body)
}
