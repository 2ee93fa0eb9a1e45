//! Estimated properties against the true ones of the lab.

use super::bound::{Bounds, MEAN_PER_STD};
use crate::validate::row::{Row, mean_and_worst};
use crate::validate::truth::Truth;
use breakshot::properties::Properties;
use breakshot::uncertain::Estimate;
use std::collections::BTreeMap;

/// One estimated value and the true one.
pub(super) struct Pair {
    pub(super) name: String,
    pub(super) estimate: Estimate,
    truth: f64,
}

impl Pair {
    pub(super) fn error_percent(&self) -> f64 {
        100.0 * (self.estimate.mean / self.truth - 1.0)
    }

    pub(super) fn covered(&self) -> bool {
        (self.estimate.interval_95[0]..=self.estimate.interval_95[1]).contains(&self.truth)
    }

    fn half_width_percent(&self) -> f64 {
        50.0 * (self.estimate.interval_95[1] - self.estimate.interval_95[0]) / self.truth
    }
}

/// Largest accepted percentage of true values outside their 95 % intervals, where only a few are counted.
const MOST_OUTSIDE_PERCENT: f64 = 12.0;

/// Estimated and true values by kind of quantity.
pub(super) struct ByKind {
    friction: Vec<Pair>,
    striker_restitution: Vec<Pair>,
    pair_restitution: Vec<Pair>,
    /// The estimates of both kinds of restitution beside the first impacts of each clip.
    first_striker_restitution: Vec<Pair>,
    first_restitution: Vec<Pair>,
    pair_masses: Vec<Pair>,
    masses: Vec<Pair>,
}

impl ByKind {
    pub(super) fn new(truth: &Truth, estimated: &Properties) -> Self {
        let (restitutions, first) = (truth.mean_restitution(), truth.first_restitution());
        let mass = |name: &str| truth.mass_kg.get(name).copied();
        let ratio = |name: &str| name.split_once('/').and_then(|(a, b)| Some(mass(a)? / mass(b)?));
        let reference_kg = mass(&estimated.reference).unwrap_or(f64::NAN);
        let mut masses = pairs(&estimated.mass_ratio, |name| Some(mass(name)? / reference_kg));
        masses.retain(|p| p.name != estimated.reference);
        let with_striker = |truths: &BTreeMap<String, f64>| {
            pairs(&estimated.striker_restitution, |name| truths.get(&format!("{name}/striker")).copied())
        };
        Self {
            friction: pairs(&estimated.friction, |name| truth.mean_friction().get(name).copied()),
            striker_restitution: with_striker(&restitutions),
            first_striker_restitution: with_striker(&first),
            pair_restitution: pairs(&estimated.restitution, |name| restitutions.get(name).copied()),
            first_restitution: pairs(&estimated.restitution, |name| first.get(name).copied()),
            pair_masses: pairs(&estimated.pair_mass_ratio, ratio),
            masses,
        }
    }

    /// Every kind with its name and the group of its quantities in the evidence; joint masses have none.
    pub(super) fn named(&self) -> [(&'static str, &'static str, &Vec<Pair>); 5] {
        [
            ("friction", "friction", &self.friction),
            ("striker restitution", "striker_restitution", &self.striker_restitution),
            ("pair restitution", "restitution", &self.pair_restitution),
            ("pair mass ratio", "pair_mass_ratio", &self.pair_masses),
            ("joint mass ratio", "", &self.masses),
        ]
    }

    /// The quantities whose coverage is counted.
    fn counted(&self) -> [&Vec<Pair>; 4] {
        [&self.friction, &self.masses, &self.striker_restitution, &self.pair_restitution]
    }
}

