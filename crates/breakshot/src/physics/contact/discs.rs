//! When do two discs touch?
//!
//! A moving and a resting disc: the path is straight, so the position of contact is that of a ray and a circle, and the time
//! follows from the distance.  Two moving discs without spin: the squared distance is a quartic in time until the first of
//! them stops.  Two moving discs of which one spins: conservative advancement along the line between the centres.

use super::roots::first_crossing;
use super::time_of_impact::{
    CONTACT_GAP_M, MovingBody, SMALLEST_GAP_M, SUSTAINED_CONTACT_M_S, TimeOfImpact, safe_time_s,
};
use crate::geometry::Vec2;
use crate::geometry::conservative_advancement::{Step, advance};
use crate::physics::sliding::motion::{Motion, SpeedLaw};

/// The first contact of two discs from a time on; a sustained contact is ignored until `ignored_until_s`.
pub(super) fn first_contact(a: MovingBody, b: MovingBody, from_s: f64, ignored_until_s: f64) -> TimeOfImpact {
    let reach_m = a.body.shape.outer_radius_m + b.body.shape.outer_radius_m;
    let from_s = if ignored_until_s > from_s && is_sustained_contact(a, b, reach_m, from_s) {
        ignored_until_s
    } else {
        from_s
    };
    let (first, last) = if a.motion.stop_s <= b.motion.stop_s { (a, b) } else { (b, a) };
    if first.motion.stop_s > from_s {
        let is_curved = |m: &Motion| matches!(m.law, SpeedLaw::Curved { .. });
        let found = if is_curved(first.motion) || is_curved(last.motion) {
            both_moving_with_spin(first, last, reach_m, from_s)
        } else {
            both_moving(first.motion, last.motion, reach_m, from_s)
                .map_or(TimeOfImpact::Never, TimeOfImpact::At)
        };
        if found != TimeOfImpact::Never {
            return found;
        }
    }
    let first_stopped_s = from_s.max(first.motion.stop_s);
    if last.motion.stop_s <= first_stopped_s {
        return TimeOfImpact::Never;
    }
    one_moving(last, first.motion, reach_m, first_stopped_s).map_or(TimeOfImpact::Never, TimeOfImpact::At)
}

/// Whether two discs touch and approach more slowly than in an impact.
fn is_sustained_contact(a: MovingBody, b: MovingBody, reach_m: f64, time_s: f64) -> bool {
    let (p, q) = (a.motion.state(time_s, a.body), b.motion.state(time_s, b.body));
    let between = q.position - p.position;
    let distance_m = between.length_squared().sqrt();
    let approach = between.dot(p.velocity - q.velocity) / distance_m;
    distance_m < reach_m + CONTACT_GAP_M && approach < SUSTAINED_CONTACT_M_S
}

/// Position, velocity and half the acceleration at a time before the stop.
fn parabola(motion: &Motion, time_s: f64) -> (Vec2, Vec2, Vec2) {
    let deceleration = motion.deceleration_m_s2[0];
    let time = time_s - motion.start_s;
    let distance_m = time * (motion.speed_m_s - 0.5 * deceleration * time);
    let speed_m_s = motion.speed_m_s - deceleration * time;
    let along = motion.direction;
    (motion.start.position.to_vec() + along * distance_m, along * speed_m_s, along * (-0.5 * deceleration))
}

/// The first contact before the first of two discs stops: a root of the squared distance less the squared sum of radii.
fn both_moving(first: &Motion, last: &Motion, reach_m: f64, from_s: f64) -> Option<f64> {
    let ((p, v, h), (q, u, g)) = (parabola(first, from_s), parabola(last, from_s));
    let (offset, speed, half) = (p - q, v - u, h - g);
    let quartic = [
        offset.length_squared() - reach_m * reach_m,
        2.0 * offset.dot(speed),
        speed.length_squared() + 2.0 * offset.dot(half),
        2.0 * speed.dot(half),
        half.length_squared(),
    ];
    first_crossing(&quartic, first.stop_s - from_s).map(|time| from_s + time)
}

/// Steps before the search answers "not before".
const STEPS: usize = 30;

/// The first contact of two moving discs of which at least one spins, until the first of them stops, by conservative
/// advancement along the line between their centres.
fn both_moving_with_spin(first: MovingBody, last: MovingBody, reach_m: f64, from_s: f64) -> TimeOfImpact {
    let found = advance(from_s, STEPS, |time_s| {
        let (p, q) = (first.motion.state(time_s, first.body), last.motion.state(time_s, last.body));
        let between = q.position - p.position;
        let distance_m = between.length_squared().sqrt();
        let normal = between / distance_m;
        let (gap_m, change) = (distance_m - reach_m, normal.dot(q.velocity - p.velocity));
        if gap_m <= CONTACT_GAP_M && change < 0.0 {
            return Step::End(TimeOfImpact::At(time_s));
        }
        let braking = |m: MovingBody, along: f64| {
            along * if along > 0.0 { m.motion.deceleration_m_s2[1] } else { m.motion.deceleration_m_s2[0] }
        };
        let deceleration = braking(last, last.motion.direction.dot(normal))
            + braking(first, -first.motion.direction.dot(normal));
        let next_s = time_s + safe_time_s(gap_m.max(SMALLEST_GAP_M), change, deceleration);
        if next_s >= first.motion.stop_s { Step::End(TimeOfImpact::Never) } else { Step::To(next_s) }
    });
    found.unwrap_or_else(TimeOfImpact::NotBefore)
}

/// The first contact of a disc on a straight path with a resting one: intersection of a ray and a circle.
fn one_moving(moving: MovingBody, resting: &Motion, reach_m: f64, from_s: f64) -> Option<f64> {
    let MovingBody { body, motion } = moving;
    let position = motion.state(from_s, body).position;
    let to_resting = resting.end.position - position;
    let (along, across) = (to_resting.dot(motion.direction), to_resting.cross(motion.direction));
    let room = reach_m * reach_m - across * across;
    if along <= 0.0 || room <= 0.0 {
        return None;
    }
    let distance_m = (along - room.sqrt()).max(0.0);
    motion.time_at_distance_s(distance_m, from_s, body)
}
