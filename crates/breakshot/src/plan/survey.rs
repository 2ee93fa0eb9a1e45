//! What is the success probability of strikes over the whole grid?  A map of a scene, and training data for models that propose strikes.

use super::arm::{CellArm, laws_with};
use super::options::{Aim, Options};
use super::robust::evaluate::{Evaluation, expected_singulated, success_probability};
use super::robust::scenarios::{Draws, Nominal, Scenario};
use super::robust::strike_grid::{GridSpacing, StrikeCandidate, StrikeGrid};
use crate::error::{Error, Result};
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use serde::{Deserialize, Serialize};

/// How many strikes of the grid are evaluated, and in how many scenarios each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridSize {
    /// Greatest number of strikes; more are thinned uniformly.
    pub strikes: usize,
    /// Number of scenarios.
    pub samples: usize,
}

/// The evaluated strikes of a scene, and how they were evaluated (`breakshot plan --survey`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Survey {
    /// The file format's version.
    pub version: u32,
    /// Scenarios in which each strike was simulated.
    pub samples: usize,
    /// Seed of all random draws.
    pub seed: u64,
    /// The strikes, in the order of the grid.
    pub strikes: Vec<EvaluatedStrike>,
}

/// The survey of a scene: [`evaluate_grid`] with its settings.
///
/// # Errors
/// A scene that cannot be simulated.
pub fn survey(scene: &Scene, properties: &Properties, options: &Options, size: GridSize) -> Result<Survey> {
    let strikes = evaluate_grid(scene, properties, options, size)?;
    Ok(Survey { version: 1, samples: size.samples, seed: options.seed, strikes })
}

/// A strike of the grid and its evaluation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct EvaluatedStrike {
    /// Object, line, speed and follow-through.
    pub aim: Aim,
    /// The strike itself.
    pub strike: Strike,
    /// Fraction of the scenarios in which it fulfils the goal.
    pub success_probability: f64,
    /// Mean number of singulated objects.
    pub expected_singulated: f64,
}

/// Evaluates feasible strikes of the grid, uniformly thinned to `size.strikes`, all in the same scenarios.
///
/// Pushes are simulated coarsely ([`Pressing::Coarse`](crate::physics::Pressing::Coarse)).  The same seed gives the same bits on any number of threads.
///
/// # Errors
/// A scene that cannot be simulated.
pub fn evaluate_grid(
    scene: &Scene,
    properties: &Properties,
    options: &Options,
    size: GridSize,
) -> Result<Vec<EvaluatedStrike>> {
    options.noise.check()?;
    let arm = CellArm::of(scene, options)?;
    let nominal = Nominal::new(scene, properties, options.noise, &laws_with(arm.as_ref()))?;
    let evaluation = Evaluation::new(scene, options.stopped)?;
    let all =
        StrikeGrid::new(scene, arm.as_ref())?.feasible(options, usize::MAX, GridSpacing::Regular)?.strikes;
    let count = size.strikes.min(all.len());
    let chosen = (0..count).map(|k| &all[k * all.len() / count]);
    let scenarios = nominal.scenarios(Draws { seed: options.seed, count: size.samples, fixed: None })?;
    let scenarios: Vec<Scenario> = scenarios.into_iter().map(Scenario::with_coarse_pushes).collect();
    let evaluated = |StrikeCandidate { aim, strike, .. }: &StrikeCandidate| {
        let margins = evaluation.margins(strike, &scenarios);
        EvaluatedStrike {
            aim: aim.clone(),
            strike: strike.clone(),
            success_probability: success_probability(&margins),
            expected_singulated: expected_singulated(&margins),
        }
    };
    let strikes = chosen.map(evaluated).collect();
    if options.is_stopped() { Err(Error::Stopped) } else { Ok(strikes) }
}
