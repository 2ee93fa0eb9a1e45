//! How fast did each object move?  (Fig. 6 of the paper; for display: estimation fits the positions themselves.)
//!
//! A parabola through a few neighbours gives velocity and acceleration.  Of the neighbours before, around and after a
//! sample those count that lie on one parabola: so an impact stays between two samples and is not smeared over many.

use super::tracks::Sample;
use crate::geometry::Vec2;
use crate::statistics::upper_median;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Neighbours in a parabola: enough to average noise, few enough for short slides.
const NEIGHBOURS: usize = 5;
/// Samples further apart than this many usual intervals are not neighbours.
const GAP: f64 = 2.5;
/// A parabola that misses by more than this many standard deviations crosses an impact.
const MISSED_STDS: f64 = 4.0;

/// Fills velocity, yaw rate and acceleration of a track.
pub(super) fn fill(samples: &mut [Sample]) {
    let runs = runs(samples);
    for k in 0..samples.len() {
        let Some(run) = runs.iter().find(|run| run.contains(&k)) else { continue };
        let windows = windows(run, k, NEIGHBOURS);
        let best = best(samples, k, windows).filter(|best| best.missed_stds < MISSED_STDS);
        let Some(motion) = best.or_else(|| smoothest(samples, k, run)) else { continue };
        let sample = &mut samples[k];
        (sample.vx_m_s, sample.vy_m_s) = (Some(motion.velocity.x), Some(motion.velocity.y));
        (sample.ax_m_s2, sample.ay_m_s2) = (Some(motion.acceleration.x), Some(motion.acceleration.y));
        sample.yaw_rate_rad_s = motion.yaw_rate_rad_s;
    }
}

/// How far the samples of a moving object lie from smooth motion, in their own standard deviations: one number for
/// each sample, about 1 where those are right.
pub(super) fn unsteadiness(samples: &[Sample]) -> Vec<f64> {
    let runs = runs(samples);
    let moving = |window: &Range<usize>| {
        let (first, last) = (&samples[window.start], &samples[window.end - 1]);
        first.position().distance(last.position()) > MOVING_STDS * first.std_m
    };
    let of_sample = |k: usize| {
        let run = runs.iter().find(|run| run.contains(&k))?;
        Some(best(samples, k, windows(run, k, NEIGHBOURS).filter(moving))?.missed_stds / BEST_OF_THREE)
    };
    (0..samples.len()).filter_map(of_sample).collect()
}

/// An object that came this many standard deviations far within a window was in motion.
const MOVING_STDS: f64 = 30.0;
/// The best of three overlapping windows fits better than a chosen one, by chance alone, by this factor.
const BEST_OF_THREE: f64 = 0.7;

struct Motion {
    velocity: Vec2,
    acceleration: Vec2,
    yaw_rate_rad_s: Option<f64>,
    missed_stds: f64,
}

