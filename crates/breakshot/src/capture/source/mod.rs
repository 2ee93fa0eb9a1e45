//! Which pictures does a film hold, and when was each of them shown?
//!
//! What a file is, is read from its first bytes, never from its name.  Whatever cannot be read, or breaks off, is
//! refused with the reason, as soon as it is known; no film is shortened silently.

mod error;
mod ffmpeg;
mod h264;
mod limits;
mod mp4;
mod opened;
mod pictures;
mod prefetch;
mod repeats;
mod sniff;
mod timestamps;
mod y4m;

pub(super) use repeats::Repeats;

use crate::error::Result;
use error::Refusal;
use ffmpeg::h264::Handed;
use mp4::reader::Movie;
use opened::Opened;
use prefetch::ahead;
use sniff::Kind;
use std::fs::File;
use std::path::Path;

/// Who turns a film into frames; all give the same frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Decoder {
    /// The built-in one for short films of its own coding (all frames together below 100 million pixels), `ffmpeg`, if
    /// it is installed, for long ones, because it is faster, and for what else there is.
    #[default]
    Auto,
    /// The built-in one alone: H.264, Y4M, PNG.
    Builtin,
    /// The program `ffmpeg` for every film, if it is installed.
    Ffmpeg,
}

/// From so many pixels on, those of all its frames together, `ffmpeg` decodes a film in less time than the built-in
/// decoder, its start (a twentieth of a second) included: 49 frames of 1080p, 13 of 4K.
const HANDED_FROM_PX: u64 = 100_000_000;

/// Opens whatever film lies at `path`.
///
/// `ffmpeg` is asked for what the built-in decoder names as another coding and for long films, never for what is
/// damaged.
pub(super) fn open(path: &Path, decoder: Decoder) -> Result<Opened> {
    let refusal = match sniff::of(path)? {
        Kind::Y4m(file) => return y4m::open(path, file),
        Kind::Png => return pictures::open_one(path),
        Kind::Folder => return pictures::open_folder(path),
        Kind::Foreign(refusal) => refusal,
        Kind::Mp4(_) if decoder == Decoder::Ffmpeg => Refusal::convertible("an MP4 or MOV film"),
        Kind::Mp4(file) => match open_mp4(path, file, (decoder == Decoder::Auto).then_some(HANDED_FROM_PX)) {
            Ok(opened) => return Ok(opened),
            Err(refusal) => refusal,
        },
    };
    if decoder == Decoder::Builtin || !refusal.convertible {
        return Err(refusal.of(path));
    }
    ffmpeg::process::open(path, &refusal)
}

/// Opens an MP4 and checks all that can be checked without decoding more than its first picture.
///
/// A film about which there is nothing to say, and whose frames together have at least so many pixels, is handed to
/// `ffmpeg`, if that is installed.
fn open_mp4(path: &Path, file: File, handed_from_px: Option<u64>) -> std::result::Result<Opened, Refusal> {
    let (opened, mut movie) = Movie::of(path, file)?;
    let pixels =
        movie.timeline.times_s.len() as u64 * opened.size_px.map(|side| side as u64).iter().product::<u64>();
    if handed_from_px.is_some_and(|least| pixels >= least)
        && opened.warnings.is_empty()
        && let Ok(program) = ffmpeg::process::open(path, &Refusal::damaged("an MP4 or MOV film"))
    {
        let handed = Handed::new(path, program.frames, movie.timeline.times_s, opened.size_px);
        return Ok(Opened { frames: Box::new(handed), ..opened });
    }
    // What the decoder cannot do shows in the first picture.
    movie.decode_next()?;
    Ok(Opened { frames: Box::new(ahead(path.into(), movie)), ..opened })
}
