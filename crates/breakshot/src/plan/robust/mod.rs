//! Which strike works in most of the worlds that may be?
//!
//! Successive halving: many aims are judged on a few possible worlds, the better ones on more; the best distinct ones are then
//! varied, each generation closer, and compared on fresh worlds.  The winner's success probability is the part of still
//! others, which had no say in choosing it, in which the goal holds.  While searching, an outcome counts by how clearly it
//! fulfils or misses the goal, so that the search feels a slope where no sample succeeds yet.

pub(crate) mod evaluate;
mod explain;
pub(crate) mod goal_margin;
pub(crate) mod scenarios;
pub(crate) mod strike_grid;

use super::options::{Aim, Options};
use super::result::{Contact, Iteration, Outcome, Plan, Prediction, Robustness, RunnerUp};
use crate::error::Result;
use crate::geometry::{Pose, wrapped_rad};
use crate::physics::{self, GRAVITY_M_S2, Simulator, World};
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use crate::singulation::Singulation;
use evaluate::{expected_singulated, judged, part, standard_error, verdicts, weigh};
use explain::{doubts, failures};
use goal_margin::{Judge, Verdict};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use scenarios::{Possible, by_name, possible_worlds};
use std::collections::BTreeMap;
use strike_grid::{Candidate, LEAST_FOLLOW_THROUGH_M, MOST_FOLLOW_THROUGH_M, Range, reachable};

/// How much is tried and on how many possible worlds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Lines judged at first, each at all paces; more are thinned evenly.
    pub lines: usize,
    /// How many candidates stay, and on how many worlds they are judged then.
    pub rounds: [(usize, usize); 5],
    /// Distinct candidates that are varied.
    pub finalists: usize,
    /// Generations of variants, how many each, and the worlds they are judged on.
    pub generations: (usize, usize, usize),
    /// Fresh worlds for the verdict.
    pub fresh: usize,
}

impl Effort {
    /// Fewer than thirty thousand rollouts.
    pub(crate) const FULL: Self = Self {
        lines: 160,
        rounds: [(1600, 1), (480, 4), (240, 16), (60, 48), (24, 96)],
        finalists: 6,
        generations: (4, 10, 64),
        fresh: 400,
    };
}

/// Fresh worlds whose outcomes are told one by one.
const CLOUD: usize = 60;
/// A strike that works less often than this is only the best effort.
const LEAST_PROBABILITY: f64 = 0.5;

/// Plans the strike that works most probably.
pub(crate) fn robust(
    mut plan: Plan,
    properties: &Properties,
    options: &Options,
    effort: &Effort,
) -> Result<Plan> {
    let scene = plan.scene.clone();
    let nominal = World::new(&scene, properties, &physics::Options::default())?;
    let range = Range::new(&scene)?;
    let (candidates, blocked) = reachable(&scene, &range, (options, effort.lines));
    if candidates.is_empty() {
        let by: Vec<_> = blocked.into_iter().collect();
        plan.reason = format!("the striker reaches no object: in its way are {}", by.join(", "));
        return Ok(plan);
    }
    let judge = Judge::new(&scene)?;
    let count = effort.rounds.iter().map(|round| round.1).max().unwrap_or(1).max(effort.generations.2);
    let known = (&scene, properties, &nominal);
    let worlds = possible_worlds(known, options, (options.seed, count), None)?;
    let field = halved(candidates, &worlds, (&judge, effort));
    let finalists = distinct(field, effort.finalists);
    let field = refined(finalists, (&worlds, &judge), (&range, effort), options.seed);
    let drawn = |seed: u64| possible_worlds(known, options, (seed, effort.fresh), None);
    let [compared_seed, verdict_seed] = [1, 2].map(|k| options.seed.wrapping_add(k * FRESH_STREAM));
    let mut judged = judged(&field, &drawn(compared_seed)?, &judge);
    judged.sort_by(|one, other| other.1.total_cmp(&one.1));
    // Some of the winner's lead is luck: it is judged once more, in worlds that had no say in the choice.
    let fresh = drawn(verdict_seed)?;
    let runner_up = judged.get(1).map(|(candidate, _)| RunnerUp {
        strike: candidate.strike.clone(),
        success_probability: part(&verdicts(&candidate.strike, &fresh, &judge), Verdict::fulfilled),
    });
    let best = judged.swap_remove(0).0;
    let told = verdicts(&best.strike, &fresh, &judge);
    let success_probability = part(&told, Verdict::fulfilled);
    let samples = told.len();
    let mut robustness = Robustness {
        success_probability,
        standard_error: standard_error(success_probability, samples),
        samples,
        rollouts: 0,
        expected_singulated: expected_singulated(&told),
        runner_up,
        failures: failures(&scene, &told),
        doubts: doubts(known, options, (&best.strike, &judge), (verdict_seed, &told))?,
        cloud: cloud(&best.strike, &fresh[..CLOUD.min(fresh.len())]),
        seed: options.seed,
    };
    robustness.rollouts = judge.judged();
    finish(&mut plan, (&nominal, properties), &best, robustness)?;
    Ok(plan)
}

