//! Which frames does a film hold, and at which time was each of them taken?
//!
//! The content of a file decides what it is, never its name.  A film that cannot be read, or that ends early, is an
//! error as soon as that is known; no film is shortened silently.

mod bag;
mod catch_panic;
mod error;
mod ffmpeg;
mod h264;
mod image_files;
mod limits;
mod mp4;
mod opened;
mod picture;
mod prefetch;
mod repeats;
mod sniff;
mod timestamps;
mod y4m;

pub use catch_panic::is_decoding;
pub use image_files::colours;
pub(super) use repeats::RepeatedFrames;

use crate::error::Result;
use crate::files::FilmPath;
use error::SourceError;
use ffmpeg::h264::FfmpegH264;
use mp4::reader::Mp4Reader;
use opened::Opened;
use prefetch::prefetch;
use sniff::Kind;
use std::fs::File;
use std::hint::black_box;
use std::path::Path;
use std::sync::Once;

/// The program that decodes a film; all choices give the same frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Decoder {
    /// The built-in decoder for H.264 films of fewer than 100 million pixels, all frames together; `ffmpeg`, if it is
    /// installed, for longer ones, because it is faster, and for all other codings.
    #[default]
    Auto,
    /// The built-in decoder alone: H.264, Y4M, PNG, bags of ROS 2.
    Builtin,
    /// The program `ffmpeg` for every film that is not Y4M, PNG or a bag of ROS 2.
    Ffmpeg,
}

/// The pictures of a film that are decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pictures {
    /// All of them.
    All,
    /// Those that other pictures refer to, of an H.264 film in an MP4 or MOV; all of any other film. Of a film with B pictures this is about
    /// every second one, in about half of the time.
    References,
}

/// From this number of pixels on, all frames together, `ffmpeg` decodes a film in less time than the built-in decoder,
/// including its start of 0.05 s: 49 frames of 1080p, 13 of 4K.
const FFMPEG_FROM_PX: u64 = 100_000_000;

/// Times in a bag before 2001 (s since 1970) are those of a clock that counts from its start, as a simulated one.
const EARLIEST_UNIX_S: f64 = 1e9;

/// When a film was recorded (s since 1970), by its own header; `None` for files that do not say. A file's date tells when it was
/// copied.
pub fn recorded_unix_s(path: &Path) -> Option<f64> {
    let FilmPath { file, topic } = FilmPath::of(path);
    if file.is_dir() || matches!(sniff::of(&file), Ok(Kind::Mcap)) {
        let taken_s = bag::taken_ns(&file, topic.as_deref())? as f64 * 1e-9;
        return Some(taken_s).filter(|&taken_s| taken_s >= EARLIEST_UNIX_S);
    }
    let mut file = File::open(file).ok()?;
    let length = file.metadata().ok()?.len();
    mp4::track::recorded_unix_s(&mut file, length)
}

/// Opens the film at `path`.
///
/// `ffmpeg` decodes long H.264 films and the codings that the built-in decoder does not support, never a film that is
/// damaged.
pub(super) fn open(path: &Path, decoder: Decoder, pictures: Pictures) -> Result<Opened> {
    keep_freed_frames();
    let FilmPath { file, topic } = FilmPath::of(path);
    let error = match sniff::of(&file)? {
        Kind::Mcap => return bag::open(&file, topic.as_deref(), path),
        Kind::Folder if bag::is_bag(&file) => return bag::open(&file, topic.as_deref(), path),
        _ if topic.is_some() => {
            let found = "a topic behind `#` for a film that is no bag";
            return Err(SourceError::unsuitable(found, "no topic, or a ROS 2 bag (MCAP)").for_file(path));
        }
        Kind::Y4m(file) => return y4m::open(path, file),
        Kind::Png => return image_files::open_one(path),
        Kind::Folder => return image_files::open_folder(path),
        Kind::Other(error) => error,
        Kind::Mp4(_) if decoder == Decoder::Ffmpeg => SourceError::convertible("an MP4 or MOV film"),
        Kind::Mp4(file) => {
            // The built-in decoder skips pictures in less time than `ffmpeg` decodes all.
            let may_ffmpeg = decoder == Decoder::Auto && pictures == Pictures::All;
            match open_mp4(path, file, pictures, may_ffmpeg.then_some(FFMPEG_FROM_PX)) {
                Ok(opened) => return Ok(opened),
                Err(error) => error,
            }
        }
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
    pictures: Pictures,
    ffmpeg_from_px: Option<u64>,
) -> std::result::Result<Opened, SourceError> {
    let (opened, mut reader) = Mp4Reader::of(path, file, pictures)?;
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

/// Lets the C library keep the memory of freed frames for the next ones. By default it gives most of it back to the system, which then
/// clears every page of every frame: a tenth of the time of reading a film.
///
/// The GNU C library keeps free memory up to twice the size of the largest block that was freed, if that is at most 32 MiB (`mallopt(3)`,
/// `M_MMAP_THRESHOLD` and `M_TRIM_THRESHOLD`); other libraries are not affected.
fn keep_freed_frames() {
    const LARGEST_BYTES: usize = (32 << 20) - (64 << 10);
    static FREED: Once = Once::new();
    FREED.call_once(|| drop(black_box(Vec::<u8>::with_capacity(LARGEST_BYTES))));
}
