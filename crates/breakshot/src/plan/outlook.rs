//! Where may everything come to rest after this one strike, and how probably is the pile singulated?
//!
//! A plan evaluates its winner in fresh scenarios ([`Method::Robust`](super::Method::Robust)). [`Possibilities`] holds the same scenarios of
//! a pile, drawn once, so that any strike can be evaluated in them within milliseconds, and a planned one gives the numbers of its plan.

use super::arm::{CellArm, laws_with};
use super::options::{Aim, Options};
use super::result::Failure;
use super::robust::budget::Budget;
use super::robust::evaluate::{Evaluation, expected_singulated, standard_error, success_probability};
use super::robust::explain::failures;
use super::robust::scenarios::{Draws, Nominal, Scenario};
use super::robust::strike_grid::StrikeGrid;
use super::robust::{SHOWN_SAMPLES, final_poses, final_seed};
use crate::error::Result;
use crate::geometry::Pose;
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use serde::Serialize;
use std::collections::BTreeMap;

/// The scenarios in which a robust plan evaluates its strike.
pub struct Possibilities {
    scene: Scene,
    scenarios: Vec<Scenario>,
}

/// The outcome of one strike in several scenarios.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Outlook {
    /// Fraction of the scenarios in which the strike fulfils the goal.
    pub success_probability: f64,
    /// Standard error of that fraction.
    pub standard_error: f64,
    /// Number of scenarios.
    pub samples: usize,
    /// Mean number of singulated objects.
    pub expected_singulated: f64,
    /// The violated conditions, the most frequent first.
    pub failures: Vec<Failure>,
    /// Final poses of each object in the first scenarios.
    #[serde(rename = "cloud")]
    pub final_poses: BTreeMap<String, Vec<Pose>>,
}

impl Possibilities {
    /// The number of scenarios in which a plan evaluates its strike.
    pub const OF_A_PLAN: usize = Budget::FULL.fresh;
    /// The number of scenarios whose final poses are part of a plan.
    pub const SHOWN: usize = SHOWN_SAMPLES;

    /// Draws `count` scenarios; with the seed of a plan they are the first ones of that plan.
    ///
    /// # Errors
    /// A scene that cannot be simulated.
    pub fn new(scene: &Scene, properties: &Properties, options: &Options, count: usize) -> Result<Self> {
        options.noise.check()?;
        let arm = CellArm::of(scene, options)?;
        let nominal = Nominal::new(scene, properties, options.noise, &laws_with(arm.as_ref()))?;
        let seed = final_seed(options.seed);
        let scenarios = nominal.scenarios(Draws { seed, count: count.max(1), fixed: None })?;
        Ok(Self { scene: scene.clone(), scenarios })
    }

    /// The outcome of a strike in the scenarios; the final poses are those of the first [`Possibilities::SHOWN`].
    ///
    /// # Errors
    /// An impossible strike.
    pub fn outlook(&self, strike: &Strike) -> Result<Outlook> {
        strike.check("strike")?;
        let shown = &self.scenarios[..Self::SHOWN.min(self.scenarios.len())];
        let margins = Evaluation::new(&self.scene, None)?.margins(strike, &self.scenarios);
        let success_probability = success_probability(&margins);
        Ok(Outlook {
            success_probability,
            standard_error: standard_error(success_probability, margins.len()),
            samples: margins.len(),
            expected_singulated: expected_singulated(&margins),
            failures: failures(&self.scene, &margins),
            final_poses: final_poses(strike, shown),
        })
    }
}

/// The strike of an aim, with the longest free lead-in, or a phrase for what is in its way.
///
/// # Errors
/// A scene that is not valid.
pub fn aimed(scene: &Scene, aim: &Aim) -> Result<std::result::Result<Strike, String>> {
    scene.check("scene")?;
    Ok(StrikeGrid::new(scene, None)?.strike(aim))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::plan;
    use crate::plan::tests::{properties, scene};
    use std::sync::Mutex;

    fn pile() -> Scene {
        scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.076, 0.0, 0.3), ("e", 0.03, 0.07, 0.0)])
    }

    #[test]
    fn the_outlook_of_a_planned_strike_has_the_numbers_of_its_plan() {
        let (scene, properties) = (pile(), properties());
        for seed in [0, 7] {
            let options = Options { seed, ..Options::default() };
            let plan = plan(&scene, &properties, &options).unwrap();
            let (strike, robustness) = plan.strike.zip(plan.robustness).unwrap();
            let drawn = |count| Possibilities::new(&scene, &properties, &options, count).unwrap();
            let outlook = drawn(Possibilities::OF_A_PLAN).outlook(&strike).unwrap();
            let first = drawn(60).outlook(&strike).unwrap();
            assert_eq!((first.samples, &first.final_poses), (60, &outlook.final_poses));
            assert_eq!(outlook.success_probability, robustness.success_probability);
            assert_eq!(outlook.standard_error, robustness.standard_error);
            assert_eq!(outlook.expected_singulated, robustness.expected_singulated);
            assert_eq!(outlook.samples, robustness.samples);
            assert_eq!(outlook.failures, robustness.failures);
            assert_eq!(outlook.final_poses, robustness.final_poses);
            let aim = Aim {
                object: strike.object.clone().unwrap(),
                heading_rad: strike.heading_rad,
                offset_m: 0.0,
                speed_m_s: 0.3,
                follow_through_m: 0.01,
            };
            let central = aimed(&scene, &aim).unwrap().unwrap();
            assert_eq!((central.object, central.speed_m_s), (strike.object, 0.3));
        }
    }

    #[test]
    fn a_search_reports_its_progress_and_its_plan_stays_the_same() {
        let (scene, properties) = (pile(), properties());
        let reported = Mutex::new(Vec::new());
        let progress = |done: f64| reported.lock().unwrap().push(done);
        let quiet = plan(&scene, &properties, &Options::default()).unwrap();
        let options = Options { progress: Some(&progress), ..Options::default() };
        assert_eq!(plan(&scene, &properties, &options).unwrap(), quiet);
        let reported = reported.into_inner().unwrap();
        let possible = reported.iter().all(|done| (0.0..1.0).contains(done));
        assert!(reported.len() > 5 && reported.is_sorted() && possible, "{reported:?}");
    }
}
