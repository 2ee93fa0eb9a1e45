//! How is a pile singulated with several strikes?  Plan, execute, observe, and plan again.

use super::arm::{CellArm, laws_with};
use super::options::Options;
use super::plan;
use super::result::Plan;
use super::robust::scenarios::{Draws, Nominal};
use crate::error::Result;
use crate::geometry::Pose;
use crate::geometry::outline::Outline;
use crate::physics::Simulator;
use crate::properties::Properties;
use crate::scene::singulation::Singulation;
use crate::scene::{Placed, Scene};
use std::collections::BTreeMap;

/// The plans of a sequence of strikes and its result.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Sequence {
    /// The plan of each strike, with the scene observed before it.
    pub plans: Vec<Plan>,
    /// The scene observed after the last strike.
    pub left: Scene,
    /// Whether the goal holds there.
    pub singulated: bool,
    /// The reason for the end, a sentence.
    pub reason: String,
}

/// Plans and strikes until the goal holds, no strike is possible, or `most` strikes were made.
///
/// `carry_out` executes the strike of a plan and returns the scene observed afterwards; it may update the properties.
///
/// # Errors
/// Scenes that cannot be simulated, and the errors of `carry_out`.
pub fn sequence(
    scene: &Scene,
    properties: &mut Properties,
    options: &Options,
    most: usize,
    carry_out: &mut dyn FnMut(&Plan, &mut Properties) -> Result<Scene>,
) -> Result<Sequence> {
    let mut left = scene.clone();
    let mut plans = Vec::new();
    loop {
        if fulfilled(&left)? {
            let reason = format!("the goal holds after {}", strikes(plans.len()));
            return Ok(Sequence { plans, left, singulated: true, reason });
        }
        let ended = |reason: String, plans, left| Ok(Sequence { plans, left, singulated: false, reason });
        if plans.len() == most {
            return ended(format!("the goal does not hold after {}", strikes(most)), plans, left);
        }
        if let Some(fallen) = fallen(&left) {
            return ended(format!("{fallen} has fallen off the table"), plans, left);
        }
        let planned =
            plan(&left, properties, &Options { seed: options.seed + plans.len() as u64, ..*options })?;
        if planned.strike.is_none() {
            let reason = format!("after {}: {}", strikes(plans.len()), planned.reason);
            return ended(reason, plans, left);
        }
        left = carry_out(&planned, properties)?;
        plans.push(planned);
    }
}

fn strikes(count: usize) -> String {
    if count == 1 { "1 strike".into() } else { format!("{count} strikes") }
}

/// The scene that a plan expects after its strike, with the properties at their means.
pub fn expected(plan: &Plan) -> Scene {
    let poses = plan.prediction.as_ref().map(|p| p.final_poses.clone()).unwrap_or_default();
    moved(&plan.scene, &poses)
}

/// The scene after the strike of a plan in a drawn world: friction, restitution, masses and contacts from their uncertainty, poses,
/// speed and heading with the noise of the options.  The same draw gives the same world.
///
/// # Errors
/// A scene that cannot be simulated.
pub fn drawn(plan: &Plan, properties: &Properties, options: &Options, draw: u64) -> Result<Scene> {
    let Some(strike) = &plan.strike else { return Ok(plan.scene.clone()) };
    let laws = laws_with(CellArm::of(&plan.scene, options)?.as_ref());
    let nominal = Nominal::new(&plan.scene, properties, options.noise, &laws)?;
    let scenarios = nominal.scenarios(Draws { seed: draw, count: 1, fixed: None })?;
    let mut poses = BTreeMap::new();
    for scenario in &scenarios {
        let outcome = Simulator::new().run(&scenario.world, &scenario.executed(strike))?;
        poses.extend(scenario.world.by_name(&outcome.poses));
    }
    Ok(moved(&plan.scene, &poses))
}

/// The scene with its objects at other poses.
pub(super) fn moved(scene: &Scene, poses: &BTreeMap<String, Pose>) -> Scene {
    let placed = |p: &Placed| {
        poses.get(&p.object).map_or_else(
            || p.clone(),
            |pose| Placed { object: p.object.clone(), position_m: pose.position, yaw_rad: pose.yaw_rad },
        )
    };
    Scene { placed: scene.placed.iter().map(placed).collect(), ..scene.clone() }
}

/// Whether the goal holds without another strike.
pub(super) fn fulfilled(scene: &Scene) -> Result<bool> {
    Ok(Singulation::of(scene, &scene.poses())?.violations().is_empty())
}

/// An object whose centre is past the table's edge or on it, where a simulation leaves a fallen object.
pub(super) fn fallen(scene: &Scene) -> Option<&str> {
    let table = Outline::polygon(&scene.cell.table.as_ref()?.outline_m);
    let past_edge =
        |p: &&Placed| !table.contains(p.position_m) || table.border_distance_m(p.position_m) < EDGE_M;
    scene.placed.iter().find(past_edge).map(|p| p.object.as_str())
}

/// Distance to the edge within which an object counts as fallen (m).
const EDGE_M: f64 = 1e-6;
