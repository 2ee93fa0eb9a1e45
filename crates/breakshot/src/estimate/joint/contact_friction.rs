//! The coefficient of contact friction that explains the impacts of all clips (Bayes, on a grid).
//!
//! Each impact shows a ratio of tangential to normal impulse: the coefficient if its contact points slid to the end, else
//! the ratio that ended the slip, times one plus the tangential restitution of the pair.  An impact that sticks bounds the
//! coefficient from below.  The tangential restitutions of the pairs and the scatter from impact to impact are unknown as
//! well, and are averaged out.

use crate::estimate::measure::contact_friction::ObliqueImpact;
use crate::properties::{ContactFriction, TangentialRestitution};
use crate::statistics::normal_cdf;
use crate::uncertain::{Estimate, Z_95};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// The grid of coefficients, from zero in steps.
const STEP: f64 = 4e-3;
const STEPS: usize = 251;
/// The grid of tangential restitutions of a pair (`rebound`); their prior is normal about zero.
const REBOUNDS: [f64; 12] = [-0.6, -0.5, -0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5];
/// The grid of standard deviations from impact to impact, and the scale of their prior (a half Cauchy distribution).
const SCATTERS: [f64; 5] = [0.0, 0.01, 0.02, 0.04, 0.08];
const SCATTER_SCALE: f64 = 0.02;
/// The fraction of impacts whose ratio is wrong, and their density per unit of the ratio.
const OUTLIERS: f64 = 0.05;
const OUTLIER_DENSITY: f64 = 1.0;
/// A coefficient is given if its interval holds at most this part of the prior probability.
const MOST_LEFT: f64 = 0.5;
/// A tangential restitution is given if its standard deviation is below this part of the assumed one's.
const LARGEST_STD: f64 = 0.5;
/// Smallest standard deviation of a conditional distribution: it keeps divisions finite.
const SMALLEST_STD: f64 = 1e-6;

/// Contact friction and tangential restitution that explain all impacts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ContactLaw {
    /// `None` if the impacts exclude less than half of what was assumed before.
    pub(crate) friction: Option<Estimate>,
    /// The mean over all pairs; `None` if the impacts leave more than half of the assumed standard deviation.
    pub(crate) tangential_restitution: Option<Estimate>,
}

/// The law of contact that explains all impacts.
pub(crate) fn contact_law(impacts: &[ObliqueImpact]) -> ContactLaw {
    if impacts.is_empty() {
        return ContactLaw::default();
    }
    let mut by_pair: BTreeMap<&str, Vec<&ObliqueImpact>> = BTreeMap::new();
    for impact in impacts {
        by_pair.entry(&impact.pair).or_default().push(impact);
    }
    let pairs: Vec<PairLikelihood> = by_pair.values().map(|of_pair| PairLikelihood::new(of_pair)).collect();
    let posterior = Posterior::new(&pairs);
    ContactLaw {
        friction: friction(&posterior.frictions(), posterior.scatter(), impacts.len()),
        tangential_restitution: tangential_restitution(&pairs, &posterior, impacts.len()),
    }
}

/// The mean over the pairs, each of which counts by the part of the prior variance that its impacts remove.
fn tangential_restitution(pairs: &[PairLikelihood], posterior: &Posterior, n: usize) -> Option<Estimate> {
    let prior_variance = TangentialRestitution::ASSUMED_STD.powi(2);
    let of_pairs: Vec<(f64, f64, f64)> = pairs
        .iter()
        .map(|pair| {
            let rebounds = posterior.rebounds(pair);
            let mean: f64 = REBOUNDS.iter().zip(&rebounds).map(|(x, p)| p * x).sum();
            let variance: f64 = REBOUNDS.iter().zip(&rebounds).map(|(x, p)| p * (x - mean).powi(2)).sum();
            ((1.0 - variance / prior_variance).max(0.0), mean, variance)
        })
        .collect();
    let total: f64 = of_pairs.iter().map(|(weight, ..)| weight).sum();
    let mean = of_pairs.iter().map(|(weight, mean, _)| weight * mean).sum::<f64>() / total;
    let between = of_pairs.iter().map(|(weight, m, _)| weight * (m - mean).powi(2)).sum::<f64>() / total;
    let within = of_pairs.iter().map(|(weight, _, variance)| weight * variance).sum::<f64>() / total;
    let standard_error = ((between + within) / total).sqrt();
    let interval_95 = [mean - Z_95 * standard_error, mean + Z_95 * standard_error];
    (standard_error < LARGEST_STD * TangentialRestitution::ASSUMED_STD).then(|| Estimate {
        mean,
        std: Some(between.sqrt()),
        standard_error,
        interval_95,
        n,
    })
}

