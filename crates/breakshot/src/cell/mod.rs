//! The robot cell: camera, tags on the table, workspace, striker, robot (`cell.toml`).

mod board;
pub(crate) mod camera_info;
mod distortion;
mod tag_widths;
pub(crate) mod xml;
pub(crate) mod yaml;

use crate::error::bounds::{self, angle, length, position, positive, zero_or_more};
use crate::error::{Error, Result};
use crate::geometry::{Pixel, Point};
use crate::object::Shape;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

pub use board::Board;
pub use distortion::{Distortion, DistortionModel};
pub(crate) use tag_widths::width_warning;

/// Everything that stays the same from strike to strike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// The file format's version.
    #[serde(default = "one")]
    pub version: u32,
    /// The lens and the sensor.
    #[serde(default)]
    pub camera: CameraSpec,
    /// AprilTags lying on the table.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tags: Vec<Tag>,
    /// Points of the table whose pixels the user read off, for a cell without tags.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<ReferencePoint>,
    /// The scale of a camera that looks straight down (px per m), for a cell with neither tags nor points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale_px_per_m: Option<f64>,
    /// Where objects may lie.
    pub workspace: Workspace,
    /// The table's edge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<Table>,
    /// What strikes; [`Striker::none`] where nothing does, in a cell of tracks without strikes.
    #[serde(default = "Striker::none", skip_serializing_if = "Striker::is_none")]
    pub striker: Striker,
    /// The arm that moves it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<RobotSpec>,
}

/// The lens and the sensor, in OpenCV's conventions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// Width and height of the picture (px).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image_size_px: Option<[u32; 2]>,
    /// Focal lengths fx and fy (px).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focal_px: Option<[f64; 2]>,
    /// The principal point cx and cy (px).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center_px: Option<[f64; 2]>,
    /// The coefficients of the distortion model, in OpenCV's order; missing ones are zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distortion: Option<Vec<f64>>,
    /// The distortion model; `plumb_bob` (k1 k2 p1 p2 k3) if it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distortion_model: Option<DistortionModel>,
    /// A calibration file of ROS, OpenCV or Kalibr instead of the keys above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_info: Option<CameraInfo>,
    /// The scale of a camera that looks straight down (px per m); the top level of the file accepts the same key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale_px_per_m: Option<f64>,
    /// How long a rolling shutter takes from the first to the last row (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readout_s: Option<f64>,
    /// How long the shutter stays open (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_s: Option<f64>,
    /// The rate at which films are taken, where their files say another (Hz).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame_rate_hz: Option<f64>,
    /// How thick the tags are (m): their faces lie so far above the table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag_thickness_m: Option<f64>,
}

/// A calibration file of ROS, OpenCV or Kalibr and the intrinsics read from it.
///
/// Serialized as the path alone: a cell that was read from the JSON copy in a plan has no intrinsics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "PathBuf", into = "PathBuf")]
pub struct CameraInfo {
    /// The file; `camchain.yaml#cam1` names one of the cameras of a Kalibr file.
    pub path: PathBuf,
    /// The file's values; `None` unless [`load_cell`](crate::files::load_cell) has read them.
    pub intrinsics: Option<Intrinsics>,
}

impl CameraInfo {
    /// The file itself, and the name of the camera after a `#`.
    pub fn file_and_camera(&self) -> (PathBuf, Option<String>) {
        let name = self.path.file_name().and_then(|name| name.to_str());
        match name.and_then(|name| name.rsplit_once('#')) {
            // A `#` before the extension is part of the file's name.
            Some((file, camera)) if !file.is_empty() && !camera.contains('.') => {
                (self.path.with_file_name(file), Some(camera.to_owned()))
            }
            _ => (self.path.clone(), None),
        }
    }
}

impl From<PathBuf> for CameraInfo {
    fn from(path: PathBuf) -> Self {
        Self { path, intrinsics: None }
    }
}

