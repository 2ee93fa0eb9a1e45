//! Strike after strike: plan, carry out, look, plan again.

use super::options::Options;
use super::plan;
use super::result::Plan;
use super::robust::scenarios::{by_name, possible_worlds};
use crate::error::Result;
use crate::geometry::Pose;
use crate::outline::Outline;
use crate::physics::{self, Simulator, World};
use crate::properties::Properties;
use crate::scene::{Placed, Scene};
use crate::singulation::Singulation;
use std::collections::BTreeMap;

/// How a sequence of strikes went.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// Each strike's plan, its scene as it was seen before it.
    pub plans: Vec<Plan>,
    /// How the table was seen after the last strike.
    pub left: Scene,
    /// Whether the goal holds there.
    pub singulated: bool,
    /// How it ended, in words.
    pub reason: String,
}

/// Plans and strikes until the goal holds, nothing more can be done, or `most` strikes were made.
///
/// `carry_out` makes a plan's strike happen and tells how the table is seen afterwards; it may learn from the strike and
/// better the properties.
///
/// # Errors
/// Scenes that cannot be simulated, and whatever goes wrong while carrying out.
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

/// The scene after a plan's strike in a world drawn from what is not known: friction, restitution, masses and contacts from their
/// uncertainty, poses, speed and heading off by what the options say.  The same draw gives the same world.
///
/// # Errors
/// A scene that cannot be simulated.
pub fn drawn(plan: &Plan, properties: &Properties, options: &Options, draw: u64) -> Result<Scene> {
    let Some(strike) = &plan.strike else { return Ok(plan.scene.clone()) };
    let mean = World::new(&plan.scene, properties, &physics::Options::default())?;
    let worlds = possible_worlds((&plan.scene, properties, &mean), options, (draw, 1), None)?;
    let mut poses = BTreeMap::new();
    for possible in &worlds {
        let outcome = Simulator::new().run(&possible.world, &possible.executed(strike))?;
        poses.extend(by_name(&possible.world, &outcome.poses));
    }
    Ok(moved(&plan.scene, &poses))
}

/// The scene with its objects elsewhere.
fn moved(scene: &Scene, poses: &BTreeMap<String, Pose>) -> Scene {
    let place = |p: &Placed| {
        poses.get(&p.object).map_or_else(
            || p.clone(),
            |pose| Placed { object: p.object.clone(), position_m: pose.position, yaw_rad: pose.yaw_rad },
        )
    };
    Scene { placed: scene.placed.iter().map(place).collect(), ..scene.clone() }
}

fn fulfilled(scene: &Scene) -> Result<bool> {
    let poses: BTreeMap<_, _> = scene.placed.iter().map(|p| (p.object.clone(), p.pose())).collect();
    Ok(Singulation::of(scene, &poses)?.violations(&scene.goal).is_empty())
}

/// An object whose centre lies beyond the table's edge, or on it: it fell there.
fn fallen(scene: &Scene) -> Option<&str> {
    let table = Outline::polygon(&scene.cell.table.as_ref()?.outline_m);
    let lies = |p: &&Placed| !table.contains(p.position_m) || table.border_distance_m(p.position_m) < EDGE_M;
    scene.placed.iter().find(lies).map(|p| p.object.as_str())
}

/// A centre this close to the edge fell (m).
const EDGE_M: f64 = 1e-6;