fn friction(frictions: &[f64], scatter: f64, n: usize) -> Option<Estimate> {
    let value = |k: usize| k as f64 * STEP;
    let mean: f64 = frictions.iter().enumerate().map(|(k, p)| p * value(k)).sum();
    let variance: f64 = frictions.iter().enumerate().map(|(k, p)| p * (value(k) - mean).powi(2)).sum();
    let interval_95 = [0.025, 0.975].map(|part| quantile(frictions, part) * STEP);
    let prior = |k: usize| ContactFriction::prior_density(value(k));
    let inside = (0..STEPS).filter(|&k| (interval_95[0]..=interval_95[1]).contains(&value(k))).map(prior);
    let left = inside.sum::<f64>() / (0..STEPS).map(prior).sum::<f64>();
    (left < MOST_LEFT).then(|| Estimate {
        mean,
        std: Some(scatter),
        standard_error: variance.sqrt(),
        interval_95,
        n,
    })
}

/// The logarithm of the likelihood of one pair's impacts, by scatter, rebound and coefficient.
struct PairLikelihood {
    logarithms: Vec<f64>,
}

impl PairLikelihood {
    fn new(impacts: &[&ObliqueImpact]) -> Self {
        let mut logarithms = Vec::with_capacity(SCATTERS.len() * REBOUNDS.len() * STEPS);
        for scatter in SCATTERS {
            for rebound in REBOUNDS {
                let impacts: Vec<Likelihood> =
                    impacts.iter().map(|i| Likelihood::new(i, scatter, rebound)).collect();
                logarithms.extend((0..STEPS).map(|k| {
                    let friction = k as f64 * STEP;
                    impacts.iter().map(|i| i.of(friction).ln()).sum::<f64>()
                }));
            }
        }
        Self { logarithms }
    }

    /// For one scatter and coefficient: the probability of each rebound times that of the impacts, over a common factor, and
    /// the logarithm of that factor.
    fn by_rebound(&self, scatter: usize, friction: usize) -> ([f64; REBOUNDS.len()], f64) {
        let logarithms: [f64; REBOUNDS.len()] = std::array::from_fn(|r| {
            let prior = -0.5 * (REBOUNDS[r] / TangentialRestitution::ASSUMED_STD).powi(2);
            prior + self.logarithms[(scatter * REBOUNDS.len() + r) * STEPS + friction]
        });
        let largest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (logarithms.map(|l| (l - largest).exp()), largest)
    }
}

/// The probability of each scatter and coefficient of the grid, the scatters one after the other.
struct Posterior(Vec<f64>);

impl Posterior {
    fn new(pairs: &[PairLikelihood]) -> Self {
        let logarithm = |index: usize| {
            let (scatter, friction) = (index / STEPS, index % STEPS);
            let of_pairs = pairs.iter().map(|pair| {
                let (probabilities, factor) = pair.by_rebound(scatter, friction);
                factor + probabilities.iter().sum::<f64>().ln()
            });
            of_pairs.sum::<f64>() + ContactFriction::prior_density(friction as f64 * STEP).ln()
                - (1.0 + (SCATTERS[scatter] / SCATTER_SCALE).powi(2)).ln()
        };
        let logarithms: Vec<f64> = (0..SCATTERS.len() * STEPS).map(logarithm).collect();
        let largest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = logarithms.into_iter().map(|l| (l - largest).exp()).collect();
        let total: f64 = weights.iter().sum();
        Self(weights.into_iter().map(|weight| weight / total).collect())
    }

    /// The probability of each coefficient.
    fn frictions(&self) -> Vec<f64> {
        (0..STEPS).map(|k| self.0.iter().skip(k).step_by(STEPS).sum()).collect()
    }

    /// The mean scatter from impact to impact.
    fn scatter(&self) -> f64 {
        self.0.chunks(STEPS).zip(SCATTERS).map(|(of_scatter, s)| s * of_scatter.iter().sum::<f64>()).sum()
    }

    /// The probability of each rebound of a pair.
    fn rebounds(&self, pair: &PairLikelihood) -> [f64; REBOUNDS.len()] {
        let mut rebounds = [0.0; REBOUNDS.len()];
        for (index, weight) in self.0.iter().enumerate() {
            let (probabilities, _) = pair.by_rebound(index / STEPS, index % STEPS);
            let total: f64 = probabilities.iter().sum();
            for (rebound, probability) in rebounds.iter_mut().zip(probabilities) {
                *rebound += weight * probability / total;
            }
        }
        rebounds
    }
}

/// The position on the grid, in steps, below which this part of the probability lies; each point stands for one step about it.
fn quantile(probabilities: &[f64], part: f64) -> f64 {
    let mut below = 0.0;
    for (k, probability) in probabilities.iter().enumerate() {
        if below + probability >= part {
            return (k as f64 - 0.5 + (part - below) / probability).max(0.0);
        }
        below += probability;
    }
    (probabilities.len() - 1) as f64
}

/// The probability of one impact's measured ratios as a function of the coefficient, for one rebound and scatter.
///
/// The true ratio that ends the slip is unknown, with a uniform prior, and is integrated out: above the coefficient over
/// `reach = 1 + rebound` the contact slides to the end, below it sticks.
struct Likelihood {
    reach: f64,
    /// The measured ratio, and its standard deviation.
    ratio: Normal,
    /// The sticking ratio if the contact slides: its mean at the measured ratio, the change of that mean per friction, its
    /// standard deviation.
    sliding: Normal,
    sliding_slope: f64,
    /// The probability density of the measured ratios if the contact sticks, and the sticking ratio then.
    density_sticking: f64,
    sticking: Normal,
}

