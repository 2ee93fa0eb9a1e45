//! What would help where no strike fulfils the goal in most scenarios?
//!
//! Each remedy changes one thing: the scene, the striker, the number of strikes, or what is known.  Changes of the scene are judged by the
//! success probability of the best strike that a short search finds on the changed scene, knowledge by that of the planned strike in
//! the same scenarios ([`Robustness::sensitivities`](super::Robustness::sensitivities)).

use super::options::{Method, Options};
use super::result::{Plan, Remedy, Source};
use super::robust::budget::Budget;
use super::robust::robust;
use super::sequence::{fallen, fulfilled, moved};
use super::{arm, feasibility};
use crate::error::Result;
use crate::geometry::Point;
use crate::physics::{self, World};
use crate::properties::{Properties, PropertyGroup};
use crate::scene::Scene;
use crate::statistics::sorted_by_value;

/// Least increase of the success probability by a remedy that is worth its trouble.
const LEAST_GAIN: f64 = 0.05;
/// Walls, and areas to keep out of, that are taken away one by one.
const MOST_OBSTACLES: usize = 6;
/// Factor of the sides of a wider workspace, of a faster striker's speed, and of a slower one's inverse speed.
const WORKSPACE_FACTOR: f64 = 1.25;
const FASTER_FACTOR: f64 = 2.0;
const SLOWER_FACTOR: f64 = 2.0;
/// Outcomes of the planned strike for which a second one is planned.
const OUTCOMES: usize = 4;

/// The changes that increase the success probability of a plan by at least [`LEAST_GAIN`], the most helpful first.
///
/// # Errors
/// A scene that cannot be simulated; a search that was stopped.
pub(crate) fn remedies(plan: &Plan, properties: &Properties, options: &Options) -> Result<Vec<Remedy>> {
    let attempt = Attempt { properties, options: Options { progress: None, ..*options } };
    let scene = &plan.scene;
    let known = plan.robustness.as_ref().map(|robustness| robustness.success_probability);
    let today = known.map_or_else(|| attempt.success_probability(scene), Ok)?;
    let mut found = Vec::new();
    found.extend(attempt.of_scenes(scene)?);
    found.extend(attempt.of_arm(scene)?);
    found.extend(attempt.of_a_second_strike(plan)?);
    found.extend(of_knowledge(plan));
    found.retain(|remedy| remedy.success_probability >= today + LEAST_GAIN);
    if plan.method == Method::Paper && today >= LEAST_GAIN {
        found.push(Remedy::new("the strike that the robust planner finds", today));
    }
    Ok(sorted_by_value(found, |remedy| -remedy.success_probability))
}

/// A short search for a strike.
struct Attempt<'a> {
    properties: &'a Properties,
    options: Options<'a>,
}

