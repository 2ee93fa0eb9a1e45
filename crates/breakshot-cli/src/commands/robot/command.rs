//! `breakshot command`: the joint path of a planned strike.

use super::touch;
use crate::args::CommandArgs;
use crate::{Outcome, console};
use breakshot::cell::Cell;
use breakshot::files::{self, Planned};
use breakshot::geometry::Point;
use breakshot::robot::{self, Answer, Command, ImpulseConditions, LimitCheck, MountedArm, Refusal};
use breakshot::scene::Scene;
use breakshot::{Result, physics, plan};
use serde::Serialize;
use std::path::Path;

/// Plans the joint path and writes it; a strike that the arm cannot execute is reported and ends doubtful.
pub(crate) fn run(args: &CommandArgs) -> Result<Outcome> {
    let cell = cell(args)?;
    if let Some(touches) = &args.touch {
        return touch::run(touches, &cell, args);
    }
    let Planned { strike, scene } = planned(args)?;
    let mounted = MountedArm::of_cell(&cell)?;
    if let Some(path) = &args.urdf {
        files::write_whole(path, mounted.arm().urdf().as_bytes())?;
    }
    if let Some(path) = &args.impulse {
        let figure = impulse_figure(&mounted, &cell, &impulse_conditions(scene.as_ref()));
        files::write_whole(path, figure.as_bytes())?;
    }
    if let Some(path) = &args.impulse_map {
        let map = robot::impulse_map(&mounted, &cell, &impulse_conditions(scene.as_ref()));
        files::write_whole(path, map.as_bytes())?;
    }
    match robot::command(&cell, &strike, scene.as_ref(), &robot::Options::default())? {
        Answer::Ready(command) => written(args, &command),
        Answer::Refused(refusal) => refused(args, &refusal),
    }
}

/// The cell with the arm of `--arm`, if given.
fn cell(args: &CommandArgs) -> Result<Cell> {
    let mut cell = files::load_cell(&args.cell)?;
    if let Some(arm) = &args.arm {
        let robot = cell.robot.get_or_insert_default();
        robot.arm.clone_from(arm);
        files::load_arm(robot)?;
    }
    Ok(cell)
}

/// The strike and the scene of the plan, or the scene of `--scene`.
fn planned(args: &CommandArgs) -> Result<Planned> {
    let path = args.plan.as_deref().unwrap_or(Path::new("plan.json"));
    match &args.scene {
        Some(scene) => {
            let scene = Some(files::load_scene(scene)?.value);
            Ok(Planned { strike: files::load_strike(path)?, scene })
        }
        None => files::load_planned(path),
    }
}

fn written(args: &CommandArgs, command: &Command) -> Result<Outcome> {
    files::write_json(&args.output, command)?;
    if let Some(path) = &args.ros {
        let goal = command.follow_joint_trajectory();
        if path.extension().is_some_and(|extension| extension == "json") {
            files::write_json(path, &goal)?;
        } else {
            files::write_whole(path, goal.yaml().as_bytes())?;
        }
    }
    if let Some(path) = &args.urscript {
        files::write_whole(path, command.urscript()?.as_bytes())?;
    }
    if let Some(path) = &args.mcap {
        let trajectory = match (&args.properties, &command.scene) {
            (Some(properties), Some(scene)) => {
                let properties = files::load_properties(properties)?;
                Some(physics::trajectory(scene, &properties, &command.strike, &plan::laws(scene)?)?)
            }
            _ => None,
        };
        files::write_whole(path, &command.recording(trajectory.as_ref())?.finished())?;
    }
    console::warn(&command.warnings);
    if args.json {
        console::print_json(&Summary::of(command))?;
    } else {
        print_summary(command);
        console::note(&command.safety_notes()?);
        println!("Wrote {}", args.output.display());
    }
    Ok(Outcome::Done)
}

fn refused(args: &CommandArgs, refusal: &Refusal) -> Result<Outcome> {
    if args.json {
        console::print_json(&serde_json::json!({ "outcome": "refused", "refusal": refusal }))?;
    } else {
        println!("refused: {}", refusal.reason);
        if let Some(fastest_m_s) = refusal.fastest_m_s {
            println!("the fastest that the joints' speeds allow on this line is {fastest_m_s:.2} m/s");
        }
    }
    Ok(Outcome::Doubtful)
}

/// The output of `--json`: everything except the samples.
#[derive(Serialize)]
struct Summary<'a> {
    outcome: &'static str,
    hash: String,
    arm: &'a str,
    stroke: &'a robot::Stroke,
    duration_s: f64,
    checks: &'a [LimitCheck],
    warnings: &'a [String],
}

impl<'a> Summary<'a> {
    fn of(command: &'a Command) -> Self {
        Self {
            outcome: "ready",
            hash: command.short_hash(),
            arm: &command.arm,
            stroke: &command.stroke,
            duration_s: command.duration_s(),
            checks: &command.checks,
            warnings: &command.warnings,
        }
    }
}

/// Prints a summary of the command.
pub(crate) fn print_summary(command: &Command) {
    let stroke = &command.stroke;
    println!(
        "{} would strike at {:.3} m/s (planned {:.3}), {:.2} s after it starts; hash {}",
        command.arm,
        stroke.contact_speed_m_s,
        command.strike.speed_m_s,
        stroke.contact_time_s,
        command.short_hash()
    );
    println!(
        "run-up {:.0} mm, stop {:.0} mm, at most {:.1} m/s2; the tip's effective mass is {:.2} kg, its energy {:.2} J",
        stroke.run_up_m * 1e3,
        stroke.stop_m * 1e3,
        stroke.acceleration_m_s2,
        stroke.effective_mass_kg,
        stroke.energy_j
    );
    for phase in &command.phases {
        let [from_s, to_s] = phase.span_s();
        println!("  {:<14} {from_s:>6.2} to {to_s:>6.2} s", phase.name.label());
    }
    println!("nearest to the limits:");
    for check in &command.checks {
        println!("  {}", check.sentence());
    }
}

/// An impact without restitution on the heaviest object, at the greatest speed of a strike.
fn impulse_conditions(scene: Option<&Scene>) -> ImpulseConditions {
    /// The mass of the paper's heaviest object (kg), used if no mass is known.
    const MASS_KG: f64 = 0.143;
    let masses = scene.into_iter().flat_map(|scene| &scene.objects).filter_map(|object| object.mass_kg);
    let heaviest_kg = masses.fold(0.0, f64::max);
    let object_mass_kg = if heaviest_kg > 0.0 { heaviest_kg } else { MASS_KG };
    ImpulseConditions { object_mass_kg, restitution: 0.0, speed_cap_m_s: robot::FASTEST_M_S }
}

/// Fig. 10 for the centres of the workspace's four quadrants.
fn impulse_figure(mounted: &MountedArm, cell: &Cell, conditions: &ImpulseConditions) -> String {
    let (min, max) = (cell.workspace.min_m, cell.workspace.max_m);
    let at = |x: f64, y: f64| Point::new(min.x + x * (max.x - min.x), min.y + y * (max.y - min.y));
    let points = [at(0.25, 0.25), at(0.75, 0.25), at(0.25, 0.75), at(0.75, 0.75)];
    let geometries: Vec<_> =
        points.iter().filter_map(|&point| mounted.impulse_geometry(point, conditions)).collect();
    robot::impulse_figure(&geometries)
}
