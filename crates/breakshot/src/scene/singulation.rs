//! Is the pile singulated?  Pairwise distances, Eq. 35 and 36, and the conditions of the goal that fail.

use crate::error::Result;
use crate::geometry::{Point, Pose};
pub use crate::scene::goal_margin::Area;
use crate::scene::goal_margin::{Condition, Evaluated, GoalEvaluator, Placement};
use crate::scene::{STILL_M, Scene};
use crate::statistics::sorted_by_value;
use std::collections::BTreeMap;
use std::fmt;

/// The distances between the objects of a scene, and what its goal lacks.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Singulation {
    /// Every pair, in alphabetical order.
    pub pairs: Vec<Pair>,
    /// The objects outside the workspace, off the table or in a keep-out area, independent of the goal's conditions on these
    /// areas.
    pub misplaced: Vec<Misplaced>,
    /// The objects that the goal's gripper cannot grasp.
    pub out_of_grasp: Vec<OutOfGrasp>,
    /// The displacement of each object that must not move.
    pub moved: Vec<Moved>,
    violations: Vec<Violation>,
}

/// Two objects and the distance between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// The first in the alphabet.
    pub a: String,
    /// The other.
    pub b: String,
    /// Between the centres (m).
    pub distance_m: f64,
    /// Between the outlines (m), negative if they overlap; none where the yaw of an object is unknown.
    pub gap_m: Option<f64>,
}

/// An object in the wrong area.
#[derive(Clone, Debug, PartialEq)]
pub struct Misplaced {
    /// The object.
    pub object: String,
    /// Which area.
    pub area: Area,
    /// Distance of its centre from the workspace or the table (m); for a keep-out area about how far it reaches in.
    pub by_m: f64,
}

/// An object that the goal's gripper cannot grasp without touching another.
#[derive(Clone, Debug, PartialEq)]
pub struct OutOfGrasp {
    /// The object.
    pub object: String,
    /// Clearance that the best grasp lacks (m).
    pub lacks_m: f64,
}

/// An object that must not move.
#[derive(Clone, Debug, PartialEq)]
pub struct Moved {
    /// The object.
    pub object: String,
    /// Displacement of its centre (m).
    pub by_m: f64,
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
        /// The least distance required (m).
        wanted_m: f64,
    },
    /// The outlines of two objects are too close.
    Narrow {
        /// The pair.
        pair: [String; 2],
        /// Their gap (m).
        gap_m: f64,
        /// The least gap required (m).
        wanted_m: f64,
    },
    /// Eq. 35, lower bound: the mean distance is too small.
    Dense {
        /// The mean distance (m).
        mean_m: f64,
        /// The least mean required (m).
        wanted_m: f64,
    },
    /// Eq. 35, upper bound: the mean distance is too large.
    Wide {
        /// The mean distance (m).
        mean_m: f64,
        /// The mean has to be below (m).
        wanted_m: f64,
    },
    /// An object is in the wrong area.
    Misplaced(Misplaced),
    /// The gripper cannot grasp an object.
    OutOfGrasp(OutOfGrasp),
    /// An object that must not move was moved.
    Moved(Moved),
    /// The objects still move: their simulation was given up.
    Unfinished {
        /// The time until then (s).
        after_s: f64,
    },
}

impl Violation {
    /// The difference between the value found and the value required (m), never negative; infinite where no value was found.
    pub fn shortfall_m(&self) -> f64 {
        match self {
            Self::Close { distance_m: found, wanted_m, .. }
            | Self::Narrow { gap_m: found, wanted_m, .. }
            | Self::Dense { mean_m: found, wanted_m }
            | Self::Wide { mean_m: found, wanted_m } => (wanted_m - found).abs(),
            Self::Misplaced(misplaced) => misplaced.by_m,
            Self::OutOfGrasp(out) => out.lacks_m,
            Self::Moved(moved) => moved.by_m,
            Self::Unfinished { .. } => f64::INFINITY,
        }
    }

