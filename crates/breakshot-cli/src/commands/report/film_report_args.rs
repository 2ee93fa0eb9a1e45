//! The flags of `breakshot film-report`.

use crate::decoder_args::{DecoderArgs, RateArgs};
use crate::laws::Assumptions;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[group(id = "shown", multiple = true, required = true, args = ["campaign", "properties", "strike"])]
pub(crate) struct FilmReportArgs {
    /// The campaign file: strike films are shown with their tracks.
    #[arg(long, value_name = "CAMPAIGN")]
    pub(crate) campaign: Option<PathBuf>,
    /// How many strike films of the campaign are shown, spread evenly over it.
    #[arg(long, value_name = "N", requires = "campaign", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=24))]
    pub(crate) clips: u32,
    /// The folder of the tracks (`estimate --tracks`); clips without finished tracks are tracked and their tracks written to it.
    #[arg(long, value_name = "DIR", requires = "campaign")]
    pub(crate) tracks: Option<PathBuf>,
    /// The properties file: the learned values are shown with their intervals.
    #[arg(long, value_name = "FILE")]
    pub(crate) properties: Option<PathBuf>,
    /// The plan file: the plan is shown on its pile, and with --properties simulated; or a file with only the strike (JSON).
    #[arg(long, value_name = "FILE")]
    pub(crate) strike: Option<PathBuf>,
    /// The scene file of the strike; that of the plan file if not given.
    #[arg(long, value_name = "SCENE", requires = "strike")]
    pub(crate) scene: Option<PathBuf>,
    /// The film of the executed strike, shown beside its simulation.
    #[arg(long, value_name = "VIDEO", requires_all = ["strike", "properties"])]
    pub(crate) executed: Option<PathBuf>,
    /// The tracks of that film (`.csv` or `.json`, as `breakshot verify` and `breakshot detect` write them); it is tracked if not given.
    #[arg(long, value_name = "FILE", requires = "executed")]
    pub(crate) executed_tracks: Option<PathBuf>,
    /// The title.
    #[arg(long, value_name = "TEXT", default_value = "From strike videos to a strike")]
    pub(crate) title: String,
    /// Width and height of the film (px).
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size, default_value = "1280x720")]
    pub(crate) size: Size,
    /// The speed of all motions over the real one (0.01 to 1).
    #[arg(long, value_name = "FACTOR", value_parser = speed, default_value_t = 0.5)]
    pub(crate) speed: f64,
    #[command(flatten)]
    pub(crate) assumptions: Assumptions,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    #[command(flatten)]
    pub(crate) rate: RateArgs,
    /// The output file (MP4).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
}

/// Width and height (px).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Size(pub(crate) [usize; 2]);

fn size(text: &str) -> Result<Size, String> {
    let numbers = text.split_once('x').and_then(|(w, h)| Some(Size([w.parse().ok()?, h.parse().ok()?])));
    numbers.ok_or_else(|| "needed: width and height, such as 1280x720".into())
}

fn speed(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|speed| (0.01..=1.0).contains(speed));
    number.ok_or_else(|| "needed: a number from 0.01 to 1".into())
}
