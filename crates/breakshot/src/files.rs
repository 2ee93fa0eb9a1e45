//! The formats on disk: TOML that people write, JSON that programs exchange.
//!
//! Everything is checked while it is loaded: an unknown key names its nearest known one, an impossible number
//! names its object.  Results are written whole or not at all.
//!
//! The loaders are generic over the path, and so are the private functions that call them. The parsers of these formats are therefore
//! compiled in the program that calls a loader and not in the library, which would build longer (ARCHITECTURE.md, "Building").

mod board;
mod campaign_file;
mod content;
mod film_path;
mod finished;
mod temporary;
mod unfinished;
mod whole;

use crate::cell::camera_info;
use crate::cell::{CameraInfo, Cell, Intrinsics, RobotSpec};
use crate::error::{Error, Result};
use crate::geometry::Point;
use crate::object::Object;
use crate::properties::Properties;
use crate::scene::{Goal, KeepOut, Placed, Scene, Strike, Wall};
pub use board::load_board;
pub use campaign_file::{campaign_of, load_campaign, repeats};
pub use content::clip_input;
pub use film_path::FilmPath;
pub use finished::{read_finished, write_finished};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::{Path, PathBuf};
pub use unfinished::Unfinished;
pub use whole::{check_file_name, write_whole};

/// A value from a file, and warnings for the user about how it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded<T> {
    /// The value.
    pub value: T,
    /// What was changed while reading, such as a polygon's origin moved to its centroid.
    pub notes: Vec<String>,
}

/// The file's name as messages call it.
fn label(path: &Path) -> String {
    path.display().to_string()
}

/// Largest size of a file of text (bytes): the properties of a campaign of a thousand clips have a tenth of it.
const MOST_BYTES: u64 = 512 << 20;

/// A whole text file.
pub(crate) fn text(path: &Path) -> Result<String> {
    let failed = |source| Error::Read { path: path.into(), source };
    let mut text = String::new();
    let file = std::fs::File::open(path).map_err(failed)?;
    file.take(MOST_BYTES + 1).read_to_string(&mut text).map_err(failed)?;
    if text.len() as u64 > MOST_BYTES {
        let needed = format!("at most {} MiB", MOST_BYTES >> 20);
        return Err(Error::invalid(label(path), "its size", "larger", needed));
    }
    Ok(text)
}

/// The text of a file of tracks, for [`recorded_tracks`](crate::detect::recorded_tracks); letters that are not UTF-8 are
/// replaced.
///
/// # Errors
/// Unreadable, or larger than 64 MiB.
pub fn tracks_text(path: &Path) -> Result<String> {
    /// About a million samples.
    const MOST_BYTES: u64 = 64 << 20;
    let unreadable = |source| Error::Read { path: path.into(), source };
    let mut bytes = Vec::new();
    let file = std::fs::File::open(path).map_err(unreadable)?;
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(Error::invalid(label(path), "size", "more than 64 MiB", "tracks of one clip"));
    }
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// A TOML file as `T`.
///
/// # Errors
/// Unreadable, not TOML, unknown keys, values of the wrong kind.
pub fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T> {
    parsed_toml(path, &text(path)?, "a file")
}

/// The text of a TOML file as `T`; `kind` says what file is needed, as `a cell file`.
fn parsed_toml<T: DeserializeOwned>(path: &Path, text: &str, kind: &str) -> Result<T> {
    let line = |e: &toml::de::Error| {
        e.span().map(|span| 1 + text[..span.start.min(text.len())].matches('\n').count())
    };
    let document = toml::Deserializer::parse(text).map_err(|e| {
        let problem = format!("{}{}; needed: {kind} in TOML", e.message(), at_line(line(&e)));
        Error::Syntax { path: path.into(), problem }
    })?;
    T::deserialize(document).map_err(|e| syntax_error(path, e.message(), line(&e)))
}

/// A JSON file as `T`.
///
/// # Errors
/// Unreadable, not JSON, unknown keys, values of the wrong kind.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    json_of(path, &text(path)?)
}

/// The JSON text that is, or would be, the file at `path`, as `T`.
///
/// # Errors
/// As [`read_json`].
pub fn json_of<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T> {
    serde_json::from_str(text).map_err(|e| {
        let message = e.to_string();
        let message = &message[..message.find(" at line ").unwrap_or(message.len())];
        if e.is_data() {
            return syntax_error(path, message, Some(e.line()));
        }
        let problem = format!("{message}{}; needed: a file in JSON", at_line(Some(e.line())));
        Error::Syntax { path: path.into(), problem }
    })
}

