//! The first frames of the film that was asked for last: while a tag is dragged the film is not decoded anew.

use breakshot::Result;
use breakshot::capture::{Footage, Frame};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

/// Frames that are kept: more than a camera is calibrated from.
const KEPT: usize = 6;

#[derive(Default)]
pub(crate) struct FirstFrames(Mutex<Option<Kept>>);

struct Kept {
    path: PathBuf,
    changed: Option<SystemTime>,
    name: String,
    frames: Vec<Frame>,
}

impl FirstFrames {
    /// The beginning of a film; the whole film where its own file gives a lens.
    ///
    /// # Errors
    /// A film that cannot be opened or decoded.
    pub(crate) fn film(&self, path: &Path) -> Result<Footage> {
        let changed = path.metadata().and_then(|file| file.modified()).ok();
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(film) = &*kept
            && film.path == path
            && film.changed == changed
        {
            return Ok(Footage::from_frames(&film.name, film.frames.clone()));
        }
        let mut footage = Footage::open(path)?;
        if footage.intrinsics().is_some() {
            return Ok(footage);
        }
        let frames = footage.by_ref().take(KEPT).collect::<Result<Vec<Frame>>>()?;
        if frames.is_empty() {
            // The film itself has the reason.
            return Footage::open(path);
        }
        let name = footage.name().to_owned();
        *kept = Some(Kept { path: path.into(), changed, name: name.clone(), frames: frames.clone() });
        Ok(Footage::from_frames(&name, frames))
    }
}
