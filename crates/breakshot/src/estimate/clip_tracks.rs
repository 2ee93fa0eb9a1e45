//! The input of the estimation: the tracks of one clip and the strike that was filmed.

use crate::detect::Tracks;
use crate::scene::Strike;

/// The tracks of one clip and the strike that the robot was given.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipTracks {
    /// The clip's name, which messages quote.
    pub name: String,
    /// Its objects, the struck one first.
    pub objects: Vec<String>,
    /// The strike; `None` if the objects were set in motion otherwise.
    pub strike: Option<Strike>,
    /// Positions and yaws over time, one track per object.
    pub tracks: Tracks,
}
