//! Which value is to be expected where nothing was measured, given the values of other objects and pairs?
//!
//! The values are observations of a mixed model, `y = group mean + sum of the effects of the objects + residual`: a lively object
//! has a high restitution with every partner. The standard deviations of effects and residuals are not estimated but averaged over
//! a grid; the weight of each pair of standard deviations is the likelihood with which every value is predicted from all others
//! (leave-one-out predictive probability: Rasmussen and Williams, *Gaussian Processes for Machine Learning*, 2006, Eq. 5.10 to 5.12).
//! With few values many grid points have similar weights, which widens the prediction as Student's t does.

use nalgebra::{DMatrix, DVector};

/// A normal distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Normal {
    pub mean: f64,
    pub std: f64,
}

/// What a value depends on: the mean of its group and the effects of its objects.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Terms<'a> {
    /// Index of the group.
    pub group: usize,
    /// The objects whose effects are added, one twice if it meets its own copy; empty if there are no effects.
    pub objects: Vec<&'a str>,
}

/// The terms of quantities without effects of objects.
pub(super) const NO_EFFECTS: Terms = Terms { group: 0, objects: Vec::new() };

/// A measured value.
#[derive(Clone, Debug)]
pub(super) struct Observation<'a> {
    pub terms: Terms<'a>,
    pub value: f64,
    pub standard_error: f64,
}

/// The model of one kind of quantity.
pub(super) struct MixedModel {
    /// Distribution of the mean of every group before any measurement.
    pub group_mean: Normal,
    /// Standard deviations of the objects' effects that are possible.
    pub effect_stds: &'static [f64],
    /// Standard deviations of the residuals that are possible.
    pub residual_stds: &'static [f64],
}

impl MixedModel {
    /// The model conditioned on at most [`MAX_OBSERVATIONS`] observations, the first ones.
    pub(super) fn fitted(self, mut observations: Vec<Observation<'_>>) -> FittedModel<'_> {
        observations.truncate(MAX_OBSERVATIONS);
        let stds = self.effect_stds.iter().flat_map(|&e| self.residual_stds.iter().map(move |&r| [e, r]));
        let mut points: Vec<GridPoint> =
            stds.filter_map(|stds| self.grid_point(stds, &observations)).collect();
        let greatest = points.iter().map(|p| p.weight).fold(f64::NEG_INFINITY, f64::max);
        for point in &mut points {
            point.weight = (point.weight - greatest).exp();
        }
        FittedModel { model: self, observations, points }
    }

    /// One point of the grid, its weight as a logarithm; `None` if the covariance cannot be inverted.
    fn grid_point(
        &self,
        [effect_std, residual_std]: [f64; 2],
        observations: &[Observation],
    ) -> Option<GridPoint> {
        let n = observations.len();
        let variance = DMatrix::from_fn(n, n, |i, k| {
            let own = residual_std.powi(2) + observations[i].standard_error.powi(2);
            let shared = self.shared_variance(effect_std, &observations[i].terms, &observations[k].terms);
            shared + if i == k { own } else { 0.0 }
        });
        let deviations = DVector::from_fn(n, |i, _| observations[i].value - self.group_mean.mean);
        let inverse = variance.cholesky()?.inverse();
        let solved = &inverse * deviations;
        let left_out = (0..n).map(|k| {
            let variance = 1.0 / inverse[(k, k)];
            let residual = solved[k] * variance;
            -0.5 * (variance.ln() + residual.powi(2) / variance)
        });
        Some(GridPoint { effect_std, residual_std, weight: left_out.sum(), inverse, solved })
    }

    /// Covariance of two values without their residuals.
    fn shared_variance(&self, effect_std: f64, one: &Terms, other: &Terms) -> f64 {
        let meets = |name: &&str| other.objects.iter().filter(|o| *o == name).count();
        let common: usize = one.objects.iter().map(meets).sum();
        let groups = if one.group == other.group { self.group_mean.std.powi(2) } else { 0.0 };
        groups + effect_std.powi(2) * common as f64
    }
}

/// The effort of a fit grows with the third power of this.
const MAX_OBSERVATIONS: usize = 150;

/// Standard deviations of effects and residuals with their weight, and the observations solved for them.
struct GridPoint {
    effect_std: f64,
    residual_std: f64,
    weight: f64,
    /// Inverse covariance of the observations.
    inverse: DMatrix<f64>,
    /// The inverse times the deviations of the observations from the mean.
    solved: DVector<f64>,
}

/// A model that has seen observations.
pub(super) struct FittedModel<'a> {
    model: MixedModel,
    observations: Vec<Observation<'a>>,
    points: Vec<GridPoint>,
}

