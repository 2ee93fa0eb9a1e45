//! How near does a path come to the arm's limits? Checks every sample and keeps the worst value of each quantity.

use super::limits::{LimitCheck, LimitedQuantity, Limits};
use super::tool_solid::ToolSolid;
use crate::cell::Cell;
use crate::robot::arm::joint_state::JointState;
use crate::robot::arm::kinematics::condition_number;
use crate::robot::arm::model::frame::Frame;
use crate::robot::arm::model::serial_arm::Arm;
use crate::robot::arm::mounted_arm::MountedArm;
use crate::robot::arm::self_collision::SelfCollision;
use crate::robot::phase::PhaseName;
use crate::scene::Scene;
use std::collections::BTreeMap;

/// How far outside the workspace the tip may move (m): the run-up begins behind objects at the workspace's edge.
const BOX_MARGIN_M: f64 = 0.15;

/// Below this height (m) the tip stays in its region in every phase: higher are the walls and fixtures of few tables.
const LOW_M: f64 = 0.1;

/// The region of the tip during the straight motions, in the table frame (m).
#[derive(Clone, Copy, Debug, PartialEq)]
struct TipBox {
    low: [f64; 2],
    high: [f64; 2],
}

/// Everything that a path must respect: the arm in its position, its limits, its self-collision pairs, the tip's region.
#[derive(Clone, Debug)]
pub(crate) struct PathConstraints<'a> {
    pub(crate) arm: &'a Arm,
    pub(crate) limits: &'a Limits,
    table_from_base: Frame,
    collision: SelfCollision,
    tip_box: TipBox,
    tool: ToolSolid,
}

impl<'a> PathConstraints<'a> {
    /// The constraints of a cell; with a scene also its objects.
    pub(crate) fn new(
        mounted: &'a MountedArm,
        cell: &Cell,
        scene: Option<&Scene>,
        limits: &'a Limits,
    ) -> Self {
        let (min, max) = (cell.workspace.min_m, cell.workspace.max_m);
        Self {
            arm: &mounted.arm,
            limits,
            table_from_base: mounted.base_from_table.inverse(),
            collision: SelfCollision::of(&mounted.arm, mounted.striker.outer_radius_m()),
            tool: ToolSolid::new(mounted, scene),
            tip_box: TipBox {
                low: [min.x - BOX_MARGIN_M, min.y - BOX_MARGIN_M],
                high: [max.x + BOX_MARGIN_M, max.y + BOX_MARGIN_M],
            },
        }
    }

    /// A monitor without samples.
    pub(crate) fn monitor(&'a self) -> LimitMonitor<'a> {
        LimitMonitor { constraints: self, worst: BTreeMap::new() }
    }
}

/// The worst value of each quantity over the samples recorded so far.
#[derive(Clone, Debug)]
pub(crate) struct LimitMonitor<'a> {
    constraints: &'a PathConstraints<'a>,
    pub(crate) worst: BTreeMap<LimitedQuantity, LimitCheck>,
}

/// The phase of a sample and its time (s).
#[derive(Clone, Copy)]
struct SampleTime {
    phase: PhaseName,
    time_s: f64,
}

