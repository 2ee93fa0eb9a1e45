//! Errors in files, measurements and requests. Every message names the file or object, the value found and the value needed.

pub mod bounds;

use std::path::{Path, PathBuf};

/// Result of a fallible function of this library.
pub type Result<T> = std::result::Result<T, Error>;

/// An error with a message that a user can act on.
///
/// All variants except [`Error::Write`] are errors of the input (exit code 2 of the program).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file that cannot be opened or read.
    #[error("{}: cannot be read ({source}); needed: a readable file", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        source: std::io::Error,
    },
    /// A result that cannot be written.
    #[error("{}: cannot be written ({source})", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        source: std::io::Error,
    },
    /// TOML, JSON or YAML that cannot be parsed, or without the required content.
    #[error("{}: {problem}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// The parser's message, with line and column if known.
        problem: String,
    },
    /// A key that does not exist in this kind of file.
    #[error("{}: unknown key `{key}`{at}; {hint}", path.display())]
    UnknownKey {
        /// The file.
        path: PathBuf,
        /// The key in the file.
        key: String,
        /// Its location, as ` (line 3)`, or empty.
        at: String,
        /// The most similar known key, or all known keys.
        hint: String,
    },
    /// A value that is physically or formally impossible.
    #[error("{name}: {what} is {found}; needed: {needed}")]
    Invalid {
        /// The file, object or clip.
        name: String,
        /// The key or quantity.
        what: String,
        /// What was found.
        found: String,
        /// What is needed.
        needed: String,
    },
    /// A video or picture that cannot be decoded, or not to its end.
    #[error("{}: {found}; needed: {needed}", path.display())]
    Video {
        /// The file.
        path: PathBuf,
        /// What was found in it.
        found: String,
        /// What is needed.
        needed: String,
    },
    /// The pose of the camera cannot be determined.
    #[error("{name}: {found}; needed: {needed}")]
    Camera {
        /// The picture, clip or cell file.
        name: String,
        /// What was found.
        found: String,
        /// What is needed.
        needed: String,
    },
    /// The markers of a clip do not correspond to its objects.
    #[error("{clip}: {found}; needed: {needed}")]
    Markers {
        /// The clip or picture.
        clip: String,
        /// What was found.
        found: String,
        /// What is needed.
        needed: String,
    },
    /// A track with too few samples for a measurement.
    #[error("object `{object}`: the track has {samples} samples; needed: at least {needed}")]
    TrackTooShort {
        /// The object.
        object: String,
        /// Number of samples found.
        samples: usize,
        /// Number of samples needed.
        needed: usize,
    },
    /// A property that a simulation or a plan requires and no clip measured.
    #[error("`{name}`: no measurement of its {quantity}; needed: {needed}")]
    NotMeasured {
        /// The object or pair.
        name: String,
        /// The property.
        quantity: &'static str,
        /// Which clip or which value is needed.
        needed: String,
    },
    /// Work that the caller stopped before its end.
    #[error("stopped before the end")]
    Stopped,
}

impl Error {
    /// An [`Error::Invalid`] with the message `name: what is found; needed: needed`.
    pub fn invalid(
        name: impl Into<String>,
        what: impl Into<String>,
        found: impl std::fmt::Display,
        needed: impl Into<String>,
    ) -> Self {
        Self::Invalid {
            name: name.into(),
            what: what.into(),
            found: format!("{found}"),
            needed: needed.into(),
        }
    }

    /// An [`Error::Video`] of the file at this path.
    pub fn video(path: &Path, found: impl Into<String>, needed: impl Into<String>) -> Self {
        Self::Video { path: path.to_path_buf(), found: found.into(), needed: needed.into() }
    }
}
