//! Where may an object be put? It touches what is near, and overlaps nothing.

use super::request::{Cache, PileRequest};
use crate::project::Project;
use breakshot::geometry::outline::Outline;
use breakshot::geometry::{Point, Pose, Vec2};
use breakshot::object::Shape;
use breakshot::scene::Scene;
use breakshot::{Error, Result};
use serde::{Deserialize, Serialize};

/// Gaps up to this close when an object is put down (m).
const SNAP_M: f64 = 0.006;
/// A gap that counts as a contact (m).
const CONTACT_M: f64 = 1e-6;
/// Times that an object slides along what it touches while it is dragged.
const MOST_SLIDES: usize = 10;
/// Halvings of a path: a metre to less than a nanometre.
const BISECTIONS: usize = 32;
/// Step of the difference that gives the direction of a contact (m).
const DIFFERENCE_M: f64 = 1e-6;

/// An object that is dragged or turned.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SettleRequest {
    pile: PileRequest,
    /// The object; its pose in the pile is the one from which it is moved.
    object: String,
    /// Where it is wanted.
    to: Pose,
    /// Whether small gaps close.
    #[serde(default = "yes")]
    snap: bool,
}

fn yes() -> bool {
    true
}

/// Where the object lies.
#[derive(Debug, PartialEq, Serialize)]
pub(crate) struct Settled {
    pub(crate) pose: Pose,
    /// What it touches: objects and `walls[k]`.
    touches: Vec<String>,
}

/// The pose nearest to the wanted one that is free.
///
/// # Errors
/// A pile that is not valid, an object that is not in it, a pose that is not finite.
pub(crate) fn settled(project: &Project, cache: &Cache, request: &SettleRequest) -> Result<Settled> {
    let scene = cache.pile(project, &request.pile)?;
    let Some(from) = scene.placed.iter().find(|p| p.object == request.object) else {
        return Err(Error::invalid("the pile", "the object", &request.object, "a placed object"));
    };
    let to = request.to;
    if !to.position.is_finite() || !to.yaw_rad.is_finite() {
        return Err(Error::invalid(&request.object, "the pose", "not a number", "numbers"));
    }
    let around = Around::new(&scene, &request.object)?;
    let pose = around.moved(from.pose(), to);
    let pose = if request.snap { around.snapped(pose) } else { pose };
    Ok(Settled { touches: around.touched(pose), pose })
}

/// One object and the outlines of everything else.
struct Around {
    shape: Shape,
    others: Vec<(String, Outline)>,
}

impl Around {
    fn new(scene: &Scene, object: &str) -> Result<Self> {
        let mut others = Vec::new();
        for placed in scene.placed.iter().filter(|placed| placed.object != object) {
            others.push((
                placed.object.clone(),
                Outline::new(&scene.object(&placed.object)?.shape, placed.pose()),
            ));
        }
        let walls = scene.walls.iter().enumerate();
        others.extend(walls.map(|(k, w)| (format!("walls[{k}]"), Outline::segment(w.from_m, w.to_m))));
        Ok(Self { shape: scene.object(object)?.shape.clone(), others })
    }

    /// The smallest gap (m); negative for an overlap.
    fn gap_m(&self, pose: Pose) -> f64 {
        let own = Outline::new(&self.shape, pose);
        self.others.iter().map(|(_, other)| own.gap_m(other)).fold(f64::INFINITY, f64::min)
    }

    /// The unit vector along which the smallest gap grows fastest.
    fn away(&self, pose: Pose) -> Option<Vec2> {
        let gap_m = |x: f64, y: f64| self.gap_m(Pose { position: pose.position + Vec2::new(x, y), ..pose });
        let d = DIFFERENCE_M;
        Vec2::new(gap_m(d, 0.0) - gap_m(-d, 0.0), gap_m(0.0, d) - gap_m(0.0, -d)).direction()
    }

    /// Moves and turns the object as far as it can go.
    fn moved(&self, from: Pose, to: Pose) -> Pose {
        if self.gap_m(to) >= 0.0 {
            return to;
        }
        if self.gap_m(from) < 0.0 {
            return from;
        }
        self.slid(self.turned(from, to.yaw_rad), to.position)
    }

