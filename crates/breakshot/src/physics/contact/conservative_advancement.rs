//! Up to when is a line known to separate two bodies?
//!
//! Conservative advancement (Mirtich 1996) along separating lines: an edge that rotates with its body, or the line across the
//! direction between two rounded corners.  Every corner on the other side has a distance g from the line that changes at g',
//! and g'' is never below -C while both motions last: `g + g' t - C t^2 / 2` is a lower bound of the distance, and no contact
//! is earlier than its first root.  The search steps there and looks again.  Near the contact the steps converge
//! quadratically, and no time in between is skipped.

use super::bounding_circles;
use super::compound_shape::PlacedPart;
use super::separating_axis::{Feature, corner_direction, separation};
use super::time_of_impact::{
    CONTACT_GAP_M, ContactSearch, MovingBody, SMALLEST_GAP_M, SUSTAINED_CONTACT_M_S, TimeOfImpact,
    safe_time_s,
};
use crate::geometry::Vec2;
use crate::geometry::conservative_advancement::{Step, advance};
use crate::physics::rotation::Rotation;
use crate::physics::sliding::motion::State;

/// Circles that touch within this time are treated as overlapping (s).
const SHORTEST_S: f64 = 1e-6;
/// Steps before the search answers "not before".
const STEPS: usize = 40;

/// A body at one instant, with bounds that are valid until its motion ends.
struct Snapshot<'a> {
    moving: MovingBody<'a>,
    state: State,
    rotation: Rotation,
    /// Greatest speed (m/s) and yaw rate (rad/s) from now on.
    speed: f64,
    yaw_rate: f64,
    /// Greatest angular deceleration (rad/s2).
    yaw_deceleration: f64,
}

/// A convex part at one instant, with the snapshot of its body.
#[derive(Clone, Copy)]
struct MovingPart<'a> {
    snapshot: &'a Snapshot<'a>,
    placed: &'a PlacedPart<'a>,
}

impl<'a> Snapshot<'a> {
    fn new(moving: MovingBody<'a>, state: State) -> Self {
        let (speed, yaw_rate) = moving.motion.greatest_speeds(&state);
        let yaw_deceleration =
            if yaw_rate == 0.0 { 0.0 } else { moving.motion.yaw_deceleration_rad_s2.abs() };
        let rotation = Rotation::new(state.yaw_rad);
        Self { moving, state, rotation, speed, yaw_rate, yaw_deceleration }
    }

    /// Bound of the acceleration by rotation of a point at a distance from the centroid (m/s2).
    fn rotation_bound(&self, reach_m: f64) -> f64 {
        (self.yaw_deceleration + self.yaw_rate * self.yaw_rate) * reach_m
    }

    /// Bound of the component of the braking against a fixed direction (m/s2); negative if it is along the direction.
    fn braking(&self, direction: Vec2) -> f64 {
        if self.speed == 0.0 {
            return 0.0;
        }
        let motion = self.moving.motion;
        let along = motion.direction.dot(direction);
        along * if along > 0.0 { motion.deceleration_m_s2[1] } else { motion.deceleration_m_s2[0] }
    }

    /// Greatest braking in any direction (m/s2).
    fn greatest_braking(&self) -> f64 {
        if self.speed == 0.0 { 0.0 } else { self.moving.motion.deceleration_m_s2[1] }
    }

    fn placed(&self, part: usize) -> PlacedPart<'a> {
        PlacedPart {
            part: &self.moving.body.shape.parts[part],
            origin: self.state.position,
            rotation: self.rotation,
        }
    }
}

