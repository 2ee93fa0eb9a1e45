//! What are the velocity and the acceleration of each object?  (Fig. 6 of the paper.)
//!
//! For display only: estimation fits the positions themselves. Both come from a parabola through a few neighbours of
//! a sample. Of the windows before, around and after the sample the one with the best fit counts, so that an impact
//! is not smoothed over several samples.

use super::tracks::Sample;
use crate::geometry::Vec2;
use crate::geometry::moments::principal_axes;
use crate::statistics::upper_median;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Number of samples of a parabola: enough to average noise, few enough for short slides.
const WINDOW: usize = 5;
/// Number of samples between impacts in close succession.
const SHORT_WINDOW: usize = 3;
/// A gap is an interval of more than this many median intervals.
const GAP: f64 = 2.5;
/// A parabola with larger residuals (standard deviations) crosses an impact.
const IMPACT_STDS: f64 = 4.0;
/// Displacement within a window from which an object moves (standard deviations of the position).
const MOVING_STDS: f64 = 30.0;
/// Ratio by which the best of three overlapping windows fits better by chance than a given one.
const BEST_OF_THREE: f64 = 0.7;

/// Sets velocity, angular velocity and acceleration of all samples of a track.
pub(super) fn fill(samples: &mut [Sample]) {
    let runs = runs(samples);
    for k in 0..samples.len() {
        let Some(run) = runs.iter().find(|run| run.contains(&k)) else { continue };
        let windows = windows(run, k, WINDOW);
        let best = best_fit(samples, k, windows).filter(|best| best.residual_stds < IMPACT_STDS);
        let Some(derivatives) = best.or_else(|| smoothest(samples, k, run)) else { continue };
        let sample = &mut samples[k];
        (sample.vx_m_s, sample.vy_m_s) = (Some(derivatives.velocity.x), Some(derivatives.velocity.y));
        (sample.ax_m_s2, sample.ay_m_s2) =
            (Some(derivatives.acceleration.x), Some(derivatives.acceleration.y));
        sample.yaw_rate_rad_s = derivatives.yaw_rate_rad_s;
    }
}

/// Residuals of the samples of a moving object, in their standard deviations: about 1 where these are right. One pair per sample in motion,
/// from uniformly decelerated motion and from a straight line: an impact ahead or a stop within all windows of a sample, as in a film of 30
/// frames a second, is in the first one only, a deflection in both.
pub(super) fn residual_stds(samples: &[Sample]) -> Vec<[f64; 2]> {
    let runs = runs(samples);
    let moving = |window: &Range<usize>| {
        let (first, last) = (&samples[window.start], &samples[window.end - 1]);
        first.position().distance(last.position()) > MOVING_STDS * first.std_m
    };
    let of_sample = |k: usize| {
        let run = runs.iter().find(|run| run.contains(&k))?;
        let windows = || windows(run, k, WINDOW).filter(moving);
        let best = best_fit(samples, k, windows())?;
        let perpendicular = windows().map(|window| perpendicular_stds(&samples[window]));
        Some([best.residual_stds, perpendicular.min_by(f64::total_cmp)?].map(|stds| stds / BEST_OF_THREE))
    };
    (0..samples.len()).filter_map(of_sample).collect()
}

/// Residuals of some samples from the straight line through them, in their standard deviations.
fn perpendicular_stds(samples: &[Sample]) -> f64 {
    let n = samples.len() as f64;
    let sum = samples.iter().map(|s| s.position().to_vec()).fold(Vec2::ZERO, |sum, at| sum + at);
    let (xx, xy, yy) = samples.iter().fold((0.0, 0.0, 0.0), |(xx, xy, yy), s| {
        let d = s.position().to_vec() - sum / n;
        (xx + d.x * d.x, xy + d.x * d.y, yy + d.y * d.y)
    });
    let (_, squares, _) = principal_axes([xx, xy, yy]);
    let std_m = samples.iter().map(|s| s.std_m).fold(0.0, f64::max);
    (squares / (n - 2.0).max(1.0)).sqrt() / std_m
}

/// Derivatives at an instant, and the residuals of their parabola.
struct Derivatives {
    velocity: Vec2,
    acceleration: Vec2,
    yaw_rate_rad_s: Option<f64>,
    residual_stds: f64,
}

/// The usual interval between samples (s).
pub(super) fn usual_interval_s(samples: &[Sample]) -> Option<f64> {
    upper_median(samples.windows(2).map(|s| s[1].time_s - s[0].time_s))
}

/// The usual duration of the windows of [`residual_stds`] (s).
pub(super) fn window_s(samples: &[Sample]) -> Option<f64> {
    Some(WINDOW as f64 * usual_interval_s(samples)?)
}

