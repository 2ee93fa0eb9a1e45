//! The measurements of one clip: values of quantities, and the covariance of their noise.

use super::matrix_serde;
use super::quantity::Quantity;
use super::restitution::DOUBLE_CONTACT_STD;
use crate::estimate::clip::result::Measured;
use crate::properties::Covariance;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The values that one clip measures, and the covariance of their noise.
///
/// All lists have one entry per value; a quantity occurs as often as the clip measures it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Measurements {
    #[serde(rename = "keys")]
    pub(crate) quantities: Vec<Quantity>,
    #[serde(with = "matrix_serde::vector")]
    pub(crate) values: DVector<f64>,
    #[serde(with = "matrix_serde::matrix")]
    pub(crate) covariance: DMatrix<f64>,
    /// Of a mass ratio the fraction of contact friction that acts vertically, see
    /// [`impulse_ratio::vertical_fraction`](super::impulse_ratio::vertical_fraction); else 0.
    #[serde(rename = "pressing")]
    pub(crate) vertical_fractions: Vec<f64>,
    /// Whether the value is the restitution of flat sides that met at one end and then at the other.
    #[serde(rename = "met_twice")]
    pub(crate) double_contact: Vec<bool>,
    /// The change of each value if the table has a slope of one along x and along y; empty in records that are older.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) by_slope: Vec<[f64; 2]>,
}

impl Measurements {
    /// The measurements of several fits of one clip, whose errors are independent.
    pub(crate) fn joined(parts: &[Self]) -> Self {
        let size = parts.iter().map(|p| p.quantities.len()).sum();
        let mut covariance = DMatrix::zeros(size, size);
        let mut at = 0;
        for part in parts {
            let n = part.quantities.len();
            covariance.view_mut((at, at), (n, n)).copy_from(&part.covariance);
            at += n;
        }
        Self {
            quantities: parts.iter().flat_map(|p| p.quantities.iter().cloned()).collect(),
            values: DVector::from_iterator(size, parts.iter().flat_map(|p| p.values.iter().copied())),
            covariance,
            vertical_fractions: parts.iter().flat_map(|p| p.vertical_fractions.iter().copied()).collect(),
            double_contact: parts.iter().flat_map(|p| p.double_contact.iter().copied()).collect(),
            by_slope: parts.iter().flat_map(|p| (0..p.quantities.len()).map(|k| p.by_slope(k))).collect(),
        }
    }

    /// Whether all lists have the same length and all numbers are finite.
    pub(crate) fn is_valid(&self) -> bool {
        let n = self.quantities.len();
        let sizes = [self.values.len(), self.vertical_fractions.len(), self.double_contact.len()];
        let slopes = self.by_slope.len();
        sizes == [n; 3]
            && (slopes == n || slopes == 0)
            && self.by_slope.iter().flatten().all(|v| v.is_finite())
            && self.covariance.shape() == (n, n)
            && self.values.iter().chain(self.covariance.iter()).all(|v| v.is_finite())
    }

    /// The covariance with a name for each value: a quantity may be measured several times.
    pub(crate) fn named_covariance(&self) -> Covariance {
        let names =
            self.quantities.iter().enumerate().map(|(k, quantity)| format!("{k}: {}", quantity.name()));
        let matrix = self.covariance.row_iter().map(|row| row.iter().copied().collect());
        Covariance { names: names.collect(), matrix: matrix.collect() }
    }

    /// The change of value `k` per slope of the table.
    pub(crate) fn by_slope(&self, k: usize) -> [f64; 2] {
        self.by_slope.get(k).copied().unwrap_or_default()
    }

    /// The measurements on a table of this slope.
    pub(crate) fn on_slope(&self, slope: [f64; 2]) -> Self {
        let mut corrected = self.clone();
        for k in 0..self.quantities.len() {
            let [x, y] = self.by_slope(k);
            corrected.values[k] += x * slope[0] + y * slope[1];
        }
        corrected
    }