#[derive(Clone, Copy)]
struct Normal {
    mean: f64,
    std: f64,
}

impl Normal {
    fn density(self, x: f64) -> f64 {
        (-0.5 * ((x - self.mean) / self.std).powi(2)).exp() / (self.std * (2.0 * PI).sqrt())
    }

    /// The probability of a value below x.
    fn below(self, x: f64) -> f64 {
        normal_cdf((x - self.mean) / self.std)
    }
}

impl Likelihood {
    fn new(impact: &ObliqueImpact, scatter: f64, rebound: f64) -> Self {
        let reach = 1.0 + rebound;
        let (r, s) = (impact.impulse_ratio, impact.sticking_ratio);
        let ratio = Normal { mean: r.value, std: r.std.hypot(scatter).max(SMALLEST_STD) };
        let (variance, sticking_variance) = (ratio.std.powi(2), impact.sticking_std.powi(2));
        let conditional_std = |variance: f64| variance.max(0.0).sqrt().max(SMALLEST_STD);

        let slope = impact.covariance / variance;
        let sliding = Normal { mean: s, std: conditional_std(sticking_variance - slope * impact.covariance) };

        // If the contact sticks, the measured ratio and `reach` times the sticking one differ by noise only.
        let difference = r.value - reach * s;
        let difference_variance =
            variance - 2.0 * reach * impact.covariance + reach * reach * sticking_variance;
        let difference_std = conditional_std(difference_variance);
        let covariance = impact.covariance - reach * sticking_variance;
        let gain = covariance / difference_std.powi(2);
        Self {
            reach,
            ratio,
            sliding,
            sliding_slope: slope,
            density_sticking: Normal { mean: 0.0, std: difference_std }.density(difference),
            sticking: Normal {
                mean: s - gain * difference,
                std: conditional_std(sticking_variance - gain * covariance),
            },
        }
    }

    fn of(&self, friction: f64) -> f64 {
        let limit = friction / self.reach;
        let mean = self.sliding.mean - self.sliding_slope * (self.ratio.mean - friction);
        let slides = self.ratio.density(friction) * (1.0 - Normal { mean, ..self.sliding }.below(limit));
        let sticks = self.density_sticking * self.sticking.below(limit);
        (1.0 - OUTLIERS) * (slides + sticks) + OUTLIERS * OUTLIER_DENSITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::clip::result::Measured;

    /// Impacts with these measured and sticking ratios.
    fn impacts(ratios: &[(f64, f64)]) -> Vec<ObliqueImpact> {
        let impact = |&(value, sticking_ratio): &(f64, f64)| ObliqueImpact {
            with_striker: false,
            pair: "a/b".into(),
            impulse_ratio: Measured { value, std: 0.012 },
            sticking_ratio,
            sticking_std: 0.01,
            covariance: 0.0,
        };
        ratios.iter().map(impact).collect()
    }

    #[test]
    fn impacts_that_slide_to_the_end_give_the_coefficient() {
        let found = contact_law(&impacts(&[(0.24, 0.6), (0.26, 0.5), (0.05, 0.05)]))
            .friction
            .expect("two impacts slide");
        assert!((found.mean - 0.25).abs() < 0.02, "{found:?}");
        assert!(found.interval_95[0] < 0.24 && found.interval_95[1] > 0.26, "{found:?}");
        assert!(found.interval_95[1] - found.interval_95[0] < 0.15, "{found:?}");
    }

    #[test]
    fn more_impacts_narrow_the_interval() {
        let width = |n: usize| {
            let [low, high] =
                contact_law(&impacts(&vec![(0.15, 0.6); n])).friction.expect("they slide").interval_95;
            high - low
        };
        assert!(width(8) < 0.75 * width(2), "{} {}", width(8), width(2));
    }

    #[test]
    fn impacts_that_stick_only_bound_it() {
        // Central impacts say nothing, even if contacts creep and all ratios are too small by the same factor.
        let central: Vec<(f64, f64)> = (1..40).map(|k| 2e-3 * f64::from(k)).map(|s| (0.8 * s, s)).collect();
        assert_eq!(contact_law(&impacts(&central)).friction, None);
        // Contacts that stick at large ratios prove a large coefficient.
        let oblique: Vec<(f64, f64)> = (1..10).map(|k| 0.03 * f64::from(k)).map(|s| (s, s)).collect();
        let found = contact_law(&impacts(&oblique)).friction.expect("friction is bounded from both sides");
        assert!(found.interval_95[0] > 0.2, "{found:?}");
    }

    #[test]
    fn without_impacts_nothing_is_given() {
        assert_eq!(contact_law(&[]), ContactLaw::default());
    }

    #[test]
    fn one_wrong_impact_does_not_move_the_coefficient() {
        let with_outlier = impacts(&[(0.15, 0.6), (0.16, 0.5), (0.14, 0.5), (0.15, 0.4), (-0.3, 0.5)]);
        let found = contact_law(&with_outlier).friction.expect("four impacts agree");
        assert!((found.mean - 0.15).abs() < 0.02, "{found:?}");
    }
}
