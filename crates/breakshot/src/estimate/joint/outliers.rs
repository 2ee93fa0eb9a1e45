//! Which measurements contradict those of the other clips, and what explains it?

use super::random_effects::{Group, least_std, repeats, with_prior};
use crate::estimate::clip::result::Measured;
use crate::estimate::measure::measurements::{Measurements, grouped};
use crate::estimate::measure::quantity::{KINDS, Quantity};
use crate::ordered_map::map_of;
use crate::statistics::median;
use crate::warning::{Cause, Warning};
use std::collections::{BTreeMap, BTreeSet};

/// From this many standard deviations off the median of all clips the weight of a measurement decreases ...
const DOWNWEIGHTED_STDS: f64 = 4.0;
/// ... and beyond this many the measurement is an outlier and is left out.
const OUTLIER_STDS: f64 = 6.0;
/// Lower bound of the factor by which downweighting divides the standard deviation of a measurement.
const MIN_FACTOR: f64 = 0.03;
/// A relative deviation below this is never an outlier.
const MIN_RELATIVE_DEVIATION: f64 = 0.05;
/// A restitution that is above one by more than this many standard deviations is impossible.
const IMPOSSIBLE_STDS: f64 = 3.0;
/// Number of clips from which the median shows which one is wrong.
const CLIPS_NEEDED: usize = 3;
/// From this number of outliers the whole clip is left out.
const MAX_OUTLIERS: usize = 2;
/// Median absolute deviation of a standard normal variable.
const NORMAL_MEDIAN_DEVIATION: f64 = 0.6745;

/// The robust consensus of all clips on one quantity.
struct Consensus {
    median: f64,
    /// The value to which relative deviations refer.
    scale: f64,
    /// Standard deviation from clip to clip.
    std: f64,
}

/// The measurements without outliers, and a warning about each clip concerned.
///
/// Between the two thresholds the variance of a measurement increases gradually with its deviation, as in a redescending
/// M-estimator: otherwise a small change of a measurement near the threshold would change the result by a step.
pub(crate) fn without_outliers(
    clips: &[Measurements],
    names: &[String],
) -> (Vec<Measurements>, Vec<Warning>) {
    let (clips, mut warnings) = without_impossible_impacts(clips, names);
    let consensus = consensus(&clips);
    let mut kept = Vec::with_capacity(clips.len());
    for (measurements, name) in clips.iter().zip(names) {
        let outliers: Vec<usize> =
            (0..measurements.quantities.len()).filter(|&k| is_outlier(measurements, k, &consensus)).collect();
        if outliers.is_empty() {
            kept.push(downweighted(measurements.clone(), &consensus));
            continue;
        }
        let evidence: Vec<String> =
            outliers.iter().map(|&k| comparison(measurements, k, &consensus)).collect();
        let all_out = outliers.len() >= MAX_OUTLIERS;
        let cause = if all_out { likely_cause(measurements, &consensus) } else { String::new() };
        let what = if all_out { "left out" } else { "left out in part" };
        let text = format!("{what}: {}{cause}", evidence.join("; "));
        warnings.push(Warning::of_clip(Cause::Contradiction, name, text));
        let mut remaining = measurements.retained(|k| !all_out && !outliers.contains(&k));
        remaining.covariance *= misfit_variance(measurements, &outliers, &consensus);
        kept.push(downweighted(remaining, &consensus));
    }
    (kept, warnings)
}

/// The measurements without the impacts of the clips that measure an impossible restitution of what other clips measure a possible one of: the motion around
/// that impact is fitted wrongly, and with it the velocities in the clip's other impacts.  A warning about each such clip.
fn without_impossible_impacts(clips: &[Measurements], names: &[String]) -> (Vec<Measurements>, Vec<Warning>) {
    let mut kept = clips.to_vec();
    let mut warnings = Vec::new();
    for (clip, (measurements, name)) in clips.iter().zip(names).enumerate() {
        let elsewhere = |quantity: &Quantity| {
            let others = clips.iter().enumerate().filter(|(other, _)| *other != clip);
            let mut values = others.flat_map(|(_, m)| m.quantities.iter().zip(m.values.iter().copied()));
            values.find(|(q, value)| *q == quantity && *value <= 1.0).map(|(_, value)| value)
        };
        let impossible = (0..measurements.quantities.len()).find_map(|k| {
            let Measured { value, std } = measurements.measured(k);
            let is_above_one = value - IMPOSSIBLE_STDS * std > 1.0;
            let quantity = &measurements.quantities[k];
            let is_restitution =
                matches!(quantity, Quantity::Restitution(..) | Quantity::StrikerRestitution(_));
            let other = elsewhere(quantity).filter(|_| is_restitution && is_above_one)?;
            Some(format!(
                "left out in part: {quantity} is {value:.3}, which is impossible, in another clip {other:.3}: its impacts measure nothing"
            ))
        });
        if let Some(text) = impossible {
            warnings.push(Warning::of_clip(Cause::Contradiction, name, text));
            kept[clip] =
                measurements.retained(|k| matches!(measurements.quantities[k], Quantity::Friction(_)));
        }
    }
    (kept, warnings)
}

