//! The breakshot command line: reads files, calls the library and writes files.

mod args;
mod commands;
mod console;

use args::{Arguments, Command};
use clap::Parser;
use std::process::ExitCode;

/// The outcome of a command that returned no error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Outcome {
    /// Done.
    Done,
    /// Done, with warnings that the user should read.
    Doubtful,
    /// Not done: the robot cannot be reached or had to be stopped.
    Failed,
}

impl Outcome {
    /// Doubtful if the condition holds, otherwise done.
    pub(crate) fn doubtful_if(doubtful: bool) -> Self {
        if doubtful { Self::Doubtful } else { Self::Done }
    }

    /// The worse of the two.
    pub(crate) fn and(self, other: Self) -> Self {
        self.max(other)
    }
}

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
