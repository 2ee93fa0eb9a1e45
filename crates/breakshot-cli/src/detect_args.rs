//! The flags of `breakshot detect`.

use crate::decoder_args::{DecoderArgs, RateArgs};
use breakshot::error::bounds;
use clap::Args;
use std::path::PathBuf;
use std::str::FromStr;

#[derive(Debug, Args)]
pub(crate) struct DetectArgs {
    #[command(flatten)]
    pub(crate) batch: BatchArgs,
    /// The cell file.
    #[arg(value_name = "CELL", required_unless_present = "campaign")]
    pub(crate) cell: Option<PathBuf>,
    /// The objects file.
    #[arg(value_name = "OBJECTS", required_unless_present = "campaign")]
    pub(crate) objects: Option<PathBuf>,
    /// The video of the clip.
    #[arg(value_name = "VIDEO", required_unless_present = "campaign")]
    pub(crate) video: Option<PathBuf>,
    /// The names of the objects in the clip, separated by commas, the struck object first.
    #[arg(
        long = "objects",
        value_name = "NAMES",
        value_delimiter = ',',
        required_unless_present = "campaign"
    )]
    pub(crate) names: Vec<String>,
    /// The heading of the strike (rad, from x towards y): objects with equal markers are identified by their order along it.
    #[arg(long, value_name = "H", conflicts_with = "scene", allow_negative_numbers = true, value_parser = heading)]
    pub(crate) strike_heading_rad: Option<f64>,
    /// A scene file with the initial poses, by which objects with equal markers are identified.
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// The grey level (0 to 255) that separates markers from objects; computed from the clip if not given.
    #[arg(long, value_name = "LEVEL")]
    pub(crate) threshold: Option<u8>,
    /// An image or video of the empty table; it improves the detection of objects without markers.
    #[arg(long, value_name = "VIDEO_OR_IMAGE")]
    pub(crate) table: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    #[command(flatten)]
    pub(crate) rate: RateArgs,
    /// Also plots distance, speed and acceleration over time (Fig. 6 of the paper; SVG).
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    /// Also writes the film with outlines, paths, velocities and the time drawn on it: an MP4 if `ffmpeg` is installed,
    /// otherwise a folder of PNG images with this name. Up to 512 MiB of frames (258 of 1080p) are kept in memory; a
    /// longer film is decoded a second time.
    #[arg(long, value_name = "FILE")]
    pub(crate) overlay: Option<PathBuf>,
    /// Also writes a page (HTML) of the frames in which an object was not found or is doubtful: where it was searched, what was found
    /// there, and why that was refused or is doubtful. The frames are kept in memory as for --overlay.
    #[arg(long, value_name = "FILE")]
    pub(crate) why: Option<PathBuf>,
    /// The output file (tracks): `.csv` or `.json`.
    #[arg(short, long, value_name = "FILE", required_unless_present = "campaign")]
    pub(crate) output: Option<PathBuf>,
    /// Prints the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Many clips instead of one.
#[derive(Debug, Args)]
pub(crate) struct BatchArgs {
    /// Tracks the clips of this campaign instead of one video.
    #[arg(long, value_name = "CAMPAIGN", requires = "tracks", conflicts_with_all = ["cell", "objects", "video", "names",
        "strike_heading_rad", "scene", "threshold", "table", "frame_rate_hz", "plot", "overlay", "why", "output"])]
    pub(crate) campaign: Option<PathBuf>,
    /// The folder for the tracks (JSON, one file for each clip; created if it does not exist). Clips whose tracks are there already, made of
    /// the same content by the same version, are not tracked again.
    #[arg(long, value_name = "DIR", requires = "campaign", conflicts_with = "video")]
    pub(crate) tracks: Option<PathBuf>,
    /// Tracks every N-th clip only, from the I-th on (1 to N), so that N calls with one folder track all.
    #[arg(
        long,
        value_name = "I/N",
        requires = "campaign",
        conflicts_with = "video",
        default_value = "1/1",
        hide_default_value = true
    )]
    pub(crate) shard: Shard,
}

/// Every `count`-th clip, from clip `first` (counted from 0) on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    first: usize,
    count: usize,
}

impl Shard {
    /// Whether clip `number` (counted from 0) belongs to it.
    pub(crate) fn contains(self, number: usize) -> bool {
        number % self.count == self.first
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((number @ 1.., count)) if number <= count => Ok(Self { first: number - 1, count }),
            _ => Err("needed: I/N with I from 1 to N, as 3/64".into()),
        }
    }
}

fn heading(text: &str) -> std::result::Result<f64, String> {
    let value = text.parse().map_err(|_| "needed: an angle in rad".to_owned())?;
    bounds::angle("--strike-heading-rad", "the heading", value).map_err(|error| error.to_string())?;
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shards_have_every_clip_once_and_differ_in_size_by_at_most_one() {
        for count in 1..9 {
            let shards = (1..=count).map(|i| format!("{i}/{count}").parse::<Shard>().unwrap());
            let shards: Vec<Shard> = shards.collect();
            let owners = |clip: usize| shards.iter().filter(|shard| shard.contains(clip)).count();
            assert!((0..100).all(|clip| owners(clip) == 1), "{count} shards");
            let size = |shard: &Shard| (0..100).filter(|clip| shard.contains(*clip)).count();
            let sizes: Vec<usize> = shards.iter().map(size).collect();
            assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1, "{sizes:?}");
        }
        for wrong in ["", "1", "0/3", "4/3", "1/0", "-1/3", "1/3/2", "a/b", "1/99999999999999999999999"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
