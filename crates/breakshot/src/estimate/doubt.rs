//! Clips that contradict the others: named with the evidence, and left out.

use super::reading::{Key, Readings, grouped};
use super::segment::median;
use super::spread::Group;
use std::collections::{BTreeMap, BTreeSet};

/// A reading this many deviations away from the other clips' contradicts them.
const CONTRADICTS: f64 = 6.0;
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

/// The readings without those that contradict the other clips', and a sentence about each clip concerned.
pub(super) fn without_contradictions(clips: &[Readings], names: &[String]) -> (Vec<Readings>, Vec<String>) {
    let majorities = majorities(clips);
    let mut kept = Vec::with_capacity(clips.len());
    let mut warnings = Vec::new();
    for (readings, name) in clips.iter().zip(names) {
        let wrong: Vec<usize> =
            (0..readings.keys.len()).filter(|&k| contradicts(readings, k, &majorities)).collect();
        if wrong.is_empty() {
            kept.push(readings.clone());
            continue;
        }
        let evidence: Vec<String> = wrong.iter().map(|&k| told(readings, k, &majorities)).collect();
        let all_out = wrong.len() >= HOPELESS;
        let hint = if all_out { hint(readings, &majorities) } else { String::new() };
        let what = if all_out { "left out" } else { "left out in part" };
        warnings.push(format!("{name}: {what}: {}{hint}", evidence.join("; ")));
        kept.push(readings.retained(|k| !all_out && !wrong.contains(&k)));
    }
    (kept, warnings)
}

fn majorities(clips: &[Readings]) -> BTreeMap<Key, Majority> {
    let groups: Vec<(Key, Group)> = grouped(clips)
        .into_iter()
        .filter(|(_, places)| places.len() >= CLIPS_NEEDED)
        .map(|(key, places)| (key.clone(), Group::of(clips, key, &places)))
        .collect();
    let middle = |group: &Group| median(group.values.iter().map(|m| m.value));
    let mut spreads = [0.0; super::reading::KINDS];
    for (kind, spread) in spreads.iter_mut().enumerate() {
        let deviations = groups.iter().filter(|(key, _)| key.kind() == kind).flat_map(|(_, group)| {
            let centre = middle(group);
            // The median is drawn to its own values: few of them look closer together than they are.
            let n = group.values.len() as f64;
            let widened = (n / (n - 1.0)).sqrt() / group.scale;
            group.values.iter().map(move |m| (m.value - centre).abs() * widened)
        });
        // For a Gaussian the median distance is 0.6745 deviations.
        *spread = median(deviations) / 0.6745;
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

fn is_off(value: f64, std: f64, majority: &Majority) -> bool {
    let off = (value - majority.value).abs();
    off > CONTRADICTS * std.hypot(majority.spread) && off > WORTH_A_WORD * majority.scale
}

fn contradicts(readings: &Readings, k: usize, majorities: &BTreeMap<Key, Majority>) -> bool {
    let measured = readings.measured(k);
    majorities.get(&readings.keys[k]).is_some_and(|majority| is_off(measured.value, measured.std, majority))
}

/// The evidence in words.
fn told(readings: &Readings, k: usize, majorities: &BTreeMap<Key, Majority>) -> String {
    let key = &readings.keys[k];
    let (mut here, mut there) = (readings.values[k], majorities[key].value);
    if matches!(key, Key::MassRatio(..)) {
        (here, there) = (here.exp(), there.exp());
    }
    format!("{key} is {here:.3}, in the other clips {there:.3}")
}

/// What would explain all of a clip's contradictions at once.
fn hint(readings: &Readings, majorities: &BTreeMap<Key, Majority>) -> String {
    let objects: BTreeSet<&String> = (readings.keys.iter())
        .filter_map(|key| match key {
            Key::Friction(object) => Some(object),
            _ => None,
        })
        .collect();
    for one in &objects {
        for other in objects.iter().filter(|o| *o > one) {
            let explained = (0..readings.keys.len()).all(|k| {
                let (key, sign) = readings.keys[k].swapped(one, other);
                let measured = readings.measured(k);
                majorities.get(&key).is_none_or(|m| !is_off(sign * measured.value, measured.std, m))
            });
            if explained {
                return format!(": as if `{one}` and `{other}` were swapped");
            }
        }
    }
    let ratios: Vec<f64> = (readings.keys.iter().enumerate())
        .filter(|(_, key)| matches!(key, Key::Friction(_)))
        .filter_map(|(k, key)| majorities.get(key).map(|m| readings.values[k] / m.value))
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
