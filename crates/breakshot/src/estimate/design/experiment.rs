//! A clip that could be filmed: who is struck how fast, into whom, and how far off centre.

use super::simulated_clip::{Filming, staged};
use crate::cell::Cell;
use crate::conservative_advancement::{Step, advance};
use crate::error::{Error, Result};
use crate::estimate::clip_tracks::ClipTracks;
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{self, Object, Shape};
use crate::outline::Outline;
use crate::properties::Properties;
use crate::scene::{Goal, Placed, Scene, Strike};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// One strike worth filming: the striker hits an object centrally, which may hit another one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shot {
    /// The object that the robot strikes.
    pub strike: String,
    /// The object that it hits then; none if it slides alone. `a#2` for a second copy.
    #[serde(default)]
    pub into: Option<String>,
    /// The striker's speed (m/s).
    pub speed_m_s: f64,
    /// How far the other object's centre lies to the left of the line along which the struck one comes (m).
    #[serde(default)]
    pub offset_m: f64,
}

/// The other object lies about so much free motion from the struck one (s): five frames of a usual camera show it, and
/// little speed is lost.
const FREE_S: f64 = 0.08;
/// An object leaves the striker about this much faster than that moves.
const FASTER: f64 = 1.6;
/// But not nearer or farther than this (m).
const GAPS_M: [f64; 2] = [0.02, 0.12];
/// The striker starts this far from the struck object, and goes on this far after it has hit it (m).
const RUN_UP_M: f64 = 0.03;
const FOLLOW_M: f64 = 0.005;

impl Shot {
    /// Where everything lies and what the robot does: along +x, the struck object near the workspace's left edge.
    ///
    /// Sides lie square to the line; a polygon that a flat side comes to meet lies with a corner towards it, so that they
    /// meet once.
    ///
    /// # Errors
    /// Unknown objects, a speed that is none.
    pub fn laid_out(&self, cell: &Cell, objects: &[Object]) -> Result<(Scene, Strike)> {
        let find = |name: &str| object::find(objects, name, "shot");
        object::positive("shot", "speed_m_s", self.speed_m_s)?;
        if !self.offset_m.is_finite() {
            return Err(Error::invalid("shot", "offset_m", self.offset_m, "a number"));
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
            let start = pose.position + Vec2::new(0.0, self.offset_m);
            let gap_m = (FREE_S * FASTER * self.speed_m_s).clamp(GAPS_M[0], GAPS_M[1]);
            let position_m = apart(&from, (shape, yaw_rad), start, Vec2::new(1.0, 0.0), gap_m);
            placed.push(Placed { object: into.clone(), position_m, yaw_rad });
        }
        let target = Outline::new(struck, pose);
        let start_m = apart(&target, (striker, 0.0), pose.position, Vec2::new(-1.0, 0.0), RUN_UP_M);
        let strike = Strike {
            object: Some(self.strike.clone()),
            start_m,
            heading_rad: 0.0,
            speed_m_s: self.speed_m_s,
            travel_m: RUN_UP_M + FOLLOW_M,
        };
        let scene = Scene {
            cell: cell.clone(),
            objects: objects.to_vec(),
            observed_unix_s: None,
            placed,
            walls: Vec::new(),
            keep_out: Vec::new(),
            goal: Goal::default(),
        };
        Ok((scene, strike))
    }

    /// The clip that a camera would film of it if the objects were as the properties say.
    ///
    /// # Errors
    /// As [`Shot::laid_out`] and [`staged`].
    pub fn staged(
        &self,
        name: &str,
        (cell, objects): (&Cell, &[Object]),
        properties: &Properties,
        filming: &Filming,
    ) -> Result<ClipTracks> {
        let (scene, strike) = self.laid_out(cell, objects)?;
        staged(name, &scene, properties, &strike, filming)
    }
}

/// Where a shape's centre comes to lie `gap_m` from an outline, pushed out of it along a direction.
fn apart(from: &Outline, (shape, yaw_rad): (&Shape, f64), start: Point, along: Vec2, gap_m: f64) -> Point {
    const ENOUGH: usize = 200;
    const CLOSE_M: f64 = 1e-7;
    let gap =
        |way_m: f64| from.gap_m(&Outline::new(shape, Pose { position: start + along * way_m, yaw_rad }));
    // Far enough out, then nearer by no more than the gap: it never passes through.
    let far_m = 2.0 * shape.outer_radius_m() + 1.0;
    let placed = advance(far_m, ENOUGH, |distance_m| {
        let excess_m = gap(distance_m) - gap_m;
        let is_placed = excess_m.abs() < CLOSE_M || distance_m < -1.0;
        if is_placed { Step::End(distance_m) } else { Step::To(distance_m - excess_m) }
    });
    start + along * placed.unwrap_or_else(|reached_m| reached_m)
}

/// The yaw that turns the side that is best to strike square to a direction; any for a disc.
///
/// Best is the longest side whose middle part faces the centroid: the line of action runs through it.
fn flat_towards(shape: &Shape, heading_rad: f64) -> f64 {
    let corners = shape.corners();
    let n = corners.len();
    let side = |k: usize| {
        let (from, to) = (corners[k], corners[(k + 1) % n]);
        let along = (to - from).direction()?;
        // How far the foot of the centroid is from the nearer end.
        let inside_m = (-from.to_vec().dot(along)).min(to.to_vec().dot(along));
        let outwards = Vec2::new(along.y, -along.x);
        // A side that others stand in front of cannot be struck.
        let outermost = corners.iter().all(|c| (*c - from).dot(outwards) < 1e-9);
        outermost.then(|| (inside_m, outwards.heading_rad()))
    };
    let best = (0..n).filter_map(side).max_by(|p, q| p.0.total_cmp(&q.0));
    best.map_or(0.0, |(_, normal_rad)| heading_rad - normal_rad)
}

/// The yaw that turns the farthest corner towards a direction.
fn corner_towards(shape: &Shape, heading_rad: f64) -> f64 {
    let farthest =
        shape.corners().into_iter().max_by(|p, q| p.to_vec().length().total_cmp(&q.to_vec().length()));
    farthest.map_or(0.0, |corner| heading_rad - corner.to_vec().heading_rad())
}

/// Whether the outline ends in a flat side in that direction.
fn is_flat_towards(shape: &Shape, yaw_rad: f64, heading_rad: f64) -> bool {
    const FLAT_M: f64 = 1e-6;
    let along = Vec2::from_heading(heading_rad - yaw_rad);
    let reach_m = shape.reach_m(along);
    shape.corners().iter().filter(|c| c.to_vec().dot(along) > reach_m - FLAT_M).count() > 1
}
