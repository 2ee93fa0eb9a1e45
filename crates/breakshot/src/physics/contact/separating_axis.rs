//! How far apart are two convex parts, and which features show it?
//!
//! The separating-axis test: the largest gap that any edge's line shows.  Where that line's nearest corner lies beyond the
//! edge's ends and a radius rounds it, the corners themselves tell the distance.

use crate::geometry::{Point, Vec2};
use crate::physics::contact::compound_shape::{Convex, Laid};

/// What shows the gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Feature {
    /// An edge of the first part.
    EdgeOfFirst(u16),
    /// An edge of the second part.
    EdgeOfSecond(u16),
    /// A corner of each.
    Corners(u16, u16),
}

/// The gap between two convex parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Witness {
    /// How far apart they are (m); negative: how deep they overlap.  A lower bound where two sharp corners are nearest.
    pub(crate) gap_m: f64,
    /// Unit vector from the first to the second.
    pub(crate) normal: Vec2,
    /// The point of the second (its core's corner) or of the first nearest to the other.
    pub(crate) point: Point,
    /// What shows it.
    pub(crate) feature: Feature,
}

/// The largest gap that a line between two parts shows.
pub(crate) fn witness(a: &Laid, b: &Laid) -> Witness {
    witness_within(a, b, f64::INFINITY).unwrap_or_else(|| corners(a, b, 0, 0))
}

/// The same, or none as soon as a line shows that the gap is larger than this (m).
pub(crate) fn witness_within(a: &Laid, b: &Laid, most_m: f64) -> Option<Witness> {
    if a.part.edges.is_empty() && b.part.edges.is_empty() {
        return Some(corners(a, b, 0, 0));
    }
    let turn = a.rotation.seen_from(b.rotation);
    let mine = widest_edge((a, b), |n| turn.turned(n), (f64::NEG_INFINITY, most_m));
    let least_m = mine.map_or(f64::NEG_INFINITY, |m| m.gap_m);
    if least_m > most_m {
        return None;
    }
    let yours = widest_edge((b, a), |n| turn.turned_back(n), (least_m, most_m));
    // Ties go to the first part's edge if it shows as much: a matter of rounding, not of physics.
    match (mine, yours) {
        (_, Some(Widest { gap_m, .. })) if gap_m > most_m => None,
        (_, Some(Widest { edge, corner, gap_m })) => {
            if rounded_corner(b, a, edge, corner) {
                return Some(corners(a, b, corner, nearest_end(b, edge, a.corner(corner))));
            }
            let normal = -b.rotation.turned(b.part.edges[edge].normal);
            let point = a.corner(corner) + normal * a.part.radius_m;
            Some(Witness { gap_m, normal, point, feature: Feature::EdgeOfSecond(edge as u16) })
        }
        (Some(Widest { edge, corner, gap_m }), None) => {
            if rounded_corner(a, b, edge, corner) {
                return Some(corners(a, b, nearest_end(a, edge, b.corner(corner)), corner));
            }
            let normal = a.rotation.turned(a.part.edges[edge].normal);
            let point = b.corner(corner) - normal * b.part.radius_m;
            Some(Witness { gap_m, normal, point, feature: Feature::EdgeOfFirst(edge as u16) })
        }
        (None, None) => Some(corners(a, b, 0, 0)),
    }
}

/// The edge that shows the largest gap, and the other part's corner nearest to its line.
#[derive(Clone, Copy)]
struct Widest {
    edge: usize,
    corner: usize,
    gap_m: f64,
}

/// The edge of `owner` whose line keeps `other` farthest away, if by more than `least_m`, or the first one seen to do so by
/// more than `most_m`; `seen` turns a normal into the other's frame.
fn widest_edge(
    (owner, other): (&Laid, &Laid),
    seen: impl Fn(Vec2) -> Vec2,
    (least_m, most_m): (f64, f64),
) -> Option<Widest> {
    let edges = &owner.part.edges;
    let way = owner.rotation.turned_back(other.origin - owner.origin);
    let radii_m = owner.part.radius_m + other.part.radius_m;
    // How far the other's origin lies beyond an edge's line; its corners reach back from there, by so much at least.
    let beyond = |k: usize| edges[k].normal.dot(way) - edges[k].offset_m - radii_m;
    let back_m = other.part.least_reach_m;
    let look = |k: usize, beyond_m: f64| {
        // In the other's frame the nearest corner is the one deepest along the normal.
        let (corner, depth) = deepest(other.part, seen(edges[k].normal));
        Widest { edge: k, corner, gap_m: beyond_m + depth }
    };
    let mut first = (0, f64::NEG_INFINITY);
    for k in 0..edges.len() {
        let beyond_m = beyond(k);
        if beyond_m > first.1 {
            first = (k, beyond_m);
        }
    }
    if first.1 - back_m <= least_m {
        return None;
    }
    // The edge that faces the other most shows most, as a rule, and rules out the others.
    let mut widest = look(first.0, first.1);
    if widest.gap_m > most_m {
        return Some(widest);
    }
    for k in (0..edges.len()).filter(|&k| k != first.0) {
        let beyond_m = beyond(k);
        if beyond_m - back_m > widest.gap_m.max(least_m) {
            let seen = look(k, beyond_m);
            if seen.gap_m > widest.gap_m {
                widest = seen;
            }
        }
    }
    (widest.gap_m > least_m).then_some(widest)
}

fn deepest(part: &Convex, normal: Vec2) -> (usize, f64) {
    let mut found = (0, f64::INFINITY);
    for (k, corner) in part.corners.iter().enumerate() {
        let depth = corner.dot(normal);
        if depth < found.1 {
            found = (k, depth);
        }
    }
    found
}

/// Whether a rounded corner lies beside the edge, so that the edge's end is nearer than its line.
fn rounded_corner(owner: &Laid, other: &Laid, edge: usize, corner: usize) -> bool {
    if owner.part.radius_m + other.part.radius_m == 0.0 {
        return false;
    }
    let (from, to) = (owner.corner(edge), owner.corner((edge + 1) % owner.part.corners.len()));
    let point = other.corner(corner);
    (point - from).dot(to - from) < 0.0 || (point - to).dot(from - to) < 0.0
}

fn nearest_end(owner: &Laid, edge: usize, point: Point) -> usize {
    let next = (edge + 1) % owner.part.corners.len();
    let squared = |k: usize| (owner.corner(k) - point).length_squared();
    if squared(edge) <= squared(next) { edge } else { next }
}

/// Unit vector from a corner of one part to a corner of the other.
pub(crate) fn corner_normal(a: &Laid, b: &Laid, i: usize, j: usize) -> Vec2 {
    let way = b.corner(j) - a.corner(i);
    let distance_m = way.length_squared().sqrt();
    if distance_m > 0.0 { way / distance_m } else { Vec2::new(1.0, 0.0) }
}

/// The gap between two rounded corners.
fn corners(a: &Laid, b: &Laid, i: usize, j: usize) -> Witness {
    let normal = corner_normal(a, b, i, j);
    Witness {
        gap_m: normal.dot(b.corner(j) - a.corner(i)) - a.part.radius_m - b.part.radius_m,
        normal,
        point: a.corner(i) + normal * a.part.radius_m,
        feature: Feature::Corners(i as u16, j as u16),
    }
}
