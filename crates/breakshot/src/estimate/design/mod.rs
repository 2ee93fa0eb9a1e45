//! What to film next?
//!
//! Bayesian experimental design with a Gaussian model.
//!
//! - `prior`: means and covariance of all parameters of a simulation, wide where nothing was filmed.
//! - `sensitivity`: the Jacobian of the final positions of many struck piles (random ones or the user's own), by finite
//!   differences of rollouts.
//! - `information`: the measurement model of every candidate clip, from a simulated clip and its fit.
//! - `advice` chooses the clip that reduces the mean standard deviation of the final positions most, updates the covariance as if
//!   that clip had been filmed, and continues with the next one (greedy selection).

pub(crate) mod experiment;
mod information;
mod monte_carlo;
mod prior;
mod sensitivity;
pub(crate) mod simulated_clip;
#[cfg(test)]
mod tests;

pub use monte_carlo::{prediction_error_m, predictive_std_m, struck_piles};
pub use sensitivity::{Draws, StruckPile};

use crate::cell::Cell;
use crate::error::{Error, Result};
use crate::estimate::measure::ClipMeasurements;
use crate::object::{self, Object};
use crate::properties::Properties;
use crate::scene::Scene;
use crate::statistics::sorted_by_value;
use experiment::{Experiment, Setup};
use information::{CandidateClip, LearnedNoise};
use nalgebra::DMatrix;
use prior::Prior;
use rayon::prelude::*;
use sensitivity::OutcomeJacobian;
use serde::{Deserialize, Serialize};

/// How many clips to advise, and for which piles.
#[derive(Clone, Debug, PartialEq)]
pub struct AdviceOptions<'a> {
    /// Number of clips.
    pub clips: usize,
    /// Seed of the random piles and strikes.
    pub seed: u64,
    /// The pile whose outcome matters; without one, random piles of all objects.
    pub scene: Option<&'a Scene>,
}

/// The most informative clips to film next (`advice.json`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Advice {
    /// The file format's version.
    pub version: u32,
    /// Seed of the random piles and strikes.
    pub seed: u64,
    /// Number of strikes on piles over which the advice is averaged.
    pub piles: usize,
    /// Standard deviation of an object's final position (m), the mean over all objects of all piles, from the uncertainty of
    /// the properties: without the variation from strike to strike, which no clip reduces.
    pub spread_m: f64,
    /// The clips, the most informative first.
    pub clips: Vec<AdvisedClip>,
}

/// One clip to film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AdvisedClip {
    /// The experiment to film.
    #[serde(flatten)]
    pub experiment: Experiment,
    /// The expected [`Advice::spread_m`] after this clip and those before it.
    pub spread_m: f64,
    /// The parameters whose uncertainty it reduces, the largest reduction first.
    #[serde(rename = "tells")]
    pub reductions: Vec<UncertaintyReduction>,
}

/// The reduction of the uncertainty of one parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UncertaintyReduction {
    /// The parameter, by its name in the covariance of the properties.
    pub quantity: String,
    /// Standard deviation before the clip.
    pub before: f64,
    /// Standard deviation after the clip.
    pub after: f64,
}

/// Number of strikes on piles over which the advice is averaged.
const PILES: usize = 80;
/// Smallest relative reduction of a standard deviation that is listed.
const MIN_REDUCTION: f64 = 0.05;

