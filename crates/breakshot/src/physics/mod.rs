//! What does this strike do to this pile?
//!
//! An event-driven simulation in the plane: bodies slide under Coulomb friction in closed form (evolve), the instant of
//! the next impact is a root (contact), an impact is resolved by Routh's method with Stronge's restitution (resolve).

use crate::error::Result;
use crate::geometry::Pose;
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How to simulate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {}

/// What happens: events, and the exact state at any time between them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    /// The file format's version.
    pub version: u32,
    /// Where every object comes to rest.
    #[serde(rename = "final")]
    pub final_poses: BTreeMap<String, Pose>,
    /// When everything is at rest (s after the striker starts).
    pub duration_s: f64,
}

impl Trajectory {
    /// Where an object is `time_s` after the striker starts; its final pose once it rests; `None` for an unknown name.
    pub fn pose(&self, _object: &str, _time_s: f64) -> Option<Pose> {
        todo!()
    }
}

/// Simulates one strike.
///
/// # Errors
/// Objects that overlap, a striker that starts inside one, properties that were never measured.
pub fn trajectory(
    _scene: &Scene,
    _properties: &Properties,
    _strike: &Strike,
    _options: &Options,
) -> Result<Trajectory> {
    todo!()
}
