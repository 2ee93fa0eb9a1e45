//! How far apart are two bodies?

use crate::geometry::Pose;
use crate::physics::contact::compound_shape::PlacedPart;
use crate::physics::contact::separating_axis::separation;
use crate::physics::rotation::Rotation;
use crate::physics::sliding::body::Body;

/// The gap between two bodies at given poses (m); negative: how deep they overlap.
///
/// A lower bound where two sharp corners are nearest, and where the bodies are far apart.
pub(crate) fn gap_m(a: (&Body, Pose), b: (&Body, Pose)) -> f64 {
    let reach = a.0.shape.outer_radius_m + b.0.shape.outer_radius_m;
    let circles_m = (a.1.position - b.1.position).length() - reach;
    if circles_m > 0.0 && !a.0.shape.parts.is_empty() && circles_m > reach {
        return circles_m;
    }
    let mut least = f64::INFINITY;
    for part_a in &a.0.shape.parts {
        let placed_a =
            PlacedPart { part: part_a, origin: a.1.position, rotation: Rotation::new(a.1.yaw_rad) };
        for part_b in &b.0.shape.parts {
            let placed_b =
                PlacedPart { part: part_b, origin: b.1.position, rotation: Rotation::new(b.1.yaw_rad) };
            least = least.min(separation(&placed_a, &placed_b).gap_m);
        }
    }
    least
}
