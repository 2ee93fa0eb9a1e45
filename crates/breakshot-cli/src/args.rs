//! The commands and their flags.

use breakshot::capture::{Capture, Decoder, Footage, GreyImage};
use breakshot::cell::Cell;
use breakshot::plan::{Method, Scatter};
use breakshot::{Error, Result};
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::{Path, PathBuf};

/// Learns from strike videos how objects slide and bounce, and plans the one strike that singulates a pile.
#[derive(Debug, Parser)]
#[command(name = "breakshot", version, max_term_width = 100)]
#[command(
    after_help = "Exit codes: 0 done, 3 done but doubtful (see the warnings), 2 bad usage or input, 1 failure."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// The whole flow on the built-in example, from videos to a report.
    #[command(after_help = "Example: breakshot demo -o breakshot-demo")]
    Demo(DemoArgs),
    /// Writes commented templates of the input files, and how to film.
    #[command(after_help = "Example: breakshot init my-cell")]
    Init(InitArgs),
    /// Writes a printable sheet of AprilTags at true scale (SVG).
    #[command(after_help = "Example: breakshot tags --ids 0,1,2,3 --size-m 0.05 -o tags.svg")]
    Tags(TagsArgs),
    /// Where the camera stands: pose, reprojection error and a picture of the fit.
    #[command(after_help = "Example: breakshot calibrate cell.toml clip.mp4 -o fit.svg")]
    Calibrate(CalibrateArgs),
    /// What lies on the table now: writes a scene file.
    #[command(
        after_help = "Example: breakshot look cell.toml objects.toml pile.png --objects a,b,c -o scene.toml"
    )]
    Look(LookArgs),
    /// Tracks the objects of one clip.
    #[command(
        after_help = "Example: breakshot detect cell.toml objects.toml clip.mp4 --objects a,c --strike-heading-rad 0.1 -o tracks.csv\n\
        Example: breakshot detect cell.toml objects.toml clip.mp4 --objects a,c -o tracks.csv --plot motion.svg --overlay overlay.mp4"
    )]
    Detect(DetectArgs),
    /// Learns friction, restitution and mass ratios from the clips of a campaign.
    #[command(after_help = "Example: breakshot estimate campaign.toml -o properties.json\n\
        Example: breakshot estimate campaign.toml -o properties.json --figures figures/     (Figs. 7, 8, 9 and Table 1)\n\
        Example: breakshot estimate new_clips.toml --update properties.json -o newer.json   (without the old films)\n\
        Example: breakshot estimate campaign.toml -o properties.json --advise 10            (what to film next)\n\
        Example: breakshot estimate campaign.toml -o properties.json --advise 5 --scene pile.scene.toml")]
    Estimate(EstimateArgs),
    /// Simulates one strike on a pile.
    #[command(
        after_help = "Example: breakshot simulate scene.toml --properties properties.json --strike strike.json -o trajectory.json"
    )]
    Simulate(SimulateArgs),
    /// Plans the strike that singulates a pile.
    #[command(after_help = "Example: breakshot plan scene.toml --properties properties.json -o plan.json\n\
        Example: breakshot plan scene.toml --properties properties.json --method robust -o plan.json --figure plan.svg\n\
        Example: breakshot plan scene.toml --properties properties.json --strikes 3 -o plan.json")]
    Plan(PlanArgs),
    /// Plans, strikes, looks and plans again until the pile is singulated, on a simulated table or with a robot.
    #[command(after_help = "Example: breakshot run scene.toml --properties properties.json -o run/\n\
        Example: breakshot run scene.toml --properties properties.json --execute './strike.sh {plan}' \
        --look './look.sh {scene}' -o run/")]
    Run(RunArgs),
    /// The joint path of a planned strike, checked against the arm's limits.
    #[command(
        name = "command",
        after_help = "Example: breakshot command plan.json --cell cell.toml -o command.json\n\
        Example: breakshot command --touch touches.toml --cell cell.toml     (where the table lies for the robot)"
    )]
    Arm(CommandArgs),
    /// Carries a command out on a robot; without --live nothing moves and it only shows what would happen.
    #[command(after_help = "\
        Example: breakshot strike command.json                                      (may it be carried out?)\n\
        Example: breakshot strike command.json --driver sim --properties properties.json --live --hash 1a2b3c4d\n\
        Example: breakshot strike command.json --driver indy:192.168.0.10           (and what does the robot say?)\n\
        Example: breakshot strike command.json --driver indy:192.168.0.10 --scene scene.toml --live --hash 1a2b3c4d")]
    Strike(StrikeArgs),
    /// Writes scene, properties and strike as a model for another simulator.
    #[command(
        after_help = "Example: breakshot export scene.toml --properties properties.json --strike strike.json --to mjcf -o scene.xml"
    )]
    Export(ExportArgs),
    /// Compares a filmed strike with its simulation.
    #[command(after_help = "\
        Example: breakshot verify scene.toml strike.mp4 --properties properties.json --strike plan.json -o report/\n\
        Example: breakshot verify scene.toml strike.mp4 --properties properties.json --strike plan.json -o report/ --update newer.json")]
    Verify(VerifyArgs),
}

