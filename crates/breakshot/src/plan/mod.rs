//! Which strike singulates the pile?
//!
//! Section 5 of the paper (Fig. 11): strike the largest object centrally from an accessible direction, simulate, and
//! feed the distances back into the strike's speed until Eq. 35 and 36 hold.

use crate::error::Result;
use crate::geometry::Pose;
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Which algorithm plans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The paper's feedback on the speed.
    #[default]
    Paper,
}

/// How to plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Which algorithm.
    pub method: Method,
}

/// How the search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The strike fulfils the goal in simulation.
    Found,
    /// The best strike there is does not; the reason says what is missing.
    BestEffort,
    /// No strike is possible.
    Unreachable,
}

/// The strike, what it is expected to do, and why it was chosen (`plan.json`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// The file format's version.
    pub version: u32,
    /// Which algorithm planned.
    pub method: Method,
    /// How the search ended.
    pub outcome: Outcome,
    /// Why, in words.
    pub reason: String,
    /// What it was planned for.
    pub scene: Scene,
    /// What the robot shall do; none if unreachable.
    pub strike: Option<Strike>,
    /// What is expected then; none if unreachable.
    pub prediction: Option<Prediction>,
    /// The search, step by step.
    pub iterations: Vec<Iteration>,
}

/// What a strike is expected to do.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// Where every object comes to rest.
    #[serde(rename = "final")]
    pub final_poses: BTreeMap<String, Pose>,
    /// Least distance between two centres (m).
    pub min_distance_m: f64,
    /// Mean distance over all pairs (m).
    pub mean_distance_m: f64,
    /// How likely it fulfils the goal, where the method can tell.
    pub success_probability: Option<f64>,
}

/// One step of the search.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Iteration {
    /// The strike tried.
    pub strike: Strike,
    /// Least distance between two centres after it (m).
    pub min_distance_m: f64,
    /// Mean distance over all pairs after it (m).
    pub mean_distance_m: f64,
    /// Whether it fulfils the goal.
    pub fulfilled: bool,
}

/// Plans the strike that singulates the pile.
///
/// # Errors
/// A scene that cannot be simulated; that no strike works is an answer, not an error.
pub fn plan(_scene: &Scene, _properties: &Properties, _options: &Options) -> Result<Plan> {
    todo!()
}
