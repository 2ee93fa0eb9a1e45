//! Looks at every sample of a path and keeps the worst of each quantity.

use super::limits::{Check, Limits, Quantity};
use crate::robot::arm::joint_state::JointState;
use crate::robot::arm::kinematics::condition_number;
use crate::robot::arm::model::frame::Frame;
use crate::robot::arm::model::serial_arm::Arm;
use crate::robot::arm::self_collision::SelfCollision;
use crate::robot::phase::PhaseName;
use std::collections::BTreeMap;

/// The region the tip may be in while it is low, in the table's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TipBox {
    pub(crate) low: [f64; 2],
    pub(crate) high: [f64; 2],
}

/// Looks at every sample and keeps the worst of each quantity.
#[derive(Clone, Debug)]
pub(crate) struct Watch<'a> {
    pub(crate) arm: &'a Arm,
    pub(crate) table_from_base: Frame,
    pub(crate) collision: &'a SelfCollision,
    pub(crate) limits: &'a Limits,
    pub(crate) tip_box: TipBox,
    pub(crate) worst: BTreeMap<Quantity, Check>,
}

impl Watch<'_> {
    /// Takes note of one sample; the joint moves at either end may leave the box and pass singular poses.
    pub(crate) fn look(&mut self, phase: PhaseName, time_s: f64, state: &JointState) {
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
    pub(crate) fn look_at_clearances(&mut self, phase: PhaseName, time_s: f64, angles_rad: &[f64]) {
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
    pub(crate) fn broken(&self) -> Option<&Check> {
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
