//! The commands and their flags.

use crate::campaign_args::CampaignArgs;
use crate::check_args::CheckArgs;
use crate::commands::report::FilmReportArgs;
use crate::decoder_args::{DecoderArgs, RateArgs};
use crate::detect_args::DetectArgs;
use crate::laws::{Assumptions, LawArgs};
use crate::planning::{PlannerArgs, SurveyArgs};
use crate::recording::RecordArgs;
use crate::studio_args::StudioArgs;
use breakshot::cell::DistortionModel;
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Estimates friction, restitution and mass ratios from strike videos and plans the strike that singulates a pile.
#[derive(Debug, Parser)]
#[command(name = "breakshot", version, max_term_width = 100)]
#[command(
    after_help = "Units: SI and radians. Exit codes: 0 done, 3 done but doubtful (see the warnings), 2 bad usage or input, 1 failure."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Runs all stages on the built-in example, from videos to an HTML report.
    #[command(after_help = "Example: breakshot demo -o breakshot-demo")]
    Demo(DemoArgs),
    /// Writes commented templates of the input files and a guide to filming.
    #[command(after_help = "Example: breakshot init my-cell")]
    Init(InitArgs),
    /// Writes a printable sheet of AprilTags, or a calibration board, at true scale (SVG).
    #[command(after_help = "Example: breakshot tags --ids 0,1,2,3 --size-m 0.05 -o tags.svg\n\
        Example: breakshot tags --board 6x4 -o board.svg     (a calibration board, and its geometry as board.toml)")]
    Tags(TagsArgs),
    /// Calibrates the lens from a film of a calibration board that is moved about: a ROS CameraInfo file.
    #[command(
        after_help = "Example: breakshot lens board.mp4 --board board.toml -o lens.yaml --figure lens.svg"
    )]
    Lens(LensArgs),
    /// Calibrates the camera pose from the tags: pose, reprojection error and a drawing of the fit.
    #[command(after_help = "Example: breakshot calibrate cell.toml clip.mp4 -o fit.svg")]
    Calibrate(CalibrateArgs),
    /// Drafts the objects file from a picture: outlines and markers of what lies on the table.
    #[command(
        after_help = "Example: breakshot objects cell.toml photo.png -o objects.toml --figure objects.png\n\
        Example: breakshot objects cell.toml photo.png --height-m 0.03 --height-m object_2=0.05 -o objects.toml"
    )]
    Objects(ObjectsArgs),
    /// Records a film from a camera, through the program `ffmpeg`.
    #[command(
        after_help = "Example: breakshot film v4l2:/dev/video0 --size 1280x720 --fps 120 --exposure-us 2000 -o clip.mp4\n\
        Example: breakshot film rtsp://192.168.0.20/stream --seconds 3 -o clip.mp4"
    )]
    Film(RecordArgs),
    /// Locates the objects in an image or video of the table, or before a camera, and writes a scene file.
    #[command(
        after_help = "Example: breakshot look cell.toml objects.toml pile.png --objects a,b,c -o scene.toml\n\
        Example: breakshot look cell.toml objects.toml v4l2:/dev/video0 --objects a,b,c -o scene.toml"
    )]
    Look(LookArgs),
    /// Tracks the objects in one clip, or in the clips of a campaign.
    #[command(
        after_help = "Example: breakshot detect cell.toml objects.toml clip.mp4 --objects a,c --strike-heading-rad 0.1 -o tracks.csv\n\
        Example: breakshot detect cell.toml objects.toml clip.mp4 --objects a,c -o tracks.csv --plot motion.svg --overlay overlay.mp4\n\
        Example: breakshot detect --campaign campaign.toml --tracks tracks --shard 3/64      (its share of all clips)"
    )]
    Detect(DetectArgs),
    /// Drafts the list of clips from a folder of films, to be completed.
    #[command(after_help = "Example: breakshot campaign videos/ -o campaign.toml")]
    Campaign(CampaignArgs),
    /// Shows what the films of a campaign contain and what does not fit, before anything is estimated (HTML).
    #[command(after_help = "Example: breakshot check campaign.toml -o check.html")]
    Check(CheckArgs),
    /// Estimates friction, restitution and mass ratios from the clips of a campaign.
    #[command(after_help = "Example: breakshot estimate campaign.toml -o properties.json\n\
        Example: breakshot estimate campaign.toml -o properties.json --figures figures/     (Figs. 7, 8, 9 and Table 1)\n\
        Example: breakshot estimate new_clips.toml --update properties.json -o newer.json   (adds clips; the old films are not needed)\n\
        Example: breakshot estimate campaign.toml -o properties.json --advise 10            (proposes clips to film)\n\
        Example: breakshot estimate campaign.toml -o properties.json --advise 5 --scene pile.scene.toml")]
    Estimate(EstimateArgs),
    /// Simulates one strike on a pile.
    #[command(
        after_help = "Example: breakshot simulate scene.toml --properties properties.json --strike strike.json -o trajectory.json\n\
        Example: breakshot simulate scene.toml --properties properties.json --strike strike.json \
        --restitution-law viscoelastic --reference-speed-m-s 0.5 -o trajectory.json"
    )]
    Simulate(SimulateArgs),
    /// Plans the strike that singulates a pile.
    #[command(after_help = "Example: breakshot plan scene.toml --properties properties.json -o plan.json\n\
        Example: breakshot plan scene.toml --properties properties.json -o plan.json --figure plan.svg --map map.svg\n\
        Example: breakshot plan scene.toml --properties properties.json --strikes 3 -o plan.json")]
    Plan(PlanArgs),
    /// Plans, executes and observes strikes until the pile is singulated, in simulation or with a robot.
    #[command(after_help = "Example: breakshot run scene.toml --properties properties.json -o run/\n\
        Example: breakshot run scene.toml --properties properties.json --execute './strike.sh {plan}' \
        --look './look.sh {scene}' -o run/")]
    Run(RunArgs),
    /// Computes the joint trajectory of a planned strike and checks it against the limits of the arm.
    #[command(
        name = "command",
        after_help = "Example: breakshot command plan.json --cell cell.toml -o command.json\n\
        Example: breakshot command --touch touches.toml --cell cell.toml     (registers the table)"
    )]
    Arm(CommandArgs),
    /// Executes a command on a robot; without --live a dry run in which nothing moves.
    #[command(after_help = "\
        Example: breakshot strike command.json                                      (checks the command)\n\
        Example: breakshot strike command.json --driver sim --properties properties.json --live --hash 1a2b3c4d\n\
        Example: breakshot strike command.json --driver indy:192.168.0.10           (also checks the robot)\n\
        Example: breakshot strike command.json --driver indy:192.168.0.10 --scene scene.toml --live --hash 1a2b3c4d")]
    Strike(StrikeArgs),
    /// Exports scene, properties and strike as a model for another simulator.
    #[command(
        after_help = "Example: breakshot export scene.toml --properties properties.json --strike strike.json --to mjcf -o scene.xml"
    )]
    Export(ExportArgs),
    /// Compares a filmed strike with its simulation.
    #[command(after_help = "\
        Example: breakshot verify scene.toml strike.mp4 --properties properties.json --strike plan.json -o report/\n\
        Example: breakshot verify scene.toml strike.mp4 --properties properties.json --strike plan.json -o report/ --update newer.json")]
    Verify(VerifyArgs),
    /// Writes a film of a whole procedure: strike films with tracks, learned values, plan, simulation and executed strike (MP4).
    #[command(after_help = "\
        Example: breakshot film-report --campaign campaign.toml --tracks tracks --properties properties.json --strike plan.json -o report.mp4\n\
        Example: breakshot film-report --scene scene.toml --properties properties.json --strike strike.json --executed strike.mp4 -o report.mp4")]
    FilmReport(FilmReportArgs),
    /// Serves a page for the browser of this machine: piles, strikes and plans of a folder, to look at and to drag.
    #[command(after_help = "Example: breakshot studio breakshot-demo")]
    Studio(StudioArgs),
    /// Writes man pages and completions for bash, zsh, fish, elvish and `PowerShell`.
    #[cfg(feature = "manual")]
    #[command(after_help = "Example: breakshot manual share/")]
    Manual(ManualArgs),
}

