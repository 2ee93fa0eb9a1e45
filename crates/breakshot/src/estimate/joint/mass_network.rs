//! The mass ratios of all objects from those of all pairs (Eq. 33 and 34 as corrected).

use super::random_effects::{Group, Mean};
use crate::estimate::measure::quantity::Quantity;
use nalgebra::{DMatrix, DVector};
use std::collections::{BTreeMap, BTreeSet};

/// The logarithms of the masses over the reference's, as a linear function of those of the pairs' ratios.
#[derive(Clone, Debug)]
pub(crate) struct Masses {
    pub(crate) objects: Vec<String>,
    pub(crate) pairs: Vec<Quantity>,
    /// One row per object, one column per pair.
    pub(crate) from_pairs: DMatrix<f64>,
    pub(crate) values: DVector<f64>,
    /// What every pair is off by, beyond what its clips' scatter tells, so that loops of pairs close (log, std).
    pub(crate) misfit: f64,
    /// What moves all masses at once (log, std).
    pub(crate) shifts: Vec<f64>,
    pub(crate) freedom: f64,
}

/// One pair's logarithm of the mass of the first over the second.
struct Pair<'a> {
    key: &'a Quantity,
    first: &'a str,
    second: &'a str,
    mean: &'a Mean,
}

impl Masses {
    /// Weighted least squares on the logarithms; objects that no chain of pairs connects with the reference are left
    /// out.
    pub(crate) fn new(groups: &BTreeMap<Quantity, (Group, Mean)>, reference: &str) -> Self {
        let mut pairs: Vec<Pair> = groups
            .iter()
            .filter_map(|(key, (_, mean))| match key {
                Quantity::MassRatio(a, b) if a != b => Some(Pair { key, first: a, second: b, mean }),
                _ => None,
            })
            .collect();
        let reached = connected(reference, &pairs);
        pairs.retain(|p| reached.contains(p.first));
        let objects: Vec<String> = reached.into_iter().filter(|o| o != reference).collect();
        let design = design(&pairs, &objects);
        let ratios = DVector::from_iterator(pairs.len(), pairs.iter().map(|p| p.mean.value));
        let variances: Vec<f64> = pairs.iter().map(|p| p.mean.standard_error.powi(2)).collect();
        let loops = pairs.len().saturating_sub(objects.len()) as f64;
        let solved = |misfit: f64| {
            let weights: Vec<f64> =
                variances.iter().map(|v| 1.0 / (v + misfit * misfit).max(f64::MIN_POSITIVE)).collect();
            let from_pairs = inverse_of(&design, &weights);
            let values = &from_pairs * &ratios;
            let off = &ratios - &design * &values;
            let squares: f64 = off.iter().zip(&weights).map(|(m, w)| w * m * m).sum();
            (from_pairs, values, squares)
        };
        let misfit = smallest_misfit(loops, |misfit| solved(misfit).2);
        let (from_pairs, values, _) = solved(misfit);
        let freedom = pairs.iter().map(|p| p.mean.freedom).sum();
        let pairs = pairs.into_iter().map(|p| p.key.clone()).collect();
        let shifts = vec![0.0; objects.len()];
        Self { objects, pairs, from_pairs, values, misfit, shifts, freedom }
    }
}

/// The least misfit of every pair that lets the loops close as well as chance would.
fn smallest_misfit(loops: f64, squares: impl Fn(f64) -> f64) -> f64 {
    const LARGEST: f64 = 1.0;
    if loops < 1.0 || squares(0.0) <= loops {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, LARGEST);
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        if squares(middle) > loops { low = middle } else { high = middle }
    }
    high
}

/// +1 for the first object of a pair, -1 for the second.
fn design(pairs: &[Pair], objects: &[String]) -> DMatrix<f64> {
    DMatrix::from_fn(pairs.len(), objects.len(), |row, column| {
        let object = objects[column].as_str();
        f64::from(u8::from(pairs[row].first == object)) - f64::from(u8::from(pairs[row].second == object))
    })
}

/// What takes the pairs' logarithms to the objects'.
fn inverse_of(design: &DMatrix<f64>, weights: &[f64]) -> DMatrix<f64> {
    let weighted = DMatrix::from_fn(design.nrows(), design.ncols(), |r, c| weights[r] * design[(r, c)]);
    let normal = design.tr_mul(&weighted);
    let size = normal.nrows();
    let inverse = normal.cholesky().map_or_else(|| DMatrix::zeros(size, size), |factor| factor.inverse());
    inverse * weighted.transpose()
}

/// All that a chain of pairs connects with `start`.
fn connected(start: &str, pairs: &[Pair]) -> BTreeSet<String> {
    let mut reached = BTreeSet::from([start.to_owned()]);
    loop {
        let before = reached.len();
        for pair in pairs {
            if reached.contains(pair.first) || reached.contains(pair.second) {
                reached.insert(pair.first.to_owned());
                reached.insert(pair.second.to_owned());
            }
        }
        if reached.len() == before {
            return reached;
        }
    }
}
