//! What happens during a strike: events, exact motions between them, energies.

use crate::geometry::{Point, Pose, Vec2};
use crate::physics::output::near_miss::NearMiss;
use crate::properties::Assumption;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The events of a strike, and the exact pose of every object at any time.
#[non_exhaustive]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    /// Version of the file format.
    pub version: u32,
    /// Pose of every object at rest.
    #[serde(rename = "final")]
    pub final_poses: BTreeMap<String, Pose>,
    /// Time at which everything is at rest (s after the striker starts).
    pub duration_s: f64,
    /// The events in the order of time.
    pub events: Vec<Event>,
    /// Energy balance.
    pub energy: Energy,
    /// Motion of each object, and of the striker under the name `striker`, as segments in the order of time.
    pub motions: BTreeMap<String, Vec<Segment>>,
    /// The miss of smallest gap, or the hit of smallest overlap: where small changes have the largest effect.
    #[serde(default, rename = "closest_graze")]
    pub closest_near_miss: Option<NearMiss>,
    /// Assumptions and unusual events that a user should know.
    pub notes: Vec<String>,
    /// Whether everything came to rest within the bounds of a simulation; if not, a note says where it ended.
    #[serde(default = "came_to_rest", skip_serializing_if = "is_complete")]
    pub complete: bool,
    /// Properties that no clip measured, with the values that were used.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumed: Vec<Assumption>,
}

fn came_to_rest() -> bool {
    true
}

/// The usual value is not written.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_complete(complete: &bool) -> bool {
    *complete
}

/// An event at one instant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Time (s after the striker starts).
    pub time_s: f64,
    /// Kind of the event.
    pub kind: EventKind,
    /// Names of the bodies: objects, `striker`, `walls[k]` or `keep_out[k]`.
    pub bodies: Vec<String>,
    /// Point of contact (m), or centre of the body.
    pub point_m: Point,
    /// Unit vector from the first body to the second.
    pub normal: Vec2,
    /// Impulse on the second body (N s, or per mass of the reference object if that was not weighed).
    pub impulse_n_s: Vec2,
    /// Velocities of the bodies before the event (m/s).
    pub velocities_before_m_s: Vec<Vec2>,
    /// Velocities of the bodies after the event (m/s).
    pub velocities_after_m_s: Vec<Vec2>,
    /// Yaw rates before the event (rad/s).
    pub yaw_rates_before_rad_s: Vec<f64>,
    /// Yaw rates after the event (rad/s).
    pub yaw_rates_after_rad_s: Vec<f64>,
    /// Energy lost in the contact (J, or per mass of the reference object if that was not weighed).
    pub loss_j: f64,
}

/// Kinds of events.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// An impact of two bodies.
    Impact,
    /// The centre of an object passed the edge of the table.
    Fallen,
    /// A body entered a keep-out area, which does not change its motion.
    Entered,
}

/// Energy balance of a strike (J, or per mass of the reference object if that was not weighed): work minus losses is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// Work of the striker on the objects.
    pub striker_work_j: f64,
    /// Energy lost in impacts.
    pub impact_loss_j: f64,
    /// Energy lost to friction on the table.
    pub friction_loss_j: f64,
    /// Kinetic energy of the objects that fell off the table.
    #[serde(default)]
    pub fallen_j: f64,
    /// Work of gravity along a tilted table; zero on a level one.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub tilt_work_j: f64,
}

/// The work on a level table is not written.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(work_j: &f64) -> bool {
    *work_j == 0.0
}

/// A part of a motion: position and yaw are polynomials of the time since its start, constant term first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// Start time (s).
    pub start_s: f64,
    /// End time (s).
    pub end_s: f64,
    /// Coefficients of x (m, m/s, ...).
    pub x_m: Vec<f64>,
    /// Coefficients of y.
    pub y_m: Vec<f64>,
    /// Coefficients of the yaw (rad, rad/s, ...).
    pub yaw_rad: Vec<f64>,
}

impl Segment {
    pub(crate) fn pose(&self, time_s: f64) -> Pose {
        let time = time_s.clamp(self.start_s, self.end_s) - self.start_s;
        let at = |c: &[f64]| c.iter().rev().fold(0.0, |sum, &c| sum * time + c);
        Pose::new(at(&self.x_m), at(&self.y_m), at(&self.yaw_rad))
    }
}

impl Trajectory {
    /// The pose of an object (or `striker`) `time_s` after the striker starts; after the last segment the final pose; `None`
    /// for an unknown name.
    pub fn pose(&self, object: &str, time_s: f64) -> Option<Pose> {
        let segments = self.motions.get(object)?;
        let next = segments.partition_point(|s| s.start_s <= time_s);
        match segments.get(next.saturating_sub(1)) {
            Some(segment) if time_s <= segment.end_s || next < segments.len() => Some(segment.pose(time_s)),
            last => self.final_poses.get(object).copied().or(last.map(|s| s.pose(time_s))),
        }
    }
}