    /// The last free pose between a free one and another; `at` gives the poses between (0 to 1).
    fn last_free(&self, at: impl Fn(f64) -> Pose) -> Pose {
        if self.gap_m(at(1.0)) >= 0.0 {
            return at(1.0);
        }
        let (mut free, mut blocked) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = f64::midpoint(free, blocked);
            if self.gap_m(at(middle)) >= 0.0 { free = middle } else { blocked = middle }
        }
        at(free)
    }

    /// Turns the object until it would overlap something.
    fn turned(&self, from: Pose, yaw_rad: f64) -> Pose {
        self.last_free(|part| Pose { yaw_rad: from.yaw_rad + part * (yaw_rad - from.yaw_rad), ..from })
    }

    /// Moves the object along a path until a contact.
    fn advanced(&self, from: Pose, path: Vec2) -> Pose {
        self.last_free(|part| Pose { position: from.position + path * part, ..from })
    }

    /// Moves the object towards a point; at a contact it slides along what it touches, and then towards the point again.
    fn slid(&self, from: Pose, to: Point) -> Pose {
        let mut pose = self.advanced(from, to - from.position);
        for _ in 0..MOST_SLIDES {
            let Some(away) = self.away(pose) else { break };
            let along = away.perpendicular();
            let sideways = along * (to - pose.position).dot(along);
            if sideways.length() < CONTACT_M {
                break;
            }
            let lifted = self.advanced(pose, away * CONTACT_M);
            let beside = self.advanced(lifted, sideways);
            pose = self.advanced(beside, to - beside.position);
        }
        pose
    }

    /// Closes the smallest gap if it is small.
    fn snapped(&self, pose: Pose) -> Pose {
        let gap_m = self.gap_m(pose);
        if !(CONTACT_M..SNAP_M).contains(&gap_m) {
            return pose;
        }
        let Some(away) = self.away(pose) else { return pose };
        // A path that passes a corner ends in no contact.
        let path = -(away * SNAP_M);
        if self.gap_m(Pose { position: pose.position + path, ..pose }) >= 0.0 {
            pose
        } else {
            self.advanced(pose, path)
        }
    }

    fn touched(&self, pose: Pose) -> Vec<String> {
        let own = Outline::new(&self.shape, pose);
        let touches = self.others.iter().filter(|(_, other)| own.gap_m(other) <= 2.0 * CONTACT_M);
        touches.map(|(name, _)| name.clone()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(shape: Shape, others: &[(f64, f64)]) -> Around {
        let disc = |&(x, y): &(f64, f64)| Outline::new(&Shape::Disc { radius_m: 0.04 }, Pose::new(x, y, 0.0));
        let others = others.iter().map(|other| (format!("{other:?}"), disc(other))).collect();
        Around { shape, others }
    }

    #[test]
    fn a_disc_that_is_dragged_onto_another_stays_beside_it() {
        let around = around(Shape::Disc { radius_m: 0.03 }, &[(0.0, 0.0)]);
        let from = Pose::new(-0.2, 0.01, 0.0);
        let pose = around.snapped(around.moved(from, Pose::new(-0.01, 0.02, 0.0)));
        let distance_m = pose.position.distance(Point::ORIGIN);
        assert!((0.07..0.070_003).contains(&distance_m), "{distance_m} m");
        // It has slid towards the wanted side.
        assert!(pose.position.y > 0.02, "{pose:?}");
    }

    #[test]
    fn a_small_gap_closes_and_a_large_one_stays() {
        let around = around(Shape::Disc { radius_m: 0.03 }, &[(0.0, 0.0)]);
        let near = around.snapped(Pose::new(0.074, 0.0, 0.0));
        assert!((near.position.x - 0.07).abs() < 3e-6 && around.gap_m(near) >= 0.0, "{near:?}");
        let far = Pose::new(0.08, 0.0, 0.0);
        assert_eq!(around.snapped(far), far);
    }

    #[test]
    fn nothing_overlaps_wherever_a_square_is_dragged() {
        let discs = [(0.0, 0.0), (0.081, 0.0), (0.04, 0.0702)];
        let around = around(Shape::Rectangle { size_m: [0.06, 0.03] }, &discs);
        let mut pose = Pose::new(-0.2, -0.1, 0.0);
        for k in 0..200 {
            let angle = f64::from(k) * 0.7;
            let wanted = Pose::new(0.04 + 0.08 * angle.cos(), 0.03 + 0.08 * (1.3 * angle).sin(), 0.2 * angle);
            pose = around.snapped(around.moved(pose, wanted));
            assert!(around.gap_m(pose) >= 0.0, "step {k}: {} m", around.gap_m(pose));
        }
    }

    #[test]
    fn an_object_turns_until_it_touches() {
        let around = around(Shape::Rectangle { size_m: [0.2, 0.02] }, &[(0.0, 0.06)]);
        let pose = around.moved(Pose::new(0.0, 0.0, 0.0), Pose::new(0.0, 0.0, 1.5));
        assert!(pose.yaw_rad > 0.05 && pose.yaw_rad < 1.5 && around.gap_m(pose) < 1e-6, "{pose:?}");
    }
}
