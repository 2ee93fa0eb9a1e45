//! Why may the strike fail, and which doubt costs most?

use super::evaluate::{part, verdicts};
use super::goal_margin::{Condition, Judge, Verdict};
use super::scenarios::possible_worlds;
use crate::error::Result;
use crate::physics::World;
use crate::plan::options::Options;
use crate::plan::result::{Doubt, Failure, Source};
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use crate::singulation::Area;
use std::collections::BTreeMap;

/// The conditions that fail, by how often each is the worst.
pub(crate) fn failures(scene: &Scene, verdicts: &[Verdict]) -> Vec<Failure> {
    let mut counts: BTreeMap<Condition, usize> = BTreeMap::new();
    for verdict in verdicts.iter().filter(|v| !v.fulfilled()) {
        *counts.entry(verdict.tightest).or_default() += 1;
    }
    let mut found: Vec<Failure> = counts
        .into_iter()
        .map(|(condition, count)| Failure {
            what: words(scene, condition),
            part: count as f64 / verdicts.len() as f64,
        })
        .collect();
    found.sort_by(|one, other| other.part.total_cmp(&one.part));
    found
}

fn words(scene: &Scene, condition: Condition) -> String {
    let name = |k: usize| scene.placed[k].object.as_str();
    match condition {
        Condition::Close([a, b]) => format!("{} and {} stay close", name(a), name(b)),
        Condition::Narrow([a, b]) => format!("the gap between {} and {} stays narrow", name(a), name(b)),
        Condition::Dense => "the pile stays together".into(),
        Condition::Wide => "the objects go too far".into(),
        Condition::Place(k, Area::Workspace) => format!("{} leaves the workspace", name(k)),
        Condition::Place(k, Area::Table) => format!("{} falls off the table", name(k)),
        Condition::Place(k, Area::KeepOut) => format!("{} enters a keep-out area", name(k)),
        Condition::Grasp(k) => format!("the gripper finds no room around {}", name(k)),
        Condition::Moved(k) => format!("{} is moved", name(k)),
        Condition::Nothing => "the strike cannot be followed to its end".into(),
    }
}

/// How the success probability would grow if one source of doubt after the other were known exactly, on the same draws.
pub(crate) fn doubts(
    known: (&Scene, &Properties, &World),
    options: &Options,
    (strike, judge): (&Strike, &Judge),
    (seed, judged): (u64, &[Verdict]),
) -> Result<Vec<Doubt>> {
    let judged = &judged[..SAMPLES.min(judged.len())];
    let probability = part(judged, Verdict::fulfilled);
    let mut found = Vec::new();
    for source in Source::ALL {
        let worlds = possible_worlds(known, options, (seed, judged.len()), Some(source))?;
        let gain = part(&verdicts(strike, &worlds, judge), Verdict::fulfilled) - probability;
        found.push(Doubt { source, gain });
    }
    found.sort_by(|one, other| other.gain.total_cmp(&one.gain));
    Ok(found)
}

/// Possible worlds per source: the first of those that the strike was judged on, but for the source.
const SAMPLES: usize = 200;
