//! How far apart are two convex parts, and which features show it?
//!
//! The separating-axis test: the largest gap along the normal of any edge.  Where the nearest corner is beyond the ends of that
//! edge and rounded by a radius, the gap is the distance between corners.

use crate::geometry::{Point, Vec2};
use crate::physics::contact::compound_shape::{ConvexPart, PlacedPart};

/// The pair of features that defines the gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Feature {
    /// An edge of the first part.
    EdgeOfFirst(u16),
    /// An edge of the second part.
    EdgeOfSecond(u16),
    /// A corner of each.
    Corners(u16, u16),
}

/// The gap between two convex parts, and the axis that shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Separation {
    /// Gap (m); negative: depth of the overlap.  A lower bound where two sharp corners are nearest.
    pub(crate) gap_m: f64,
    /// Unit vector from the first to the second.
    pub(crate) normal: Vec2,
    /// Point of contact: on the surface of the part whose corner is nearest to the edge of the other.
    pub(crate) point: Point,
    /// The features that define it.
    pub(crate) feature: Feature,
}

/// The largest gap along any separating axis of two parts.
pub(crate) fn separation(a: &PlacedPart, b: &PlacedPart) -> Separation {
    separation_within(a, b, f64::INFINITY).unwrap_or_else(|| corners(a, b, 0, 0))
}

/// The same; none as soon as an axis shows that the gap is larger than `limit_m`.
pub(crate) fn separation_within(a: &PlacedPart, b: &PlacedPart, limit_m: f64) -> Option<Separation> {
    if a.part.edges.is_empty() && b.part.edges.is_empty() {
        return Some(corners(a, b, 0, 0));
    }
    let b_from_a = a.rotation.relative_to(b.rotation);
    let of_a = edge_of_greatest_gap(a, b, |n| b_from_a.apply(n), f64::NEG_INFINITY, limit_m);
    let least_m = of_a.map_or(f64::NEG_INFINITY, |m| m.gap_m);
    if least_m > limit_m {
        return None;
    }
    let of_b = edge_of_greatest_gap(b, a, |n| b_from_a.apply_inverse(n), least_m, limit_m);
    // On a tie the edge of the first part is used.
    match (of_a, of_b) {
        (_, Some(EdgeGap { gap_m, .. })) if gap_m > limit_m => None,
        (_, Some(EdgeGap { edge, corner, gap_m })) => {
            if rounded_corner(b, a, edge, corner) {
                return Some(corners(a, b, corner, nearest_end(b, edge, a.corner(corner))));
            }
            let normal = -b.rotation.apply(b.part.edges[edge].normal);
            let point = a.corner(corner) + normal * a.part.radius_m;
            Some(Separation { gap_m, normal, point, feature: Feature::EdgeOfSecond(edge as u16) })
        }
        (Some(EdgeGap { edge, corner, gap_m }), None) => {
            if rounded_corner(a, b, edge, corner) {
                return Some(corners(a, b, nearest_end(a, edge, b.corner(corner)), corner));
            }
            let normal = a.rotation.apply(a.part.edges[edge].normal);
            let point = b.corner(corner) - normal * b.part.radius_m;
            Some(Separation { gap_m, normal, point, feature: Feature::EdgeOfFirst(edge as u16) })
        }
        (None, None) => Some(corners(a, b, 0, 0)),
    }
}

/// An edge, the corner of the other part nearest to its line, and their gap.
#[derive(Clone, Copy)]
struct EdgeGap {
    edge: usize,
    corner: usize,
    gap_m: f64,
}

