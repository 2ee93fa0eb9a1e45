//! The measurements of the single clips of a campaign, stored so that an estimate can be updated without the old
//! films.

use crate::cell::{CameraSpec, Cell, ReferencePoint, Striker, Tag};
use crate::object::Object;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The cell, the objects and the measurements of each clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evidence {
    /// The parts of the cell that measurements depend on.
    pub filmed_with: FilmedWith,
    /// The objects as measured with a ruler.
    pub objects: Vec<Object>,
    /// The clips in the order of the campaign.
    pub clips: Vec<ClipRecord>,
}

/// The measurements of one clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClipRecord {
    /// Name of the clip.
    pub clip: String,
    /// Hash of the clip's tracks, which identifies a clip whatever its name is.
    pub fingerprint: String,
    /// Names of its objects, the struck one first; copies as `a#2`.
    pub objects: Vec<String>,
    /// The clip's measurements, in the form that `estimate` defines.
    #[serde(rename = "told")]
    pub measurements: serde_json::Value,
}

/// A part of a cell that differs from that of an earlier one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Name of the part.
    pub part: String,
    /// The part now.
    pub now: String,
    /// The part of the earlier cell.
    pub before: String,
}

/// The parts of a cell that measurements depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilmedWith {
    /// The camera; of the path of a `camera_info` file only the file name.
    pub camera: CameraSpec,
    /// AprilTags on the table.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tags: Vec<Tag>,
    /// Points of the table with known pixels.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<ReferencePoint>,
    /// Scale of a camera that looks straight down (px per m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale_px_per_m: Option<f64>,
    /// The striker; none for tracks without strikes.
    #[serde(default = "Striker::none", skip_serializing_if = "Striker::is_none")]
    pub striker: Striker,
}

impl FilmedWith {
    /// The parts of the given cell.
    pub fn new(cell: &Cell) -> Self {
        let mut camera = cell.camera.clone();
        camera.camera_info =
            camera.camera_info.and_then(|info| info.path.file_name().map(|name| PathBuf::from(name).into()));
        // The rate has set the times of the films; others may have been taken at another.
        camera.frame_rate_hz = None;
        Self {
            camera,
            tags: cell.tags.clone(),
            points: cell.points.clone(),
            scale_px_per_m: cell.scale_px_per_m,
            striker: cell.striker.clone(),
        }
    }

    /// The first part that differs from that of an earlier cell; `None` if all are equal.
    ///
    /// The striker's range of speeds may change: no measurement depends on it.
    pub fn difference(&self, earlier: &Self) -> Option<Difference> {
        let difference =
            |part: &str, now: String, before: String| Some(Difference { part: part.to_owned(), now, before });
        if self.camera != earlier.camera {
            return difference("camera", format!("{:?}", self.camera), format!("{:?}", earlier.camera));
        }
        if self.tags.len() != earlier.tags.len() {
            return difference(
                "tags",
                format!("{} tags", self.tags.len()),
                format!("{} tags", earlier.tags.len()),
            );
        }
        if let Some((now, before)) = self.tags.iter().zip(&earlier.tags).find(|(now, before)| now != before) {
            return difference(&format!("tag {}", now.id), format!("{now:?}"), format!("{before:?}"));
        }
        if self.points != earlier.points {
            return difference("points", format!("{:?}", self.points), format!("{:?}", earlier.points));
        }
        if self.scale_px_per_m != earlier.scale_px_per_m {
            return difference(
                "scale_px_per_m",
                format!("{:?}", self.scale_px_per_m),
                format!("{:?}", earlier.scale_px_per_m),
            );
        }
        let measured = |s: &Striker| (s.shape.clone(), s.height_m, s.retract_speed_m_s);
        let (now, before) = (measured(&self.striker), measured(&earlier.striker));
        if now == before { None } else { difference("striker", format!("{now:?}"), format!("{before:?}")) }
    }
}
