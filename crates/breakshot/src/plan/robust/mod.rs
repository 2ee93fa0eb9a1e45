//! Which strike fulfils the goal in most scenarios?
//!
//! Successive halving (Jamieson and Talwalkar 2016): many strikes are evaluated in few scenarios, the better ones in more.  The best
//! distinct ones are varied, each generation fewer of them and by less, and compared in fresh scenarios.  Good strikes on large piles
//! are rare and far apart, so that the search is repeated in other grids while the best strike fails too often.  The success probability
//! of the winner is measured in further scenarios that did not take part in the choice, so that it is not biased by the selection.  The
//! search maximises a smooth score of the goal's margin, which has a slope where no sample succeeds.

pub(crate) mod budget;
pub(crate) mod evaluate;
pub(crate) mod explain;
pub(crate) mod scenarios;
mod search;
pub(crate) mod strike_grid;

use super::arm::{CellArm, laws_with};
use super::options::{Aim, Options};
use super::result::{Contact, Iteration, Outcome, Plan, Prediction, Robustness, RunnerUp};
use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::physics::{GRAVITY_M_S2, Simulator};
use crate::properties::Properties;
use crate::scene::Strike;
use crate::scene::singulation::Singulation;
use crate::statistics::sorted_by_value;
use budget::Budget;
use evaluate::{Compared, Evaluation, expected_singulated, standard_error, success_probability};
use explain::{failures, sensitivities};
use scenarios::{Draws, Nominal, Scenario};
use search::Search;
use std::collections::BTreeMap;
use strike_grid::{Feasible, GridSpacing, StrikeCandidate, StrikeGrid};

/// Scenarios whose final poses are part of the plan.
pub(crate) const SHOWN_SAMPLES: usize = 60;
/// Least success probability of a strike that counts as found; below it is the best effort.
const LEAST_PROBABILITY: f64 = 0.5;
/// A strike that works with this probability ends the search.
const ENOUGH_PROBABILITY: f64 = 0.95;
/// Offset of the seeds of fresh scenarios from that of the search.
const FRESH_STREAM: u64 = 0x5EED_F4E5;
/// Distance of the seeds of one search and the next.
const SEARCH_STREAM: u64 = 0x5EA2_C4E5;
/// The part of a search that is done after successive halving, and the part of a plan after the last search.
const HALVED: f64 = 0.5;
const SEARCHED: f64 = 0.95;

/// The seed of the scenarios in which the winner is evaluated; they took no part in the choice.
pub(crate) fn final_seed(seed: u64) -> u64 {
    seed.wrapping_add(FRESH_STREAM.wrapping_mul(2))
}

/// Plans the strike with the largest success probability.
pub(crate) fn robust(
    mut plan: Plan,
    properties: &Properties,
    options: &Options,
    budget: &Budget,
) -> Result<Plan> {
    // Feasible strikes
    let scene = plan.scene.clone();
    let arm = CellArm::of(&scene, options)?;
    let nominal = Nominal::new(&scene, properties, options.noise, &laws_with(arm.as_ref()))?;
    let grid = StrikeGrid::new(&scene, arm.as_ref())?;
    plan.arm = arm.as_ref().map(CellArm::name);
    let Feasible { strikes, obstacles } = grid.feasible(options, budget.lines, GridSpacing::Regular)?;
    if strikes.is_empty() {
        let by: Vec<_> = obstacles.into_iter().collect();
        plan.reason = format!("the striker reaches no object: its path is blocked by {}", by.join(", "));
        return Ok(plan);
    }

    // Searches, and comparison of the best strikes
    let evaluation = Evaluation::new(&scene, options.stopped)?;
    let drawn = |seed: u64, count: usize| nominal.scenarios(Draws { seed, count, fixed: None });
    let scenarios: Vec<Scenario> =
        drawn(options.seed, budget.samples())?.into_iter().map(Scenario::with_coarse_pushes).collect();
    let arm = arm.as_ref();
    let search = Search { grid: &grid, evaluation: &evaluation, scenarios: &scenarios, budget, arm };
    let comparison = drawn(options.seed.wrapping_add(FRESH_STREAM), budget.fresh)?;
    let mut ranked = match searched(&search, strikes, options, &comparison)? {
        Ok(ranked) => ranked,
        Err(refusal) => {
            plan.reason = format!("the arm can execute no strike within its reach: {refusal}");
            return Ok(plan);
        }
    };
    options.report(SEARCHED);

    // Evaluation of the winner in scenarios that did not take part in the choice
    let final_seed = final_seed(options.seed);
    let fresh = drawn(final_seed, budget.fresh)?;
    let runner_up = ranked.get(1).map(|Compared { candidate, .. }| RunnerUp {
        strike: candidate.strike.clone(),
        success_probability: success_probability(&evaluation.margins(&candidate.strike, &fresh)),
    });
    let best = ranked.swap_remove(0).candidate;
    let margins = evaluation.margins(&best.strike, &fresh);
    let success_probability = success_probability(&margins);
    let samples = margins.len();
    let sensitivities = if budget.sensitivities {
        sensitivities(&nominal, &evaluation, &best.strike, final_seed, &margins)?
    } else {
        Vec::new()
    };
    let mut robustness = Robustness {
        success_probability,
        standard_error: standard_error(success_probability, samples),
        samples,
        rollouts: 0,
        expected_singulated: expected_singulated(&margins),
        runner_up,
        failures: failures(&scene, &margins),
        sensitivities,
        final_poses: final_poses(&best.strike, &fresh[..SHOWN_SAMPLES.min(fresh.len())]),
        seed: options.seed,
    };
    robustness.rollouts = evaluation.rollouts();
    if options.is_stopped() {
        return Err(Error::Stopped);
    }
    finish(&mut plan, &nominal, &best, robustness)?;
    Ok(plan)
}

