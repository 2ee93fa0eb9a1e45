//! The feedback of Fig. 11: simulate, measure what the distances lack to Eq. 35 and 36, correct the strike's speed.
//!
//! **Law.** What an object slides grows with the square of its speed (Eq. 30), so the speed's square is corrected in
//! proportion to the relative error: `v2 <- v2 (1 + GAIN error / wanted)`, at most by a factor of two either way.  The
//! error is the worst condition's: positive where distances are too small, negative where the mean distance or an object's
//! way is too large; it is measured to 2 % beyond what is wanted, which is else approached without end.  Speeds known to be
//! too slow and too fast bracket the next one.
//!
//! **Stop.** The first speed that fulfils the goal; else when the speed changes by less than 2 mm/s, stands at the end
//! of the striker's range, or after twelve strikes.
//!
//! **When the response is not monotonic** (walls, objects that meet again) the feedback can miss the speeds that work.
//! Then the striker's range is scanned, and of the speeds that fulfil the goal the middle of the longest run is taken.

use super::central_strikes::Candidate;
use crate::error::Result;
use crate::geometry::Pose;
use crate::physics::{Simulator, World};
use crate::plan::result::{Contact, Iteration};
use crate::scene::Scene;
use crate::singulation::{Area, Misplaced, Singulation, Violation};
use std::collections::BTreeMap;

/// How strongly the relative error acts on the speed's square.
const GAIN: f64 = 1.5;
/// The feedback aims this part beyond what is wanted.
const AIM_BEYOND: f64 = 0.02;
/// One correction changes the speed's square at most by this factor.
const MOST_FACTOR: f64 = 2.0;
/// A smaller change than this is no change (m/s).
const LEAST_CHANGE_M_S: f64 = 2e-3;
/// The feedback ends after so many strikes.
const MOST_STEPS: usize = 12;
/// Speeds in a scan of the striker's range.
const SCAN_SPEEDS: u32 = 20;
/// Where the goal wants no distance, errors are measured in this length (m).
const FALLBACK_SCALE_M: f64 = 0.1;

/// A simulated strike.
#[derive(Clone, Debug)]
pub(crate) struct Trial {
    pub iteration: Iteration,
    pub final_poses: BTreeMap<String, Pose>,
    /// The conditions that do not hold, the worst first.
    pub violations: Vec<Violation>,
}

impl Trial {
    pub(crate) fn fulfilled(&self) -> bool {
        self.violations.is_empty()
    }

    /// What is worse is greater: lost objects, then how much the worst condition lacks (m).
    fn badness(&self) -> (usize, f64) {
        let fallen = |v: &&Violation| matches!(v, Violation::Misplaced(m) if m.area == Area::Table);
        let lost = self.violations.iter().filter(fallen).count();
        (lost, self.violations.first().map_or(0.0, Violation::shortfall_m))
    }
}

/// All strikes simulated so far.
pub(crate) struct Search<'a> {
    scene: &'a Scene,
    world: &'a World,
    simulator: Simulator,
    pub iterations: Vec<Iteration>,
    pub best: Option<Trial>,
}

impl<'a> Search<'a> {
    pub(crate) fn new(scene: &'a Scene, world: &'a World) -> Self {
        Self { scene, world, simulator: Simulator::new(), iterations: Vec::new(), best: None }
    }

    /// A speed that fulfils the goal along this heading, by feedback, else by scan; the best trial is kept in any case.
    pub(crate) fn run(&mut self, candidate: &Candidate) -> Result<Option<Trial>> {
        match self.feedback(candidate)? {
            Some(trial) => Ok(Some(trial)),
            None => self.scan(candidate),
        }
    }

