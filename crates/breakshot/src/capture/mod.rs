//! What did the camera see, and from where?
//!
//! A video or a folder of pictures becomes [`Footage`]: grey frames with their presentation times.  The tags on the
//! table tell the [`Camera`]: lens, pose, and the way from a pixel to a place at any height above the table and back.

mod calibrate;
mod camera;
mod image;
mod layout;
mod lens;
mod picture;
mod pose;
mod source;
pub mod synthetic;
mod tags;

pub use calibrate::{Calibration, calibration};
pub use camera::{Camera, TagFit};
pub use layout::camera;
pub use lens::Lens;
pub use tags::tag_sheet;

use crate::cell::Cell;
use crate::error::Result;
use source::Repeats;
use std::path::Path;

/// A grey picture, row by row, 0 is black.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GreyImage {
    /// Width (px).
    pub width: usize,
    /// Height (px).
    pub height: usize,
    /// `width * height` grey levels.
    pub pixels: Vec<u8>,
}

/// One picture and when it was shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Presentation time (s); the clip's first frame is at 0.
    pub time_s: f64,
    /// The luma plane.
    pub image: GreyImage,
}

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

/// A video or a folder of pictures, read frame by frame: memory does not grow with its length.
///
/// Frames come in the order in which they are shown.  After an error, which is the last item, nothing comes.
pub struct Footage {
    name: String,
    size_px: [usize; 2],
    frame_count: Option<usize>,
    warnings: Vec<String>,
    frames: Box<dyn Iterator<Item = Result<Frame>> + Send>,
    repeats: Option<Repeats>,
}

impl Footage {
    /// Opens an H.264 MP4 or MOV, a Y4M, a PNG, or a folder of PNGs with a `timing.toml` that holds
    /// `frame_rate_hz = 60.0` or `times_s = [0.0, ...]`; any other film or picture where the program `ffmpeg` is
    /// installed.  What it is, its content tells.
    ///
    /// Presentation times, edit lists and the rotation written in the file are applied.
    ///
    /// # Errors
    /// A file of another kind or coding, one that breaks off, one whose times go back: [`Error::Video`](crate::Error)
    /// names the file, what was found and what is needed.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_with(path, Decoder::Auto)
    }

    /// As [`Footage::open`], by a decoder of one's choice.
    ///
    /// # Errors
    /// As [`Footage::open`]; also a film that needs `ffmpeg` where it is not installed.
    pub fn open_with(path: &Path, decoder: Decoder) -> Result<Self> {
        let opened = source::open(path, decoder)?;
        Ok(Self {
            name: path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
            size_px: opened.size_px,
            frame_count: opened.frame_count,
            warnings: opened.warnings,
            frames: opened.frames,
            repeats: Some(Repeats::new(opened.tick_s)),
        })
    }

    /// Frames made elsewhere, all of one size.
    pub fn from_frames(name: &str, frames: Vec<Frame>) -> Self {
        let size_px = frames.first().map_or([0, 0], |frame| [frame.image.width, frame.image.height]);
        Self {
            name: name.into(),
            size_px,
            frame_count: Some(frames.len()),
            warnings: Vec::new(),
            frames: Box::new(frames.into_iter().map(Ok)),
            repeats: Some(Repeats::default()),
        }
    }

    /// The file's name, as messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Width and height (px).
    pub fn size_px(&self) -> [usize; 2] {
        self.size_px
    }

    /// How many frames will come, where the file says so.
    pub fn frame_count(&self) -> Option<usize> {
        self.frame_count
    }

    /// What the user should know about the film: missing frames, a varying rate and, once the last frame has come,
    /// repeated pictures.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }
}

impl Iterator for Footage {
    type Item = Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        let next = self.frames.next();
        match &next {
            Some(Ok(frame)) => {
                if let Some(repeats) = &mut self.repeats {
                    repeats.see(frame);
                }
            }
            Some(Err(_)) => {
                self.frames = Box::new(std::iter::empty());
                self.repeats = None;
            }
            None => {
                self.warnings.extend(self.repeats.take().map_or(Vec::new(), |repeats| repeats.warnings()));
            }
        }
        next
    }
}

/// A film and the camera that took it.
pub struct Capture {
    /// The frames, from the first one on.
    pub footage: Footage,
    /// The camera, found from the film's own first frames.
    pub camera: Camera,
    /// The cell it was filmed in.
    pub cell: Cell,
}

/// A still scene's corners are averaged over this many first frames: more hardly lowers their noise.
const FRAMES_FOR_THE_POSE: usize = 3;

impl Capture {
    /// Finds the camera in a film's first frames, which stay in the film.
    ///
    /// # Errors
    /// As [`capture`].
    pub fn of(mut footage: Footage, cell: &Cell) -> Result<Self> {
        let first: Vec<Frame> = footage.frames.by_ref().take(FRAMES_FOR_THE_POSE).collect::<Result<_>>()?;
        let pictures: Vec<&GreyImage> = first.iter().map(|frame| &frame.image).collect();
        let camera = camera(&footage.name, &pictures, cell)?;
        footage.frames = Box::new(first.into_iter().map(Ok).chain(footage.frames));
        Ok(Self { footage, camera, cell: cell.clone() })
    }
}

/// Opens a film (MP4, Y4M, a PNG or a folder of them) and finds the camera in it.
///
/// # Errors
/// No film, a film that cannot be decoded, too few tags in view; each names the file, what was found and what is
/// needed.
pub fn capture(path: &Path, cell: &Cell) -> Result<Capture> {
    Capture::of(Footage::open(path)?, cell)
}

#[cfg(test)]
mod tests;
