//! What the clips of a campaign told one by one, kept so that later clips can join them without the old films.

use crate::cell::{CameraSpec, Cell, ReferencePoint, Striker, Tag};
use crate::object::Object;
use serde::{Deserialize, Serialize};

/// What was filmed with, what was filmed, and what each clip told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evidence {
    /// The cell, as far as measurements depend on it.
    pub filmed_with: FilmedWith,
    /// What a ruler told of the objects.
    pub objects: Vec<Object>,
    /// The clips, in the order in which they were given.
    pub clips: Vec<ClipRecord>,
}

/// What one clip told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClipRecord {
    /// The clip's name.
    pub clip: String,
    /// A number that another clip would only share if it were the same.
    pub fingerprint: String,
    /// Its objects, the struck one first; copies by their own names.
    pub objects: Vec<String>,
    /// What estimation needs to hear of it again.
    pub told: serde_json::Value,
}

/// The parts of a cell that measurements depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilmedWith {
    /// The camera; of a `camera_info` file only its name.
    pub camera: CameraSpec,
    /// AprilTags lying on the table.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tags: Vec<Tag>,
    /// Points of the table whose pixels are known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<ReferencePoint>,
    /// The scale of a camera that looks straight down (px per m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale_px_per_m: Option<f64>,
    /// What strikes.
    pub striker: Striker,
}

impl FilmedWith {
    /// Those parts of a cell.
    pub fn new(cell: &Cell) -> Self {
        let mut camera = cell.camera.clone();
        camera.camera_info = camera.camera_info.and_then(|path| path.file_name().map(Into::into));
        Self {
            camera,
            tags: cell.tags.clone(),
            points: cell.points.clone(),
            scale_px_per_m: cell.scale_px_per_m,
            striker: cell.striker.clone(),
        }
    }

    /// The first part that differs from an earlier cell's, what it is and what it was; none if all are the same.
    ///
    /// The striker's range of speeds may change: no measurement rests on it.
    pub fn difference(&self, then: &Self) -> Option<(String, String, String)> {
        let told = |what: &str, now: String, was: String| Some((what.to_owned(), now, was));
        if self.camera != then.camera {
            return told("camera", format!("{:?}", self.camera), format!("{:?}", then.camera));
        }
        if self.tags.len() != then.tags.len() {
            return told("tags", format!("{} tags", self.tags.len()), format!("{} tags", then.tags.len()));
        }
        if let Some((now, was)) = self.tags.iter().zip(&then.tags).find(|(now, was)| now != was) {
            return told(&format!("tag {}", now.id), format!("{now:?}"), format!("{was:?}"));
        }
        if self.points != then.points {
            return told("points", format!("{:?}", self.points), format!("{:?}", then.points));
        }
        if self.scale_px_per_m != then.scale_px_per_m {
            return told(
                "scale_px_per_m",
                format!("{:?}", self.scale_px_per_m),
                format!("{:?}", then.scale_px_per_m),
            );
        }
        let measured = |s: &Striker| (s.shape.clone(), s.height_m, s.retract_speed_m_s);
        let (now, was) = (measured(&self.striker), measured(&then.striker));
        if now == was { None } else { told("striker", format!("{now:?}"), format!("{was:?}")) }
    }
}
