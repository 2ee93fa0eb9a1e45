//! The flag that chooses the video decoder.

use breakshot::capture::{Capture, Decoder, Footage, GreyImage};
use breakshot::cell::Cell;
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
