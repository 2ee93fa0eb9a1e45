//! An experiment that could be filmed: which object is struck at which speed, into which other one, with which offset.

use super::simulated_clip::{SimulatedCamera, simulated_clip};
use crate::cell::Cell;
use crate::error::{Error, Result, bounds};
use crate::estimate::clip_tracks::ClipTracks;
use crate::geometry::conservative_advancement::{Step, advance};
use crate::geometry::outline::Outline;
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{self, Object, Shape};
use crate::properties::Properties;
use crate::scene::{Placed, Scene, Strike};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// The robot cell and the objects with which experiments are made.
#[derive(Clone, Copy, Debug)]
pub struct Setup<'a> {
    /// The cell: striker, camera, workspace.
    pub cell: &'a Cell,
    /// The kinds of objects.
    pub objects: &'a [Object],
}

/// One experiment: the striker hits an object centrally, which may hit another one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// The object that the robot strikes.
    pub strike: String,
    /// The object that the struck one hits; `None` if it slides alone.  A second copy is `a#2`.
    #[serde(default)]
    pub into: Option<String>,
    /// The striker's speed (m/s).
    pub speed_m_s: f64,
    /// Offset of the other object's centre to the left of the line of motion of the struck one (m).
    #[serde(default)]
    pub offset_m: f64,
}

/// Time of free sliding before the struck object hits the other one (s): about five frames of a usual camera, short enough
/// that little speed is lost.
const FREE_S: f64 = 0.08;
/// Typical speed of an object after the strike over the speed of the striker.
const SPEED_GAIN: f64 = 1.6;
/// Smallest and largest gap between the objects (m).
const GAPS_M: [f64; 2] = [0.02, 0.12];
/// Gap between the striker and the struck object at the start, and travel after the contact (m).
const RUN_UP_M: f64 = 0.03;
const FOLLOW_M: f64 = 0.005;

impl Experiment {
    /// The initial scene and the strike along +x, with the struck object near the left edge of the workspace.
    ///
    /// Flat sides are perpendicular to the motion; a polygon that is hit by a flat side has a corner towards it, so that there
    /// is one contact and not two.
    ///
    /// # Errors
    /// Unknown objects, a speed that is not positive, an offset that is not finite.
    pub fn layout(&self, setup: Setup) -> Result<(Scene, Strike)> {
        let Setup { cell, objects } = setup;
        let find = |name: &str| object::find(objects, name, "experiment");
        bounds::positive("experiment", "speed_m_s", self.speed_m_s)?;
        if !self.offset_m.is_finite() {
            return Err(Error::invalid("experiment", "offset_m", self.offset_m, "a number"));
        }
        let struck = &find(&self.strike)?.shape;
        let striker = &cell.striker.shape;
        let (low, high) = (cell.workspace.min_m, cell.workspace.max_m);
        let room_m = RUN_UP_M + 2.0 * striker.outer_radius_m() + struck.outer_radius_m();
        let pose = Pose::new(low.x + room_m, f64::midpoint(low.y, high.y), flat_towards(struck, PI));
        let mut placed =
            vec![Placed { object: self.strike.clone(), position_m: pose.position, yaw_rad: pose.yaw_rad }];
        if let Some(into) = &self.into {
            let shape = &find(into)?.shape;
            let flat = !matches!(struck, Shape::Disc { .. }) && is_flat_towards(struck, pose.yaw_rad, 0.0);
            let yaw_rad = if flat { corner_towards(shape, PI) } else { flat_towards(shape, PI) };
            let from = Outline::new(struck, pose);
            let start = Pose { position: pose.position + Vec2::new(0.0, self.offset_m), yaw_rad };
            let gap_m = (FREE_S * SPEED_GAIN * self.speed_m_s).clamp(GAPS_M[0], GAPS_M[1]);
            let position_m = apart(&from, shape, start, Vec2::new(1.0, 0.0), gap_m);
            placed.push(Placed { object: into.clone(), position_m, yaw_rad });
        }
        let target = Outline::new(struck, pose);
        let contact = Pose { position: pose.position, yaw_rad: 0.0 };
        let start_m = apart(&target, striker, contact, Vec2::new(-1.0, 0.0), RUN_UP_M);
        let strike = Strike {
            object: Some(self.strike.clone()),
            start_m,
            heading_rad: 0.0,
            speed_m_s: self.speed_m_s,
            travel_m: RUN_UP_M + FOLLOW_M,
        };
        let scene = Scene::on_free_table(cell.clone(), objects.to_vec(), placed);
        Ok((scene, strike))
    }

