//! The feedback of Fig. 11: simulate, compare the distances with Eq. 35 and 36, correct the strike's speed.
//!
//! **Control law.** The sliding distance of an object is proportional to the square of its speed (Eq. 30), so the square of the speed
//! is corrected in proportion to the relative error: `v2 <- v2 (1 + GAIN error / wanted)`, at most by a factor of two up or down.  The
//! error is that of the worst condition: positive where distances are too small, negative where the mean distance or a displacement is
//! too large.  The set point is 2 % beyond the required value, which the feedback would otherwise only approach.  Speeds known to be
//! too slow and too fast bracket the next one.
//!
//! **Stop rule.** The first speed that fulfils the goal; else when the speed changes by less than 2 mm/s, when it is at the end of the
//! striker's range, or after twelve strikes.
//!
//! **Where the response is not monotonic** (walls, repeated impacts) the feedback can miss the speeds that work.  The striker's range
//! is then scanned, and of the speeds that fulfil the goal the middle of the longest run is taken.

use super::central_strikes::CentralStrike;
use crate::error::Result;
use crate::geometry::Pose;
use crate::physics::{Simulator, World};
use crate::plan::result::{Contact, Iteration};
use crate::scene::Scene;
use crate::scene::singulation::{Area, Misplaced, Singulation, Violation};
use std::collections::BTreeMap;

/// Gain from the relative error to the relative change of the squared speed.
const GAIN: f64 = 1.5;
/// The set point lies this fraction beyond the required value.
const BEYOND: f64 = 0.02;
/// Greatest factor by which one correction changes the squared speed.
const MOST_FACTOR: f64 = 2.0;
/// The feedback stops below this change of speed (m/s).
const LEAST_CHANGE_M_S: f64 = 2e-3;
/// Greatest number of strikes of the feedback.
const MOST_STEPS: usize = 12;
/// Number of speeds in a scan of the striker's range.
const SCAN_SPEEDS: u32 = 20;
/// Unit of the relative error for a goal without distances (m).
const FALLBACK_SCALE_M: f64 = 0.1;

/// A simulated strike.
#[derive(Clone, Debug)]
pub(crate) struct Trial {
    pub iteration: Iteration,
    pub final_poses: BTreeMap<String, Pose>,
    /// The violated conditions, the largest shortfall first.
    pub violations: Vec<Violation>,
}

impl Trial {
    pub(crate) fn fulfilled(&self) -> bool {
        self.violations.is_empty()
    }

    /// Number of fallen objects, and the largest shortfall (m).
    fn failure(&self) -> (usize, f64) {
        let fallen = |v: &&Violation| matches!(v, Violation::Misplaced(m) if m.area == Area::Table);
        let lost = self.violations.iter().filter(fallen).count();
        (lost, self.violations.first().map_or(0.0, Violation::shortfall_m))
    }

    /// Sorts the trial first in which fewer objects fall, then the one with the smaller shortfall.
    pub(crate) fn better_first(&self, other: &Self) -> std::cmp::Ordering {
        let ((lost, shortfall_m), (other_lost, other_shortfall_m)) = (self.failure(), other.failure());
        lost.cmp(&other_lost).then(shortfall_m.total_cmp(&other_shortfall_m))
    }
}

