//! `breakshot simulate`: the outcome of one strike on a pile.

use crate::args::SimulateArgs;
use crate::laws::Assumptions;
use crate::{Outcome, console};
use breakshot::physics::{self, Trajectory};
use breakshot::plan;
use breakshot::properties::Properties;
use breakshot::scene::Scene;
use breakshot::scene::singulation::Singulation;
use breakshot::{Result, files};
use std::path::Path;

/// Simulates the strike and writes the trajectory.
pub(crate) fn run(args: &SimulateArgs) -> Result<Outcome> {
    let SimulationInputs { scene, properties, outcome, .. } =
        inputs(&args.scene, &args.properties, &args.assumptions)?;
    let strike = files::load_strike(&args.strike)?;
    let options = args.laws.options(plan::laws(&scene)?);
    let trajectory = physics::trajectory(&scene, &properties, &strike, &options)?;
    console::warn(&trajectory.notes);
    files::write_json(&args.output, &trajectory)?;
    if args.json {
        console::print_json(&Summary::of(&scene, &trajectory)?)?;
    } else {
        print_table(&trajectory);
        println!("Wrote {}", args.output.display());
    }
    Ok(outcome.and(Outcome::doubtful_if(!trajectory.complete)))
}

/// The files that simulations and plans need.
pub(crate) struct SimulationInputs {
    pub(crate) scene: Scene,
    /// The properties with assumed values for what was not measured.
    pub(crate) properties: Properties,
    /// The properties as they are in the file.
    pub(crate) measured: Properties,
    /// Doubtful if a value was assumed.
    pub(crate) outcome: Outcome,
}

/// Loads the scene and the properties, adds assumed values for what was not measured, and prints them.
pub(crate) fn inputs(scene: &Path, properties: &Path, assumptions: &Assumptions) -> Result<SimulationInputs> {
    let scene = files::load_scene(scene)?;
    console::note(&scene.notes);
    assumed(scene.value, files::load_properties(properties)?, assumptions)
}

/// Adds assumed values for what was not measured, and prints them.
pub(crate) fn assumed(
    scene: Scene,
    measured: Properties,
    assumptions: &Assumptions,
) -> Result<SimulationInputs> {
    let properties = completed(&scene, &measured, assumptions)?;
    console::assumed(&properties.assumed);
    let outcome = Outcome::doubtful_if(!properties.assumed.is_empty());
    Ok(SimulationInputs { scene, properties, measured, outcome })
}

/// The properties with assumed values for what was not measured.
pub(crate) fn completed(
    scene: &Scene,
    measured: &Properties,
    assumptions: &Assumptions,
) -> Result<Properties> {
    let mut properties = measured.clone();
    if let Some(restitution) = assumptions.assume_restitution {
        let names: Vec<String> = scene.placed.iter().map(|p| p.object.clone()).collect();
        properties.assume_restitution(&names, restitution)?;
    }
    Ok(properties.completed_for(scene)?.into_owned())
}

/// The output of `--json`.
#[derive(serde::Serialize)]
struct Summary<'a> {
    #[serde(rename = "final")]
    final_poses: &'a std::collections::BTreeMap<String, breakshot::geometry::Pose>,
    min_distance_m: Option<f64>,
    mean_distance_m: Option<f64>,
    duration_s: f64,
}

impl<'a> Summary<'a> {
    fn of(scene: &Scene, trajectory: &'a Trajectory) -> Result<Self> {
        let singulation = Singulation::of(scene, &trajectory.final_poses)?;
        Ok(Self {
            final_poses: &trajectory.final_poses,
            min_distance_m: singulation.min_distance_m(),
            mean_distance_m: singulation.mean_distance_m(),
            duration_s: trajectory.duration_s,
        })
    }
}

fn print_table(trajectory: &Trajectory) {
    println!("{:<10} {:>9} {:>9} {:>9}", "object", "x (mm)", "y (mm)", "yaw (deg)");
    for (object, pose) in &trajectory.final_poses {
        let (x, y) = (pose.position.x * 1e3, pose.position.y * 1e3);
        println!("{object:<10} {x:>9.1} {y:>9.1} {:>9.1}", pose.yaw_rad.to_degrees());
    }
    let end = if trajectory.complete { "all at rest" } else { "given up" };
    println!("{end} after {:.2} s", trajectory.duration_s);
}