/// The first contact of two bodies between two times.
pub(super) fn first_contact(search: ContactSearch, hint: &mut Option<Feature>) -> TimeOfImpact {
    let ContactSearch { bodies: [a, b], from_s, until_s, ignored_until_s } = search;
    let reach_m = a.body.shape.outer_radius_m + b.body.shape.outer_radius_m;
    let is_convex_pair = a.body.shape.parts.len() == 1 && b.body.shape.parts.len() == 1;
    let mut sufficient_s = until_s - from_s;
    let found = advance(from_s, STEPS, |time_s| {
        if time_s >= a.motion.stop_s && time_s >= b.motion.stop_s {
            return Step::End(TimeOfImpact::Never);
        }
        let (state_a, state_b) = (a.motion.state(time_s, a.body), b.motion.state(time_s, b.body));
        let circles_s = bounding_circles::free_time_s([a, b], [&state_a, &state_b], reach_m, time_s);
        if circles_s == f64::INFINITY {
            return Step::End(TimeOfImpact::Never);
        }
        let step_s = if circles_s > SHORTEST_S {
            circles_s
        } else {
            let snapshots = [Snapshot::new(a, state_a), Snapshot::new(b, state_b)];
            let ignored_s = ignored_until_s - time_s;
            let safe_s = if is_convex_pair {
                safe_time_of_parts(&snapshots, [0, 0], ignored_s, sufficient_s, hint)
            } else {
                safe_time_of_all_parts(&snapshots, ignored_s)
            };
            // In later steps any time for which the line of the hint separates the two is sufficient.
            sufficient_s = 0.0;
            match safe_s {
                None => return Step::End(TimeOfImpact::At(time_s)),
                Some(safe_s) => safe_s,
            }
        };
        let next_s = (time_s + step_s).min(next_stop_s(a, b, time_s));
        if next_s > until_s { Step::End(not_before(next_s)) } else { Step::To(next_s) }
    });
    found.unwrap_or_else(not_before)
}

fn not_before(time_s: f64) -> TimeOfImpact {
    if time_s == f64::INFINITY { TimeOfImpact::Never } else { TimeOfImpact::NotBefore(time_s) }
}

/// The next time at which one of the two motions ends (s).
fn next_stop_s(a: MovingBody, b: MovingBody, time_s: f64) -> f64 {
    let (stop_a, stop_b) = (a.motion.stop_s, b.motion.stop_s);
    match (stop_a > time_s, stop_b > time_s) {
        (true, true) => stop_a.min(stop_b),
        (true, false) => stop_a,
        (false, true) => stop_b,
        (false, false) => f64::INFINITY,
    }
}

/// The shortest safe time of all pairs of parts (s); none if any pair touches.
fn safe_time_of_all_parts(snapshots: &[Snapshot; 2], ignored_s: f64) -> Option<f64> {
    let mut step_s = f64::INFINITY;
    for i in 0..snapshots[0].moving.body.shape.parts.len() {
        for k in 0..snapshots[1].moving.body.shape.parts.len() {
            step_s = step_s.min(safe_time_of_parts(snapshots, [i, k], ignored_s, 0.0, &mut None)?);
        }
    }
    Some(step_s)
}

/// A time for which two parts do not touch (s); none if they touch now.
///
/// The line of the hint is tried first; if it separates them for less than `sufficient_s`, the line of the largest gap is used.
fn safe_time_of_parts(
    [a, b]: &[Snapshot; 2],
    [i, k]: [usize; 2],
    ignored_s: f64,
    sufficient_s: f64,
    hint: &mut Option<Feature>,
) -> Option<f64> {
    let (placed_a, placed_b) = (a.placed(i), b.placed(k));
    let a = MovingPart { snapshot: a, placed: &placed_a };
    let b = MovingPart { snapshot: b, placed: &placed_b };
    if let Some(feature) = *hint
        && let Some(step_s) = safe_time_of_feature(a, b, feature, None)
        && step_s >= sufficient_s
    {
        return Some(step_s);
    }
    let feature = separation(&placed_a, &placed_b).feature;
    *hint = Some(feature);
    safe_time_of_feature(a, b, feature, Some(ignored_s))
}

/// A time for which the line of a feature separates two parts (s).
fn safe_time_of_feature(
    a: MovingPart,
    b: MovingPart,
    feature: Feature,
    ignored_s: Option<f64>,
) -> Option<f64> {
    match feature {
        Feature::EdgeOfFirst(k) => safe_time_of_edge(a, usize::from(k), b, ignored_s),
        Feature::EdgeOfSecond(k) => safe_time_of_edge(b, usize::from(k), a, ignored_s),
        Feature::Corners(i, k) => {
            let normal = corner_direction(a.placed, b.placed, usize::from(i), usize::from(k));
            safe_time_of_corners(a, b, normal, ignored_s)
        }
    }
}