impl Attempt<'_> {
    /// The success probability of the best strike that a short search finds; zero if there is none.
    fn success_probability(&self, scene: &Scene) -> Result<f64> {
        self.success_probability_with(scene, &self.options)
    }

    fn success_probability_with(&self, scene: &Scene, options: &Options) -> Result<f64> {
        if feasibility::impossible(scene).is_some() {
            return Ok(0.0);
        }
        let properties = self.properties.completed_for(scene)?;
        let empty = Plan::unreachable(scene, Method::Robust);
        let planned = robust(empty, &properties, options, &Budget::SHORT)?;
        Ok(planned.robustness.map_or(0.0, |robustness| robustness.success_probability))
    }

    /// Obstacles elsewhere, a wider workspace, a faster and a slower striker.
    fn of_scenes(&self, scene: &Scene) -> Result<Vec<Remedy>> {
        let mut changed: Vec<(String, Scene)> = Vec::new();
        for k in 0..scene.walls.len().min(MOST_OBSTACLES) {
            let mut other = scene.clone();
            other.walls.remove(k);
            changed.push((format!("walls[{k}] at another place, or none"), other));
        }
        for k in 0..scene.keep_out.len().min(MOST_OBSTACLES) {
            let mut other = scene.clone();
            other.keep_out.remove(k);
            changed.push((format!("keep_out[{k}] at another place, or none"), other));
        }
        if scene.goal.inside_workspace {
            changed.push(wider(scene));
        }
        let [slowest_m_s, fastest_m_s] = scene.cell.striker.speed_range_m_s;
        let striker = |speed_range_m_s: [f64; 2]| {
            let mut other = scene.clone();
            other.cell.striker.speed_range_m_s = speed_range_m_s;
            other
        };
        let fast_m_s = fastest_m_s * FASTER_FACTOR;
        changed.push((format!("strikes of up to {fast_m_s:.2} m/s"), striker([slowest_m_s, fast_m_s])));
        let slow_m_s = slowest_m_s / SLOWER_FACTOR;
        changed.push((format!("pushes as slow as {slow_m_s:.3} m/s"), striker([slow_m_s, fastest_m_s])));
        let judged =
            |(change, scene): (String, Scene)| Ok(Remedy::new(change, self.success_probability(&scene)?));
        changed.into_iter().map(judged).collect()
    }

    /// An arm without limits, where the cell has one.
    fn of_arm(&self, scene: &Scene) -> Result<Option<Remedy>> {
        if arm::CellArm::of(scene, &self.options)?.is_none() {
            return Ok(None);
        }
        let any = Options { any_arm: true, ..self.options };
        let probability = self.success_probability_with(scene, &any)?;
        Ok(Some(Remedy::new("the arm's base at another place, or another arm", probability)))
    }

    /// A second strike after the first outcomes of the planned one.
    fn of_a_second_strike(&self, plan: &Plan) -> Result<Option<Remedy>> {
        let outcomes = plan.robustness.as_ref().map(|robustness| &robustness.final_poses);
        let Some(outcomes) = outcomes else { return Ok(None) };
        let count = outcomes.values().map(Vec::len).min().unwrap_or(0).min(OUTCOMES);
        let mut probabilities = Vec::new();
        for k in 0..count {
            let poses = outcomes.iter().map(|(name, poses)| (name.clone(), poses[k])).collect();
            let left = moved(&plan.scene, &poses);
            // Drawn poses can overlap what they lie beside
            let properties = self.properties.completed_for(&left)?;
            if World::new(&left, &properties, &physics::Options::default()).is_err() {
                continue;
            }
            probabilities.push(match fulfilled(&left)? {
                true => 1.0,
                false if fallen(&left).is_some() => 0.0,
                false => self.success_probability(&left)?,
            });
        }
        let mean = probabilities.iter().sum::<f64>() / probabilities.len() as f64;
        Ok((!probabilities.is_empty()).then(|| Remedy::new("one more strike", mean)))
    }
}

/// The scene with a larger workspace about the same centre.
fn wider(scene: &Scene) -> (String, Scene) {
    let mut other = scene.clone();
    let workspace = &mut other.cell.workspace;
    let (min_m, max_m) = (workspace.min_m, workspace.max_m);
    let margin_m = (max_m - min_m) * (0.5 * (WORKSPACE_FACTOR - 1.0));
    (workspace.min_m, workspace.max_m) =
        (Point::new(min_m.x - margin_m.x, min_m.y - margin_m.y), max_m + margin_m);
    let size_m = workspace.max_m - workspace.min_m;
    (format!("a workspace of {:.0} x {:.0} mm", size_m.x * 1e3, size_m.y * 1e3), other)
}

/// The planned strike if a source of its uncertainty were known exactly, with the film that would show it.
fn of_knowledge(plan: &Plan) -> Vec<Remedy> {
    let Some(robustness) = &plan.robustness else { return Vec::new() };
    let remedy = |source: Source, gain: f64| {
        let change = match source {
            Source::Poses => "exactly observed poses of the objects".to_owned(),
            Source::Strike => "strikes of exactly the planned speed and heading".to_owned(),
            Source::Friction | Source::Restitution | Source::Masses | Source::Contacts => {
                format!("films that show {} exactly: {}", source.words(), film(plan, source))
            }
        };
        Remedy::new(change, robustness.success_probability + gain)
    };
    robustness.sensitivities.iter().map(|s| remedy(s.source, s.gain)).collect()
}

/// The clip that would show a source of uncertainty: that of a property that nobody measured, if there is one.
fn film(plan: &Plan, source: Source) -> String {
    let is_of = |group: PropertyGroup| match source {
        Source::Friction => group == PropertyGroup::Friction,
        Source::Masses => group == PropertyGroup::MassRatio,
        Source::Restitution => {
            matches!(group, PropertyGroup::Restitution | PropertyGroup::StrikerRestitution)
        }
        Source::Poses | Source::Strike | Source::Contacts => false,
    };
    match plan.assumed.iter().find(|assumption| is_of(assumption.quantity)) {
        Some(assumption) => assumption.clip.clone(),
        None if source == Source::Contacts => "impacts far off the centre".into(),
        None => "more clips of these objects".into(),
    }
}