#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// The folder to write; made if it is not there.
    #[arg(short, long, default_value = "breakshot-demo", value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Prints the results as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct InitArgs {
    /// The folder to write the templates to.
    #[arg(default_value = ".", value_name = "DIR")]
    pub(crate) folder: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct TagsArgs {
    /// Which tags, separated by commas (0 to 586).
    #[arg(long, value_name = "IDS", value_delimiter = ',', default_value = "0,1,2,3")]
    pub(crate) ids: Vec<u32>,
    /// The side of the black square.
    #[arg(long, value_name = "M", default_value_t = 0.05)]
    pub(crate) size_m: f64,
    /// The sheet to write.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
}

#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct DecoderArgs {
    /// Who decodes the video: `auto` takes `ffmpeg`, if it is installed, for H.264 of at least 100 million pixels (49 frames
    /// of 1080p, where it is faster) and for HEVC, AV1, 10 bits and whatever else there is, else the built-in decoder; the
    /// frames are the same.
    #[arg(long, value_enum, default_value_t = DecoderName::Auto, value_name = "DECODER")]
    pub(crate) decoder: DecoderName,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum DecoderName {
    Auto,
    Builtin,
    Ffmpeg,
}

impl From<DecoderArgs> for Decoder {
    fn from(args: DecoderArgs) -> Self {
        match args.decoder {
            DecoderName::Auto => Self::Auto,
            DecoderName::Builtin => Self::Builtin,
            DecoderName::Ffmpeg => Self::Ffmpeg,
        }
    }
}

impl DecoderArgs {
    /// The first picture of a film of the empty table, if one is given.
    pub(crate) fn table(self, path: Option<&Path>) -> Result<Option<GreyImage>> {
        let Some(path) = path else { return Ok(None) };
        let first = Footage::open_with(path, self.into())?.next().transpose()?;
        let empty = || Error::video(path, "no frame", "a picture of the empty table");
        first.map(|frame| Some(frame.image)).ok_or_else(empty)
    }

    /// Opens a film and finds the camera in it.
    pub(crate) fn film(self, path: &Path, cell: &Cell) -> Result<Capture> {
        Capture::of(Footage::open_with(path, self.into())?, cell)
    }
}

