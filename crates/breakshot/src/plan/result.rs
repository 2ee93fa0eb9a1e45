//! The result of planning: the strike, its prediction, its robustness, and the search that led to it.

use super::options::Method;
use crate::geometry::Pose;
use crate::properties::Assumption;
use crate::scene::{Scene, Strike};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How the search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The strike fulfils the goal in simulation, or the pile fulfils it without one.
    Found,
    /// The best strike does not fulfil the goal; the reason names what is missing.
    BestEffort,
    /// No strike is possible.
    Unreachable,
}

/// The motion of a struck, free object relative to the striker (Eq. 27 and 28).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Contact {
    /// The object leaves the striker, which stops before it catches up with it.
    #[default]
    Scattering,
    /// The striker catches up with the object and pushes it.
    Pushing,
}

/// The strike, its prediction, and why it was chosen (`plan.json`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Plan {
    /// The file format's version.
    pub version: u32,
    /// The algorithm.
    pub method: Method,
    /// How the search ended.
    pub outcome: Outcome,
    /// The reason for the outcome, a sentence.
    pub reason: String,
    /// The scene that was planned for.
    pub scene: Scene,
    /// The arm that can execute the strike within its limits; none where the cell has no arm of known base pose or it was left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arm: Option<String>,
    /// The strike; none if the goal is unreachable or already fulfilled.
    pub strike: Option<Strike>,
    /// The predicted result; none if unreachable.
    pub prediction: Option<Prediction>,
    /// The steps of the search.
    pub iterations: Vec<Iteration>,
    /// Success probability and its explanation (`Robust`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robustness: Option<Robustness>,
    /// Properties that no clip measured, with the values that were used.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumed: Vec<Assumption>,
    /// What would increase the success probability, the most helpful change first; only if no strike was found and
    /// [`Options::remedies`](super::Options::remedies) is set.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remedies: Vec<Remedy>,
    /// The strikes that follow if each has exactly its predicted result; only where more than one was asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub then: Vec<Strike>,
}

impl Plan {
    /// A plan without strike, prediction and reason.
    pub(crate) fn unreachable(scene: &Scene, method: Method) -> Self {
        Self {
            version: 1,
            method,
            outcome: Outcome::Unreachable,
            reason: String::new(),
            scene: scene.clone(),
            arm: None,
            strike: None,
            prediction: None,
            iterations: Vec::new(),
            robustness: None,
            assumed: Vec::new(),
            remedies: Vec::new(),
            then: Vec::new(),
        }
    }
}

/// The predicted result of a strike, with the properties at their means.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Prediction {
    /// The pose of every object at rest.
    #[serde(rename = "final")]
    pub final_poses: BTreeMap<String, Pose>,
    /// The least distance between two centres (m); none for a single object.
    pub min_distance_m: Option<f64>,
    /// The mean distance over all pairs (m); none for a single object.
    pub mean_distance_m: Option<f64>,
    /// The probability that the goal is fulfilled (`Robust`).
    pub success_probability: Option<f64>,
}

/// One simulated strike of the search.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Iteration {
    /// The strike.
    pub strike: Strike,
    /// Whether the object leaves the striker or is pushed.
    pub contact: Contact,
    /// The least distance between two centres after it (m); none for a single object.
    pub min_distance_m: Option<f64>,
    /// The mean distance over all pairs after it (m); none for a single object.
    pub mean_distance_m: Option<f64>,
    /// Whether it fulfils the goal.
    pub fulfilled: bool,
}

/// The success probability of a strike and its explanation (`plan.json`).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Robustness {
    /// Fraction of the scenarios in which the strike fulfils the goal.
    pub success_probability: f64,
    /// Standard error of that fraction.
    pub standard_error: f64,
    /// Number of scenarios.
    pub samples: usize,
    /// Number of simulations of the whole search.
    #[serde(default)]
    pub rollouts: usize,
    /// Mean number of singulated objects.
    pub expected_singulated: f64,
    /// The best strike of another kind.
    pub runner_up: Option<RunnerUp>,
    /// The violated conditions, the most frequent first.
    pub failures: Vec<Failure>,
    /// The sources of uncertainty, the one with the largest gain first.
    #[serde(rename = "doubts")]
    pub sensitivities: Vec<Sensitivity>,
    /// Final poses of each object in the first scenarios.
    #[serde(rename = "cloud")]
    pub final_poses: BTreeMap<String, Vec<Pose>>,
    /// Seed of all random draws.
    pub seed: u64,
}

/// A clearly different strike and its success probability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RunnerUp {
    /// The strike.
    pub strike: Strike,
    /// Fraction of the scenarios in which it fulfils the goal.
    pub success_probability: f64,
}

/// A condition of the goal that fails in some scenarios.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Failure {
    /// What happens, a phrase.
    pub what: String,
    /// Fraction of the scenarios in which this condition fails by most.
    #[serde(rename = "part")]
    pub fraction: f64,
}

/// The gain in success probability if one source of uncertainty were removed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Sensitivity {
    /// The source.
    pub source: Source,
    /// Increase of the success probability of this strike; negative if it decreases.
    pub gain: f64,
}

/// A change of the scene, the striker, the number of strikes or what is known, and the success probability with it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Remedy {
    /// The change, a phrase.
    pub change: String,
    /// Success probability of a strike with this change (of both strikes for a second one).
    pub success_probability: f64,
}

impl Remedy {
    pub(crate) fn new(change: impl Into<String>, success_probability: f64) -> Self {
        Self { change: change.into(), success_probability }
    }
}

/// A source of uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The poses of the objects.
    Poses,
    /// The speed and heading of the strike.
    Strike,
    /// Friction against the table.
    Friction,
    /// Restitution of all pairs, the striker included.
    Restitution,
    /// Mass ratios.
    Masses,
    /// Contact friction, tangential restitution, and the law of simultaneous impacts.
    Contacts,
}

impl Source {
    pub(crate) const ALL: [Self; 6] =
        [Self::Poses, Self::Strike, Self::Friction, Self::Restitution, Self::Masses, Self::Contacts];

    /// The source in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Poses => "the poses of the objects",
            Self::Strike => "the strike's speed and heading",
            Self::Friction => "friction on the table",
            Self::Restitution => "restitution",
            Self::Masses => "mass ratios",
            Self::Contacts => "contact friction, tangential restitution and the law of simultaneous impacts",
        }
    }
}
