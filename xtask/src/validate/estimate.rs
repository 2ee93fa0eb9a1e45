//! Estimated properties against the truth of a lab's campaign.

use breakshot::properties::Properties;
use breakshot::uncertain::Estimate;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// What `truth.json` holds, as far as it is compared here.
#[derive(Deserialize)]
struct Truth {
    clips: BTreeMap<String, ClipTruth>,
    mass_kg: BTreeMap<String, f64>,
    friction: BTreeMap<String, f64>,
    surface_friction: f64,
    striker_friction: f64,
}

#[derive(Deserialize)]
struct ClipTruth {
    start: BTreeMap<String, [f64; 3]>,
    friction_scale: f64,
    measured: MeasuredTruth,
}

#[derive(Deserialize)]
struct MeasuredTruth {
    impacts: Vec<ImpactTruth>,
}

#[derive(Deserialize)]
struct ImpactTruth {
    pair: [String; 2],
    single: bool,
    restitution: Option<f64>,
}

/// One line of the table: an estimate beside the two truths that it is judged by.
struct Line<'a> {
    name: String,
    estimate: Option<&'a Estimate>,
    /// What the mean should be.
    truth: f64,
    /// What the interval should hold.
    cell: f64,
    counts_for_coverage: bool,
}

/// Prints every property beside its truth, and a summary of each kind; `verbose` prints every line.
///
/// # Errors
/// A truth file that cannot be read.
pub fn print(lab: &Path, properties: &Properties, verbose: bool) -> Result<(), Box<dyn std::error::Error>> {
    let truth: Truth = serde_json::from_slice(&std::fs::read(lab.join("campaign/truth.json"))?)?;
    let mut all = Vec::new();
    for (title, lines) in [
        ("friction", friction(&truth, properties)),
        ("striker restitution", striker(&truth, properties)),
        ("pair restitution", pairs(&truth, properties)),
        ("pair mass ratio", pair_masses(&truth, properties)),
        ("joint mass ratio", masses(&truth, properties)),
    ] {
        summarize(title, &lines, verbose);
        all.extend(lines);
    }
    let judged: Vec<&Line> = all.iter().filter(|l| l.counts_for_coverage).collect();
    let covered = judged.iter().filter(|l| l.covers()).count();
    println!("interval_95 covers {covered} of {}", judged.len());
    for (what, estimate, truth) in [
        ("objects", &properties.contact_friction.objects, truth.surface_friction),
        ("striker", &properties.contact_friction.striker, truth.striker_friction),
    ] {
        match estimate {
            Some(e) => {
                println!("contact friction, {what}: {:.3} +- {:.3} (truth {truth})", e.mean, e.standard_error)
            }
            None => println!("contact friction, {what}: absent (truth {truth})"),
        }
    }
    Ok(())
}

impl Line<'_> {
    /// The error of the mean (%).
    fn error(&self) -> f64 {
        self.estimate.map_or(f64::NAN, |e| 100.0 * (e.mean / self.truth - 1.0))
    }

    fn covers(&self) -> bool {
        self.estimate.is_some_and(|e| (e.interval_95[0]..=e.interval_95[1]).contains(&self.cell))
    }

    /// Half the interval over the mean (%).
    fn half_width(&self) -> f64 {
        self.estimate.map_or(f64::NAN, |e| 50.0 * (e.interval_95[1] - e.interval_95[0]) / e.mean)
    }
}

