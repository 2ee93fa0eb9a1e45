//! Conservative advancement: up to when is a line known to keep two bodies apart?
//!
//! Take the line that shows the widest gap: an edge that turns with its body, or the line across the way between two
//! rounded corners.  Every corner on the other side has a distance g from it, changing at g' now, and g'' is never below
//! -C as long as both go on as they do: then `g + g' t - C t^2 / 2` is a lower bound, and no contact comes before its first
//! root.  Step there and look again; near the contact the steps converge quadratically, and no time in between is left
//! unchecked.

use super::witness::{Feature, Witness, witness};
use super::{Mover, Outlook};
use crate::geometry::Vec2;
use crate::physics::evolve::{Law, State};
use crate::physics::rotation::Rotation;
use crate::physics::shape::Laid;

/// Closer than this bodies touch (m): a hundredth of what a light wave could show.
pub(crate) const CONTACT_GAP_M: f64 = 1e-8;
/// A gap of rounding's size counts as this (m), so that bodies that move along together are not asked about for ever.
const SMALLEST_GAP_M: f64 = 1e-9;
/// Lines tried before the search answers "ask again".
const STEP_BUDGET: usize = 12;

/// A body at one instant, with bounds that hold until it stops.
struct Now<'a> {
    mover: Mover<'a>,
    state: State,
    rotation: Rotation,
    speed: f64,
    rate: f64,
    /// Greatest deceleration along the path, and of the turn.
    deceleration: f64,
    yaw_deceleration: f64,
}

impl<'a> Now<'a> {
    fn new(mover: Mover<'a>, time_s: f64) -> Self {
        let state = mover.motion.state(time_s, mover.body);
        let moving = mover.motion.stop_s > time_s;
        let (deceleration, yaw_deceleration) = match mover.motion.law {
            _ if !moving => (0.0, 0.0),
            Law::Rest => (0.0, 0.0),
            Law::Even { deceleration_m_s2, yaw_deceleration_rad_s2 } => {
                (deceleration_m_s2, if state.yaw_rate_rad_s == 0.0 { 0.0 } else { yaw_deceleration_rad_s2 })
            }
            Law::Curved { .. } => (mover.body.grip_m_s2, mover.body.spin_deceleration_rad_s2()),
        };
        Self {
            mover,
            state,
            rotation: Rotation::new(state.yaw_rad),
            speed: state.velocity.length_squared().sqrt(),
            rate: state.yaw_rate_rad_s.abs(),
            deceleration,
            yaw_deceleration,
        }
    }

    /// How fast a point at a distance can be turned aside (m/s2).
    fn turning(&self, reach_m: f64) -> f64 {
        (self.yaw_deceleration + self.rate * self.rate) * reach_m
    }

    fn laid(&self, part: usize) -> Laid<'a> {
        Laid {
            part: &self.mover.body.plate.parts[part],
            origin: self.state.position,
            rotation: self.rotation,
        }
    }
}

/// The first contact of any two bodies.
pub(crate) fn first_contact_convex(a: Mover, b: Mover, from_s: f64) -> Outlook {
    let mut time_s = from_s;
    for _ in 0..STEP_BUDGET {
        let (now_a, now_b) = (Now::new(a, time_s), Now::new(b, time_s));
        let stop_s = next_stop(a, b, time_s);
        if stop_s == f64::INFINITY && a.motion.stop_s <= time_s && b.motion.stop_s <= time_s {
            return Outlook::Never;
        }
        let mut step_s = f64::INFINITY;
        for i in 0..a.body.plate.parts.len() {
            for k in 0..b.body.plate.parts.len() {
                let (laid_a, laid_b) = (now_a.laid(i), now_b.laid(k));
                let seen = witness(&laid_a, &laid_b);
                let safe = safe_step(&now_a, &now_b, (&laid_a, &laid_b), &seen);
                match safe {
                    None => return Outlook::Touch(time_s),
                    Some(step) => step_s = step_s.min(step),
                }
            }
        }
        if step_s == f64::INFINITY && stop_s == f64::INFINITY {
            return Outlook::Never;
        }
        time_s = (time_s + step_s).min(stop_s);
    }
    Outlook::NotBefore(time_s)
}

/// The next time at which one of the two stops.
fn next_stop(a: Mover, b: Mover, time_s: f64) -> f64 {
    [a.motion.stop_s, b.motion.stop_s].into_iter().filter(|&stop| stop > time_s).fold(f64::INFINITY, f64::min)
}

