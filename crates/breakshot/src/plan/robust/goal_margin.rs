//! By how much does an outcome fulfil the goal, or miss it?
//!
//! The same conditions as [`crate::singulation`], by index instead of by name, with one number: the slack of the tightest
//! condition.

use crate::error::Result;
use crate::geometry::{Point, Pose};
use crate::gripper::Grasps;
use crate::object::Shape;
use crate::outline::Outline;
use crate::physics::Outcome;
use crate::scene::{STILL_M, Scene};
use crate::singulation::Area;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A scene's goal, ready to judge many outcomes.
pub(crate) struct Judge<'a> {
    scene: &'a Scene,
    shapes: Vec<&'a Shape>,
    table: Option<Outline>,
    keep_out: Vec<Outline>,
    /// Whether the goal asks anything of an object's distance to the others.
    asked: Vec<bool>,
    /// How the goal's gripper can take each object that it shall take.
    grasps: Vec<Option<Grasps>>,
    /// Where the objects lie that must not move.
    still: Vec<Option<Point>>,
    judged: AtomicUsize,
}

/// The condition that is tightest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Condition {
    /// Eq. 36 for a pair of objects.
    Close([usize; 2]),
    /// The least gap of a pair of objects.
    Narrow([usize; 2]),
    /// Eq. 35, lower bound.
    Dense,
    /// Eq. 35, upper bound.
    Wide,
    /// An object's place.
    Place(usize, Area),
    /// The room around an object for the gripper.
    Grasp(usize),
    /// How far an object that must lie still was moved.
    Moved(usize),
    /// Nothing is asked of a single object, or the rollout was given up.
    Nothing,
}

/// What an outcome is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Verdict {
    /// The slack of the tightest condition (m); negative if it does not hold.
    pub margin_m: f64,
    pub tightest: Condition,
    /// How many objects are far enough from all others and lie where they may.
    pub singulated: usize,
}

impl Verdict {
    /// A rollout that came to no end, or a strike that could not start.
    pub(crate) const FAILED: Self = Self { margin_m: -1.0, tightest: Condition::Nothing, singulated: 0 };

    pub(crate) fn fulfilled(&self) -> bool {
        self.margin_m >= 0.0
    }
}

