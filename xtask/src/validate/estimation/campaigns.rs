//! Do 95 % intervals contain the true value in 95 % of the cases?  `cargo xtask validate estimate [COUNT]`.
//!
//! Synthetic campaigns with known truth and noise are estimated, and the coverage of every kind of quantity is counted by
//! itself: a kind that is covered too often would hide one that is covered too rarely.

use crate::validate::row::{self, Row, median};
use breakshot::estimate::{self, Options};
use breakshot::properties::Properties;
use breakshot::synthetic::campaign::{CampaignSpec, SyntheticCampaign, Truth, campaign};
use breakshot::uncertain::Estimate;
use std::collections::BTreeMap;

/// Default number of campaigns.
pub(crate) const COUNT: u64 = 200;
/// Nominal coverage of the intervals, and its largest accepted error (percent).
const NOMINAL_PERCENT: f64 = 95.0;
const TOLERANCE_PERCENT: f64 = 2.0;

/// Estimated against true values of one kind of quantity, over all campaigns.
#[derive(Default)]
struct Tally {
    count: usize,
    covered: usize,
    /// Sum of the squares of error over standard error.
    chi_square: f64,
    /// The largest of them, with the number of its campaign.
    worst: (f64, u64),
    errors_percent: Vec<f64>,
    half_widths_percent: Vec<f64>,
}

impl Tally {
    fn add(&mut self, campaign: u64, estimate: &Estimate, truth: f64) {
        let [low, high] = estimate.interval_95;
        self.count += 1;
        self.covered += usize::from((low..=high).contains(&truth));
        let square = ((estimate.mean - truth) / estimate.standard_error).powi(2);
        self.chi_square += square;
        if square > self.worst.0 {
            self.worst = (square, campaign);
        }
        if truth != 0.0 {
            self.errors_percent.push(100.0 * (estimate.mean / truth - 1.0).abs());
            self.half_widths_percent.push(50.0 * (high - low) / truth.abs());
        }
    }

    fn add_all(
        &mut self,
        campaign: u64,
        estimates: &BTreeMap<String, Estimate>,
        truth: &BTreeMap<String, f64>,
    ) {
        for (name, estimate) in estimates.iter().filter(|(_, e)| e.standard_error > 0.0) {
            if let Some(&truth) = truth.get(name) {
                self.add(campaign, estimate, truth);
            }
        }
    }

    fn coverage_percent(&self) -> f64 {
        100.0 * self.covered as f64 / self.count.max(1) as f64
    }

    /// The row of this kind: how far its coverage is from the nominal one, with the binomial error of so few intervals.
    fn row(&self, what: &str) -> Row {
        let nominal = NOMINAL_PERCENT / 100.0;
        let sampling = 100.0 * (nominal * (1.0 - nominal) / self.count.max(1) as f64).sqrt();
        let coverage = self.coverage_percent();
        Row::at_most(
            format!("{what}: {coverage:.1} % of {} cover (+- {sampling:.1}), off 95", self.count),
            (coverage - NOMINAL_PERCENT).abs(),
            TOLERANCE_PERCENT,
            "%",
        )
    }
}

/// The conditions of the `n`-th campaign: noise, codec, variation and offsets differ.
fn spec(n: u64) -> CampaignSpec {
    let pick = |step: u64, values: [f64; 3]| values[(n / step % 3) as usize];
    CampaignSpec {
        noise_m: pick(1, [1e-5, 2e-5, 4e-5]),
        still_noise: pick(3, [0.05, 0.5, 1.0]),
        friction_std: pick(9, [0.03, 0.01, 0.05]),
        restitution_std: pick(27, [0.02, 0.01, 0.03]),
        // Every other campaign has impacts off the centre, and markers that show the yaw.
        max_offset: if n.is_multiple_of(2) { 0.1 } else { 0.6 },
        bar_markers: !n.is_multiple_of(2),
        // Two of three campaigns have objects that press towards their rims.
        drawn_supports: !n.is_multiple_of(3),
        // Every other pair of campaigns lies on a tilted table: up to 0.6 degrees in another direction each.
        slope: if (n / 2).is_multiple_of(2) { [0.0; 2] } else { slope(n) },
        // Less, and somewhat more than the bodies of drawn cells (`validate cells`).
        rocking: pick(5, [0.002, 0.008, 0.03]),
        // Bodies with spin slide straight, curl a little, or as much as those that a linear pressure supports.
        pressed_ahead: pick(7, [0.0, 0.3, 1.0]),
        ..CampaignSpec::default()
    }
}

/// The slope of the `n`-th campaign: 0.2, 0.4 or 0.6 degrees, in a direction that the golden angle turns.
fn slope(n: u64) -> [f64; 2] {
    const GOLDEN_RAD: f64 = 2.399_963_229_728_653;
    let (size, direction) = (0.0035 * (1 + n % 3) as f64, GOLDEN_RAD * n as f64);
    [size * direction.cos(), size * direction.sin()]
}

