//! By what margin does a strike fulfil the goal in each scenario?

use super::scenarios::Scenario;
use super::strike_grid::StrikeCandidate;
use crate::error::Result;
use crate::physics::Simulator;
use crate::plan::options::Stopped;
use crate::scene::goal_margin::{GoalEvaluator, GoalMargin};
use crate::scene::{Scene, Strike};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Scale of the logistic score (m): a margin of `+SOFT_M` scores 0.73, of `-SOFT_M` 0.27, so that the search has a slope where no sample
/// succeeds.
const SOFT_M: f64 = 0.008;
/// Weight of the fraction of singulated objects beside the score of the margin: it decides where no strike fulfils the goal.
const SINGULATED_WEIGHT: f64 = 0.1;
/// Weight of the score beside the success probability, small against the standard error of that: it decides between equal probabilities.
const TIE_WEIGHT: f64 = 0.01;

/// Simulates strikes, evaluates the goal, and counts the simulations.
pub(crate) struct Evaluation<'a> {
    goal: GoalEvaluator<'a>,
    rollouts: AtomicUsize,
    stopped: Option<Stopped<'a>>,
}

impl<'a> Evaluation<'a> {
    /// From when on `stopped` holds nothing is simulated any more.
    pub(crate) fn new(scene: &'a Scene, stopped: Option<Stopped<'a>>) -> Result<Self> {
        Ok(Self { goal: GoalEvaluator::new(scene)?, rollouts: AtomicUsize::new(0), stopped })
    }

    /// Number of simulated strikes so far.
    pub(crate) fn rollouts(&self) -> usize {
        self.rollouts.load(Ordering::Relaxed)
    }

    /// The margin of one strike in every scenario.
    pub(crate) fn margins(&self, strike: &Strike, scenarios: &[Scenario]) -> Vec<GoalMargin> {
        scenarios
            .par_iter()
            .map_init(Simulator::new, |simulator, scenario| self.margin(simulator, scenario, strike))
            .collect()
    }

    fn margin(&self, simulator: &mut Simulator, scenario: &Scenario, strike: &Strike) -> GoalMargin {
        if self.stopped.is_some_and(|stopped| stopped()) {
            return GoalMargin::FAILED;
        }
        // In a scenario the striker may start inside an object: the strike has failed then.
        simulator.run(&scenario.world, &scenario.executed(strike)).map_or(GoalMargin::FAILED, |outcome| {
            self.rollouts.fetch_add(1, Ordering::Relaxed);
            if outcome.complete {
                self.goal.margin(&outcome.poses, &outcome.fallen)
            } else {
                GoalMargin::FAILED
            }
        })
    }

    /// Adds the scores in these scenarios to every candidate.
    pub(crate) fn add_scores(&self, candidates: &mut [StrikeCandidate], scenarios: &[Scenario]) {
        candidates.par_iter_mut().for_each_init(Simulator::new, |simulator, candidate| {
            for scenario in scenarios {
                candidate.score += self.score(&self.margin(simulator, scenario, &candidate.strike));
            }
        });
    }

    /// A logistic score of the margin between 0 and 1, and a little more for every singulated object.
    fn score(&self, margin: &GoalMargin) -> f64 {
        let logistic = 1.0 / (1.0 + (-margin.margin_m / SOFT_M).exp());
        logistic + SINGULATED_WEIGHT * margin.singulated as f64 / self.goal.count() as f64
    }

    /// The success probability and the mean score of each candidate in these scenarios.
    pub(crate) fn compared(&self, candidates: Vec<StrikeCandidate>, scenarios: &[Scenario]) -> Vec<Compared> {
        let compared = |candidate: StrikeCandidate| {
            let margins = self.margins(&candidate.strike, scenarios);
            let score = margins.iter().map(|m| self.score(m)).sum::<f64>() / margins.len() as f64;
            Compared { candidate, success_probability: success_probability(&margins), score }
        };
        candidates.into_iter().map(compared).collect()
    }
}

/// A strike in scenarios that took no part in its search.
pub(crate) struct Compared {
    pub candidate: StrikeCandidate,
    pub success_probability: f64,
    /// Mean score of the margin.
    score: f64,
}

impl Compared {
    /// What is maximised: the success probability, and the score where that is equal.
    pub(crate) fn value(&self) -> f64 {
        self.success_probability + TIE_WEIGHT * self.score
    }
}

/// Fraction of the scenarios in which the goal is fulfilled.
pub(crate) fn success_probability(margins: &[GoalMargin]) -> f64 {
    margins.iter().filter(|m| m.fulfilled()).count() as f64 / margins.len() as f64
}

/// Mean number of singulated objects.
pub(crate) fn expected_singulated(margins: &[GoalMargin]) -> f64 {
    margins.iter().map(|m| m.singulated as f64).sum::<f64>() / margins.len() as f64
}

/// Standard error of a fraction of `n` (Agresti and Coull 1998: never zero, also for 0 of n).
pub(crate) fn standard_error(fraction: f64, n: usize) -> f64 {
    let n = n as f64 + 4.0;
    let centred = (fraction * (n - 4.0) + 2.0) / n;
    (centred * (1.0 - centred) / n).sqrt()
}