fn summarize(title: &str, lines: &[Line], verbose: bool) {
    let errors: Vec<f64> = lines.iter().map(|l| l.error().abs()).filter(|e| e.is_finite()).collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let worst = errors.iter().copied().fold(0.0, f64::max);
    let widest = lines.iter().map(Line::half_width).fold(0.0, f64::max);
    let missing = lines.iter().filter(|l| l.estimate.is_none()).count();
    let covered = lines.iter().filter(|l| l.covers()).count();
    println!(
        "{title:20} {:2} values, mean error {mean:.2} %, worst {worst:.2} %, widest interval +-{widest:.1} %, \
         covers {covered}, missing {missing}",
        lines.len()
    );
    if !verbose {
        return;
    }
    for line in lines {
        let Some(e) = line.estimate else {
            println!("    {:6} absent (truth {:.4})", line.name, line.truth);
            continue;
        };
        println!(
            "    {:6} {:9.4} truth {:9.4} error {:+6.2} %  interval +-{:4.1} % {} std {:.4} n {}",
            line.name,
            e.mean,
            line.truth,
            line.error(),
            line.half_width(),
            if line.covers() { "covers " } else { "MISSES " },
            e.std.unwrap_or(f64::NAN),
            e.n
        );
    }
}

fn kind(name: &str) -> &str {
    name.split('#').next().unwrap_or(name)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn friction<'a>(truth: &Truth, properties: &'a Properties) -> Vec<Line<'a>> {
    (truth.friction.iter())
        .map(|(object, &cell)| {
            let filmed = |c: &&ClipTruth| c.start.keys().any(|n| kind(n) == object);
            let scales: Vec<f64> = truth.clips.values().filter(filmed).map(|c| c.friction_scale).collect();
            Line {
                name: object.clone(),
                estimate: properties.friction.get(object),
                truth: cell * mean(&scales),
                cell,
                counts_for_coverage: true,
            }
        })
        .collect()
}

/// The mean restitution of all single impacts of each pair of names.
fn restitutions(truth: &Truth) -> BTreeMap<String, f64> {
    let mut all: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for impact in truth.clips.values().flat_map(|c| &c.measured.impacts) {
        if let (true, Some(e)) = (impact.single, impact.restitution) {
            let [a, b] = [kind(&impact.pair[0]), kind(&impact.pair[1])];
            all.entry(format!("{}/{}", a.min(b), a.max(b))).or_default().push(e);
        }
    }
    all.into_iter().map(|(pair, values)| (pair, mean(&values))).collect()
}

fn striker<'a>(truth: &Truth, properties: &'a Properties) -> Vec<Line<'a>> {
    (restitutions(truth).into_iter())
        .filter_map(|(pair, e)| pair.strip_suffix("/striker").map(|o| (o.to_owned(), e)))
        .map(|(name, e)| Line {
            estimate: properties.striker_restitution.get(&name),
            name,
            truth: e,
            cell: e,
            counts_for_coverage: true,
        })
        .collect()
}

fn pairs<'a>(truth: &Truth, properties: &'a Properties) -> Vec<Line<'a>> {
    (restitutions(truth).into_iter())
        .filter(|(pair, _)| !pair.ends_with("/striker"))
        .map(|(name, e)| Line {
            estimate: properties.restitution.get(&name),
            name,
            truth: e,
            cell: e,
            counts_for_coverage: true,
        })
        .collect()
}

fn pair_masses<'a>(truth: &Truth, properties: &'a Properties) -> Vec<Line<'a>> {
    (properties.pair_mass_ratio.iter())
        .filter_map(|(pair, estimate)| {
            let (a, b) = pair.split_once('/')?;
            let ratio = truth.mass_kg.get(a)? / truth.mass_kg.get(b)?;
            let estimate = Some(estimate);
            Some(Line { name: pair.clone(), estimate, truth: ratio, cell: ratio, counts_for_coverage: false })
        })
        .collect()
}

fn masses<'a>(truth: &Truth, properties: &'a Properties) -> Vec<Line<'a>> {
    let Some(unit) = truth.mass_kg.get(&properties.reference) else { return Vec::new() };
    (truth.mass_kg.iter())
        .filter(|(object, _)| **object != properties.reference)
        .map(|(object, mass)| Line {
            name: object.clone(),
            estimate: properties.mass_ratio.get(object),
            truth: mass / unit,
            cell: mass / unit,
            counts_for_coverage: true,
        })
        .collect()
}
