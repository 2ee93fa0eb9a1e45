//! Conservative advancement: up to when is a line known to keep two bodies apart?
//!
//! Take the line that shows a gap: an edge that turns with its body, or the line across the way between two rounded
//! corners.  Every corner on the other side has a distance g from it, changing at g' now, and g'' is never below -C as
//! long as both go on as they do: then `g + g' t - C t^2 / 2` is a lower bound, and no contact comes before its first root.
//! Step there and look again; near the contact the steps converge quadratically, and no time in between is left
//! unchecked.

use super::discs::SMALLEST_GAP_M;
use super::separating_axis::{Feature, corner_normal, witness};
use super::{CONTACT_GAP_M, Mover, Outlook, PRESSING_M_S, bounding_circles, time_apart_s};
use crate::geometry::Vec2;
use crate::physics::contact::compound_shape::Laid;
use crate::physics::rotation::Rotation;
use crate::physics::sliding::motion::State;

/// Circles that meet within this time count as overlapping (s).
const SHORTEST_S: f64 = 1e-6;
/// Lines tried before the search answers "ask again".
const STEPS: usize = 40;

/// A body at one instant, with bounds that hold until it stops.
struct Now<'a> {
    mover: Mover<'a>,
    state: State,
    rotation: Rotation,
    speed: f64,
    rate: f64,
    /// Greatest deceleration of the turn (rad/s2).
    yaw_deceleration: f64,
}

impl<'a> Now<'a> {
    fn new(mover: Mover<'a>, state: State) -> Self {
        let (speed, rate) = mover.motion.greatest_speeds(&state);
        let yaw_deceleration = if rate == 0.0 { 0.0 } else { mover.motion.yaw_deceleration_rad_s2.abs() };
        let rotation = Rotation::new(state.yaw_rad);
        Self { mover, state, rotation, speed, rate, yaw_deceleration }
    }

    /// How fast a point at a distance can be turned aside (m/s2).
    fn turning(&self, reach_m: f64) -> f64 {
        (self.yaw_deceleration + self.rate * self.rate) * reach_m
    }

    /// How fast braking can pull the body against a fixed direction (m/s2); negative if it must push it along.
    fn braking(&self, direction: Vec2) -> f64 {
        if self.speed == 0.0 {
            return 0.0;
        }
        let motion = self.mover.motion;
        let along = motion.direction.dot(direction);
        along * if along > 0.0 { motion.deceleration_m_s2[1] } else { motion.deceleration_m_s2[0] }
    }

    fn laid(&self, part: usize) -> Laid<'a> {
        Laid {
            part: &self.mover.body.plate.parts[part],
            origin: self.state.position,
            rotation: self.rotation,
        }
    }
}

/// The first contact of two bodies between two times; beyond `until_s` it says no more than "not before".
pub(super) fn first_contact(
    (a, b): (Mover, Mover),
    (from_s, until_s): (f64, f64),
    pressing_s: f64,
    hint: &mut Option<Feature>,
) -> Outlook {
    let reach_m = a.body.plate.outer_radius_m + b.body.plate.outer_radius_m;
    let simple = a.body.plate.parts.len() == 1 && b.body.plate.parts.len() == 1;
    let mut time_s = from_s;
    let mut enough_s = until_s - from_s;
    for _ in 0..STEPS {
        if time_s >= a.motion.stop_s && time_s >= b.motion.stop_s {
            return Outlook::Never;
        }
        let (state_a, state_b) = (a.motion.state(time_s, a.body), b.motion.state(time_s, b.body));
        let circles_s = bounding_circles::time_apart((a, &state_a), (b, &state_b), reach_m, time_s);
        if circles_s == f64::INFINITY {
            return Outlook::Never;
        }
        let step_s = if circles_s > SHORTEST_S {
            circles_s
        } else {
            let now = (Now::new(a, state_a), Now::new(b, state_b));
            let pressing = pressing_s - time_s;
            let step = if simple {
                step_of_parts(&now, (0, 0), (pressing, enough_s), hint)
            } else {
                step_of_all(&now, pressing)
            };
            // A line found on the way keeps them apart as long as it does.
            enough_s = 0.0;
            match step {
                None => return Outlook::Touch(time_s),
                Some(step) => step,
            }
        };
        time_s = (time_s + step_s).min(next_stop(a, b, time_s));
        if time_s > until_s {
            break;
        }
    }
    if time_s == f64::INFINITY { Outlook::Never } else { Outlook::NotBefore(time_s) }
}

/// The next time at which one of the two stops.
fn next_stop(a: Mover, b: Mover, time_s: f64) -> f64 {
    let (one, other) = (a.motion.stop_s, b.motion.stop_s);
    match (one > time_s, other > time_s) {
        (true, true) => one.min(other),
        (true, false) => one,
        (false, true) => other,
        (false, false) => f64::INFINITY,
    }
}

/// The shortest safe step of all pairs of parts; none if any touch.
fn step_of_all(now: &(Now, Now), pressing_s: f64) -> Option<f64> {
    let mut step_s = f64::INFINITY;
    for i in 0..now.0.mover.body.plate.parts.len() {
        for k in 0..now.1.mover.body.plate.parts.len() {
            step_s = step_s.min(step_of_parts(now, (i, k), (pressing_s, 0.0), &mut None)?);
        }
    }
    Some(step_s)
}

