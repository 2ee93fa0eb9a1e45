//! The law of contacts that explains the impacts of all clips (Bayes, on a grid): contact friction, and what is left of the slip.
//!
//! Each impact shows a ratio of tangential to normal impulse: the coefficient of contact friction if its contact points slid to the
//! end, else the ratio that the tangential restitution of the pair needs, which bounds the coefficient from below.  The tangential
//! restitutions of the pairs follow one of two laws: they are about constant, or they depend on the restitution
//! ([`crate::properties::SlipDamping`]).  The pairs' own values, the scatter from impact to impact, and the part of the slip due to
//! the normal impulse that contacts do not stop, are unknown as well, and are averaged out.

use crate::estimate::measure::contact_friction::ObliqueImpact;
use crate::properties::{ContactFriction, SlipDamping, TangentialRestitution};
use crate::statistics::normal_cdf;
use crate::uncertain::{Estimate, Z_95};
use std::collections::BTreeMap;
use std::f64::consts::{LN_2, PI};

/// The grid of coefficients, from zero in steps.
const STEP: f64 = 4e-3;
const STEPS: usize = 251;
/// The grid of tangential restitutions of a pair, from the least possible one in steps.
const LEAST_TANGENTIAL: f64 = TangentialRestitution::RANGE[0];
const TANGENTIAL_STEP: f64 = 0.1;
const TANGENTIALS: usize =
    1 + ((TangentialRestitution::RANGE[1] - LEAST_TANGENTIAL) / TANGENTIAL_STEP + 0.5) as usize;
/// The standard deviation of the tangential restitutions of pairs about their law.
const PAIR_STD: f64 = 0.1;
/// The grid of exponents of damped slip; their prior is normal in the logarithm.
const EXPONENTS: [f64; 9] = [0.25, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 8.0];
/// The step of the logarithms of the exponents in the middle of the grid.
const EXPONENT_STEP: f64 = 0.5 * LN_2;
/// The restitution of a pair that no clip shows.
const UNKNOWN_RESTITUTION: f64 = 0.5;
/// The grid of standard deviations from impact to impact, and the scale of their prior (a half Cauchy distribution).
const SCATTERS: [f64; 5] = [0.0, 0.01, 0.02, 0.04, 0.08];
const SCATTER_SCALE: f64 = 0.02;
/// The part of the slip due to the normal impulse that sticking contacts do not stop, and its prior.
const CREEPS: [(f64, f64); 3] = [(0.0, 0.5), (0.1, 0.3), (0.2, 0.2)];
/// The fraction of impacts whose ratio is wrong, and their density per unit of the ratio.
const OUTLIERS: f64 = 0.05;
const OUTLIER_DENSITY: f64 = 1.0;
/// A coefficient is given if the impacts inform of it at least by this (nats): as much as if they excluded 45 % of what was assumed.
const LEAST_INFORMATION: f64 = 0.6;
/// A tangential restitution is given if its standard error is below this part of the assumed standard deviation.
const LARGEST_STD: f64 = 0.5;
/// Smallest standard deviation of a conditional distribution: it keeps divisions finite.
const SMALLEST_STD: f64 = 1e-6;
/// Deviations that are impossible, in standard deviations.
const IMPOSSIBLE: f64 = 8.0;

/// Contact friction and tangential restitution that explain all impacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContactLaw {
    /// `None` if the impacts inform too little of it.
    pub(crate) friction: Option<Estimate>,
    /// Tangential restitution if it is constant; `None` if the impacts leave more than half of the assumed standard deviation.
    pub(crate) tangential_restitution: Option<Estimate>,
    /// What was assumed before, without impacts.
    pub(crate) damping: SlipDamping,
}