/// Estimates synthetic campaigns and prints how often the intervals contain the truth; whether every target holds.
pub(crate) fn validate(count: u64) -> Result<bool, String> {
    let mut tallies: BTreeMap<&str, Tally> = BTreeMap::new();
    let mut verdicts = Verdicts::default();
    for n in 0..count {
        let drawn = campaign(&spec(n), n);
        let estimated = estimated(&drawn)?;
        verdicts.add(&estimated, &drawn.truth);
        add(&mut tallies, n, &estimated, &drawn.truth);
    }
    print_table(&tallies);
    let mut rows = vec![Row::plain("campaigns", count as f64, "")];
    rows.extend(tallies.iter().map(|(what, tally)| tally.row(what)));
    let pooled = Tally {
        count: tallies.values().map(|t| t.count).sum(),
        covered: tallies.values().map(|t| t.covered).sum(),
        ..Tally::default()
    };
    rows.push(pooled.row("all kinds together"));
    rows.extend(verdicts.rows());
    Ok(row::print_all("Coverage of 95 % intervals on synthetic campaigns", &rows))
}

/// Whether tables are said to be level.
#[derive(Default)]
struct Verdicts {
    level: usize,
    level_said_level: usize,
    tilted: usize,
    tilted_said_tilted: usize,
}

impl Verdicts {
    fn add(&mut self, estimated: &Properties, truth: &Truth) {
        let tilted = estimated.tilt.is_some_and(|tilt| !tilt.level);
        if truth.slope == [0.0; 2] {
            self.level += 1;
            self.level_said_level += usize::from(!tilted);
        } else {
            self.tilted += 1;
            self.tilted_said_tilted += usize::from(tilted);
        }
    }

    fn rows(&self) -> [Row; 2] {
        [
            Row::plain(
                format!("level tables not said to be tilted, of {}", self.level),
                self.level_said_level as f64,
                "",
            ),
            Row::plain(
                format!("tilted tables said to be tilted, of {}", self.tilted),
                self.tilted_said_tilted as f64,
                "",
            ),
        ]
    }
}

/// Adds all estimates of the campaign of this number.
fn add(tallies: &mut BTreeMap<&str, Tally>, campaign: u64, estimated: &Properties, truth: &Truth) {
    let groups = [
        ("friction", &estimated.friction, &truth.friction),
        ("striker restitution", &estimated.striker_restitution, &truth.striker_restitution),
        ("pair restitution", &estimated.restitution, &truth.restitution),
        ("mass ratio", &estimated.mass_ratio, &truth.mass_ratio),
        ("support", &estimated.support, &truth.support),
    ];
    for (what, estimates, values) in groups {
        tallies.entry(what).or_default().add_all(campaign, estimates, values);
    }
    let pair_truth: BTreeMap<String, f64> = (estimated.pair_mass_ratio.keys())
        .filter_map(|pair| {
            let (a, b) = pair.split_once('/')?;
            Some((pair.clone(), truth.mass_ratio.get(a)? / truth.mass_ratio.get(b)?))
        })
        .collect();
    tallies.entry("pair mass ratio").or_default().add_all(campaign, &estimated.pair_mass_ratio, &pair_truth);
    if let Some(tilt) = estimated.tilt {
        for (found, truth) in [tilt.x, tilt.y].iter().zip(truth.slope) {
            tallies.entry("slope").or_default().add(campaign, found, truth);
        }
    }
    let contact = [
        ("contact friction", estimated.contact_friction.objects, truth.contact_friction),
        ("striker friction", estimated.contact_friction.striker, truth.striker_friction),
    ];
    for (what, estimate, value) in contact {
        if let Some(estimate) = estimate {
            tallies.entry(what).or_default().add(campaign, &estimate, value);
        }
    }
}

fn print_table(tallies: &BTreeMap<&str, Tally>) {
    let [count, covered, error, half] = ["count", "covered %", "error %", "+-95 %"];
    println!("{:<20} {count:>6} {covered:>9} {:>8} {error:>9} {half:>8} {:>12}", "", "chi^2", "worst chi^2");
    for (what, tally) in tallies {
        println!(
            "{what:<20} {:>6} {:>9.2} {:>8.3} {:>9.3} {:>8.3} {:>12.1} (campaign {})",
            tally.count,
            tally.coverage_percent(),
            tally.chi_square / tally.count as f64,
            median(tally.errors_percent.clone()),
            median(tally.half_widths_percent.clone()),
            tally.worst.0,
            tally.worst.1,
        );
    }
}

fn estimated(drawn: &SyntheticCampaign) -> Result<Properties, String> {
    let options = Options { reference: Some(drawn.objects[0].name.clone()) };
    let found = estimate::estimation(&drawn.clips, &drawn.cell, &drawn.objects, &options);
    Ok(found.map_err(|e| e.to_string())?.properties)
}