    /// Value `k` with the standard deviation of its noise.
    pub(crate) fn measured(&self, k: usize) -> Measured {
        Measured { value: self.values[k], std: self.covariance[(k, k)].max(0.0).sqrt() }
    }

    /// The measurements whose index satisfies `keep`.
    pub(crate) fn retained(&self, keep: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.quantities.len()).filter(|k| keep(*k)).collect();
        Self {
            quantities: kept.iter().map(|&k| self.quantities[k].clone()).collect(),
            vertical_fractions: kept.iter().map(|&k| self.vertical_fractions[k]).collect(),
            double_contact: kept.iter().map(|&k| self.double_contact[k]).collect(),
            by_slope: kept.iter().map(|&k| self.by_slope(k)).collect(),
            values: self.values.select_rows(&kept),
            covariance: self.covariance.select_rows(&kept).select_columns(&kept),
        }
    }

    /// The measurements whose quantity satisfies `is_updated`, conditioned on what is `expected` of others: their noise is correlated (a
    /// Kalman update).  Those others stay as the clip measures them.
    ///
    /// `expected` holds indices of values, each with the value that the clip is expected to have and its standard deviation.
    pub(crate) fn conditioned(
        &self,
        expected: &[(usize, Measured)],
        is_updated: impl Fn(&Quantity) -> bool,
    ) -> Self {
        let rows: Vec<usize> = expected.iter().map(|(k, _)| *k).collect();
        let cross = self.covariance.select_columns(&rows);
        let mut own = cross.select_rows(&rows);
        for (r, (_, value)) in expected.iter().enumerate() {
            own[(r, r)] += value.std.powi(2);
        }
        let Some(factor) = own.cholesky() else { return self.clone() };
        let gain = factor.solve(&cross.transpose()).transpose();
        let innovation =
            DVector::from_iterator(expected.len(), expected.iter().map(|(k, m)| self.values[*k] - m.value));
        let change = &gain * innovation;
        let reduction = &gain * cross.transpose();
        let reduction = (&reduction + reduction.transpose()) / 2.0;
        // Without the reduction of the cross terms with what stays, the matrix would be no covariance.
        let stays = |k: usize| !is_updated(&self.quantities[k]);
        let mut updated = self.clone();
        for k in (0..self.quantities.len()).filter(|&k| !stays(k)) {
            updated.values[k] -= change[k];
            for l in 0..self.quantities.len() {
                updated.covariance[(k, l)] -= reduction[(k, l)];
                if stays(l) {
                    updated.covariance[(l, k)] -= reduction[(l, k)];
                }
            }
        }
        updated
    }

    /// The frictions of these measurements, and the other values as functions of them that are linear about the frictions of `near`. `None` if the two do not
    /// measure the same quantities, or no friction.
    pub(crate) fn linearized_at(&self, near: &Self) -> Option<Self> {
        let is_friction = |k: &usize| matches!(self.quantities[*k], Quantity::Friction(_));
        let frictions: Vec<usize> = (0..self.quantities.len()).filter(is_friction).collect();
        if self.quantities != near.quantities || frictions.is_empty() {
            return None;
        }
        // The regression of all values on the frictions; of the frictions themselves the identity
        let cross = near.covariance.select_columns(&frictions);
        let by_friction = cross.select_rows(&frictions).cholesky()?.solve(&cross.transpose()).transpose();
        let own = self.covariance.select_rows(&frictions).select_columns(&frictions);
        let difference = self.values.select_rows(&frictions) - near.values.select_rows(&frictions);
        let covariance = &near.covariance - &by_friction * cross.transpose()
            + &by_friction * own * by_friction.transpose();
        let by_slope = |k: usize| {
            let shifts = frictions.iter().enumerate().map(|(f, &l)| {
                [0, 1].map(|axis| by_friction[(k, f)] * (self.by_slope(l)[axis] - near.by_slope(l)[axis]))
            });
            shifts.fold(near.by_slope(k), |sum, shift| [sum[0] + shift[0], sum[1] + shift[1]])
        };
        let linearized = Self {
            values: &near.values + &by_friction * difference,
            covariance: (&covariance + covariance.transpose()) / 2.0,
            by_slope: (0..self.quantities.len()).map(by_slope).collect(),
            ..near.clone()
        };
        linearized.is_valid().then_some(linearized)
    }

    /// The measurements with mass ratios corrected for the impulse that the table's friction takes, see
    /// [`impulse_ratio::vertical_fraction`](super::impulse_ratio::vertical_fraction).
    pub(crate) fn corrected_for_table_friction(
        &self,
        frictions: &BTreeMap<String, f64>,
        contact_friction: f64,
    ) -> Self {
        let mut corrected = self.clone();
        for (k, quantity) in self.quantities.iter().enumerate() {
            if let Quantity::MassRatio(a, b) = quantity
                && let (Some(a), Some(b)) = (frictions.get(a), frictions.get(b))
            {
                corrected.values[k] -= self.vertical_fractions[k] * contact_friction * (a - b);
            }
        }
        corrected
    }
}

