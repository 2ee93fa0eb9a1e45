//! Do these poses fulfil the goal, and by what margin?
//!
//! The only module that evaluates a goal: [`crate::scene::singulation`] reports the conditions that fail, the planner searches for the strike
//! with the largest margin.

use crate::error::Result;
use crate::geometry::outline::Outline;
use crate::geometry::{Point, Pose};
use crate::object::Shape;
use crate::scene::gripper::Grasps;
use crate::scene::{STILL_M, Scene};
use serde::{Deserialize, Serialize};

/// An area with a rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Area {
    /// The workspace: every centre has to be inside.
    Workspace,
    /// The table: an object whose centre is past its edge falls.
    Table,
    /// A keep-out area: no outline may overlap it.
    KeepOut,
}

/// One condition of the goal; objects are indices in the evaluator's order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Condition {
    /// Eq. 36 for a pair of objects.
    Close([usize; 2]),
    /// The least gap between the outlines of a pair.
    Narrow([usize; 2]),
    /// Eq. 35, lower bound.
    Dense,
    /// Eq. 35, upper bound.
    Wide,
    /// The area in which an object is, or must not be.
    Position(usize, Area),
    /// The room around an object for the gripper's fingers.
    Grasp(usize),
    /// The displacement of an object that must not move.
    Moved(usize),
    /// No condition applies (a single object), or the simulation did not finish.
    Nothing,
}

/// A condition, evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evaluated {
    pub condition: Condition,
    /// The length that the condition is about (m): a distance, a gap, a displacement, or how deep an object is in a forbidden area.
    pub found_m: f64,
    /// The slack (m); negative if the condition does not hold.
    pub margin_m: f64,
    /// Whether the goal requires it.  Conditions that are not required are reported all the same.
    pub required: bool,
}

/// How clearly poses fulfil the goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoalMargin {
    /// The slack of the tightest condition (m); negative if it does not hold.
    pub margin_m: f64,
    /// The condition with the least slack.
    pub(crate) tightest: Condition,
    /// Number of objects that are far enough from all others and inside the permitted areas.
    pub singulated: usize,
}

impl GoalMargin {
    /// A simulation that did not finish, or a strike that could not start.
    pub const FAILED: Self = Self { margin_m: -1.0, tightest: Condition::Nothing, singulated: 0 };

    /// Whether every required condition holds.
    pub fn fulfilled(&self) -> bool {
        self.margin_m >= 0.0
    }

    fn take(&mut self, margin_m: f64, condition: Condition) {
        if margin_m < self.margin_m {
            (self.margin_m, self.tightest) = (margin_m, condition);
        }
    }
}

/// The centre and, where it is known, the yaw of an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub position: Point,
    pub yaw_rad: Option<f64>,
}

impl From<Pose> for Placement {
    fn from(pose: Pose) -> Self {
        Self { position: pose.position, yaw_rad: Some(pose.yaw_rad) }
    }
}

/// The goal of a scene, prepared for many evaluations: shapes, areas and grasps are looked up once.
pub struct GoalEvaluator<'a> {
    scene: &'a Scene,
    shapes: Vec<&'a Shape>,
    table: Option<Outline>,
    keep_out: Vec<Outline>,
    /// Whether the goal restricts an object's distance to the others.
    restricted: Vec<bool>,
    /// The grasps of each object that the goal's gripper has to take.
    grasps: Vec<Option<Grasps>>,
    /// The positions of the objects that must not move.
    fixed: Vec<Option<Point>>,
}

impl<'a> GoalEvaluator<'a> {
    /// For the placed objects of the scene, in its order.
    ///
    /// # Errors
    /// A placed object without an entry among the scene's objects.
    pub fn new(scene: &'a Scene) -> Result<Self> {
        Self::of_objects(scene, scene.placed.iter().map(|p| p.object.as_str()))
    }

