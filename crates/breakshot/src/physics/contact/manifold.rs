//! At which points do two bodies that nearly touch push on each other?
//!
//! Two facing edges touch along a line, which its two ends represent (the incident edge clipped to the reference edge, as in
//! physics engines for games).  Every other contact is one point.

use super::separating_axis::{Feature, separation_within};
use crate::geometry::{Point, Vec2};
use crate::physics::contact::compound_shape::PlacedPart;
use crate::physics::impact::routh::ContactPoint;
use crate::physics::rotation::Rotation;
use crate::physics::sliding::motion::BodyState;

/// Calls `found` with every contact point of two bodies whose gap is at most `reach_m`, and with that gap (m).
pub(crate) fn contact_points(
    a: BodyState,
    b: BodyState,
    reach_m: f64,
    mut found: impl FnMut(ContactPoint, f64),
) {
    if a.body.shape.is_disc && b.body.shape.is_disc {
        let (offset, radius_m) = (b.state.position - a.state.position, a.body.shape.outer_radius_m);
        let distance_m = offset.length_squared().sqrt();
        let gap_m = distance_m - radius_m - b.body.shape.outer_radius_m;
        if gap_m <= reach_m {
            let normal_ab = if distance_m > 0.0 { offset / distance_m } else { Vec2::new(1.0, 0.0) };
            found(ContactPoint { point: a.state.position + normal_ab * radius_m, normal_ab }, gap_m);
        }
        return;
    }
    let (rotation_a, rotation_b) = (Rotation::new(a.state.yaw_rad), Rotation::new(b.state.yaw_rad));
    for part_a in &a.body.shape.parts {
        let placed_a = PlacedPart { part: part_a, origin: a.state.position, rotation: rotation_a };
        for part_b in &b.body.shape.parts {
            let placed_b = PlacedPart { part: part_b, origin: b.state.position, rotation: rotation_b };
            let Some(separation) =
                separation_within(&placed_a, &placed_b, reach_m).filter(|s| s.gap_m <= reach_m)
            else {
                continue;
            };
            match separation.feature {
                Feature::EdgeOfFirst(k) if !part_b.edges.is_empty() => {
                    clip_facing_edge(
                        &placed_a,
                        usize::from(k),
                        &placed_b,
                        separation.normal,
                        |point, gap_m| {
                            if gap_m <= reach_m {
                                found(ContactPoint { point, normal_ab: separation.normal }, gap_m);
                            }
                        },
                    );
                }
                Feature::EdgeOfSecond(k) if !part_a.edges.is_empty() => {
                    clip_facing_edge(
                        &placed_b,
                        usize::from(k),
                        &placed_a,
                        -separation.normal,
                        |point, gap_m| {
                            if gap_m <= reach_m {
                                found(ContactPoint { point, normal_ab: separation.normal }, gap_m);
                            }
                        },
                    );
                }
                _ => found(
                    ContactPoint { point: separation.point, normal_ab: separation.normal },
                    separation.gap_m,
                ),
            }
        }
    }
}

/// Calls `found` with the ends of the other part's facing edge, clipped to the length of the reference edge, and their gaps (m).
fn clip_facing_edge(
    owner: &PlacedPart,
    edge: usize,
    other: &PlacedPart,
    normal: Vec2,
    mut found: impl FnMut(Point, f64),
) {
    let next = |k: usize, n: usize| if k + 1 < n { k + 1 } else { 0 };
    let n = owner.part.corners.len();
    let (from, to) = (owner.corner(edge), owner.corner(next(edge, n)));
    let along = to - from;
    let width = along.dot(along);
    let facing = facing_edge(other, normal);
    let ends = [other.corner(facing), other.corner(next(facing, other.part.corners.len()))];
    let fractions = ends.map(|p| (p - from).dot(along) / width);
    let mut last: Option<Point> = None;
    for i in 0..2 {
        let (own, opposite) = (fractions[i], fractions[1 - i]);
        let cut = own.clamp(0.0, 1.0);
        let fraction = if own == opposite { 0.0 } else { (cut - own) / (opposite - own) };
        let point = ends[i] + (ends[1 - i] - ends[i]) * fraction.clamp(0.0, 1.0);
        if last.is_some_and(|p| (p - point).length_squared() < SAME_POINT_M * SAME_POINT_M) {
            continue;
        }
        last = Some(point);
        found(point, (point - from).dot(normal));
    }
}

/// Distance below which two contact points are one (m).
const SAME_POINT_M: f64 = 1e-6;

/// The edge of a part whose normal is most opposite to a given normal.
fn facing_edge(placed: &PlacedPart, normal: Vec2) -> usize {
    let own_normal = placed.rotation.apply_inverse(normal);
    let mut best = (0, f64::INFINITY);
    for (k, edge) in placed.part.edges.iter().enumerate() {
        let facing = edge.normal.dot(own_normal);
        if facing < best.1 {
            best = (k, facing);
        }
    }
    best.0
}