impl From<CameraInfo> for PathBuf {
    fn from(info: CameraInfo) -> Self {
        info.path
    }
}

/// The calibrated intrinsics of a camera, in OpenCV's conventions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Width and height of the calibrated image (px).
    pub image_size_px: [u32; 2],
    /// Focal lengths fx and fy (px).
    pub focal_px: [f64; 2],
    /// The principal point cx and cy (px).
    pub center_px: [f64; 2],
    /// The distortion model and its coefficients.
    pub distortion: Distortion,
}

impl CameraSpec {
    /// The same camera with the values of its `camera_info` file in its own keys.
    ///
    /// # Errors
    /// The lens is given twice, or the `camera_info` file has not been read.
    pub(crate) fn resolved(&self, file: &str) -> Result<Self> {
        self.check_lens_given_once(file)?;
        let Some(info) = &self.camera_info else { return Ok(self.clone()) };
        let Some(intrinsics) = info.intrinsics else {
            let found = format!("`{}`, which was not read", info.path.display());
            let needed = "a cell read from its cell.toml, or focal_px, center_px and distortion";
            return Err(Error::invalid(file, "camera.camera_info", found, needed));
        };
        Ok(self.with_intrinsics(intrinsics))
    }

    /// The same camera with these intrinsics in its own keys.
    pub(crate) fn with_intrinsics(&self, intrinsics: Intrinsics) -> Self {
        Self {
            image_size_px: Some(intrinsics.image_size_px),
            focal_px: Some(intrinsics.focal_px),
            center_px: Some(intrinsics.center_px),
            distortion: Some(intrinsics.distortion.coefficients().to_vec()),
            distortion_model: match intrinsics.distortion.model() {
                DistortionModel::PlumbBob => None,
                model => Some(model),
            },
            camera_info: None,
            ..self.clone()
        }
    }

    /// Whether the cell says anything about the lens.
    pub(crate) fn gives_lens(&self) -> bool {
        self.camera_info.is_some() || self.has_lens_keys()
    }

    fn has_lens_keys(&self) -> bool {
        let distortion_given = self.distortion.is_some() || self.distortion_model.is_some();
        self.focal_px.is_some() || self.center_px.is_some() || distortion_given
    }

    /// The distortion that the keys give; none without them.
    ///
    /// # Errors
    /// Coefficients that are not numbers or that the model does not have, a model without coefficients.
    pub(crate) fn own_distortion(&self, file: &str) -> Result<Option<Distortion>> {
        let Some(coefficients) = &self.distortion else {
            return match self.distortion_model {
                Some(model) if self.camera_info.is_none() => {
                    let needed = format!("distortion = [{}]", model.coefficient_names().join(", "));
                    Err(Error::invalid(
                        file,
                        "camera.distortion",
                        "not given beside distortion_model",
                        needed,
                    ))
                }
                _ => Ok(None),
            };
        };
        Distortion::new(self.distortion_model.unwrap_or_default(), coefficients)
            .map(Some)
            .map_err(|needed| Error::invalid(file, "camera.distortion", format!("{coefficients:?}"), needed))
    }

    fn check_lens_given_once(&self, file: &str) -> Result<()> {
        if self.camera_info.is_some() && self.has_lens_keys() {
            let needed = "the lens once: camera_info, or focal_px, center_px and distortion";
            return Err(Error::invalid(file, "camera", "both camera_info and the lens's own keys", needed));
        }
        Ok(())
    }
}

/// An AprilTag lying flat on the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tag {
    /// The family; `36h11` is the one that is read.
    #[serde(default = "family_36h11")]
    pub family: String,
    /// Its number.
    pub id: u32,
    /// The side of its black square (m).
    pub size_m: f64,
    /// The centre of its black square.
    pub center_m: Point,
    /// Rotation of its top edge (rad); at 0 the tag is upright in a view with x to the right and y up.
    #[serde(default)]
    pub yaw_rad: f64,
}