    /// The tracks that the clip of this experiment would give if the objects had these properties.
    ///
    /// # Errors
    /// As [`Experiment::layout`] and [`simulated_clip`].
    pub fn simulated_clip(
        &self,
        name: &str,
        setup: Setup,
        properties: &Properties,
        camera: &SimulatedCamera,
    ) -> Result<ClipTracks> {
        let (scene, strike) = self.layout(setup)?;
        simulated_clip(name, &scene, properties, &strike, camera)
    }
}

/// The position of a shape with the yaw of `start`, on the ray from `start` along a unit vector, at which its gap to an outline is `gap_m`.
fn apart(from: &Outline, shape: &Shape, start: Pose, along: Vec2, gap_m: f64) -> Point {
    const MAX_STEPS: usize = 200;
    const TOLERANCE_M: f64 = 1e-7;
    let gap = |distance_m: f64| {
        from.gap_m(&Outline::new(shape, Pose { position: start.position + along * distance_m, ..start }))
    };
    let far_m = 2.0 * shape.outer_radius_m() + 1.0;
    let placed = advance(far_m, MAX_STEPS, |distance_m| {
        let excess_m = gap(distance_m) - gap_m;
        let is_placed = excess_m.abs() < TOLERANCE_M || distance_m < -1.0;
        if is_placed { Step::End(distance_m) } else { Step::To(distance_m - excess_m) }
    });
    start.position + along * placed.unwrap_or_else(|reached_m| reached_m)
}

/// The yaw at which the best side to strike faces a heading; 0 for a disc.
///
/// The best side is the one on which the foot of the perpendicular from the centroid is farthest from both ends, so that a
/// central strike acts through the centroid.
fn flat_towards(shape: &Shape, heading_rad: f64) -> f64 {
    let corners = shape.corners();
    let n = corners.len();
    let side = |k: usize| {
        let (from, to) = (corners[k], corners[(k + 1) % n]);
        let along = (to - from).direction()?;
        // Distance of the foot of the perpendicular from the nearer end.
        let inside_m = (-from.to_vec().dot(along)).min(to.to_vec().dot(along));
        let outwards = Vec2::new(along.y, -along.x);
        // A side behind other parts of the outline cannot be struck.
        let outermost = corners.iter().all(|c| (*c - from).dot(outwards) < 1e-9);
        outermost.then(|| (inside_m, outwards.heading_rad()))
    };
    let best = (0..n).filter_map(side).max_by(|p, q| p.0.total_cmp(&q.0));
    best.map_or(0.0, |(_, normal_rad)| heading_rad - normal_rad)
}

/// The yaw at which the corner farthest from the centroid points along a heading.
fn corner_towards(shape: &Shape, heading_rad: f64) -> f64 {
    let farthest =
        shape.corners().into_iter().max_by(|p, q| p.to_vec().length().total_cmp(&q.to_vec().length()));
    farthest.map_or(0.0, |corner| heading_rad - corner.to_vec().heading_rad())
}

/// Whether the extreme part of the outline in a direction is a side and not a corner.
fn is_flat_towards(shape: &Shape, yaw_rad: f64, heading_rad: f64) -> bool {
    const FLAT_M: f64 = 1e-6;
    let along = Vec2::from_heading(heading_rad - yaw_rad);
    let reach_m = shape.reach_m(along);
    shape.corners().iter().filter(|c| c.to_vec().dot(along) > reach_m - FLAT_M).count() > 1
}
