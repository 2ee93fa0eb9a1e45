//! Do the times of the frames grow uniformly?

use crate::statistics::upper_median;

/// Relative difference from the median step below which a step counts as usual: clocks are rounded, cameras jitter.
const STEP_TOLERANCE: f64 = 0.2;
/// Fraction of unusual steps above which the frame rate counts as variable.
const VARIABLE_FRACTION: f64 = 0.05;

/// The requirement on time stamps, for messages.
pub(crate) const NEEDED_TIMES: &str = "time stamps that grow from frame to frame";

/// Warnings about the times of the frames (s), which are multiples of `tick_s`: gaps and a variable frame rate.
pub(crate) fn warnings(times_s: &[f64], tick_s: f64) -> Vec<String> {
    let steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let Some(usual) = upper_median(steps.iter().copied()) else {
        return Vec::new();
    };
    let tolerance = (STEP_TOLERANCE * usual).max(1.5 * tick_s);
    let (mut missing, mut gaps, mut first_gap_s, mut unusual) = (0.0, 0, None, 0);
    for (step, time_s) in steps.iter().zip(times_s) {
        let multiple = (step / usual).round();
        if (step - usual).abs() <= tolerance {
        } else if multiple >= 2.0 && (step - multiple * usual).abs() <= tolerance {
            missing += multiple - 1.0;
            gaps += 1;
            first_gap_s = first_gap_s.or(Some(*time_s));
        } else {
            unusual += 1;
        }
    }
    let mut warnings = Vec::new();
    if let Some(first_s) = first_gap_s {
        warnings.push(format!(
            "{missing:.0} frames are missing in {gaps} gaps of the time stamps, the first one after {first_s:.3} s \
             (usual step: {:.3} ms)",
            1e3 * usual
        ));
    }
    if f64::from(unusual) > VARIABLE_FRACTION * steps.len() as f64 {
        let shortest = steps.iter().copied().fold(f64::INFINITY, f64::min);
        let longest = steps.iter().copied().fold(0.0, f64::max);
        warnings.push(format!(
            "the frame rate varies: steps of {:.3} to {:.3} ms (median {:.3} ms); the time stamps are used",
            1e3 * shortest,
            1e3 * longest,
            1e3 * usual
        ));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_counted_and_rounded_clocks_are_not_gaps() {
        let even: Vec<f64> = (0..60).map(|n| f64::from(n) / 60.0).collect();
        assert_eq!(warnings(&even, 1e-5), Vec::<String>::new());
        // Times in whole milliseconds: steps of 16 and 17 ms.
        let rounded: Vec<f64> = even.iter().map(|t| (t * 1e3).round() / 1e3).collect();
        assert_eq!(warnings(&rounded, 1e-3), Vec::<String>::new());
        let gaps: Vec<f64> =
            even.iter().enumerate().filter(|(n, _)| ![20, 40, 41].contains(n)).map(|(_, t)| *t).collect();
        let found = warnings(&gaps, 1e-5);
        assert!(
            found.len() == 1 && found[0].starts_with("3 frames are missing in 2 gaps"),
            "warnings: {found:?}"
        );
        assert!(found[0].contains("after 0.317 s"), "warnings: {found:?}");
    }

    #[test]
    fn a_variable_frame_rate_is_a_warning() {
        let times_s: Vec<f64> = (0..40).map(|n: i32| f64::from(n) / 30.0 + 0.01 * f64::from(n % 3)).collect();
        let found = warnings(&times_s, 1e-5);
        assert!(found.iter().any(|w| w.contains("rate varies")), "warnings: {found:?}");
    }
}