/// Ranges of samples without a gap.
fn runs(samples: &[Sample]) -> Vec<Range<usize>> {
    let usual_s = usual_interval_s(samples).unwrap_or(f64::INFINITY);
    let mut runs: Vec<Range<usize>> = Vec::new();
    for k in 0..samples.len() {
        match runs.last_mut() {
            Some(run) if samples[k].time_s - samples[k - 1].time_s < GAP * usual_s => run.end = k + 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs
}

/// The windows of `length` samples of the run that end with, surround and begin with sample `k`, as far as they
/// exist.
fn windows(run: &Range<usize>, k: usize, length: usize) -> impl Iterator<Item = Range<usize>> + use<> {
    let run = run.clone();
    [length - 1, length / 2, 0].into_iter().filter_map(move |before| {
        let start = k.checked_sub(before)?;
        (start >= run.start && start + length <= run.end).then_some(start..start + length)
    })
}

fn best_fit(
    samples: &[Sample],
    k: usize,
    windows: impl Iterator<Item = Range<usize>>,
) -> Option<Derivatives> {
    windows
        .filter_map(|window| derivatives(&samples[window], samples[k].time_s))
        .min_by(|a, b| a.residual_stds.total_cmp(&b.residual_stds))
}

/// Between two impacts in close succession: the three samples with the least acceleration.
fn smoothest(samples: &[Sample], k: usize, run: &Range<usize>) -> Option<Derivatives> {
    windows(run, k, SHORT_WINDOW)
        .filter_map(|window| derivatives(&samples[window], samples[k].time_s))
        .min_by(|a, b| a.acceleration.length().total_cmp(&b.acceleration.length()))
}

/// Derivatives at an instant of the parabola through some samples.
fn derivatives(samples: &[Sample], time_s: f64) -> Option<Derivatives> {
    let span_s = samples.last()?.time_s - samples.first()?.time_s;
    let times: Vec<f64> = samples.iter().map(|s| (s.time_s - time_s) / span_s).collect();
    let fit =
        |value: &dyn Fn(&Sample) -> f64| parabola(&times, &samples.iter().map(value).collect::<Vec<_>>());
    let (x, squares_x) = fit(&|s| s.x_m)?;
    let (y, squares_y) = fit(&|s| s.y_m)?;
    let yaws: Option<Vec<f64>> = samples.iter().map(|s| s.yaw_rad).collect();
    let yaw_rate_rad_s = yaws.and_then(|yaws| parabola(&times, &yaws)).map(|(yaw, _)| yaw[1] / span_s);
    let std_m = samples.iter().map(|s| s.std_m).fold(0.0, f64::max);
    let degrees_of_freedom = (2 * samples.len()).saturating_sub(6).max(1) as f64;
    Some(Derivatives {
        velocity: Vec2::new(x[1], y[1]) / span_s,
        acceleration: Vec2::new(x[2], y[2]) * (2.0 / (span_s * span_s)),
        yaw_rate_rad_s,
        residual_stds: ((squares_x + squares_y) / degrees_of_freedom).sqrt() / std_m,
    })
}

/// Least squares fit of c0 + c1 t + c2 t2, and the sum of squared residuals.
fn parabola(times: &[f64], values: &[f64]) -> Option<(Vector3<f64>, f64)> {
    let middle = values.iter().sum::<f64>() / values.len() as f64;
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (&t, &v) in times.iter().zip(values) {
        let powers = Vector3::new(1.0, t, t * t);
        matrix += powers * powers.transpose();
        right += powers * (v - middle);
    }
    let mut fit = matrix.try_inverse()? * right;
    fit[0] += middle;
    let squares =
        times.iter().zip(values).map(|(&t, &v)| (v - fit[0] - t * (fit[1] + t * fit[2])).powi(2)).sum();
    Some((fit, squares))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    fn sample(time_s: f64, x_m: f64, y_m: f64) -> Sample {
        Sample::new(time_s, Point::new(x_m, y_m), Some(0.5 + 2.0 * time_s), 2e-5)
    }

    /// At rest, struck at 0.208 s, sliding to rest with 2.5 m/s2, at 60 frames a second.
    fn struck() -> Vec<Sample> {
        let position = |t: f64| {
            let t = (t - 0.208).clamp(0.0, 0.2);
            0.1 + 0.5 * t - 1.25 * t * t
        };
        (0..40).map(|k| f64::from(k) / 60.0).map(|t| sample(t, position(t), -position(t))).collect()
    }

    #[test]
    fn an_impact_stays_between_two_samples() {
        let mut samples = struck();
        fill(&mut samples);
        for s in &samples {
            let expected_m_s = if s.time_s < 0.208 { 0.0 } else { (0.5 - 2.5 * (s.time_s - 0.208)).max(0.0) };
            let error_m_s = (s.vx_m_s.expect("a velocity") - expected_m_s).abs();
            assert!(error_m_s < 0.011, "{} m/s at {} s, not {expected_m_s}", s.vx_m_s.unwrap(), s.time_s);
            assert!((s.yaw_rate_rad_s.expect("an angular velocity") - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_sliding_body_has_the_same_deceleration_in_every_sample() {
        let mut samples = struck();
        fill(&mut samples);
        for s in samples.iter().filter(|s| (0.22..0.39).contains(&s.time_s)) {
            assert!((s.ax_m_s2.expect("an acceleration") + 2.5).abs() < 1e-6, "{s:?}");
            assert!((s.ay_m_s2.expect("an acceleration") - 2.5).abs() < 1e-6, "{s:?}");
        }
    }

    #[test]
    fn a_strike_and_a_stop_in_few_frames_are_no_noise() {
        // 30 frames a second: five of them in motion, with 20 um of noise.
        let noisy = |(k, s): (usize, &Sample)| Sample {
            x_m: s.x_m + if k % 2 == 0 { 2e-5 } else { -2e-5 },
            y_m: s.y_m + if k % 4 < 2 { 2e-5 } else { -2e-5 },
            ..*s
        };
        let samples: Vec<Sample> = struck().iter().step_by(2).enumerate().map(noisy).collect();
        let residuals = residual_stds(&samples);
        let middle = |i: usize| upper_median(residuals.iter().map(|pair| pair[i])).expect("moving samples");
        assert!(middle(0) > 10.0 && middle(1) < 2.0, "{} and {}", middle(0), middle(1));
    }

    #[test]
    fn a_gap_is_not_bridged_and_single_samples_have_no_velocity() {
        let mut samples = struck();
        samples.drain(20..30);
        let single = samples.len() - 1;
        samples[single].time_s += 1.0;
        fill(&mut samples);
        assert_eq!(samples[single].vx_m_s, None);
        assert!(samples[19].vx_m_s.is_some() && samples[20].vx_m_s.is_some());
    }
}
