//! Can a parallel gripper grasp an object from above without touching its neighbours?

use crate::error::{Result, bounds};
use crate::geometry::outline::Outline;
use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A parallel gripper: two fingers that descend on both sides of an object and close.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gripper {
    /// Distance between the inner faces of the open fingers (m).
    pub opening_m: f64,
    /// Size of a finger along the closing direction and across it (m).
    pub finger_size_m: [f64; 2],
    /// Clearance between each finger and the object before the gripper closes (m).
    #[serde(default = "default_clearance_m")]
    pub clearance_m: f64,
}

fn default_clearance_m() -> f64 {
    0.003
}

/// Closing directions that are tried: every 10 degrees over 180, from the object's own x axis on.
const DIRECTIONS: u8 = 18;

impl Gripper {
    /// Checks the sizes; errors name `owner`.
    ///
    /// # Errors
    /// Sizes that are not positive.
    pub fn check(&self, owner: &str) -> Result<()> {
        bounds::positive(owner, "gripper.opening_m", self.opening_m)?;
        bounds::positive(owner, "gripper.finger_size_m[0]", self.finger_size_m[0])?;
        bounds::positive(owner, "gripper.finger_size_m[1]", self.finger_size_m[1])?;
        bounds::zero_or_more(owner, "gripper.clearance_m", self.clearance_m, "metres")
    }

    /// Every grasp of a shape that the opening permits.
    pub fn grasps(&self, shape: &Shape) -> Grasps {
        let [thickness_m, breadth_m] = self.finger_size_m;
        let swept_m = self.clearance_m + thickness_m;
        let fingers = (0..DIRECTIONS).filter_map(|k| {
            let along = Vec2::from_heading(PI * f64::from(k) / f64::from(DIRECTIONS));
            let across = Vec2::new(-along.y, along.x) * (breadth_m / 2.0);
            let sides = [along, -along].map(|outward| {
                let middle = Point::ORIGIN + outward * (shape.reach_m(outward) + swept_m / 2.0);
                [middle - across, middle + across]
            });
            let width_m = shape.reach_m(along) + shape.reach_m(-along);
            (width_m + 2.0 * self.clearance_m <= self.opening_m).then_some(sides)
        });
        Grasps { fingers: fingers.collect(), radius_m: swept_m / 2.0 }
    }
}

/// The grasps of one kind of object.
#[derive(Clone, Debug, PartialEq)]
pub struct Grasps {
    /// Per feasible closing direction the centre lines of the areas that the two fingers sweep, in the object's frame (m).
    fingers: Vec<[[Point; 2]; 2]>,
    /// Half of the width that a finger sweeps while it closes (m).
    radius_m: f64,
}

impl Grasps {
    /// Whether the object is too wide in all closing directions.
    pub fn is_empty(&self) -> bool {
        self.fingers.is_empty()
    }

    /// Clearance between the neighbours and the fingers of the best grasp (m): negative if every grasp touches one, infinite without
    /// neighbours.
    pub fn room_m<'a>(&self, pose: Pose, neighbours: impl Iterator<Item = &'a Outline> + Clone) -> f64 {
        let room_m = |sides: &[[Point; 2]; 2]| {
            let fingers = sides.map(|[from, to]| {
                Outline::capsule(pose.table_from_body(from), pose.table_from_body(to), self.radius_m)
            });
            let gaps = neighbours.clone().flat_map(|n| fingers.each_ref().map(|finger| finger.gap_m(n)));
            gaps.fold(f64::INFINITY, f64::min)
        };
        // Without a feasible grasp the clearance is that of the deepest overlap.
        self.fingers.iter().map(room_m).fold(-self.radius_m, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRIPPER: Gripper = Gripper { opening_m: 0.06, finger_size_m: [0.01, 0.02], clearance_m: 0.005 };

    fn square(x_m: f64, y_m: f64) -> Outline {
        Outline::new(&Shape::Rectangle { size_m: [0.04, 0.04] }, Pose::new(x_m, y_m, 0.0))
    }

    fn room_m(neighbours: &[Outline]) -> f64 {
        let grasps = GRIPPER.grasps(&Shape::Rectangle { size_m: [0.04, 0.04] });
        grasps.room_m(Pose::new(0.0, 0.0, 0.0), neighbours.iter())
    }

    #[test]
    fn fingers_fit_where_the_neighbours_leave_clearance() {
        // A finger sweeps the 15 mm beside the square.
        let beside = |gap_m: f64| [square(0.04 + gap_m, 0.0), square(-0.04 - gap_m, 0.0)];
        let free_above = room_m(&beside(0.001));
        assert!(free_above > 0.0, "{free_above} m");
        let blocked = |gap_m: f64| {
            let [east, west] = beside(gap_m);
            [east, west, square(0.0, 0.04 + gap_m), square(0.0, -0.04 - gap_m)]
        };
        assert!(room_m(&blocked(0.010)) < 0.0);
        assert!((room_m(&blocked(0.018)) - 0.003).abs() < 1e-12);
        assert_eq!(room_m(&[]), f64::INFINITY);
    }

    #[test]
    fn clearance_decreases_monotonically_even_where_fingers_touch() {
        let around = |gap_m: f64| {
            let far_m = 0.04 + gap_m;
            [square(far_m, 0.0), square(-far_m, 0.0), square(0.0, far_m), square(0.0, -far_m)]
        };
        // Below half of the swept width the clearance saturates.
        let rooms = [0.008, 0.010, 0.014, 0.018].map(|gap_m| room_m(&around(gap_m)));
        assert!(rooms.is_sorted_by(|less, more| less < more), "{rooms:?}");
    }

    #[test]
    fn an_object_wider_than_the_opening_has_no_grasp() {
        assert!(GRIPPER.grasps(&Shape::Disc { radius_m: 0.026 }).is_empty());
        let bar = GRIPPER.grasps(&Shape::Rectangle { size_m: [0.2, 0.03] });
        assert!(!bar.is_empty() && bar.fingers.len() < usize::from(DIRECTIONS));
        assert!(GRIPPER.grasps(&Shape::Disc { radius_m: 0.026 }).room_m(Pose::default(), [].iter()) < 0.0);
    }
}
