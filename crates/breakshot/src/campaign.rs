//! The list of clips from which the properties are estimated (`campaign.toml`).

use crate::cell::Cell;
use crate::columns::Columns;
use crate::error::{Error, Result, bounds};
use crate::object::{self, Object};
use crate::scene::{Placed, Strike};
use std::path::{Path, PathBuf};

/// All clips of one cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Campaign {
    /// The robot cell.
    pub cell: Cell,
    /// All kinds of objects in the clips.
    pub objects: Vec<Object>,
    /// The clips.
    pub clips: Vec<Clip>,
}

/// One clip: a film of moving objects, or their tracks.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// What identifies the clip in messages: the name of its file, with the folders that tell it from the others.
    pub name: String,
    /// Where the positions come from.
    pub source: Source,
    /// The rate at which it was taken, where the file says another or none (Hz).
    pub frame_rate_hz: Option<f64>,
    /// The objects in the clip, the struck one first; a second copy is `a#2`.
    pub objects: Vec<String>,
    /// The commanded strike; `None` if the objects were set in motion otherwise.
    pub strike: Option<Strike>,
    /// The initial pose of each object, for piles whose markers look alike.
    pub placed: Option<Vec<Placed>>,
}

/// Extensions of films.
pub const FILM_EXTENSIONS: [&str; 14] =
    ["mp4", "mov", "m4v", "y4m", "mkv", "webm", "avi", "mpg", "mpeg", "mts", "m2ts", "ts", "wmv", "mcap"];

/// Where the positions of a clip's objects come from.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A film in which they are detected.
    Film(PathBuf),
    /// A table of positions that something else measured.
    Tracks {
        /// The file.
        path: PathBuf,
        /// What its columns hold; `None` for the columns that `breakshot detect` writes.
        columns: Option<Box<Columns>>,
    },
}

impl Source {
    /// The file, or the folder of pictures.
    pub fn path(&self) -> &Path {
        match self {
            Self::Film(path) | Self::Tracks { path, .. } => path,
        }
    }

    /// The key of the file in `campaign.toml`.
    pub fn key(&self) -> &'static str {
        match self {
            Self::Film(_) => "video",
            Self::Tracks { .. } => "tracks",
        }
    }
}

impl Campaign {
    /// Checks that every clip is complete and consistent.
    ///
    /// # Errors
    /// No clips, unknown or repeated objects, an impossible strike or frame rate, a strike in a cell without striker, a
    /// film in one without camera; the error names the clip.
    pub fn check(&self, file: &str) -> Result<()> {
        if self.clips.is_empty() {
            return Err(Error::invalid(file, "clips", "none", "at least one [[clips]] entry"));
        }
        for clip in &self.clips {
            let owner = format!("{file}: clip `{}`", clip.name);
            if clip.objects.is_empty() {
                return Err(Error::invalid(
                    owner,
                    "objects",
                    "an empty list",
                    "the struck object, then the others",
                ));
            }
            for (k, name) in clip.objects.iter().enumerate() {
                object::find(&self.objects, name, &owner)?;
                if clip.objects[..k].contains(name) {
                    let needed = format!("every copy once; a second one is `{}#2`", object::kind(name));
                    return Err(Error::invalid(owner, "objects", format!("`{name}` twice"), needed));
                }
            }
            if let Some(strike) = &clip.strike {
                strike.check(&owner)?;
                self.cell.require_striker(&format!("{owner}: cell"))?;
            }
            if let Some(rate) = clip.frame_rate_hz {
                bounds::frame_rate(&owner, "frame_rate_hz", rate)?;
            }
            match &clip.source {
                Source::Film(_) => self.cell.require_camera_pose(&format!("{owner}: cell"))?,
                Source::Tracks { columns, .. } => {
                    if let Some(columns) = columns {
                        columns.check(&owner, &clip.objects, clip.frame_rate_hz)?;
                    }
                }
            }
        }
        Ok(())
    }
}
