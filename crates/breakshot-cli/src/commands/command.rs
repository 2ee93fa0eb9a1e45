//! `breakshot command`: the joint path of a planned strike.

use super::touch;
use crate::args::CommandArgs;
use crate::{Outcome, console};
use breakshot::cell::Cell;
use breakshot::geometry::Point;
use breakshot::plan::Plan;
use breakshot::robot::{self, Answer, Check, Command, Hit, Refusal, Station};
use breakshot::scene::{Scene, Strike};
use breakshot::{Result, files, physics};
use serde::Serialize;
use std::path::Path;

/// Plans the joint path and writes it; a strike that the arm cannot carry out is told and ends doubtful.
pub(crate) fn run(args: &CommandArgs) -> Result<Outcome> {
    if let Some(touches) = &args.touch {
        return touch::run(touches, args);
    }
    let cell = cell(args)?;
    let (strike, scene) = planned(args)?;
    let station = Station::of_cell(&cell)?;
    if let Some(path) = &args.urdf {
        files::write_whole(path, station.arm().urdf().as_bytes())?;
    }
    if let Some(path) = &args.impulse {
        files::write_whole(path, impulse_figure(&station, &cell, scene.as_ref()).as_bytes())?;
    }
    match robot::command(&cell, &strike, scene.as_ref(), &robot::Options::default())? {
        Answer::Ready(command) => written(args, &command),
        Answer::Refused(refusal) => refused(args, &refusal),
    }
}

/// The cell with the arm that was asked for.
pub(crate) fn cell(args: &CommandArgs) -> Result<Cell> {
    let mut cell = files::load_cell(&args.cell)?;
    if let Some(arm) = &args.arm {
        cell.robot.get_or_insert_default().arm.clone_from(arm);
    }
    Ok(cell)
}

/// The strike, and what lies on the table if anything tells.
fn planned(args: &CommandArgs) -> Result<(Strike, Option<Scene>)> {
    let path = args.plan.as_deref().unwrap_or(Path::new("plan.json"));
    let strike = files::load_strike(path)?;
    if let Some(scene) = &args.scene {
        return Ok((strike, Some(files::load_scene(scene)?.value)));
    }
    let value: serde_json::Value = files::read_json(path)?;
    let scene = if value.get("scene").is_some() { Some(files::read_json::<Plan>(path)?.scene) } else { None };
    Ok((strike, scene))
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
                let options = physics::Options::default();
                Some(physics::trajectory(scene, &properties, &command.strike, &options)?)
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

/// What `--json` prints: all but the samples.
#[derive(Serialize)]
struct Summary<'a> {
    outcome: &'static str,
    hash: String,
    arm: &'a str,
    stroke: &'a robot::Stroke,
    duration_s: f64,
    checks: &'a [Check],
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

/// What the arm would do, in a few lines.
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
        "run-up {:.0} mm, stop {:.0} mm, at most {:.1} m/s2; the tip feels like {:.2} kg and carries {:.2} J",
        stroke.run_up_m * 1e3,
        stroke.stop_m * 1e3,
        stroke.acceleration_m_s2,
        stroke.effective_mass_kg,
        stroke.energy_j
    );
    for phase in &command.phases {
        let [from_s, to_s] = phase.span_s();
        println!("  {:<14} {from_s:>6.2} to {to_s:>6.2} s", phase.name.text());
    }
    println!("nearest to the limits:");
    for check in &command.checks {
        println!("  {}", check.sentence());
    }
}

/// Fig. 10 for the middles of the workspace's four quarters.
fn impulse_figure(station: &Station, cell: &Cell, scene: Option<&Scene>) -> String {
    /// The paper's heaviest object (kg), where no weight is known.
    const MASS_KG: f64 = 0.143;
    let masses = scene.into_iter().flat_map(|scene| &scene.objects).filter_map(|object| object.mass_kg);
    let heaviest_kg = masses.fold(0.0, f64::max);
    let object_mass_kg = if heaviest_kg > 0.0 { heaviest_kg } else { MASS_KG };
    let hit = Hit { object_mass_kg, restitution: 0.0, speed_cap_m_s: robot::FASTEST_M_S };
    let (min, max) = (cell.workspace.min_m, cell.workspace.max_m);
    let at = |x: f64, y: f64| Point::new(min.x + x * (max.x - min.x), min.y + y * (max.y - min.y));
    let places = [at(0.25, 0.25), at(0.75, 0.25), at(0.25, 0.75), at(0.75, 0.75)];
    let geometries: Vec<_> =
        places.iter().filter_map(|&place| station.impulse_geometry(place, &hit)).collect();
    robot::impulse_figure(&geometries)
}
