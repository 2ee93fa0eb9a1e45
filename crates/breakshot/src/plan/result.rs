//! What a plan is: the strike, what it is expected to do, and why it was chosen.

use super::options::Method;
use crate::geometry::Pose;
use crate::scene::{Scene, Strike};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How the search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The strike fulfils the goal in simulation, or the pile does without one.
    Found,
    /// The best strike there is does not; the reason says what is missing.
    BestEffort,
    /// No strike is possible.
    Unreachable,
}

/// How the striker meets a free object (Eq. 27 and 28).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Contact {
    /// The object leaves the striker and is not caught up within its stroke.
    #[default]
    Scattering,
    /// The striker catches the object up and pushes it.
    Pushing,
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
    /// What the robot shall do; none if unreachable, and if nothing needs to be done.
    pub strike: Option<Strike>,
    /// What is expected then; none if unreachable.
    pub prediction: Option<Prediction>,
    /// The search, step by step.
    pub iterations: Vec<Iteration>,
    /// How sure the plan is, and why; only `Robust` tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robustness: Option<Robustness>,
    /// The strikes that would follow if each did exactly what is expected of it; only where more than one was asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub then: Vec<Strike>,
}

/// What a strike is expected to do.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// Where every object comes to rest.
    #[serde(rename = "final")]
    pub final_poses: BTreeMap<String, Pose>,
    /// Least distance between two centres (m); none for a single object.
    pub min_distance_m: Option<f64>,
    /// Mean distance over all pairs (m); none for a single object.
    pub mean_distance_m: Option<f64>,
    /// How likely it fulfils the goal, where the method can tell.
    pub success_probability: Option<f64>,
}

/// One step of the search.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Iteration {
    /// The strike tried.
    pub strike: Strike,
    /// How the striker meets the object.
    pub contact: Contact,
    /// Least distance between two centres after it (m); none for a single object.
    pub min_distance_m: Option<f64>,
    /// Mean distance over all pairs after it (m); none for a single object.
    pub mean_distance_m: Option<f64>,
    /// Whether it fulfils the goal.
    pub fulfilled: bool,
}

/// How sure a robust plan is, and why (`plan.json`).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Robustness {
    /// The part of the possible worlds in which the strike fulfils the goal.
    pub success_probability: f64,
    /// One standard deviation of that part.
    pub standard_error: f64,
    /// On how many possible worlds it was judged.
    pub samples: usize,
    /// How many strikes were simulated and judged in all.
    #[serde(default)]
    pub rollouts: usize,
    /// How many objects are singulated, on average.
    pub expected_singulated: f64,
    /// The best strike that is clearly another one.
    pub runner_up: Option<RunnerUp>,
    /// What goes wrong where it goes wrong, the most frequent first.
    pub failures: Vec<Failure>,
    /// What it would bring to know one thing exactly, the most first.
    pub doubts: Vec<Doubt>,
    /// Where each object comes to rest in each of the first possible worlds.
    pub cloud: BTreeMap<String, Vec<Pose>>,
    /// The seed of all draws.
    pub seed: u64,
}

/// A clearly different strike that is nearly as good.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunnerUp {
    /// The strike.
    pub strike: Strike,
    /// The part of the possible worlds in which it fulfils the goal.
    pub success_probability: f64,
}

/// One way to fail.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// What happens, in words.
    pub what: String,
    /// In which part of the possible worlds it is the worst that happens.
    pub part: f64,
}

/// What it would bring to know one thing exactly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Doubt {
    /// What is not known exactly.
    pub source: Source,
    /// By how much the success probability of this strike would grow.
    pub gain: f64,
}

/// Where doubt comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Where the objects lie.
    Poses,
    /// The strike's speed and heading.
    Strike,
    /// Friction against the table.
    Friction,
    /// Restitution of all pairs, the striker included.
    Restitution,
    /// Mass ratios.
    Masses,
    /// Contact friction, and how touching objects share an impact.
    Contacts,
}

impl Source {
    pub(crate) const ALL: [Self; 6] =
        [Self::Poses, Self::Strike, Self::Friction, Self::Restitution, Self::Masses, Self::Contacts];

    /// What it is, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Poses => "where the objects lie",
            Self::Strike => "the strike's speed and heading",
            Self::Friction => "friction on the table",
            Self::Restitution => "restitution",
            Self::Masses => "mass ratios",
            Self::Contacts => "contact friction, and how touching objects share an impact",
        }
    }
}
