//! The contents of drawings from above: a pile at given poses, and a simulated strike.

use crate::geometry::{Point, Pose};
use crate::physics::Trajectory;
use crate::report::figures::{CentrePath, DrawnObject, Layer, Palette, TopView};
use crate::scene::{Scene, Strike};
use std::collections::BTreeMap;

/// The number of points of a path: their distance is less than a pixel.
const PATH_POINTS: usize = 160;

/// The objects of a scene at these poses, in one style.
pub(super) fn drawn_objects<'a>(
    scene: &'a Scene,
    poses: impl Iterator<Item = (&'a str, Pose)>,
    layer: Layer,
    palette: &Palette,
) -> Vec<DrawnObject<'a>> {
    let drawn = |(name, pose): (&'a str, Pose)| {
        let shape = &scene.object(name).ok()?.shape;
        Some(DrawnObject { name, class: palette.class(name), shape, pose, layer })
    };
    poses.filter_map(drawn).collect()
}

/// A simulated strike: the poses before and after it, the striker, and the paths of the centres if the trajectory is
/// given.
pub(super) fn simulated_view<'a>(
    scene: &'a Scene,
    strike: &'a Strike,
    final_poses: &'a BTreeMap<String, Pose>,
    trajectory: Option<&Trajectory>,
    palette: &Palette,
) -> TopView<'a> {
    let before = scene.placed.iter().map(|p| (p.object.as_str(), p.pose()));
    let after = final_poses.iter().map(|(name, pose)| (name.as_str(), *pose));
    let mut objects = drawn_objects(scene, before, Layer::Before, palette);
    objects.extend(drawn_objects(scene, after, Layer::Current, palette));
    let path = |name: &String| {
        Some(CentrePath { class: palette.class(name), points: centre_path(trajectory?, name) })
    };
    let paths = final_poses.keys().filter_map(path).collect();
    TopView { scene, objects, paths, strike: Some(strike), approaches: Vec::new() }
}

/// The path of an object's centre.
pub(super) fn centre_path(trajectory: &Trajectory, name: &str) -> Vec<Point> {
    let time = |k: usize| trajectory.duration_s * k as f64 / (PATH_POINTS - 1) as f64;
    let poses: Vec<Pose> = (0..PATH_POINTS).filter_map(|k| trajectory.pose(name, time(k))).collect();
    poses.into_iter().map(|pose| pose.position).collect()
}
