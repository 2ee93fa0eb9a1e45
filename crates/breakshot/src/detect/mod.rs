//! Where was each object at each instant?
//!
//! Section 4 of the paper: every frame becomes a binary image, its 8-connected components become blobs with area and
//! centroid, blobs of the markers' size become tracks that keep their object's identity through the whole clip.

mod blob;
pub mod label;

use crate::capture::Capture;
use crate::error::Result;
use crate::geometry::Point;
use crate::object::Object;
use crate::scene::Placed;
use serde::{Deserialize, Serialize};

/// Where every object of a clip was, frame by frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tracks {
    /// The file format's version.
    pub version: u32,
    /// The film.
    pub video: String,
    /// How well the camera's pose explains the tags (px, root mean square).
    pub reprojection_rms_px: f64,
    /// One track per object, in the order asked for.
    pub tracks: Vec<Track>,
    /// What the user should know.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// One object through the clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// The object; `a#2` for the second copy.
    pub object: String,
    /// In order of time; frames in which the marker was not seen are missing.
    pub samples: Vec<Sample>,
}

/// One object in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Presentation time (s).
    pub time_s: f64,
    /// The object's centroid on the table (m).
    pub x_m: f64,
    /// The object's centroid on the table (m).
    pub y_m: f64,
    /// How it is turned (rad, continuous over time); unknown where the marker cannot tell.
    pub yaw_rad: Option<f64>,
    /// Velocity (m/s), for display: estimation fits positions.
    pub vx_m_s: Option<f64>,
    /// Velocity (m/s), for display.
    pub vy_m_s: Option<f64>,
    /// Rate of turn (rad/s), for display.
    pub yaw_rate_rad_s: Option<f64>,
    /// Acceleration (m/s2), for display.
    pub ax_m_s2: Option<f64>,
    /// Acceleration (m/s2), for display.
    pub ay_m_s2: Option<f64>,
    /// One standard deviation of the position's noise along each axis (m).
    pub std_m: f64,
    /// Whether something (the striker's arm, a shadow, another marker) may have spoilt the position.
    #[serde(default)]
    pub doubtful: bool,
}

impl Sample {
    /// The object's centroid.
    pub fn position(&self) -> Point {
        Point::new(self.x_m, self.y_m)
    }
}

/// What is known about which marker belongs to which object.
#[derive(Clone, Debug, PartialEq)]
pub enum Layout {
    /// Nothing: marker shapes and object outlines must tell.
    Unknown,
    /// The struck object comes first along the strike, the others in their order behind it.
    AlongStrike {
        /// The strike's direction (rad).
        heading_rad: f64,
        /// Where the striker's centre starts, if known.
        start_m: Option<Point>,
    },
    /// Each object lay here when the clip began.
    Placed(Vec<Placed>),
}

/// How to look.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The grey level that separates marker from object, instead of the clip's own.
    pub threshold: Option<u8>,
}

#[allow(clippy::derivable_impls)]
impl Default for Options {
    fn default() -> Self {
        Self { threshold: None }
    }
}

/// One track for each of `names`, from the first to the last frame.
///
/// `frame_done` is called after each frame with the number of frames so far.
///
/// # Errors
/// A film that breaks off, fewer markers than objects, markers that cannot be told apart.
pub fn tracks(
    _capture: Capture,
    _objects: &[Object],
    _names: &[String],
    _layout: &Layout,
    _options: &Options,
) -> Result<Tracks> {
    todo!()
}

/// What lies on the table in the film's first frames (or in a picture): one pose for each of `names`.
///
/// # Errors
/// As [`tracks`].
pub fn placed(
    _capture: Capture,
    _objects: &[Object],
    _names: &[String],
    _options: &Options,
) -> Result<(Vec<Placed>, Vec<String>)> {
    todo!()
}