/// A line as it follows what was found in it; empty if it is not known.
fn at_line(line: Option<usize>) -> String {
    line.map_or(String::new(), |line| format!(" (line {line})"))
}

/// Converts a parser's message into an [`Error`]: an unknown key becomes [`Error::UnknownKey`] with the nearest known one.
fn syntax_error(path: &Path, message: &str, line: Option<usize>) -> Error {
    let at = at_line(line);
    let first = message.lines().next().unwrap_or_default();
    let quoted: Vec<&str> = first.split('`').skip(1).step_by(2).collect();
    let unknown = first.starts_with("unknown field") || first.starts_with("unknown variant");
    match quoted.split_first() {
        Some((key, known)) if unknown => {
            Error::UnknownKey { path: path.into(), key: (*key).into(), at, hint: nearest_hint(key, known) }
        }
        _ => Error::Syntax {
            path: path.into(),
            problem: format!("{}{at}", message.trim().replace('\n', "; ")),
        },
    }
}

fn nearest_hint(key: &str, known: &[&str]) -> String {
    let nearest = known.iter().min_by_key(|candidate| strsim::damerau_levenshtein(key, candidate));
    match nearest {
        Some(nearest) => format!("the nearest known key is `{nearest}`"),
        None => "needed: no key here".into(),
    }
}

/// The name of the file of each clip's tracks (JSON), all different.
///
/// A clip's extension is left out where that is possible, and its folders are joined to its name.
pub fn track_file_names(clips: &[&str]) -> Vec<String> {
    let flat: Vec<String> = clips.iter().map(|clip| clip.replace(['/', '\\'], "_")).collect();
    let stem = |name: &String| Path::new(name).with_extension("").to_string_lossy().into_owned();
    let stems: Vec<String> = flat.iter().map(stem).collect();
    let alike = counts(&stems);
    let (mut names, mut taken) = (Vec::new(), BTreeSet::new());
    for (name, stem) in flat.iter().zip(&stems) {
        let wanted = if alike[stem.as_str()] == 1 { stem } else { name };
        let numbered = (2..).map(|number| format!("{wanted}_{number}.json"));
        let mut candidates = std::iter::once(format!("{wanted}.json")).chain(numbered);
        names.extend(candidates.find(|candidate| taken.insert(candidate.clone())));
    }
    names
}

/// A value as indented JSON: the text of the files that [`write_json`] writes.
///
/// # Errors
/// A map whose keys are not text, which no output has.
pub fn json_text<T: Serialize>(value: &T) -> serde_json::Result<String> {
    serde_json::to_string_pretty(value).map(|text| text + "\n")
}

/// Writes a value as indented JSON, whole or not at all.
///
/// # Errors
/// The folder is missing or not writable.
pub fn write_json<T: Serialize>(path: &Path, value: &T) -> Result<()> {
    let text =
        json_text(value).map_err(|e| Error::Write { path: path.into(), source: std::io::Error::other(e) })?;
    write_whole(path, text.as_bytes())
}

/// `cell.toml` with the intrinsics of its `camera_info` file and the URDF of its arm: a value that needs no further files.
///
/// # Errors
/// See [`read_toml`], [`Cell::check`] and [`load_arm`]; also a cell without striker, and a `camera_info` file that is missing,
/// is none of ROS, OpenCV or Kalibr, or was calibrated for another image size than the cell's.
pub fn load_cell(path: impl AsRef<Path>) -> Result<Cell> {
    let path = path.as_ref();
    cell_of(path, text(path)?)
}

/// The cell of a text that is, or would be, the file at `path`.
///
/// # Errors
/// See [`load_cell`].
pub fn cell_of(path: impl AsRef<Path>, text: String) -> Result<Cell> {
    let path = path.as_ref();
    let cell = any_cell_of(path, &text)?;
    cell.require_striker(&label(path))?;
    Ok(cell)
}

