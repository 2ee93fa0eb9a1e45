//! The masses of all objects from the mass ratios of all pairs (Eq. 33 and 34 as corrected).

use super::random_effects::{BetweenClipStd, Group, Mean, between_clip_std, groups_of_kind, least_std};
use crate::estimate::measure::measurements::Measurements;
use crate::estimate::measure::quantity::Quantity;
use crate::ordered_map::map_of;
use nalgebra::{DMatrix, DVector};
use std::collections::{BTreeMap, BTreeSet};

/// Assumed difference of the frictions of two objects where one of them is unknown.
pub(crate) const ASSUMED_FRICTION_DIFFERENCE: f64 = 0.1;

/// The standard deviation of the logarithm of a pair's mass ratio that no repetition reduces, before the loops of pairs show it: bodies rock within an
/// impact and after it and exchange impulse with the table, about equally in all clips of a pair.  `cargo xtask validate cells` prints what it is in an independent
/// simulation of drawn cells, in the mean and at worst.
const ROCKING_STD: f64 = 0.025;
/// The number of loops that this prior is worth.
const ROCKING_LOOPS: f64 = 1.0;
/// The part of the variance of such an error that one body has in all of its pairs. `cargo xtask validate cells` prints the correlation of pairs that share a
/// body in drawn cells.
const ROCKING_OF_BODY: f64 = 0.25;

/// Logarithms of all masses over the reference's, by weighted least squares on those of the pairs' ratios.
///
/// The network's nodes are objects, its edges pairs with a measured ratio.
#[derive(Clone, Debug)]
pub(crate) struct MassNetwork {
    /// The objects that a chain of pairs connects with the reference, without the reference.
    pub(crate) objects: Vec<String>,
    pub(crate) pairs: Vec<Quantity>,
    /// The linear map from the pairs' logarithms (columns) to the objects' (rows).
    pub(crate) from_pairs: DMatrix<f64>,
    values: DVector<f64>,
    /// Standard deviation of every pair's logarithm that no repetition reduces, from the prior and the closure errors of the loops.
    pub(crate) pair_std: f64,
    degrees_of_freedom: f64,
}

/// Errors of mass ratios that are equal in all clips of a pair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SystematicErrors {
    /// Standard deviation of the logarithm of each pair's ratio.
    pub(crate) pair_std: f64,
    /// Standard deviation of the vertical impulse over the horizontal one, common to all pairs; it shifts a logarithm by
    /// this times the difference of the two frictions.
    pub(crate) vertical_impulse_std: f64,
}

/// The logarithm of one pair's mass ratio, first over second object.
struct Pair<'a> {
    quantity: &'a Quantity,
    first: &'a str,
    second: &'a str,
    mean: &'a Mean,
}

/// A weighted least-squares solution.
struct Solution {
    from_pairs: DMatrix<f64>,
    values: DVector<f64>,
    /// Weighted sum of squared residuals.
    chi2: f64,
}

impl MassNetwork {
    /// The masses of all objects that a chain of pairs connects with the reference.
    pub(crate) fn new(groups: &BTreeMap<Quantity, (Group, Mean)>, reference: &str) -> Self {
        let mut pairs: Vec<Pair> = groups
            .iter()
            .filter_map(|(quantity, (_, mean))| match quantity {
                Quantity::MassRatio(a, b) if a != b => Some(Pair { quantity, first: a, second: b, mean }),
                _ => None,
            })
            .collect();
        let reached = connected(reference, &pairs);
        pairs.retain(|p| reached.contains(p.first));
        let objects: Vec<String> = reached.into_iter().filter(|o| o != reference).collect();
        let design = design(&pairs, &objects);
        let ratios = DVector::from_iterator(pairs.len(), pairs.iter().map(|p| p.mean.value));
        let variances: Vec<f64> = pairs.iter().map(|p| p.mean.standard_error.powi(2)).collect();
        let solve = |closure_std: f64| {
            let weights: Vec<f64> = variances
                .iter()
                .map(|v| 1.0 / (v + closure_std * closure_std).max(f64::MIN_POSITIVE))
                .collect();
            let from_pairs = weighted_pseudo_inverse(&design, &weights);
            let values = &from_pairs * &ratios;
            let residuals = &ratios - &design * &values;
            let chi2 = residuals.iter().zip(&weights).map(|(r, w)| w * r * r).sum();
            Solution { from_pairs, values, chi2 }
        };
        let loops = pairs.len().saturating_sub(objects.len()) as f64;
        let closure_std = closure_std(loops, |std| solve(std).chi2);
        let pair_std = ((loops * closure_std.powi(2) + ROCKING_LOOPS * ROCKING_STD.powi(2))
            / (loops + ROCKING_LOOPS))
            .sqrt();
        // The weights contain what the loops show; the prior widens the intervals only.
        let Solution { from_pairs, values, .. } = solve(closure_std);
        let degrees_of_freedom = pairs.iter().map(|p| p.mean.degrees_of_freedom).sum();
        let pairs = pairs.into_iter().map(|p| p.quantity.clone()).collect();
        Self { objects, pairs, from_pairs, values, pair_std, degrees_of_freedom }
    }

