//! What did the camera see, and from where?
//!
//! A video or a folder of pictures becomes [`Footage`]: grey frames with their presentation times.  The tags on the
//! table tell the [`Camera`]: lens, pose, and the way from a pixel to a place at any height above the table and back.

mod calibrate;
mod camera;
mod extrinsics;
mod footage;
mod homography;
mod image;
mod lens;
mod png_url;
mod pose;
mod source;
mod tags;

pub use calibrate::{Calibration, calibration};
pub use camera::{Camera, TagFit};
pub use extrinsics::camera;
pub use footage::Footage;
pub use image::{Frame, GreyImage};
pub use lens::Lens;
pub use source::Decoder;
pub use tags::tag_sheet;

#[cfg(any(test, feature = "synthetic"))]
pub(crate) use tags::{CODES, is_white};

use crate::cell::Cell;
use crate::error::Result;
use std::path::Path;

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