#[cfg(feature = "manual")]
#[derive(Debug, Args)]
pub(crate) struct ManualArgs {
    /// The folder for `man/man1` and `completions`; created if it does not exist.
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// The output folder; created if it does not exist.
    #[arg(short, long, default_value = "breakshot-demo", value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Prints the results as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct InitArgs {
    /// The folder for the templates.
    #[arg(default_value = ".", value_name = "DIR")]
    pub(crate) folder: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct TagsArgs {
    /// The ids of the tags, separated by commas (0 to 586, family 36h11).
    #[arg(long, value_name = "IDS", value_delimiter = ',', default_value = "0,1,2,3")]
    pub(crate) ids: Vec<u32>,
    /// A calibration board of so many columns and rows of tags instead, with its geometry in a TOML file of the same name.
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = grid, conflicts_with = "ids")]
    pub(crate) board: Option<[usize; 2]>,
    /// The side of the black square (m) [default: 0.05; of a board the largest that fits a sheet of A4].
    #[arg(long, value_name = "M")]
    pub(crate) size_m: Option<f64>,
    /// The output file (SVG).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
}

/// Two whole numbers with an x between them.
fn grid(text: &str) -> std::result::Result<[usize; 2], String> {
    let numbers = text.split_once('x').and_then(|(a, b)| Some([a.parse().ok()?, b.parse().ok()?]));
    numbers.ok_or_else(|| "needed: columns and rows, such as 6x4".into())
}