/// The law of contact that explains all impacts, with the mean restitution of each pair by [`ObliqueImpact::pair`].
pub(crate) fn contact_law(impacts: &[ObliqueImpact], restitutions: &BTreeMap<String, f64>) -> ContactLaw {
    if impacts.is_empty() {
        return ContactLaw { friction: None, tangential_restitution: None, damping: SlipDamping::assumed() };
    }
    let mut by_pair: BTreeMap<&str, Vec<&ObliqueImpact>> = BTreeMap::new();
    for impact in impacts {
        by_pair.entry(&impact.pair).or_default().push(impact);
    }
    let laws = Hypothesis::all();
    let mut logarithms = vec![0.0; NUISANCES * laws.len() * STEPS];
    for (pair, of_pair) in by_pair {
        let restitution = restitutions.get(pair).copied().unwrap_or(UNKNOWN_RESTITUTION);
        add_pair(&mut logarithms, &of_pair, &laws, restitution);
    }
    let posterior = Posterior::new(&logarithms, &laws);
    ContactLaw {
        friction: friction(&posterior.frictions(), posterior.scatter(), impacts.len()),
        tangential_restitution: posterior.constant(&laws, impacts.len()),
        damping: posterior.damping(&laws, impacts.len()),
    }
}

/// One value on the grid of laws of tangential restitution, with its prior probability.
struct Hypothesis {
    law: SlipLaw,
    prior: f64,
}

#[derive(Clone, Copy)]
enum SlipLaw {
    /// About the same for all pairs.
    Constant(f64),
    /// [`SlipDamping`] with this exponent.
    Damped(f64),
}

impl Hypothesis {
    fn all() -> Vec<Self> {
        let SlipDamping { probability, exponent } = SlipDamping::assumed();
        let density = |deviation: f64| (-0.5 * deviation * deviation).exp();
        let std = exponent.standard_error / exponent.mean;
        let constant: Vec<(SlipLaw, f64)> = (0..TANGENTIALS)
            .map(tangential)
            .map(|value| (SlipLaw::Constant(value), density(value / TangentialRestitution::ASSUMED_STD)))
            .collect();
        // The exponents are not uniformly spaced: each stands for the interval up to half way to its neighbours.
        let logarithm = |k: usize| EXPONENTS[k.min(EXPONENTS.len() - 1)].ln();
        let damped: Vec<(SlipLaw, f64)> = (0..EXPONENTS.len())
            .map(|k| {
                let width = 0.5 * (logarithm(k + 1) - logarithm(k.saturating_sub(1)));
                let deviation = (logarithm(k) - exponent.mean.ln()) / std;
                (SlipLaw::Damped(EXPONENTS[k]), width * density(deviation))
            })
            .collect();
        let normalized = |laws: Vec<(SlipLaw, f64)>, share: f64| {
            let total: f64 = laws.iter().map(|(_, weight)| weight).sum();
            laws.into_iter().map(move |(law, weight)| Self { law, prior: share * weight / total })
        };
        normalized(constant, 1.0 - probability).chain(normalized(damped, probability)).collect()
    }

    /// The probability of each tangential restitution of a pair with this restitution.
    fn of_pair(&self, restitution: f64) -> [f64; TANGENTIALS] {
        let mean = match self.law {
            SlipLaw::Constant(value) => value,
            SlipLaw::Damped(exponent) => SlipDamping::restitution_at(exponent, restitution),
        };
        let weights: [f64; TANGENTIALS] =
            std::array::from_fn(|k| (-0.5 * ((tangential(k) - mean) / PAIR_STD).powi(2)).exp());
        let total: f64 = weights.iter().sum();
        weights.map(|weight| weight / total)
    }
}

/// The tangential restitution of this index.
fn tangential(index: usize) -> f64 {
    LEAST_TANGENTIAL + TANGENTIAL_STEP * index as f64
}

fn friction(frictions: &[f64], scatter: f64, n: usize) -> Option<Estimate> {
    let value = |k: usize| k as f64 * STEP;
    let mean: f64 = frictions.iter().enumerate().map(|(k, p)| p * value(k)).sum();
    let variance: f64 = frictions.iter().enumerate().map(|(k, p)| p * (value(k) - mean).powi(2)).sum();
    let interval_95 = [0.025, 0.975].map(|part| quantile(frictions, part) * STEP);
    (information(frictions) >= LEAST_INFORMATION).then(|| Estimate {
        mean,
        std: Some(scatter),
        standard_error: variance.sqrt(),
        interval_95,
        n,
    })
}

/// What the impacts inform of the coefficient: the divergence of its distribution from the prior (nats; Kullback and Leibler 1951).
fn information(frictions: &[f64]) -> f64 {
    let prior: Vec<f64> = (0..STEPS).map(|k| ContactFriction::prior_density(k as f64 * STEP)).collect();
    let total: f64 = prior.iter().sum();
    let of = |(p, q): (&f64, f64)| if *p > 0.0 { p * (p * total / q).ln() } else { 0.0 };
    frictions.iter().zip(prior).map(of).sum()
}

