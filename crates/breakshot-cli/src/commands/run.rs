//! `breakshot run`: plan, strike, look, plan again, until the pile is singulated.
//!
//! Without a robot, each strike meets one of the tables that may be: what is not known exactly is drawn.  With one, two programs
//! of the user's stand for the cell: one carries a plan out, one looks.

use super::{plan, simulate};
use crate::args::RunArgs;
use crate::{Outcome, console};
use breakshot::plan::{self as planning, Options, Plan, Sequence};
use breakshot::properties::Properties;
use breakshot::scene::{Placed, Scene, Strike};
use breakshot::{Error, Result, files};
use serde::Serialize;
use std::path::Path;
use std::process::{Command, Stdio};

/// Runs the loop and writes what came of it.
pub(crate) fn run(args: &RunArgs) -> Result<Outcome> {
    let (scene, mut properties, outcome) = simulate::world(&args.scene, &args.properties, &args.assumptions)?;
    std::fs::create_dir_all(&args.output)
        .map_err(|source| Error::Write { path: args.output.clone(), source })?;
    let options = Options {
        method: args.method.into(),
        scatter: args.scatter.scatter(),
        seed: args.seed,
        ..Options::default()
    };
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
                run_program("--execute", execute, ("{plan}", &file))?;
                let seen = args.output.join(format!("scene_{number}.toml"));
                run_program("--look", look, ("{scene}", &seen))?;
                *properties = files::load_properties(&args.properties)?;
                let seen = files::load_scene(&seen)?;
                console::note(&seen.notes);
                Ok(seen_after(&plan.scene, seen.value))
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

/// What `run.json` holds.
#[derive(Serialize)]
struct Summary<'a> {
    version: u32,
    singulated: bool,
    reason: &'a str,
    /// The strikes that were carried out.
    strikes: Vec<&'a Strike>,
    /// How likely each was said to work, where the method can tell.
    success_probabilities: Vec<Option<f64>>,
    /// What lies where after the last one.
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

/// The places of what was seen, with the walls, areas and goal of the scene before.
fn seen_after(before: &Scene, seen: Scene) -> Scene {
    Scene { placed: seen.placed, observed_unix_s: seen.observed_unix_s, ..before.clone() }
}

/// Runs a program of the user's; what it prints goes to stderr, for stdout is ours.
fn run_program(flag: &str, command: &str, (holder, file): (&str, &Path)) -> Result<()> {
    let mut words = command.split_whitespace().map(|word| word.replace(holder, &file.to_string_lossy()));
    let program = words.next().unwrap_or_default();
    let failed = |found: String| Error::invalid(flag, "the program", found, "a program that ends with 0");
    let status = Command::new(&program)
        .args(words)
        .stdin(Stdio::null())
        .stdout(std::io::stderr())
        .status()
        .map_err(|e| failed(format!("`{program}`, which cannot be started ({e})")))?;
    if status.success() { Ok(()) } else { Err(failed(format!("`{program}`, which ended with {status}"))) }
}
