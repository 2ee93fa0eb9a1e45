//! How far final places really scatter if the quantities are as uncertain as they are: rollouts of random draws.

use super::prior::Belief;
use super::sensitivity::{self, Rolled, StruckPile};
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

/// Random strikes on random piles of these objects, as fast as the properties let them stay in the workspace.
///
/// # Errors
/// No pile of these objects can be struck.
pub fn struck_piles(
    properties: &Properties,
    cell: &Cell,
    objects: &[Object],
    (count, seed): (usize, u64),
) -> Result<Vec<StruckPile>> {
    let belief = Belief::new(properties, objects, false);
    let piles = sensitivity::sampled(&belief, (cell, objects), None, (count, seed))?;
    if piles.is_empty() {
        return Err(Error::invalid("piles", "strikes", "none", "objects that the striker can reach"));
    }
    Ok(piles)
}

/// One standard deviation of where an object comes to rest (m), the mean over all objects of all piles, if the quantities are
/// as uncertain as the properties say: the scatter of `draws` rollouts of each pile.
pub fn predictive_spread_m(
    properties: &Properties,
    objects: &[Object],
    piles: &[StruckPile],
    (draws, seed): (usize, u64),
) -> f64 {
    let belief = Belief::new(properties, objects, false);
    let size = belief.quantities.len();
    let eigen = SymmetricEigen::new(belief.covariance.clone());
    let scales = eigen.eigenvalues.map(|v| v.max(0.0).sqrt());
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let worlds: Vec<Properties> = (0..draws)
        .map(|_| {
            let normal = DVector::from_fn(size, |k, _| {
                let z: f64 = StandardNormal.sample(&mut random);
                z * scales[k]
            });
            let drawn = &eigen.eigenvectors * normal;
            belief.moved(&drawn.iter().copied().enumerate().collect::<Vec<_>>()).0
        })
        .collect();
    let of_piles: Vec<Vec<f64>> = piles.par_iter().map(|pile| scatter_m(pile, &worlds)).collect();
    let all: Vec<f64> = of_piles.into_iter().flatten().collect();
    all.iter().sum::<f64>() / all.len().max(1) as f64
}

/// How far objects come to rest from where the properties predict it, if `truth` is true (m, mean over all objects of all
/// piles); what the properties do not know has the stand-ins of [`super::advice`].
pub fn prediction_error_m(
    properties: &Properties,
    truth: &Properties,
    objects: &[Object],
    piles: &[StruckPile],
) -> f64 {
    let belief = Belief::new(properties, objects, false);
    let of_pile = |pile: &StruckPile| {
        let rolled = Rolled::new(pile, truth)?;
        let mut simulator = Simulator::new();
        let predicted = rolled.finals(&belief.properties, &mut simulator)?;
        let real = rolled.finals(truth, &mut simulator)?;
        Some(predicted.iter().zip(&real).map(|(p, q)| p.distance(*q)).collect::<Vec<_>>())
    };
    let all: Vec<f64> = piles.par_iter().filter_map(of_pile).collect::<Vec<_>>().concat();
    all.iter().sum::<f64>() / all.len().max(1) as f64
}

/// The scatter of each object's final place over the worlds (m).
fn scatter_m(pile: &StruckPile, worlds: &[Properties]) -> Vec<f64> {
    let mut simulator = Simulator::new();
    let rolled = worlds.first().and_then(|world| Rolled::new(pile, world));
    let Some(rolled) = rolled else { return Vec::new() };
    let ends: Vec<Vec<Point>> = worlds.iter().filter_map(|w| rolled.finals(w, &mut simulator)).collect();
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