/// The mean errors at the Cramer-Rao bound of the positions' noise, and those found.
pub(crate) fn bound_rows(truth: &Truth, estimated: &Properties, bounds: &Bounds) -> Vec<Row> {
    let kinds = ByKind::new(truth, estimated);
    let of = |what: &str, pairs: &[Pair], least: &BTreeMap<String, f64>, relative: bool| {
        let percent = |p: &Pair| {
            let std = least.get(&p.name).copied().unwrap_or(f64::NAN);
            100.0 * MEAN_PER_STD * if relative { std } else { std / p.truth }
        };
        let bound: f64 = pairs.iter().map(percent).sum::<f64>() / pairs.len().max(1) as f64;
        let found = mean_and_worst(&pairs.iter().map(Pair::error_percent).collect::<Vec<_>>()).0;
        [
            Row::plain(format!("{what}: mean error at best"), bound, "%"),
            Row::plain(format!("{what}: mean error found"), found, "%"),
        ]
    };
    let worst = (kinds.pair_masses.iter())
        .max_by(|p, q| p.error_percent().abs().total_cmp(&q.error_percent().abs()))
        .map(|p| {
            let least = bounds.pair_mass_ratio.get(&p.name).copied().unwrap_or(f64::NAN);
            [
                Row::plain(
                    format!("pair mass ratio: worst error ({})", p.name),
                    p.error_percent().abs(),
                    "%",
                ),
                Row::plain("its standard deviation at best", 100.0 * least, "%"),
            ]
        });
    [
        of("friction", &kinds.friction, &bounds.friction, false),
        of("striker restitution", &kinds.striker_restitution, &bounds.striker_restitution, false),
        of("pair restitution", &kinds.pair_restitution, &bounds.restitution, false),
        of("pair mass ratio", &kinds.pair_masses, &bounds.pair_mass_ratio, true),
        of("joint mass ratio", &kinds.masses, &bounds.mass_ratio, true),
    ]
    .into_iter()
    .chain(worst)
    .flatten()
    .collect()
}

/// Results of a campaign with fewer clips or frames: coverage, and by how much the intervals widen.
pub(crate) fn thin_rows(truth: &Truth, whole: &Properties, thin: &Properties) -> Vec<Row> {
    let (whole, thin) = (ByKind::new(truth, whole), ByKind::new(truth, thin));
    let mut wider: Vec<f64> = Vec::new();
    for (before, now) in whole.counted().into_iter().zip(thin.counted()) {
        for pair in now {
            let same = before.iter().find(|p| p.name == pair.name);
            wider.extend(same.map(|p| pair.half_width_percent() / p.half_width_percent()));
        }
    }
    wider.sort_by(f64::total_cmp);
    let all = thin.counted().into_iter().flatten();
    let (count, covered) = all.fold((0_usize, 0_usize), |(n, c), p| (n + 1, c + usize::from(p.covered())));
    let outside = 100.0 * (1.0 - covered as f64 / count.max(1) as f64);
    let middle = wider.get(wider.len() / 2).copied().unwrap_or(f64::NAN);
    let mut rows = vec![
        Row::at_most(
            format!("truths outside their 95 % interval, of {count}"),
            outside,
            MOST_OUTSIDE_PERCENT,
            "%",
        ),
        Row::plain("half interval over that of the whole campaign, median", middle, ""),
    ];
    for (what, pairs) in [("friction", &thin.friction), ("joint mass ratio", &thin.masses)] {
        let errors: Vec<f64> = pairs.iter().map(Pair::error_percent).collect();
        rows.push(Row::plain(format!("{what}: mean error"), mean_and_worst(&errors).0, "%"));
    }
    rows
}

/// Errors of all estimated values, and their coverage; `details` prints every value.
pub(crate) fn rows(truth: &Truth, estimated: &Properties, details: bool) -> Vec<Row> {
    let ByKind { friction, striker_restitution, pair_restitution, pair_masses, masses, .. } =
        ByKind::new(truth, estimated);
    let mut rows = Vec::new();
    let groups = [
        ("friction", &friction, 0.6),
        ("striker restitution", &striker_restitution, 0.5),
        ("pair restitution", &pair_restitution, 1.0),
        ("pair mass ratio", &pair_masses, 0.6),
        ("joint mass ratio", &masses, 0.3),
    ];
    for (what, group, target) in groups {
        if details {
            print_details(what, group);
        }
        let errors: Vec<f64> = group.iter().map(Pair::error_percent).collect();
        let (mean, worst) = mean_and_worst(&errors);
        rows.push(Row::at_most(format!("{what}: mean error of {}", group.len()), mean, target, "%"));
        rows.push(if what == "pair mass ratio" {
            Row::at_most(format!("{what}: worst error"), worst, 2.0, "%")
        } else {
            Row::plain(format!("{what}: worst error"), worst, "%")
        });
    }
    rows.extend(coverage([&friction, &masses, &striker_restitution, &pair_restitution]));
    rows
}