/// Stretches without a gap.
fn runs(samples: &[Sample]) -> Vec<Range<usize>> {
    let intervals_s = samples.windows(2).map(|s| s[1].time_s - s[0].time_s);
    let usual_s = upper_median(intervals_s).unwrap_or(f64::INFINITY);
    let mut runs: Vec<Range<usize>> = Vec::new();
    for k in 0..samples.len() {
        match runs.last_mut() {
            Some(run) if samples[k].time_s - samples[k - 1].time_s < GAP * usual_s => run.end = k + 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs
}

/// `length` samples of the run ending with, around and beginning with the `k`th, as far as there are.
fn windows(run: &Range<usize>, k: usize, length: usize) -> impl Iterator<Item = Range<usize>> + use<> {
    let run = run.clone();
    [length - 1, length / 2, 0].into_iter().filter_map(move |before| {
        let start = k.checked_sub(before)?;
        (start >= run.start && start + length <= run.end).then_some(start..start + length)
    })
}

fn best(samples: &[Sample], k: usize, windows: impl Iterator<Item = Range<usize>>) -> Option<Motion> {
    windows
        .filter_map(|window| motion(&samples[window], samples[k].time_s))
        .min_by(|a, b| a.missed_stds.total_cmp(&b.missed_stds))
}

/// Between two impacts that are close together: the three samples with the least acceleration.
fn smoothest(samples: &[Sample], k: usize, run: &Range<usize>) -> Option<Motion> {
    windows(run, k, 3)
        .filter_map(|window| motion(&samples[window], samples[k].time_s))
        .min_by(|a, b| a.acceleration.length().total_cmp(&b.acceleration.length()))
}

/// The motion at an instant on the parabola through some samples.
fn motion(samples: &[Sample], time_s: f64) -> Option<Motion> {
    let span_s = samples.last()?.time_s - samples.first()?.time_s;
    let times: Vec<f64> = samples.iter().map(|s| (s.time_s - time_s) / span_s).collect();
    let fit =
        |value: &dyn Fn(&Sample) -> f64| parabola(&times, &samples.iter().map(value).collect::<Vec<_>>());
    let (x, off_x) = fit(&|s| s.x_m)?;
    let (y, off_y) = fit(&|s| s.y_m)?;
    let yaws: Option<Vec<f64>> = samples.iter().map(|s| s.yaw_rad).collect();
    let yaw_rate_rad_s = yaws.and_then(|yaws| parabola(&times, &yaws)).map(|(yaw, _)| yaw[1] / span_s);
    let std_m = samples.iter().map(|s| s.std_m).fold(0.0, f64::max);
    let spare = (2 * samples.len()).saturating_sub(6).max(1) as f64;
    Some(Motion {
        velocity: Vec2::new(x[1], y[1]) / span_s,
        acceleration: Vec2::new(x[2], y[2]) * (2.0 / (span_s * span_s)),
        yaw_rate_rad_s,
        missed_stds: ((off_x + off_y) / spare).sqrt() / std_m,
    })
}

/// Least squares c0 + c1 t + c2 t2, and the sum of squares left.
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
    let left =
        times.iter().zip(values).map(|(&t, &v)| (v - fit[0] - t * (fit[1] + t * fit[2])).powi(2)).sum();
    Some((fit, left))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(time_s: f64, x_m: f64, y_m: f64) -> Sample {
        Sample {
            time_s,
            x_m,
            y_m,
            yaw_rad: Some(0.5 + 2.0 * time_s),
            vx_m_s: None,
            vy_m_s: None,
            yaw_rate_rad_s: None,
            ax_m_s2: None,
            ay_m_s2: None,
            std_m: 2e-5,
            doubtful: false,
        }
    }

    /// At rest, struck at 0.208 s, sliding to rest with 2.5 m/s2, at 60 frames a second.
    fn struck() -> Vec<Sample> {
        let place = |t: f64| {
            let t = (t - 0.208).clamp(0.0, 0.2);
            0.1 + 0.5 * t - 1.25 * t * t
        };
        (0..40).map(|k| f64::from(k) / 60.0).map(|t| sample(t, place(t), -place(t))).collect()
    }

    #[test]
    fn an_impact_stays_between_two_samples() {
        let mut samples = struck();
        fill(&mut samples);
        for s in &samples {
            let due_m_s = if s.time_s < 0.208 { 0.0 } else { (0.5 - 2.5 * (s.time_s - 0.208)).max(0.0) };
            let off_m_s = (s.vx_m_s.expect("a speed") - due_m_s).abs();
            assert!(off_m_s < 0.011, "{} m/s at {} s, not {due_m_s}", s.vx_m_s.unwrap(), s.time_s);
            assert!((s.yaw_rate_rad_s.expect("a rate") - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_sliding_body_decelerates_by_the_same_amount_all_the_way() {
        let mut samples = struck();
        fill(&mut samples);
        for s in samples.iter().filter(|s| (0.22..0.39).contains(&s.time_s)) {
            assert!((s.ax_m_s2.expect("an acceleration") + 2.5).abs() < 1e-6, "{s:?}");
            assert!((s.ay_m_s2.expect("an acceleration") - 2.5).abs() < 1e-6, "{s:?}");
        }
    }

    #[test]
    fn a_gap_is_not_bridged_and_lone_samples_have_no_speed() {
        let mut samples = struck();
        samples.drain(20..30);
        let lone = samples.len() - 1;
        samples[lone].time_s += 1.0;
        fill(&mut samples);
        assert_eq!(samples[lone].vx_m_s, None);
        assert!(samples[19].vx_m_s.is_some() && samples[20].vx_m_s.is_some());
    }
}
