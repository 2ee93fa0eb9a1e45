//! The tool with the striker as a solid, and the objects that are in its way.
//!
//! From the flange to the tip it counts as a cylinder of the striker's outer radius, however it is tilted.

use crate::geometry::Point;
use crate::geometry::outline::Outline;
use crate::robot::arm::model::frame::Frame;
use crate::robot::arm::model::serial_arm::Arm;
use crate::robot::arm::mounted_arm::MountedArm;
use crate::scene::Scene;

/// Smallest height of the tool above the table, as a fraction of the strike's height: the rest is for the errors of the path.
const LEAST_HEIGHT_FRACTION: f64 = 0.5;

/// The tool, and what it must not touch outside the strike.
#[derive(Clone, Debug)]
pub(crate) struct ToolSolid {
    table_from_base: Frame,
    radius_m: f64,
    /// Smallest allowed height of its lowest edge (m).
    pub(crate) least_height_m: f64,
    /// The outlines of the objects with their heights (m).
    objects: Vec<(Outline, f64)>,
}

/// The tool at one sample, in the table frame.
pub(crate) struct ToolPlace {
    /// Height of its lowest edge (m).
    pub(crate) lowest_m: f64,
    /// Its projection to the table.
    shadow: Outline,
}

impl ToolSolid {
    pub(crate) fn new(mounted: &MountedArm, scene: Option<&Scene>) -> Self {
        let placed = scene.into_iter().flat_map(|scene| scene.placed.iter().map(move |p| (scene, p)));
        let objects = placed.filter_map(|(scene, placed)| {
            let object = scene.object(&placed.object).ok()?;
            Some((Outline::new(&object.shape, placed.pose()), object.height_m))
        });
        Self {
            table_from_base: mounted.base_from_table.inverse(),
            radius_m: mounted.striker.outer_radius_m(),
            least_height_m: LEAST_HEIGHT_FRACTION * mounted.strike_height_m,
            objects: objects.collect(),
        }
    }

    /// The tool at joint angles (rad).
    pub(crate) fn at(&self, arm: &Arm, angles_rad: &[f64]) -> ToolPlace {
        let ends = [arm.tip(angles_rad), arm.flange_frame(angles_rad)].map(|end| self.table_from_base * end);
        let lowest = ends.iter().map(|end| {
            // The edge of a disc across the tool: it is lower than its centre by the radius times the sine of the tilt.
            let upright = end.rotation.matrix()[(2, 2)].clamp(-1.0, 1.0);
            end.translation.z - self.radius_m * (1.0 - upright * upright).sqrt()
        });
        let [tip, flange] = ends.map(|end| Point::new(end.translation.x, end.translation.y));
        ToolPlace {
            lowest_m: lowest.fold(f64::INFINITY, f64::min),
            shadow: Outline::capsule(tip, flange, self.radius_m),
        }
    }

    /// The distance to the nearest object that is at least as high as the tool's lowest edge (m); `None` above all objects.
    pub(crate) fn object_distance_m(&self, place: &ToolPlace) -> Option<f64> {
        let in_the_way = self.objects.iter().filter(|(_, height_m)| *height_m >= place.lowest_m);
        in_the_way.map(|(outline, _)| outline.gap_m(&place.shadow)).min_by(f64::total_cmp)
    }
}
