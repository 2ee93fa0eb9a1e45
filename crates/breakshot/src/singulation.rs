//! Is the pile singulated?  Pairwise distances, Eq. 35 and 36, and what they lack to the goal.

use crate::error::Result;
use crate::geometry::{Point, Pose};
use crate::object::Shape;
use crate::outline::Outline;
use crate::scene::{Goal, STILL_M, Scene};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// How far apart the objects of a scene lie.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Singulation {
    /// Every pair, in alphabetical order.
    pub pairs: Vec<Pair>,
    /// Where a centre or an outline is where it should not be.
    pub misplaced: Vec<Misplaced>,
    /// Whom the goal's gripper cannot take.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub out_of_grasp: Vec<OutOfGrasp>,
    /// How far the objects that must lie still were moved.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub moved: Vec<Moved>,
}

/// Two objects and the way between them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// The first in the alphabet.
    pub a: String,
    /// The other.
    pub b: String,
    /// From centre to centre (m).
    pub distance_m: f64,
    /// Between the outlines (m), negative if they overlap; unknown where it is unknown how an object is turned.
    pub gap_m: Option<f64>,
}

/// An object that is where it should not be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Misplaced {
    /// The object.
    pub object: String,
    /// Which area.
    pub area: Area,
    /// How far its centre is outside the workspace or past the edge; about how deep it is in a keep-out area (m).
    pub by_m: f64,
}

/// An object that the goal's gripper cannot take without touching another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutOfGrasp {
    /// The object.
    pub object: String,
    /// How much room its fingers lack where they lack least (m).
    pub lacks_m: f64,
}

/// An object that must lie still, and how far it was moved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    /// The object.
    pub object: String,
    /// How far (m).
    pub by_m: f64,
}

/// An area with a rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Area {
    /// Its centre left the workspace.
    Workspace,
    /// Its centre is past the table's edge.
    Table,
    /// It entered a keep-out area.
    KeepOut,
}

/// One condition of the goal that does not hold.
#[derive(Clone, Debug, PartialEq)]
pub enum Violation {
    /// Eq. 36: two centres are too close.
    Close {
        /// The pair.
        pair: [String; 2],
        /// Their distance (m).
        distance_m: f64,
        /// The least one wanted (m).
        wanted_m: f64,
    },
    /// The outlines of two objects are too close.
    Narrow {
        /// The pair.
        pair: [String; 2],
        /// Their gap (m).
        gap_m: f64,
        /// The least one wanted (m).
        wanted_m: f64,
    },
    /// Eq. 35, lower bound: the mean distance is too small.
    Dense {
        /// The mean distance (m).
        mean_m: f64,
        /// The least one wanted (m).
        wanted_m: f64,
    },
    /// Eq. 35, upper bound: the mean distance is too large.
    Wide {
        /// The mean distance (m).
        mean_m: f64,
        /// The mean has to stay below (m).
        wanted_m: f64,
    },
    /// An object is where it should not be.
    Misplaced(Misplaced),
    /// The gripper cannot take an object.
    OutOfGrasp(OutOfGrasp),
    /// An object that must lie still was moved.
    Moved(Moved),
}

impl Violation {
    /// How much is missing (m).
    pub fn shortfall_m(&self) -> f64 {
        match self {
            Self::Close { distance_m: found, wanted_m, .. }
            | Self::Narrow { gap_m: found, wanted_m, .. }
            | Self::Dense { mean_m: found, wanted_m }
            | Self::Wide { mean_m: found, wanted_m } => (wanted_m - found).abs(),
            Self::Misplaced(misplaced) => misplaced.by_m,
            Self::OutOfGrasp(out) => out.lacks_m,
            Self::Moved(moved) => moved.by_m,
        }
    }

