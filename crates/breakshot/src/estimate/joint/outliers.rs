//! Clips that contradict the others: named with the evidence, and left out.

use super::random_effects::Group;
use crate::estimate::clip::result::Measured;
use crate::estimate::measure::measurements::{Measurements, grouped};
use crate::estimate::measure::quantity::Quantity;
use crate::statistics::median;
use std::collections::{BTreeMap, BTreeSet};

/// A reading this many deviations away from the other clips' counts less and less, ...
const DOUBTED: f64 = 4.0;
/// ... until it contradicts them and does not count at all.
const CONTRADICTS: f64 = 6.0;
/// Between the two a reading's own deviation is never less than this part of the one with which it counts.
const LEAST_PART: f64 = 0.03;
/// Below this part of the value no reading is worth a word.
const WORTH_A_WORD: f64 = 0.05;
/// With fewer clips nobody can tell which one is wrong.
const CLIPS_NEEDED: usize = 3;
/// So many contradictions put the whole clip in doubt.
const HOPELESS: usize = 2;

/// What the clips say of one quantity, by majority.
struct Majority {
    value: f64,
    scale: f64,
    spread: f64,
}

/// The measurements without those that contradict the other clips', and a sentence about each clip concerned.
///
/// What lies nearly as far off has more noise than it had: else one reading that is a little farther off than another would
/// count for nothing, and the other one in full.
pub(crate) fn without_contradictions(
    clips: &[Measurements],
    names: &[String],
) -> (Vec<Measurements>, Vec<String>) {
    let majorities = majorities(clips);
    let mut kept = Vec::with_capacity(clips.len());
    let mut warnings = Vec::new();
    for (measurements, name) in clips.iter().zip(names) {
        let wrong: Vec<usize> = (0..measurements.quantities.len())
            .filter(|&k| contradicts(measurements, k, &majorities))
            .collect();
        if wrong.is_empty() {
            kept.push(doubted(measurements.clone(), &majorities));
            continue;
        }
        let evidence: Vec<String> = wrong.iter().map(|&k| told(measurements, k, &majorities)).collect();
        let all_out = wrong.len() >= HOPELESS;
        let hint = if all_out { hint(measurements, &majorities) } else { String::new() };
        let what = if all_out { "left out" } else { "left out in part" };
        warnings.push(format!("{name}: {what}: {}{hint}", evidence.join("; ")));
        kept.push(doubted(measurements.retained(|k| !all_out && !wrong.contains(&k)), &majorities));
    }
    (kept, warnings)
}

fn majorities(clips: &[Measurements]) -> BTreeMap<Quantity, Majority> {
    let groups: Vec<(Quantity, Group)> = grouped(clips)
        .into_iter()
        .filter(|(_, places)| places.len() >= CLIPS_NEEDED)
        .map(|(key, places)| (key.clone(), Group::of(clips, key, &places)))
        .collect();
    let middle = |group: &Group| median(group.values.iter().map(|m| m.value)).unwrap_or(0.0);
    let mut spreads = [0.0; crate::estimate::measure::quantity::KINDS];
    for (kind, spread) in spreads.iter_mut().enumerate() {
        let deviations = groups.iter().filter(|(key, _)| key.kind() == kind).flat_map(|(_, group)| {
            let centre = middle(group);
            // The median is drawn to its own values: few of them look closer together than they are.
            let n = group.values.len() as f64;
            let widened = (n / (n - 1.0)).sqrt() / group.scale;
            group.values.iter().map(move |m| (m.value - centre).abs() * widened)
        });
        // For a Gaussian the median distance is 0.6745 deviations.
        *spread = median(deviations).unwrap_or(0.0) / 0.6745;
    }
    groups
        .iter()
        .map(|(key, group)| {
            let majority = Majority {
                value: middle(group),
                scale: group.scale,
                spread: spreads[key.kind()] * group.scale,
            };
            (key.clone(), majority)
        })
        .collect()
}

/// The measurements, with as much more noise as they are far from the other clips'.
fn doubted(mut measurements: Measurements, majorities: &BTreeMap<Quantity, Majority>) -> Measurements {
    for k in 0..measurements.quantities.len() {
        let Some(majority) = majorities.get(&measurements.quantities[k]) else { continue };
        let measured = measurements.measured(k);
        let part = (CONTRADICTS - majority.deviations(measured)) / (CONTRADICTS - DOUBTED);
        if part < 1.0 {
            let variance = majority.variance(measured.std);
            measurements.covariance[(k, k)] += variance * (part.max(LEAST_PART).powi(-2) - 1.0);
        }
    }
    measurements
}

impl Majority {
    /// Of a clip's value with this noise about the majority's.
    fn variance(&self, std: f64) -> f64 {
        std.powi(2) + self.spread.powi(2)
    }

