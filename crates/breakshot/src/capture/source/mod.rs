//! Which pictures does a film hold, and when was each of them shown?
//!
//! What a file is, is read from its first bytes, never from its name.  Whatever cannot be read, or breaks off, is
//! refused with the reason, as soon as it is known; no film is shortened silently.

mod ahead;
mod boxes;
mod ffmpeg;
mod guard;
mod h264;
mod handed;
mod kind;
mod movie;
mod mp4;
mod orientation;
mod pictures;
mod refusal;
mod repeats;
mod samples;
mod timeline;
mod y4m;

pub(super) use repeats::Repeats;

use super::{Decoder, Frame};
use crate::error::Result;
use kind::Kind;
use refusal::Refusal;
use std::path::Path;

/// No side of a picture is longer: a header that says more lies, or asks for more memory than is sane.
const MAX_SIDE_PX: u64 = 16_384;
/// No picture is larger (an 8K picture has 33 million pixels).
const MAX_PIXELS: u64 = 40_000_000;
/// No film is longer: two hours at 240 frames a second.
const MAX_FRAMES: u64 = 2_000_000;

/// From so many pixels on, those of all its frames together, `ffmpeg` decodes a film in less time than the built-in
/// decoder, its start (a twentieth of a second) included: 49 frames of 1080p, 13 of 4K.
const HANDED_FROM_PX: u64 = 100_000_000;

/// A film whose header is read and whose frames are ready to come.
pub(super) struct Opened {
    pub size_px: [usize; 2],
    pub frame_count: Option<usize>,
    pub warnings: Vec<String>,
    pub frames: Box<dyn Iterator<Item = Result<Frame>> + Send>,
    /// The step of the clock (s) of a film that tells its times only frame by frame: they are still to be checked.
    pub tick_s: Option<f64>,
}

/// Opens whatever film lies at `path`.
///
/// `ffmpeg` is asked for what the built-in decoder names as another coding and for long films, never for what is
/// damaged.
pub(super) fn open(path: &Path, decoder: Decoder) -> Result<Opened> {
    let refusal = match kind::of(path)? {
        Kind::Y4m(file) => return y4m::open(path, file),
        Kind::Png => return pictures::open_one(path),
        Kind::Folder => return pictures::open_folder(path),
        Kind::Foreign(refusal) => refusal,
        Kind::Mp4(_) if decoder == Decoder::Ffmpeg => Refusal::convertible("an MP4 or MOV film"),
        Kind::Mp4(file) => {
            match movie::open(path, file, (decoder == Decoder::Auto).then_some(HANDED_FROM_PX)) {
                Ok(opened) => return Ok(opened),
                Err(refusal) => refusal,
            }
        }
    };
    if decoder == Decoder::Builtin || !refusal.convertible {
        return Err(refusal.of(path));
    }
    ffmpeg::open(path, &refusal)
}

/// An error unless a picture of this size can be worked on.
fn check_size(width: u64, height: u64) -> std::result::Result<(), Refusal> {
    let sane = 1..=MAX_SIDE_PX;
    if sane.contains(&width) && sane.contains(&height) && width * height <= MAX_PIXELS {
        return Ok(());
    }
    Err(Refusal::unfit(
        format!("pictures of {width} x {height} px"),
        format!("1 to {MAX_SIDE_PX} px a side and at most {} million pixels", MAX_PIXELS / 1_000_000),
    ))
}