    /// For objects in a given order.
    ///
    /// # Errors
    /// A name without an entry among the scene's objects.
    pub(crate) fn of_objects<'n>(
        scene: &'a Scene,
        names: impl Iterator<Item = &'n str> + Clone,
    ) -> Result<Self> {
        let goal = &scene.goal;
        let shapes: Vec<&Shape> =
            names.clone().map(|n| Ok(&scene.object(n)?.shape)).collect::<Result<_>>()?;
        let restricted: Vec<bool> = names.clone().map(|name| goal.asks_of(name)).collect();
        let grasps = shapes
            .iter()
            .zip(&restricted)
            .map(|(shape, restricted)| goal.gripper.filter(|_| *restricted).map(|g| g.grasps(shape)));
        let fixed = names.map(|name| {
            let placed = scene.placed.iter().find(|p| p.object == name)?;
            goal.keep_still.contains(&placed.object).then_some(placed.position_m)
        });
        Ok(Self {
            scene,
            grasps: grasps.collect(),
            fixed: fixed.collect(),
            shapes,
            restricted,
            table: scene.cell.table.as_ref().map(|table| Outline::polygon(&table.outline_m)),
            keep_out: scene.keep_out.iter().map(|area| Outline::polygon(&area.points_m)).collect(),
        })
    }

    /// Number of objects.
    pub(crate) fn count(&self) -> usize {
        self.shapes.len()
    }

    /// The outline of an object; none where its yaw is unknown and matters.
    pub(crate) fn outline(&self, object: usize, at: Placement) -> Option<Outline> {
        let shape = self.shapes[object];
        let yaw_rad = self.yaw_rad(object, at)?;
        Some(Outline::new(shape, Pose { position: at.position, yaw_rad }))
    }

    /// The yaw of an object (rad); any yaw describes a disc.
    fn yaw_rad(&self, object: usize, at: Placement) -> Option<f64> {
        at.yaw_rad.or(matches!(self.shapes[object], Shape::Disc { .. }).then_some(0.0))
    }

    /// The margin of final poses, in the evaluator's order; `fallen` marks objects that fell off the table (empty: none).
    pub fn margin(&self, poses: &[Pose], fallen: &[bool]) -> GoalMargin {
        let mut margin = GoalMargin { margin_m: f64::INFINITY, tightest: Condition::Nothing, singulated: 0 };
        let mut alone = vec![true; poses.len()];
        let outlines: Vec<_> = if self.needs_outlines() {
            poses.iter().enumerate().map(|(k, pose)| self.outline(k, (*pose).into())).collect()
        } else {
            Vec::new()
        };
        self.evaluate(
            &outlines,
            |k| poses[k].into(),
            |evaluated| {
                let Evaluated { condition, margin_m, required, .. } = evaluated;
                if required {
                    margin.take(margin_m, condition);
                }
                match condition {
                    Condition::Close([a, b]) | Condition::Narrow([a, b]) if margin_m < 0.0 => {
                        (alone[a], alone[b]) = (false, false);
                    }
                    Condition::Position(k, _) | Condition::Grasp(k) if required && margin_m < 0.0 => {
                        alone[k] = false;
                    }
                    _ => {}
                }
            },
        );
        // The pose of a fallen object is the one at the edge.
        for k in (0..alone.len()).filter(|&k| fallen.get(k) == Some(&true)) {
            margin.take(GoalMargin::FAILED.margin_m, Condition::Position(k, Area::Table));
            alone[k] = false;
        }
        margin.singulated = alone.iter().filter(|&&alone| alone).count();
        margin
    }

    fn needs_outlines(&self) -> bool {
        self.scene.goal.min_gap_m > 0.0
            || !self.keep_out.is_empty()
            || self.grasps.iter().any(Option::is_some)
    }

    /// Evaluates every condition: pairs, the mean distance, areas, grasps, displacements.
    ///
    /// `outlines` may be empty if no condition needs them; an object without an outline has no gap and no grasp.
    pub(crate) fn evaluate(
        &self,
        outlines: &[Option<Outline>],
        at: impl Fn(usize) -> Placement,
        mut take: impl FnMut(Evaluated),
    ) {
        self.pairs(outlines, &at, &mut take);
        for k in 0..self.count() {
            self.areas(k, at(k), outlines.get(k).and_then(Option::as_ref), &mut take);
        }
        self.grasps(outlines, &at, &mut take);
        for (k, fixed) in self.fixed.iter().enumerate() {
            if let Some(fixed) = fixed {
                let found_m = fixed.distance(at(k).position);
                take(Evaluated {
                    condition: Condition::Moved(k),
                    found_m,
                    margin_m: STILL_M - found_m,
                    required: true,
                });
            }
        }
    }

    fn pairs(
        &self,
        outlines: &[Option<Outline>],
        at: &impl Fn(usize) -> Placement,
        take: &mut impl FnMut(Evaluated),
    ) {
        let (goal, count) = (&self.scene.goal, self.count());
        let mut sum_m = 0.0;
        for a in 0..count {
            let from = at(a).position;
            for b in a + 1..count {
                let found_m = from.distance(at(b).position);
                sum_m += found_m;
                let required = self.restricted[a] || self.restricted[b];
                let margin_m = found_m - goal.min_distance_m;
                take(Evaluated { condition: Condition::Close([a, b]), found_m, margin_m, required });
                if required
                    && goal.min_gap_m > 0.0
                    && let (Some(Some(one)), Some(Some(other))) = (outlines.get(a), outlines.get(b))
                {
                    let found_m = one.gap_m(other);
                    let margin_m = found_m - goal.min_gap_m;
                    take(Evaluated { condition: Condition::Narrow([a, b]), found_m, margin_m, required });
                }
            }
        }
        let pairs = count * count.saturating_sub(1) / 2;
        if pairs > 0 && goal.target.is_none() {
            let [least_m, most_m] = goal.mean_distance_m;
            let found_m = sum_m / pairs as f64;
            let mut mean = |condition, margin_m| {
                take(Evaluated { condition, found_m, margin_m, required: true });
            };
            mean(Condition::Dense, found_m - least_m);
            // The interval is open above: a mean equal to the upper bound is too large.
            mean(Condition::Wide, open_bound(most_m - found_m));
        }
    }

    /// Conditions on an object's position; `found_m` is how deep it is in the wrong area.
    fn areas(&self, k: usize, at: Placement, outline: Option<&Outline>, take: &mut impl FnMut(Evaluated)) {
        let mut position = |area, margin_m: f64, required, found_m: &dyn Fn() -> f64| {
            let found_m = if margin_m < 0.0 { found_m() } else { 0.0 };
            take(Evaluated { condition: Condition::Position(k, area), found_m, margin_m, required });
        };
        let Placement { position: centre, .. } = at;
        let (low, high) = (self.scene.cell.workspace.min_m, self.scene.cell.workspace.max_m);
        let inside_m = (centre.x - low.x).min(high.x - centre.x).min(centre.y - low.y).min(high.y - centre.y);
        position(Area::Workspace, inside_m, self.scene.goal.inside_workspace, &|| {
            let past_m = |low: f64, value: f64, high: f64| (low - value).max(value - high).max(0.0);
            past_m(low.x, centre.x, high.x).hypot(past_m(low.y, centre.y, high.y))
        });
        if let Some(table) = &self.table {
            let border_m = table.border_distance_m(centre);
            let margin_m = if table.contains(centre) { border_m } else { open_bound(-border_m) };
            position(Area::Table, margin_m, true, &|| border_m);
        }
        for area in &self.keep_out {
            let (border_m, inside) = (area.border_distance_m(centre), area.contains(centre));
            let margin_m = match outline {
                Some(outline) => area.gap_m(outline),
                None if inside => open_bound(-border_m),
                None => border_m,
            };
            let radius_m = self.shapes[k].outer_radius_m();
            position(Area::KeepOut, margin_m, true, &|| {
                (radius_m + if inside { border_m } else { -border_m }).max(0.0)
            });
        }
    }

    fn grasps(
        &self,
        outlines: &[Option<Outline>],
        at: &impl Fn(usize) -> Placement,
        take: &mut impl FnMut(Evaluated),
    ) {
        for (k, grasps) in self.grasps.iter().enumerate() {
            let Some(grasps) = grasps else { continue };
            let Placement { position, .. } = at(k);
            let Some(yaw_rad) = self.yaw_rad(k, at(k)) else { continue };
            let neighbours =
                outlines.iter().enumerate().filter(|(other, _)| *other != k).filter_map(|(_, o)| o.as_ref());
            let room_m = grasps.room_m(Pose { position, yaw_rad }, neighbours);
            let condition = Condition::Grasp(k);
            take(Evaluated { condition, found_m: -room_m, margin_m: room_m, required: true });
        }
    }
}

/// A margin that has to be positive, not only non-negative: zero becomes the smallest negative number.
fn open_bound(margin_m: f64) -> f64 {
    if margin_m > 0.0 { margin_m } else { margin_m.min(-f64::MIN_POSITIVE) }
}
