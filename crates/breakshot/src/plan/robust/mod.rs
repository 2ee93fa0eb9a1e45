//! Which strike fulfils the goal in most scenarios?
//!
//! Successive halving (Jamieson and Talwalkar 2016): many strikes are evaluated in few scenarios, the better ones in more.  The best
//! distinct ones are varied, each generation by less, and compared in fresh scenarios.  The success probability of the winner is
//! measured in further scenarios that did not take part in the choice, so that it is not biased by the selection.  The search maximises
//! a smooth score of the goal's margin, which has a slope where no sample succeeds.

pub(crate) mod evaluate;
pub(crate) mod explain;
pub(crate) mod scenarios;
pub(crate) mod strike_grid;

use super::arm::{CellArm, Execution, laws_with};
use super::options::{Aim, Options};
use super::result::{Contact, Iteration, Outcome, Plan, Prediction, Robustness, RunnerUp};
use crate::error::{Error, Result};
use crate::geometry::{Pose, wrapped_rad};
use crate::physics::{GRAVITY_M_S2, Simulator};
use crate::properties::Properties;
use crate::scene::Strike;
use crate::scene::singulation::Singulation;
use crate::statistics::sorted_by_value;
use evaluate::{Evaluation, expected_singulated, standard_error, success_probability};
use explain::{failures, sensitivities};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use scenarios::{Draws, Nominal, Scenario};
use std::collections::BTreeMap;
use strike_grid::{Feasible, LEAST_FOLLOW_THROUGH_M, MOST_FOLLOW_THROUGH_M, StrikeCandidate, StrikeGrid};

/// How many strikes are evaluated, and in how many scenarios.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    /// Lines of the grid, each at all paces; more are thinned uniformly.
    pub lines: usize,
    /// Rounds of successive halving.
    pub rounds: [Round; 5],
    /// Distinct strikes that are varied.
    pub finalists: usize,
    pub refinement: Refinement,
    /// Fresh scenarios for the comparison of the finalists, and again for the final evaluation.
    pub fresh: usize,
    /// Whether the winner's sensitivity to each source of uncertainty is measured.
    pub sensitivities: bool,
}

/// One round of successive halving.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Round {
    /// Strikes that take part.
    pub strikes: usize,
    /// Scenarios in which each has been evaluated after the round.
    pub samples: usize,
}

/// The local search about each finalist.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refinement {
    pub generations: usize,
    /// Variants of each finalist per generation.
    pub variants: usize,
    /// Scenarios in which each variant is evaluated.
    pub samples: usize,
}

impl Budget {
    /// Fewer than thirty thousand rollouts.
    pub(crate) const FULL: Self = Self {
        lines: 160,
        rounds: [
            Round { strikes: 1600, samples: 1 },
            Round { strikes: 480, samples: 4 },
            Round { strikes: 240, samples: 16 },
            Round { strikes: 60, samples: 48 },
            Round { strikes: 24, samples: 96 },
        ],
        finalists: 6,
        refinement: Refinement { generations: 4, variants: 10, samples: 64 },
        fresh: 400,
        sensitivities: true,
    };

    /// A tenth of the rollouts, to compare scenes with each other.
    pub(crate) const SHORT: Self = Self {
        lines: 70,
        rounds: [
            Round { strikes: 700, samples: 1 },
            Round { strikes: 120, samples: 3 },
            Round { strikes: 40, samples: 8 },
            Round { strikes: 12, samples: 20 },
            Round { strikes: 6, samples: 32 },
        ],
        finalists: 2,
        refinement: Refinement { generations: 2, variants: 6, samples: 24 },
        fresh: 100,
        sensitivities: false,
    };

    /// Scenarios of the search.
    fn samples(&self) -> usize {
        self.rounds.iter().map(|round| round.samples).max().unwrap_or(1).max(self.refinement.samples)
    }
}

/// Scenarios whose final poses are part of the plan.
pub(crate) const SHOWN_SAMPLES: usize = 60;
/// Least success probability of a strike that counts as found; below it is the best effort.
const LEAST_PROBABILITY: f64 = 0.5;
/// Offset of the seeds of fresh scenarios from that of the search.
const FRESH_STREAM: u64 = 0x5EED_F4E5;
/// Parts of the search that are done after successive halving, after the refinement, and after the comparison of the finalists.
const DONE: [f64; 3] = [0.45, 0.75, 0.9];

/// The seed of the scenarios in which the winner is evaluated; they took no part in the choice.
pub(crate) fn final_seed(seed: u64) -> u64 {
    seed.wrapping_add(FRESH_STREAM.wrapping_mul(2))
}