/// The best strikes of the searches, the one with the largest success probability first: the first search has these strikes, each
/// further one those of another grid.
///
/// # Errors
/// A proposal for an object that is not placed; within, the arm's refusal if it can execute no strike.
fn searched(
    search: &Search,
    strikes: Vec<StrikeCandidate>,
    options: &Options,
    comparison: &[Scenario],
) -> Result<std::result::Result<Vec<Compared>, String>> {
    let mut ranked: Vec<Compared> = Vec::new();
    let mut refusal = String::new();
    let mut strikes = Some(strikes);
    for k in 0..search.budget.searches {
        // Most plans need one search: each further one is half of what is left.
        let done = |part: f64| SEARCHED * (1.0 - (1.0 - 0.5 * part) * 0.5_f64.powi(k as i32));
        options.report(done(0.0));
        let seed = options.seed.wrapping_add(SEARCH_STREAM.wrapping_mul(k));
        let strikes = match strikes.take() {
            Some(first) => first,
            None => search.grid.feasible(options, search.budget.lines, GridSpacing::Random { seed })?.strikes,
        };
        let halved = search.halved(strikes, |part| options.report(done(HALVED * part)));
        match search.finalists(halved) {
            Ok(finalists) => {
                ranked.extend(search.evaluation.compared(search.refined(finalists, seed), comparison));
            }
            Err(reason) => refusal = reason,
        }
        ranked = sorted_by_value(ranked, |compared| -compared.value());
        let is_enough = |best: &Compared| best.success_probability >= ENOUGH_PROBABILITY;
        if ranked.first().is_some_and(is_enough) || options.is_stopped() {
            break;
        }
    }
    Ok(if ranked.is_empty() { Err(refusal) } else { Ok(ranked) })
}

/// The final poses of each object in these scenarios.
pub(crate) fn final_poses(strike: &Strike, scenarios: &[Scenario]) -> BTreeMap<String, Vec<Pose>> {
    let mut simulator = Simulator::new();
    let mut found: BTreeMap<String, Vec<Pose>> = BTreeMap::new();
    for scenario in scenarios {
        if let Ok(outcome) = simulator.run(&scenario.world, &scenario.executed(strike)) {
            for (name, pose) in scenario.world.by_name(&outcome.poses) {
                found.entry(name).or_default().push(pose);
            }
        }
    }
    found
}

/// Completes the plan with the prediction: the strike as written, simulated with the properties at their means.
fn finish(plan: &mut Plan, nominal: &Nominal, best: &StrikeCandidate, robustness: Robustness) -> Result<()> {
    let strike = best.strike.clone();
    let outcome = Simulator::new().run(&nominal.world, &strike)?;
    let final_poses = nominal.world.by_name(&outcome.poses);
    let singulation = Singulation::of(&plan.scene, &final_poses)?;
    let probability = robustness.success_probability;
    plan.outcome = if probability >= LEAST_PROBABILITY { Outcome::Found } else { Outcome::BestEffort };
    plan.reason = reason(plan, &strike, &robustness);
    plan.iterations = vec![Iteration {
        strike: strike.clone(),
        contact: contact(&best.aim, &nominal.properties)?,
        min_distance_m: singulation.min_distance_m(),
        mean_distance_m: singulation.mean_distance_m(),
        fulfilled: singulation.violations().is_empty(),
    }];
    plan.prediction = Some(Prediction {
        final_poses,
        min_distance_m: singulation.min_distance_m(),
        mean_distance_m: singulation.mean_distance_m(),
        success_probability: Some(probability),
    });
    plan.strike = Some(strike);
    plan.robustness = Some(robustness);
    Ok(())
}

/// Whether the striker catches up with a free object within the follow-through (Eq. 27 and 28, corrected).
fn contact(aim: &Aim, properties: &Properties) -> Result<Contact> {
    let restitution = properties.striker_restitution(&aim.object)?.mean;
    let deceleration_m_s2 = properties.friction(&aim.object)?.mean * GRAVITY_M_S2;
    let catch_up_m = 2.0 * restitution * aim.speed_m_s.powi(2) / deceleration_m_s2;
    Ok(if catch_up_m > aim.follow_through_m { Contact::Scattering } else { Contact::Pushing })
}

/// The outcome in a sentence.
fn reason(plan: &Plan, strike: &Strike, robustness: &Robustness) -> String {
    let Robustness { success_probability, standard_error, samples, expected_singulated, .. } = robustness;
    let what = format!(
        "striking {} at {:.3} m/s works in {:.0} % (+- {:.1} %) of {samples} scenarios",
        strike.object.as_deref().unwrap_or_default(),
        strike.speed_m_s,
        success_probability * 100.0,
        standard_error * 100.0
    );
    let fails = robustness.failures.first().map(|failure| {
        format!("; the most frequent failure: {} ({:.0} %)", failure.what, failure.fraction * 100.0)
    });
    let best_effort = (plan.outcome == Outcome::BestEffort).then(|| {
        let all = plan.scene.placed.len();
        format!(
            "; no strike found works in half of them, and this one singulates {expected_singulated:.1} of {all} \
             objects on average"
        )
    });
    what + &fails.unwrap_or_default() + &best_effort.unwrap_or_default()
}
