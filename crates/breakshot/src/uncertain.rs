//! Estimates of quantities with their uncertainty.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// A value and the standard deviation of its error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// One standard deviation in the unit of the value.
    pub std: f64,
}

/// A measured quantity: mean, variation between clips and uncertainty of the mean.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimate {
    /// Mean value.
    pub mean: f64,
    /// Standard deviation between clips; `None` for a single clip.
    pub std: Option<f64>,
    /// Standard deviation of the mean.
    pub standard_error: f64,
    /// 95 % confidence interval of the mean, by Student's t where there are few clips.
    pub interval_95: [f64; 2],
    /// Number of clips that contribute a measurement.
    pub n: usize,
}

impl Estimate {
    /// Standard deviation of the uniform distribution from 0 to 1: 1/sqrt(12).
    pub(crate) const UNIFORM_STD: f64 = 0.288_675_134_594_813;

    /// A value without uncertainty, such as the mass ratio of the reference object.
    pub const fn exact(value: f64) -> Self {
        Self { mean: value, std: Some(0.0), standard_error: 0.0, interval_95: [value, value], n: 0 }
    }

    /// An assumed value of a quantity without measurements, with a uniform distribution from 0 to 1.
    pub const fn assumed(value: f64) -> Self {
        Self { mean: value, std: None, standard_error: Self::UNIFORM_STD, interval_95: [0.0, 1.0], n: 0 }
    }

    /// Checks that the uncertainties are possible; errors name `owner`.
    ///
    /// # Errors
    /// Standard deviations that are negative or not finite, an interval whose ends are not finite or not in order.
    pub fn check_uncertainty(&self, owner: &str) -> Result<()> {
        for (what, value) in [("std", self.std.unwrap_or(0.0)), ("standard_error", self.standard_error)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::invalid(owner, what, value, "a finite number, zero or more"));
            }
        }
        let [low, high] = self.interval_95;
        if !(low.is_finite() && high.is_finite() && low <= high) {
            let needed = "two finite numbers, the lower end first";
            return Err(Error::invalid(owner, "interval_95", format!("[{low}, {high}]"), needed));
        }
        Ok(())
    }

    /// The mean of repeated values of equal accuracy; `None` without values.
    ///
    /// A single value has no standard deviation: `single_standard_error`, from another source such as the noise of
    /// the track, is the uncertainty of its mean.
    pub fn from_repeats(values: &[f64], single_standard_error: f64) -> Option<Self> {
        let n = values.len();
        if n == 0 {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n as f64;
        if n == 1 {
            let half = Z_95 * single_standard_error;
            return Some(Self {
                mean,
                std: None,
                standard_error: single_standard_error,
                interval_95: [mean - half, mean + half],
                n,
            });
        }
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
        let standard_error = (variance / n as f64).sqrt();
        let half = student_t_95(n - 1) * standard_error;
        Some(Self {
            mean,
            std: Some(variance.sqrt()),
            standard_error,
            interval_95: [mean - half, mean + half],
            n,
        })
    }
}

/// Two-sided 95 % quantile of the normal distribution.
pub(crate) const Z_95: f64 = 1.959_963_984_540_054;

/// Two-sided 95 % quantile of Student's t distribution with `degrees` degrees of freedom.
///
/// Tabulated up to 10, above that the Cornish-Fisher expansion (error below 1e-4).
pub fn student_t_95(degrees: usize) -> f64 {
    const EXACT: [f64; 10] = [
        12.706_204_736,
        4.302_652_730,
        3.182_446_305,
        2.776_445_105,
        2.570_581_836,
        2.446_911_851,
        2.364_624_252,
        2.306_004_135,
        2.262_157_163,
        2.228_138_852,
    ];
    match degrees {
        0 => f64::INFINITY,
        1..=10 => EXACT[degrees - 1],
        _ => {
            let (z, n) = (Z_95, degrees as f64);
            let first = (z.powi(3) + z) / 4.0;
            let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
            let third = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
            z + (first + (second + third / n) / n) / n
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_t_quantile_agrees_with_published_tables() {
        for (degrees, expected) in [(4, 2.776_445), (15, 2.131_450), (30, 2.042_272), (120, 1.979_930)] {
            assert!((student_t_95(degrees) - expected).abs() < 1e-4, "{degrees}: {}", student_t_95(degrees));
        }
    }

    #[test]
    fn repeated_values_give_their_mean_standard_deviation_and_interval() {
        let estimate = Estimate::from_repeats(&[1.0, 2.0, 3.0], 0.0).expect("three values");
        assert_eq!((estimate.mean, estimate.std, estimate.n), (2.0, Some(1.0), 3));
        assert!((estimate.standard_error - 1.0 / 3f64.sqrt()).abs() < 1e-15);
        assert!((estimate.interval_95[1] - 2.0 - 4.302_652_730 / 3f64.sqrt()).abs() < 1e-9);
    }
}