impl FittedModel<'_> {
    /// The number of observations.
    pub(super) fn count(&self, group: usize) -> usize {
        self.observations.iter().filter(|o| o.terms.group == group).count()
    }

    /// The distribution of an unmeasured value with these terms.
    pub(super) fn prediction(&self, wanted: &Terms) -> Normal {
        let prior = self.model.group_mean;
        let (mut weight, mut mean, mut square) = (0.0, 0.0, 0.0);
        for point in &self.points {
            let shared = |terms: &Terms| self.model.shared_variance(point.effect_std, terms, wanted);
            let covariance =
                DVector::from_fn(self.observations.len(), |i, _| shared(&self.observations[i].terms));
            let own_mean = prior.mean + covariance.dot(&point.solved);
            let reduction = covariance.dot(&(&point.inverse * &covariance));
            let variance = (shared(wanted) + point.residual_std.powi(2) - reduction).max(0.0);
            weight += point.weight;
            mean += point.weight * own_mean;
            square += point.weight * (own_mean.powi(2) + variance);
        }
        if weight <= 0.0 {
            return prior;
        }
        let mean = mean / weight;
        Normal { mean, std: (square / weight - mean * mean).max(0.0).sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prediction(observations: &[Observation], wanted: &Terms) -> Normal {
        let model = MixedModel {
            group_mean: Normal { mean: 0.5, std: 0.3 },
            effect_stds: &[0.0, 0.05, 0.1, 0.2],
            residual_stds: &[0.02, 0.06, 0.1, 0.2],
        };
        model.fitted(observations.to_vec()).prediction(wanted)
    }

    fn pair<'a>(a: &'a str, b: &'a str, value: f64) -> Observation<'a> {
        Observation { terms: Terms { group: 0, objects: vec![a, b] }, value, standard_error: 0.01 }
    }

    #[test]
    fn without_observations_the_prediction_is_the_prior_widened_by_effects_and_residuals() {
        let terms = Terms { group: 0, objects: vec!["a", "b"] };
        let predicted = prediction(&[], &terms);
        assert!((predicted.mean - 0.5).abs() < 1e-12);
        assert!(predicted.std > 0.3 && predicted.std < 0.45, "{}", predicted.std);
    }

    #[test]
    fn a_group_of_equal_values_predicts_their_mean_within_the_residual_of_the_grid() {
        let values: Vec<Observation> = (0..12)
            .map(|k| Observation {
                terms: Terms { group: 0, objects: Vec::new() },
                value: 0.7 + 0.02 * if k % 2 == 0 { 1.0 } else { -1.0 },
                standard_error: 0.0,
            })
            .collect();
        let predicted = prediction(&values, &Terms { group: 0, objects: Vec::new() });
        assert!((predicted.mean - 0.7).abs() < 2e-3, "{}", predicted.mean);
        assert!(predicted.std > 0.015 && predicted.std < 0.04, "{}", predicted.std);
    }

    #[test]
    fn the_effects_of_both_partners_are_learned_from_their_other_pairs() {
        // Additive effects: a -0.1, b 0, c +0.1, d +0.2 about 0.5; the pair a/d is left out.
        let effect = |name: &str| match name {
            "a" => -0.1,
            "c" => 0.1,
            "d" => 0.2,
            _ => 0.0,
        };
        let names = [("a", "b"), ("a", "c"), ("b", "c"), ("b", "d"), ("c", "d")];
        let known: Vec<Observation> =
            names.iter().map(|&(a, b)| pair(a, b, 0.5 + effect(a) + effect(b))).collect();
        let predicted = prediction(&known, &Terms { group: 0, objects: vec!["a", "d"] });
        assert!((predicted.mean - 0.6).abs() < 0.05, "{predicted:?}");
        let unknown = prediction(&known, &Terms { group: 0, objects: vec!["x", "y"] });
        assert!(unknown.std > 1.5 * predicted.std, "{unknown:?} {predicted:?}");
    }

    #[test]
    fn another_group_shares_effects_but_not_its_mean() {
        let known = [pair("a", "b", 0.3), pair("a", "c", 0.3), pair("b", "c", 0.7), pair("b", "d", 0.7)];
        let of = |name| prediction(&known, &Terms { group: 1, objects: vec![name] });
        let (low, high) = (of("a"), of("b"));
        assert!(low.mean < 0.5 && high.mean > low.mean, "{low:?} {high:?}");
        assert!(low.std > 0.28 && high.std > 0.28, "the group's own mean was never measured: {low:?}");
    }
}
