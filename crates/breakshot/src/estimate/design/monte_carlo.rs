//! How large is the uncertainty of final positions without linearization?  Rollouts with randomly drawn parameters.

use super::experiment::Setup;
use super::prior::Prior;
use super::sensitivity::{self, Draws, PileSimulation, StruckPile};
use crate::cell::Cell;
use crate::error::{Error, Result};
use crate::geometry::{Point, Vec2};
use crate::object::Object;
use crate::physics::Simulator;
use crate::properties::Properties;
use nalgebra::{DVector, SymmetricEigen};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Random strikes on random piles of these objects, slow enough for the struck object to stay in the workspace.
///
/// # Errors
/// No pile of these objects can be struck.
pub fn struck_piles(
    properties: &Properties,
    cell: &Cell,
    objects: &[Object],
    draws: Draws,
) -> Result<Vec<StruckPile>> {
    let prior = Prior::new(properties, objects, false);
    let piles = sensitivity::random_struck_piles(&prior, Setup { cell, objects }, None, draws)?;
    if piles.is_empty() {
        return Err(Error::invalid("piles", "strikes", "none", "objects that the striker can reach"));
    }
    Ok(piles)
}

/// Standard deviation of an object's final position (m), the mean over all objects of all piles.
///
/// For every pile the parameters are drawn `draws.count` times from the estimate's distribution (Monte Carlo).
pub fn predictive_std_m(
    properties: &Properties,
    objects: &[Object],
    piles: &[StruckPile],
    draws: Draws,
) -> f64 {
    let prior = Prior::new(properties, objects, false);
    let size = prior.parameters.len();
    let eigen = SymmetricEigen::new(prior.covariance.clone());
    let scales = eigen.eigenvalues.map(|v| v.max(0.0).sqrt());
    let mut random = Pcg64Mcg::seed_from_u64(draws.seed);
    let samples: Vec<Properties> = (0..draws.count)
        .map(|_| {
            let normal = DVector::from_fn(size, |k, _| {
                let z: f64 = StandardNormal.sample(&mut random);
                z * scales[k]
            });
            let drawn = &eigen.eigenvectors * normal;
            prior.changed(&drawn.iter().copied().enumerate().collect::<Vec<_>>()).0
        })
        .collect();
    let of_piles: Vec<Vec<f64>> = piles.par_iter().map(|pile| position_stds_m(pile, &samples)).collect();
    let all: Vec<f64> = of_piles.into_iter().flatten().collect();
    all.iter().sum::<f64>() / all.len().max(1) as f64
}

/// Distance between predicted and true final positions (m), the mean over all objects of all piles.
///
/// `truth` holds the true properties; parameters that the estimate lacks have the default values of [`super::advice`].
pub fn prediction_error_m(
    properties: &Properties,
    truth: &Properties,
    objects: &[Object],
    piles: &[StruckPile],
) -> f64 {
    let prior = Prior::new(properties, objects, false);
    let of_pile = |pile: &StruckPile| {
        let simulation = PileSimulation::new(pile, truth)?;
        let mut simulator = Simulator::new();
        let predicted = simulation.final_positions(&prior.properties, &mut simulator)?;
        let real = simulation.final_positions(truth, &mut simulator)?;
        Some(predicted.iter().zip(&real).map(|(p, q)| p.distance(*q)).collect::<Vec<_>>())
    };
    let all: Vec<f64> = piles.par_iter().filter_map(of_pile).collect::<Vec<_>>().concat();
    all.iter().sum::<f64>() / all.len().max(1) as f64
}

/// Standard deviation of each object's final position over samples of the properties (m, root of the sum over both axes).
fn position_stds_m(pile: &StruckPile, samples: &[Properties]) -> Vec<f64> {
    let mut simulator = Simulator::new();
    let simulation = samples.first().and_then(|sample| PileSimulation::new(pile, sample));
    let Some(simulation) = simulation else { return Vec::new() };
    let ends: Vec<Vec<Point>> =
        samples.iter().filter_map(|s| simulation.final_positions(s, &mut simulator)).collect();
    if ends.len() < 2 {
        return Vec::new();
    }
    let count = ends.len() as f64;
    (0..pile.scene.placed.len())
        .map(|k| {
            let sum = ends.iter().fold(Vec2::ZERO, |sum, end| sum + end[k].to_vec());
            let middle = Point::ORIGIN + sum / count;
            let squares: f64 = ends.iter().map(|end| (end[k] - middle).length_squared()).sum();
            (squares / (count - 1.0)).sqrt()
        })
        .collect()
}
