//! A calibration board: tags in one plane whose positions are known.

use super::Tag;
use crate::error::bounds::{angle, length, position};
use crate::error::{Error, Result};
use crate::geometry::Point;
use serde::{Deserialize, Serialize};

/// The tags of a calibration board (`board.toml`), in its own frame: x to the right, y up, as one reads it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Board {
    /// The file format's version.
    #[serde(default = "super::one")]
    pub version: u32,
    /// The family of all tags; `36h11` is the one that is read.
    #[serde(default = "super::family_36h11")]
    pub family: String,
    /// The tags.
    #[serde(default)]
    pub tags: Vec<Tag>,
}

/// Number of the first tag of a printed board: the sheets for the table start at 0.
const FIRST_ID: u32 = 100;
/// Largest number of tags of a board: those of the family.
const MOST_TAGS: usize = 587;
/// Smallest number of tags of a board.
const LEAST_TAGS: usize = 4;

impl Board {
    /// A grid of tags, their black squares `size_m` wide and their centres `pitch_m` apart, centred on the origin; the
    /// numbers ascend as one reads.
    ///
    /// # Errors
    /// Fewer than four tags, more than the family has, an impossible size.
    pub fn grid([columns, rows]: [usize; 2], size_m: f64, pitch_m: f64) -> Result<Self> {
        let most = MOST_TAGS - FIRST_ID as usize;
        let count = columns.saturating_mul(rows);
        if columns < 2 || rows < 2 || count > most {
            let needed = format!("2 or more columns and rows, up to {most} tags");
            return Err(Error::invalid("board", "grid", format!("{columns} x {rows}"), needed));
        }
        let tag = |k: usize| {
            let x_m = ((k % columns) as f64 - (columns as f64 - 1.0) / 2.0) * pitch_m;
            let y_m = ((rows as f64 - 1.0) / 2.0 - (k / columns) as f64) * pitch_m;
            let id = FIRST_ID + k as u32;
            Tag { family: super::family_36h11(), id, size_m, center_m: Point::new(x_m, y_m), yaw_rad: 0.0 }
        };
        let mut board =
            Self { version: 1, family: super::family_36h11(), tags: (0..count).map(tag).collect() };
        board.check("board")?;
        Ok(board)
    }

    /// An error that names what cannot be in the file `file`; sorts the tags by number.
    ///
    /// # Errors
    /// Another family, a number that does not exist or stands twice, too few tags, impossible sizes and positions.
    pub fn check(&mut self, file: &str) -> Result<()> {
        for (owner, family) in std::iter::once((file.to_owned(), &self.family))
            .chain(self.tags.iter().map(|tag| (format!("{file}: tag {}", tag.id), &tag.family)))
        {
            if family.trim_start_matches("tag") != "36h11" {
                return Err(Error::invalid(owner, "family", format!("`{family}`"), "`36h11`"));
            }
        }
        if !(LEAST_TAGS..=MOST_TAGS).contains(&self.tags.len()) {
            let needed = format!("{LEAST_TAGS} to {MOST_TAGS} [[tags]]");
            return Err(Error::invalid(file, "tags", self.tags.len(), needed));
        }
        for tag in &self.tags {
            let owner = format!("{file}: tag {}", tag.id);
            length(&owner, "size_m", tag.size_m)?;
            position(&owner, "center_m", &[tag.center_m.x, tag.center_m.y])?;
            angle(&owner, "yaw_rad", tag.yaw_rad)?;
            if tag.id as usize >= MOST_TAGS {
                return Err(Error::invalid(owner, "id", tag.id, format!("0 to {}", MOST_TAGS - 1)));
            }
        }
        self.tags.sort_by_key(|tag| tag.id);
        match self.tags.windows(2).find(|pair| pair[0].id == pair[1].id) {
            Some(pair) => {
                Err(Error::invalid(file, "tags", format!("tag {} twice", pair[0].id), "each tag once"))
            }
            None => Ok(()),
        }
    }
}