impl<'a> Judge<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Result<Self> {
        let (goal, placed) = (&scene.goal, &scene.placed);
        let shapes: Vec<&Shape> =
            placed.iter().map(|p| Ok(&scene.object(&p.object)?.shape)).collect::<Result<_>>()?;
        let asked: Vec<bool> = placed.iter().map(|p| goal.asks_of(&p.object)).collect();
        let grasps = shapes
            .iter()
            .zip(&asked)
            .map(|(shape, asked)| goal.gripper.filter(|_| *asked).map(|gripper| gripper.grasps(shape)));
        let still = placed.iter().map(|p| goal.keep_still.contains(&p.object).then_some(p.position_m));
        Ok(Self {
            scene,
            grasps: grasps.collect(),
            still: still.collect(),
            shapes,
            asked,
            table: scene.cell.table.as_ref().map(|table| Outline::polygon(&table.outline_m)),
            keep_out: scene.keep_out.iter().map(|area| Outline::polygon(&area.points_m)).collect(),
            judged: AtomicUsize::new(0),
        })
    }

    /// How many outcomes were judged so far.
    pub(crate) fn judged(&self) -> usize {
        self.judged.load(Ordering::Relaxed)
    }

    /// How many objects there are.
    pub(crate) fn count(&self) -> usize {
        self.shapes.len()
    }

    /// Judges where the objects came to rest, in the scene's order.
    pub(crate) fn verdict(&self, outcome: &Outcome) -> Verdict {
        self.judged.fetch_add(1, Ordering::Relaxed);
        if !outcome.complete {
            return Verdict::FAILED;
        }
        let mut slack = Slack { margin_m: f64::INFINITY, tightest: Condition::Nothing };
        let mut alone = vec![true; outcome.poses.len()];
        self.places(&outcome.poses, &mut slack, &mut alone);
        // A fallen object's pose is the one at the edge.
        for k in (0..alone.len()).filter(|&k| outcome.fallen.get(k) == Some(&true)) {
            slack.take(Verdict::FAILED.margin_m, Condition::Place(k, Area::Table));
            alone[k] = false;
        }
        self.pairs(&outcome.poses, &mut slack, &mut alone);
        self.grasps(&outcome.poses, &mut slack, &mut alone);
        self.still(&outcome.poses, &mut slack);
        let singulated = alone.iter().filter(|&&alone| alone).count();
        Verdict { margin_m: slack.margin_m, tightest: slack.tightest, singulated }
    }

    fn pairs(&self, poses: &[Pose], slack: &mut Slack, alone: &mut [bool]) {
        let goal = &self.scene.goal;
        let mut sum_m = 0.0;
        for (a, one) in poses.iter().enumerate() {
            for (b, other) in poses.iter().enumerate().skip(a + 1) {
                let distance_m = one.position.distance(other.position);
                sum_m += distance_m;
                let asked = self.asked[a] || self.asked[b];
                let mut least_m = distance_m - goal.min_distance_m;
                if asked {
                    slack.take(least_m, Condition::Close([a, b]));
                }
                if asked && goal.min_gap_m > 0.0 {
                    let outlines =
                        [(a, one), (b, other)].map(|(k, pose)| Outline::new(self.shapes[k], *pose));
                    let gap_m = outlines[0].gap_m(&outlines[1]) - goal.min_gap_m;
                    slack.take(gap_m, Condition::Narrow([a, b]));
                    least_m = least_m.min(gap_m);
                }
                if least_m < 0.0 {
                    (alone[a], alone[b]) = (false, false);
                }
            }
        }
        let count = poses.len() * poses.len().saturating_sub(1) / 2;
        if count > 0 && goal.target.is_none() {
            let [least_m, most_m] = goal.mean_distance_m;
            let mean_m = sum_m / count as f64;
            slack.take(mean_m - least_m, Condition::Dense);
            // The upper bound itself is too much.
            let below_m = most_m - mean_m;
            slack
                .take(if below_m > 0.0 { below_m } else { below_m.min(-f64::MIN_POSITIVE) }, Condition::Wide);
        }
    }

    fn grasps(&self, poses: &[Pose], slack: &mut Slack, alone: &mut [bool]) {
        if self.grasps.iter().all(Option::is_none) {
            return;
        }
        let outlines: Vec<_> =
            poses.iter().zip(&self.shapes).map(|(pose, shape)| Outline::new(shape, *pose)).collect();
        for (k, grasps) in self.grasps.iter().enumerate() {
            let Some(grasps) = grasps else { continue };
            let neighbours = outlines.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, o)| o);
            let room_m = grasps.room_m(poses[k], neighbours);
            slack.take(room_m, Condition::Grasp(k));
            alone[k] &= room_m >= 0.0;
        }
    }

    fn still(&self, poses: &[Pose], slack: &mut Slack) {
        for (k, lay) in self.still.iter().enumerate() {
            if let Some(lay) = lay {
                slack.take(STILL_M - lay.distance(poses[k].position), Condition::Moved(k));
            }
        }
    }

    fn places(&self, poses: &[Pose], slack: &mut Slack, alone: &mut [bool]) {
        for (k, pose) in poses.iter().enumerate() {
            let mut least_m = f64::INFINITY;
            let mut take = |margin_m: f64, area| {
                slack.take(margin_m, Condition::Place(k, area));
                least_m = least_m.min(margin_m);
            };
            if self.scene.goal.inside_workspace {
                take(self.inside_m(pose.position), Area::Workspace);
            }
            if let Some(table) = &self.table {
                let border_m = table.border_distance_m(pose.position);
                take(if table.contains(pose.position) { border_m } else { -border_m }, Area::Table);
            }
            for area in &self.keep_out {
                take(area.gap_m(&Outline::new(self.shapes[k], *pose)), Area::KeepOut);
            }
            alone[k] = least_m >= 0.0;
        }
    }

    /// How far inside the workspace a point lies (m); negative outside.
    fn inside_m(&self, point: Point) -> f64 {
        let (low, high) = (self.scene.cell.workspace.min_m, self.scene.cell.workspace.max_m);
        (point.x - low.x).min(high.x - point.x).min(point.y - low.y).min(high.y - point.y)
    }
}

struct Slack {
    margin_m: f64,
    tightest: Condition,
}

impl Slack {
    fn take(&mut self, margin_m: f64, condition: Condition) {
        if margin_m < self.margin_m {
            (self.margin_m, self.tightest) = (margin_m, condition);
        }
    }
}