/// The measurements without restitutions of double contacts where the quantity has others; where it has none, they stay
/// and get the additional standard deviation [`DOUBLE_CONTACT_STD`] of the mean over all clips.
pub(crate) fn without_replaceable_double_contacts(clips: &[Measurements]) -> Vec<Measurements> {
    let mut single: BTreeSet<Quantity> = BTreeSet::new();
    let mut double_contacts: BTreeMap<Quantity, f64> = BTreeMap::new();
    for measurements in clips {
        for (quantity, twice) in measurements.quantities.iter().zip(&measurements.double_contact) {
            if *twice {
                *double_contacts.entry(quantity.clone()).or_default() += 1.0;
            } else {
                single.insert(quantity.clone());
            }
        }
    }
    clips
        .iter()
        .map(|measurements| {
            let keep =
                |k: usize| !measurements.double_contact[k] || !single.contains(&measurements.quantities[k]);
            let mut kept = measurements.retained(keep);
            for k in 0..kept.quantities.len() {
                if kept.double_contact[k] {
                    // The error is the same in all clips: averaging does not reduce it.
                    kept.covariance[(k, k)] +=
                        double_contacts[&kept.quantities[k]] * DOUBLE_CONTACT_STD.powi(2);
                }
            }
            kept
        })
        .collect()
}

