//! What can be wrong with a file, a measurement or a request: every error names the thing, what was found
//! and what is needed.

use std::path::{Path, PathBuf};

/// The library's result.
pub type Result<T> = std::result::Result<T, Error>;

/// What was wrong, in words a user can act on.
///
/// All but [`Error::Write`] are the input's fault (exit code 2 of the program).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file that cannot be opened or read at all.
    #[error("{}: cannot be read ({source}); needed: a readable file", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A result that cannot be written.
    #[error("{}: cannot be written ({source})", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// TOML, JSON or YAML that does not parse, or does not hold what its kind of file must.
    #[error("{}: {problem}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// What the parser found, with line and column where it has them.
        problem: String,
    },
    /// A key that no file of this kind has.
    #[error("{}: unknown key `{key}`{at}; {hint}", path.display())]
    UnknownKey {
        /// The file.
        path: PathBuf,
        /// The key as written.
        key: String,
        /// Where it stands, as ` (line 3)`, or empty.
        at: String,
        /// The nearest known key, or all of them.
        hint: String,
    },
    /// A value outside what is physically or formally possible.
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
    /// A video or picture that is not what it claims, or that breaks off.
    #[error("{}: {found}; needed: {needed}", path.display())]
    Video {
        /// The file.
        path: PathBuf,
        /// What was found in it.
        found: String,
        /// What can be read.
        needed: String,
    },
    /// The picture does not tell where the camera is.
    #[error("{name}: {found}; needed: {needed}")]
    Camera {
        /// The picture, clip or cell file.
        name: String,
        /// What was found.
        found: String,
        /// What is needed.
        needed: String,
    },
    /// Markers and objects that do not go together.
    #[error("{clip}: {found}; needed: {needed}")]
    Markers {
        /// The clip or picture.
        clip: String,
        /// What was found.
        found: String,
        /// What is needed.
        needed: String,
    },
    /// A track with too few samples to measure anything.
    #[error("object `{object}`: its track has {samples} samples; needed: at least {needed}")]
    TrackTooShort {
        /// The object.
        object: String,
        /// Samples found.
        samples: usize,
        /// Samples needed.
        needed: usize,
    },
    /// A property that no clip supports, asked for by a simulation or a plan.
    #[error("`{name}`: its {quantity} was never measured; needed: {needed}")]
    NotMeasured {
        /// The object or pair.
        name: String,
        /// Which property.
        quantity: &'static str,
        /// What to film, or to give.
        needed: String,
    },
}

impl Error {
    /// A value that cannot be: `name: what is found; needed: needed`.
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

    /// A video that cannot be used.
    pub fn video(path: &Path, found: impl Into<String>, needed: impl Into<String>) -> Self {
        Self::Video { path: path.to_path_buf(), found: found.into(), needed: needed.into() }
    }
}