/// The consensus on every quantity that enough clips measure.
fn consensus(clips: &[Measurements]) -> BTreeMap<Quantity, Consensus> {
    let groups: Vec<(Quantity, Group)> = grouped(clips)
        .into_iter()
        .filter(|(_, indices)| indices.len() >= CLIPS_NEEDED)
        .map(|(quantity, indices)| (quantity.clone(), Group::new(clips, quantity, &indices)))
        .collect();
    let mut relative_stds = [0.0; KINDS];
    for (kind, std) in relative_stds.iter_mut().enumerate() {
        let of_kind: Vec<&Group> =
            groups.iter().filter(|(q, _)| q.kind() == kind).map(|(_, group)| group).collect();
        *std = with_prior(robust_between_clip_std(&of_kind), repeats(of_kind.iter().copied()));
    }
    map_of(groups.iter().map(|(quantity, group)| {
        let consensus = Consensus {
            median: middle(group),
            scale: group.scale,
            std: relative_stds[quantity.kind()] * group.scale,
        };
        (quantity.clone(), consensus)
    }))
}

fn middle(group: &Group) -> f64 {
    median(group.values.iter().map(|m| m.value)).unwrap_or(0.0)
}

/// The relative standard deviation from clip to clip with which the deviations from the medians, in standard deviations of noise and variation, have
/// the median of a normal distribution: outliers hardly change it.
fn robust_between_clip_std(groups: &[&Group]) -> f64 {
    let median_stds = |relative: f64| {
        let of_group = |group: &&Group| {
            let (centre, between) = (middle(group), relative * group.scale);
            // Deviations from the median of a small sample are too small on average.
            let n = group.values.len() as f64;
            let widened = (n / (n - 1.0)).sqrt();
            let stds = |m: &Measured| {
                (m.value - centre).abs() * widened / m.std.hypot(between).max(f64::MIN_POSITIVE)
            };
            group.values.iter().map(stds).collect::<Vec<_>>()
        };
        median(groups.iter().flat_map(of_group)).unwrap_or(0.0)
    };
    least_std(|relative| median_stds(relative) > NORMAL_MEDIAN_DEVIATION)
}

/// The measurements with larger variances where they deviate much from the consensus.
fn downweighted(mut measurements: Measurements, consensus: &BTreeMap<Quantity, Consensus>) -> Measurements {
    for k in 0..measurements.quantities.len() {
        let Some(consensus) = consensus.get(&measurements.quantities[k]) else { continue };
        let measured = measurements.measured(k);
        let factor = (OUTLIER_STDS - consensus.deviation_stds(measured)) / (OUTLIER_STDS - DOWNWEIGHTED_STDS);
        if factor < 1.0 {
            let variance = consensus.variance(measured.std);
            measurements.covariance[(k, k)] += variance * (factor.max(MIN_FACTOR).powi(-2) - 1.0);
        }
    }
    measurements
}

impl Consensus {
    /// Variance of the deviation of a clip's value with this noise.
    fn variance(&self, std: f64) -> f64 {
        std.powi(2) + self.std.powi(2)
    }

    /// The deviation of a measurement in standard deviations; 0 for small relative deviations.
    fn deviation_stds(&self, measured: Measured) -> f64 {
        let deviation = (measured.value - self.median).abs();
        if deviation > MIN_RELATIVE_DEVIATION * self.scale {
            deviation / self.variance(measured.std).sqrt()
        } else {
            0.0
        }
    }

    fn is_outlier(&self, measured: Measured) -> bool {
        self.deviation_stds(measured) > OUTLIER_STDS
    }
}

/// The factor by which the variances of a clip's other values increase: an outlying friction shows that the motion was fitted wrongly as a whole,
/// with errors as many times larger than stated.
fn misfit_variance(
    measurements: &Measurements,
    outliers: &[usize],
    consensus: &BTreeMap<Quantity, Consensus>,
) -> f64 {
    let frictions = outliers.iter().map(|&k| (&measurements.quantities[k], measurements.measured(k)));
    let deviations_stds = frictions
        .filter(|(quantity, _)| matches!(quantity, Quantity::Friction(_)))
        .filter_map(|(quantity, measured)| Some(consensus.get(quantity)?.deviation_stds(measured)));
    deviations_stds.fold(1.0, f64::max).powi(2)
}

