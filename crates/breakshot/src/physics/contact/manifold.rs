//! At which points do two bodies that nearly touch press on each other?
//!
//! Two flat sides that face each other touch along a line: its two ends stand for it (the incident edge clipped to the
//! reference edge, as physics engines for games do).  Everything else touches in one point.

use super::separating_axis::{Feature, witness_within};
use crate::geometry::{Point, Vec2};
use crate::physics::contact::compound_shape::Laid;
use crate::physics::impact::routh::Touch;
use crate::physics::rotation::Rotation;
use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::State;

/// Calls `found` with every contact point of two bodies whose gap is at most `reach_m`, and with its gap (m).
pub(crate) fn contact_points(
    a: (&Body, &State),
    b: (&Body, &State),
    reach_m: f64,
    mut found: impl FnMut(Touch, f64),
) {
    if a.0.plate.is_disc && b.0.plate.is_disc {
        let (way, radius_m) = (b.1.position - a.1.position, a.0.plate.outer_radius_m);
        let distance_m = way.length_squared().sqrt();
        let gap_m = distance_m - radius_m - b.0.plate.outer_radius_m;
        if gap_m <= reach_m {
            let normal_ab = if distance_m > 0.0 { way / distance_m } else { Vec2::new(1.0, 0.0) };
            found(Touch { point: a.1.position + normal_ab * radius_m, normal_ab }, gap_m);
        }
        return;
    }
    let (turn_a, turn_b) = (Rotation::new(a.1.yaw_rad), Rotation::new(b.1.yaw_rad));
    for part_a in &a.0.plate.parts {
        let laid_a = Laid { part: part_a, origin: a.1.position, rotation: turn_a };
        for part_b in &b.0.plate.parts {
            let laid_b = Laid { part: part_b, origin: b.1.position, rotation: turn_b };
            let Some(seen) = witness_within(&laid_a, &laid_b, reach_m).filter(|w| w.gap_m <= reach_m) else {
                continue;
            };
            match seen.feature {
                Feature::EdgeOfFirst(k) if !part_b.edges.is_empty() => {
                    clipped(&laid_a, usize::from(k), &laid_b, seen.normal, |point, gap_m| {
                        if gap_m <= reach_m {
                            found(Touch { point, normal_ab: seen.normal }, gap_m);
                        }
                    });
                }
                Feature::EdgeOfSecond(k) if !part_a.edges.is_empty() => {
                    clipped(&laid_b, usize::from(k), &laid_a, -seen.normal, |point, gap_m| {
                        if gap_m <= reach_m {
                            found(Touch { point, normal_ab: seen.normal }, gap_m);
                        }
                    });
                }
                _ => found(Touch { point: seen.point, normal_ab: seen.normal }, seen.gap_m),
            }
        }
    }
}

/// The ends of the other part's facing edge, cut to the width of the reference edge, with their gaps.
fn clipped(owner: &Laid, edge: usize, other: &Laid, normal: Vec2, mut found: impl FnMut(Point, f64)) {
    let next = |k: usize, n: usize| if k + 1 < n { k + 1 } else { 0 };
    let n = owner.part.corners.len();
    let (from, to) = (owner.corner(edge), owner.corner(next(edge, n)));
    let along = to - from;
    let width = along.dot(along);
    let facing = facing_edge(other, normal);
    let ends = [other.corner(facing), other.corner(next(facing, other.part.corners.len()))];
    let parts = ends.map(|p| (p - from).dot(along) / width);
    let mut last: Option<Point> = None;
    for i in 0..2 {
        let (here, there) = (parts[i], parts[1 - i]);
        let cut = here.clamp(0.0, 1.0);
        let share = if here == there { 0.0 } else { (cut - here) / (there - here) };
        let point = ends[i] + (ends[1 - i] - ends[i]) * share.clamp(0.0, 1.0);
        if last.is_some_and(|p| (p - point).length_squared() < SAME_POINT_M * SAME_POINT_M) {
            continue;
        }
        last = Some(point);
        found(point, (point - from).dot(normal));
    }
}

/// Two contact points closer than this are one (m).
const SAME_POINT_M: f64 = 1e-6;

/// The edge of a part that faces a normal most.
fn facing_edge(laid: &Laid, normal: Vec2) -> usize {
    let mine = laid.rotation.turned_back(normal);
    let mut best = (0, f64::INFINITY);
    for (k, edge) in laid.part.edges.iter().enumerate() {
        let facing = edge.normal.dot(mine);
        if facing < best.1 {
            best = (k, facing);
        }
    }
    best.0
}