#[derive(Debug, Args)]
pub(crate) struct CalibrateArgs {
    /// The cell file.
    #[arg(value_name = "CELL")]
    pub(crate) cell: PathBuf,
    /// A video or picture in which the tags are seen.
    #[arg(value_name = "VIDEO_OR_IMAGE")]
    pub(crate) film: PathBuf,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    /// Where to write the picture of the fit (SVG).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Prints the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct LookArgs {
    /// The cell file.
    #[arg(value_name = "CELL")]
    pub(crate) cell: PathBuf,
    /// The objects file.
    #[arg(value_name = "OBJECTS")]
    pub(crate) objects: PathBuf,
    /// A video or picture of the table.
    #[arg(value_name = "VIDEO_OR_IMAGE")]
    pub(crate) film: PathBuf,
    /// What lies on the table, separated by commas; `a#2` is a second copy.
    #[arg(long = "objects", value_name = "NAMES", value_delimiter = ',', required = true)]
    pub(crate) names: Vec<String>,
    /// The grey level between markers and objects, instead of the film's own.
    #[arg(long, value_name = "LEVEL")]
    pub(crate) threshold: Option<u8>,
    /// A picture or film of the empty table, which helps to find objects without markers.
    #[arg(long, value_name = "VIDEO_OR_IMAGE")]
    pub(crate) table: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    /// The scene file to write.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Prints the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct DetectArgs {
    /// The cell file.
    #[arg(value_name = "CELL")]
    pub(crate) cell: PathBuf,
    /// The objects file.
    #[arg(value_name = "OBJECTS")]
    pub(crate) objects: PathBuf,
    /// The clip.
    #[arg(value_name = "VIDEO")]
    pub(crate) video: PathBuf,
    /// The objects in it, separated by commas, the struck one first.
    #[arg(long = "objects", value_name = "NAMES", value_delimiter = ',', required = true)]
    pub(crate) names: Vec<String>,
    /// The strike's direction: tells objects with the same marker apart by their order along it.
    #[arg(long, value_name = "H", conflicts_with = "scene", allow_negative_numbers = true)]
    pub(crate) strike_heading_rad: Option<f64>,
    /// A scene file that says where each object lay.
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// The grey level between markers and objects, instead of the clip's own.
    #[arg(long, value_name = "LEVEL")]
    pub(crate) threshold: Option<u8>,
    /// A picture or film of the empty table, which helps to find objects without markers.
    #[arg(long, value_name = "VIDEO_OR_IMAGE")]
    pub(crate) table: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    /// Also draws distance, speed and acceleration over time (Fig. 6 of the paper; SVG).
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    /// Also draws outlines, ways, velocities and the time on the film: an MP4 where `ffmpeg` is installed, else a
    /// folder of PNG pictures of that name.
    #[arg(long, value_name = "FILE")]
    pub(crate) overlay: Option<PathBuf>,
    /// The tracks to write: `.csv` or `.json`.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Prints a summary as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct EstimateArgs {
    /// The campaign file.
    #[arg(value_name = "CAMPAIGN")]
    pub(crate) campaign: PathBuf,
    /// The object whose mass is the unit; the first in the alphabet if not given.
    #[arg(long, value_name = "NAME")]
    pub(crate) reference: Option<String>,
    /// Adds the campaign's clips to the estimate in this file; the films of its clips are not needed.
    #[arg(long, value_name = "FILE")]
    pub(crate) update: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    /// Also writes the tracks of every clip into this folder (JSON).
    #[arg(long, value_name = "DIR")]
    pub(crate) tracks: Option<PathBuf>,
    /// Also draws the paper's Figs. 7, 8, 9 and Table 1 into this folder (SVG, and their numbers as CSV).
    #[arg(long, value_name = "DIR")]
    pub(crate) figures: Option<PathBuf>,
    /// Also ranks the next N clips worth filming, by how much they would sharpen predicted strikes.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) advise: Option<u32>,
    /// The pile that the advice is for; random piles of all objects if not given.
    #[arg(long, value_name = "FILE", requires = "advise")]
    pub(crate) scene: Option<PathBuf>,
    /// The seed of the piles that the advice is for.
    #[arg(long, value_name = "N", requires = "advise", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Where to write the advice; `advice.json` beside the properties if not given.
    #[arg(long, value_name = "FILE", requires = "advise")]
    pub(crate) advice: Option<PathBuf>,
    /// The properties to write.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Prints the properties as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// What stands in for a restitution that was never measured.
#[derive(Debug, Args)]
pub(crate) struct Assumptions {
    /// Restitution of pairs that were never filmed; without it such a pair is an error.
    #[arg(long, value_name = "E")]
    pub(crate) assume_restitution: Option<f64>,
}

#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    /// The scene file.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    /// The properties file.
    #[arg(long, value_name = "FILE")]
    pub(crate) properties: PathBuf,
    /// A plan, or a file with just the strike.
    #[arg(long, value_name = "FILE")]
    pub(crate) strike: PathBuf,
    #[command(flatten)]
    pub(crate) assumptions: Assumptions,
    /// The trajectory to write.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Prints a summary as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// The planners by their names on the command line.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum MethodName {
    /// The paper's feedback on the strike's speed.
    Paper,
    /// The strike that works most probably, over all that is not known exactly.
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

/// How well the pile is seen and the strike carried out, one standard deviation each (robust).
#[derive(Debug, Args)]
pub(crate) struct ScatterArgs {
    /// An object's place, along each axis.
    #[arg(long, value_name = "M", default_value_t = Scatter::default().position_m)]
    position_std_m: f64,
    /// An object's yaw.
    #[arg(long, value_name = "RAD", default_value_t = Scatter::default().yaw_rad)]
    yaw_std_rad: f64,
    /// The strike's speed, as a part of it.
    #[arg(long, value_name = "PART", default_value_t = Scatter::default().speed)]
    speed_std: f64,
    /// The strike's heading.
    #[arg(long, value_name = "RAD", default_value_t = Scatter::default().heading_rad)]
    heading_std_rad: f64,
}

impl ScatterArgs {
    pub(crate) fn scatter(&self) -> Scatter {
        Scatter {
            position_m: self.position_std_m,
            yaw_rad: self.yaw_std_rad,
            speed: self.speed_std,
            heading_rad: self.heading_std_rad,
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    /// The scene file.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    /// The properties file.
    #[arg(long, value_name = "FILE")]
    pub(crate) properties: PathBuf,
    /// Which algorithm plans.
    #[arg(long, value_enum, default_value = "paper")]
    pub(crate) method: MethodName,
    /// The seed of all draws; the same seed gives the same plan (robust).
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) scatter: ScatterArgs,
    #[command(flatten)]
    pub(crate) assumptions: Assumptions,
    /// Plans up to so many strikes, each for the pile that the one before it is expected to leave.
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=20))]
    pub(crate) strikes: u32,
    /// A drawing of the pile, the strike and where the objects may come to rest (SVG).
    #[arg(long, value_name = "FILE")]
    pub(crate) figure: Option<PathBuf>,
    /// The plan to write.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Prints the plan as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    /// The scene file: what lies on the table before the first strike.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    /// The properties file; with --execute it is read again before each plan, so that it can be bettered on the way.
    #[arg(long, value_name = "FILE")]
    pub(crate) properties: PathBuf,
    /// Which algorithm plans.
    #[arg(long, value_enum, default_value = "robust")]
    pub(crate) method: MethodName,
    /// Strikes at most.
    #[arg(long, value_name = "K", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=20))]
    pub(crate) strikes: u32,
    /// The seed of the plans' draws.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Which of the tables that may be is struck, where no robot strikes.
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "execute")]
    pub(crate) table: u64,
    /// The program that carries out a plan, its words separated by spaces; `{plan}` stands for the plan's file.
    #[arg(long, value_name = "COMMAND", requires = "look")]
    pub(crate) execute: Option<String>,
    /// The program that looks at the table and writes the scene file that `{scene}` stands for.
    #[arg(long, value_name = "COMMAND", requires = "execute")]
    pub(crate) look: Option<String>,
    #[command(flatten)]
    pub(crate) scatter: ScatterArgs,
    #[command(flatten)]
    pub(crate) assumptions: Assumptions,
    /// The folder for the plans and scenes of all strikes, and what came of them (`run.json`).
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    /// Prints what came of it as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct CommandArgs {
    /// A plan, or a file with just the strike.
    #[arg(value_name = "PLAN", required_unless_present = "touch")]
    pub(crate) plan: Option<PathBuf>,
    /// The cell file; its [robot] says which arm, where the table lies for it, and the tool.
    #[arg(long, value_name = "FILE")]
    pub(crate) cell: PathBuf,
    /// Another arm than the cell's: `indy7`, `indy7_v2` or a URDF file.
    #[arg(long, value_name = "ARM")]
    pub(crate) arm: Option<String>,
    /// What lies on the table, for a strike without a plan.
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// The command to write.
    #[arg(short, long, value_name = "FILE", default_value = "command.json")]
    pub(crate) output: PathBuf,
    /// Also writes a goal for ROS 2 (a `FollowJointTrajectory` action): `.yaml` or `.json`.
    #[arg(long, value_name = "FILE")]
    pub(crate) ros: Option<PathBuf>,
    /// Also writes a URScript program.
    #[arg(long, value_name = "FILE")]
    pub(crate) urscript: Option<PathBuf>,
    /// Also writes a recording of the planned strike (MCAP, for Foxglove, Lichtblick or Rerun).
    #[arg(long, value_name = "FILE")]
    pub(crate) mcap: Option<PathBuf>,
    /// Lets the objects in the recording move as these properties predict.
    #[arg(long, value_name = "FILE", requires = "mcap")]
    pub(crate) properties: Option<PathBuf>,
    /// Also draws what impulse the arm can give in which direction (SVG, Fig. 10).
    #[arg(long, value_name = "FILE")]
    pub(crate) impulse: Option<PathBuf>,
    /// Also writes the arm with its tool as a URDF.
    #[arg(long, value_name = "FILE")]
    pub(crate) urdf: Option<PathBuf>,
    /// Instead: finds where the table lies for the robot from touched points, and writes it into the cell file.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["plan", "ros", "urscript", "mcap", "impulse", "urdf"])]
    pub(crate) touch: Option<PathBuf>,
    /// Prints the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct StrikeArgs {
    /// The command, as `breakshot command` wrote it.
    #[arg(value_name = "COMMAND")]
    pub(crate) command: PathBuf,
    /// The robot: `indy:HOST` (`indy:HOST:PORT` for all services on one port), `ros:HOST:PORT`, or `sim`.
    #[arg(long, value_name = "ROBOT")]
    pub(crate) driver: Option<String>,
    /// What the objects are like (`sim` alone).
    #[arg(long, value_name = "FILE")]
    pub(crate) properties: Option<PathBuf>,
    /// The controller's name (`ros` alone).
    #[arg(long, value_name = "NAME", default_value = "/joint_trajectory_controller")]
    pub(crate) controller: String,
    /// What lies on the table, as `breakshot look` wrote it; read now and again before the strike.
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// Moves the arm.
    #[arg(long, requires = "driver")]
    pub(crate) live: bool,
    /// The command's short hash, as it was printed: the arm moves for no other command.
    #[arg(long, value_name = "HASH")]
    pub(crate) hash: Option<String>,
    /// Allows a strike of more than 0.25 m/s: nobody may be in the cell.
    #[arg(long)]
    pub(crate) allow_fast: bool,
    /// The log to write (JSON lines; beside it a recording, MCAP); `strike-HASH.jsonl` if not given.
    #[arg(long, value_name = "FILE")]
    pub(crate) log: Option<PathBuf>,
    /// Prints the report as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// The models by their names on the command line.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ModelName {
    /// MuJoCo's XML.
    Mjcf,
}

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// The scene file.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    /// The properties file.
    #[arg(long, value_name = "FILE")]
    pub(crate) properties: PathBuf,
    /// A plan, or a file with just the strike.
    #[arg(long, value_name = "FILE")]
    pub(crate) strike: PathBuf,
    /// For which simulator.
    #[arg(long, value_enum, value_name = "MODEL")]
    pub(crate) to: ModelName,
    #[command(flatten)]
    pub(crate) assumptions: Assumptions,
    /// The model to write.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct VerifyArgs {
    /// The scene file: where the objects lay before the strike.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    /// The film of the strike.
    #[arg(value_name = "VIDEO")]
    pub(crate) video: PathBuf,
    /// The properties file.
    #[arg(long, value_name = "FILE")]
    pub(crate) properties: PathBuf,
    /// The plan, or a file with just the strike.
    #[arg(long, value_name = "FILE")]
    pub(crate) strike: PathBuf,
    #[command(flatten)]
    pub(crate) assumptions: Assumptions,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    /// Also adds what the film tells to the properties, and writes them to this file.
    #[arg(long, value_name = "FILE")]
    pub(crate) update: Option<PathBuf>,
    /// The folder for the report.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Prints the comparison as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}