/// Adds the logarithm of the probability of one pair's impacts, averaged over its tangential restitution: by scatter, creep, law and coefficient.
fn add_pair(sums: &mut [f64], impacts: &[&ObliqueImpact], laws: &[Hypothesis], restitution: f64) {
    let of_pair: Vec<[f64; TANGENTIALS]> = laws.iter().map(|law| law.of_pair(restitution)).collect();
    for (nuisance, sums) in sums.chunks_mut(laws.len() * STEPS).enumerate() {
        let (scatter, (creep, _)) = (SCATTERS[nuisance / CREEPS.len()], CREEPS[nuisance % CREEPS.len()]);
        let by_tangential: [Vec<f64>; TANGENTIALS] = std::array::from_fn(|k| {
            let mut sum = vec![0.0; STEPS];
            for impact in impacts {
                Likelihood::new(impact, scatter, creep, tangential(k)).add_logarithms(&mut sum);
            }
            sum
        });
        for friction in 0..STEPS {
            let logarithms: [f64; TANGENTIALS] = std::array::from_fn(|k| by_tangential[k][friction]);
            let largest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let relative = logarithms.map(|logarithm| (logarithm - largest).exp());
            for (law, probabilities) in of_pair.iter().enumerate() {
                let mean: f64 = probabilities.iter().zip(relative).map(|(p, of)| p * of).sum();
                sums[law * STEPS + friction] += mean.max(f64::MIN_POSITIVE).ln() + largest;
            }
        }
    }
}

/// The combinations of scatter and creep.
const NUISANCES: usize = SCATTERS.len() * CREEPS.len();

/// The probability of each scatter, creep, law and coefficient of the grid, the last one fastest.
struct Posterior {
    probabilities: Vec<f64>,
    laws: usize,
}

impl Posterior {
    /// From the logarithms of the probability of all impacts.
    fn new(of_impacts: &[f64], laws: &[Hypothesis]) -> Self {
        let logarithm = |index: usize| {
            let (nuisance, law, friction) =
                (index / (STEPS * laws.len()), index / STEPS % laws.len(), index % STEPS);
            let (scatter, creep) = (SCATTERS[nuisance / CREEPS.len()], CREEPS[nuisance % CREEPS.len()].1);
            let prior = ContactFriction::prior_density(friction as f64 * STEP) * laws[law].prior * creep
                / (1.0 + (scatter / SCATTER_SCALE).powi(2));
            prior.ln() + of_impacts[index]
        };
        let logarithms: Vec<f64> = (0..of_impacts.len()).map(logarithm).collect();
        let largest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = logarithms.into_iter().map(|l| (l - largest).exp()).collect();
        let total: f64 = weights.iter().sum();
        Self { probabilities: weights.into_iter().map(|weight| weight / total).collect(), laws: laws.len() }
    }

    /// The probability of each coefficient.
    fn frictions(&self) -> Vec<f64> {
        (0..STEPS).map(|k| self.probabilities.iter().skip(k).step_by(STEPS).sum()).collect()
    }

    /// The mean scatter from impact to impact.
    fn scatter(&self) -> f64 {
        let of_scatters = self.probabilities.chunks(STEPS * self.laws * CREEPS.len());
        of_scatters.zip(SCATTERS).map(|(of_scatter, s)| s * of_scatter.iter().sum::<f64>()).sum()
    }

    /// The laws' values on a scale, with their probabilities.
    fn of_laws(&self, laws: &[Hypothesis], value: impl Fn(SlipLaw) -> Option<f64>) -> Vec<(f64, f64)> {
        let of_law =
            |law: usize| self.probabilities.chunks(STEPS).skip(law).step_by(self.laws).flatten().sum();
        (laws.iter().enumerate())
            .filter_map(|(k, hypothesis)| Some((value(hypothesis.law)?, of_law(k))))
            .collect()
    }