/// A point of the table whose pixel is known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferencePoint {
    /// In the picture.
    pub image_px: Pixel,
    /// On the table.
    pub table_m: Point,
}

/// A rectangle along the table's axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Workspace {
    /// Its lower left corner.
    pub min_m: Point,
    /// Its upper right corner.
    pub max_m: Point,
}

impl Workspace {
    /// So long and so wide, the table's origin in the middle.
    pub fn centred([x_m, y_m]: [f64; 2]) -> Self {
        Self { min_m: Point::new(-0.5 * x_m, -0.5 * y_m), max_m: Point::new(0.5 * x_m, 0.5 * y_m) }
    }

    /// Whether a point lies inside or on the edge.
    pub fn contains(&self, point: Point) -> bool {
        (self.min_m.x..=self.max_m.x).contains(&point.x) && (self.min_m.y..=self.max_m.y).contains(&point.y)
    }
}

/// The table top; an object whose centre passes its outline has fallen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Corner points, counter-clockwise (m).
    pub outline_m: Vec<Point>,
}

/// What strikes: a convex body that the robot moves along a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Striker {
    /// Its outline from above; the x axis points along the strike.
    pub shape: Shape,
    /// Its height (m).
    pub height_m: f64,
    /// The slowest and the fastest strike (m/s).
    pub speed_range_m_s: [f64; 2],
    /// How fast it draws back after the strike (m/s).
    #[serde(default = "retract_speed_m_s")]
    pub retract_speed_m_s: f64,
}

impl Striker {
    /// An upright rod, 0.1 m high, that draws back at 0.15 m/s.
    pub fn rod(radius_m: f64, speed_range_m_s: [f64; 2]) -> Self {
        let retract_speed_m_s = retract_speed_m_s();
        Self { shape: Shape::Disc { radius_m }, height_m: 0.1, speed_range_m_s, retract_speed_m_s }
    }

    /// No striker: a point of no height that never moves. No strike can be simulated with it.
    pub fn none() -> Self {
        let shape = Shape::Disc { radius_m: 0.0 };
        Self { shape, height_m: 0.0, speed_range_m_s: [0.0; 2], retract_speed_m_s: 0.0 }
    }

    /// Whether this is [`Striker::none`].
    pub fn is_none(&self) -> bool {
        *self == Self::none()
    }
}

/// The arm and the pose of its base.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotSpec {
    /// `indy7`, or a URDF file.
    pub arm: String,
    /// The URDF's text, if `arm` is a file; filled in by [`crate::files::load_arm`].
    #[serde(skip)]
    pub urdf: Option<String>,
    /// The link of the URDF that the tool is screwed to, where that is not clear.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flange: Option<String>,
    /// Where the table's frame lies in the robot's base frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_from_table: Option<Transform>,
    /// From the flange to the striker's tip, in the flange's frame (m).
    #[serde(default)]
    pub tool_offset_m: [f64; 3],
    /// What the striker weighs (kg).
    #[serde(default)]
    pub tool_mass_kg: f64,
    /// Each joint's rotor inertia as felt at the joint (kg m2), where known: the rotor's own times the gear ratio squared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub armature_kg_m2: Option<Vec<f64>>,
    /// The joint angles the arm waits at before a strike (rad).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub home_rad: Option<Vec<f64>>,
    /// How high above the table the striker's tip runs (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strike_height_m: Option<f64>,
}

impl RobotSpec {
    /// Checks the numbers that do not depend on the arm; errors name `owner`.
    fn check(&self, owner: &str) -> Result<()> {
        if let Some(base) = &self.base_from_table {
            position(owner, "base_from_table.position_m", &base.position_m)?;
            base.rpy_rad.iter().try_for_each(|q| angle(owner, "base_from_table.rpy_rad", *q))?;
        }
        position(owner, "tool_offset_m", &self.tool_offset_m)?;
        zero_or_more(owner, "tool_mass_kg", self.tool_mass_kg, "kilograms")?;
        for value in self.armature_kg_m2.iter().flatten() {
            zero_or_more(owner, "armature_kg_m2", *value, "kg m2")?;
        }
        self.home_rad.iter().flatten().try_for_each(|q| angle(owner, "home_rad", *q))?;
        self.strike_height_m.map_or(Ok(()), |height_m| length(owner, "strike_height_m", height_m))
    }

