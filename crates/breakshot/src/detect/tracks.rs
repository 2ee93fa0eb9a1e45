//! Where was every object, frame by frame?

use super::markerless::outline_size::OUTLINE_SIZE;
use super::striker::StrikerTrack;
use crate::capture::{CAMERA_MOVED, RECORDED_LENS};
use crate::geometry::Point;
use crate::uncertain::Measured;
use crate::warning::Cause;
use serde::{Deserialize, Serialize};

/// The tracks of all objects of one clip: the output of this stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tracks {
    /// Version of the file format.
    pub version: u32,
    /// Name of the film.
    pub video: String,
    /// Reprojection error of the camera's pose over all tag corners (px, root mean square).
    pub reprojection_rms_px: f64,
    /// The mean width of the tags' black squares over `size_m`, where lengths are those between their centres; `None` if fewer than four tags
    /// are seen, if they differ, or if one is narrower than 40 px.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag_width_ratio: Option<f64>,
    /// The camera's position in the table frame (m); `None` if it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_position_m: Option<[f64; 3]>,
    /// One track per object, in the order of the requested names.
    pub tracks: Vec<Track>,
    /// The striker's own motion; `None` where no strike is given or the film does not show it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub striker: Option<StrikerTrack>,
    /// When the striker, or its arm, has begun to move (s); `None` where no strike is given or the film does not show it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub striker_onset_s: Option<Measured>,
    /// Problems and doubtful results, in words.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// One object through the clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// Name of the object; `a#2` for the second copy of `a`.
    pub object: String,
    /// Samples in the order of time; frames in which the object was not found have none.
    pub samples: Vec<Sample>,
}

/// One object in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Presentation time (s), corrected for the rolling shutter.
    pub time_s: f64,
    /// x of the object's centroid in the table frame (m).
    pub x_m: f64,
    /// y of the object's centroid in the table frame (m).
    pub y_m: f64,
    /// Yaw (rad, continuous over time); `None` where the marker does not determine it.
    pub yaw_rad: Option<f64>,
    /// x component of the velocity (m/s), for display: estimation fits the positions.
    pub vx_m_s: Option<f64>,
    /// y component of the velocity (m/s), for display.
    pub vy_m_s: Option<f64>,
    /// Angular velocity (rad/s), for display.
    pub yaw_rate_rad_s: Option<f64>,
    /// x component of the acceleration (m/s2), for display.
    pub ax_m_s2: Option<f64>,
    /// y component of the acceleration (m/s2), for display.
    pub ay_m_s2: Option<f64>,
    /// Standard deviation of the position along each axis (m).
    pub std_m: f64,
    /// The part of it that all positions near this one have in common: that of the camera's pose (m).
    #[serde(default)]
    pub pose_std_m: f64,
    /// Whether the position may be biased, by an occlusion (the striker's arm, another marker), a shadow or the
    /// border of the image.
    #[serde(default)]
    pub doubtful: bool,
}

impl Tracks {
    /// The warnings, each with its cause.
    pub fn causes(&self) -> impl Iterator<Item = (Cause, &str)> {
        let cause = |warning: &str| {
            if warning.starts_with(CAMERA_MOVED) {
                Cause::CameraMotion
            } else if warning.starts_with(RECORDED_LENS) {
                Cause::Lens
            } else if warning.starts_with(OUTLINE_SIZE) {
                Cause::Lengths
            } else {
                Cause::Tracking
            }
        };
        self.warnings.iter().map(move |warning| (cause(warning), warning.as_str()))
    }
}

impl Sample {
    /// A sample that is not doubtful and has no derivatives.
    pub fn new(time_s: f64, position: Point, yaw_rad: Option<f64>, std_m: f64) -> Self {
        Self {
            time_s,
            x_m: position.x,
            y_m: position.y,
            yaw_rad,
            vx_m_s: None,
            vy_m_s: None,
            yaw_rate_rad_s: None,
            ax_m_s2: None,
            ay_m_s2: None,
            std_m,
            pose_std_m: 0.0,
            doubtful: false,
        }
    }

    /// The sample with a further error of this standard deviation (m), which all positions near it have in common.
    pub(super) fn with_pose_std(self, pose_std_m: f64) -> Self {
        Self { std_m: self.std_m.hypot(pose_std_m), pose_std_m, ..self }
    }

    /// Standard deviation of the noise of the position along each axis (m): without what all positions near it have in common.
    pub fn noise_std_m(&self) -> f64 {
        (self.std_m * self.std_m - self.pose_std_m * self.pose_std_m).max(0.0).sqrt()
    }

    /// The object's centroid in the table frame.
    pub fn position(&self) -> Point {
        Point::new(self.x_m, self.y_m)
    }
}