/// The cell of a text; it may have no striker.
fn any_cell_of(path: impl AsRef<Path>, text: &str) -> Result<Cell> {
    let path = path.as_ref();
    let mut cell: Cell = parsed_toml(path, text, "a cell file")?;
    check_version(path, cell.version)?;
    cell.check(&label(path))?;
    let given_size_px = cell.camera.image_size_px;
    if let Some(info) = &mut cell.camera.camera_info {
        info.path = beside(path, &info.path);
        info.intrinsics = Some(load_intrinsics(&info.path, given_size_px)?);
    }
    if let Some(robot) = &mut cell.robot
        && robot.is_file()
    {
        robot.arm = beside(path, Path::new(&robot.arm)).display().to_string();
        load_arm(robot)?;
    }
    Ok(cell)
}

/// Reads the URDF of an arm that is a file, so that the cell is complete without further files.
///
/// # Errors
/// A URDF that cannot be read.
pub fn load_arm(robot: &mut RobotSpec) -> Result<()> {
    robot.urdf = if robot.is_file() { Some(text(Path::new(&robot.arm))?) } else { None };
    Ok(())
}

/// The intrinsics in a calibration file of ROS, OpenCV or Kalibr; `given_size_px` is the size that the cell gives, if it does.
///
/// `camchain.yaml#cam1` names one of the cameras of a Kalibr file.
///
/// # Errors
/// A file that cannot be read, that is none of these, whose model is not supported, or of another image size than the given one.
pub fn load_intrinsics(path: impl AsRef<Path>, given_size_px: Option<[u32; 2]>) -> Result<Intrinsics> {
    let (path, camera) = CameraInfo::from(path.as_ref().to_path_buf()).file_and_camera();
    let intrinsics = camera_info::parsed(&path, text(&path)?, camera.as_deref(), given_size_px)?;
    let size_px = intrinsics.image_size_px;
    if let Some(given) = given_size_px
        && given != size_px
    {
        let found = format!("{} x {}", size_px[0], size_px[1]);
        let needed = format!("the cell's image_size_px, {} x {}", given[0], given[1]);
        return Err(Error::invalid(label(&path), "image size", found, needed));
    }
    Ok(intrinsics)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ObjectsFile {
    #[serde(default = "one")]
    version: u32,
    #[serde(default)]
    objects: Vec<Object>,
}

/// `objects.toml`.
///
/// # Errors
/// See [`read_toml`] and [`Object::check`]; also a name given twice.
pub fn load_objects(path: impl AsRef<Path>) -> Result<Loaded<Vec<Object>>> {
    let path = path.as_ref();
    let file: ObjectsFile = parsed_toml(path, &text(path)?, "an objects file")?;
    check_version(path, file.version)?;
    let mut objects = file.objects;
    if objects.is_empty() {
        return Err(Error::invalid(label(path), "objects", "none", "at least one [[objects]] entry"));
    }
    let mut notes = Vec::new();
    for k in 0..objects.len() {
        notes.extend(objects[k].check().map_err(|e| in_file(path, e))?);
        if objects[..k].iter().any(|o| o.name == objects[k].name) {
            let owner = format!("{}: object `{}`", label(path), objects[k].name);
            return Err(Error::invalid(owner, "name", "given twice", "every kind of object once"));
        }
    }
    Ok(Loaded { value: objects, notes })
}

/// The same error, its message led by the file's name.
fn in_file(path: &Path, error: Error) -> Error {
    match error {
        Error::Invalid { name, what, found, needed } => {
            Error::Invalid { name: format!("{}: {name}", label(path)), what, found, needed }
        }
        other => other,
    }
}

/// How often each name occurs.
fn counts(names: &[String]) -> BTreeMap<&str, usize> {
    let mut counts = BTreeMap::new();
    for name in names {
        *counts.entry(name.as_str()).or_insert(0) += 1;
    }
    counts
}

/// What `scene.toml` holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// The file format's version.
    #[serde(default = "one")]
    pub version: u32,
    /// The cell file.
    pub cell: PathBuf,
    /// The objects file.
    pub objects: PathBuf,
    /// When it was looked at (s since 1970).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observed_unix_s: Option<f64>,
    /// What lies where.
    #[serde(default)]
    pub placed: Vec<Placed>,
    /// Straight walls.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub walls: Vec<Wall>,
    /// Areas that must stay free.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keep_out: Vec<KeepOut>,
    /// What is wanted.
    #[serde(default)]
    pub goal: Goal,
}

