//! What a fitted clip tells the outside.

use super::motion_model::Path;
use super::sliding::Motion;
use crate::geometry::{Point, Vec2};
use serde::{Deserialize, Serialize};

/// A value and one standard deviation of its error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// One standard deviation, from the noise of the track.
    pub std: f64,
}

/// The most likely motion of one clip's bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipFit {
    /// The clip.
    pub name: String,
    /// One fit per object, in the order of the clip's objects.
    pub bodies: Vec<BodyFit>,
    /// All impacts, in order of time.
    pub impacts: Vec<Impact>,
    /// How far the sights of moving bodies lie from the fit (m, root mean square, both axes together).
    pub residual_rms_m: f64,
    /// What the user should know.
    pub remarks: Vec<String>,
}

/// One object of a fitted clip.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyFit {
    /// The object.
    pub object: String,
    /// Its friction against the table, if it slid.
    pub friction: Option<Measured>,
    pub(crate) path: Path,
}

impl BodyFit {
    /// Its fitted motion at a time of the clip; at the instant of an impact, the one after it.
    pub fn motion(&self, time_s: f64) -> Motion {
        self.path.motion(time_s)
    }
}

/// One impact of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct Impact {
    /// When (s).
    pub time: Measured,
    /// Who hit: an object, `striker`, or nothing that was filmed or told.
    pub a: Option<String>,
    /// Who was hit.
    pub b: String,
    /// The unit vector from a to b.
    pub normal_ab: Vec2,
    /// Where they touched.
    pub point: Point,
    /// How far apart the outlines were at that moment (m); far from zero if names or outlines are wrong.
    pub gap_m: f64,
    /// Motions of a and b just before.
    pub before: [Motion; 2],
    /// Motions of a and b just after.
    pub after: [Motion; 2],
    /// The restitution, where one impact along one normal took place.
    pub restitution: Option<Measured>,
    /// Mass of a over mass of b, for two objects; its standard deviation is relative.
    pub mass_ratio: Option<Measured>,
    /// Why something was left out.
    pub remarks: Vec<String>,
}