#[derive(Debug, Args)]
pub(crate) struct LensArgs {
    /// A video of the board, or a folder of images.
    #[arg(value_name = "VIDEO")]
    pub(crate) film: PathBuf,
    /// The geometry of the board (TOML or JSON), as `breakshot tags --board` writes it.
    #[arg(long, value_name = "FILE")]
    pub(crate) board: PathBuf,
    /// The distortion model: `equidistant` for fisheyes, `rational_polynomial` for wide angles that `plumb_bob` does not fit.
    #[arg(long, value_enum, default_value_t = LensModel::PlumbBob, value_name = "MODEL")]
    pub(crate) model: LensModel,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    /// The output file: a ROS CameraInfo (YAML), for `camera_info` in cell.toml.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Draws where corners were measured and how far they are from their predictions (SVG).
    #[arg(long, value_name = "FILE")]
    pub(crate) figure: Option<PathBuf>,
    /// Prints the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// The distortion models by the names that files have for them.
#[derive(Clone, Copy, Debug, ValueEnum)]
#[value(rename_all = "snake_case")]
pub(crate) enum LensModel {
    PlumbBob,
    RationalPolynomial,
    Equidistant,
}

impl From<LensModel> for DistortionModel {
    fn from(name: LensModel) -> Self {
        match name {
            LensModel::PlumbBob => Self::PlumbBob,
            LensModel::RationalPolynomial => Self::RationalPolynomial,
            LensModel::Equidistant => Self::Equidistant,
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct CalibrateArgs {
    /// The cell file.
    #[arg(value_name = "CELL")]
    pub(crate) cell: PathBuf,
    /// A video or image that shows the tags.
    #[arg(value_name = "VIDEO_OR_IMAGE")]
    pub(crate) film: PathBuf,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    /// Writes a drawing of the fit (SVG).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Prints the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// The latest time of an image (s since 1970): the year 5138.
const LATEST_S: f64 = 1e11;

/// The time of an image: a number of seconds since 1970, or `now`.
fn taken_time(text: &str) -> std::result::Result<f64, String> {
    if text == "now" {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        return since.map(|since| since.as_secs_f64()).map_err(|_| "the clock is before 1970".into());
    }
    let number = text.parse::<f64>().ok().filter(|time_s| (0.0..=LATEST_S).contains(time_s));
    number.ok_or_else(|| format!("`{text}`; needed: seconds since 1970, or `now`"))
}

#[derive(Debug, Args)]
pub(crate) struct ObjectsArgs {
    /// The cell file.
    #[arg(value_name = "CELL")]
    pub(crate) cell: PathBuf,
    /// An image of the table with the objects apart from each other, or a video that begins with it.
    #[arg(value_name = "PHOTO")]
    pub(crate) photo: PathBuf,
    /// The height of the tops above the table (m), of all objects or as NAME=METRES of one; 0.02 if not given. Outlines are
    /// measured at that height.
    #[arg(long = "height-m", value_name = "[NAME=]METRES")]
    pub(crate) heights: Vec<String>,
    /// Writes the picture with the outlines, the markers and the numbers of the objects (PNG).
    #[arg(long, value_name = "FILE")]
    pub(crate) figure: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    /// The output file (objects, TOML).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Prints where each object lies as JSON.
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
    /// A video or image of the table, or a camera: `v4l2:/dev/video0`, `rtsp://..`, `http://..`.
    #[arg(value_name = "VIDEO_OR_IMAGE")]
    pub(crate) film: PathBuf,
    /// The names of the objects on the table, separated by commas; `a#2` is a second copy of `a`.
    #[arg(long = "objects", value_name = "NAMES", value_delimiter = ',', required = true)]
    pub(crate) names: Vec<String>,
    /// The grey level (0 to 255) that separates markers from objects; computed from the image if not given.
    #[arg(long, value_name = "LEVEL")]
    pub(crate) threshold: Option<u8>,
    /// An image or video of the empty table; it improves the detection of objects without markers.
    #[arg(long, value_name = "VIDEO_OR_IMAGE")]
    pub(crate) table: Option<PathBuf>,
    /// When the image was taken (s since 1970), for a file that does not contain it; `now` for a camera's latest image.
    #[arg(long, value_name = "TIME", value_parser = taken_time)]
    pub(crate) taken_unix_s: Option<f64>,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    /// The output file (scene, TOML).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Prints the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct EstimateArgs {
    /// The campaign file.
    #[arg(value_name = "CAMPAIGN")]
    pub(crate) campaign: PathBuf,
    /// The reference object of the mass ratios; the first in alphabetical order if not given.
    #[arg(long, value_name = "NAME")]
    pub(crate) reference: Option<String>,
    /// Adds the clips of the campaign to the properties in this file; the films of its clips are not needed.
    #[arg(long, value_name = "FILE")]
    pub(crate) update: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    /// Also writes the tracks of every clip to this folder (JSON). Clips whose tracks are there already, made of the same content by the
    /// same version (`detect --campaign` or an earlier run), are not tracked again.
    #[arg(long, value_name = "DIR")]
    pub(crate) tracks: Option<PathBuf>,
    /// Also writes Figs. 7, 8, 9 and Table 1 of the paper to this folder (SVG, and their numbers as CSV).
    #[arg(long, value_name = "DIR")]
    pub(crate) figures: Option<PathBuf>,
    /// Also proposes the next N clips to film, ranked by how much they reduce the uncertainty of predicted strikes.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) advise: Option<u32>,
    /// The scene file of the pile that the proposed clips are optimized for; random piles of all objects if not given.
    #[arg(long, value_name = "FILE", requires = "advise")]
    pub(crate) scene: Option<PathBuf>,
    /// The random seed of the piles that the proposed clips are optimized for.
    #[arg(long, value_name = "N", requires = "advise", default_value_t = 1)]
    pub(crate) seed: u64,
    /// The output file for the proposed clips (JSON); `advice.json` in the folder of the properties if not given.
    #[arg(long, value_name = "FILE", requires = "advise")]
    pub(crate) advice: Option<PathBuf>,
    /// The output file (properties, JSON).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Prints the properties as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    /// The scene file.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    /// The properties file.
    #[arg(long, value_name = "FILE")]
    pub(crate) properties: PathBuf,
    /// A plan file, or a file with only the strike (JSON).
    #[arg(long, value_name = "FILE")]
    pub(crate) strike: PathBuf,
    #[command(flatten)]
    pub(crate) assumptions: Assumptions,
    #[command(flatten)]
    pub(crate) laws: LawArgs,
    /// The output file (trajectory, JSON).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Prints the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    /// The scene file.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    /// The properties file.
    #[arg(long, value_name = "FILE")]
    pub(crate) properties: PathBuf,
    #[command(flatten)]
    pub(crate) planner: PlannerArgs,
    #[command(flatten)]
    pub(crate) assumptions: Assumptions,
    /// Plans up to K strikes (1 to 20), each for the expected outcome of the one before it.
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=20))]
    pub(crate) strikes: u32,
    /// Strikes to evaluate in addition to the grid (method `robust`): a JSON list of aims.
    #[arg(long, value_name = "FILE")]
    pub(crate) proposals: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) survey: SurveyArgs,
    /// Also draws the pile, the strike and the possible final poses of the objects (SVG).
    #[arg(long, value_name = "FILE")]
    pub(crate) figure: Option<PathBuf>,
    /// The output file (plan, JSON).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Prints the plan as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    /// The scene file: the poses of the objects before the first strike.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    /// The properties file; with --execute it is read again before each plan, unless the strikes are recorded.
    #[arg(long, value_name = "FILE")]
    pub(crate) properties: PathBuf,
    #[command(flatten)]
    pub(crate) planner: PlannerArgs,
    /// The maximum number of strikes (1 to 20).
    #[arg(long, value_name = "K", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=20))]
    pub(crate) strikes: u32,
    /// The random seed of the simulated table: its properties and poses are drawn from their distributions (without --execute).
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "execute")]
    pub(crate) table: u64,
    /// The program that executes a plan, with its arguments separated by spaces; `{plan}` is replaced by the plan file. If `{film}` or `{tracks}`
    /// is among them, it records the strike in that file (MP4, or tracks as CSV), and the next plan uses what was learned from it.
    #[arg(long, value_name = "COMMAND", requires = "look")]
    pub(crate) execute: Option<String>,
    /// The program that observes the table and writes a scene file; `{scene}` is replaced by the file to write.
    #[arg(long, value_name = "COMMAND", requires = "execute")]
    pub(crate) look: Option<String>,
    #[command(flatten)]
    pub(crate) assumptions: Assumptions,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    #[command(flatten)]
    pub(crate) rate: RateArgs,
    /// The output folder for the plans and scenes of all strikes and the result (`run.json`).
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    /// Prints the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct CommandArgs {
    /// A plan file, or a file with only the strike (JSON).
    #[arg(value_name = "PLAN", required_unless_present = "touch")]
    pub(crate) plan: Option<PathBuf>,
    /// The cell file; its [robot] section gives the arm, the pose of the table in the robot base frame, and the tool.
    #[arg(long, value_name = "FILE")]
    pub(crate) cell: PathBuf,
    /// The arm: `indy7`, `indy7_v2` or a URDF file; the arm of the cell file if not given.
    #[arg(long, value_name = "ARM")]
    pub(crate) arm: Option<String>,
    /// The scene file, for a file with only the strike.
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// The output file (command, JSON).
    #[arg(short, long, value_name = "FILE", default_value = "command.json")]
    pub(crate) output: PathBuf,
    /// Also writes a ROS 2 goal (action `FollowJointTrajectory`): `.yaml` or `.json`.
    #[arg(long, value_name = "FILE")]
    pub(crate) ros: Option<PathBuf>,
    /// Also writes a URScript program.
    #[arg(long, value_name = "FILE")]
    pub(crate) urscript: Option<PathBuf>,
    /// Also writes a recording of the planned strike (MCAP, for Foxglove, Lichtblick or Rerun).
    #[arg(long, value_name = "FILE")]
    pub(crate) mcap: Option<PathBuf>,
    /// The properties file for the motion of the objects in the recording.
    #[arg(long, value_name = "FILE", requires = "mcap")]
    pub(crate) properties: Option<PathBuf>,
    /// Also draws the dynamic impulse ellipsoid of the arm (SVG, Fig. 10).
    #[arg(long, value_name = "FILE")]
    pub(crate) impulse: Option<PathBuf>,
    /// Also draws the greatest impulse of the arm along each heading, over the whole workspace (SVG).
    #[arg(long, value_name = "FILE")]
    pub(crate) impulse_map: Option<PathBuf>,
    /// Also writes the arm with its tool as a URDF file.
    #[arg(long, value_name = "FILE")]
    pub(crate) urdf: Option<PathBuf>,
    /// Instead of a strike: registers the table in the robot base frame from touched points and writes the pose to the cell file.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["plan", "ros", "urscript", "mcap", "impulse", "impulse_map", "urdf"])]
    pub(crate) touch: Option<PathBuf>,
    /// Writes the pose of --touch although a residual exceeds 2 mm.
    #[arg(long, requires = "touch")]
    pub(crate) accept_residuals: bool,
    /// Prints the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct StrikeArgs {
    /// The command file written by `breakshot command`.
    #[arg(value_name = "COMMAND")]
    pub(crate) command: PathBuf,
    /// The robot: `sim`, or, in a program built with the feature `network`, `indy:HOST` (`indy:HOST:PORT` for all services on
    /// one port), `indy-sim:HOST` (a controller that simulates its robot) or `ros:HOST:PORT`.
    #[arg(long, value_name = "ROBOT")]
    pub(crate) driver: Option<String>,
    /// The properties file (driver `sim` only).
    #[arg(long, value_name = "FILE")]
    pub(crate) properties: Option<PathBuf>,
    /// The name of the controller (driver `ros` only).
    #[arg(long, value_name = "NAME", default_value = "/joint_trajectory_controller")]
    pub(crate) controller: String,
    /// The scene file written by `breakshot look`; read at the start and again immediately before the strike.
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// Executes the motion; without this flag nothing moves.
    #[arg(long, requires = "driver")]
    pub(crate) live: bool,
    /// The short hash of the command, as printed by the dry run; required with --live, and no other command is executed.
    #[arg(long, value_name = "HASH")]
    pub(crate) hash: Option<String>,
    /// Allows strikes above 0.25 m/s; no person may be in the cell.
    #[arg(long)]
    pub(crate) allow_fast: bool,
    /// The log file (JSON lines; a recording in MCAP is written next to it); `strike-HASH-TIME.jsonl` if not given. A file that
    /// exists is never overwritten.
    #[arg(long, value_name = "FILE")]
    pub(crate) log: Option<PathBuf>,
    /// Prints the report as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// The model formats.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ModelName {
    /// The XML format of MuJoCo.
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
    /// A plan file, or a file with only the strike (JSON).
    #[arg(long, value_name = "FILE")]
    pub(crate) strike: PathBuf,
    /// The format of the model.
    #[arg(long, value_enum, value_name = "MODEL")]
    pub(crate) to: ModelName,
    #[command(flatten)]
    pub(crate) assumptions: Assumptions,
    /// The output file (model).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct VerifyArgs {
    /// The scene file: the poses of the objects before the strike.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    /// The film of the strike, or its tracks (`.csv` or `.json`, as `breakshot detect` writes them).
    #[arg(value_name = "VIDEO_OR_TRACKS")]
    pub(crate) video: PathBuf,
    /// The properties file.
    #[arg(long, value_name = "FILE")]
    pub(crate) properties: PathBuf,
    /// The plan file, or a file with only the strike (JSON).
    #[arg(long, value_name = "FILE")]
    pub(crate) strike: PathBuf,
    #[command(flatten)]
    pub(crate) assumptions: Assumptions,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    #[command(flatten)]
    pub(crate) rate: RateArgs,
    /// Also adds the measurements of this film to the properties and writes them to this file.
    #[arg(long, value_name = "FILE")]
    pub(crate) update: Option<PathBuf>,
    /// The output folder of the report.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Prints the comparison as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}
