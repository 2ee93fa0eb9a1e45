//! A search for good strikes in a fixed set of scenarios: successive halving, then variation of the best distinct strikes.

use super::budget::Budget;
use super::evaluate::Evaluation;
use super::scenarios::Scenario;
use super::strike_grid::{LEAST_FOLLOW_THROUGH_M, MOST_FOLLOW_THROUGH_M, StrikeCandidate, StrikeGrid};
use crate::geometry::wrapped_rad;
use crate::plan::arm::{CellArm, Execution};
use crate::plan::options::Aim;
use crate::statistics::sorted_by_value;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Factor by which the variation narrows from one generation to the next.
const NARROWING: f64 = 0.6;

/// The search for good strikes in a fixed set of scenarios.
pub(super) struct Search<'a> {
    pub(super) grid: &'a StrikeGrid<'a>,
    pub(super) evaluation: &'a Evaluation<'a>,
    pub(super) scenarios: &'a [Scenario],
    pub(super) budget: &'a Budget,
    pub(super) arm: Option<&'a CellArm<'a>>,
}

/// Strikes in the order of their scores: those that took part in the last round of successive halving, and those that did not.
pub(super) struct Halved {
    last_round: Vec<StrikeCandidate>,
    eliminated: Vec<StrikeCandidate>,
}

/// A finalist and its variants.
struct Line {
    /// Those that a later one improved, in this order.
    earlier: Vec<StrikeCandidate>,
    /// The latest one, which is the best.
    last: StrikeCandidate,
}

impl Line {
    fn new(strike: StrikeCandidate) -> Self {
        Self { earlier: Vec::new(), last: StrikeCandidate { score: 0.0, ..strike } }
    }
}

/// The variants of one line in a generation.
#[derive(Clone, Copy)]
struct Variation {
    count: usize,
    /// Scale of all standard deviations.
    width: f64,
}

impl Search<'_> {
    /// Successive halving: each round evaluates the better strikes of the last one in more scenarios.
    /// `report` gets the part of the rounds that are done.
    pub(super) fn halved(&self, mut strikes: Vec<StrikeCandidate>, report: impl Fn(f64)) -> Halved {
        let mut evaluated = 0;
        let mut eliminated: Vec<StrikeCandidate> = Vec::new();
        for (k, round) in self.budget.rounds.iter().enumerate() {
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
    pub(super) fn finalists(
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

    /// Varies the strikes, every generation fewer of them and by less, and keeps of each the best variant that the arm can execute.
    pub(super) fn refined(&self, strikes: Vec<StrikeCandidate>, seed: u64) -> Vec<StrikeCandidate> {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut lines: Vec<Line> = strikes.into_iter().map(Line::new).collect();
        let mut width = 1.0;
        let mut evaluated = 0;
        for generation in self.budget.generations {
            let samples = generation.samples.min(self.scenarios.len()).max(evaluated);
            self.add_scores_of_last(&mut lines, &self.scenarios[evaluated..samples]);
            evaluated = samples;
            lines = sorted_by_value(lines, |line| -line.last.score);
            lines.truncate(generation.strikes);
            let variation = Variation { count: generation.variants, width };
            self.vary(&mut lines, variation, &self.scenarios[..samples], &mut rng);
            width *= NARROWING;
        }
        lines.into_par_iter().map(|line| self.latest_executable(line)).collect()
    }

    /// Adds the scores in further scenarios to the latest variant of each line.
    fn add_scores_of_last(&self, lines: &mut [Line], scenarios: &[Scenario]) {
        let mut last: Vec<StrikeCandidate> = lines.iter().map(|line| line.last.clone()).collect();
        self.evaluation.add_scores(&mut last, scenarios);
        for (line, last) in lines.iter_mut().zip(last) {
            line.last = last;
        }
    }

    /// One generation: the best of some variants becomes the latest of each line, if it is better than that.
    fn vary(&self, lines: &mut [Line], variation: Variation, scenarios: &[Scenario], rng: &mut Pcg64Mcg) {
        let mut tried: Vec<(usize, StrikeCandidate)> = Vec::new();
        for (k, line) in lines.iter().enumerate() {
            for _ in 0..variation.count {
                let aim = self.varied(&line.last.aim, variation.width, rng);
                tried.extend(self.grid.candidate(aim).ok().map(|candidate| (k, candidate)));
            }
        }
        let (of_line, mut children): (Vec<_>, Vec<_>) = tried.into_iter().unzip();
        self.evaluation.add_scores(&mut children, scenarios);
        let mut best: Vec<Option<StrikeCandidate>> = vec![None; lines.len()];
        for (k, child) in of_line.into_iter().zip(children) {
            if child.score > best[k].as_ref().unwrap_or(&lines[k].last).score {
                best[k] = Some(child);
            }
        }
        for (line, best) in lines.iter_mut().zip(best) {
            if let Some(best) = best {
                line.earlier.push(std::mem::replace(&mut line.last, best));
            }
        }
    }

    /// The latest variant that the arm can execute, with the travel after which the arm stops; the first strike of the line is one.
    fn latest_executable(&self, Line { mut earlier, last }: Line) -> StrikeCandidate {
        let Some(arm) = self.arm else { return last };
        let mut candidate = last;
        loop {
            match (arm.execution(&candidate.strike), earlier.pop()) {
                (Execution::Refused(_), Some(before)) => candidate = before,
                (Execution::Overshoot(beyond_m), _) => return self.lengthened(candidate, beyond_m),
                (Execution::Refused(_) | Execution::AsPlanned, _) => return candidate,
            }
        }
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
