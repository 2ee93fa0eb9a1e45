//! Drawn campaigns of known truth and known noise: do 95 % intervals hold the truth in 95 % of the cases?
//!
//! `cargo xtask validate estimate [COUNT]`.

use super::row::{self, Row};
use breakshot::estimate::{self, Options};
use breakshot::properties::Properties;
use breakshot::synthetic::campaign::{self, Campaign, Recipe};
use breakshot::uncertain::Estimate;
use std::collections::BTreeMap;

/// Campaigns unless told otherwise.
pub(crate) const COUNT: u64 = 200;

/// Learned against true values of one kind of quantity, over all campaigns.
#[derive(Default)]
struct Tally {
    count: usize,
    covered: usize,
    /// Sum of squares of error over standard error.
    squares: f64,
    errors: Vec<f64>,
    half_widths: Vec<f64>,
}

impl Tally {
    fn add(&mut self, learned: &Estimate, truth: f64) {
        let [low, high] = learned.interval_95;
        self.count += 1;
        self.covered += usize::from((low..=high).contains(&truth));
        self.squares += ((learned.mean - truth) / learned.standard_error).powi(2);
        self.errors.push(100.0 * (learned.mean / truth - 1.0).abs());
        self.half_widths.push(50.0 * (high - low) / truth);
    }

    fn add_all(&mut self, learned: &BTreeMap<String, Estimate>, truth: &BTreeMap<String, f64>) {
        for (name, estimate) in learned.iter().filter(|(_, e)| e.standard_error > 0.0) {
            if let Some(&truth) = truth.get(name) {
                self.add(estimate, truth);
            }
        }
    }

    fn coverage(&self) -> f64 {
        100.0 * self.covered as f64 / self.count.max(1) as f64
    }
}

/// The films of the `n`-th campaign: noise, codec, spread and aim vary.
fn recipe(n: u64) -> Recipe {
    let pick = |step: u64, values: [f64; 3]| values[(n / step % 3) as usize];
    Recipe {
        noise_m: pick(1, [1e-5, 2e-5, 4e-5]),
        still_noise: pick(3, [0.05, 0.5, 1.0]),
        friction_spread: pick(9, [0.03, 0.01, 0.05]),
        restitution_spread: pick(27, [0.02, 0.01, 0.03]),
        // Every other campaign strikes off centre, with markers that tell the turn.
        off_centre: if n.is_multiple_of(2) { 0.1 } else { 0.6 },
        bars: !n.is_multiple_of(2),
        ..Recipe::default()
    }
}

/// Draws campaigns, learns from them, and prints how often the intervals hold the truth.
pub(crate) fn validate(count: u64) -> Result<bool, String> {
    let mut tallies: BTreeMap<&str, Tally> = BTreeMap::new();
    for n in 0..count {
        let campaign = campaign::campaign(&recipe(n), n);
        let learned = learned(&campaign)?;
        let truth = &campaign.truth;
        let groups = [
            ("friction", &learned.friction, &truth.friction),
            ("striker restitution", &learned.striker_restitution, &truth.striker_restitution),
            ("pair restitution", &learned.restitution, &truth.restitution),
            ("mass ratio", &learned.mass_ratio, &truth.mass_ratio),
        ];
        for (what, learned, truth) in groups {
            tallies.entry(what).or_default().add_all(learned, truth);
        }
        let contact = [
            ("contact friction", learned.contact_friction.objects, truth.contact_friction),
            ("striker friction", learned.contact_friction.striker, truth.striker_friction),
        ];
        for (what, learned, truth) in contact {
            if let Some(learned) = learned {
                tallies.entry(what).or_default().add(&learned, truth);
            }
        }
    }
    println!("{:<20} {:>6} {:>9} {:>8} {:>9} {:>8}", "", "count", "covered %", "chi^2", "error %", "+-95 %");
    for (what, tally) in &tallies {
        let mid = |values: &[f64]| {
            let mut sorted = values.to_vec();
            sorted.sort_by(f64::total_cmp);
            sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
        };
        println!(
            "{what:<20} {:>6} {:>9.2} {:>8.3} {:>9.3} {:>8.3}",
            tally.count,
            tally.coverage(),
            tally.squares / tally.count as f64,
            mid(&tally.errors),
            mid(&tally.half_widths)
        );
    }
    let (covered, all) = tallies.values().fold((0, 0), |(c, n), t| (c + t.covered, n + t.count));
    let coverage = 100.0 * covered as f64 / all.max(1) as f64;
    Ok(row::print_all(
        "Drawn campaigns",
        &[
            Row::plain("campaigns", count as f64, ""),
            Row::at_most(
                "95 % intervals hold the truth: distance from 95",
                (coverage - 95.0).abs(),
                2.0,
                "%",
            ),
        ],
    ))
}

fn learned(campaign: &Campaign) -> Result<Properties, String> {
    let options = Options { reference: Some(campaign.objects[0].name.clone()) };
    let found = estimate::estimation(&campaign.clips, &campaign.cell, &campaign.objects, &options);
    Ok(found.map_err(|e| e.to_string())?.properties)
}