/// Factor by which the variation narrows from one generation to the next.
const NARROWING: f64 = 0.6;

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
    let Feasible { strikes, obstacles } = grid.feasible(options, budget.lines)?;
    if strikes.is_empty() {
        let by: Vec<_> = obstacles.into_iter().collect();
        plan.reason = format!("the striker reaches no object: its path is blocked by {}", by.join(", "));
        return Ok(plan);
    }

    // Search
    let evaluation = Evaluation::new(&scene, options.stopped)?;
    let drawn = |seed: u64, count: usize| nominal.scenarios(Draws { seed, count, fixed: None });
    let scenarios: Vec<Scenario> =
        drawn(options.seed, budget.samples())?.into_iter().map(Scenario::with_coarse_pushes).collect();
    let arm = arm.as_ref();
    let search = Search { grid: &grid, evaluation: &evaluation, scenarios: &scenarios, budget, arm };
    options.report(0.0);
    let halved = search.halved(strikes, |part| options.report(DONE[0] * part));
    let finalists = match search.finalists(halved) {
        Ok(finalists) => finalists,
        Err(refusal) => {
            plan.reason = format!("the arm can execute no strike within its reach: {refusal}");
            return Ok(plan);
        }
    };
    let refined = search.refined(finalists, options.seed);
    options.report(DONE[1]);

    // Comparison, and evaluation of the winner in scenarios that did not take part in the choice
    let (comparison_seed, final_seed) = (options.seed.wrapping_add(FRESH_STREAM), final_seed(options.seed));
    let mut ranked = evaluation.ranked(refined, &drawn(comparison_seed, budget.fresh)?);
    options.report(DONE[2]);
    let fresh = drawn(final_seed, budget.fresh)?;
    let runner_up = ranked.get(1).map(|candidate| RunnerUp {
        strike: candidate.strike.clone(),
        success_probability: success_probability(&evaluation.margins(&candidate.strike, &fresh)),
    });
    let best = ranked.swap_remove(0);
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

/// The search for good strikes in a fixed set of scenarios.
struct Search<'a> {
    grid: &'a StrikeGrid<'a>,
    evaluation: &'a Evaluation<'a>,
    scenarios: &'a [Scenario],
    budget: &'a Budget,
    arm: Option<&'a CellArm<'a>>,
}

/// Strikes in the order of their scores: those that took part in the last round of successive halving, and those that did not.
struct Halved {
    last_round: Vec<StrikeCandidate>,
    eliminated: Vec<StrikeCandidate>,
}