/// How long two parts surely stay apart (s); none if they touch now.
///
/// The line that kept them apart before is tried first; when it does not do so for long enough (s), the widest one.
fn step_of_parts(
    (a, b): &(Now, Now),
    (i, k): (usize, usize),
    (pressing_s, enough_s): (f64, f64),
    hint: &mut Option<Feature>,
) -> Option<f64> {
    let laid = (a.laid(i), b.laid(k));
    if let Some(feature) = *hint
        && let Some(step_s) = step_of_line(a, b, &laid, feature, None)
        && step_s >= enough_s
    {
        return Some(step_s);
    }
    let feature = witness(&laid.0, &laid.1).feature;
    *hint = Some(feature);
    step_of_line(a, b, &laid, feature, Some(pressing_s))
}

fn step_of_line(
    a: &Now,
    b: &Now,
    laid: &(Laid, Laid),
    feature: Feature,
    pressing_s: Option<f64>,
) -> Option<f64> {
    match feature {
        Feature::EdgeOfFirst(k) => step_of_edge((a, &laid.0, usize::from(k)), (b, &laid.1), pressing_s),
        Feature::EdgeOfSecond(k) => step_of_edge((b, &laid.1, usize::from(k)), (a, &laid.0), pressing_s),
        Feature::Corners(i, k) => {
            let normal = corner_normal(&laid.0, &laid.1, usize::from(i), usize::from(k));
            step_of_corners((a, &laid.0), (b, &laid.1), normal, pressing_s)
        }
    }
}

/// The line of an edge of `a`, turning with it, against every corner of `b`.
fn step_of_edge(
    (a, laid_a, k): (&Now, &Laid, usize),
    (b, laid_b): (&Now, &Laid),
    pressing_s: Option<f64>,
) -> Option<f64> {
    let edge = laid_a.part.edges[k];
    let normal = a.rotation.turned(edge.normal);
    let between = b.state.position - a.state.position;
    let relative = b.state.velocity - a.state.velocity;
    let reach_b = laid_b.part.reach_m;
    let (bend, cap_s) = if a.rate == 0.0 {
        (a.braking(-normal) + b.braking(normal) + b.turning(reach_b), f64::INFINITY)
    } else {
        let closing = a.speed + b.speed + b.rate * reach_b;
        let far = between.length_squared().sqrt() + reach_b;
        // Within this time the corners stay within one and a half times their distance.
        let cap_s = 0.5 * far / closing;
        let braking = a.greatest_braking() + b.greatest_braking();
        (a.turning(1.5 * far) + 2.0 * a.rate * closing + braking + b.turning(reach_b), cap_s)
    };
    // Seen from b, gap and change of a corner are linear in its place.
    let inward = b.rotation.turned_back(normal);
    let gap_0 = normal.dot(between) - edge.offset_m - laid_a.part.radius_m - laid_b.part.radius_m;
    let change_0 = normal.dot(relative) + a.state.yaw_rate_rad_s * normal.perpendicular().dot(between);
    let spin = -inward.perpendicular() * (b.state.yaw_rate_rad_s - a.state.yaw_rate_rad_s);
    let lines = laid_b.part.corners.iter().map(|c| (gap_0 + inward.dot(*c), change_0 + spin.dot(*c)));
    shortest_time(lines, bend, pressing_s).map(|time| time.min(cap_s))
}

/// A line that does not turn, across `normal`, between two parts of which one is a single rounded corner.
fn step_of_corners(
    (a, laid_a): (&Now, &Laid),
    (b, laid_b): (&Now, &Laid),
    normal: Vec2,
    pressing_s: Option<f64>,
) -> Option<f64> {
    let bend = a.braking(-normal)
        + b.braking(normal)
        + a.turning(laid_a.part.reach_m)
        + b.turning(laid_b.part.reach_m);
    let gap_0 = normal.dot(b.state.position - a.state.position) - laid_a.part.radius_m - laid_b.part.radius_m;
    let change_0 = normal.dot(b.state.velocity - a.state.velocity);
    let of_corner = |now: &Now, corner: Vec2| {
        let arm = now.rotation.turned(corner);
        (normal.dot(arm), normal.dot(arm.perpendicular()) * now.state.yaw_rate_rad_s)
    };
    let lines = laid_a.part.corners.iter().flat_map(|&mine| {
        let (out, out_change) = of_corner(a, mine);
        laid_b.part.corners.iter().map(move |&yours| {
            let (depth, change) = of_corner(b, yours);
            (gap_0 + depth - out, change_0 + change - out_change)
        })
    });
    shortest_time(lines, bend, pressing_s)
}

/// How long all corners surely stay on their side (s); none if one is at the line and crossing it.
///
/// With a time for which pressing is overlooked the line is the best there is: a corner at it that parts or presses does no
/// harm.  Without, it must still keep all corners apart.
fn shortest_time(lines: impl Iterator<Item = (f64, f64)>, bend: f64, pressing_s: Option<f64>) -> Option<f64> {
    let mut shortest = f64::INFINITY;
    for (gap_m, change) in lines {
        if gap_m <= CONTACT_GAP_M && (change < 0.0 || pressing_s.is_none()) {
            let while_s = pressing_s.filter(|&s| s > 0.0 && change > -PRESSING_M_S)?;
            shortest = shortest.min(while_s);
            continue;
        }
        let gap_m = gap_m.max(SMALLEST_GAP_M);
        // A bound that is positive at the shortest time so far was so before.
        if bend >= 0.0
            && shortest < f64::INFINITY
            && gap_m + shortest * (change - 0.5 * bend * shortest) > 0.0
        {
            continue;
        }
        shortest = shortest.min(time_apart_s(gap_m, change, bend));
    }
    Some(shortest)
}

impl Now<'_> {
    fn greatest_braking(&self) -> f64 {
        if self.speed == 0.0 { 0.0 } else { self.mover.motion.deceleration_m_s2[1] }
    }
}