    fn feedback(&mut self, candidate: &Candidate) -> Result<Option<Trial>> {
        let [slowest, fastest] = self.scene.cell.striker.speed_range_m_s;
        let scale_m = self.scale_m();
        let mut speed_m_s = candidate.speed_for_slide_m_s(scale_m).clamp(slowest, fastest);
        let (mut too_slow, mut too_fast) = (slowest, fastest);
        for _ in 0..MOST_STEPS {
            let trial = self.simulate(candidate, speed_m_s)?;
            let Some(worst) = trial.violations.first() else {
                return Ok(Some(trial));
            };
            let error = worst.shortfall_m() / scale_m + AIM_BEYOND;
            let error = if worst.is_excess() { -error } else { error };
            if error > 0.0 {
                too_slow = too_slow.max(speed_m_s);
            } else {
                too_fast = too_fast.min(speed_m_s);
            }
            if too_slow >= too_fast {
                return Ok(None);
            }
            let factor = (1.0 + GAIN * error).clamp(1.0 / MOST_FACTOR, MOST_FACTOR);
            let next = (speed_m_s * factor.sqrt()).clamp(slowest, fastest);
            // Beyond what is known to be too slow or too fast the law has nothing to say: halve what is left.
            let known = (next <= too_slow && too_slow > slowest) || (next >= too_fast && too_fast < fastest);
            let next = if known { f64::midpoint(too_slow, too_fast) } else { next };
            if (next - speed_m_s).abs() < LEAST_CHANGE_M_S {
                return Ok(None);
            }
            speed_m_s = next;
        }
        Ok(None)
    }

    fn scan(&mut self, candidate: &Candidate) -> Result<Option<Trial>> {
        let [slowest, fastest] = self.scene.cell.striker.speed_range_m_s;
        let mut runs: Vec<Vec<Trial>> = vec![Vec::new()];
        for k in 0..SCAN_SPEEDS {
            let part = f64::from(k) / f64::from(SCAN_SPEEDS - 1);
            let trial = self.simulate(candidate, slowest + part * (fastest - slowest))?;
            match runs.last_mut() {
                Some(run) if trial.fulfilled() => run.push(trial),
                _ => runs.push(Vec::new()),
            }
        }
        // Of equally long runs the slowest: `max_by_key` keeps the last one.
        let longest = runs.into_iter().rev().max_by_key(Vec::len).unwrap_or_default();
        let middle = longest.len() / 2;
        Ok(longest.into_iter().nth(middle))
    }

    fn simulate(&mut self, candidate: &Candidate, speed_m_s: f64) -> Result<Trial> {
        let [slowest, fastest] = self.scene.cell.striker.speed_range_m_s;
        let mut strike = candidate.strike(speed_m_s);
        // Rounding may lead out of the striker's range.
        strike.speed_m_s = strike.speed_m_s.clamp(slowest, fastest);
        let outcome = self.simulator.run(self.world, &strike)?;
        let final_poses = self.world.names().iter().cloned().zip(outcome.poses).collect();
        let singulation = Singulation::of(self.scene, &final_poses)?;
        let mut violations = singulation.violations(&self.scene.goal);
        let fallen = self.world.names().iter().zip(&outcome.fallen).filter(|(_, fallen)| **fallen);
        for (object, _) in
            fallen.filter(|(name, _)| !singulation.misplaced.iter().any(|m| m.object == **name))
        {
            // Its pose is the one at the edge, by rounding just on the table.
            violations.push(Violation::Misplaced(Misplaced {
                object: object.clone(),
                area: Area::Table,
                by_m: 0.0,
            }));
        }
        let follow_through_m = strike.travel_m - candidate.lead_in_m;
        let scatters = candidate.catch_up_m(strike.speed_m_s) > follow_through_m;
        let iteration = Iteration {
            strike,
            contact: if scatters { Contact::Scattering } else { Contact::Pushing },
            min_distance_m: singulation.min_distance_m(),
            mean_distance_m: singulation.mean_distance_m(),
            fulfilled: violations.is_empty(),
        };
        self.iterations.push(iteration.clone());
        let trial = Trial { iteration, final_poses, violations };
        let better = |best: &Trial| {
            let ((lost, lacks_m), (best_lost, best_lacks_m)) = (trial.badness(), best.badness());
            lost < best_lost || (lost == best_lost && lacks_m < best_lacks_m)
        };
        if self.best.as_ref().is_none_or(better) {
            self.best = Some(trial.clone());
        }
        Ok(trial)
    }

    /// The distance that the goal asks for (m): errors are measured in it, and the first speed aims at it.
    fn scale_m(&self) -> f64 {
        let goal = &self.scene.goal;
        let scale_m = goal.min_distance_m.max(goal.mean_distance_m[0]).max(goal.min_gap_m);
        if scale_m > 0.0 { scale_m } else { FALLBACK_SCALE_M }
    }
}
