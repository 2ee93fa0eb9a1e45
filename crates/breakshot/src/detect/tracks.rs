//! Where was every object, frame by frame?

use crate::geometry::Point;
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
