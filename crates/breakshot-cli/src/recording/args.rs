//! The flags of `breakshot film`.

use super::source::Source;
use breakshot::Error;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct RecordArgs {
    /// The camera: `v4l2:/dev/video0` (a camera of this machine), `rtsp://HOST/..` or `http://HOST/..` (one of the network), or a
    /// video file, which is played in real time.
    #[arg(value_name = "SOURCE", value_parser = source)]
    pub(crate) source: Source,
    /// The picture size that a camera of this machine is set to.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    pub(crate) size: Option<[u32; 2]>,
    /// The frame rate that a camera of this machine is set to.
    #[arg(long, value_name = "HZ", value_parser = rate)]
    pub(crate) fps: Option<f64>,
    /// The exposure time that a camera of this machine is set to (by the program `v4l2-ctl`), and kept at.
    #[arg(long, value_name = "MICROSECONDS", value_parser = clap::value_parser!(u32).range(10..=1_000_000))]
    pub(crate) exposure_us: Option<u32>,
    /// The coding in which a camera of this machine sends its pictures, such as `mjpeg`: many deliver their highest rates in this one
    /// alone.
    #[arg(long, value_name = "CODING", value_parser = coding)]
    pub(crate) camera_coding: Option<String>,
    /// Ends the recording after this time; otherwise Ctrl-C ends it, or an hour.
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub(crate) seconds: Option<f64>,
    /// The output file (MP4, H.264).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Prints the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Longest recording (s).
pub(super) const LONGEST_S: f64 = 3600.0;

fn source(text: &str) -> Result<Source, String> {
    Source::of(text).map_err(|error: Error| error.to_string())
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(a, b)| Some([a.parse().ok()?, b.parse().ok()?]));
    let possible = |[width, height]: &[u32; 2]| (16..=16384).contains(width) && (16..=16384).contains(height);
    sides.filter(possible).ok_or_else(|| "needed: width and height in pixels, such as 1280x720".into())
}

fn rate(text: &str) -> Result<f64, String> {
    let possible = |rate_hz: &f64| (0.1..=10_000.0).contains(rate_hz);
    text.parse().ok().filter(possible).ok_or_else(|| "needed: frames a second, from 0.1 to 10000".into())
}

fn seconds(text: &str) -> Result<f64, String> {
    let possible = |time_s: &f64| (0.05..=LONGEST_S).contains(time_s);
    text.parse().ok().filter(possible).ok_or_else(|| format!("needed: seconds, from 0.05 to {LONGEST_S}"))
}

fn coding(text: &str) -> Result<String, String> {
    let possible = !text.is_empty()
        && text.len() <= 20
        && text.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    if possible { Ok(text.into()) } else { Err("needed: a name such as mjpeg, yuyv422 or h264".into()) }
}
