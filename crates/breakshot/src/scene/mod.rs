//! The pile on the table, the goal, and the strike (`scene.toml`, `strike.json`).

pub(crate) mod goal_margin;
pub mod gripper;
pub mod singulation;

pub use goal_margin::{GoalEvaluator, GoalMargin};

use crate::cell::Cell;
use crate::error::{Error, Result, bounds};
use crate::geometry::{Point, Pose};
use crate::object::{self, Object};
use crate::ordered_map::map_of;
use crate::scene::gripper::Gripper;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// A pile on the table of a cell: everything that a simulation or a plan needs besides the properties.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// The robot cell.
    pub cell: Cell,
    /// The kinds of objects there are.
    pub objects: Vec<Object>,
    /// The time at which the pile was observed (s since 1970), if known.
    pub observed_unix_s: Option<f64>,
    /// The poses of the objects.
    pub placed: Vec<Placed>,
    /// Straight walls.
    pub walls: Vec<Wall>,
    /// Areas that neither striker nor objects may enter.
    pub keep_out: Vec<KeepOut>,
    /// The goal after the strike.
    pub goal: Goal,
}

/// One object on the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Placed {
    /// Its name; `a#2` for the second copy of `a`.
    pub object: String,
    /// Its centroid (m).
    pub position_m: Point,
    /// Its rotation (rad, counter-clockwise).
    #[serde(default)]
    pub yaw_rad: f64,
}

impl Placed {
    /// Position and yaw together.
    pub fn pose(&self) -> Pose {
        Pose { position: self.position_m, yaw_rad: self.yaw_rad }
    }
}

/// A straight, fixed wall.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// One end.
    pub from_m: Point,
    /// The other end.
    pub to_m: Point,
    /// Restitution of an impact with it.
    pub restitution: f64,
}

/// An area that neither the striker nor any object may enter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeepOut {
    /// Its corner points, counter-clockwise (m).
    pub points_m: Vec<Point>,
}

/// What counts as singulated (Eq. 35 and 36).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Goal {
    /// Least distance between any two centres (m, Eq. 36).
    pub min_distance_m: f64,
    /// Bounds of the mean distance over all pairs (m, Eq. 35): lower inclusive, upper exclusive.
    pub mean_distance_m: [f64; 2],
    /// Least gap between any two outlines (m).
    pub min_gap_m: f64,
    /// Whether every centre must end inside the workspace.
    pub inside_workspace: bool,
    /// The one object to be singulated: only distances, gaps and grasps that involve it are required, and Eq. 35 is not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Objects that must not move.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub keep_still: Vec<String>,
    /// The gripper that has to be able to grasp every object from at least one direction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gripper: Option<Gripper>,
}

/// Displacements up to this count as no motion (m): two observations of the same table differ by a millimetre or two.
pub const STILL_M: f64 = 0.005;

impl Default for Goal {
    /// The paper's experiment (section 5): at least 90 mm between any two centres, 150 to 900 mm on average.
    fn default() -> Self {
        Self {
            min_distance_m: 0.09,
            mean_distance_m: [0.15, 0.90],
            min_gap_m: 0.0,
            inside_workspace: true,
            target: None,
            keep_still: Vec::new(),
            gripper: None,
        }
    }
}

/// After the strike the striker retracts along its path to this distance behind its start (m).
pub const RETRACT_PAST_START_M: f64 = 0.02;

/// The motion of the striker: from rest at `start_m` it moves `travel_m` along `heading_rad`, stops and retracts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Strike {
    /// The object to be struck; in a campaign it is the first of the clip's `objects`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// The striker's centre at the start (m).
    pub start_m: Point,
    /// Its direction (rad).
    pub heading_rad: f64,
    /// Its speed (m/s).
    pub speed_m_s: f64,
    /// The distance from start to stop (m).
    pub travel_m: f64,
}

/// The longest travel that is simulated (m).
const LONGEST_TRAVEL_M: f64 = 20.0;
/// The largest number of objects, walls or areas of a scene: all pairs are compared.
const MOST_ENTRIES: usize = 1000;