/// Tells fresh worlds' draws from those of the search.
const FRESH_STREAM: u64 = 0x5EED_F4E5;

/// Successive halving: the better part of the judged goes on to more worlds.
fn halved(
    mut field: Vec<Candidate>,
    worlds: &[Possible],
    (judge, effort): (&Judge, &Effort),
) -> Vec<Candidate> {
    let mut seen = 0;
    for (stay, samples) in effort.rounds {
        field.truncate(stay);
        let samples = samples.min(worlds.len());
        weigh(&mut field, &worlds[seen..samples], judge);
        seen = samples;
        field.sort_by(|one, other| other.worth.total_cmp(&one.worth));
    }
    field
}

/// The best candidates that are no variants of a better one.
fn distinct(field: Vec<Candidate>, count: usize) -> Vec<Candidate> {
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in field {
        let repeats = |k: &Candidate| {
            k.aim.object == candidate.aim.object
                && wrapped_rad(k.aim.heading_rad - candidate.aim.heading_rad).abs() < ALIKE_RAD
        };
        if kept.len() < count && !kept.iter().any(repeats) {
            kept.push(candidate);
        }
    }
    kept
}

/// Headings closer together are variants of one strike (rad).
const ALIKE_RAD: f64 = 0.2;

/// Varies each candidate, every generation by less, and keeps what is better.
fn refined(
    mut field: Vec<Candidate>,
    (worlds, judge): (&[Possible], &Judge),
    (range, effort): (&Range, &Effort),
    seed: u64,
) -> Vec<Candidate> {
    let (generations, variants, samples) = effort.generations;
    let worlds = &worlds[..samples.min(worlds.len())];
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    for candidate in &mut field {
        candidate.worth = 0.0;
    }
    weigh(&mut field, worlds, judge);
    for generation in 0..generations {
        let width = 0.6f64.powi(i32::try_from(generation).unwrap_or(0));
        let mut tried: Vec<(usize, Candidate)> = Vec::new();
        for (line, parent) in field.iter().enumerate() {
            for _ in 0..variants {
                let aim = varied(&parent.aim, width, range, &mut rng);
                if let Ok(strike) = range.strike(&aim) {
                    tried.push((line, Candidate { aim, strike, worth: 0.0 }));
                }
            }
        }
        let (lines, mut children): (Vec<_>, Vec<_>) = tried.into_iter().unzip();
        weigh(&mut children, worlds, judge);
        for (line, child) in lines.into_iter().zip(children) {
            if child.worth > field[line].worth {
                field[line] = child;
            }
        }
    }
    field
}

