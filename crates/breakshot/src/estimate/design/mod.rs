//! What to film next?
//!
//! Bayesian experimental design.  What is known is Gaussian: the estimate's means and full covariance, wide priors where
//! nothing was filmed.  What matters is where objects come to rest after a strike on a pile: over many random piles (or the
//! user's own), the final places are linearized about the means by finite differences of rollouts.  What a clip would tell
//! is found by staging it with the learned properties and fitting it: the fit's own covariance at the learned noise, plus the
//! learned spread from clip to clip.  The clip that lowers the mean standard deviation of the final places most comes
//! first; the covariance is updated as if it had been filmed, and so on.

pub(crate) mod experiment;
mod information;
mod monte_carlo;
mod prior;
mod sensitivity;
pub(crate) mod simulated_clip;
#[cfg(test)]
mod tests;

pub use monte_carlo::{prediction_error_m, predictive_spread_m, struck_piles};
pub use sensitivity::StruckPile;

use crate::cell::Cell;
use crate::error::{Error, Result};
use crate::estimate::measure::ClipMeasurements;
use crate::object::{self, Object};
use crate::properties::Properties;
use crate::scene::Scene;
use experiment::Shot;
use information::{Candidate, Habits};
use nalgebra::DMatrix;
use prior::Belief;
use rayon::prelude::*;
use sensitivity::Response;
use serde::{Deserialize, Serialize};

/// What to advise, and for what.
#[derive(Clone, Debug, PartialEq)]
pub struct AdviceOptions<'a> {
    /// How many clips.
    pub clips: usize,
    /// The seed of the random piles.
    pub seed: u64,
    /// The pile to plan for; random ones of all objects if not given.
    pub scene: Option<&'a Scene>,
}

/// The clips that are worth filming next (`advice.json`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Advice {
    /// The file format's version.
    pub version: u32,
    /// The seed of the piles.
    pub seed: u64,
    /// How many strikes on piles it rests on.
    pub piles: usize,
    /// One standard deviation of where an object comes to rest (m), the mean over all objects of all piles, as far as
    /// filming can lower it.
    pub spread_m: f64,
    /// The clips, the most useful first.
    pub clips: Vec<Advised>,
}

/// One clip to film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Advised {
    /// What to do.
    #[serde(flatten)]
    pub shot: Shot,
    /// What [`Advice::spread_m`] is expected to be once this clip and those before it are filmed.
    pub spread_m: f64,
    /// What it tells of, the most telling first.
    pub tells: Vec<Told>,
}

/// What a clip tells of one quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// The quantity, as the covariance of the properties calls it.
    pub quantity: String,
    /// One standard deviation of its mean before.
    pub before: f64,
    /// And after.
    pub after: f64,
}

/// How many strikes on piles stand for all.
const PILES: usize = 80;
/// A quantity that a clip makes surer by less than this part is not worth a word.
const TELLS: f64 = 0.05;

/// The next clips, ranked by how much they shrink the predictive uncertainty of final places.
///
/// # Errors
/// Properties without evidence; a pile that cannot be struck; nothing that could be filmed within the workspace.
pub fn advice(
    properties: &Properties,
    cell: &Cell,
    objects: &[Object],
    options: &AdviceOptions,
) -> Result<Advice> {
    let evidence = properties.evidence.as_ref();
    let records = evidence
        .into_iter()
        .flat_map(|e| &e.clips)
        .map(ClipMeasurements::from_kept)
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
    let mut belief = Belief::new(properties, objects, !copies.is_empty());
    let piles = sensitivity::sampled(&belief, (cell, objects), options.scene, (PILES, options.seed))?;
    let responses = sensitivity::responses(&belief, &piles);
    if responses.is_empty() {
        let needed = "a pile that the striker reaches and that can be simulated";
        return Err(Error::invalid("advice", "piles", "none", needed));
    }
    let habits = Habits::new(&records);
    let shots = information::shots(&belief, cell, objects, &copies);
    let candidates = information::candidates(&belief, (cell, objects), &habits, shots);
    if candidates.is_empty() {
        let needed = "a workspace in which at least one object can be struck and comes to rest";
        return Err(Error::invalid("advice", "clips", "none that stays in the workspace", needed));
    }
    let spread_m = mean_spread_m(&responses, &belief.covariance);
    let clips = (0..options.clips).map_while(|_| next(&mut belief, &responses, &candidates)).collect();
    Ok(Advice { version: 1, seed: options.seed, piles: responses.len(), spread_m, clips })
}

/// The best candidate; the belief is updated as if it had been filmed.
fn next(belief: &mut Belief, responses: &[Response], candidates: &[Candidate]) -> Option<Advised> {
    let merits: Vec<Option<(f64, DMatrix<f64>)>> = candidates
        .par_iter()
        .map(|candidate| {
            let after = candidate.after(&belief.covariance)?;
            Some((mean_spread_m(responses, &after), after))
        })
        .collect();
    let found = candidates.iter().zip(merits).filter_map(|(c, merit)| merit.map(|(m, after)| (c, m, after)));
    let (best, spread_m, after) = found.min_by(|p, q| p.1.total_cmp(&q.1))?;
    let before = std::mem::replace(&mut belief.covariance, after);
    let std = |matrix: &DMatrix<f64>, k: usize| matrix[(k, k)].max(0.0).sqrt();
    let mut tells: Vec<Told> = (belief.quantities.iter().enumerate())
        .map(|(k, q)| Told { quantity: q.name(), before: std(&before, k), after: std(&belief.covariance, k) })
        .filter(|t| t.after < (1.0 - TELLS) * t.before)
        .collect();
    tells.sort_by(|p, q| (p.after / p.before).total_cmp(&(q.after / q.before)));
    Some(Advised { shot: best.shot.clone(), spread_m, tells })
}

fn mean_spread_m(responses: &[Response], covariance: &DMatrix<f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for spread_m in responses.iter().flat_map(|r| r.spreads_m(covariance)) {
        sum += spread_m;
        count += 1;
    }
    sum / f64::from(count.max(1))
}