    /// Whether the objects moved too far, as opposed to not far enough.
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
            Self::Unfinished { after_s } => {
                write!(f, "the objects still move after {after_s:.3} s, when the simulation was given up")
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
    /// A name without an entry among the scene's objects.
    ///
    /// # Examples
    /// ```
    /// use breakshot::cell::{Cell, Striker, Workspace};
    /// use breakshot::object::{Object, Shape};
    /// use breakshot::{geometry::Point, scene::{Placed, Scene, singulation::Singulation}};
    ///
    /// let cell = Cell::from_above(1000.0, Workspace::centred([0.6, 0.6]), Striker::rod(0.015, [0.05, 1.0]));
    /// let disc = |name: &str| Object { name: name.into(), shape: Shape::Disc { radius_m: 0.03 }, height_m: 0.03, marker: None, mass_kg: None, support: None };
    /// let placed = |object: &str, x_m| Placed { object: object.into(), position_m: Point::new(x_m, 0.0), yaw_rad: 0.0 };
    /// let scene = Scene::new(cell, vec![disc("a"), disc("b")], vec![placed("a", 0.0), placed("b", 0.08)])?;
    /// let poses = scene.placed.iter().map(|p| (p.object.clone(), p.pose())).collect();
    /// let singulation = Singulation::of(&scene, &poses)?;
    /// assert!((singulation.min_distance_m().unwrap() - 0.08).abs() < 1e-12); // m
    /// assert_eq!(singulation.violations().len(), 2); // 90 mm between the two and 150 mm on average are required
    /// # Ok::<(), breakshot::Error>(())
    /// ```
    pub fn of(scene: &Scene, poses: &BTreeMap<String, Pose>) -> Result<Self> {
        let observed = poses.iter().map(|(name, pose)| (name.as_str(), pose.position, Some(pose.yaw_rad)));
        Self::of_poses(scene, observed)
    }

    /// The same for objects of which some have an unknown yaw: name, centre, yaw (rad).
    ///
    /// Without a yaw an object that is no disc has no gap to others and no grasp; keep-out areas are checked with its centre.
    ///
    /// # Errors
    /// A name without an entry among the scene's objects.
    pub fn of_poses<'a>(
        scene: &Scene,
        poses: impl Iterator<Item = (&'a str, Point, Option<f64>)>,
    ) -> Result<Self> {
        let mut placed: Vec<(&str, Placement)> =
            poses.map(|(name, position, yaw_rad)| (name, Placement { position, yaw_rad })).collect();
        placed.sort_unstable_by_key(|(name, _)| *name);
        let evaluator = GoalEvaluator::of_objects(scene, placed.iter().map(|(name, _)| *name))?;
        let outlines: Vec<_> =
            placed.iter().enumerate().map(|(k, (_, at))| evaluator.outline(k, *at)).collect();
        let name = |k: usize| placed[k].0.to_owned();
        let mut pairs = Vec::new();
        for a in 0..placed.len() {
            for b in a + 1..placed.len() {
                let gap_m = outlines[a].as_ref().zip(outlines[b].as_ref()).map(|(a, b)| a.gap_m(b));
                let distance_m = placed[a].1.position.distance(placed[b].1.position);
                pairs.push(Pair { a: name(a), b: name(b), distance_m, gap_m });
            }
        }
        let mut found = Self {
            pairs,
            misplaced: Vec::new(),
            out_of_grasp: Vec::new(),
            moved: Vec::new(),
            violations: Vec::new(),
        };
        evaluator.evaluate(&outlines, |k| placed[k].1, |evaluated| found.take(scene, evaluated, name));
        found.violations = sorted_by_value(found.violations, |violation| -violation.shortfall_m());
        Ok(found)
    }

    /// Reports a condition of the goal under the objects' names.
    fn take(&mut self, scene: &Scene, evaluated: Evaluated, name: impl Fn(usize) -> String) {
        let Evaluated { condition, found_m, margin_m, required } = evaluated;
        if let Condition::Moved(k) = condition {
            self.moved.push(Moved { object: name(k), by_m: found_m });
        }
        if margin_m >= 0.0 {
            return;
        }
        let goal = &scene.goal;
        let violation = match condition {
            Condition::Close([a, b]) => Violation::Close {
                pair: [name(a), name(b)],
                distance_m: found_m,
                wanted_m: goal.min_distance_m,
            },
            Condition::Narrow([a, b]) => {
                Violation::Narrow { pair: [name(a), name(b)], gap_m: found_m, wanted_m: goal.min_gap_m }
            }
            Condition::Dense => Violation::Dense { mean_m: found_m, wanted_m: goal.mean_distance_m[0] },
            Condition::Wide => Violation::Wide { mean_m: found_m, wanted_m: goal.mean_distance_m[1] },
            Condition::Position(k, area) => {
                let misplaced = Misplaced { object: name(k), area, by_m: found_m };
                self.misplaced.push(misplaced.clone());
                Violation::Misplaced(misplaced)
            }
            Condition::Grasp(k) => {
                let out = OutOfGrasp { object: name(k), lacks_m: found_m };
                self.out_of_grasp.push(out.clone());
                Violation::OutOfGrasp(out)
            }
            Condition::Moved(k) => Violation::Moved(Moved { object: name(k), by_m: found_m }),
            Condition::Nothing => return,
        };
        if required {
            self.violations.push(violation);
        }
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

    /// Every condition of the scene's goal that does not hold, the largest shortfall first.
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Cell, Workspace};
    use crate::object::{Marker, Object, Shape};
    use crate::scene::{Goal, KeepOut};

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

    fn at(poses: &[(&str, f64, f64)]) -> BTreeMap<String, Pose> {
        poses.iter().map(|&(name, x, y)| (name.to_owned(), Pose::new(x, y, 0.0))).collect()
    }

    #[test]
    fn distances_are_between_centres_and_gaps_between_outlines() {
        let poses = at(&[("b", 0.1, 0.0), ("a", 0.0, 0.0), ("a#2", 0.0, 0.2)]);
        let found = Singulation::of(&scene(), &poses).expect("known objects");
        let names: Vec<_> = found.pairs.iter().map(|p| format!("{}-{}", p.a, p.b)).collect();
        assert_eq!(names, ["a-a#2", "a-b", "a#2-b"]);
        assert!((found.min_distance_m().expect("pairs") - 0.1).abs() < 1e-15);
        let mean_m = (0.2 + 0.1 + 0.05f64.sqrt()) / 3.0;
        assert!((found.mean_distance_m().expect("pairs") - mean_m).abs() < 1e-15);
        assert!((found.pairs[1].gap_m.expect("a gap") - 0.05).abs() < 1e-15);
        assert!(found.violations().is_empty());
    }

    #[test]
    fn every_violated_condition_is_described_with_its_number() {
        let close =
            Singulation::of(&scene(), &at(&[("a", 0.0, 0.0), ("b", 0.06, 0.0)])).expect("known objects");
        let words: Vec<_> = close.violations().iter().map(ToString::to_string).collect();
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
        let words: Vec<_> = far.violations().iter().map(ToString::to_string).collect();
        assert_eq!(words, ["a leaves the workspace by 50.0 mm"]);
    }

    #[test]
    fn the_mean_has_to_be_below_its_upper_bound() {
        let goal = Goal { mean_distance_m: [0.1, 0.2], ..Goal::default() };
        let scene = Scene { goal, ..scene() };
        for (x_m, fulfilled) in [(0.2 - 1e-9, true), (0.2, false), (0.1, true), (0.1 - 1e-9, false)] {
            let found = Singulation::of(&scene, &at(&[("a", 0.0, 0.0), ("b", x_m, 0.0)])).expect("known");
            assert_eq!(found.violations().is_empty(), fulfilled, "{x_m} m");
        }
    }

    #[test]
    fn an_outline_may_not_enter_a_keep_out_area() {
        let mut scene = scene();
        let points_m = [[0.0, 0.1], [0.2, 0.1], [0.2, 0.2], [0.0, 0.2]].map(Point::from).to_vec();
        scene.keep_out = vec![KeepOut { points_m }];
        for (y_m, enters) in [(0.069, false), (0.075, true), (0.15, true)] {
            let found = Singulation::of(&scene, &at(&[("a", 0.1, y_m)])).expect("known");
            assert_eq!(!found.violations().is_empty(), enters, "{y_m} m");
        }
    }

    #[test]
    fn a_single_object_has_no_distances_and_violates_none() {
        let alone = Singulation::of(&scene(), &at(&[("a", 0.0, 0.0)])).expect("known");
        assert_eq!((alone.min_distance_m(), alone.mean_distance_m()), (None, None));
        assert!(alone.violations().is_empty());
    }
}