/// An aim nearby.
fn varied(aim: &Aim, width: f64, range: &Range, rng: &mut Pcg64Mcg) -> Aim {
    let mut normal = || width * rng.sample::<f64, _>(StandardNormal);
    let heading_rad = wrapped_rad(aim.heading_rad + 0.12 * normal());
    let offset_m = aim.offset_m + 0.15 * normal() * range.reach_m(aim.object, heading_rad, 1.0);
    let most_m = 0.8 * range.reach_m(aim.object, heading_rad, offset_m);
    Aim {
        object: aim.object,
        heading_rad,
        offset_m: offset_m.clamp(-most_m, most_m),
        speed_m_s: (aim.speed_m_s * (0.15 * normal()).exp()).clamp(range.slowest_m_s, range.fastest_m_s),
        follow_through_m: (aim.follow_through_m * (0.4 * normal()).exp())
            .clamp(LEAST_FOLLOW_THROUGH_M, MOST_FOLLOW_THROUGH_M),
    }
}

fn cloud(strike: &Strike, worlds: &[Possible]) -> BTreeMap<String, Vec<Pose>> {
    let mut simulator = Simulator::new();
    let mut cloud: BTreeMap<String, Vec<Pose>> = BTreeMap::new();
    for possible in worlds {
        if let Ok(outcome) = simulator.run(&possible.world, &possible.executed(strike)) {
            for (name, pose) in by_name(&possible.world, &outcome.poses) {
                cloud.entry(name).or_default().push(pose);
            }
        }
    }
    cloud
}

/// The strike as written, simulated with the mean properties, and the answer in words.
fn finish(
    plan: &mut Plan,
    (nominal, properties): (&World, &Properties),
    best: &Candidate,
    robustness: Robustness,
) -> Result<()> {
    let strike = best.strike.clone();
    let outcome = Simulator::new().run(nominal, &strike)?;
    let final_poses = by_name(nominal, &outcome.poses);
    let singulation = Singulation::of(&plan.scene, &final_poses)?;
    let probability = robustness.success_probability;
    plan.outcome = if probability >= LEAST_PROBABILITY { Outcome::Found } else { Outcome::BestEffort };
    plan.reason = reason(plan, &strike, &robustness);
    plan.iterations = vec![Iteration {
        strike: strike.clone(),
        contact: contact(&best.aim, &plan.scene, properties)?,
        min_distance_m: singulation.min_distance_m(),
        mean_distance_m: singulation.mean_distance_m(),
        fulfilled: singulation.violations(&plan.scene.goal).is_empty(),
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

/// Whether a free object would be caught up within the follow-through (Eq. 27 and 28, corrected).
fn contact(aim: &Aim, scene: &Scene, properties: &Properties) -> Result<Contact> {
    let name = &scene.placed[aim.object].object;
    let restitution = properties.striker_restitution(name)?.mean;
    let deceleration_m_s2 = properties.friction(name)?.mean * GRAVITY_M_S2;
    let catch_up_m = 2.0 * restitution * aim.speed_m_s.powi(2) / deceleration_m_s2;
    Ok(if catch_up_m > aim.follow_through_m { Contact::Scattering } else { Contact::Pushing })
}

fn reason(plan: &Plan, strike: &Strike, robustness: &Robustness) -> String {
    let Robustness { success_probability, standard_error, samples, expected_singulated, .. } = robustness;
    let what = format!(
        "striking {} at {:.3} m/s works in {:.0} % (+- {:.1} %) of {samples} possible worlds",
        strike.object.as_deref().unwrap_or_default(),
        strike.speed_m_s,
        success_probability * 100.0,
        standard_error * 100.0
    );
    let fails = robustness
        .failures
        .first()
        .map(|failure| format!("; what fails most often: {} ({:.0} %)", failure.what, failure.part * 100.0));
    let best_effort = (plan.outcome == Outcome::BestEffort).then(|| {
        let all = plan.scene.placed.len();
        format!(
            "; no strike found works in half of them, and this one singulates {expected_singulated:.1} of {all} \
             objects on average"
        )
    });
    what + &fails.unwrap_or_default() + &best_effort.unwrap_or_default()
}
