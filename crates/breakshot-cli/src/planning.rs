//! The flags of planning: method, seed, arm, noise of poses and strike, and the evaluation of strikes over the whole grid.

use crate::console;
use breakshot::cell::Cell;
use breakshot::plan::{ExecutionNoise, Method, Options};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// The planning methods.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum MethodName {
    /// The method of the paper: feedback on the speed of the strike, with the mean properties.
    Paper,
    /// The strike with the highest success probability over all uncertain quantities.
    Robust,
}

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::Paper => Self::Paper,
            MethodName::Robust => Self::Robust,
        }
    }
}

/// How to plan a strike.
#[derive(Debug, Args)]
pub(crate) struct PlannerArgs {
    /// The planning method.
    #[arg(long, value_enum, default_value = "robust")]
    method: MethodName,
    /// The random seed; the same seed gives the same plan (method `robust`).
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Plans also strikes that the arm of the cell's [robot] section cannot execute.
    #[arg(long)]
    any_arm: bool,
    #[command(flatten)]
    noise: NoiseArgs,
}

impl PlannerArgs {
    /// The planner's options; prints a note if the arm is left out because its base pose is unknown.
    pub(crate) fn options(&self, cell: &Cell) -> Options<'static> {
        if !self.any_arm && cell.robot.as_ref().is_some_and(|robot| robot.base_from_table.is_none()) {
            console::note(&["the cell's [robot] has no base_from_table: the plan leaves the arm out".into()]);
        }
        Options {
            method: self.method.into(),
            seed: self.seed,
            any_arm: self.any_arm,
            noise: self.noise.noise(),
            ..Options::default()
        }
    }
}

/// Standard deviations of the poses in the scene and of the execution of the strike (method `robust`).
#[derive(Debug, Args)]
struct NoiseArgs {
    /// Standard deviation of an object's position along each axis (m).
    #[arg(long, value_name = "M", default_value_t = ExecutionNoise::default().position_m)]
    position_std_m: f64,
    /// Standard deviation of an object's yaw (rad).
    #[arg(long, value_name = "RAD", default_value_t = ExecutionNoise::default().yaw_rad)]
    yaw_std_rad: f64,
    /// Standard deviation of the speed of the strike, as a fraction of the speed.
    #[arg(long, value_name = "PART", default_value_t = ExecutionNoise::default().speed)]
    speed_std: f64,
    /// Standard deviation of the heading of the strike (rad).
    #[arg(long, value_name = "RAD", default_value_t = ExecutionNoise::default().heading_rad)]
    heading_std_rad: f64,
}

impl NoiseArgs {
    fn noise(&self) -> ExecutionNoise {
        ExecutionNoise {
            position_m: self.position_std_m,
            yaw_rad: self.yaw_std_rad,
            speed: self.speed_std,
            heading_rad: self.heading_std_rad,
        }
    }
}

/// The evaluation of strikes over the whole grid.
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("surveyed").args(["survey", "map"]).multiple(true))]
pub(crate) struct SurveyArgs {
    /// Evaluates strikes on every object from all directions and writes their success probabilities (JSON).
    #[arg(long, value_name = "FILE")]
    pub(crate) survey: Option<PathBuf>,
    /// Draws the success probability of these strikes by contact point and direction (SVG).
    #[arg(long, value_name = "FILE")]
    pub(crate) map: Option<PathBuf>,
    /// Strikes of the survey at most.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=100_000), requires = "surveyed")]
    pub(crate) survey_strikes: u32,
    /// Scenarios in which each strike of the survey is simulated.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=100_000), requires = "surveyed")]
    pub(crate) survey_samples: u32,
}