/// The edge of `owner` with the largest gap to `other`, if above `least_m`, or the first one tried whose gap is above `limit_m`.
///
/// `to_other_frame` rotates a normal from the frame of `owner` into that of `other`.
fn edge_of_greatest_gap(
    owner: &PlacedPart,
    other: &PlacedPart,
    to_other_frame: impl Fn(Vec2) -> Vec2,
    least_m: f64,
    limit_m: f64,
) -> Option<EdgeGap> {
    let edges = &owner.part.edges;
    let offset = owner.rotation.apply_inverse(other.origin - owner.origin);
    let radii_m = owner.part.radius_m + other.part.radius_m;
    // Gap between an edge's line and the origin of the other part, whose corners reach back by at least `reach_back_m`.
    let origin_gap = |k: usize| edges[k].normal.dot(offset) - edges[k].offset_m - radii_m;
    let reach_back_m = other.part.least_reach_m;
    let edge_gap = |k: usize, origin_gap_m: f64| {
        // In the frame of the other part the nearest corner has the least extent along the normal.
        let (corner, extent) = deepest_corner(other.part, to_other_frame(edges[k].normal));
        EdgeGap { edge: k, corner, gap_m: origin_gap_m + extent }
    };
    let mut first = (0, f64::NEG_INFINITY);
    for k in 0..edges.len() {
        let origin_gap_m = origin_gap(k);
        if origin_gap_m > first.1 {
            first = (k, origin_gap_m);
        }
    }
    if first.1 - reach_back_m <= least_m {
        return None;
    }
    // The edge whose line is farthest from the other origin usually has the largest gap and excludes the rest.
    let mut greatest = edge_gap(first.0, first.1);
    if greatest.gap_m > limit_m {
        return Some(greatest);
    }
    for k in (0..edges.len()).filter(|&k| k != first.0) {
        let origin_gap_m = origin_gap(k);
        if origin_gap_m - reach_back_m > greatest.gap_m.max(least_m) {
            let candidate = edge_gap(k, origin_gap_m);
            if candidate.gap_m > greatest.gap_m {
                greatest = candidate;
            }
        }
    }
    (greatest.gap_m > least_m).then_some(greatest)
}

fn deepest_corner(part: &ConvexPart, normal: Vec2) -> (usize, f64) {
    let mut found = (0, f64::INFINITY);
    for (k, corner) in part.corners.iter().enumerate() {
        let extent = corner.dot(normal);
        if extent < found.1 {
            found = (k, extent);
        }
    }
    found
}

/// Whether a rounded corner is beyond the ends of the edge, so that an end is nearer than the edge's line.
fn rounded_corner(owner: &PlacedPart, other: &PlacedPart, edge: usize, corner: usize) -> bool {
    if owner.part.radius_m + other.part.radius_m == 0.0 {
        return false;
    }
    let (from, to) = (owner.corner(edge), owner.corner((edge + 1) % owner.part.corners.len()));
    let point = other.corner(corner);
    (point - from).dot(to - from) < 0.0 || (point - to).dot(from - to) < 0.0
}

fn nearest_end(owner: &PlacedPart, edge: usize, point: Point) -> usize {
    let next = (edge + 1) % owner.part.corners.len();
    let squared = |k: usize| (owner.corner(k) - point).length_squared();
    if squared(edge) <= squared(next) { edge } else { next }
}

/// Unit vector from corner i of one part to corner j of the other.
pub(crate) fn corner_direction(a: &PlacedPart, b: &PlacedPart, i: usize, j: usize) -> Vec2 {
    let offset = b.corner(j) - a.corner(i);
    let distance_m = offset.length_squared().sqrt();
    if distance_m > 0.0 { offset / distance_m } else { Vec2::new(1.0, 0.0) }
}

/// The gap between two rounded corners.
fn corners(a: &PlacedPart, b: &PlacedPart, i: usize, j: usize) -> Separation {
    let normal = corner_direction(a, b, i, j);
    Separation {
        gap_m: normal.dot(b.corner(j) - a.corner(i)) - a.part.radius_m - b.part.radius_m,
        normal,
        point: a.corner(i) + normal * a.part.radius_m,
        feature: Feature::Corners(i as u16, j as u16),
    }
}
