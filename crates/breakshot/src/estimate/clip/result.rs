//! The fitted motion and the impacts of a clip, as the user gets them.

use super::motion_model::BodyPath;
use super::sliding::MotionState;
use crate::geometry::{Point, Vec2};
pub use crate::uncertain::Measured;

/// The motion of one clip's bodies with the least squared residuals.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ClipFit {
    /// The clip's name.
    pub name: String,
    /// One fit per object, in the order of the clip's objects.
    pub bodies: Vec<BodyFit>,
    /// All impacts, in order of time.
    pub impacts: Vec<Impact>,
    /// The root mean square distance between the observations of moving bodies and the fit (m).
    pub residual_rms_m: f64,
    /// Warnings for the user.
    pub remarks: Vec<String>,
}

/// The fitted motion of one object in one clip.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct BodyFit {
    /// The object.
    pub object: String,
    /// Its coefficient of friction against the table; `None` if it did not slide.
    pub friction: Option<Measured>,
    pub(crate) path: BodyPath,
}

impl BodyFit {
    /// Its pose and velocity at a time of the clip (s); at the instant of an impact, those just after it.
    pub fn motion(&self, time_s: f64) -> MotionState {
        self.path.motion(time_s)
    }
}

/// One impact of a clip.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Impact {
    /// When (s).
    pub time: Measured,
    /// The hitting body: an object, `striker`, or `None` if it was neither filmed nor specified.
    pub a: Option<String>,
    /// The body that was hit.
    pub b: String,
    /// The unit normal from a to b.
    pub normal_ab: Vec2,
    /// The contact point.
    pub point: Point,
    /// The distance between the outlines at the impact (m); far from zero if names or outlines are wrong.
    pub gap_m: f64,
    /// The striker's distance from its given start (m) at its first impact; `None` at other impacts, and if the given strike does not reach b.
    pub striker_distance_m: Option<f64>,
    /// The motions of a and b just before.
    pub before: [MotionState; 2],
    /// The motions of a and b just after.
    pub after: [MotionState; 2],
    /// The restitution; `None` unless this is a single impact with a known normal.
    pub restitution: Option<Measured>,
    /// The mass of a over the mass of b; `None` unless this is an impact of two objects alone.
    pub mass_ratio: Option<Measured>,
    /// Why a value is absent, and other warnings.
    pub remarks: Vec<String>,
}