impl LimitMonitor<'_> {
    /// Records one sample. Approach and return may leave the tip's region and pass singular configurations.
    pub(crate) fn record(&mut self, phase: PhaseName, time_s: f64, state: &JointState) {
        let (arm, limits) = (self.constraints.arm, self.constraints.limits);
        let at = SampleTime { phase, time_s };

        // Joints
        let torques = arm.torques(&state.q_rad, &state.qd_rad_s, &state.qdd_rad_s2);
        for (k, link) in arm.links.iter().enumerate() {
            let joint = &link.joint;
            let [low, high] = joint.range_rad;
            let q = state.q_rad[k];
            let mut keep = |quantity: LimitedQuantity, found: f64, allowed: f64| {
                self.keep_worst(at.check(quantity, found, allowed), || format!("joint `{}`", joint.name));
            };
            keep(LimitedQuantity::JointMargin, (q - low).min(high - q), limits.joint_margin_rad);
            let speed_limit = limits.speed_fraction * joint.speed_rad_s;
            keep(LimitedQuantity::JointSpeed, state.qd_rad_s[k].abs(), speed_limit);
            let acceleration_limit = limits.acceleration_per_speed * joint.speed_rad_s;
            keep(LimitedQuantity::JointAcceleration, state.qdd_rad_s2[k].abs(), acceleration_limit);
            let torque_limit = limits.torque_fraction * joint.torque_n_m;
            keep(LimitedQuantity::JointTorque, torques[k].abs(), torque_limit);
        }

        // Tip, during the straight motions
        if !matches!(phase, PhaseName::Approach | PhaseName::Home) {
            let condition = condition_number(&arm.jacobian(&state.q_rad));
            let check = at.check(LimitedQuantity::ConditionNumber, condition, limits.condition_number);
            self.keep_worst(check, || "the arm".into());
        }
        let is_straight = !matches!(phase, PhaseName::Approach | PhaseName::Home);
        let tool_height_m = self.constraints.tool.at(arm, &state.q_rad).lowest_m;
        if is_straight || tool_height_m < LOW_M {
            let check = at.check(LimitedQuantity::BoxMargin, self.box_margin_m(state), 0.0);
            self.keep_worst(check, || "the tip".into());
        }

        self.record_clearances(phase, time_s, &state.q_rad);
    }

    /// The distance of the tip from the edge of its region, negative outside (m).
    fn box_margin_m(&self, state: &JointState) -> f64 {
        let constraints = self.constraints;
        let tip = constraints.table_from_base * constraints.arm.tip(&state.q_rad);
        let margins = (0..2).map(|k| {
            let x = tip.translation.vector[k];
            (x - constraints.tip_box.low[k]).min(constraints.tip_box.high[k] - x)
        });
        margins.fold(f64::INFINITY, f64::min)
    }

    /// Records the clearances of the links from the table and of the arm's parts from each other.
    pub(crate) fn record_clearances(&mut self, phase: PhaseName, time_s: f64, angles_rad: &[f64]) {
        let PathConstraints { arm, limits, .. } = *self.constraints;
        let (table_from_base, collision) = (&self.constraints.table_from_base, &self.constraints.collision);
        let at = SampleTime { phase, time_s };
        // The first link rotates about the vertical: its clearance from the table does not depend on the path.
        for (k, capsules) in arm.link_capsules(angles_rad).iter().enumerate().skip(1) {
            let heights = capsules.iter().map(|capsule| {
                let capsule = capsule.transformed(table_from_base);
                capsule.from_m.z.min(capsule.to_m.z) - capsule.radius_m
            });
            let height = heights.fold(f64::INFINITY, f64::min);
            let check = at.check(LimitedQuantity::TableClearance, height, limits.table_clearance_m);
            self.keep_worst(check, || format!("link `{}`", arm.links[k].name));
        }
        self.record_tool(at, angles_rad);
        if let Some(closest) = collision.closest(arm, angles_rad) {
            let check = at.check(LimitedQuantity::SelfClearance, closest.gap_m, limits.self_clearance_m);
            self.keep_worst(check, || {
                let (i, j) = closest.parts;
                format!("`{}` and `{}`", arm.part_name(i), arm.part_name(j))
            });
        }
    }

    /// Records the tool's height above the table and, outside the strike, its distance from objects.
    fn record_tool(&mut self, at: SampleTime, angles_rad: &[f64]) {
        let PathConstraints { arm, tool, .. } = self.constraints;
        let place = tool.at(arm, angles_rad);
        let check = at.check(LimitedQuantity::ToolHeight, place.lowest_m, tool.least_height_m);
        self.keep_worst(check, || "the tool".into());
        if matches!(at.phase, PhaseName::Strike | PhaseName::DrawBack) {
            return;
        }
        if let Some(distance_m) = tool.object_distance_m(&place) {
            let check = at.check(LimitedQuantity::ObjectClearance, distance_m, 0.0);
            self.keep_worst(check, || "the tool".into());
        }
    }

    /// Keeps a check if it is nearer to its limit, or farther past it, than the previous one of its quantity.
    fn keep_worst(&mut self, mut check: LimitCheck, part: impl FnOnce() -> String) {
        // A value that is no number breaks its limit.
        let is_worse = |known: &LimitCheck| {
            check.excess() > known.excess() || (check.found.is_nan() && !known.found.is_nan())
        };
        if self.worst.get(&check.quantity).is_none_or(is_worse) {
            check.part = part();
            self.worst.insert(check.quantity, check);
        }
    }

    /// Keeps of two monitors the check of each quantity that is nearer to its limit, or farther past it; this one's if they are equal.
    pub(crate) fn merge(&mut self, later: LimitMonitor<'_>) {
        for check in later.worst.into_values() {
            let part = check.part.clone();
            self.keep_worst(check, || part);
        }
    }

    /// The most exceeded limit, if any limit is exceeded.
    pub(crate) fn broken(&self) -> Option<&LimitCheck> {
        let broken = self.worst.values().filter(|check| !check.holds());
        broken.max_by(|a, b| a.excess().total_cmp(&b.excess()))
    }
}

impl SampleTime {
    /// A check at this sample; its part is named only if it is the worst check.
    fn check(self, quantity: LimitedQuantity, found: f64, allowed: f64) -> LimitCheck {
        LimitCheck { quantity, found, allowed, part: String::new(), phase: self.phase, time_s: self.time_s }
    }
}
