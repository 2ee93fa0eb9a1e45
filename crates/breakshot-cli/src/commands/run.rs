//! `breakshot run`: plans, executes and observes strikes until the pile is singulated.
//!
//! Without a robot, each strike is simulated with properties and poses drawn from their distributions.  With a robot, one
//! program of the user executes a plan, and another one observes the table.

use super::plan;
use super::simulate::{self, SimulationInputs};
use crate::args::RunArgs;
use crate::{Outcome, console};
use breakshot::plan::{self as planning, Plan, Sequence};
use breakshot::properties::Properties;
use breakshot::scene::{Placed, Scene, Strike};
use breakshot::{Error, Result, files};
use serde::Serialize;
use std::path::Path;
use std::process::{Command, Stdio};

/// Runs the loop and writes its result.
pub(crate) fn run(args: &RunArgs) -> Result<Outcome> {
    let SimulationInputs { scene, mut properties, outcome, .. } =
        simulate::inputs(&args.scene, &args.properties, &args.assumptions)?;
    std::fs::create_dir_all(&args.output)
        .map_err(|source| Error::Write { path: args.output.clone(), source })?;
    let options = args.planner.options(&scene.cell);
    let mut number = 0;
    let mut carry_out = |plan: &Plan, properties: &mut Properties| {
        number += 1;
        let file = args.output.join(format!("plan_{number}.json"));
        files::write_json(&file, plan)?;
        if !args.json {
            print!("{number}. ");
            plan::print_summary(plan);
        }
        match (&args.execute, &args.look) {
            (Some(execute), Some(look)) => {
                UserProgram { flag: "--execute", command: execute, placeholder: "{plan}" }.run(&file)?;
                let observed = args.output.join(format!("scene_{number}.toml"));
                UserProgram { flag: "--look", command: look, placeholder: "{scene}" }.run(&observed)?;
                *properties = files::load_properties(&args.properties)?;
                let observed = files::load_scene(&observed)?;
                console::note(&observed.notes);
                Ok(with_observed_poses(&plan.scene, observed.value))
            }
            _ => planning::drawn(plan, properties, &options, args.table.wrapping_add(number)),
        }
    };
    let strikes = args.strikes as usize;
    let ended = planning::sequence(&scene, &mut properties, &options, strikes, &mut carry_out)?;
    let summary = Summary::of(&ended);
    let file = args.output.join("run.json");
    files::write_json(&file, &summary)?;
    if args.json {
        console::print_json(&summary)?;
    } else {
        println!("{}: {}", if ended.singulated { "singulated" } else { "not singulated" }, ended.reason);
        println!("Wrote {}", file.display());
    }
    Ok(outcome.and(Outcome::doubtful_if(!ended.singulated)))
}

/// The contents of `run.json`.
#[derive(Serialize)]
struct Summary<'a> {
    version: u32,
    singulated: bool,
    reason: &'a str,
    /// The executed strikes.
    strikes: Vec<&'a Strike>,
    /// The predicted success probability of each strike; null for the paper's method.
    success_probabilities: Vec<Option<f64>>,
    /// The poses after the last strike.
    placed: &'a [Placed],
}

impl<'a> Summary<'a> {
    fn of(ended: &'a Sequence) -> Self {
        let stated = |plan: &Plan| plan.prediction.as_ref()?.success_probability;
        Self {
            version: 1,
            singulated: ended.singulated,
            reason: &ended.reason,
            strikes: ended.plans.iter().filter_map(|p| p.strike.as_ref()).collect(),
            success_probabilities: ended.plans.iter().map(stated).collect(),
            placed: &ended.left.placed,
        }
    }
}

/// The scene before a strike with the poses that were observed after it.
fn with_observed_poses(before: &Scene, observed: Scene) -> Scene {
    Scene { placed: observed.placed, observed_unix_s: observed.observed_unix_s, ..before.clone() }
}

/// A program of the user, started without a shell.
struct UserProgram<'a> {
    /// The flag that names it.
    flag: &'a str,
    /// The program and its arguments, separated by spaces.
    command: &'a str,
    /// The text in the arguments that is replaced by the path of a file.
    placeholder: &'a str,
}

impl UserProgram<'_> {
    /// Runs the program and waits for its end; its standard output is redirected to stderr, because stdout is reserved
    /// for the result of breakshot.
    fn run(&self, file: &Path) -> Result<()> {
        let file = file.to_string_lossy();
        let mut words = self.command.split_whitespace().map(|word| word.replace(self.placeholder, &file));
        let program = words.next().unwrap_or_default();
        let failed =
            |found: String| Error::invalid(self.flag, "the program", found, "a program that ends with 0");
        let status = Command::new(&program)
            .args(words)
            .stdin(Stdio::null())
            .stdout(std::io::stderr())
            .status()
            .map_err(|e| failed(format!("`{program}`, which cannot be started ({e})")))?;
        if status.success() { Ok(()) } else { Err(failed(format!("`{program}`, which ended with {status}"))) }
    }
}