    /// Tangential restitution if it is about the same for all pairs.
    fn constant(&self, laws: &[Hypothesis], n: usize) -> Option<Estimate> {
        let constants = self.of_laws(laws, |law| match law {
            SlipLaw::Constant(value) => Some(value),
            SlipLaw::Damped(_) => None,
        });
        let [_, mean, standard_error] = moments(&constants, TANGENTIAL_STEP);
        let interval_95 = [mean - Z_95 * standard_error, mean + Z_95 * standard_error];
        (standard_error < LARGEST_STD * TangentialRestitution::ASSUMED_STD).then_some(Estimate {
            mean,
            std: Some(PAIR_STD),
            standard_error,
            interval_95,
            n,
        })
    }

    /// The probability of damped slip, and its exponent.
    fn damping(&self, laws: &[Hypothesis], n: usize) -> SlipDamping {
        let logarithms = self.of_laws(laws, |law| match law {
            SlipLaw::Constant(_) => None,
            SlipLaw::Damped(exponent) => Some(exponent.ln()),
        });
        let [probability, mean, std] = moments(&logarithms, EXPONENT_STEP);
        let at = |deviations: f64| (mean + deviations * std).exp();
        let exponent = Estimate {
            mean: at(0.0),
            std: None,
            standard_error: std * at(0.0),
            interval_95: [at(-Z_95), at(Z_95)],
            n,
        };
        SlipDamping { probability: probability.clamp(0.0, 1.0), exponent }
    }
}

