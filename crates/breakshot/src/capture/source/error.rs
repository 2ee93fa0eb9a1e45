//! Why a film cannot be used, before its name is put to it.

use crate::error::Error;
use std::path::Path;

/// What can be read.
const READABLE: &str = "MP4 or MOV (H.264, 8 bit, 4:2:0, progressive), Y4M, PNG or a folder of PNGs";

/// How to turn any other film into one.
const CONVERT: &str = "ffmpeg -i FILM -c:v libx264 -crf 12 -pix_fmt yuv420p NEW.mp4";

/// What was found and what is needed instead.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    pub found: String,
    pub needed: String,
    /// Whether `ffmpeg` is likely to read it.
    pub convertible: bool,
}

impl Refusal {
    /// The file is not whole, or contradicts itself.
    pub(super) fn damaged(found: impl Into<String>) -> Self {
        Self { found: found.into(), needed: "a complete, undamaged file".into(), convertible: false }
    }

    /// A file of a kind that is not read.
    pub(super) fn foreign(found: impl Into<String>) -> Self {
        Self { found: found.into(), needed: READABLE.into(), convertible: false }
    }

    /// A whole film that asks for something else than what is there.
    pub(super) fn unfit(found: impl Into<String>, needed: impl Into<String>) -> Self {
        Self { found: found.into(), needed: needed.into(), convertible: false }
    }

    /// A film that `ffmpeg` can read, or turn into one that is read.
    pub(super) fn convertible(found: impl Into<String>) -> Self {
        let needed = format!("{READABLE}; to convert: {CONVERT}");
        Self { found: found.into(), needed, convertible: true }
    }

    /// The error for the film at `path`.
    pub(super) fn of(self, path: &Path) -> Error {
        Error::video(path, self.found, self.needed)
    }
}
