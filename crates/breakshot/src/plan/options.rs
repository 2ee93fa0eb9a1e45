//! The inputs of the planner besides scene and properties: algorithm, arm, proposals, execution noise, seed.

use crate::error::{Error, Result};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};

/// The planning algorithm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The paper's feedback on the speed, with the properties at their means.
    Paper,
    /// The strike with the largest success probability under all uncertainties.
    #[default]
    Robust,
}

/// A function from a scene to strikes that are evaluated in addition to the grid, such as a learned model.
pub type Proposals<'a> = dyn Fn(&Scene) -> Vec<Aim> + Sync + 'a;

/// A function that gets the part of a search that is done (0 to 1).
pub type Progress<'a> = dyn Fn(f64) + Sync + 'a;

/// Whether the caller wants no answer any more.
pub type Stopped<'a> = &'a (dyn Fn() -> bool + Sync);

/// How to plan.
#[derive(Clone, Copy, Default)]
pub struct Options<'a> {
    /// The algorithm.
    pub method: Method,
    /// Plans also what the cell's arm cannot execute; the striker counts as infinitely heavy then.
    pub any_arm: bool,
    /// Lists what would help if no strike is found ([`Plan::remedies`](super::Plan::remedies)), which takes about as long again.
    pub remedies: bool,
    /// Strikes to evaluate in addition to the grid; used by `Robust`.
    pub proposals: Option<&'a Proposals<'a>>,
    /// Errors of observation and execution; used by `Robust`.
    pub noise: ExecutionNoise,
    /// Seed of all random draws; used by `Robust`.
    pub seed: u64,
    /// Whether the caller wants no answer any more: from then on nothing is simulated, and the plan ends with
    /// [`Error::Stopped`]; used by `Robust` and surveys.
    pub stopped: Option<Stopped<'a>>,
    /// Follows the search; used by `Robust`.
    pub progress: Option<&'a Progress<'a>>,
}

impl Options<'_> {
    /// Whether the caller wants no answer any more.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stopped.is_some_and(|stopped| stopped())
    }

    /// Reports the part of the search that is done.
    pub(crate) fn report(&self, done: f64) {
        if let Some(progress) = self.progress {
            progress(done);
        }
    }
}

/// Errors of the observed poses and of the executed strike: standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExecutionNoise {
    /// Of an object's position, along each axis (m).
    pub position_m: f64,
    /// Of an object's yaw (rad).
    pub yaw_rad: f64,
    /// Of the strike's speed, relative.
    pub speed: f64,
    /// Of the strike's heading (rad).
    pub heading_rad: f64,
}

impl ExecutionNoise {
    /// Checks that every standard deviation is a possible one.
    ///
    /// # Errors
    /// One that is negative, not finite, or larger than any table.
    pub(crate) fn check(&self) -> Result<()> {
        for (what, value, most, unit) in [
            ("position_std_m", self.position_m, 1.0, " m"),
            ("yaw_std_rad", self.yaw_rad, std::f64::consts::PI, " rad"),
            ("speed_std", self.speed, 1.0, ""),
            ("heading_std_rad", self.heading_rad, std::f64::consts::PI, " rad"),
        ] {
            if !(0.0..=most).contains(&value) {
                return Err(Error::invalid("noise", what, value, format!("from 0 to {most:.3}{unit}")));
            }
        }
        Ok(())
    }
}

impl Default for ExecutionNoise {
    /// Default noise (1 sigma): object position 1 mm and 1 degree, strike speed 2 %, heading 1 degree.
    fn default() -> Self {
        Self { position_m: 1e-3, yaw_rad: 0.0175, speed: 0.02, heading_rad: 0.0175 }
    }
}

/// A strike without its start: object, line, speed and follow-through.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aim {
    /// Name of the object to touch first.
    pub object: String,
    /// Direction of motion (rad).
    pub heading_rad: f64,
    /// Distance by which the striker's line passes the object's centroid on its left (m); negative on its right.
    #[serde(default)]
    pub offset_m: f64,
    /// Speed (m/s), clamped to the striker's range.
    pub speed_m_s: f64,
    /// Distance that the striker moves on after the first contact (m).
    pub follow_through_m: f64,
}
