//! How far apart are two convex parts, and which features show it?
//!
//! The separating-axis test: the largest gap that any edge's line shows.  Where that line's nearest corner lies beyond the
//! edge's ends and a radius rounds it, the corners themselves tell the distance.

use crate::geometry::{Point, Vec2};
use crate::physics::shape::{Convex, Laid};

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
    if a.part.edges.is_empty() && b.part.edges.is_empty() {
        return corners(a, b, 0, 0);
    }
    let mine = widest_edge(a, b);
    let yours = widest_edge(b, a);
    // Ties go to the first part's edge if it shows as much: a matter of rounding, not of physics.
    match (mine, yours) {
        (Some((k, j, gap_m)), other) if other.is_none_or(|(_, _, gap)| gap <= gap_m) => {
            if rounded_corner(a, b, k, j) {
                return corners(a, b, nearest_end(a, k, b.corner(j)), j);
            }
            let normal = a.rotation.turned(a.part.edges[k].normal);
            let point = b.corner(j) - normal * b.part.radius_m;
            Witness { gap_m, normal, point, feature: Feature::EdgeOfFirst(k as u16) }
        }
        (_, Some((k, j, gap_m))) => {
            if rounded_corner(b, a, k, j) {
                return corners(a, b, j, nearest_end(b, k, a.corner(j)));
            }
            let normal = -b.rotation.turned(b.part.edges[k].normal);
            let point = a.corner(j) + normal * a.part.radius_m;
            Witness { gap_m, normal, point, feature: Feature::EdgeOfSecond(k as u16) }
        }
        _ => corners(a, b, 0, 0),
    }
}

/// The edge of `owner` whose line keeps `other` farthest away: edge, nearest corner, gap.
fn widest_edge(owner: &Laid, other: &Laid) -> Option<(usize, usize, f64)> {
    let mut widest: Option<(usize, usize, f64)> = None;
    let way = owner.rotation.turned_back(other.origin - owner.origin);
    let radii_m = owner.part.radius_m + other.part.radius_m;
    for (k, edge) in owner.part.edges.iter().enumerate() {
        // In the other's frame the nearest corner is the one deepest along the normal.
        let normal = other.rotation.turned_back(owner.rotation.turned(edge.normal));
        let (j, depth) = deepest(other.part, normal);
        let gap_m = edge.normal.dot(way) - edge.offset_m + depth - radii_m;
        if widest.is_some_and(|(_, _, gap)| gap >= gap_m) {
            continue;
        }
        widest = Some((k, j, gap_m));
    }
    widest
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
