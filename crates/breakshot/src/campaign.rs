//! The strike videos that the properties are learned from (`campaign.toml`).

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
    /// The kinds of objects there are.
    pub objects: Vec<Object>,
    /// The videos.
    pub clips: Vec<Clip>,
}

/// One strike video.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// The film.
    pub video: PathBuf,
    /// What is seen in it, the struck object first.
    pub objects: Vec<String>,
    /// What the robot was told.
    pub strike: Strike,
    /// Where each object lay, for piles whose markers look alike.
    pub placed: Option<Vec<Placed>>,
}

impl Clip {
    /// The file's name, as messages call the clip.
    pub fn name(&self) -> String {
        self.video.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }
}

impl Campaign {
    /// An error that names the clip unless the campaign can exist.
    ///
    /// # Errors
    /// Unknown or repeated objects, strikes that cannot be, videos that are not there.
    pub fn check(&self, file: &str) -> Result<()> {
        if self.clips.is_empty() {
            return Err(Error::invalid(file, "clips", "none", "at least one [[clips]] entry"));
        }
        for clip in &self.clips {
            let owner = format!("{file}: clip `{}`", clip.name());
            if !clip.video.exists() {
                let found = format!("missing ({})", clip.video.display());
                return Err(Error::invalid(owner, "video", found, "a file that exists"));
            }
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
