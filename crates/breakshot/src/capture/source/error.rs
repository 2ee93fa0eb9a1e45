//! Why can a film not be used?  The reason, before the file's name is attached.

use crate::error::Error;
use std::path::Path;

/// The formats that are read, for messages.
const READABLE: &str = "MP4 or MOV (H.264, 8 bit, 4:2:0, progressive), Y4M, PNG or a folder of PNGs";

/// The command that converts any other film, for messages.
const CONVERT: &str = "ffmpeg -i FILM -c:v libx264 -crf 12 -pix_fmt yuv420p NEW.mp4";

/// What was found in a film and what is needed instead.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct SourceError {
    pub found: String,
    pub needed: String,
    /// Whether `ffmpeg` probably decodes the film.
    pub convertible: bool,
}

impl SourceError {
    /// The file is incomplete or contradicts itself.
    pub(super) fn damaged(found: impl Into<String>) -> Self {
        Self { found: found.into(), needed: "a complete, undamaged file".into(), convertible: false }
    }

    /// The file has a format that is not read.
    pub(super) fn unsupported(found: impl Into<String>) -> Self {
        Self { found: found.into(), needed: READABLE.into(), convertible: false }
    }

    /// The film is intact, but its content cannot be used.
    pub(super) fn unsuitable(found: impl Into<String>, needed: impl Into<String>) -> Self {
        Self { found: found.into(), needed: needed.into(), convertible: false }
    }

    /// The film has a coding that `ffmpeg` can decode or convert.
    pub(super) fn convertible(found: impl Into<String>) -> Self {
        let needed = format!("{READABLE}; to convert: {CONVERT}");
        Self { found: found.into(), needed, convertible: true }
    }

    /// The library's error for the film at `path`.
    pub(super) fn for_file(self, path: &Path) -> Error {
        Error::video(path, self.found, self.needed)
    }
}
