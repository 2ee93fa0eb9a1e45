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
    /// The distribution of an unmeasured value with these terms.
    pub(super) fn prediction(&self, observations: &[Observation], wanted: &Terms) -> Normal {
        let stds = self.effect_stds.iter().flat_map(|&e| self.residual_stds.iter().map(move |&r| [e, r]));
        let predictions: Vec<Weighted> =
            stds.filter_map(|stds| self.conditional(stds, observations, wanted)).collect();
        let greatest = predictions.iter().map(|p| p.log_weight).fold(f64::NEG_INFINITY, f64::max);
        let (mut weight, mut mean, mut square) = (0.0, 0.0, 0.0);
        for Weighted { log_weight, prediction } in predictions {
            let own = (log_weight - greatest).exp();
            weight += own;
            mean += own * prediction.mean;
            square += own * (prediction.mean.powi(2) + prediction.std.powi(2));
        }
        if weight <= 0.0 {
            return self.group_mean;
        }
        let mean = mean / weight;
        Normal { mean, std: (square / weight - mean * mean).max(0.0).sqrt() }
    }

    /// The prediction for given standard deviations of effects and residuals; `None` if the covariance cannot be inverted.
    fn conditional(&self, stds: [f64; 2], observations: &[Observation], wanted: &Terms) -> Option<Weighted> {
        let [effect_std, residual_std] = stds;
        let n = observations.len();
        let shared = |p: &Terms, q: &Terms| self.shared_variance(effect_std, p, q);
        let variance = DMatrix::from_fn(n, n, |i, k| {
            let own = residual_std.powi(2) + observations[i].standard_error.powi(2);
            shared(&observations[i].terms, &observations[k].terms) + if i == k { own } else { 0.0 }
        });
        let deviations = DVector::from_fn(n, |i, _| observations[i].value - self.group_mean.mean);
        let covariance = DVector::from_fn(n, |i, _| shared(&observations[i].terms, wanted));
        let inverse = variance.cholesky()?.inverse();
        let solved = &inverse * deviations;
        let left_out = (0..n).map(|k| {
            let variance = 1.0 / inverse[(k, k)];
            let residual = solved[k] * variance;
            -0.5 * (variance.ln() + residual.powi(2) / variance)
        });
        let own = shared(wanted, wanted) + residual_std.powi(2);
        Some(Weighted {
            log_weight: left_out.sum(),
            prediction: Normal {
                mean: self.group_mean.mean + covariance.dot(&solved),
                std: (own - covariance.dot(&(&inverse * &covariance))).max(0.0).sqrt(),
            },
        })
    }

    /// Covariance of two values without their residuals.
    fn shared_variance(&self, effect_std: f64, one: &Terms, other: &Terms) -> f64 {
        let meets = |name: &&str| other.objects.iter().filter(|o| *o == name).count();
        let common: usize = one.objects.iter().map(meets).sum();
        let groups = if one.group == other.group { self.group_mean.std.powi(2) } else { 0.0 };
        groups + effect_std.powi(2) * common as f64
    }
}

/// The prediction at one point of the grid.
struct Weighted {
    log_weight: f64,
    prediction: Normal,
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: MixedModel = MixedModel {
        group_mean: Normal { mean: 0.5, std: 0.3 },
        effect_stds: &[0.0, 0.05, 0.1, 0.2],
        residual_stds: &[0.02, 0.06, 0.1, 0.2],
    };

    fn pair<'a>(a: &'a str, b: &'a str, value: f64) -> Observation<'a> {
        Observation { terms: Terms { group: 0, objects: vec![a, b] }, value, standard_error: 0.01 }
    }

    #[test]
    fn without_observations_the_prediction_is_the_prior_widened_by_effects_and_residuals() {
        let terms = Terms { group: 0, objects: vec!["a", "b"] };
        let prediction = MODEL.prediction(&[], &terms);
        assert!((prediction.mean - 0.5).abs() < 1e-12);
        assert!(prediction.std > 0.3 && prediction.std < 0.45, "{}", prediction.std);
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
        let prediction = MODEL.prediction(&values, &Terms { group: 0, objects: Vec::new() });
        assert!((prediction.mean - 0.7).abs() < 2e-3, "{}", prediction.mean);
        assert!(prediction.std > 0.015 && prediction.std < 0.04, "{}", prediction.std);
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
        let prediction = MODEL.prediction(&known, &Terms { group: 0, objects: vec!["a", "d"] });
        assert!((prediction.mean - 0.6).abs() < 0.05, "{prediction:?}");
        let unknown = MODEL.prediction(&known, &Terms { group: 0, objects: vec!["x", "y"] });
        assert!(unknown.std > 1.5 * prediction.std, "{unknown:?} {prediction:?}");
    }

    #[test]
    fn another_group_shares_effects_but_not_its_mean() {
        let known = [pair("a", "b", 0.3), pair("a", "c", 0.3), pair("b", "c", 0.7), pair("b", "d", 0.7)];
        let of = |name| MODEL.prediction(&known, &Terms { group: 1, objects: vec![name] });
        let (low, high) = (of("a"), of("b"));
        assert!(low.mean < 0.5 && high.mean > low.mean, "{low:?} {high:?}");
        assert!(low.std > 0.28 && high.std > 0.28, "the group's own mean was never measured: {low:?}");
    }
}