    /// The error of every object's logarithm that is common to all pairs (1 sigma).
    ///
    /// The unknown vertical impulse shifts masses in proportion to the difference of the frictions.  The shifts of a loop of
    /// pairs cancel, so closure errors do not show them.
    pub(crate) fn common_shifts(
        &self,
        frictions: &BTreeMap<String, f64>,
        reference: &str,
        vertical_impulse_std: f64,
    ) -> Vec<f64> {
        let friction = |name: &str| frictions.get(name).copied();
        let shift = |object: &str| Some(vertical_impulse_std * (friction(object)? - friction(reference)?));
        let assumed = vertical_impulse_std * ASSUMED_FRICTION_DIFFERENCE;
        self.objects.iter().map(|object| shift(object).unwrap_or(assumed)).collect()
    }

    /// The mean logarithm of every object, with the standard error from a covariance whose last rows are these objects.
    pub(crate) fn means(&self, covariance: &DMatrix<f64>) -> BTreeMap<String, Mean> {
        let first_row = covariance.nrows() - self.objects.len();
        let mean = |(k, object): (usize, &String)| {
            let variance = covariance[(first_row + k, first_row + k)];
            let mean = Mean {
                value: self.values[k],
                standard_error: variance.max(0.0).sqrt(),
                degrees_of_freedom: self.degrees_of_freedom,
                weights: Vec::new(),
                dispersion: 1.0,
            };
            (object.clone(), mean)
        };
        map_of(self.objects.iter().enumerate().map(mean))
    }
}

/// The typical variation of mass ratios from clip to clip. Impacts of one clip are one value: what a clip shows wrongly, such as two impacts within
/// few frames, is no variation of the other clips.
///
/// Masses do not vary, so that they need no prior of that variation.
pub(crate) fn variation_of_mass_ratios(clips: &[Measurements]) -> BetweenClipStd {
    let groups = groups_of_kind(clips, Quantity::MASS_RATIO);
    let of_clips = groups.map(|(_, indices, group)| group.with_one_value_per_clip(&indices));
    between_clip_std(&of_clips.collect::<Vec<_>>())
}

/// The standard deviation of a pair's logarithm that no repetition reduces, as these clips show it.
pub(crate) fn pair_std(clips: &[Measurements]) -> f64 {
    let groups: Vec<_> = groups_of_kind(clips, Quantity::MASS_RATIO).collect();
    let typical = variation_of_mass_ratios(clips);
    let reference = groups.iter().find_map(|(quantity, ..)| match quantity {
        Quantity::MassRatio(a, _) => Some(a.clone()),
        _ => None,
    });
    let groups = map_of(groups.into_iter().filter_map(|(quantity, _, group)| {
        let mean = group.mean(typical.for_group(&group))?;
        Some((quantity.clone(), (group, mean)))
    }));
    MassNetwork::new(&groups, &reference.unwrap_or_default()).pair_std
}

/// The covariance of the errors of two pairs' logarithms that no repetition reduces: a body that rocks exchanges impulse with the table in all of
/// its pairs, so that the mean of several pairs has a larger error than that of as many independent ones.
pub(crate) fn systematic_covariance(pair: &Quantity, other: &Quantity, pair_std: f64) -> f64 {
    let (Quantity::MassRatio(a, b), Quantity::MassRatio(c, d)) = (pair, other) else { return 0.0 };
    let equal = |x: &str, y: &str| f64::from(u8::from(x == y));
    let shared = equal(a, c) + equal(b, d) - equal(a, d) - equal(b, c);
    let of_pair = f64::from(u8::from(pair == other)) * (1.0 - 2.0 * ROCKING_OF_BODY);
    (of_pair + ROCKING_OF_BODY * shared) * pair_std.powi(2)
}

