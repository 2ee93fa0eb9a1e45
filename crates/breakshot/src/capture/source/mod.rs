//! Which frames does a film hold, and at which time was each of them taken?
//!
//! The content of a file decides what it is, never its name.  A film that cannot be read, or that ends early, is an
//! error as soon as that is known; no film is shortened silently.

mod error;
mod ffmpeg;
mod h264;
mod image_files;
mod limits;
mod mp4;
mod opened;
mod prefetch;
mod repeats;
mod sniff;
mod timestamps;
mod y4m;

pub use h264::is_decoding;
pub(super) use repeats::RepeatedFrames;

use crate::error::Result;
use error::SourceError;
use ffmpeg::h264::FfmpegH264;
use mp4::reader::Mp4Reader;
use opened::Opened;
use prefetch::prefetch;
use sniff::Kind;
use std::fs::File;
use std::path::Path;

/// The program that decodes a film; all choices give the same frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Decoder {
    /// The built-in decoder for H.264 films of fewer than 100 million pixels, all frames together; `ffmpeg`, if it is
    /// installed, for longer ones, because it is faster, and for all other codings.
    #[default]
    Auto,
    /// The built-in decoder alone: H.264, Y4M, PNG.
    Builtin,
    /// The program `ffmpeg` for every film that is not Y4M or PNG.
    Ffmpeg,
}

/// From this number of pixels on, all frames together, `ffmpeg` decodes a film in less time than the built-in decoder,
/// including its start of 0.05 s: 49 frames of 1080p, 13 of 4K.
const FFMPEG_FROM_PX: u64 = 100_000_000;

/// When a film was recorded (s since 1970), by its own header; `None` for files that do not say. A file's date tells when it was
/// copied.
pub fn recorded_unix_s(path: &Path) -> Option<f64> {
    let mut file = File::open(path).ok()?;
    let length = file.metadata().ok()?.len();
    mp4::track::recorded_unix_s(&mut file, length)
}

/// Opens the film at `path`.
///
/// `ffmpeg` decodes long H.264 films and the codings that the built-in decoder does not support, never a film that is
/// damaged.
pub(super) fn open(path: &Path, decoder: Decoder) -> Result<Opened> {
    let error = match sniff::of(path)? {
        Kind::Y4m(file) => return y4m::open(path, file),
        Kind::Png => return image_files::open_one(path),
        Kind::Folder => return image_files::open_folder(path),
        Kind::Other(error) => error,
        Kind::Mp4(_) if decoder == Decoder::Ffmpeg => SourceError::convertible("an MP4 or MOV film"),
        Kind::Mp4(file) => match open_mp4(path, file, (decoder == Decoder::Auto).then_some(FFMPEG_FROM_PX)) {
            Ok(opened) => return Ok(opened),
            Err(error) => error,
        },
    };
    if decoder == Decoder::Builtin || !error.convertible {
        return Err(error.for_file(path));
    }
    ffmpeg::process::open(path, &error)
}

/// Opens an MP4 and checks all that can be checked by decoding no more than its first frame.
///
/// If `ffmpeg` is installed, it decodes a film of at least `ffmpeg_from_px` pixels, all frames together, that has no
/// warnings.
fn open_mp4(
    path: &Path,
    file: File,
    ffmpeg_from_px: Option<u64>,
) -> std::result::Result<Opened, SourceError> {
    let (opened, mut reader) = Mp4Reader::of(path, file)?;
    let pixels =
        reader.timeline.times_s.len() as u64 * opened.size_px.map(|side| side as u64).iter().product::<u64>();
    if ffmpeg_from_px.is_some_and(|least| pixels >= least)
        && opened.warnings.is_empty()
        && let Ok(process) = ffmpeg::process::open(path, &SourceError::damaged("an MP4 or MOV film"))
    {
        let frames = FfmpegH264::new(path, process.frames, reader.timeline.times_s, opened.size_px);
        return Ok(Opened { frames: Box::new(frames), ..opened });
    }
    // A coding tool that the decoder lacks shows in the first picture.
    reader.decode_next()?;
    Ok(Opened { frames: Box::new(prefetch(path.into(), reader)), ..opened })
}
