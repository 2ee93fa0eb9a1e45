//! Whether the arm can follow a path, and how near it comes to each limit.

use crate::robot::phase::PhaseName;
use serde::{Deserialize, Serialize};

/// What is checked on every sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// How far a joint stays from the end of its range (rad).
    JointMargin,
    /// How fast a joint turns (rad/s).
    JointSpeed,
    /// How fast that changes (rad/s2).
    JointAcceleration,
    /// What a joint must hold (N m).
    JointTorque,
    /// How near the tip is to a place where it cannot move in some direction.
    ConditionNumber,
    /// How far the links stay above the table (m).
    TableClearance,
    /// How far parts of the arm stay from each other (m).
    SelfClearance,
    /// How far the tip stays inside its box (m).
    BoxMargin,
}

/// How near a path comes to a limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// What was checked.
    pub quantity: Quantity,
    /// The value nearest to the limit, or farthest past it.
    pub found: f64,
    /// The limit: the least allowed margin, clearance, or the largest allowed value of anything else.
    pub allowed: f64,
    /// The joint or the parts of the arm.
    pub part: String,
    /// When.
    pub phase: PhaseName,
    /// When, since the command's start (s).
    pub time_s: f64,
}

/// What the arm may use of what it can.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Least distance of a joint from the ends of its range (rad).
    pub joint_margin_rad: f64,
    /// Largest share of a joint's speed.
    pub speed_share: f64,
    /// Largest share of a joint's torque.
    pub torque_share: f64,
    /// Largest acceleration of a joint over its largest speed (1/s).
    pub acceleration_per_speed: f64,
    /// Largest ratio of the Jacobian's singular values.
    pub condition_number: f64,
    /// Least distance of the links from the table (m).
    pub table_clearance_m: f64,
    /// Least distance of parts of the arm from each other (m).
    pub self_clearance_m: f64,
}

impl Default for Limits {
    /// Margin, condition number and shares as in Neuromeka's servo configuration; nine times the largest speed per
    /// second is the most its controller takes.
    fn default() -> Self {
        Self {
            joint_margin_rad: 0.1,
            speed_share: 0.9,
            torque_share: 0.8,
            acceleration_per_speed: 9.0,
            condition_number: 100.0,
            table_clearance_m: 0.01,
            self_clearance_m: 0.01,
        }
    }
}

impl Quantity {
    /// Whether the value must stay above its limit.
    fn is_margin(self) -> bool {
        matches!(self, Self::JointMargin | Self::TableClearance | Self::SelfClearance | Self::BoxMargin)
    }

    /// In words, and the unit.
    pub fn text(self) -> (&'static str, &'static str) {
        match self {
            Self::JointMargin => ("distance from the end of its range", "rad"),
            Self::JointSpeed => ("speed", "rad/s"),
            Self::JointAcceleration => ("acceleration", "rad/s2"),
            Self::JointTorque => ("torque", "N m"),
            Self::ConditionNumber => ("condition number", ""),
            Self::TableClearance => ("height above the table", "m"),
            Self::SelfClearance => ("distance", "m"),
            Self::BoxMargin => ("distance from the edge of the workspace and its margin", "m"),
        }
    }
}

impl Check {
    /// Whether the limit is kept.
    pub fn holds(&self) -> bool {
        if self.quantity.is_margin() { self.found >= self.allowed } else { self.found <= self.allowed }
    }

    /// How bad it is: negative while the limit is kept, in shares of the limit.
    pub(crate) fn excess(&self) -> f64 {
        let over =
            if self.quantity.is_margin() { self.allowed - self.found } else { self.found - self.allowed };
        over / self.allowed.abs().max(LEAST_LIMIT)
    }

    /// One clause that names the joint, what was found and what is allowed.
    pub fn sentence(&self) -> String {
        let (what, unit) = self.quantity.text();
        let bound = if self.quantity.is_margin() { "at least" } else { "at most" };
        format!(
            "{}: {what} {:.3} {unit} during the {} ({:.2} s); allowed is {bound} {:.3} {unit}",
            self.part,
            self.found,
            self.phase.text(),
            self.time_s,
            self.allowed
        )
    }
}

/// Against division by a limit of zero.
const LEAST_LIMIT: f64 = 1e-3;
