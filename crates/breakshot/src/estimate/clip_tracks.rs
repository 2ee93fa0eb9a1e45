//! The input of the estimation: the tracks of one clip and the strike that was filmed.

use crate::detect::Tracks;
use crate::scene::Strike;
use crate::statistics::median;

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

impl ClipTracks {
    /// The rate of its samples (Hz).
    pub(crate) fn frame_rate_hz(&self) -> Option<f64> {
        let steps_s =
            self.tracks.tracks.iter().flat_map(|t| t.samples.windows(2).map(|w| w[1].time_s - w[0].time_s));
        median(steps_s).filter(|step_s| *step_s > 0.0).map(f64::recip)
    }
}
