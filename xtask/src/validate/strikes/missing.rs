//! Do planned strikes work where a property was never measured?
//!
//! Each pile is planned and struck with all properties, then with every entry that concerns it removed in turn, then with every
//! object as if it had never been filmed.  The planner has to answer each time; how often its first strike works is compared with
//! how often it works with all properties.

use super::lab::{Lab, LabCell, Pile, Variation};
use super::{Study, friction_scale, on_all_cores, placed, planned, works};
use crate::validate::row::{self, Row};
use breakshot::object::kind;
use breakshot::plan::Method;
use breakshot::properties::Properties;
use breakshot::scene::Scene;
use breakshot::uncertain::Estimate;
use std::collections::BTreeMap;

/// Least fraction of the strikes that work with all properties and have to work without one of them.
const LEAST_STILL_WORKING: f64 = 0.85;

/// One way to lack properties.
struct Lack {
    /// The sort of what is missing.
    sort: &'static str,
    properties: Properties,
}

/// The trials with one sort of missing properties.
#[derive(Default)]
struct Count {
    trials: usize,
    without_strike: usize,
    /// Trials on piles that the first strike singulates with all properties.
    solved: usize,
    still_solved: usize,
    /// Sum of the stated success probabilities, and the strikes that worked.
    stated: f64,
    worked: usize,
}

/// Strikes every pile with all properties and with every lack, with one lab on each core; prints the table.
pub(super) fn run(cell: &LabCell, study: &Study, piles: &[Pile]) -> Result<(), String> {
    let trials = on_all_cores(cell, piles, |lab, pile, seed| trials(lab, study, pile, seed))?.concat();
    let (mut counts, mut all) = (BTreeMap::<&'static str, Count>::new(), Count::default());
    for trial in &trials {
        counts.entry(trial.sort).or_default().add(trial);
        all.add(trial);
    }
    row::require(print(&counts, &all))
}

/// One pile with one lack.
#[derive(Clone)]
struct Trial {
    sort: &'static str,
    without: Tried,
    /// Whether the strike that is planned with all properties works.
    solved: bool,
}

impl Count {
    fn add(&mut self, Trial { without, solved, .. }: &Trial) {
        self.trials += 1;
        self.without_strike += usize::from(!without.planned);
        self.solved += usize::from(*solved);
        self.still_solved += usize::from(*solved && without.worked);
        self.stated += without.stated;
        self.worked += usize::from(without.worked);
    }
}

/// Strikes one pile with every lack.
fn trials(lab: &mut Lab, study: &Study, pile: &Pile, seed: u64) -> Result<Vec<Trial>, String> {
    let mut scene = study.scene.clone();
    scene.placed = placed(&pile.poses);
    let solved = first_strike(lab, &scene, &study.properties, seed)?.worked;
    let mut trials = Vec::new();
    for Lack { sort, properties } in lacks(&scene, &study.properties) {
        trials.push(Trial { sort, without: first_strike(lab, &scene, &properties, seed)?, solved });
    }
    let working = trials.iter().filter(|t| t.without.worked).count();
    let word = if solved { "works" } else { "fails" };
    println!(
        "{} {} objects: {word} with all properties, {working} of {} times without one",
        pile.name,
        pile.poses.len(),
        trials.len()
    );
    Ok(trials)
}

/// What came of one strike.
#[derive(Clone)]
struct Tried {
    planned: bool,
    stated: f64,
    worked: bool,
}

fn first_strike(lab: &mut Lab, scene: &Scene, properties: &Properties, seed: u64) -> Result<Tried, String> {
    let plan = planned(scene, properties, Method::Robust, seed).map_err(|e| e.to_string())?;
    let once = Variation { friction_scale: friction_scale(seed), seed: None };
    Ok(Tried {
        planned: plan.strike.is_some(),
        stated: plan.prediction.as_ref().and_then(|p| p.success_probability).unwrap_or(0.0),
        worked: works(lab, scene, plan.strike.as_ref(), once)?.0,
    })
}

/// A group of properties.
type Group = for<'a> fn(&'a mut Properties) -> &'a mut BTreeMap<String, Estimate>;

const GROUPS: [(&str, Group); 4] = [
    ("friction", |p| &mut p.friction),
    ("striker restitution", |p| &mut p.striker_restitution),
    ("restitution", |p| &mut p.restitution),
    ("mass ratio", |p| &mut p.mass_ratio),
];

/// The properties with each entry that concerns the scene removed in turn, and with each object never filmed.
fn lacks(scene: &Scene, properties: &Properties) -> Vec<Lack> {
    let complete = Properties { evidence: None, ..properties.clone() };
    let names: Vec<&str> = scene.placed.iter().map(|p| kind(&p.object)).collect();
    let concerns = |entry: &str| entry.split('/').all(|name| names.contains(&name));
    let mut lacks = Vec::new();
    for (sort, group) in GROUPS {
        let entries: Vec<String> =
            group(&mut complete.clone()).keys().filter(|e| concerns(e)).cloned().collect();
        for entry in entries {
            let mut properties = complete.clone();
            group(&mut properties).remove(&entry);
            lacks.push(Lack { sort, properties });
        }
    }
    for name in &names {
        let mut properties = complete.clone();
        for (_, group) in GROUPS {
            group(&mut properties).retain(|entry, _| entry.split('/').all(|other| other != *name));
        }
        lacks.push(Lack { sort: "object never filmed", properties });
    }
    lacks
}

fn print(counts: &BTreeMap<&'static str, Count>, all: &Count) -> bool {
    let mut all_hold = true;
    let mut rows = |what: &str, count: &Count| {
        let part = |n: usize, of: usize| n as f64 / of.max(1) as f64;
        let rows = [
            Row::plain("plans", count.trials as f64, ""),
            Row::at_most("plans without a strike", count.without_strike as f64, 0.0, ""),
            Row::plain("success probability stated, mean", count.stated / count.trials.max(1) as f64, ""),
            Row::plain("strikes that work", part(count.worked, count.trials), ""),
            Row::at_least(
                format!("of the {} that work with all properties, still work", count.solved),
                part(count.still_solved, count.solved),
                LEAST_STILL_WORKING,
                "",
            ),
        ];
        all_hold &= row::print_all(what, &rows);
    };
    for (sort, count) in counts {
        rows(&format!("without one {sort}"), count);
    }
    rows("all", all);
    all_hold
}
