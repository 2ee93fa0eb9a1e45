//! The list of clips from which the properties are estimated (`campaign.toml`).

use crate::cell::Cell;
use crate::columns::Columns;
use crate::error::{Error, Result, bounds};
use crate::geometry::Point;
use crate::object::{self, Object};
use crate::scene::{Placed, Strike};
use serde::{Deserialize, Serialize};
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
    /// Clips that are listed and left out (`exclude = true`).
    pub excluded: Vec<Clip>,
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
    /// Stretches of time whose frames are left out, from and until (s of the clip).
    pub excluded_s: Vec<[f64; 2]>,
    /// Where objects are in the first frame, as a person has seen it; none for those that are found without.
    pub starts: Vec<ClipStart>,
}

/// Where an object is in the first frame of a clip, as a person has seen it.
///
/// It says which marker (or outline) is the object's, and is no measurement: the detection takes the one near it and measures its pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClipStart {
    /// The object; `a#2` for the second copy of `a`.
    pub object: String,
    /// Its centroid (m).
    pub position_m: Point,
    /// Its rotation (rad, counter-clockwise), where its marker leaves that open; `None` if it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yaw_rad: Option<f64>,
}

/// Most stretches of a clip that are left out.
const MOST_STRETCHES: usize = 100;

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

impl Clip {
    fn check_stretches(&self, owner: &str) -> Result<()> {
        let needed = "[from_s, until_s] with from_s below until_s";
        for [from_s, until_s] in &self.excluded_s {
            if !(from_s.is_finite() && until_s.is_finite() && from_s < until_s) {
                return Err(Error::invalid(owner, "exclude", format!("[{from_s}, {until_s}]"), needed));
            }
        }
        if self.excluded_s.len() > MOST_STRETCHES {
            let needed = format!("at most {MOST_STRETCHES}");
            return Err(Error::invalid(
                owner,
                "exclude",
                format!("{} stretches", self.excluded_s.len()),
                needed,
            ));
        }
        Ok(())
    }

    fn check_starts(&self, owner: &str) -> Result<()> {
        for (k, start) in self.starts.iter().enumerate() {
            let name = &start.object;
            if !self.objects.contains(name) {
                let needed = format!("one of {}", self.objects.join(", "));
                return Err(Error::invalid(owner, "starts", format!("`{name}`"), needed));
            }
            if self.starts[..k].iter().any(|other| other.object == *name) {
                return Err(Error::invalid(owner, "starts", format!("`{name}` twice"), "every object once"));
            }
            let owner = format!("{owner}: start of `{name}`");
            bounds::position(&owner, "position_m", &[start.position_m.x, start.position_m.y])?;
            start.yaw_rad.map_or(Ok(()), |yaw_rad| bounds::angle(&owner, "yaw_rad", yaw_rad))?;
        }
        if !self.starts.is_empty() && matches!(self.source, Source::Tracks { .. }) {
            let needed = "`video`, or no `starts`: nothing is detected in tracks";
            return Err(Error::invalid(owner, "starts", "given for tracks", needed));
        }
        Ok(())
    }

    /// Whether the frame at a time is left out.
    pub(crate) fn excludes(&self, time_s: f64) -> bool {
        self.excluded_s.iter().any(|[from_s, until_s]| (*from_s..=*until_s).contains(&time_s))
    }
}

impl Campaign {
    /// Checks that every clip is complete and consistent.
    ///
    /// # Errors
    /// No clips, unknown or repeated objects, an impossible start, strike or frame rate, a strike in a cell without striker, a
    /// film in one without camera; the error names the clip.
    pub fn check(&self, file: &str) -> Result<()> {
        if self.clips.is_empty() {
            let found = if self.excluded.is_empty() { "none" } else { "none that is not excluded" };
            return Err(Error::invalid(file, "clips", found, "at least one [[clips]] entry"));
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
            clip.check_stretches(&owner)?;
            clip.check_starts(&owner)?;
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

/// The objects in the name of a film, in its order; the second `a` is `a#2`.
///
/// An object is found where its name stands between other things than letters, whatever their case; of two that fit the longer.
pub fn named_objects(film: &str, names: &[String]) -> Vec<String> {
    let film = film.to_lowercase();
    let letters: Vec<(usize, char)> = film.char_indices().collect();
    let is_end = |byte: usize, name: &str| {
        let number = name.ends_with(|c: char| c.is_ascii_digit());
        film[byte..].chars().next().is_none_or(|c| !(c.is_alphabetic() || number && c.is_ascii_digit()))
    };
    let mut found: Vec<String> = Vec::new();
    let mut next = 0;
    for (k, (byte, letter)) in letters.iter().enumerate() {
        let starts = k == 0
            || !letters[k - 1].1.is_alphanumeric()
            || !letter.is_ascii_digit() && letters[k - 1].1.is_ascii_digit();
        if *byte < next || !starts {
            continue;
        }
        let fits = |name: &&String| {
            let name = name.to_lowercase();
            !name.is_empty() && film[*byte..].starts_with(&name) && is_end(byte + name.len(), &name)
        };
        if let Some(name) = names.iter().filter(fits).max_by_key(|name| name.len()) {
            next = byte + name.to_lowercase().len();
            let copies = found.iter().filter(|other| other.split('#').next() == Some(name)).count();
            found.push(if copies == 0 { name.clone() } else { format!("{name}#{}", copies + 1) });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_are_found_in_the_names_of_films() {
        let names = ["a", "c", "puck", "Puck_red", "e2"].map(String::from);
        for (film, expected) in [
            ("single_a_3", vec!["a"]),
            ("pair_c_a_1", vec!["c", "a"]),
            ("a_a_1", vec!["a", "a#2"]),
            ("PUCK-into-puck_red.take1", vec!["puck", "Puck_red"]),
            ("puck1", vec!["puck"]),
            ("cat_e21", vec![]),
            ("2024-e2 über", vec!["e2"]),
            ("", vec![]),
        ] {
            assert_eq!(named_objects(film, &names), expected, "{film}");
        }
    }
}