    /// Whether the objects went too far, not too short a way.
    pub fn is_excess(&self) -> bool {
        matches!(self, Self::Wide { .. } | Self::Misplaced(_) | Self::Moved(_))
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Close { pair: [a, b], distance_m, wanted_m } => {
                write!(
                    f,
                    "the centres of {a} and {b} are {} apart, {} wanted",
                    mm(*distance_m),
                    mm(*wanted_m)
                )
            }
            Self::Narrow { pair: [a, b], gap_m, .. } if *gap_m < 0.0 => write!(f, "{a} and {b} overlap"),
            Self::Narrow { pair: [a, b], gap_m, wanted_m } => {
                write!(f, "the gap between {a} and {b} is {}, {} wanted", mm(*gap_m), mm(*wanted_m))
            }
            Self::Dense { mean_m, wanted_m } => {
                write!(f, "the mean distance is {}, at least {} wanted", mm(*mean_m), mm(*wanted_m))
            }
            Self::Wide { mean_m, wanted_m } => {
                write!(f, "the mean distance is {}, below {} wanted", mm(*mean_m), mm(*wanted_m))
            }
            Self::Misplaced(Misplaced { object, area, by_m }) => match area {
                Area::Workspace => write!(f, "{object} leaves the workspace by {}", mm(*by_m)),
                Area::Table => write!(f, "{object} falls off the table"),
                Area::KeepOut => write!(f, "{object} enters a keep-out area"),
            },
            Self::OutOfGrasp(OutOfGrasp { object, .. }) => {
                write!(f, "the gripper finds no room around {object}")
            }
            Self::Moved(Moved { object, by_m }) => {
                write!(f, "{object} is moved by {}, at most {} wanted", mm(*by_m), mm(STILL_M))
            }
        }
    }
}

fn mm(length_m: f64) -> String {
    format!("{:.1} mm", length_m * 1e3)
}

impl Singulation {
    /// Of the objects of a scene at these poses.
    ///
    /// # Errors
    /// A name that the scene's objects do not know.
    pub fn of(scene: &Scene, poses: &BTreeMap<String, Pose>) -> Result<Self> {
        let places = poses.iter().map(|(name, pose)| (name.as_str(), pose.position, Some(pose.yaw_rad)));
        Self::of_places(scene, places)
    }

    /// The same for objects of which some are turned nobody knows how: name, centre, yaw (rad).
    ///
    /// # Errors
    /// A name that the scene's objects do not know.
    pub fn of_places<'a>(
        scene: &Scene,
        places: impl Iterator<Item = (&'a str, Point, Option<f64>)>,
    ) -> Result<Self> {
        let mut placed = places
            .map(|(name, position, yaw_rad)| {
                let shape = &scene.object(name)?.shape;
                // A disc looks the same however it is turned.
                let yaw_rad = yaw_rad.or(matches!(shape, Shape::Disc { .. }).then_some(0.0));
                let outline = yaw_rad.map(|yaw_rad| Outline::new(shape, Pose { position, yaw_rad }));
                Ok(Lying { name, position, yaw_rad, outline, radius_m: shape.outer_radius_m() })
            })
            .collect::<Result<Vec<_>>>()?;
        placed.sort_by(|one, other| one.name.cmp(other.name));
        let mut pairs = Vec::new();
        for (k, one) in placed.iter().enumerate() {
            for other in &placed[k + 1..] {
                let gap_m = one.outline.as_ref().zip(other.outline.as_ref()).map(|(a, b)| a.gap_m(b));
                let distance_m = one.position.distance(other.position);
                pairs.push(Pair { a: one.name.into(), b: other.name.into(), distance_m, gap_m });
            }
        }
        let misplaced = placed.iter().flat_map(|lying| lying.misplaced(scene)).collect();
        let out_of_grasp = out_of_grasp(scene, &placed)?;
        Ok(Self { pairs, misplaced, out_of_grasp, moved: moved(scene, &placed) })
    }

    /// The two objects whose centres are closest; none for fewer than two objects.
    pub fn closest(&self) -> Option<&Pair> {
        self.pairs.iter().min_by(|one, other| one.distance_m.total_cmp(&other.distance_m))
    }

    /// The least distance between two centres (m, Eq. 36); none for fewer than two objects.
    pub fn min_distance_m(&self) -> Option<f64> {
        self.closest().map(|pair| pair.distance_m)
    }

    /// The mean distance over all pairs (m, Eq. 35); none for fewer than two objects.
    pub fn mean_distance_m(&self) -> Option<f64> {
        let sum_m: f64 = self.pairs.iter().map(|pair| pair.distance_m).sum();
        (!self.pairs.is_empty()).then(|| sum_m / self.pairs.len() as f64)
    }

