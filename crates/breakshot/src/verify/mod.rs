//! Did it happen as predicted?
//!
//! Section 6 of the paper: pairwise distances after the strike, filmed beside simulated (Fig. 17).
//!
//! The prediction starts from where the scene says that the objects lie, as the plan did; the film's first frames tell
//! how far that was from the truth, and a warning says so where it matters.

mod compare;
mod observed;

pub use observed::{Observed, Seen};

use crate::error::Result;
use crate::geometry::Pose;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Predicted against observed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The file format's version.
    pub version: u32,
    /// The film.
    pub video: String,
    /// Where every object lay before the strike, as filmed.
    pub before: BTreeMap<String, Seen>,
    /// Where it came to rest, as filmed.
    pub observed: BTreeMap<String, Seen>,
    /// Where it was predicted to come to rest.
    pub predicted: BTreeMap<String, Pose>,
    /// Every pair, in alphabetical order.
    pub pairs: Vec<PairDifference>,
    /// Every object, in alphabetical order.
    pub objects: Vec<ObjectDifference>,
    /// All pairs together, pairs of discs, pairs with other shapes.
    pub summary: Summary,
    /// Whether the goal was reached.
    pub goal: Goals,
    /// What the reader should know.
    pub warnings: Vec<String>,
}

/// The distance of two objects after the strike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairDifference {
    /// The first in the alphabet.
    pub a: String,
    /// The other.
    pub b: String,
    /// From centre to centre, as filmed (m).
    pub observed_m: f64,
    /// From centre to centre, as predicted (m).
    pub predicted_m: f64,
    /// Predicted less observed (m).
    pub difference_m: f64,
    /// Whether both are discs: the paper tells them apart from general shapes.
    pub discs: bool,
}

/// One object's place after the strike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectDifference {
    /// The object.
    pub object: String,
    /// From where the scene says that it lay to where the film saw it before the strike (m).
    pub placement_error_m: f64,
    /// From before to after the strike, as filmed (m).
    pub observed_way_m: f64,
    /// From before to after the strike, as predicted (m).
    pub predicted_way_m: f64,
    /// From where it was predicted to where it came to rest (m).
    pub position_error_m: f64,
    /// How much further counter-clockwise it was predicted than it came to rest (rad), as far as its marker can tell.
    pub yaw_error_rad: Option<f64>,
}

/// The differences in a few numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// All pairs; none for fewer than two objects.
    pub all: Option<Spread>,
    /// Pairs of discs.
    pub discs: Option<Spread>,
    /// Pairs of which one at least is no disc.
    pub general: Option<Spread>,
    /// Mean distance between predicted and observed places (m).
    pub mean_position_error_m: f64,
    /// The largest of them (m).
    pub worst_position_error_m: f64,
}

/// Differences of pairwise distances, without their sign.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// How many pairs.
    pub pairs: usize,
    /// Mean (m).
    pub mean_m: f64,
    /// The largest (m).
    pub worst_m: f64,
    /// Mean over the mean observed distance.
    pub relative: f64,
}

/// Eq. 35 and 36 in both worlds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Goals {
    /// As filmed.
    pub observed: GoalCheck,
    /// As predicted.
    pub predicted: GoalCheck,
}

/// Whether the goal holds, and why not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GoalCheck {
    /// Whether every condition holds.
    pub fulfilled: bool,
    /// Least distance between two centres (m, Eq. 36); none for fewer than two objects.
    pub min_distance_m: Option<f64>,
    /// Mean distance over all pairs (m, Eq. 35); none for fewer than two objects.
    pub mean_distance_m: Option<f64>,
    /// The conditions that do not hold, the worst first.
    pub violations: Vec<String>,
}

/// Where the objects of a scene were predicted to come to rest, against where the film saw them.
///
/// # Errors
/// An object of the scene that was not predicted or not filmed.
pub fn comparison(scene: &Scene, predicted: &BTreeMap<String, Pose>, observed: &Observed) -> Result<Report> {
    compare::report(scene, predicted, observed)
}

impl Report {
    /// The pairwise distances as a table: `a,b,observed_m,predicted_m,difference_m,shapes`.
    pub fn csv(&self) -> String {
        let line = |pair: &PairDifference| {
            let shapes = if pair.discs { "discs" } else { "general" };
            let PairDifference { a, b, observed_m, predicted_m, difference_m, .. } = pair;
            format!("{a},{b},{observed_m:.6},{predicted_m:.6},{difference_m:.6},{shapes}\n")
        };
        let head = "a,b,observed_m,predicted_m,difference_m,shapes\n".to_owned();
        self.pairs.iter().fold(head, |table, pair| table + &line(pair))
    }
}