    /// Whether the arm is a URDF file, not a built-in model.
    pub fn is_file(&self) -> bool {
        Path::new(&self.arm).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("urdf"))
    }
}

/// A rigid motion in space: first rotated about the fixed axes x, y, z, then translated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Transform {
    /// The move (m).
    pub position_m: [f64; 3],
    /// Roll, pitch, yaw (rad).
    #[serde(default)]
    pub rpy_rad: [f64; 3],
}

fn one() -> u32 {
    1
}

fn family_36h11() -> String {
    "36h11".into()
}

fn retract_speed_m_s() -> f64 {
    0.15
}

impl Cell {
    /// A cell with a camera that looks straight down at this scale (px per m), and without an arm.
    pub fn from_above(scale_px_per_m: f64, workspace: Workspace, striker: Striker) -> Self {
        Self {
            version: one(),
            camera: CameraSpec::default(),
            tags: Vec::new(),
            points: Vec::new(),
            scale_px_per_m: Some(scale_px_per_m),
            workspace,
            table: None,
            striker,
            robot: None,
        }
    }

    /// The scale of a camera that looks straight down, wherever the file gave it (px per m).
    pub fn scale_px_per_m(&self) -> Option<f64> {
        self.scale_px_per_m.or(self.camera.scale_px_per_m)
    }

    /// Whether the cell says anything about a camera; a cell of tracks needs none.
    pub fn has_camera(&self) -> bool {
        let pose = !self.tags.is_empty() || !self.points.is_empty() || self.scale_px_per_m().is_some();
        pose || self.camera != CameraSpec::default()
    }

    /// An error that names the missing section unless the cell has a striker.
    ///
    /// # Errors
    /// A cell without `[striker]`; `file` is the cell's name in messages.
    pub fn require_striker(&self, file: &str) -> Result<()> {
        if !self.striker.is_none() {
            return Ok(());
        }
        let needed = "[striker] with shape, height_m and speed_range_m_s";
        Err(Error::invalid(file, "striker", "missing", needed))
    }

    /// An error unless the cell says what is needed to find the pose of its camera.
    ///
    /// # Errors
    /// No tags, no scale, and fewer than four points; `file` is the cell's name in messages.
    pub fn require_camera_pose(&self, file: &str) -> Result<()> {
        if self.tags.is_empty() && self.points.is_empty() && self.scale_px_per_m().is_none() {
            let needed = "[[tags]], four or more [[points]], or scale_px_per_m";
            return Err(Error::invalid(file, "camera pose", "no information about it", needed));
        }
        if self.tags.is_empty() && !self.points.is_empty() && self.points.len() < 4 {
            let found = format!("{} [[points]]", self.points.len());
            return Err(Error::invalid(file, "camera pose", found, "four or more [[points]]"));
        }
        Ok(())
    }