impl Search<'_> {
    /// Successive halving: each round evaluates the better strikes of the last one in more scenarios.
    /// `report` gets the part of the rounds that are done.
    fn halved(&self, mut strikes: Vec<StrikeCandidate>, report: impl Fn(f64)) -> Halved {
        let mut evaluated = 0;
        let mut eliminated: Vec<StrikeCandidate> = Vec::new();
        for (k, round) in self.budget.rounds.into_iter().enumerate() {
            let tail = strikes.split_off(round.strikes.min(strikes.len()));
            eliminated.splice(0..0, tail);
            let samples = round.samples.min(self.scenarios.len());
            self.evaluation.add_scores(&mut strikes, &self.scenarios[evaluated..samples]);
            evaluated = samples;
            strikes = sorted_by_value(strikes, |candidate| -candidate.score);
            report((k + 1) as f64 / self.budget.rounds.len() as f64);
        }
        Halved { last_round: strikes, eliminated }
    }

    /// The best strikes that the arm can execute, without variants of better ones; eliminated strikes only if the arm can execute none
    /// of the last round.
    ///
    /// # Errors
    /// The arm's refusal of the best strike, if it can execute none.
    fn finalists(
        &self,
        Halved { last_round, eliminated }: Halved,
    ) -> std::result::Result<Vec<StrikeCandidate>, String> {
        let most = self.budget.finalists;
        let Some(arm) = self.arm else { return Ok(distinct(last_round, most)) };
        let mut refusals = Vec::new();
        for strikes in [last_round, eliminated] {
            let mut found: Vec<StrikeCandidate> = Vec::new();
            for some in strikes.chunks(most) {
                let new: Vec<_> = some.iter().filter(|c| !found.iter().any(|f| f.is_alike(c))).collect();
                let answers: Vec<_> = new.par_iter().map(|c| arm.refusal(&c.strike)).collect();
                for (candidate, refusal) in new.into_iter().zip(answers) {
                    match refusal {
                        Some(reason) => refusals.push(reason),
                        None => found.push(candidate.clone()),
                    }
                }
                found = distinct(found, most);
                if found.len() == most {
                    break;
                }
            }
            if !found.is_empty() {
                return Ok(found);
            }
        }
        Err(refusals.into_iter().next().unwrap_or_default())
    }

    /// Varies each strike, every generation by less, and keeps the best variant that the arm can execute.
    fn refined(&self, mut strikes: Vec<StrikeCandidate>, seed: u64) -> Vec<StrikeCandidate> {
        let Refinement { generations, variants, samples } = self.budget.refinement;
        let scenarios = &self.scenarios[..samples.min(self.scenarios.len())];
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        for strike in &mut strikes {
            strike.score = 0.0;
        }
        self.evaluation.add_scores(&mut strikes, scenarios);
        // Each strike after every generation that improved it, the latest last
        let mut lines: Vec<Vec<StrikeCandidate>> = strikes.into_iter().map(|strike| vec![strike]).collect();
        for generation in 0..generations {
            let width = NARROWING.powi(i32::try_from(generation).unwrap_or(0));
            let mut tried: Vec<(usize, StrikeCandidate)> = Vec::new();
            for (line, parent) in lines.iter().enumerate().filter_map(|(k, line)| Some((k, line.last()?))) {
                for _ in 0..variants {
                    let aim = self.varied(&parent.aim, width, &mut rng);
                    if let Ok(candidate) = self.grid.candidate(aim) {
                        tried.push((line, candidate));
                    }
                }
            }
            let (of_line, mut children): (Vec<_>, Vec<_>) = tried.into_iter().unzip();
            self.evaluation.add_scores(&mut children, scenarios);
            let mut best: Vec<Option<StrikeCandidate>> = vec![None; lines.len()];
            for (line, child) in of_line.into_iter().zip(children) {
                let known = best[line].as_ref().or(lines[line].last());
                if known.is_none_or(|known| child.score > known.score) {
                    best[line] = Some(child);
                }
            }
            for (line, best) in lines.iter_mut().zip(best) {
                line.extend(best);
            }
        }
        lines.into_par_iter().filter_map(|line| self.latest_executable(line)).collect()
    }

    /// The latest variant that the arm can execute, with the travel after which the arm stops; the first strike of the line is one.
    fn latest_executable(&self, mut line: Vec<StrikeCandidate>) -> Option<StrikeCandidate> {
        let Some(arm) = self.arm else { return line.pop() };
        while let Some(candidate) = line.pop() {
            match arm.execution(&candidate.strike) {
                Execution::Refused(_) if !line.is_empty() => {}
                Execution::Overshoot(beyond_m) => return Some(self.lengthened(candidate, beyond_m)),
                Execution::Refused(_) | Execution::AsPlanned => return Some(candidate),
            }
        }
        None
    }

    /// The strike with a longer travel, if the arm ends that one as planned.
    fn lengthened(&self, candidate: StrikeCandidate, by_m: f64) -> StrikeCandidate {
        let follow_through_m = candidate.aim.follow_through_m + by_m;
        let longer = self.grid.candidate(Aim { follow_through_m, ..candidate.aim.clone() }).ok();
        let is_as_planned = |longer: &StrikeCandidate| {
            self.arm.is_some_and(|arm| arm.execution(&longer.strike) == Execution::AsPlanned)
        };
        longer.filter(is_as_planned).unwrap_or(candidate)
    }

    /// A normally distributed variation of an aim; `width` scales all standard deviations.
    fn varied(&self, aim: &Aim, width: f64, rng: &mut Pcg64Mcg) -> Aim {
        let grid = self.grid;
        let mut normal = || width * rng.sample::<f64, _>(StandardNormal);
        let heading_rad = wrapped_rad(aim.heading_rad + 0.12 * normal());
        let offset_m = aim.offset_m + 0.15 * normal() * grid.greatest_offset_m(&aim.object, heading_rad, 1.0);
        let most_m = 0.8 * grid.greatest_offset_m(&aim.object, heading_rad, offset_m);
        Aim {
            object: aim.object.clone(),
            heading_rad,
            offset_m: offset_m.clamp(-most_m, most_m),
            speed_m_s: (aim.speed_m_s * (0.15 * normal()).exp()).clamp(grid.slowest_m_s, grid.fastest_m_s),
            follow_through_m: (aim.follow_through_m * (0.4 * normal()).exp())
                .clamp(LEAST_FOLLOW_THROUGH_M, MOST_FOLLOW_THROUGH_M),
        }
    }
}

/// The best strikes without variants of better ones.
fn distinct(strikes: Vec<StrikeCandidate>, count: usize) -> Vec<StrikeCandidate> {
    let mut kept: Vec<StrikeCandidate> = Vec::new();
    for strike in strikes {
        if kept.len() < count && !kept.iter().any(|k| k.is_alike(&strike)) {
            kept.push(strike);
        }
    }
    kept
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
