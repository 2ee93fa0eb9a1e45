//! The frames of a film, one after the other.

use super::image::{Frame, GreyImage};
use super::recorded_lens::RecordedLens;
use super::retimed::RetimedFrames;
use super::source::{self, Decoder, Pictures, RepeatedFrames};
use crate::cell::Intrinsics;
use crate::error::{Error, Result};
use crate::files::FilmPath;
use std::path::Path;

/// A video or a folder of pictures, read frame by frame: memory does not grow with its length.
///
/// Frames come in display order.  An error is the last item.
pub struct Footage {
    pub(super) name: String,
    size_px: [usize; 2],
    frame_count: Option<usize>,
    warnings: Vec<String>,
    pub(super) frames: Box<dyn Iterator<Item = Result<Frame>> + Send>,
    repeats: Option<RepeatedFrames>,
    /// Whether the times are those of a rate that was given.
    is_retimed: bool,
    /// The lens that the film's own file gives.
    pub(super) lens: Option<RecordedLens>,
}

impl Footage {
    /// Opens an H.264 MP4 or MOV, a Y4M, a PNG, a folder of PNGs with a `timing.toml` that holds
    /// `frame_rate_hz = 60.0` or `times_s = [0.0, ...]`, or a bag of ROS 2 (MCAP, or a folder of them), behind whose name
    /// `#` and a topic may stand; any other film or picture if the program `ffmpeg` is
    /// installed.  The content of the file decides its format, not its name.
    ///
    /// Presentation times, edit lists and the rotation written in the file are applied.
    ///
    /// # Errors
    /// A file of another format or coding, one that ends early, one whose times go back: [`Error::Video`](crate::Error)
    /// names the file, what was found and what is needed.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_with(path, Decoder::Auto)
    }

    /// As [`Footage::open`], with the given decoder.
    ///
    /// # Errors
    /// As [`Footage::open`]; also a film that needs `ffmpeg` if it is not installed.
    pub fn open_with(path: &Path, decoder: Decoder) -> Result<Self> {
        Self::open_pictures(path, decoder, Pictures::All)
    }

    /// As [`Footage::open_with`], with a part of the pictures; [`Footage::frame_count`] counts all of them.
    ///
    /// # Errors
    /// As [`Footage::open_with`].
    pub fn open_pictures(path: &Path, decoder: Decoder, pictures: Pictures) -> Result<Self> {
        let opened = source::open(path, decoder, pictures)?;
        let file = FilmPath::of(path).file;
        Ok(Self {
            name: file.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
            size_px: opened.size_px,
            frame_count: opened.frame_count,
            warnings: opened.warnings,
            frames: opened.frames,
            repeats: Some(RepeatedFrames::new(opened.tick_s)),
            is_retimed: false,
            lens: opened.lens,
        })
    }

    /// A film from frames in memory, all of one size.
    pub fn from_frames(name: &str, frames: Vec<Frame>) -> Self {
        let size_px = frames.first().map_or([0, 0], |frame| [frame.image.width, frame.image.height]);
        Self {
            name: name.into(),
            size_px,
            frame_count: Some(frames.len()),
            warnings: Vec::new(),
            frames: Box::new(frames.into_iter().map(Ok)),
            repeats: Some(RepeatedFrames::default()),
            is_retimed: false,
            lens: None,
        }
    }

    /// The same film, taken at `rate_hz` frames a second where its file says another rate.
    ///
    /// Regular times become multiples of the true interval, to the bit those of a file that says the true rate; irregular ones
    /// keep their proportions. The first rate that is given counts: a film is not retimed twice. Without a rate the film stays as it is.
    #[must_use]
    pub fn at_frame_rate(mut self, rate_hz: impl Into<Option<f64>>) -> Self {
        if let (Some(rate_hz), false) = (rate_hz.into(), self.is_retimed) {
            self.frames = Box::new(RetimedFrames::new(self.frames, rate_hz));
            self.is_retimed = true;
        }
        self
    }

    /// The same film; it ends with [`Error::Stopped`] at the first frame at which `stopped` holds.
    #[must_use]
    pub fn until(mut self, stopped: impl Fn() -> bool + Send + 'static) -> Self {
        self.frames =
            Box::new(self.frames.map(move |frame| if stopped() { Err(Error::Stopped) } else { frame }));
        self
    }

    /// The file's name, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Width and height (px).
    pub fn size_px(&self) -> [usize; 2] {
        self.size_px
    }

    /// The number of frames, if the file holds it.
    pub fn frame_count(&self) -> Option<usize> {
        self.frame_count
    }

    /// The lens that the film's own file gives: of a bag the `CameraInfo` that belongs to the images, of other films none.
    ///
    /// The error is that of a damaged message or of a lens that is not supported. [`Capture::of`](super::Capture::of) uses the lens if the cell
    /// gives none; the footage in the capture has it no longer.
    pub fn intrinsics(&self) -> Option<std::result::Result<&Intrinsics, &Error>> {
        self.lens.as_ref().map(|lens| lens.intrinsics.as_ref())
    }

    /// Warnings about the film: missing frames, a variable rate and, after the last frame, repeated frames.
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
                    repeats.push(frame);
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

impl Footage {
    /// The next frame's image, which stays in the film; `None` at its end or at an error.
    pub(crate) fn first_image(&mut self) -> Option<GreyImage> {
        let next = self.frames.next()?;
        let image = next.as_ref().ok().map(|frame| frame.image.clone());
        let rest = std::mem::replace(&mut self.frames, Box::new(std::iter::empty()));
        self.frames = Box::new(std::iter::once(next).chain(rest));
        image
    }

    /// The same film; `observe` is called with every frame when it is read.
    ///
    /// With it a second user of the frames needs no second pass through the decoder.
    #[must_use]
    pub fn observed(mut self, mut observe: impl FnMut(&Frame) + Send + 'static) -> Self {
        self.frames = Box::new(self.frames.inspect(move |frame| {
            if let Ok(frame) = frame {
                observe(frame);
            }
        }));
        self
    }
}
