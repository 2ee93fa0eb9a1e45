//! The result of the comparison: the contents of `report.json`.

use super::observed::ObservedPose;
use crate::geometry::Pose;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The predicted outcome of a strike compared with the observed one: `report.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Report {
    /// The file format's version.
    pub version: u32,
    /// The name of the film.
    pub video: String,
    /// The observed pose of every object before the strike.
    pub before: BTreeMap<String, ObservedPose>,
    /// The observed pose of every object at rest after the strike.
    pub observed: BTreeMap<String, ObservedPose>,
    /// The predicted pose of every object at rest after the strike.
    pub predicted: BTreeMap<String, Pose>,
    /// The distances of all pairs, in alphabetical order.
    pub pairs: Vec<PairDifference>,
    /// The errors of all objects, in alphabetical order.
    pub objects: Vec<ObjectDifference>,
    /// The errors over all pairs, pairs of discs, and pairs with other shapes.
    pub summary: Summary,
    /// Whether the goal was reached.
    pub goal: GoalChecks,
    /// The tracker's warnings and deviations of the scene file from the film.
    pub warnings: Vec<String>,
    /// Film and simulation on one time axis ([`Report::align`]); none where that was not asked for, and where the struck object moves in
    /// only one of them.
    #[serde(default)]
    pub alignment: Option<Alignment>,
}

/// A film and a simulation of the same strike on one time axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Alignment {
    /// The object that is struck first: where it has moved by as much in the film as in the simulation, the times are equal.
    pub object: String,
    /// Time of the film at which the simulated striker starts (s).
    pub start_s: f64,
    /// Where objects leave their simulated motion for good, in the order of time.
    pub divergences: Vec<Divergence>,
}

/// Where an object leaves its simulated motion by more than 2 mm and does not come back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Divergence {
    /// The object.
    pub object: String,
    /// Time of the first such frame (s after the striker starts).
    pub time_s: f64,
    /// Distance between the observed and the simulated position in that frame (m).
    pub distance_m: f64,
    /// The last simulated impact of the object before that; none if the simulation has none.
    pub last_impact: Option<SimulatedImpact>,
}

/// An impact of a simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SimulatedImpact {
    /// Time (s after the striker starts).
    pub time_s: f64,
    /// The two bodies.
    pub bodies: Vec<String>,
}

/// The distance of two objects after the strike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct PairDifference {
    /// The object whose name comes first in alphabetical order.
    pub a: String,
    /// The other object.
    pub b: String,
    /// Observed distance between the centres (m).
    pub observed_m: f64,
    /// Predicted distance between the centres (m).
    pub predicted_m: f64,
    /// Predicted minus observed distance (m).
    pub difference_m: f64,
    /// Whether both objects are discs: the paper lists discs and general shapes separately.
    pub discs: bool,
}

/// The displacement and the final pose of one object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ObjectDifference {
    /// The object's name.
    pub object: String,
    /// Distance from the position in the scene file to the observed one before the strike (m).
    pub placement_error_m: f64,
    /// Observed distance between the positions before and after the strike (m).
    #[serde(rename = "observed_way_m")]
    pub observed_displacement_m: f64,
    /// Predicted distance between the positions before and after the strike (m).
    #[serde(rename = "predicted_way_m")]
    pub predicted_displacement_m: f64,
    /// Distance between the predicted and the observed final position (m).
    pub position_error_m: f64,
    /// Predicted minus observed final yaw (rad, counter-clockwise positive), modulo the symmetry of the marker; none
    /// where the marker shows no yaw.
    pub yaw_error_rad: Option<f64>,
}

/// The errors of all pairs and all objects.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Summary {
    /// All pairs; none for fewer than two objects.
    pub all: Option<DistanceErrors>,
    /// The pairs of two discs.
    pub discs: Option<DistanceErrors>,
    /// The pairs with at least one object that is not a disc.
    pub general: Option<DistanceErrors>,
    /// Mean distance between predicted and observed final positions (m).
    pub mean_position_error_m: f64,
    /// Largest distance between a predicted and an observed final position (m).
    pub worst_position_error_m: f64,
}

/// Absolute differences between predicted and observed pairwise distances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct DistanceErrors {
    /// The number of pairs.
    pub pairs: usize,
    /// Mean of the absolute differences (m).
    pub mean_m: f64,
    /// Largest absolute difference (m).
    pub worst_m: f64,
    /// Mean absolute difference over mean observed distance.
    pub relative: f64,
}

/// The goal (Eq. 35 and 36), checked on the observed and on the predicted final poses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct GoalChecks {
    /// The check of the observed poses.
    pub observed: GoalCheck,
    /// The check of the predicted poses.
    pub predicted: GoalCheck,
}

/// Whether the goal holds, and which conditions are violated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct GoalCheck {
    /// Whether every condition holds.
    pub fulfilled: bool,
    /// Least distance between two centres (m, Eq. 36); none for fewer than two objects.
    pub min_distance_m: Option<f64>,
    /// Mean distance over all pairs (m, Eq. 35); none for fewer than two objects.
    pub mean_distance_m: Option<f64>,
    /// The violated conditions, the largest violation first.
    pub violations: Vec<String>,
}

impl Divergence {
    /// The distance from which on an object has left its simulated motion (m): at 1 m/s it covers it in 2 ms, a tenth of a frame at 50 Hz,
    /// to which film and simulation can be set to the same time.
    pub const LEAST_M: f64 = 2e-3;
}

impl Report {
    /// The pairwise distances as CSV with the columns `a,b,observed_m,predicted_m,difference_m,shapes`.
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