    /// Every condition of the goal that does not hold, the worst first.
    pub fn violations(&self, goal: &Goal) -> Vec<Violation> {
        let mut found = Vec::new();
        for Pair { a, b, distance_m, gap_m } in self.pairs.iter().filter(|p| goal.asks_of_pair(&p.a, &p.b)) {
            let pair = || [a.clone(), b.clone()];
            if *distance_m < goal.min_distance_m {
                found.push(Violation::Close {
                    pair: pair(),
                    distance_m: *distance_m,
                    wanted_m: goal.min_distance_m,
                });
            }
            if let Some(gap_m) = *gap_m
                && gap_m < goal.min_gap_m
                && goal.min_gap_m > 0.0
            {
                found.push(Violation::Narrow { pair: pair(), gap_m, wanted_m: goal.min_gap_m });
            }
        }
        if let Some(mean_m) = self.mean_distance_m()
            && goal.target.is_none()
        {
            let [least_m, most_m] = goal.mean_distance_m;
            if mean_m < least_m {
                found.push(Violation::Dense { mean_m, wanted_m: least_m });
            } else if mean_m >= most_m {
                found.push(Violation::Wide { mean_m, wanted_m: most_m });
            }
        }
        let counts = |m: &&Misplaced| m.area != Area::Workspace || goal.inside_workspace;
        found.extend(self.misplaced.iter().filter(counts).cloned().map(Violation::Misplaced));
        found.extend(self.out_of_grasp.iter().cloned().map(Violation::OutOfGrasp));
        found.extend(self.moved.iter().filter(|m| m.by_m > STILL_M).cloned().map(Violation::Moved));
        found.sort_by(|one, other| other.shortfall_m().total_cmp(&one.shortfall_m()));
        found
    }
}

/// Whom the goal's gripper cannot take, of those for whom it is known how all lie.
fn out_of_grasp(scene: &Scene, placed: &[Lying]) -> Result<Vec<OutOfGrasp>> {
    let Some(gripper) = &scene.goal.gripper else { return Ok(Vec::new()) };
    let mut found = Vec::new();
    for (k, lying) in placed.iter().enumerate().filter(|(_, lying)| scene.goal.asks_of(lying.name)) {
        let Some(yaw_rad) = lying.yaw_rad else { continue };
        let grasps = gripper.grasps(&scene.object(lying.name)?.shape);
        let others = placed.iter().enumerate().filter(|(other, _)| *other != k);
        let neighbours = others.filter_map(|(_, other)| other.outline.as_ref());
        let room_m = grasps.room_m(Pose { position: lying.position, yaw_rad }, neighbours);
        if room_m < 0.0 {
            found.push(OutOfGrasp { object: lying.name.into(), lacks_m: -room_m });
        }
    }
    Ok(found)
}

/// How far the objects that must lie still are from where the scene has them.
fn moved(scene: &Scene, placed: &[Lying]) -> Vec<Moved> {
    let by_m = |lying: &Lying| {
        let before = scene.placed.iter().find(|p| p.object == lying.name)?;
        Some(Moved { object: lying.name.into(), by_m: before.position_m.distance(lying.position) })
    };
    let still = |lying: &&Lying| scene.goal.keep_still.iter().any(|name| name == lying.name);
    placed.iter().filter(still).filter_map(by_m).collect()
}

/// An object on the table.
struct Lying<'a> {
    name: &'a str,
    position: Point,
    /// Unknown where it is unknown how the object is turned; any for a disc.
    yaw_rad: Option<f64>,
    /// Unknown where it is unknown how the object is turned.
    outline: Option<Outline>,
    radius_m: f64,
}