    /// An error that names the key unless every number is possible. A cell may have no camera and no striker.
    ///
    /// # Errors
    /// The first key of `file` (the cell's name in messages) that cannot be, with what was found and what is needed.
    pub fn check(&mut self, file: &str) -> Result<()> {
        if self.has_camera() {
            self.check_camera(file)?;
            self.require_camera_pose(file)?;
        }
        self.check_tags(file)?;
        for (k, point) in self.points.iter().enumerate() {
            position(file, &format!("points[{k}].table_m"), &[point.table_m.x, point.table_m.y])?;
            if !(point.image_px.x.is_finite() && point.image_px.y.is_finite()) {
                let what = format!("points[{k}].image_px");
                return Err(Error::invalid(file, what, "not a number", "two numbers in px"));
            }
        }
        let Workspace { min_m, max_m } = self.workspace;
        position(file, "workspace", &[min_m.x, min_m.y, max_m.x, max_m.y])?;
        if !(min_m.x < max_m.x && min_m.y < max_m.y) {
            let found = format!("from ({}, {}) to ({}, {})", min_m.x, min_m.y, max_m.x, max_m.y);
            return Err(Error::invalid(file, "workspace", found, "min_m below max_m in both axes"));
        }
        if let Some(table) = &self.table {
            let mut outline = Shape::Polygon { points_m: table.outline_m.clone() };
            outline.check_and_centre(&format!("{file}: table.outline_m"))?;
        }
        if let Some(robot) = &self.robot {
            robot.check(&format!("{file}: robot"))?;
        }
        self.check_striker(file)
    }

    fn check_camera(&self, file: &str) -> Result<()> {
        let camera = &self.camera;
        camera.check_lens_given_once(file)?;
        for (what, pair) in [("camera.focal_px", camera.focal_px), ("camera.center_px", camera.center_px)] {
            for value in pair.into_iter().flatten() {
                positive(file, what, value)?;
            }
        }
        for (what, value) in
            [("scale_px_per_m", self.scale_px_per_m()), ("camera.exposure_s", camera.exposure_s)]
        {
            if let Some(value) = value {
                positive(file, what, value)?;
            }
        }
        for (what, value, unit) in [
            ("camera.readout_s", camera.readout_s, "seconds"),
            ("camera.tag_thickness_m", camera.tag_thickness_m, "metres"),
        ] {
            if let Some(value) = value {
                zero_or_more(file, what, value, unit)?;
            }
        }
        if let Some(rate_hz) = camera.frame_rate_hz {
            bounds::frame_rate(file, "camera.frame_rate_hz", rate_hz)?;
        }
        camera.own_distortion(file)?;
        if let Some([width, height]) = camera.image_size_px
            && (width == 0 || height == 0)
        {
            let found = format!("{width} x {height}");
            return Err(Error::invalid(file, "camera.image_size_px", found, "a picture with pixels"));
        }
        Ok(())
    }

    fn check_tags(&self, file: &str) -> Result<()> {
        for (k, tag) in self.tags.iter().enumerate() {
            let owner = format!("{file}: tag {}", tag.id);
            if tag.family.trim_start_matches("tag") != "36h11" {
                return Err(Error::invalid(owner, "family", format!("`{}`", tag.family), "`36h11`"));
            }
            length(&owner, "size_m", tag.size_m)?;
            position(&owner, "center_m", &[tag.center_m.x, tag.center_m.y])?;
            angle(&owner, "yaw_rad", tag.yaw_rad)?;
            if self.tags[..k].iter().any(|other| other.id == tag.id) {
                return Err(Error::invalid(owner, "id", "given twice", "every tag once"));
            }
        }
        Ok(())
    }

    fn check_striker(&mut self, file: &str) -> Result<()> {
        if self.striker.is_none() {
            return Ok(());
        }
        let owner = format!("{file}: striker");
        self.striker.shape.check_and_centre(&owner)?;
        length(&owner, "height_m", self.striker.height_m)?;
        let [slowest, fastest] = self.striker.speed_range_m_s;
        for (what, speed_m_s) in [
            ("retract_speed_m_s", self.striker.retract_speed_m_s),
            ("speed_range_m_s[0]", slowest),
            ("speed_range_m_s[1]", fastest),
        ] {
            bounds::strike_speed(&owner, what, speed_m_s)?;
        }
        if slowest > fastest {
            let found = format!("[{slowest}, {fastest}]");
            return Err(Error::invalid(owner, "speed_range_m_s", found, "the slower speed first"));
        }
        Ok(())
    }
}
