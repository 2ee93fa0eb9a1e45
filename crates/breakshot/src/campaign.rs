//! The list of strike videos from which the properties are estimated (`campaign.toml`).

use crate::cell::Cell;
use crate::error::{Error, Result};
use crate::object::{self, Object};
use crate::scene::{Placed, Strike};
use std::path::PathBuf;

/// All clips of one cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Campaign {
    /// The robot cell.
    pub cell: Cell,
    /// All kinds of objects in the clips.
    pub objects: Vec<Object>,
    /// The videos.
    pub clips: Vec<Clip>,
}

/// One strike video.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// The path of the film.
    pub video: PathBuf,
    /// The objects in the film, the struck one first; a second copy is `a#2`.
    pub objects: Vec<String>,
    /// The commanded strike.
    pub strike: Strike,
    /// The initial pose of each object, for piles whose markers look alike.
    pub placed: Option<Vec<Placed>>,
}

impl Clip {
    /// The name of the video file, which identifies the clip in messages.
    pub fn name(&self) -> String {
        self.video.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }
}

impl Campaign {
    /// Checks that every clip is complete and consistent.
    ///
    /// # Errors
    /// No clips, unknown or repeated objects, an impossible strike; the error names the clip.
    pub fn check(&self, file: &str) -> Result<()> {
        if self.clips.is_empty() {
            return Err(Error::invalid(file, "clips", "none", "at least one [[clips]] entry"));
        }
        for clip in &self.clips {
            let owner = format!("{file}: clip `{}`", clip.name());
            if clip.objects.is_empty() {
                return Err(Error::invalid(owner, "objects", "none", "the struck object, then the others"));
            }
            for (k, name) in clip.objects.iter().enumerate() {
                object::find(&self.objects, name, &owner)?;
                if clip.objects[..k].contains(name) {
                    let needed = format!("every copy once; a second one is `{}#2`", object::kind(name));
                    return Err(Error::invalid(owner, "objects", format!("`{name}` twice"), needed));
                }
            }
            clip.strike.check(&owner)?;
        }
        Ok(())
    }
}