impl Strike {
    /// Checks that the strike can be executed; errors name `owner`.
    ///
    /// # Errors
    /// Numbers that are not finite, a speed or travel that is not positive or that no striker has.
    pub fn check(&self, owner: &str) -> Result<()> {
        bounds::strike_speed(owner, "speed_m_s", self.speed_m_s)?;
        bounds::positive(owner, "travel_m", self.travel_m)?;
        if self.travel_m > LONGEST_TRAVEL_M {
            let needed = format!("at most {LONGEST_TRAVEL_M} m");
            return Err(Error::invalid(owner, "travel_m", self.travel_m, needed));
        }
        bounds::position(owner, "start_m", &[self.start_m.x, self.start_m.y])?;
        bounds::angle(owner, "heading_rad", self.heading_rad)
    }
}

impl Scene {
    /// A scene with the default goal, without walls and keep-out areas, checked.
    ///
    /// Polygons are moved so that their origin is the centroid, as when they are loaded from a file.
    ///
    /// # Errors
    /// A cell, an object or a placement that is not valid.  Overlaps are found by the simulator.
    ///
    /// # Examples
    /// ```
    /// use breakshot::cell::{Cell, Striker, Workspace};
    /// use breakshot::geometry::Point;
    /// use breakshot::object::{Object, Shape};
    /// use breakshot::scene::{Placed, Scene};
    ///
    /// let cell = Cell::from_above(1000.0, Workspace::centred([0.6, 0.4]), Striker::rod(0.015, [0.05, 1.0]));
    /// let disc = Object { name: "a".into(), shape: Shape::Disc { radius_m: 0.03 }, height_m: 0.02, marker: None, mass_kg: None, support: None };
    /// let placed = |object: &str, x_m| Placed { object: object.into(), position_m: Point::new(x_m, 0.0), yaw_rad: 0.0 };
    /// let scene = Scene::new(cell.clone(), vec![disc.clone()], vec![placed("a", 0.0), placed("a#2", 0.07)])?;
    /// assert_eq!(scene.goal.min_distance_m, 0.09); // m, Eq. 36
    /// assert!(Scene::new(cell, vec![disc], vec![placed("b", 0.0)]).is_err()); // no object is called b
    /// # Ok::<(), breakshot::Error>(())
    /// ```
    pub fn new(mut cell: Cell, mut objects: Vec<Object>, placed: Vec<Placed>) -> Result<Self> {
        cell.check("cell")?;
        for object in &mut objects {
            object.check()?;
        }
        let scene = Self::on_free_table(cell, objects, placed);
        scene.check("scene")?;
        Ok(scene)
    }

    /// The scene that [`Scene::new`] gives, of parts that were checked before.
    pub(crate) fn on_free_table(cell: Cell, objects: Vec<Object>, placed: Vec<Placed>) -> Self {
        let goal = Goal::default();
        Self { cell, objects, observed_unix_s: None, placed, walls: Vec::new(), keep_out: Vec::new(), goal }
    }

    /// The poses of the placed objects by name.
    pub(crate) fn poses(&self) -> BTreeMap<String, Pose> {
        map_of(self.placed.iter().map(|p| (p.object.clone(), p.pose())))
    }

    /// The kind of object placed under that name.
    ///
    /// # Errors
    /// No such kind.
    pub fn object(&self, name: &str) -> Result<&Object> {
        object::find(&self.objects, name, "scene")
    }

    /// The kinds of the placed objects in alphabetical order, and whether more than one copy of each is placed.
    pub(crate) fn kinds(&self) -> Vec<(String, bool)> {
        let mut copies = BTreeMap::new();
        for placed in &self.placed {
            *copies.entry(object::kind(&placed.object).to_owned()).or_insert(0) += 1;
        }
        copies.into_iter().map(|(name, count)| (name, count > 1)).collect()
    }

