//! What might the true state be?  Scenarios of everything that is uncertain about a scene, one by one, for rollouts beside those of the planner.

use super::options::ExecutionNoise;
use super::robust::scenarios::{Distribution, Nominal, Sampler, Scenario};
use crate::error::Result;
use crate::physics::{self, World};
use crate::properties::Properties;
use crate::scene::Scene;
use std::borrow::Cow;

/// The scenarios of a scene: the distribution from which robust plans and surveys draw.
pub struct Scenarios {
    nominal: Nominal<'static>,
    distribution: Distribution,
}

impl Scenarios {
    /// The distribution about a scene and properties; what no clip measured is drawn from its prior.
    ///
    /// # Errors
    /// A scene that cannot be simulated, impossible noise.
    pub fn new(
        scene: &Scene,
        properties: &Properties,
        noise: ExecutionNoise,
        laws: &physics::Options,
    ) -> Result<Self> {
        noise.check()?;
        let Nominal { properties, world, .. } = Nominal::new(scene, properties, noise, laws)?;
        let distribution = Distribution::of(&properties);
        let properties = Cow::Owned(properties.into_owned());
        let nominal = Nominal { scene: Cow::Owned(scene.clone()), properties, noise, world };
        Ok(Self { nominal, distribution })
    }

    /// The world with the properties at their means and the objects where they were seen.
    pub fn mean(&self) -> &World {
        &self.nominal.world
    }

    /// Draw number `k` of a seed, which depends on these two numbers alone.
    ///
    /// # Errors
    /// A drawn scene that cannot be simulated.
    pub fn draw(&self, seed: u64, k: u64) -> Result<Scenario> {
        self.nominal.scenario(&self.distribution, Sampler::new(seed, k, None))
    }
}

/// `count` draws of the measured properties: values of a single strike, each exact.  Draw `k` depends on the seed and
/// `k` alone.
pub fn drawn_properties(properties: &Properties, count: usize, seed: u64) -> Vec<Properties> {
    let distribution = Distribution::of(properties);
    let draw = |k: usize| Sampler::new(seed, k as u64, None).properties(&distribution).exact();
    (0..count).map(draw).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::Simulator;
    use crate::plan::tests::{properties, scene};
    use crate::scene::Strike;
    use crate::uncertain::Estimate;

    fn uncertain() -> Properties {
        let mut uncertain = properties();
        for friction in uncertain.friction.values_mut() {
            friction.standard_error = 0.02;
        }
        uncertain
    }

    #[test]
    fn a_draw_depends_on_the_seed_and_its_number_alone() {
        let scene = scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.09, 0.0, 0.0)]);
        let scenarios = || {
            let laws = physics::Options::default();
            Scenarios::new(&scene, &uncertain(), ExecutionNoise::default(), &laws).expect("scenarios")
        };
        let start_m = crate::geometry::Point::new(-0.2, 0.01);
        let strike = Strike { start_m, speed_m_s: 0.5, travel_m: 0.2, ..Strike::default() };
        let hash = |scenarios: &Scenarios, seed: u64, k: u64| {
            let drawn = scenarios.draw(seed, k).expect("a scenario");
            Simulator::new().run(&drawn.world, &drawn.executed(&strike)).expect("a strike").bit_hash()
        };
        let (one, other) = (scenarios(), scenarios());
        assert_ne!(hash(&one, 1, 0), hash(&one, 1, 7));
        assert_eq!(hash(&one, 1, 7), hash(&other, 1, 7));
        assert_ne!(hash(&other, 1, 7), hash(&other, 2, 7));
    }

    #[test]
    fn drawn_properties_are_exact_and_spread_as_their_uncertainty() {
        let drawn = drawn_properties(&uncertain(), 2000, 3);
        let frictions: Vec<f64> = drawn.iter().map(|p| p.friction["a"].mean).collect();
        let mean = frictions.iter().sum::<f64>() / 2000.0;
        let std = (frictions.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / 2000.0).sqrt();
        let found = properties().friction["a"].mean;
        assert!((mean - found).abs() < 0.002, "mean friction {mean}, not {found}");
        assert!((std - 0.02).abs() < 0.0015, "spread {std}, not 0.02");
        assert!(drawn.iter().all(|p| p.friction["a"] == Estimate::exact(p.friction["a"].mean)));
        assert_eq!(drawn_properties(&uncertain(), 5, 3), drawn[..5]);
    }
}
