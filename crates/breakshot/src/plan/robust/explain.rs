//! Why does the strike fail where it fails, and which uncertainty costs most?

use super::evaluate::{Evaluation, success_probability};
use super::scenarios::{Draws, Nominal};
use crate::error::Result;
use crate::plan::result::{Failure, Sensitivity, Source};
use crate::scene::goal_margin::{Condition, GoalMargin};
use crate::scene::singulation::Area;
use crate::scene::{Scene, Strike};
use crate::statistics::sorted_by_value;
use std::collections::BTreeMap;

/// Scenarios per source of uncertainty: the first of those in which the strike was evaluated, with that source fixed.
const SAMPLES: usize = 200;

/// The violated conditions, the most frequent first; of each failed scenario the condition with the least margin counts.
pub(crate) fn failures(scene: &Scene, margins: &[GoalMargin]) -> Vec<Failure> {
    let mut counts: BTreeMap<Condition, usize> = BTreeMap::new();
    for margin in margins.iter().filter(|m| !m.fulfilled()) {
        *counts.entry(margin.tightest).or_default() += 1;
    }
    let found: Vec<Failure> = counts
        .into_iter()
        .map(|(condition, count)| Failure {
            what: phrase(scene, condition),
            fraction: count as f64 / margins.len() as f64,
        })
        .collect();
    sorted_by_value(found, |failure| -failure.fraction)
}

fn phrase(scene: &Scene, condition: Condition) -> String {
    let name = |k: usize| scene.placed[k].object.as_str();
    match condition {
        Condition::Close([a, b]) => format!("{} and {} stay close", name(a), name(b)),
        Condition::Narrow([a, b]) => format!("the gap between {} and {} stays narrow", name(a), name(b)),
        Condition::Dense => "the pile stays together".into(),
        Condition::Wide => "the objects move too far apart".into(),
        Condition::Position(k, Area::Workspace) => format!("{} leaves the workspace", name(k)),
        Condition::Position(k, Area::Table) => format!("{} falls off the table", name(k)),
        Condition::Position(k, Area::KeepOut) => format!("{} enters a keep-out area", name(k)),
        Condition::Grasp(k) => format!("the gripper finds no room around {}", name(k)),
        Condition::Moved(k) => format!("{} is moved", name(k)),
        Condition::Nothing => "the simulation of the strike does not finish".into(),
    }
}

/// The gain in success probability if each source of uncertainty were removed, on the same draws; the largest first.
///
/// `margins` are those of the strike with all sources, drawn with `seed`.
pub(crate) fn sensitivities(
    nominal: &Nominal,
    evaluation: &Evaluation,
    strike: &Strike,
    seed: u64,
    margins: &[GoalMargin],
) -> Result<Vec<Sensitivity>> {
    let margins = &margins[..SAMPLES.min(margins.len())];
    let probability = success_probability(margins);
    let mut found = Vec::new();
    for source in Source::ALL {
        let scenarios = nominal.scenarios(Draws { seed, count: margins.len(), fixed: Some(source) })?;
        let gain = success_probability(&evaluation.margins(strike, &scenarios)) - probability;
        found.push(Sensitivity { source, gain });
    }
    Ok(sorted_by_value(found, |sensitivity| -sensitivity.gain))
}