/// The smallest additional standard deviation of every pair with which chi-square is at most the number of independent
/// loops, its expectation (as Paule and Mandel 1982 do for one group).
fn closure_std(loops: f64, chi2: impl Fn(f64) -> f64) -> f64 {
    if loops < 1.0 { 0.0 } else { least_std(|std| chi2(std) > loops) }
}

/// The design matrix, one row per pair and one column per object: +1 for the first object of a pair, -1 for the second.
fn design(pairs: &[Pair], objects: &[String]) -> DMatrix<f64> {
    DMatrix::from_fn(pairs.len(), objects.len(), |row, column| {
        let object = objects[column].as_str();
        f64::from(u8::from(pairs[row].first == object)) - f64::from(u8::from(pairs[row].second == object))
    })
}

/// The matrix that maps data to the weighted least-squares solution; zero if the design has no full rank.
fn weighted_pseudo_inverse(design: &DMatrix<f64>, weights: &[f64]) -> DMatrix<f64> {
    let weighted = DMatrix::from_fn(design.nrows(), design.ncols(), |r, c| weights[r] * design[(r, c)]);
    let normal = design.tr_mul(&weighted);
    let size = normal.nrows();
    let inverse = normal.cholesky().map_or_else(|| DMatrix::zeros(size, size), |factor| factor.inverse());
    inverse * weighted.transpose()
}

/// All objects that a chain of pairs connects with `start`, including `start`.
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

#[cfg(test)]
mod tests {
    use super::super::means::{JointMeans, exponential};
    use super::*;
    use crate::estimate::clip::result::Measured;

    #[test]
    fn errors_of_pairs_that_share_a_body_are_correlated() {
        let pair = |first: &str, second: &str| Quantity::MassRatio(first.into(), second.into());
        let correlation = |p: [&str; 2], q: [&str; 2]| {
            systematic_covariance(&pair(p[0], p[1]), &pair(q[0], q[1]), 0.02) / 4e-4
        };
        for (p, q, expected) in [
            (["a", "b"], ["a", "b"], 1.0),
            (["a", "b"], ["a", "c"], ROCKING_OF_BODY),
            (["a", "c"], ["b", "c"], ROCKING_OF_BODY),
            (["a", "b"], ["b", "c"], -ROCKING_OF_BODY),
            (["b", "c"], ["a", "b"], -ROCKING_OF_BODY),
            (["a", "b"], ["c", "d"], 0.0),
        ] {
            assert!((correlation(p, q) - expected).abs() < 1e-12, "{p:?} and {q:?}: {}", correlation(p, q));
        }
    }

    /// A clip that measures these mass ratios with these standard deviations.
    fn clip(values: &[([&str; 2], f64, f64)]) -> Measurements {
        let n = values.len();
        let quantities = values.iter().map(|([a, b], ..)| Quantity::MassRatio((*a).into(), (*b).into()));
        Measurements {
            quantities: quantities.collect(),
            values: DVector::from_iterator(n, values.iter().map(|(_, value, _)| *value)),
            covariance: DMatrix::from_diagonal(&DVector::from_iterator(
                n,
                values.iter().map(|(.., std)| std * std),
            )),
            vertical_fractions: vec![0.0; n],
            double_contact: vec![false; n],
            by_slope: Vec::new(),
        }
    }

    #[test]
    fn impacts_of_one_clip_that_contradict_each_other_do_not_widen_other_masses() {
        let friction = Measured { value: 0.15, std: 0.05 };
        let half = |clips: &[Measurements], object: &str| {
            let joint = JointMeans::new(clips, "a", friction, None);
            let estimate = exponential(&joint.log_masses[object], None, 1);
            (estimate.interval_95[1] / estimate.mean).ln()
        };
        let one = [clip(&[(["a", "b"], -0.66, 0.03)]), clip(&[(["a", "c"], -0.3, 0.01)])];
        let two = [clip(&[(["a", "b"], -0.66, 0.03), (["a", "b"], -1.1, 0.12)]), one[1].clone()];
        let (before, after) = (half(&one, "c"), half(&two, "c"));
        assert!(before < 0.1 && after < 1.5 * before, "{before} without, {after} with the second impact");
        // The two impacts of the pair itself contradict each other.
        let (before, after) = (half(&one, "b"), half(&two, "b"));
        assert!(after > 1.3 * before && after < 3.0 * before, "{before} without, {after} with it");
    }
}