/// Whether measurement `k` of a clip is an outlier.
fn is_outlier(measurements: &Measurements, k: usize, consensus: &BTreeMap<Quantity, Consensus>) -> bool {
    consensus.get(&measurements.quantities[k]).is_some_and(|c| c.is_outlier(measurements.measured(k)))
}

/// The measurement `k` beside the consensus, for a warning.
fn comparison(measurements: &Measurements, k: usize, consensus: &BTreeMap<Quantity, Consensus>) -> String {
    let quantity = &measurements.quantities[k];
    let (mut value, mut others) = (measurements.values[k], consensus[quantity].median);
    if matches!(quantity, Quantity::MassRatio(..)) {
        (value, others) = (value.exp(), others.exp());
    }
    format!("{quantity} is {value:.3}, in the other clips {others:.3}")
}

/// A mistake that explains all outliers of a clip: two exchanged names or a wrong frame rate; empty if neither does.
fn likely_cause(measurements: &Measurements, consensus: &BTreeMap<Quantity, Consensus>) -> String {
    // Two exchanged names
    let objects: BTreeSet<&String> = (measurements.quantities.iter())
        .filter_map(|quantity| match quantity {
            Quantity::Friction(object) => Some(object),
            _ => None,
        })
        .collect();
    for one in &objects {
        for other in objects.iter().filter(|o| *o > one) {
            let explained = (0..measurements.quantities.len()).all(|k| {
                let (quantity, sign) = measurements.quantities[k].swapped(one, other);
                let Measured { value, std } = measurements.measured(k);
                let swapped = Measured { value: sign * value, std };
                consensus.get(&quantity).is_none_or(|consensus| !consensus.is_outlier(swapped))
            });
            if explained {
                return format!(": as if `{one}` and `{other}` were swapped");
            }
        }
    }

    // A wrong frame rate: deceleration is proportional to its square
    let ratios: Vec<f64> = (measurements.quantities.iter().enumerate())
        .filter(|(_, quantity)| matches!(quantity, Quantity::Friction(_)))
        .filter_map(|(k, quantity)| consensus.get(quantity).map(|c| measurements.values[k] / c.median))
        .collect();
    let close =
        |factor: f64| !ratios.is_empty() && ratios.iter().all(|r| (r / (factor * factor) - 1.0).abs() < 0.2);
    for (factor, words) in
        [(2.0, "half"), (0.5, "twice"), (4.0, "a quarter of"), (0.25, "four times"), (0.125, "eight times")]
    {
        if close(factor) {
            return format!(": as if it were filmed at {words} the frame rate that its file says");
        }
    }
    String::new()
}

#[cfg(test)]
mod tests {
    use super::super::random_effects::BetweenClipStd;
    use super::*;
    use nalgebra::{DMatrix, DVector};

    const STD: f64 = 0.01;

    fn measurement(pair: usize, value: f64) -> Measurements {
        Measurements {
            quantities: vec![Quantity::Restitution(format!("a{pair}"), format!("b{pair}"))],
            values: DVector::from_element(1, value),
            covariance: DMatrix::from_element(1, 1, STD * STD),
            vertical_fractions: vec![0.0],
            double_contact: vec![false],
            by_slope: Vec::new(),
        }
    }

    /// The measurements without outliers and the warnings, for clips that are named by their numbers.
    fn kept(clips: &[Measurements]) -> (Vec<Measurements>, Vec<Warning>) {
        let names: Vec<String> = (0..clips.len()).map(|k| k.to_string()).collect();
        without_outliers(clips, &names)
    }

    /// The mean over five clips of one pair, four of which agree, and whether there is a warning about the fifth.
    fn mean(fifth: f64) -> (f64, bool) {
        let scattered =
            |pair: usize| [-0.01, -0.005, 0.0, 0.005, 0.01].map(|off| measurement(pair, 0.6 + off));
        let mut clips: Vec<Measurements> = (0..6).flat_map(scattered).collect();
        clips[4] = measurement(0, fifth);
        let (kept, warnings) = kept(&clips);
        let (quantity, indices) = grouped(&kept).into_iter().next().expect("a pair");
        let between = BetweenClipStd { relative: 0.01, degrees_of_freedom: 12.0 };
        (Group::new(&kept, quantity, &indices).mean(between).expect("values").value, !warnings.is_empty())
    }

    #[test]
    fn the_influence_of_a_deviating_measurement_decreases_gradually() {
        let steps: Vec<(f64, bool)> = (0..=200).map(|k| mean(0.6 + 1e-3 * f64::from(k))).collect();
        for (k, pair) in steps.windows(2).enumerate() {
            let [(before, _), (after, _)] = [pair[0], pair[1]];
            assert!((after - before).abs() < 1e-3, "{before} to {after} at {k} thousandths");
        }
        let furthest = steps.iter().map(|step| step.0).fold(0.0, f64::max);
        let (last, warned) = steps[200];
        println!("0.6 without it, {furthest:.4} at most, {last:.4} far off");
        assert!((0.602..0.62).contains(&furthest) && (last - 0.5975).abs() < 0.002 && warned);
    }

