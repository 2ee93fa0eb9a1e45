//! How do the objects slide and bounce?
//!
//! Sections 4.1 to 4.3 of the paper with the corrected equations: every clip is fitted as rest, slide, impact, slide,
//! rest; the fits of all clips together give friction, restitution and mass ratios with their uncertainty.

use crate::cell::Cell;
use crate::detect::Tracks;
use crate::error::Result;
use crate::object::Object;
use crate::properties::Properties;
use crate::scene::Strike;

/// The tracks of one clip and what the robot was told in it.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipTracks {
    /// The clip's name, as messages call it.
    pub name: String,
    /// Its objects, the struck one first.
    pub objects: Vec<String>,
    /// The strike.
    pub strike: Strike,
    /// Where the objects were.
    pub tracks: Tracks,
}

/// How to estimate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// The object whose mass is the unit; the first one in the alphabet if not given.
    pub reference: Option<String>,
}

/// Friction, restitution and mass ratios from the tracks of all clips.
///
/// # Errors
/// No clip at all, a reference that is no object.
pub fn properties(
    _clips: &[ClipTracks],
    _cell: &Cell,
    _objects: &[Object],
    _options: &Options,
) -> Result<Properties> {
    todo!()
}
