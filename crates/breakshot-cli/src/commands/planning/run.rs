//! `breakshot run`: plans, executes and observes strikes until the pile is singulated.
//!
//! Without a robot, each strike is simulated with properties and poses drawn from their distributions.  With a robot, one
//! program of the user executes a plan, and another one observes the table.

use super::plan;
use super::simulate::{self, SimulationInputs};
use crate::args::RunArgs;
use crate::commands::report::verify;
use crate::{Outcome, console};
use breakshot::plan::{self as planning, Plan, Sequence};
use breakshot::properties::Properties;
use breakshot::scene::{Placed, Scene, Strike};
use breakshot::{Error, Result, files};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Stdio};

/// Runs the loop and writes its result.
pub(crate) fn run(args: &RunArgs) -> Result<Outcome> {
    let SimulationInputs { scene, mut properties, measured, outcome } =
        simulate::inputs(&args.scene, &args.properties, &args.assumptions)?;
    std::fs::create_dir_all(&args.output)
        .map_err(|source| Error::Write { path: args.output.clone(), source })?;
    let options = args.planner.options(&scene.cell);
    let mut robot = Robot { args, measured, outcome };
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
                *properties = robot.execute(execute, plan, number)?;
                robot.look(look, &plan.scene, number)
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
    Ok(robot.outcome.and(Outcome::doubtful_if(!ended.singulated)))
}

/// A robot that programs of the user operate, and what was learned from its strikes.
struct Robot<'a> {
    args: &'a RunArgs,
    /// The properties without assumed values.
    measured: Properties,
    outcome: Outcome,
}

impl Robot<'_> {
    /// Executes a plan; the properties for the next one.
    fn execute(&mut self, command: &str, plan: &Plan, number: u64) -> Result<Properties> {
        let in_folder = |name: String| self.args.output.join(name);
        let file = in_folder(format!("plan_{number}.json"));
        let recordings = [("{tracks}", "csv"), ("{film}", "mp4")]
            .map(|(placeholder, extension)| (placeholder, in_folder(format!("strike_{number}.{extension}"))));
        let recorded = recordings.iter().find(|(placeholder, _)| command.contains(placeholder));
        if let Some((_, recording)) = recorded {
            // Of an earlier run
            remove(recording)?;
        }
        let [(tracks, tracks_file), (film, film_file)] = &recordings;
        let files = [("{plan}", &*file), (*tracks, &**tracks_file), (*film, &**film_file)];
        UserProgram { flag: "--execute", command, files: &files }.run()?;
        match recorded {
            Some((_, recording)) => self.learn(plan, recording, number)?,
            None => self.measured = files::load_properties(&self.args.properties)?,
        }
        simulate::completed(&plan.scene, &self.measured, &self.args.assumptions)
    }

    /// Adds the measurements of a strike to the properties; a recording that shows nothing is a warning.
    fn learn(&mut self, plan: &Plan, recording: &Path, number: u64) -> Result<()> {
        let Some(strike) = &plan.strike else { return Ok(()) };
        let (args, scene) = (self.args, &plan.scene);
        let tracks = verify::observed_strike(recording, (args.rate, args.decoder), scene);
        let learned = tracks.and_then(|observed| {
            let mut clip = verify::clip(recording, observed.tracks, strike, scene);
            clip.name = unused_name(&clip.name, &self.measured);
            verify::learned(&self.measured, clip, scene)
        });
        match learned {
            Ok(learned) => {
                files::write_json(
                    &args.output.join(format!("properties_{number}.json")),
                    &learned.properties,
                )?;
                self.measured = learned.properties;
                self.outcome = self.outcome.and(learned.outcome);
            }
            Err(error) => {
                console::warn(&[format!("nothing is learned from strike {number}: {error}")]);
                self.outcome = self.outcome.and(Outcome::Doubtful);
            }
        }
        Ok(())
    }

    /// The scene after a strike.
    fn look(&self, command: &str, before: &Scene, number: u64) -> Result<Scene> {
        let observed = self.args.output.join(format!("scene_{number}.toml"));
        UserProgram { flag: "--look", command, files: &[("{scene}", &observed)] }.run()?;
        let observed = files::load_scene(&observed)?;
        console::note(&observed.notes);
        Ok(with_observed_poses(before, observed.value))
    }
}

/// The name of a clip with a number behind it if the evidence has a clip of that name: every run names its recordings equally.
fn unused_name(name: &str, measured: &Properties) -> String {
    let clips = measured.evidence.iter().flat_map(|evidence| &evidence.clips);
    let used: BTreeSet<&str> = clips.map(|record| &*record.clip).collect();
    let mut candidate = name.to_owned();
    for number in 2.. {
        if !used.contains(&*candidate) {
            break;
        }
        candidate = format!("{name} ({number})");
    }
    candidate
}

/// Removes a file that may not be there.
fn remove(file: &Path) -> Result<()> {
    match std::fs::remove_file(file) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::Write { path: file.into(), source })
        }
        _ => Ok(()),
    }
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
    /// The texts in the arguments that are replaced by the paths of files.
    files: &'a [(&'a str, &'a Path)],
}

impl UserProgram<'_> {
    /// Runs the program and waits for its end; its standard output is redirected to stderr, because stdout is reserved
    /// for the result of breakshot.
    fn run(&self) -> Result<()> {
        let replaced = |word: &str| {
            let replace =
                |word: String, (text, file): &(&str, &Path)| word.replace(text, &file.to_string_lossy());
            self.files.iter().fold(word.to_owned(), replace)
        };
        let mut words = self.command.split_whitespace().map(replaced);
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