    /// Frictions of one object, each clip with that of another object of its own, all known to 1 %.
    fn frictions(of_a: &[f64]) -> Vec<Measurements> {
        let clip = |(k, value): (usize, &f64)| Measurements {
            quantities: vec![Quantity::Friction("a".into()), Quantity::Friction(format!("b{k}"))],
            values: DVector::from_vec(vec![*value, 0.3]),
            covariance: DMatrix::from_diagonal_element(2, 2, (0.003f64).powi(2)),
            vertical_fractions: vec![0.0; 2],
            double_contact: vec![false; 2],
            by_slope: Vec::new(),
        };
        of_a.iter().enumerate().map(clip).collect()
    }

    /// The noise of three clips, and not the variation from clip to clip, explains how far they are apart.
    #[test]
    fn a_friction_that_contradicts_precise_ones_is_an_outlier_beside_noisy_ones() {
        let values =
            [(0.412, 0.171), (0.508, 0.017), (0.497, 0.045), (0.58, 0.051), (0.012, 0.067), (0.503, 0.02)];
        let clip = |(value, std): (f64, f64)| Measurements {
            quantities: vec![Quantity::Friction("a".into())],
            values: DVector::from_element(1, value),
            covariance: DMatrix::from_element(1, 1, std * std),
            vertical_fractions: vec![0.0],
            double_contact: vec![false],
            by_slope: Vec::new(),
        };
        let (kept, warnings) = kept(&values.map(clip));
        let left: Vec<usize> = kept.iter().map(|m| m.quantities.len()).collect();
        assert_eq!((left, warnings.len()), (vec![1, 1, 1, 1, 0, 1], 1));
    }

    #[test]
    fn an_outlying_friction_widens_the_other_values_of_its_clip() {
        let clips = frictions(&[0.299, 0.301, 0.3, 0.302, 0.298, 0.6]);
        let (kept, warnings) = kept(&clips);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert_eq!(kept[5].quantities, [Quantity::Friction("b5".into())]);
        let widened = (kept[5].covariance[(0, 0)] / clips[5].covariance[(1, 1)]).sqrt();
        println!("widened {widened:.1} times");
        assert!(widened > OUTLIER_STDS, "widened {widened} times");
        assert_eq!(kept[0].covariance, clips[0].covariance);
    }

    #[test]
    fn the_impacts_of_a_clip_with_an_impossible_restitution_are_left_out_where_another_clip_measures_it() {
        let striker = |value: f64, std: f64| {
            let (quantity, mass) = (Quantity::StrikerRestitution("a".into()), ("a".into(), "b".into()));
            Measurements {
                quantities: vec![
                    Quantity::Friction("b".into()),
                    Quantity::MassRatio(mass.0, mass.1),
                    quantity,
                ],
                values: DVector::from_vec(vec![0.3, 2.3, value]),
                covariance: DMatrix::from_diagonal(&DVector::from_vec(vec![1e-6, 1.0, std * std])),
                vertical_fractions: vec![0.0; 3],
                double_contact: vec![false; 3],
                by_slope: Vec::new(),
            }
        };
        // A second strike that no trusted position shows
        let (kept, warnings) = kept(&[striker(2.47, 0.38), striker(0.81, 0.01), striker(1.02, 0.01)]);
        assert_eq!(kept[0].quantities, [Quantity::Friction("b".into())]);
        let text = warnings[0].to_string();
        assert!(warnings.len() == 1 && text.contains("2.470, which is impossible"), "{warnings:?}");
        assert!(kept[1..].iter().all(|clip| clip.quantities.len() == 3), "{kept:?}");
        // The mean itself is refused where all clips agree on it.
        let (kept, warnings) = super::tests::kept(&[striker(1.4, 0.01), striker(1.5, 0.01)]);
        assert!(warnings.is_empty() && kept.iter().all(|clip| clip.quantities.len() == 3), "{warnings:?}");
    }

    #[test]
    fn three_clips_that_agree_by_chance_do_not_outvote_two() {
        // Friction varies by some per cent from clip to clip.
        let clips = frictions(&[0.385, 0.3619, 0.3626, 0.3625, 0.404]);
        let (kept, warnings) = kept(&clips);
        assert!(warnings.is_empty(), "{warnings:?}");
        assert!(kept.iter().all(|clip| clip.quantities.len() == 2));
    }
}
