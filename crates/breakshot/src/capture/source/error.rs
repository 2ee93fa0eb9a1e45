//! Why can a film not be used?  The reason, before the file's name is attached.

use crate::error::Error;
use std::path::Path;

/// The formats that are read, for messages.
const READABLE: &str =
    "MP4 or MOV (H.264, 8 bit, 4:2:0, progressive), Y4M, PNG or a folder of PNGs, a ROS 2 bag (MCAP)";

/// The command that converts any other film, for messages.
const CONVERT: &str = "ffmpeg -i FILM -c:v libx264 -crf 12 -pix_fmt yuv420p NEW.mp4";

/// The command that converts any bag of ROS, for messages.
const CONVERT_BAG: &str = "a ROS 2 bag of MCAP files; to convert (PyPI package `rosbags`): \
    rosbags-convert --src BAG --dst NEW --dst-storage mcap";

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

    /// The operating system cannot read the file.
    pub(super) fn unreadable(error: &std::io::Error) -> Self {
        Self::damaged(format!("unreadable ({error})"))
    }

    /// A bag without its end.
    pub(super) fn of_cut_bag() -> Self {
        let needed = "a complete file; `mcap recover BAG -o NEW.mcap` keeps what is intact";
        Self::unsuitable("an MCAP file that breaks off", needed)
    }

    /// A bag of ROS 1, or messages of one.
    pub(super) fn of_ros_1(found: &str) -> Self {
        Self::unsuitable(found, CONVERT_BAG)
    }

    /// A bag of ROS 2 in an `SQLite` database.
    pub(super) fn of_sqlite() -> Self {
        Self::unsuitable("a bag in an SQLite database (.db3)", CONVERT_BAG)
    }

    /// A bag of ROS 2 whose files or messages are compressed.
    pub(super) fn of_compressed_bag(found: &str) -> Self {
        Self::unsuitable(found, CONVERT_BAG)
    }

    /// The library's error for the film at `path`.
    pub(super) fn for_file(self, path: &Path) -> Error {
        Error::video(path, self.found, self.needed)
    }
}