/// A time for which the line of edge `k` of `a`, rotating with it, separates `a` from every corner of `b` (s).
fn safe_time_of_edge(
    MovingPart { snapshot: a, placed: placed_a }: MovingPart,
    k: usize,
    MovingPart { snapshot: b, placed: placed_b }: MovingPart,
    ignored_s: Option<f64>,
) -> Option<f64> {
    // Bound of the second derivative of all gaps, and for how long it is valid
    let edge = placed_a.part.edges[k];
    let normal = a.rotation.apply(edge.normal);
    let between = b.state.position - a.state.position;
    let relative = b.state.velocity - a.state.velocity;
    let reach_b = placed_b.part.reach_m;
    let (deceleration, valid_for_s) = if a.yaw_rate == 0.0 {
        (a.braking(-normal) + b.braking(normal) + b.rotation_bound(reach_b), f64::INFINITY)
    } else {
        let closing = a.speed + b.speed + b.yaw_rate * reach_b;
        let distance_m = between.length_squared().sqrt() + reach_b;
        // For this time the corners stay within one and a half times their distance.
        let valid_for_s = 0.5 * distance_m / closing;
        let braking = a.greatest_braking() + b.greatest_braking();
        (
            a.rotation_bound(1.5 * distance_m)
                + 2.0 * a.yaw_rate * closing
                + braking
                + b.rotation_bound(reach_b),
            valid_for_s,
        )
    };

    // In the frame of b the gap of a corner and its change are linear in the corner's position.
    let inward = b.rotation.apply_inverse(normal);
    let gap_0 = normal.dot(between) - edge.offset_m - placed_a.part.radius_m - placed_b.part.radius_m;
    let change_0 = normal.dot(relative) + a.state.yaw_rate_rad_s * normal.perpendicular().dot(between);
    let spin = -inward.perpendicular() * (b.state.yaw_rate_rad_s - a.state.yaw_rate_rad_s);
    let gaps = placed_b.part.corners.iter().map(|c| (gap_0 + inward.dot(*c), change_0 + spin.dot(*c)));
    shortest_safe_time(gaps, deceleration, ignored_s).map(|time| time.min(valid_for_s))
}

/// A time for which a line of fixed direction, across `normal`, separates two parts of which one is a rounded corner (s).
fn safe_time_of_corners(
    MovingPart { snapshot: a, placed: placed_a }: MovingPart,
    MovingPart { snapshot: b, placed: placed_b }: MovingPart,
    normal: Vec2,
    ignored_s: Option<f64>,
) -> Option<f64> {
    let deceleration = a.braking(-normal)
        + b.braking(normal)
        + a.rotation_bound(placed_a.part.reach_m)
        + b.rotation_bound(placed_b.part.reach_m);
    let gap_0 =
        normal.dot(b.state.position - a.state.position) - placed_a.part.radius_m - placed_b.part.radius_m;
    let change_0 = normal.dot(b.state.velocity - a.state.velocity);
    let of_corner = |snapshot: &Snapshot, corner: Vec2| {
        let arm = snapshot.rotation.apply(corner);
        (normal.dot(arm), normal.dot(arm.perpendicular()) * snapshot.state.yaw_rate_rad_s)
    };
    let gaps = placed_a.part.corners.iter().flat_map(|&corner_a| {
        let (extent_a, change_a) = of_corner(a, corner_a);
        placed_b.part.corners.iter().map(move |&corner_b| {
            let (extent_b, change_b) = of_corner(b, corner_b);
            (gap_0 + extent_b - extent_a, change_0 + change_b - change_a)
        })
    });
    shortest_safe_time(gaps, deceleration, ignored_s)
}

/// A time for which all gaps are open (s), given each gap and its change; none if one is closed and closing.
///
/// With `ignored_s` the line is the one of the largest gap: a corner at it that separates, or that approaches slowly within
/// this time, is no contact.  Without it the line is a hint, which must have all corners on its far side.
fn shortest_safe_time(
    gaps: impl Iterator<Item = (f64, f64)>,
    deceleration: f64,
    ignored_s: Option<f64>,
) -> Option<f64> {
    let mut shortest = f64::INFINITY;
    for (gap_m, change) in gaps {
        if gap_m <= CONTACT_GAP_M && (change < 0.0 || ignored_s.is_none()) {
            let ignored_s = ignored_s.filter(|&s| s > 0.0 && change > -SUSTAINED_CONTACT_M_S)?;
            shortest = shortest.min(ignored_s);
            continue;
        }
        let gap_m = gap_m.max(SMALLEST_GAP_M);
        // A bound that is positive at the shortest time so far is positive before it.
        if deceleration >= 0.0
            && shortest < f64::INFINITY
            && gap_m + shortest * (change - 0.5 * deceleration * shortest) > 0.0
        {
            continue;
        }
        shortest = shortest.min(safe_time_s(gap_m, change, deceleration));
    }
    Some(shortest)
}