/// The search along one heading after the other, its history, and the best trial since the caller took it.
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

    /// A speed that fulfils the goal along this heading, by feedback, else by scan; `best` holds the best trial of all.
    pub(crate) fn run(&mut self, central: &CentralStrike) -> Result<Option<Trial>> {
        match self.feedback(central)? {
            Some(trial) => Ok(Some(trial)),
            None => self.scan(central),
        }
    }

    fn feedback(&mut self, central: &CentralStrike) -> Result<Option<Trial>> {
        let [slowest, fastest] = central.speed_range_m_s;
        let scale_m = self.scale_m();
        let mut speed_m_s = central.speed_for_slide_m_s(scale_m).clamp(slowest, fastest);
        let (mut too_slow, mut too_fast) = (slowest, fastest);
        for _ in 0..MOST_STEPS {
            let trial = self.simulate(central, speed_m_s)?;
            let Some(worst) = trial.violations.first() else {
                return Ok(Some(trial));
            };
            let error = worst.shortfall_m() / scale_m + BEYOND;
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
            // Outside the bracket the law is useless: bisect.
            let known = (next <= too_slow && too_slow > slowest) || (next >= too_fast && too_fast < fastest);
            let next = if known { f64::midpoint(too_slow, too_fast) } else { next };
            if (next - speed_m_s).abs() < LEAST_CHANGE_M_S {
                return Ok(None);
            }
            speed_m_s = next;
        }
        Ok(None)
    }

    fn scan(&mut self, central: &CentralStrike) -> Result<Option<Trial>> {
        let [slowest, fastest] = central.speed_range_m_s;
        let mut runs: Vec<Vec<Trial>> = vec![Vec::new()];
        for k in 0..SCAN_SPEEDS {
            let fraction = f64::from(k) / f64::from(SCAN_SPEEDS - 1);
            let trial = self.simulate(central, slowest + fraction * (fastest - slowest))?;
            match runs.last_mut() {
                Some(run) if trial.fulfilled() => run.push(trial),
                _ => runs.push(Vec::new()),
            }
        }
        // Of equally long runs the slowest: `max_by_key` returns the last maximum.
        let longest = runs.into_iter().rev().max_by_key(Vec::len).unwrap_or_default();
        let middle = longest.len() / 2;
        Ok(longest.into_iter().nth(middle))
    }

    /// A strike of this speed; one whose simulation is given up does not fulfil the goal.
    fn simulate(&mut self, central: &CentralStrike, speed_m_s: f64) -> Result<Trial> {
        let [slowest, fastest] = central.speed_range_m_s;
        let mut strike = central.strike(speed_m_s);
        // Rounding may leave the striker's range.
        strike.speed_m_s = strike.speed_m_s.clamp(slowest, fastest);
        let outcome = self.simulator.run(self.world, &strike)?;
        let final_poses = self.world.by_name(&outcome.poses);
        let singulation = Singulation::of(self.scene, &final_poses)?;
        let mut violations = singulation.violations().to_vec();
        let fallen = self.world.names().iter().zip(&outcome.fallen).filter(|(_, fallen)| **fallen);
        for (object, _) in
            fallen.filter(|(name, _)| !singulation.misplaced.iter().any(|m| m.object == **name))
        {
            // The pose of a fallen object is the one at the edge, which rounding may put on the table.
            violations.push(Violation::Misplaced(Misplaced {
                object: object.clone(),
                area: Area::Table,
                by_m: 0.0,
            }));
        }
        if !outcome.complete {
            violations.insert(0, Violation::Unfinished { after_s: outcome.duration_s });
        }
        let follow_through_m = strike.travel_m - central.lead_in_m;
        let scatters = central.catch_up_m(strike.speed_m_s) > follow_through_m;
        let iteration = Iteration {
            strike,
            contact: if scatters { Contact::Scattering } else { Contact::Pushing },
            min_distance_m: singulation.min_distance_m(),
            mean_distance_m: singulation.mean_distance_m(),
            fulfilled: violations.is_empty(),
        };
        self.iterations.push(iteration.clone());
        let trial = Trial { iteration, final_poses, violations };
        let better = |best: &Trial| trial.better_first(best).is_lt();
        if self.best.as_ref().is_none_or(better) {
            self.best = Some(trial.clone());
        }
        Ok(trial)
    }

    /// The distance that the goal requires (m): the unit of the relative error, and the sliding distance of the first speed.
    fn scale_m(&self) -> f64 {
        let goal = &self.scene.goal;
        let scale_m = goal.min_distance_m.max(goal.mean_distance_m[0]).max(goal.min_gap_m);
        if scale_m > 0.0 { scale_m } else { FALLBACK_SCALE_M }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::Options;
    use crate::plan::paper::central_strikes::central_strikes;
    use crate::plan::tests::{properties, scene};
    use crate::uncertain::Estimate;

    #[test]
    fn a_strike_whose_simulation_is_given_up_fulfils_no_goal() {
        // A slow push into a pile against much friction is more than a hundred thousand hops.
        let mut scene = scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.07, 0.028, 0.0), ("e", 0.05, -0.0495, 0.0)]);
        scene.cell.striker.speed_range_m_s = [0.0005, 0.002];
        let mut properties = properties();
        for friction in properties.friction.values_mut() {
            *friction = Estimate::exact(10.0);
        }
        let world = World::new(&scene, &properties, &Options::default()).expect("a scene");
        let strikes = central_strikes(&scene, &properties, None, &scene.placed[0]).expect("an object");
        let Ok(strikes) = strikes else { panic!("not free") };
        let central = strikes.iter().max_by(|a, b| a.towards_pile.total_cmp(&b.towards_pile)).expect("one");
        let trial = Search::new(&scene, &world).simulate(central, 0.0005).expect("a strike");
        assert!(matches!(trial.violations[0], Violation::Unfinished { .. }), "{:?}", trial.violations);
        assert!(!trial.fulfilled() && trial.violations[0].to_string().contains("given up"));
    }
}