    /// How many standard deviations off a reading is; 0 where that is not worth a word.
    fn deviations(&self, measured: Measured) -> f64 {
        let off = (measured.value - self.value).abs();
        if off > WORTH_A_WORD * self.scale { off / self.variance(measured.std).sqrt() } else { 0.0 }
    }

    fn is_contradicted(&self, measured: Measured) -> bool {
        self.deviations(measured) > CONTRADICTS
    }
}

fn contradicts(measurements: &Measurements, k: usize, majorities: &BTreeMap<Quantity, Majority>) -> bool {
    majorities
        .get(&measurements.quantities[k])
        .is_some_and(|majority| majority.is_contradicted(measurements.measured(k)))
}

/// The evidence in words.
fn told(measurements: &Measurements, k: usize, majorities: &BTreeMap<Quantity, Majority>) -> String {
    let key = &measurements.quantities[k];
    let (mut here, mut there) = (measurements.values[k], majorities[key].value);
    if matches!(key, Quantity::MassRatio(..)) {
        (here, there) = (here.exp(), there.exp());
    }
    format!("{key} is {here:.3}, in the other clips {there:.3}")
}

/// What would explain all of a clip's contradictions at once.
fn hint(measurements: &Measurements, majorities: &BTreeMap<Quantity, Majority>) -> String {
    let objects: BTreeSet<&String> = (measurements.quantities.iter())
        .filter_map(|key| match key {
            Quantity::Friction(object) => Some(object),
            _ => None,
        })
        .collect();
    for one in &objects {
        for other in objects.iter().filter(|o| *o > one) {
            let explained = (0..measurements.quantities.len()).all(|k| {
                let (key, sign) = measurements.quantities[k].swapped(one, other);
                let Measured { value, std } = measurements.measured(k);
                let here = Measured { value: sign * value, std };
                majorities.get(&key).is_none_or(|majority| !majority.is_contradicted(here))
            });
            if explained {
                return format!(": as if `{one}` and `{other}` were swapped");
            }
        }
    }
    let ratios: Vec<f64> = (measurements.quantities.iter().enumerate())
        .filter(|(_, key)| matches!(key, Quantity::Friction(_)))
        .filter_map(|(k, key)| majorities.get(key).map(|m| measurements.values[k] / m.value))
        .collect();
    // Deceleration goes with the square of the frame rate.
    let close =
        |factor: f64| !ratios.is_empty() && ratios.iter().all(|r| (r / (factor * factor) - 1.0).abs() < 0.2);
    for (factor, words) in [(2.0, "half"), (0.5, "twice")] {
        if close(factor) {
            return format!(": as if it were filmed at {words} the frame rate that its file says");
        }
    }
    String::new()
}

#[cfg(test)]
mod tests {
    use super::super::random_effects::Spread;
    use super::*;
    use nalgebra::{DMatrix, DVector};

    const STD: f64 = 0.01;

    fn reading(pair: usize, value: f64) -> Measurements {
        Measurements {
            quantities: vec![Quantity::Restitution(format!("a{pair}"), format!("b{pair}"))],
            values: DVector::from_element(1, value),
            covariance: DMatrix::from_element(1, 1, STD * STD),
            vertical_fractions: vec![0.0],
            double_contact: vec![false],
        }
    }

    /// The mean over five clips of one pair, four of which agree, and whether the fifth is named.
    fn mean(fifth: f64) -> (f64, bool) {
        let scattered = |pair: usize| [-0.01, -0.005, 0.0, 0.005, 0.01].map(|off| reading(pair, 0.6 + off));
        let mut clips: Vec<Measurements> = (0..6).flat_map(scattered).collect();
        clips[4] = reading(0, fifth);
        let names: Vec<String> = (0..clips.len()).map(|k| k.to_string()).collect();
        let (kept, warnings) = without_contradictions(&clips, &names);
        let (key, places) = grouped(&kept).into_iter().next().expect("a pair");
        let spread = Spread { relative: 0.01, freedom: 12.0 };
        (Group::of(&kept, key, &places).mean(spread).expect("values").value, !warnings.is_empty())
    }

    #[test]
    fn a_reading_that_moves_away_from_the_others_lets_go_of_them_bit_by_bit() {
        let steps: Vec<(f64, bool)> = (0..=200).map(|k| mean(0.6 + 1e-3 * f64::from(k))).collect();
        for (k, pair) in steps.windows(2).enumerate() {
            let [(before, _), (after, _)] = [pair[0], pair[1]];
            assert!((after - before).abs() < 1e-3, "{before} to {after} at {k} thousandths");
        }
        let furthest = steps.iter().map(|step| step.0).fold(0.0, f64::max);
        let (last, named) = steps[200];
        println!("0.6 without it, {furthest:.4} at most, {last:.4} far off");
        assert!((0.602..0.62).contains(&furthest) && (last - 0.5975).abs() < 0.002 && named);
    }
}
