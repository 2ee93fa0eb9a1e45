//! Few clips: random halves and thirds of the lab's campaign, estimated from the films' saved tracks.

use super::altered::learned;
use super::properties::{ByKind, Pair};
use super::saved::Saved;
use crate::validate::row::{self, Row, mean_and_worst};
use crate::validate::truth::Truth;
use breakshot::estimate::ClipTracks;
use breakshot::properties::Properties;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;

/// Default number of subsets.
pub(crate) const COUNT: u64 = 500;
/// From this many clips on quantities are counted together.
const MANY_CLIPS: usize = 6;
/// Most clips of one case.
const MOST_CLIPS: usize = 3;
/// Two-sided 95 % quantile of the normal distribution.
const Z_95: f64 = 1.96;
/// Error of mass ratios (relative) that is the same in all clips, by which means are corrected: the table's friction takes
/// a part of each impulse.
const MASS_CORRECTION: f64 = 0.02;
/// The ends of an interval differ by at most this factor, unless it is a narrow one near zero.
const WIDEST_FACTOR: f64 = 2.0;
const NARROW: f64 = 0.2;

/// What was found in all subsets about one kind of quantity, by the number of clips that measure it.
#[derive(Default)]
struct Found {
    estimates: usize,
    covered: usize,
    errors_percent: BTreeMap<usize, Vec<f64>>,
    outside_readings: Vec<String>,
    too_wide: Vec<String>,
}

/// Measures this many random subsets; whether every target holds.
pub(crate) fn validate(saved: &Saved, truth: &Truth, count: u64) -> Result<bool, String> {
    let mut kinds: BTreeMap<&str, Found> = BTreeMap::new();
    for seed in 0..count {
        let clips = subset(&saved.clips, seed);
        let properties = learned(saved, &clips)?.properties;
        let readings = readings(&properties);
        for (what, group, values) in ByKind::new(truth, &properties).named() {
            let found = kinds.entry(what).or_default();
            for pair in values {
                found.add(pair, seed, readings.get(&format!("{group}/{}", pair.name)));
            }
        }
    }
    let mut all_hold = true;
    for (what, found) in &kinds {
        all_hold &= row::print_all(&format!("{count} random halves and thirds: {what}"), &found.rows());
    }
    let sum = |of: fn(&Found) -> usize| kinds.values().map(of).sum::<usize>();
    let (estimates, covered) = (sum(|f| f.estimates), sum(|f| f.covered));
    let percent = 100.0 * covered as f64 / estimates.max(1) as f64;
    let rows = [
        Row::at_least(format!("95 % intervals that hold, of {estimates}"), percent, 90.0, "%"),
        Row::at_most("the same", percent, 99.0, "%"),
    ];
    Ok(all_hold & row::print_all("All quantities", &rows))
}

/// One to three clips of every case.
fn subset(clips: &[ClipTracks], seed: u64) -> Vec<ClipTracks> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut cases: BTreeMap<&[String], Vec<usize>> = BTreeMap::new();
    for (k, clip) in clips.iter().enumerate() {
        cases.entry(&clip.objects).or_default().push(k);
    }
    let mut chosen: Vec<usize> = Vec::new();
    for mut of_case in cases.into_values() {
        of_case.shuffle(&mut random);
        of_case.truncate(random.random_range(1..=MOST_CLIPS));
        chosen.extend(of_case);
    }
    chosen.sort_unstable();
    chosen.into_iter().map(|k| clips[k].clone()).collect()
}

/// The ends of the 95 % interval of every value that a single clip gives, by the name of its quantity in the evidence.
fn readings(properties: &Properties) -> BTreeMap<String, Vec<[f64; 2]>> {
    let mut readings: BTreeMap<String, Vec<[f64; 2]>> = BTreeMap::new();
    for record in properties.evidence.iter().flat_map(|e| &e.clips) {
        let of_clip = &record.measurements["readings"];
        let names = of_clip["keys"].as_array().into_iter().flatten();
        let values = of_clip["values"].as_array().into_iter().flatten();
        for (k, (name, value)) in names.zip(values).enumerate() {
            if let (Some(name), Some(value), Some(variance)) =
                (name.as_str(), value.as_f64(), of_clip["covariance"][k][k].as_f64())
            {
                let ends = [-1.0, 1.0].map(|sign| value + sign * Z_95 * variance.sqrt());
                let (name, ends) = match name.strip_prefix("log_") {
                    Some(ratio) => {
                        (ratio, [ends[0] - MASS_CORRECTION, ends[1] + MASS_CORRECTION].map(f64::exp))
                    }
                    None => (name, ends),
                };
                readings.entry(name.to_owned()).or_default().push(ends);
            }
        }
    }
    readings
}

impl Found {
    fn add(&mut self, pair: &Pair, seed: u64, readings: Option<&Vec<[f64; 2]>>) {
        let [low, high] = pair.estimate.interval_95;
        let shown =
            || format!("subset {seed}: {} {:.4} [{low:.4}, {high:.4}]", pair.name, pair.estimate.mean);
        self.estimates += 1;
        self.covered += usize::from(pair.covered());
        self.errors_percent.entry(pair.estimate.n.min(MANY_CLIPS)).or_default().push(pair.error_percent());
        if high > WIDEST_FACTOR * low && high - low > NARROW {
            self.too_wide.push(shown());
        }
        if let Some(readings) = readings {
            let least = readings.iter().map(|r| r[0]).fold(f64::INFINITY, f64::min);
            let most = readings.iter().map(|r| r[1]).fold(f64::NEG_INFINITY, f64::max);
            if !(least..=most).contains(&pair.estimate.mean) {
                self.outside_readings.push(format!("{} readings {readings:.4?}", shown()));
            }
        }
    }

    fn rows(&self) -> Vec<Row> {
        let covered = 100.0 * self.covered as f64 / self.estimates.max(1) as f64;
        for example in self.outside_readings.iter().take(4).chain(self.too_wide.iter().take(4)) {
            println!("{example}");
        }
        let mut rows = vec![
            Row::plain(format!("95 % intervals that hold, of {}", self.estimates), covered, "%"),
            Row::at_most(
                "means outside the intervals of all their clips",
                self.outside_readings.len() as f64,
                0.0,
                "",
            ),
            Row::at_most("intervals wider than a factor of two", self.too_wide.len() as f64, 0.0, ""),
        ];
        for (n, errors) in &self.errors_percent {
            let (mean, worst) = mean_and_worst(errors);
            let more = if *n == MANY_CLIPS { " or more" } else { "" };
            rows.push(Row::plain(format!("{n}{more} clips: mean error of {}", errors.len()), mean, "%"));
            rows.push(Row::plain(format!("{n}{more} clips: worst error"), worst, "%"));
        }
        rows
    }
}
