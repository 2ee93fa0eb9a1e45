//! The breakshot command line: reads files, calls the library and writes files.

#[macro_use]
mod terminal;

mod args;
mod campaign_args;
mod check_args;
mod commands;
mod console;
mod decoder_args;
mod detect_args;
mod laws;
mod outcome;
mod planning;
mod recording;
mod studio_args;

pub(crate) use outcome::Outcome;

use args::{Arguments, Command};
use breakshot::capture::is_decoding;
use breakshot::{Error, Result, files};
use clap::Parser;
use std::panic::{set_hook, take_hook};
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    quiet_decoder_panics();
    let result = check_arguments().and_then(|()| run());
    let result = result.and_then(|outcome| match terminal::failure() {
        Some(source) => Err(Error::Write { path: "stdout".into(), source }),
        None => Ok(outcome),
    });
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Doubtful) => ExitCode::from(3),
        Ok(Outcome::Failed) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            // An output file that cannot be written is a failure (1); every other error is caused by the input (2).
            ExitCode::from(if matches!(error, Error::Write { .. }) { 1 } else { 2 })
        }
    }
}

/// A panic of the built-in decoder becomes an error that names the film: it is not reported twice.
fn quiet_decoder_panics() {
    let previous = take_hook();
    set_hook(Box::new(move |panic| {
        if !is_decoding() {
            previous(panic);
        }
    }));
}

/// Checks that every name in the arguments can be shown on one line.
fn check_arguments() -> Result<()> {
    std::env::args_os().try_for_each(|argument| files::check_file_name(Path::new(&argument)))
}

fn run() -> Result<Outcome> {
    let arguments = Arguments::parse();
    match arguments.command {
        Command::Demo(args) => commands::report::demo::run(&args),
        Command::Init(args) => commands::capture::init::run(&args),
        Command::Tags(args) => commands::capture::tags::run(&args),
        Command::Lens(args) => commands::capture::lens::run(&args),
        Command::Calibrate(args) => commands::capture::calibrate::run(&args),
        Command::Objects(args) => commands::detection::objects::run(&args),
        Command::Film(args) => commands::capture::film::run(&args),
        Command::Look(args) => commands::detection::look::run(&args),
        Command::Campaign(args) => commands::estimation::campaign::run(&args),
        Command::Check(args) => commands::estimation::check::run(&args),
        Command::Detect(args) => commands::detection::detect::run(&args),
        Command::Estimate(args) => commands::estimation::estimate::run(&args),
        Command::Simulate(args) => commands::planning::simulate::run(&args),
        Command::Plan(args) => commands::planning::plan::run(&args),
        Command::Run(args) => commands::planning::run::run(&args),
        Command::Arm(args) => commands::robot::command::run(&args),
        Command::Strike(args) => commands::robot::strike::run(&args),
        Command::Export(args) => commands::planning::export::run(&args),
        Command::Verify(args) => commands::report::verify::run(&args),
        Command::FilmReport(args) => commands::report::film_report::run(&args),
        Command::Studio(args) => commands::report::studio::run(&args),
        #[cfg(feature = "manual")]
        Command::Manual(args) => commands::manual::run(&args),
    }
}
