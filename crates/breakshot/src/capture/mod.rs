//! What did the camera see, and from where?
//!
//! A video or a folder of images becomes [`Footage`]: grey frames with their times.  The tags on the table determine the
//! [`Camera`]: lens and pose, and with them the map between pixels and points at any height above the table.

mod board;
mod calibrate;
mod camera;
mod camera_motion;
mod extrinsics;
mod footage;
mod homography;
mod image;
mod lens;
mod png_url;
mod pose;
mod recorded_lens;
mod retimed;
mod source;
mod tag_widths;
mod tags;

pub use board::{LensCalibration, LensParameter, lens_calibration};
pub use calibrate::{Calibration, TagResidual, calibration};
pub use camera::{Camera, TagFit};
pub(crate) use camera_motion::{CAMERA_MOVED, CameraMotion};
pub use extrinsics::camera;
pub use footage::Footage;
pub use image::{Frame, GreyImage};
pub use lens::Lens;
pub use png_url::PngEffort;
pub(crate) use recorded_lens::RECORDED_LENS;
pub use source::{Decoder, Pictures, colours, is_decoding, recorded_unix_s};
pub use tags::{board_sheet, tag_sheet};

#[cfg(any(test, feature = "synthetic"))]
pub(crate) use tags::{CODES, is_white};

use crate::cell::Cell;
use crate::error::Result;
use recorded_lens::with_recorded;
use std::path::Path;

/// A film and the camera that took it.
pub struct Capture {
    /// The frames, from the first one on.
    pub footage: Footage,
    /// The camera, calibrated from the film's first frames.
    pub camera: Camera,
    /// The cell it was filmed in, with the lens of the film if the cell gives none.
    pub cell: Cell,
}

/// Number of first frames over which the tags' corners are averaged: more frames hardly lower the noise.
const FRAMES_FOR_THE_POSE: usize = 3;

impl Capture {
    /// Calibrates the camera from a film's first frames, which stay in the film; its times are those of the cell's
    /// `frame_rate_hz`, unless the film has been given another. If the cell gives no lens and the film's own file does
    /// ([`Footage::intrinsics`]), that lens is taken; one that differs from the cell's lens is a warning of the camera.
    ///
    /// ```
    /// use breakshot::capture::{Camera, Capture, Footage, Lens};
    /// use breakshot::cell::{Cell, Striker, Tag, Transform, Workspace};
    /// use breakshot::geometry::Point;
    /// use breakshot::synthetic::film::{Thing, View, film};
    ///
    /// // A drawn film of four tags on the table, from a camera 1 m above it.
    /// let family = || "36h11".to_string();
    /// let tag = |id, x, y| Tag { family: family(), id, size_m: 0.06, center_m: Point::new(x, y), yaw_rad: 0.0 };
    /// let tags = vec![tag(0, -0.2, -0.12), tag(1, 0.2, -0.12), tag(2, 0.2, 0.12), tag(3, -0.2, 0.12)];
    /// let (size_px, position_m) = ([640, 480], [0.02, -0.01, 1.0]);
    /// let table_from_camera = Transform { position_m, rpy_rad: [0.0; 3] };
    /// let camera = Camera::new(size_px, Lens::pinhole(size_px, 800.0), table_from_camera);
    /// let frames = film(&View::new(camera), &[0.0], |_| tags.iter().map(Thing::tag).collect());
    ///
    /// let mut cell = Cell::from_above(800.0, Workspace::centred([0.4, 0.2]), Striker::rod(0.01, [0.1, 1.0]));
    /// cell.camera.focal_px = Some([800.0; 2]);
    /// cell.tags = tags;
    /// let capture = Capture::of(Footage::from_frames("drawn", frames), &cell)?;
    /// let height_m = capture.camera.position_m().expect("a camera with a pose")[2];
    /// assert!((height_m - 1.0).abs() < 1e-3, "the camera is {height_m} m above the table, not 1 m");
    /// # Ok::<(), breakshot::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`capture`].
    pub fn of(footage: Footage, cell: &Cell) -> Result<Self> {
        let mut footage = footage.at_frame_rate(cell.camera.frame_rate_hz);
        let first: Vec<Frame> = footage.frames.by_ref().take(FRAMES_FOR_THE_POSE).collect::<Result<_>>()?;
        let pictures: Vec<&GreyImage> = first.iter().map(|frame| &frame.image).collect();
        let (cell, mut warnings) =
            with_recorded(cell, footage.lens.take(), &footage.name, footage.size_px())?;
        let mut camera = camera(&footage.name, &pictures, &cell)?;
        warnings.append(&mut camera.warnings);
        camera.warnings = warnings;
        footage.frames = Box::new(first.into_iter().map(Ok).chain(footage.frames));
        Ok(Self { footage, camera, cell })
    }
}

/// Opens a film (MP4, Y4M, a PNG or a folder of them) and calibrates the camera from it.
///
/// # Errors
/// No film, a film that cannot be decoded, too few tags in view; each names the file, what was found and what is
/// needed.
pub fn capture(path: &Path, cell: &Cell) -> Result<Capture> {
    Capture::of(Footage::open(path)?, cell)
}

#[cfg(test)]
mod tests;
