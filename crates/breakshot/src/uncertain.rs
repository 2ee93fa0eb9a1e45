//! A number that knows how sure it is.

use serde::{Deserialize, Serialize};

/// A measured quantity: its mean, how much it varies from clip to clip, and how well the mean is known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimate {
    /// The best single value.
    pub mean: f64,
    /// The spread from clip to clip (one standard deviation); unknown from a single clip.
    pub std: Option<f64>,
    /// One standard deviation of the mean itself.
    pub standard_error: f64,
    /// Holds the true mean with 95 % probability; Student's t where few clips speak.
    pub interval_95: [f64; 2],
    /// How many clips speak for it.
    pub n: usize,
}

impl Estimate {
    /// A value known exactly, such as the reference object's mass ratio.
    pub const fn exact(value: f64) -> Self {
        Self { mean: value, std: Some(0.0), standard_error: 0.0, interval_95: [value, value], n: 0 }
    }

    /// A value that nobody measured: no clip speaks for it, and it may be anything from 0 to 1.
    pub const fn assumed(value: f64) -> Self {
        Self { mean: value, std: None, standard_error: UNIFORM_STD, interval_95: [0.0, 1.0], n: 0 }
    }

    /// The mean of repeated values, each as good as the others.
    ///
    /// One value alone has no spread: then `single_standard_error`, known from elsewhere (the noise of the
    /// track), stands for its uncertainty.  No values give `None`.
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

/// The standard deviation of a number that is anywhere from 0 to 1 with equal probability: 1/sqrt(12).
const UNIFORM_STD: f64 = 0.288_675_134_594_813;

/// The two-sided 95 % quantile of the normal distribution.
const Z_95: f64 = 1.959_963_984_540_054;

/// The two-sided 95 % quantile of Student's t with `degrees` degrees of freedom.
///
/// Exact values up to 10, beyond that the Cornish-Fisher expansion (error below 1e-4).
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
    fn the_t_quantile_agrees_with_the_tables() {
        for (degrees, expected) in [(4, 2.776_445), (15, 2.131_450), (30, 2.042_272), (120, 1.979_930)] {
            assert!((student_t_95(degrees) - expected).abs() < 1e-4, "{degrees}: {}", student_t_95(degrees));
        }
    }

    #[test]
    fn repeats_give_the_textbook_mean_and_spread() {
        let estimate = Estimate::from_repeats(&[1.0, 2.0, 3.0], 0.0).expect("three values");
        assert_eq!((estimate.mean, estimate.std, estimate.n), (2.0, Some(1.0), 3));
        assert!((estimate.standard_error - 1.0 / 3f64.sqrt()).abs() < 1e-15);
        assert!((estimate.interval_95[1] - 2.0 - 4.302_652_730 / 3f64.sqrt()).abs() < 1e-9);
    }
}
