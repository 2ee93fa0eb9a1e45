//! What becomes of the goal in each of the worlds that may be?

use super::goal_margin::{Judge, Verdict};
use super::scenarios::Possible;
use super::strike_grid::Candidate;
use crate::physics::Simulator;
use crate::scene::Strike;
use rayon::prelude::*;

/// An outcome that misses or fulfils the goal by this much (m) is still half a question of luck.
const SOFT_M: f64 = 0.008;
/// What singulating all objects counts beside fulfilling the goal: it decides where nothing fulfils it.
const SINGULATED_WEIGHT: f64 = 0.1;
/// Judges every candidate on the same worlds, and adds up what it is worth there.
pub(crate) fn weigh(field: &mut [Candidate], worlds: &[Possible], judge: &Judge) {
    let all = judge.count() as f64;
    field.par_iter_mut().for_each_init(Simulator::new, |simulator, candidate| {
        for world in worlds {
            candidate.worth += worth(&verdict(simulator, world, &candidate.strike, judge), all);
        }
    });
}

/// Between 0 and 1 for how clearly the goal is missed or fulfilled, a little more for every singulated object.
fn worth(verdict: &Verdict, all: f64) -> f64 {
    let clearly = 1.0 / (1.0 + (-verdict.margin_m / SOFT_M).exp());
    clearly + SINGULATED_WEIGHT * verdict.singulated as f64 / all
}

/// What becomes of the goal if the arm is told this strike in this world.
fn verdict(simulator: &mut Simulator, possible: &Possible, strike: &Strike, judge: &Judge) -> Verdict {
    // A striker that starts inside something, by an error of the poses, has failed.
    simulator
        .run(&possible.world, &possible.executed(strike))
        .map_or(Verdict::FAILED, |outcome| judge.verdict(&outcome))
}

/// What each candidate is worth in these worlds.
pub(crate) fn judged(field: &[Candidate], worlds: &[Possible], judge: &Judge) -> Vec<(Candidate, f64)> {
    let all = judge.count() as f64;
    field
        .iter()
        .map(|candidate| {
            let verdicts = verdicts(&candidate.strike, worlds, judge);
            // What counts in the end is how often the goal holds; how clearly decides between equals.
            let clearly = verdicts.iter().map(|v| worth(v, all)).sum::<f64>() / verdicts.len() as f64;
            let worth = part(&verdicts, Verdict::fulfilled) + TIE_WEIGHT * clearly;
            (candidate.clone(), worth)
        })
        .collect()
}

/// Small against the standard error of a success probability.
const TIE_WEIGHT: f64 = 0.01;

/// The verdicts on one strike in every world.
pub(crate) fn verdicts(strike: &Strike, worlds: &[Possible], judge: &Judge) -> Vec<Verdict> {
    worlds
        .par_iter()
        .map_init(Simulator::new, |simulator, world| verdict(simulator, world, strike, judge))
        .collect()
}

/// The part of the verdicts for which something holds.
pub(crate) fn part(verdicts: &[Verdict], holds: impl Fn(&Verdict) -> bool) -> f64 {
    verdicts.iter().filter(|v| holds(v)).count() as f64 / verdicts.len() as f64
}

/// How many objects are singulated, on average.
pub(crate) fn expected_singulated(verdicts: &[Verdict]) -> f64 {
    verdicts.iter().map(|v| v.singulated as f64).sum::<f64>() / verdicts.len() as f64
}

/// Of a part of `n` (Agresti and Coull: never zero, however clear the count).
pub(crate) fn standard_error(part: f64, n: usize) -> f64 {
    let n = n as f64 + 4.0;
    let centred = (part * (n - 4.0) + 2.0) / n;
    (centred * (1.0 - centred) / n).sqrt()
}
