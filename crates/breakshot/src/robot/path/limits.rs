//! The arm's limits, and how near a path comes to each.

use crate::robot::phase::PhaseName;
use serde::{Deserialize, Serialize};

/// The largest strike speed (m/s): the tip speed permitted by the maker of the Indy 7.
pub const FASTEST_M_S: f64 = 1.0;

/// The quantities that are checked on every sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LimitedQuantity {
    /// Distance of a joint from the end of its range (rad).
    JointMargin,
    /// Absolute joint velocity (rad/s).
    JointSpeed,
    /// Absolute joint acceleration (rad/s2).
    JointAcceleration,
    /// Absolute joint torque (N m).
    JointTorque,
    /// Condition number of the Jacobian; infinite at a singular configuration.
    ConditionNumber,
    /// Height of the links above the table (m).
    TableClearance,
    /// Distance between parts of the arm (m).
    SelfClearance,
    /// Distance of the tip from the edge of its region (m).
    BoxMargin,
    /// Height of the tool, a cylinder as wide as the striker, above the table (m).
    ToolHeight,
    /// Distance of the tool from objects in its way, outside the strike (m).
    ObjectClearance,
}

/// The value of a path that is nearest to a limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct LimitCheck {
    /// The quantity.
    pub quantity: LimitedQuantity,
    /// The value nearest to the limit, or farthest past it.
    pub found: f64,
    /// The limit: the smallest allowed margin or clearance, or the largest allowed value of the other quantities.
    pub allowed: f64,
    /// The joint or the parts of the arm concerned.
    pub part: String,
    /// The phase of the sample.
    pub phase: PhaseName,
    /// Time of the sample since the command's start (s).
    pub time_s: f64,
}

/// The limits of a path.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Smallest distance of a joint from the ends of its range (rad).
    pub joint_margin_rad: f64,
    /// Largest fraction of a joint's speed limit.
    pub speed_fraction: f64,
    /// Largest fraction of a joint's torque limit.
    pub torque_fraction: f64,
    /// Largest ratio of a joint's acceleration to its speed limit (1/s).
    pub acceleration_per_speed: f64,
    /// Largest condition number of the Jacobian (ratio of its extreme singular values).
    pub condition_number: f64,
    /// Smallest height of the links above the table (m).
    pub table_clearance_m: f64,
    /// Smallest distance between parts of the arm (m).
    pub self_clearance_m: f64,
}

impl Default for Limits {
    /// Margin, condition number and fractions as in Neuromeka's servo configuration. Nine times the speed limit per second is
    /// the largest acceleration that its controller accepts.
    fn default() -> Self {
        Self {
            joint_margin_rad: 0.1,
            speed_fraction: 0.9,
            torque_fraction: 0.8,
            acceleration_per_speed: 9.0,
            condition_number: 100.0,
            table_clearance_m: 0.01,
            self_clearance_m: 0.01,
        }
    }
}

impl LimitedQuantity {
    /// Whether the limit is a lower bound.
    fn is_margin(self) -> bool {
        matches!(
            self,
            Self::JointMargin
                | Self::TableClearance
                | Self::SelfClearance
                | Self::BoxMargin
                | Self::ToolHeight
                | Self::ObjectClearance
        )
    }

    /// The name and the unit in messages.
    pub fn label(self) -> (&'static str, &'static str) {
        match self {
            Self::JointMargin => ("distance from the end of its range", "rad"),
            Self::JointSpeed => ("speed", "rad/s"),
            Self::JointAcceleration => ("acceleration", "rad/s2"),
            Self::JointTorque => ("torque", "N m"),
            Self::ConditionNumber => ("condition number", ""),
            Self::TableClearance => ("height above the table", "m"),
            Self::SelfClearance => ("distance", "m"),
            Self::ToolHeight => ("height of its lowest edge above the table", "m"),
            Self::ObjectClearance => ("distance from an object", "m"),
            Self::BoxMargin => ("distance from the edge of the workspace and its margin", "m"),
        }
    }
}

impl LimitCheck {
    /// Whether the limit is kept.
    pub fn holds(&self) -> bool {
        if self.quantity.is_margin() { self.found >= self.allowed } else { self.found <= self.allowed }
    }

    /// The excess over the limit as a fraction of the limit; negative while the limit is kept.
    pub(crate) fn excess(&self) -> f64 {
        let over =
            if self.quantity.is_margin() { self.allowed - self.found } else { self.found - self.allowed };
        over / self.allowed.abs().max(SMALLEST_LIMIT)
    }

    /// One sentence with the part, the value found and the value allowed.
    pub fn sentence(&self) -> String {
        let (what, unit) = self.quantity.label();
        let bound = if self.quantity.is_margin() { "at least" } else { "at most" };
        format!(
            "{}: {what} {:.3} {unit} during the {} ({:.2} s); allowed is {bound} {:.3} {unit}",
            self.part,
            self.found,
            self.phase.label(),
            self.time_s,
            self.allowed
        )
    }
}

/// Smallest divisor of the excess, for limits of zero.
const SMALLEST_LIMIT: f64 = 1e-3;
