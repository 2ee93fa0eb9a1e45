//! The breakshot command line: reads files, calls the library and writes files.

mod args;
mod commands;
mod console;
mod laws;
mod outcome;
mod planning;

pub(crate) use outcome::Outcome;

use args::{Arguments, Command};
use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let result = match arguments.command {
        Command::Demo(args) => commands::demo::run(&args),
        Command::Init(args) => commands::init::run(&args),
        Command::Tags(args) => commands::tags::run(&args),
        Command::Calibrate(args) => commands::calibrate::run(&args),
        Command::Look(args) => commands::look::run(&args),
        Command::Detect(args) => commands::detect::run(&args),
        Command::Estimate(args) => commands::estimate::run(&args),
        Command::Simulate(args) => commands::simulate::run(&args),
        Command::Plan(args) => commands::plan::run(&args),
        Command::Run(args) => commands::run::run(&args),
        Command::Arm(args) => commands::command::run(&args),
        Command::Strike(args) => commands::strike::run(&args),
        Command::Export(args) => commands::export::run(&args),
        Command::Verify(args) => commands::verify::run(&args),
    };
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Doubtful) => ExitCode::from(3),
        Ok(Outcome::Failed) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            // An output file that cannot be written is a failure (1); every other error is caused by the input (2).
            ExitCode::from(if matches!(error, breakshot::Error::Write { .. }) { 1 } else { 2 })
        }
    }
}
