//! Why was an object lost, or its position doubtful?
//!
//! While a film is tracked a record can be kept of where each object was expected in each frame, and, where it was lost, of
//! the regions that were tried and refused. It changes no track.

pub(super) mod candidates;
pub(super) mod reason;
pub(super) mod recorder;

pub use reason::{Doubt, Rejection};

use super::tracks::Tracks;
use crate::capture::Camera;
use crate::geometry::{Pixel, Pose};
use crate::object::Object;

/// The tracks of a clip, and how each object was searched in each frame.
#[derive(Clone, Debug)]
pub struct Explained {
    /// The tracks.
    pub tracks: Tracks,
    /// The objects with the outlines that were tracked.
    pub objects: Vec<Object>,
    /// The cameras of the frames: the calibrated one first; further ones where it moved.
    pub cameras: Vec<Camera>,
    /// One for each track, in the same order.
    pub searches: Vec<ObjectSearches>,
}

/// How one object was searched, frame by frame.
#[derive(Clone, Debug)]
pub struct ObjectSearches {
    /// Name of the object; `a#2` for the second copy of `a`.
    pub object: String,
    /// Height above the table at which its marker (or its outline) appears (m).
    pub height_m: f64,
    /// All frames that were tracked, in the order of time.
    pub frames: Vec<Search>,
}

/// The search for one object in one frame.
#[derive(Clone, Debug)]
pub struct Search {
    /// Number of the frame in the film, from 0 on.
    pub frame: usize,
    /// Presentation time of the frame (s).
    pub time_s: f64,
    /// Index of the frame's camera among those of [`Explained`].
    pub camera: usize,
    /// The expected pose in the table frame.
    pub predicted: Pose,
    /// How far from the expected place the object was searched (m).
    pub radius_m: f64,
    /// What was found.
    pub outcome: Outcome,
}

/// What the search for an object in one frame found.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// The object.
    Found(Sighting),
    /// The object at a position that may be biased, for these reasons.
    Doubtful(Sighting, Vec<Doubt>),
    /// Nothing that was accepted; the regions nearest to the expected place, at most [`MOST_CANDIDATES`].
    Lost(Vec<Candidate>),
}

/// Regions that are recorded where an object was lost.
pub const MOST_CANDIDATES: usize = 5;

/// An object as it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// The pose in the table frame; with the expected yaw where that was not measured.
    pub pose: Pose,
    /// Standard deviation of the position along each axis (m).
    pub std_m: f64,
    /// The marker, or the outline, in the frame.
    pub spot: Spot,
}

/// A region of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Its centroid.
    pub centroid: Pixel,
    /// Its central second moments over its area: xx, xy, yy (px2).
    pub covariance_px2: [f64; 3],
}

/// A region that was not accepted as the object.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Where it is in the frame.
    pub spot: Spot,
    /// Its distance from the expected place (m).
    pub distance_m: f64,
    /// Why it is not the object.
    pub reason: Rejection,
}

impl Outcome {
    /// Whether the object was found without doubt.
    pub fn is_trusted(&self) -> bool {
        matches!(self, Self::Found(_))
    }
}