/// The total probability of weighted values on a grid with this step, their mean and their standard deviation.
fn moments(weighted: &[(f64, f64)], step: f64) -> [f64; 3] {
    let total: f64 = weighted.iter().map(|(_, weight)| weight).sum();
    let mean_of = |f: &dyn Fn(f64) -> f64| {
        weighted.iter().map(|(value, weight)| weight * f(*value)).sum::<f64>() / total.max(f64::MIN_POSITIVE)
    };
    let mean = mean_of(&|value| value);
    let variance = mean_of(&|value| (value - mean).powi(2));
    [total, mean, (variance + step.powi(2) / 12.0).sqrt()]
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

/// The probability of one impact's measured ratios as a function of the coefficient.
///
/// The true ratio that the tangential restitution needs is unknown, with a uniform prior, and is integrated out: above the coefficient the
/// contact slides to the end, below it sticks.
struct Likelihood {
    /// The measured ratio, and its standard deviation.
    ratio: Normal,
    /// The needed ratio if the contact slides: its mean at the measured ratio, the change of that mean per friction, its
    /// standard deviation.
    sliding: Normal,
    sliding_slope: f64,
    /// The probability density of the measured ratios if the contact sticks, and the needed ratio then.
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

    /// No value is above.
    fn most(self) -> f64 {
        self.mean + IMPOSSIBLE * self.std
    }
}

impl Likelihood {
    fn new(impact: &ObliqueImpact, scatter: f64, creep: f64, tangential: f64) -> Self {
        let all = impact.sticking_ratio;
        let of_slip = impact.slip_ratio.unwrap_or(all);
        let needed = (1.0 - creep) * (all - of_slip) + (1.0 + tangential) * of_slip;
        // Ratios are positive against the slip that remains.
        let sign = if needed < 0.0 { -1.0 } else { 1.0 };
        let (r, s) = (sign * impact.impulse_ratio.value, sign * needed);
        let ratio = Normal { mean: r, std: impact.impulse_ratio.std.hypot(scatter).max(SMALLEST_STD) };
        // The error of the needed ratio is that of the ratio that ends all slip: the standard deviations are upper bounds, so that a width that
        // depends on the tangential restitution would count in favour of the narrowest.
        let (variance, needed_variance) = (ratio.std.powi(2), impact.sticking_std.powi(2));
        let conditional_std = |variance: f64| variance.max(0.0).sqrt().max(SMALLEST_STD);

        let slope = impact.covariance / variance;
        let sliding = Normal { mean: s, std: conditional_std(needed_variance - slope * impact.covariance) };

        // If the contact sticks, the measured ratio and the needed one differ by noise only.
        let difference = r - s;
        let difference_std = conditional_std(variance - 2.0 * impact.covariance + needed_variance);
        let covariance = impact.covariance - needed_variance;
        let gain = covariance / difference_std.powi(2);
        Self {
            ratio,
            sliding,
            sliding_slope: slope,
            density_sticking: Normal { mean: 0.0, std: difference_std }.density(difference),
            sticking: Normal {
                mean: s - gain * difference,
                std: conditional_std(needed_variance - gain * covariance),
            },
        }
    }

    fn of(&self, friction: f64) -> f64 {
        let mean = self.sliding.mean - self.sliding_slope * (self.ratio.mean - friction);
        let slides = self.ratio.density(friction) * (1.0 - Normal { mean, ..self.sliding }.below(friction));
        let sticks = self.density_sticking * self.sticking.below(friction);
        (1.0 - OUTLIERS) * (slides + sticks) + OUTLIERS * OUTLIER_DENSITY
    }

    /// Adds the logarithm of the probability at each coefficient.
    fn add_logarithms(&self, sums: &mut [f64]) {
        // Above all possible ratios every coefficient is as probable as the next.
        let most = self.ratio.most().max(self.sticking.most());
        let distinct = ((most / STEP).ceil().max(0.0) as usize).min(sums.len() - 1);
        let last = self.of(distinct as f64 * STEP).ln();
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += if k < distinct { self.of(k as f64 * STEP).ln() } else { last };
        }
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
            slip_ratio: Some(sticking_ratio),
            sticking_std: 0.01,
            covariance: 0.0,
        };
        ratios.iter().map(impact).collect()
    }

    fn law_of(impacts: &[ObliqueImpact]) -> ContactLaw {
        contact_law(impacts, &BTreeMap::new())
    }

    #[test]
    fn impacts_that_slide_to_the_end_give_the_coefficient() {
        let found =
            law_of(&impacts(&[(0.24, 0.6), (0.26, 0.5), (0.05, 0.05)])).friction.expect("two impacts slide");
        assert!((found.mean - 0.25).abs() < 0.02, "{found:?}");
        assert!(found.interval_95[0] < 0.24 && found.interval_95[1] > 0.26, "{found:?}");
        assert!(found.interval_95[1] - found.interval_95[0] < 0.15, "{found:?}");
    }

    #[test]
    fn more_impacts_narrow_the_interval() {
        let width = |n: usize| {
            let [low, high] =
                law_of(&impacts(&vec![(0.15, 0.6); n])).friction.expect("they slide").interval_95;
            high - low
        };
        assert!(width(8) < 0.75 * width(2), "{} {}", width(8), width(2));
    }

    #[test]
    fn impacts_that_stick_only_bound_it() {
        // Central impacts say nothing, even if contacts creep and all ratios are too small by the same factor.
        let central: Vec<(f64, f64)> = (1..40).map(|k| 2e-3 * f64::from(k)).map(|s| (0.8 * s, s)).collect();
        assert_eq!(law_of(&impacts(&central)).friction, None);
        // Contacts that stick at large ratios prove a large coefficient.
        let oblique: Vec<(f64, f64)> = (1..10).map(|k| 0.03 * f64::from(k)).map(|s| (s, s)).collect();
        let found = law_of(&impacts(&oblique)).friction.expect("friction is bounded from both sides");
        assert!(found.interval_95[0] > 0.2, "{found:?}");
    }

    #[test]
    fn tangential_restitution_is_of_the_slip_before_the_impact() {
        // A third of the slip remains: the ratios are smaller by a third of the part that is due to the slip.
        let creeping = (1..60).map(|k| {
            let (of_slip, of_normal) = (0.01 * f64::from(k % 30), 0.03 * f64::from(k % 3));
            ObliqueImpact {
                pair: format!("a/{}", k % 6),
                slip_ratio: Some(of_slip),
                ..impacts(&[(2.0 / 3.0 * of_slip - of_normal, of_slip - of_normal)]).remove(0)
            }
        });
        let found = law_of(&creeping.collect::<Vec<_>>()).tangential_restitution.expect("the impacts agree");
        assert!((found.mean + 1.0 / 3.0).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn without_impacts_nothing_is_learned() {
        let found = law_of(&[]);
        assert_eq!((found.friction, found.tangential_restitution), (None, None));
        assert_eq!(found.damping, SlipDamping::assumed());
    }

    #[test]
    fn information_is_counted_whatever_the_shape_of_the_distribution() {
        let normalized = |density: &dyn Fn(f64) -> f64| {
            let values: Vec<f64> = (0..STEPS).map(|k| density(k as f64 * STEP)).collect();
            let total: f64 = values.iter().sum();
            values.into_iter().map(|value| value / total).collect::<Vec<f64>>()
        };
        let prior = ContactFriction::prior_density;
        assert!(information(&normalized(&prior)).abs() < 1e-9);
        // Half of the prior is below 0.25.
        let halved = information(&normalized(&|x| if x < 0.25 { prior(x) } else { 0.0 }));
        assert!((halved - LN_2).abs() < 0.02, "{halved}");
        // A narrow peak with a long tail, whose interval holds more than half of the prior.
        let peak = normalized(&|x| {
            prior(x) * (20.0 * (-0.5 * ((x - 0.23) / 0.01).powi(2)).exp() + f64::from(u8::from(x > 0.2)))
        });
        let found = friction(&peak, 0.0, 20).expect("most of it is within the peak");
        assert!(found.interval_95[1] - found.interval_95[0] > 0.25, "{found:?}");
        assert!((found.mean - 0.23).abs() < found.standard_error, "{found:?}");
    }

    #[test]
    fn one_wrong_impact_does_not_move_the_coefficient() {
        let with_outlier = impacts(&[(0.15, 0.6), (0.16, 0.5), (0.14, 0.5), (0.15, 0.4), (-0.3, 0.5)]);
        let found = law_of(&with_outlier).friction.expect("four impacts agree");
        assert!((found.mean - 0.15).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn slip_of_the_normal_impulse_that_is_not_stopped_is_no_sliding() {
        // The ratios of central impacts are smaller by an eighth, with little noise.
        let creeping = (0..40).map(|k| {
            let of_normal = 0.002 * f64::from(k);
            let impact = impacts(&[(0.88 * of_normal, of_normal)]).remove(0);
            ObliqueImpact { slip_ratio: Some(0.0), ..impact }
        });
        assert_eq!(law_of(&creeping.collect::<Vec<_>>()).friction, None);
    }

    #[test]
    fn many_impacts_of_pairs_that_disagree_give_finite_numbers() {
        let of = |pair: &str, ratio: f64| {
            let impact = ObliqueImpact { pair: pair.into(), ..impacts(&[(ratio, 0.8)]).remove(0) };
            vec![impact; 300]
        };
        let found = law_of(&[of("a/b", 0.1), of("a/c", 0.6)].concat());
        assert!(found.damping.probability.is_finite() && found.damping.exponent.mean.is_finite());
        assert!(found.friction.is_none_or(|friction| friction.mean.is_finite()), "{found:?}");
    }

    /// Impacts that stick, of pairs with these restitutions, of whose slip these parts remain.
    fn damped(pairs: &[(f64, f64)]) -> ContactLaw {
        let name = |k: usize| format!("a/{k}");
        let restitutions: BTreeMap<String, f64> =
            pairs.iter().enumerate().map(|(k, &(restitution, _))| (name(k), restitution)).collect();
        let of_pair = |(k, &(_, left)): (usize, &(f64, f64))| {
            let impact =
                |s: f64| ObliqueImpact { pair: name(k), ..impacts(&[((1.0 - left) * s, s)]).remove(0) };
            [0.1, 0.15, 0.2, 0.25].map(impact)
        };
        let impacts: Vec<ObliqueImpact> = pairs.iter().enumerate().flat_map(of_pair).collect();
        contact_law(&impacts, &restitutions)
    }

    #[test]
    fn damped_slip_is_told_from_a_constant_restitution() {
        let restitutions = [0.3, 0.5, 0.7, 0.85];
        let found = damped(&restitutions.map(|e: f64| (e, e * e))).damping;
        assert!(found.probability > 0.8, "{found:?}");
        assert!((found.exponent.mean - 2.0).abs() < 0.4, "{found:?}");
        let constant = damped(&restitutions.map(|e| (e, 0.0)));
        assert!(constant.damping.probability < 0.2, "{constant:?}");
        let mean = constant.tangential_restitution.expect("sixteen impacts").mean;
        assert!(mean.abs() < 0.1, "{mean}");
    }

    #[test]
    fn central_impacts_leave_the_prior_law() {
        let found = law_of(&impacts(&[(0.002, 0.003), (0.001, 0.0), (0.003, 0.004)])).damping;
        let assumed = SlipDamping::assumed();
        assert!((found.probability - assumed.probability).abs() < 0.05, "{found:?}");
        assert!((found.exponent.mean / assumed.exponent.mean).ln().abs() < 0.2, "{found:?}");
    }
}
