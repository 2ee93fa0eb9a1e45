//! How far apart are two bodies?

use crate::geometry::Pose;
use crate::physics::contact::compound_shape::PlacedPart;
use crate::physics::contact::separating_axis::separation;
use crate::physics::rotation::Rotation;
use crate::physics::sliding::body::Body;

/// The gap between two bodies at given poses (m); negative: how deep they overlap.
///
/// A lower bound where two sharp corners are nearest, and where the bodies are far apart.
pub(crate) fn gap_m(a: &Body, pose_a: Pose, b: &Body, pose_b: Pose) -> f64 {
    let reach = a.shape.outer_radius_m + b.shape.outer_radius_m;
    let circles_m = (pose_a.position - pose_b.position).length() - reach;
    if circles_m > 0.0 && !a.shape.parts.is_empty() && circles_m > reach {
        return circles_m;
    }
    let mut least = f64::INFINITY;
    for part_a in &a.shape.parts {
        let placed_a =
            PlacedPart { part: part_a, origin: pose_a.position, rotation: Rotation::new(pose_a.yaw_rad) };
        for part_b in &b.shape.parts {
            let placed_b =
                PlacedPart { part: part_b, origin: pose_b.position, rotation: Rotation::new(pose_b.yaw_rad) };
            least = least.min(separation(&placed_a, &placed_b).gap_m);
        }
    }
    least
}
