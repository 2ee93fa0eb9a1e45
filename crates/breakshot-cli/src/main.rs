//! The breakshot command line: files in, files out.  The physics is in the library; here are only its doors.

mod args;
mod commands;
mod console;

use args::{Arguments, Command};
use clap::Parser;
use std::process::ExitCode;

/// How a command that did not fail ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Outcome {
    /// Done.
    Done,
    /// Done, but the user should look at the warnings.
    Doubtful,
    /// Not done: a robot that cannot be reached, or that had to be stopped.
    Failed,
}

impl Outcome {
    /// Doubtful if there is anything to look at.
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
            // A result that cannot be written is the machine's fault or ours; all else is the input's.
            ExitCode::from(if matches!(error, breakshot::Error::Write { .. }) { 1 } else { 2 })
        }
    }
}