impl SceneFile {
    /// The scene of objects that were located in a picture: poses in whole micrometres and microradians, far below the noise of the
    /// measurement, and the goal of the paper.
    pub fn of_picture(
        cell: PathBuf,
        objects: PathBuf,
        placed: Vec<Placed>,
        observed_unix_s: Option<f64>,
    ) -> Self {
        let round = |value: f64| (value * 1e6).round() / 1e6;
        let rounded = |Placed { object, position_m, yaw_rad }: Placed| Placed {
            object,
            position_m: Point::new(round(position_m.x), round(position_m.y)),
            yaw_rad: round(yaw_rad),
        };
        let placed = placed.into_iter().map(rounded).collect();
        let (walls, keep_out, goal) = (Vec::new(), Vec::new(), Goal::default());
        Self { version: 1, cell, objects, observed_unix_s, placed, walls, keep_out, goal }
    }
}

/// `scene.toml` with the cell and the objects that it names.
///
/// # Errors
/// See [`read_toml`], [`Scene::check`] and the loaders of the named files.
pub fn load_scene(path: impl AsRef<Path>) -> Result<Loaded<Scene>> {
    let path = path.as_ref();
    let file: SceneFile = parsed_toml(path, &text(path)?, "a scene file")?;
    check_version(path, file.version)?;
    let objects = load_objects(beside(path, &file.objects))?;
    let scene = Scene {
        cell: load_cell(beside(path, &file.cell))?,
        objects: objects.value,
        observed_unix_s: file.observed_unix_s,
        placed: file.placed,
        walls: file.walls,
        keep_out: file.keep_out,
        goal: file.goal,
    };
    scene.check(&label(path))?;
    Ok(Loaded { value: scene, notes: objects.notes })
}

/// A strike: from a `plan.json`, or from a file with just the strike.
///
/// # Errors
/// See [`read_json`] and [`Strike::check`]; also a plan that found no strike.
pub fn load_strike(path: impl AsRef<Path>) -> Result<Strike> {
    strike_and_scene(path).map(|(strike, _)| strike)
}

/// A strike, and the scene that it was planned for.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// The strike.
    pub strike: Strike,
    /// The scene of a `plan.json`; `None` for a file with just the strike.
    pub scene: Option<Scene>,
}

/// The strike and the scene of a `plan.json`, or of a file with just the strike.
///
/// # Errors
/// See [`load_strike`].
pub fn load_planned(path: impl AsRef<Path>) -> Result<Planned> {
    let path = path.as_ref();
    let (strike, scene) = strike_and_scene(path)?;
    let scene = scene.map(|scene| part(path, scene)).transpose()?;
    Ok(Planned { strike, scene })
}

/// The strike of a file, checked, and the JSON value of its scene.
fn strike_and_scene(path: impl AsRef<Path>) -> Result<(Strike, Option<serde_json::Value>)> {
    let path = path.as_ref();
    let mut value: serde_json::Value = read_json(path)?;
    let (strike, scene) = match value.get_mut("strike").map(serde_json::Value::take) {
        Some(serde_json::Value::Null) => {
            let found = "null (the plan found none)";
            return Err(Error::invalid(label(path), "strike", found, "a plan with a strike"));
        }
        Some(strike) => (strike, value.get_mut("scene").map(serde_json::Value::take)),
        None => (value, None),
    };
    let strike: Strike = part(path, strike)?;
    strike.check(&label(path))?;
    Ok((strike, scene))
}

/// A part of a JSON file as `T`.
fn part<T: DeserializeOwned>(path: &Path, value: serde_json::Value) -> Result<T> {
    serde_json::from_value(value).map_err(|e| syntax_error(path, &e.to_string(), None))
}

/// `properties.json`.
///
/// # Errors
/// See [`read_json`] and [`Properties::check`].
pub fn load_properties(path: impl AsRef<Path>) -> Result<Properties> {
    let path = path.as_ref();
    let properties: Properties = read_json(path)?;
    check_version(path, properties.version)?;
    properties.check(&label(path))?;
    Ok(properties)
}

fn check_version(path: &Path, version: u32) -> Result<()> {
    if version == 1 {
        return Ok(());
    }
    Err(Error::invalid(label(path), "version", version, "1"))
}

/// A path written in a file, relative to that file.
fn beside(file: &Path, named: &Path) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).join(named)
}

fn one() -> u32 {
    1
}

/// Sorted names of the files in a folder.
#[cfg(test)]
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