/// The measurements of each quantity: index of the clip, and index within its measurements.
pub(crate) fn grouped(clips: &[Measurements]) -> BTreeMap<&Quantity, Vec<(usize, usize)>> {
    let mut indices: BTreeMap<&Quantity, Vec<(usize, usize)>> = BTreeMap::new();
    for (clip, measurements) in clips.iter().enumerate() {
        for (k, quantity) in measurements.quantities.iter().enumerate() {
            indices.entry(quantity).or_default().push((clip, k));
        }
    }
    indices
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A friction with this mean and standard deviation, and a mass ratio that depends on it with this curvature, as one clip measures both.
    fn curved(friction: f64, std: f64, curvature: f64) -> Measurements {
        let slope = 1.0 + curvature * friction;
        let by_friction = DVector::from_vec(vec![1.0, slope]);
        Measurements {
            quantities: vec![
                Quantity::Friction("a".to_owned()),
                Quantity::MassRatio("a".to_owned(), "b".to_owned()),
            ],
            values: DVector::from_vec(vec![friction, friction + curvature * friction * friction / 2.0]),
            covariance: DMatrix::from_diagonal(&DVector::from_vec(vec![0.0, 1e-6]))
                + std * std * &by_friction * by_friction.transpose(),
            vertical_fractions: vec![0.0; 2],
            double_contact: vec![false; 2],
            by_slope: vec![[friction, 0.0], [0.0, 1.0]],
        }
    }

    #[test]
    fn values_far_from_linear_in_friction_are_measured_near_the_friction_of_other_clips() {
        const CURVATURE: f64 = -2.0;
        let expected = [(0, Measured { value: 0.4, std: 0.02 })];
        let is_ratio = |quantity: &Quantity| matches!(quantity, Quantity::MassRatio(..));
        let own = curved(0.9, 0.3, CURVATURE);
        let near = curved(0.41, 0.02, CURVATURE);
        let truth = curved(0.4, 0.3, CURVATURE).values[1];

        let linearized = own.linearized_at(&near).expect("the same quantities");
        assert!((linearized.values[0] - 0.9).abs() < 1e-12, "{}", linearized.values);
        assert!((linearized.covariance[(0, 0)] - 0.09).abs() < 1e-12, "{}", linearized.covariance);
        let error = |measurements: &Measurements| {
            (measurements.conditioned(&expected, is_ratio).values[1] - truth).abs()
        };
        let (before, after) = (error(&own), error(&linearized));
        println!("{before:.4} from the clip by itself, {after:.4} near the expected friction");
        assert!(before > 0.1 && after < 5e-3, "{before} and {after}");
        // The slope of the table changes the ratio by what it changes the friction.
        let by_slope = 0.49 * (1.0 + CURVATURE * 0.41);
        assert!((linearized.by_slope(1)[0] - by_slope).abs() < 1e-12, "{:?}", linearized.by_slope);
    }

    #[test]
    fn measurements_of_other_quantities_are_not_linearized() {
        let (own, near) = (curved(0.9, 0.3, 0.0), curved(0.4, 0.02, 0.0));
        assert!(own.linearized_at(&near.retained(|k| k == 0)).is_none());
        let ratio = |measurements: &Measurements| measurements.retained(|k| k == 1);
        assert!(ratio(&own).linearized_at(&ratio(&near)).is_none());
    }

    #[test]
    fn what_is_conditioned_keeps_a_covariance() {
        // A friction that the clip itself hardly measures, and two values that depend on it almost entirely.
        let slopes = DVector::from_vec(vec![1.0, -0.9, 0.7, 0.2]);
        let noise = DVector::from_vec(vec![1e-8, 1e-6, 1e-6, 1e-5]);
        let covariance = DMatrix::from_diagonal(&noise) + 0.03 * &slopes * slopes.transpose();
        let of = |name: &str| name.to_owned();
        let measurements = Measurements {
            quantities: vec![
                Quantity::Friction(of("a")),
                Quantity::StrikerRestitution(of("a")),
                Quantity::MassRatio(of("a"), of("b")),
                Quantity::Friction(of("b")),
            ],
            values: DVector::from_vec(vec![0.5, 0.4, 0.1, 0.3]),
            covariance,
            vertical_fractions: vec![0.0; 4],
            double_contact: vec![false; 4],
            by_slope: Vec::new(),
        };
        let expected = [(0, Measured { value: 0.3, std: 0.01 })];
        let updated =
            measurements.conditioned(&expected, |quantity| !matches!(quantity, Quantity::Friction(_)));
        let least = updated.covariance.clone().symmetric_eigenvalues().min();
        assert!(least > 0.0, "{least}: {}", updated.covariance);
        // With the variance s2 of the friction that is expected: the line of regression, and the cross covariance s2 / (s2 + own) times its own.
        let (own, s2) = (0.03 + 1e-8, 1e-4);
        let expected = 0.4 - (-0.9 * 0.03 / (s2 + own)) * 0.2;
        assert!((updated.values[1] - expected).abs() < 1e-12, "{}", updated.values);
        let cross = -0.9 * 0.03 * s2 / (s2 + own);
        assert!((updated.covariance[(0, 1)] - cross).abs() < 1e-12, "{}", updated.covariance);
        assert_eq!(updated.covariance[(0, 3)], measurements.covariance[(0, 3)]);
        assert_eq!(updated.covariance, updated.covariance.transpose());
    }
}