    /// Checks names, numbers and the goal; errors name the entry.  Overlaps are found by the simulator.
    ///
    /// # Errors
    /// Unknown or repeated names, numbers that are not finite, a contradictory goal.
    pub fn check(&self, file: &str) -> Result<()> {
        for (what, found) in
            [("placed", self.placed.len()), ("walls", self.walls.len()), ("keep_out", self.keep_out.len())]
        {
            if found > MOST_ENTRIES {
                let needed = format!("at most {MOST_ENTRIES}");
                return Err(Error::invalid(file, format!("the number of {what}"), found, needed));
            }
        }
        let mut names = BTreeSet::new();
        for placed in &self.placed {
            object::find(&self.objects, &placed.object, file)?;
            let owner = format!("{file}: placed `{}`", placed.object);
            if !names.insert(&placed.object) {
                let needed = format!("every copy once; a second one is `{}#2`", object::kind(&placed.object));
                return Err(Error::invalid(owner, "name", "given twice", needed));
            }
            bounds::position(&owner, "position_m", &[placed.position_m.x, placed.position_m.y])?;
            bounds::angle(&owner, "yaw_rad", placed.yaw_rad)?;
        }
        for (k, wall) in self.walls.iter().enumerate() {
            let owner = format!("{file}: walls[{k}]");
            if !(0.0..=1.0).contains(&wall.restitution) {
                return Err(Error::invalid(owner, "restitution", wall.restitution, "a number from 0 to 1"));
            }
            for end in [wall.from_m, wall.to_m] {
                bounds::position(&owner, "from_m or to_m", &[end.x, end.y])?;
            }
            let length_m = wall.from_m.distance(wall.to_m);
            bounds::positive(&owner, "length", length_m)?;
        }
        for (k, area) in self.keep_out.iter().enumerate() {
            let mut outline = object::Shape::Polygon { points_m: area.points_m.clone() };
            outline.check_and_centre(&format!("{file}: keep_out[{k}]"))?;
        }
        let target = self.goal.target.iter().map(|name| ("target", name));
        let fixed = self.goal.keep_still.iter().map(|name| ("keep_still", name));
        if let Some((what, name)) = target.chain(fixed).find(|(_, name)| !names.contains(name)) {
            let placed: Vec<_> = names.iter().map(|name| name.as_str()).collect();
            let needed = format!("one of the placed objects: {}", placed.join(", "));
            return Err(Error::invalid(format!("{file}: goal"), what, name, needed));
        }
        if !names.is_empty() && names.iter().all(|name| self.goal.keep_still.contains(name)) {
            let found = "every placed object";
            let needed = "at least one object that may move";
            return Err(Error::invalid(format!("{file}: goal"), "keep_still", found, needed));
        }
        self.goal.check(file)
    }
}

impl Goal {
    /// Whether the goal restricts the distances of an object.
    pub fn asks_of(&self, object: &str) -> bool {
        self.target.as_deref().is_none_or(|target| target == object)
    }

    /// Whether the goal restricts the distance between two objects.
    pub fn asks_of_pair(&self, a: &str, b: &str) -> bool {
        self.asks_of(a) || self.asks_of(b)
    }

    /// Checks that the goal is not contradictory.
    ///
    /// # Errors
    /// Distances that are negative or not numbers, an empty interval for the mean.
    pub fn check(&self, file: &str) -> Result<()> {
        let owner = format!("{file}: goal");
        for (what, value) in [
            ("min_distance_m", self.min_distance_m),
            ("min_gap_m", self.min_gap_m),
            ("mean_distance_m[0]", self.mean_distance_m[0]),
        ] {
            bounds::zero_or_more(&owner, what, value, "metres")?;
        }
        let [least, most] = self.mean_distance_m;
        if most.is_nan() || most <= least {
            let found = format!("[{least}, {most}]");
            return Err(Error::invalid(owner, "mean_distance_m", found, "a lower bound below the upper one"));
        }
        if let Some(gripper) = &self.gripper {
            gripper.check(&owner)?;
        }
        if self.target.is_none() && self.min_distance_m >= most {
            let found = format!("{} with a mean below {most}", self.min_distance_m);
            let needed = "a least distance below the largest mean";
            return Err(Error::invalid(owner, "min_distance_m", found, needed));
        }
        Ok(())
    }
}