/// How long the witness's line surely keeps the two apart (s); none if they touch now.
fn safe_step(a: &Now, b: &Now, laid: (&Laid, &Laid), seen: &Witness) -> Option<f64> {
    match seen.feature {
        Feature::EdgeOfFirst(k) => step_of_edge(a, b, laid.0, laid.1, k),
        Feature::EdgeOfSecond(k) => step_of_edge(b, a, laid.1, laid.0, k),
        Feature::Corners(..) => step_of_corners(a, b, laid, seen.normal),
    }
}

/// The line of an edge of `a`, turning with it, against every corner of `b`.
fn step_of_edge(a: &Now, b: &Now, laid_a: &Laid, laid_b: &Laid, k: usize) -> Option<f64> {
    let edge = laid_a.part.edges[k];
    let normal = a.rotation.turned(edge.normal);
    let between = b.state.position - a.state.position;
    let (reach_b, radii_m) = (laid_b.part.reach_m, laid_a.part.radius_m + laid_b.part.radius_m);
    let closing = a.speed + b.speed;
    let far = between.length_squared().sqrt() + reach_b;
    // Within this time the corners stay within one and a half times their distance.
    let cap_s = if a.rate == 0.0 && a.yaw_deceleration == 0.0 {
        f64::INFINITY
    } else {
        0.5 * far / (closing + b.rate * reach_b)
    };
    let bend = if cap_s == f64::INFINITY {
        approach_bend(a, b, normal) + b.turning(reach_b)
    } else {
        a.turning(1.5 * far)
            + 2.0 * a.rate * (closing + b.rate * reach_b)
            + a.deceleration
            + b.deceleration
            + b.turning(reach_b)
    };
    let turning = normal.perpendicular() * a.state.yaw_rate_rad_s;
    let relative = b.state.velocity - a.state.velocity;
    let mut step_s = cap_s;
    for &corner in &laid_b.part.corners {
        let arm = laid_b.rotation.turned(corner);
        let place = between + arm;
        let gap = normal.dot(place) - edge.offset_m - radii_m;
        let change = normal.dot(relative + arm.perpendicular() * b.state.yaw_rate_rad_s) + turning.dot(place);
        step_s = step_s.min(safe_time(gap, change, bend)?);
    }
    Some(step_s)
}

/// A line that does not turn, across `normal`, between two parts of which one is a single rounded corner.
fn step_of_corners(a: &Now, b: &Now, laid: (&Laid, &Laid), normal: Vec2) -> Option<f64> {
    let bend = approach_bend(a, b, normal) + a.turning(laid.0.part.reach_m) + b.turning(laid.1.part.reach_m);
    let between = b.state.position - a.state.position;
    let relative = b.state.velocity - a.state.velocity;
    let radii_m = laid.0.part.radius_m + laid.1.part.radius_m;
    let mut step_s = f64::INFINITY;
    for &mine in &laid.0.part.corners {
        let arm_a = laid.0.rotation.turned(mine);
        for &yours in &laid.1.part.corners {
            let arm_b = laid.1.rotation.turned(yours);
            let gap = normal.dot(between + arm_b - arm_a) - radii_m;
            let spin = arm_b.perpendicular() * b.state.yaw_rate_rad_s
                - arm_a.perpendicular() * a.state.yaw_rate_rad_s;
            step_s = step_s.min(safe_time(gap, normal.dot(relative + spin), bend)?);
        }
    }
    Some(step_s)
}

/// The greatest acceleration of the two towards each other along a fixed normal (m/s2).
fn approach_bend(a: &Now, b: &Now, normal: Vec2) -> f64 {
    let toward = |now: &Now, normal: Vec2| {
        // Braking helps against an approach only if it is sure to last: then it is a parabola.
        let along = now.mover.motion.direction.dot(normal);
        match now.mover.motion.law {
            Law::Even { .. } => along * now.deceleration,
            _ => (along * now.deceleration).max(0.0),
        }
    };
    toward(b, normal) + toward(a, -normal)
}

/// How long `gap + change t - bend t^2 / 2` stays positive; none if the gap is closed and closing.
fn safe_time(gap_m: f64, change_m_s: f64, bend_m_s2: f64) -> Option<f64> {
    if gap_m <= CONTACT_GAP_M && change_m_s < 0.0 {
        return None;
    }
    let gap_m = gap_m.max(SMALLEST_GAP_M);
    let square = change_m_s * change_m_s + 2.0 * bend_m_s2 * gap_m;
    if square < 0.0 {
        return Some(f64::INFINITY);
    }
    let root = square.sqrt();
    if change_m_s > 0.0 {
        return Some(if bend_m_s2 > 0.0 { (change_m_s + root) / bend_m_s2 } else { f64::INFINITY });
    }
    let below = root - change_m_s;
    Some(if below > 0.0 { 2.0 * gap_m / below } else { f64::INFINITY })
}
