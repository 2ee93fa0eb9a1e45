//! The flags that choose the video decoder and the frame rate.

use breakshot::capture::{Capture, Decoder, Footage, GreyImage};
use breakshot::cell::Cell;
use breakshot::error::bounds;
use breakshot::{Error, Result};
use clap::{Args, ValueEnum};
use std::path::Path;

#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct DecoderArgs {
    /// The video decoder. `auto` uses `ffmpeg`, if it is installed, for H.264 videos of at least 100 million pixels (49
    /// frames of 1080p; it is faster) and for other codings such as HEVC, AV1 and 10 bits; otherwise the built-in decoder.
    /// Both give the same frames.
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
    /// The first frame of a film of the empty table, if a film is given.
    pub(crate) fn table(self, path: Option<&Path>) -> Result<Option<GreyImage>> {
        let Some(path) = path else { return Ok(None) };
        let first = Footage::open_with(path, self.into())?.next().transpose()?;
        let empty = || Error::video(path, "no frame", "a picture of the empty table");
        first.map(|frame| Some(frame.image)).ok_or_else(empty)
    }

    /// Opens a film and calibrates its camera.
    pub(crate) fn film(self, path: &Path, cell: &Cell) -> Result<Capture> {
        Capture::of(Footage::open_with(path, self.into())?, cell)
    }
}

#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct RateArgs {
    /// The frame rate at which the video was taken, where its file says another (slow motion); `[camera] frame_rate_hz` of the
    /// cell if not given.
    #[arg(long, value_name = "HZ", value_parser = frame_rate)]
    pub(crate) frame_rate_hz: Option<f64>,
}

fn frame_rate(text: &str) -> std::result::Result<f64, String> {
    let value = text.parse().map_err(|_| "needed: a positive number".to_owned())?;
    bounds::frame_rate("--frame-rate-hz", "the rate", value).map_err(|error| error.to_string())?;
    Ok(value)
}

impl RateArgs {
    /// Opens a film that was taken at this rate, or at that of the cell.
    pub(crate) fn open(self, path: &Path, decoder: DecoderArgs, cell: &Cell) -> Result<Footage> {
        let rate_hz = self.frame_rate_hz.or(cell.camera.frame_rate_hz);
        Ok(Footage::open_with(path, decoder.into())?.at_frame_rate(rate_hz))
    }
}
