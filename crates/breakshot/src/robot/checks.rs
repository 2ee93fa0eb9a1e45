//! Whether the arm can follow a path, and how near it comes to each limit.

use super::capsule::SelfCollision;
use super::command::PhaseName;
use super::kinematics::condition_number;
use super::model::Arm;
use super::{Frame, JointState};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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
    pub(super) fn excess(&self) -> f64 {
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

/// The region the tip may be in while it is low, in the table's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TipBox {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
}

/// Looks at every sample and keeps the worst of each quantity.
#[derive(Clone, Debug)]
pub(super) struct Watch<'a> {
    pub(super) arm: &'a Arm,
    pub(super) table_from_base: Frame,
    pub(super) collision: &'a SelfCollision,
    pub(super) limits: &'a Limits,
    pub(super) tip_box: TipBox,
    pub(super) worst: BTreeMap<Quantity, Check>,
}

impl Watch<'_> {
    /// Takes note of one sample; the joint moves at either end may leave the box and pass singular poses.
    pub(super) fn look(&mut self, phase: PhaseName, time_s: f64, state: &JointState) {
        let is_straight = !matches!(phase, PhaseName::Approach | PhaseName::Home);
        let (arm, limits) = (self.arm, self.limits);
        let torques = arm.torques(&state.q_rad, &state.qd_rad_s, &state.qdd_rad_s2);
        for (k, link) in arm.links.iter().enumerate() {
            let joint = &link.joint;
            let [low, high] = joint.range_rad;
            let q = state.q_rad[k];
            let mut note = |quantity: Quantity, found: f64, allowed: f64| {
                let part = || format!("joint `{}`", joint.name);
                self.note(quantity, (found, allowed), (phase, time_s), part);
            };
            note(Quantity::JointMargin, (q - low).min(high - q), limits.joint_margin_rad);
            note(Quantity::JointSpeed, state.qd_rad_s[k].abs(), limits.speed_share * joint.speed_rad_s);
            let acceleration = limits.acceleration_per_speed * joint.speed_rad_s;
            note(Quantity::JointAcceleration, state.qdd_rad_s2[k].abs(), acceleration);
            note(Quantity::JointTorque, torques[k].abs(), limits.torque_share * joint.torque_n_m);
        }
        if is_straight {
            let condition = condition_number(&arm.jacobian(&state.q_rad));
            self.note(
                Quantity::ConditionNumber,
                (condition, limits.condition_number),
                (phase, time_s),
                || "the arm".into(),
            );
            self.look_at_box(phase, time_s, state);
        }
        self.look_at_clearances(phase, time_s, &state.q_rad);
    }

    fn look_at_box(&mut self, phase: PhaseName, time_s: f64, state: &JointState) {
        let tip = self.table_from_base * self.arm.tip(&state.q_rad);
        let margins = (0..2).map(|k| {
            let x = tip.translation.vector[k];
            (x - self.tip_box.low[k]).min(self.tip_box.high[k] - x)
        });
        let margin = margins.fold(f64::INFINITY, f64::min);
        self.note(Quantity::BoxMargin, (margin, 0.0), (phase, time_s), || "the tip".into());
    }

    /// Takes note of how far the links stay from the table and from each other.
    pub(super) fn look_at_clearances(&mut self, phase: PhaseName, time_s: f64, angles_rad: &[f64]) {
        let when = (phase, time_s);
        // The first link turns on the spot: it is as far from the table as it was built.
        for (k, capsules) in self.arm.link_capsules(angles_rad).iter().enumerate().skip(1) {
            let heights = capsules.iter().map(|capsule| {
                let capsule = capsule.seen_from(&self.table_from_base);
                capsule.from_m.z.min(capsule.to_m.z) - capsule.radius_m
            });
            let height = heights.fold(f64::INFINITY, f64::min);
            let part = || format!("link `{}`", self.arm.links[k].name);
            let allowed = self.limits.table_clearance_m;
            note(&mut self.worst, Quantity::TableClearance, (height, allowed), when, part);
        }
        if let Some(closest) = self.collision.closest(self.arm, angles_rad) {
            let part = || {
                let (i, j) = closest.parts;
                format!("`{}` and `{}`", self.arm.part_name(i), self.arm.part_name(j))
            };
            let allowed = self.limits.self_clearance_m;
            note(&mut self.worst, Quantity::SelfClearance, (closest.gap_m, allowed), when, part);
        }
    }

    fn note(
        &mut self,
        quantity: Quantity,
        values: (f64, f64),
        when: (PhaseName, f64),
        part: impl FnOnce() -> String,
    ) {
        note(&mut self.worst, quantity, values, when, part);
    }

    /// The worst broken limit, if any is.
    pub(super) fn broken(&self) -> Option<&Check> {
        let broken = self.worst.values().filter(|check| !check.holds());
        broken.max_by(|a, b| a.excess().total_cmp(&b.excess()))
    }
}

/// Keeps a value if it is nearer to its limit, or farther past it, than what was seen before.
fn note(
    worst: &mut BTreeMap<Quantity, Check>,
    quantity: Quantity,
    (found, allowed): (f64, f64),
    (phase, time_s): (PhaseName, f64),
    part: impl FnOnce() -> String,
) {
    let mut check = Check { quantity, found, allowed, part: String::new(), phase, time_s };
    let is_worse = worst.get(&quantity).is_none_or(|known| check.excess() > known.excess());
    if is_worse {
        check.part = part();
        worst.insert(quantity, check);
    }
}
