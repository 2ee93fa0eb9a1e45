//! The joint configurations that hold the striker upright at a point of the table, and the tip's capability there.

use super::kinematics::condition_number;
use super::mounted_arm::MountedArm;
use crate::geometry::{Point, Vec2};
use crate::object::Shape;
use nalgebra::{Vector3, Vector6};
use std::f64::consts::TAU;

/// One solution of the inverse kinematics for an upright striker at a point of the table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct IkSolution {
    /// Rotation of the tool about the vertical (rad, table frame).
    pub(crate) yaw_rad: f64,
    /// Joint angles (rad).
    pub(crate) angles: Vec<f64>,
    /// The joint of a seven-joint arm that is held fixed during straight motions.
    pub(crate) fixed_joint: Option<usize>,
}

/// The tip's capability in one direction at one point of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Capability {
    /// The tip's largest speed in that direction without rotation (m/s).
    pub speed_m_s: f64,
    /// The effective mass of the tip (kg, Eq. 8).
    pub effective_mass_kg: f64,
}

/// Number of rotations tried for a round striker.
const ROUND_YAWS: u32 = 12;

impl MountedArm {
    /// The solutions at a point for a strike along `heading_rad`: all branches, for all rotations that leave the striker's
    /// outline unchanged.
    pub(crate) fn ik_solutions(&self, position: Point, heading_rad: f64) -> Vec<IkSolution> {
        let all = self.tool_yaws(heading_rad).flat_map(|yaw_rad| {
            let target = self.upright(position, self.strike_height_m, yaw_rad);
            self.arm.branches(&target).into_iter().map(move |angles| (yaw_rad, angles))
        });
        all.map(|(yaw_rad, angles)| self.ik_solution(yaw_rad, angles)).collect()
    }

    /// The tip's speed (m/s) along a heading (rad) within `speed_fraction` of the joints' speed limits, for the first solution that
    /// reaches `wanted_m_s`, else for the fastest one; zero out of reach.
    pub(crate) fn reachable_speed_m_s(
        &self,
        position: Point,
        heading_rad: f64,
        wanted_m_s: f64,
        speed_fraction: f64,
    ) -> f64 {
        let direction = self.direction_in_base(Vec2::from_heading(heading_rad));
        let mut fastest_m_s: f64 = 0.0;
        for yaw_rad in self.tool_yaws(heading_rad) {
            let target = self.upright(position, self.strike_height_m, yaw_rad);
            for angles in self.arm.solutions(&target) {
                let solution = self.ik_solution(yaw_rad, angles);
                fastest_m_s =
                    fastest_m_s.max(speed_fraction * self.straight_speed_m_s(&solution, &direction));
                if fastest_m_s >= wanted_m_s {
                    return fastest_m_s;
                }
            }
        }
        fastest_m_s
    }

    /// The rotations of the tool that leave the striker's outline unchanged, from that of the heading on (rad).
    fn tool_yaws(&self, heading_rad: f64) -> impl Iterator<Item = f64> {
        let step_rad = match &self.striker {
            Shape::Disc { .. } => TAU / f64::from(ROUND_YAWS),
            other => other.rotation_symmetry_rad().unwrap_or(TAU),
        };
        let rotations = (TAU / step_rad).round() as u32;
        (0..rotations).map(move |k| heading_rad + step_rad * f64::from(k))
    }

    fn ik_solution(&self, yaw_rad: f64, angles: Vec<f64>) -> IkSolution {
        let fixed_joint = self.fixed_joint_of(&angles);
        IkSolution { yaw_rad, angles, fixed_joint }
    }

    /// The joint of a seven-joint arm without which the Jacobian's condition number is smallest; `None` for six joints.
    pub(crate) fn fixed_joint_of(&self, angles: &[f64]) -> Option<usize> {
        if self.arm.joint_count() == 6 {
            return None;
        }
        let jacobian = self.arm.jacobian(angles);
        let condition = |k: usize| condition_number(&jacobian.clone().remove_column(k));
        (0..self.arm.joint_count()).min_by(|&i, &j| condition(i).total_cmp(&condition(j)))
    }

    /// The tip's largest speed along a unit vector of the base frame without rotation (m/s), limited by the joints' speeds;
    /// zero at a singular configuration.
    pub(crate) fn straight_speed_m_s(&self, solution: &IkSolution, direction: &Vector3<f64>) -> f64 {
        let velocity = Vector6::new(direction.x, direction.y, direction.z, 0.0, 0.0, 0.0);
        let still = Vector6::zeros();
        let Some((speeds, _)) =
            self.arm.joint_rates(&solution.angles, &velocity, &still, solution.fixed_joint)
        else {
            return 0.0;
        };
        let links = speeds.iter().zip(&self.arm.links);
        let least =
            links.map(|(speed, link)| link.joint.speed_rad_s / speed.abs()).fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { 0.0 }
    }

    /// The capability at a point along a heading (rad), for the fastest solution; `None` out of reach.
    pub fn capability(&self, position: Point, heading_rad: f64) -> Option<Capability> {
        let direction = self.direction_in_base(Vec2::from_heading(heading_rad));
        let capabilities = self.ik_solutions(position, heading_rad).into_iter().filter_map(|solution| {
            let mobility = direction.dot(&(self.arm.tip_mobility(&solution.angles)? * direction));
            let speed_m_s = self.straight_speed_m_s(&solution, &direction);
            Some(Capability { speed_m_s, effective_mass_kg: 1.0 / mobility })
        });
        capabilities.max_by(|a, b| a.speed_m_s.total_cmp(&b.speed_m_s))
    }
}