/// The clips to film next, ranked by how much they reduce the predicted uncertainty of final positions.
///
/// # Errors
/// A cell without striker; properties without evidence; a pile that cannot be struck or simulated; no experiment that stays within the workspace.
pub fn advice(
    properties: &Properties,
    cell: &Cell,
    objects: &[Object],
    options: &AdviceOptions,
) -> Result<Advice> {
    cell.require_striker("advice: cell")?;

    // The earlier clips
    let setup = Setup { cell, objects };
    let evidence = properties.evidence.as_ref();
    let records = evidence
        .into_iter()
        .flat_map(|e| &e.clips)
        .map(ClipMeasurements::from_evidence)
        .collect::<Result<Vec<_>>>()?;
    if records.is_empty() {
        let needed = "properties with the evidence of at least one clip";
        return Err(Error::invalid("advice", "evidence", "missing", needed));
    }
    for placed in options.scene.iter().flat_map(|s| &s.placed) {
        object::find(objects, &placed.object, "advice: scene")?;
    }
    let in_scene = options.scene.into_iter().flat_map(|s| &s.placed).map(|p| p.object.as_str());
    let filmed = records.iter().flat_map(|r| &r.objects).map(String::as_str);
    let copies = information::copies(filmed.chain(in_scene));

    // How final positions depend on the parameters
    let mut prior = Prior::new(properties, objects, !copies.is_empty());
    let draws = Draws { count: PILES, seed: options.seed };
    let piles = sensitivity::random_struck_piles(&prior, setup, options.scene, draws)?;
    let jacobians = sensitivity::jacobians(&prior, &piles);
    if jacobians.is_empty() {
        let needed = "a pile that the striker reaches and that can be simulated";
        return Err(Error::invalid("advice", "piles", "none", needed));
    }

    // What each clip would measure
    let learned = LearnedNoise::new(&records);
    let experiments = information::experiments(&prior, setup, &copies);
    let mut candidates = information::candidates(&prior, setup, &learned, experiments);
    if candidates.is_empty() {
        let needed = "a workspace in which at least one object can be struck and comes to rest";
        return Err(Error::invalid("advice", "clips", "none that stays in the workspace", needed));
    }

    // Greedy selection
    let spread_m = mean_position_std_m(&jacobians, &prior.covariance);
    let clips = (0..options.clips).map_while(|_| next(&mut prior, &jacobians, &mut candidates)).collect();
    Ok(Advice { version: 1, seed: options.seed, piles: jacobians.len(), spread_m, clips })
}

/// An experiment is advised at most this often: what rocking and uneven faces do to one geometry, repeats do not average out.
const MOST_REPEATS: usize = 2;

/// The best candidate; updates the covariance as if it had been filmed.
fn next(
    prior: &mut Prior,
    jacobians: &[OutcomeJacobian],
    candidates: &mut Vec<CandidateClip>,
) -> Option<AdvisedClip> {
    let outcomes: Vec<Option<(f64, DMatrix<f64>)>> = candidates
        .par_iter()
        .map(|candidate| {
            let after = candidate.after(&prior.covariance)?;
            Some((mean_position_std_m(jacobians, &after), after))
        })
        .collect();
    let found =
        outcomes.into_iter().enumerate().filter_map(|(k, outcome)| outcome.map(|(m, after)| (k, m, after)));
    let (best, spread_m, after) = found.min_by(|p, q| p.1.total_cmp(&q.1))?;
    let experiment = candidates[best].experiment.clone();
    candidates[best].advised += 1;
    if candidates[best].advised == MOST_REPEATS {
        candidates.remove(best);
    }
    let before = std::mem::replace(&mut prior.covariance, after);
    let std = |matrix: &DMatrix<f64>, k: usize| matrix[(k, k)].max(0.0).sqrt();
    let reductions: Vec<UncertaintyReduction> = (prior.parameters.iter().enumerate())
        .map(|(k, p)| UncertaintyReduction {
            quantity: p.name(),
            before: std(&before, k),
            after: std(&prior.covariance, k),
        })
        .filter(|r| r.after < (1.0 - MIN_REDUCTION) * r.before)
        .collect();
    let reductions = sorted_by_value(reductions, |r| r.after / r.before);
    Some(AdvisedClip { experiment, spread_m, reductions })
}

/// The mean over all objects of all piles of the standard deviation of the final position (m).
fn mean_position_std_m(jacobians: &[OutcomeJacobian], covariance: &DMatrix<f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for std_m in jacobians.iter().flat_map(|j| j.position_stds_m(covariance)) {
        sum += std_m;
        count += 1;
    }
    sum / f64::from(count.max(1))
}