/// Errors and coverage over the values of several cells.
pub(crate) fn pooled_rows(cells: &[(Truth, Properties)]) -> Vec<Row> {
    let kinds: Vec<ByKind> = cells.iter().map(|(truth, learned)| ByKind::new(truth, learned)).collect();
    let errors = |of: fn(&ByKind) -> &Vec<Pair>| -> Vec<f64> {
        kinds.iter().flat_map(of).map(Pair::error_percent).collect()
    };
    let group = |what: &str, of: fn(&ByKind) -> &Vec<Pair>, target: f64| {
        let errors = errors(of);
        let (mean, worst) = mean_and_worst(&errors);
        [
            Row::at_most(format!("{what}: mean error of {}", errors.len()), mean, target, "%"),
            Row::plain(format!("{what}: worst error"), worst, "%"),
        ]
    };
    let beside_first = |what: &str, of: fn(&ByKind) -> &Vec<Pair>| {
        let mean = mean_and_worst(&errors(of)).0;
        Row::plain(format!("{what} restitution beside first impacts: mean error"), mean, "%")
    };
    let all: Vec<&Pair> = kinds.iter().flat_map(ByKind::counted).flatten().collect();
    let covered = 100.0 * all.iter().filter(|p| p.covered()).count() as f64 / all.len().max(1) as f64;
    [
        group("friction", |k| &k.friction, 2.0),
        group("striker restitution", |k| &k.striker_restitution, 1.0),
        group("pair restitution", |k| &k.pair_restitution, 2.0),
        group("pair mass ratio", |k| &k.pair_masses, 2.0),
    ]
    .into_iter()
    .flatten()
    .chain([
        beside_first("striker", |k| &k.first_striker_restitution),
        beside_first("pair", |k| &k.first_restitution),
        Row::at_least(format!("95 % intervals that hold, of {}", all.len()), covered, 90.0, "%"),
        Row::at_most("the same", covered, 99.0, "%"),
    ])
    .collect()
}

/// Number of true values outside their 95 % intervals and the widest intervals, over friction, masses and both restitutions.
fn coverage(groups: [&Vec<Pair>; 4]) -> Vec<Row> {
    let all: Vec<&Pair> = groups.into_iter().flatten().collect();
    let outside = all.iter().filter(|p| !p.covered()).count();
    let widest = |groups: &[&Vec<Pair>]| {
        groups.iter().flat_map(|g| g.iter()).map(Pair::half_width_percent).fold(0.0, f64::max)
    };
    let most = MOST_OUTSIDE_PERCENT / 100.0 * all.len() as f64;
    vec![
        Row::at_most(
            format!("truths outside their 95 % interval, of {}", all.len()),
            outside as f64,
            most.floor(),
            "",
        ),
        Row::at_most("widest half interval of friction and masses", widest(&groups[..2]), 5.0, "%"),
        Row::at_most("widest half interval of restitutions", widest(&groups[2..]), 8.0, "%"),
    ]
}

fn pairs(estimates: &BTreeMap<String, Estimate>, truth: impl Fn(&str) -> Option<f64>) -> Vec<Pair> {
    estimates
        .iter()
        .filter_map(|(name, &estimate)| Some(Pair { name: name.clone(), estimate, truth: truth(name)? }))
        .collect()
}

fn print_details(what: &str, group: &[Pair]) {
    println!(
        "\n{what:<22} {:>9} {:>9} {:>8} {:>9} {:>8} {:>3}",
        "estimate", "true", "error %", "std %", "+-95 %", "n"
    );
    for pair in group {
        let std = pair.estimate.std.map_or(f64::NAN, |s| 100.0 * s / pair.truth);
        println!(
            "{:<22} {:>9.4} {:>9.4} {:>8.2} {:>9.2} {:>8.2} {:>3}{}",
            pair.name,
            pair.estimate.mean,
            pair.truth,
            pair.error_percent(),
            std,
            pair.half_width_percent(),
            pair.estimate.n,
            if pair.covered() { "" } else { "  outside" }
        );
    }
}