impl Lying<'_> {
    fn misplaced(&self, scene: &Scene) -> Vec<Misplaced> {
        let position = self.position;
        let mut found = Vec::new();
        let mut push = |area, by_m| found.push(Misplaced { object: self.name.into(), area, by_m });
        let workspace = &scene.cell.workspace;
        if !workspace.contains(position) {
            let past_m = |low: f64, value: f64, high: f64| (low - value).max(value - high).max(0.0);
            let dx_m = past_m(workspace.min_m.x, position.x, workspace.max_m.x);
            let dy_m = past_m(workspace.min_m.y, position.y, workspace.max_m.y);
            push(Area::Workspace, dx_m.hypot(dy_m));
        }
        if let Some(table) = &scene.cell.table {
            let top = Outline::polygon(&table.outline_m);
            if !top.contains(position) {
                push(Area::Table, top.border_distance_m(position));
            }
        }
        for area in &scene.keep_out {
            let area = Outline::polygon(&area.points_m);
            let inside = area.contains(position);
            if self.outline.as_ref().map_or(inside, |outline| area.gap_m(outline) < 0.0) {
                let border_m = area.border_distance_m(position);
                push(Area::KeepOut, (self.radius_m + if inside { border_m } else { -border_m }).max(0.0));
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Cell, Workspace};
    use crate::object::{Marker, Object};
    use crate::scene::KeepOut;

    fn scene() -> Scene {
        let cell = "[camera]\nscale_px_per_m = 1000.0\n[workspace]\nmin_m = [-0.3, -0.3]\nmax_m = [0.3, 0.3]\n\
                    [striker]\nshape = { disc = { radius_m = 0.015 } }\nheight_m = 0.08\nspeed_range_m_s = [0.05, 1.0]";
        let cell: Cell = toml::from_str(cell).expect("a cell");
        assert_eq!(cell.workspace, Workspace { min_m: Point::new(-0.3, -0.3), max_m: Point::new(0.3, 0.3) });
        let object = |name: &str, shape: Shape| Object {
            name: name.into(),
            marker: Some(Marker::centred(shape.clone())),
            shape,
            height_m: 0.03,
            mass_kg: None,
            support: None,
        };
        let objects = vec![
            object("a", Shape::Disc { radius_m: 0.03 }),
            object("b", Shape::Rectangle { size_m: [0.04, 0.04] }),
        ];
        let goal = Goal { min_gap_m: 0.02, ..Goal::default() };
        let (placed, walls) = (Vec::new(), Vec::new());
        Scene { cell, objects, observed_unix_s: None, placed, walls, keep_out: Vec::new(), goal }
    }

    fn at(places: &[(&str, f64, f64)]) -> BTreeMap<String, Pose> {
        places.iter().map(|&(name, x, y)| (name.to_owned(), Pose::new(x, y, 0.0))).collect()
    }

    #[test]
    fn distances_are_those_of_a_ruler() {
        let poses = at(&[("b", 0.1, 0.0), ("a", 0.0, 0.0), ("a#2", 0.0, 0.2)]);
        let found = Singulation::of(&scene(), &poses).expect("known objects");
        let names: Vec<_> = found.pairs.iter().map(|p| format!("{}-{}", p.a, p.b)).collect();
        assert_eq!(names, ["a-a#2", "a-b", "a#2-b"]);
        assert!((found.min_distance_m().expect("pairs") - 0.1).abs() < 1e-15);
        let mean_m = (0.2 + 0.1 + 0.05f64.sqrt()) / 3.0;
        assert!((found.mean_distance_m().expect("pairs") - mean_m).abs() < 1e-15);
        assert!((found.pairs[1].gap_m.expect("a gap") - 0.05).abs() < 1e-15);
        assert!(found.violations(&scene().goal).is_empty());
    }

    #[test]
    fn every_broken_condition_is_told_in_words_with_its_number() {
        let close =
            Singulation::of(&scene(), &at(&[("a", 0.0, 0.0), ("b", 0.06, 0.0)])).expect("known objects");
        let words: Vec<_> = close.violations(&scene().goal).iter().map(ToString::to_string).collect();
        assert_eq!(
            words,
            [
                "the mean distance is 60.0 mm, at least 150.0 mm wanted",
                "the centres of a and b are 60.0 mm apart, 90.0 mm wanted",
                "the gap between a and b is 10.0 mm, 20.0 mm wanted",
            ]
        );
        let far =
            Singulation::of(&scene(), &at(&[("a", -0.34, 0.33), ("b", 0.3, 0.0)])).expect("known objects");
        let words: Vec<_> = far.violations(&scene().goal).iter().map(ToString::to_string).collect();
        assert_eq!(words, ["a leaves the workspace by 50.0 mm"]);
    }

    #[test]
    fn the_mean_has_to_stay_below_its_upper_bound() {
        let goal = Goal { mean_distance_m: [0.1, 0.2], ..Goal::default() };
        for (x_m, fulfilled) in [(0.2 - 1e-9, true), (0.2, false), (0.1, true), (0.1 - 1e-9, false)] {
            let found = Singulation::of(&scene(), &at(&[("a", 0.0, 0.0), ("b", x_m, 0.0)])).expect("known");
            assert_eq!(found.violations(&goal).is_empty(), fulfilled, "{x_m} m");
        }
    }

    #[test]
    fn an_outline_may_not_enter_a_keep_out_area() {
        let mut scene = scene();
        let points_m = [[0.0, 0.1], [0.2, 0.1], [0.2, 0.2], [0.0, 0.2]].map(Point::from).to_vec();
        scene.keep_out = vec![KeepOut { points_m }];
        for (y_m, enters) in [(0.069, false), (0.075, true), (0.15, true)] {
            let found = Singulation::of(&scene, &at(&[("a", 0.1, y_m)])).expect("known");
            assert_eq!(!found.violations(&scene.goal).is_empty(), enters, "{y_m} m");
        }
    }

    #[test]
    fn a_single_object_has_no_distances_and_breaks_none() {
        let alone = Singulation::of(&scene(), &at(&[("a", 0.0, 0.0)])).expect("known");
        assert_eq!((alone.min_distance_m(), alone.mean_distance_m()), (None, None));
        assert!(alone.violations(&scene().goal).is_empty());
    }
}
