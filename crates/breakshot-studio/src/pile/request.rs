//! The pile that a page asks about: a scene file, with what was moved on the page.

use crate::project::Project;
use breakshot::properties::Properties;
use breakshot::scene::{Goal, KeepOut, Placed, Scene, Wall};
use breakshot::{Error, Result, files};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

/// Most objects, walls or areas of a pile that a page asks about.
const MOST_ENTRIES: usize = 500;

/// A scene file of the project, and what the page has changed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PileRequest {
    /// The scene file.
    pub(crate) scene: String,
    pub(crate) placed: Option<Vec<Placed>>,
    pub(crate) walls: Option<Vec<Wall>>,
    pub(crate) keep_out: Option<Vec<KeepOut>>,
    pub(crate) goal: Option<Goal>,
}

/// What a file was when it was read.
type Stamp = (PathBuf, Option<SystemTime>, u64);

fn stamp(path: &Path) -> Stamp {
    let file = path.metadata().ok();
    (path.into(), file.as_ref().and_then(|f| f.modified().ok()), file.map_or(0, |f| f.len()))
}

/// Values read from files, until one of the files changes.
struct Read<T> {
    stamps: Vec<Stamp>,
    value: Arc<T>,
}

/// A scene, and the notes of its loader.
type SceneAndNotes = (Scene, Vec<String>);

/// The last scene and the last properties that were read: a strike that is dragged asks for them at every step.
#[derive(Default)]
pub(crate) struct Cache {
    scene: Mutex<Option<Read<SceneAndNotes>>>,
    properties: Mutex<Option<Read<Properties>>>,
}

/// The value in the cache if none of its files has changed, otherwise a new one.
fn cached<T>(
    cache: &Mutex<Option<Read<T>>>,
    file: &Path,
    load: impl FnOnce() -> Result<(T, Vec<PathBuf>)>,
) -> Result<Arc<T>> {
    let mut cache = cache.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(read) = &*cache
        && read.stamps.first().is_some_and(|(path, ..)| path == file)
        && read.stamps.iter().all(|known| stamp(&known.0) == *known)
    {
        return Ok(read.value.clone());
    }
    let (value, others) = load()?;
    let stamps = std::iter::once(file).chain(others.iter().map(PathBuf::as_path)).map(stamp).collect();
    let value = Arc::new(value);
    *cache = Some(Read { stamps, value: value.clone() });
    Ok(value)
}

/// The files that a scene names: cell and objects, and what the cell names.
fn named_files(project: &Project, scene: &Path) -> Result<Vec<PathBuf>> {
    let file: files::SceneFile = files::read_toml(scene)?;
    let cell = project.named_in(scene, &file.cell)?;
    let objects = project.named_in(scene, &file.objects)?;
    let of_cell = project.check_cell(&cell)?;
    Ok([vec![cell, objects], of_cell].concat())
}

impl Cache {
    /// The scene of a file and the notes of its loader.
    ///
    /// # Errors
    /// A file that is not of the project, or that names one that is not; a scene that is not valid.
    pub(crate) fn scene_file(&self, project: &Project, name: &str) -> Result<Arc<SceneAndNotes>> {
        let path = project.file(name)?;
        cached(&self.scene, &path, || {
            let others = named_files(project, &path)?;
            let loaded = files::load_scene(&path)?;
            Ok(((loaded.value, loaded.notes), others))
        })
    }

    /// The pile that the page shows.
    ///
    /// # Errors
    /// As [`Cache::scene_file`]; a change that is not valid.
    pub(crate) fn pile(&self, project: &Project, request: &PileRequest) -> Result<Scene> {
        let mut scene = self.scene_file(project, &request.scene)?.0.clone();
        let PileRequest { placed, walls, keep_out, goal, .. } = request.clone();
        scene.placed = placed.unwrap_or(scene.placed);
        scene.walls = walls.unwrap_or(scene.walls);
        scene.keep_out = keep_out.unwrap_or(scene.keep_out);
        scene.goal = goal.unwrap_or(scene.goal);
        let entries = scene.placed.len().max(scene.walls.len()).max(scene.keep_out.len());
        if entries > MOST_ENTRIES {
            let needed = format!("at most {MOST_ENTRIES}");
            return Err(Error::invalid("the pile", "number of objects, walls or areas", entries, needed));
        }
        scene.check("the pile")?;
        Ok(scene)
    }

    /// The properties of a file, with assumed values where this pile needs them.
    ///
    /// # Errors
    /// A file that is not of the project, properties that are not valid.
    pub(crate) fn properties(&self, project: &Project, name: &str, scene: &Scene) -> Result<Properties> {
        let path = project.file(name)?;
        let read = cached(&self.properties, &path, || Ok((files::load_properties(&path)?, Vec::new())))?;
        Ok(read.completed_for(scene)?.into_owned())
    }
}
