//! The ways an arm can hold the striker upright at a place on the table, and what it can do there.

use super::kinematics::condition_number;
use super::mounted_arm::Station;
use crate::geometry::{Point, Vec2};
use crate::object::Shape;
use nalgebra::{Vector3, Vector6};
use std::f64::consts::TAU;

/// One way to hold the striker at a place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Posture {
    /// How the tool is turned about the vertical (rad, table).
    pub(crate) yaw_rad: f64,
    /// The joint angles (rad).
    pub(crate) angles: Vec<f64>,
    /// The joint of a seven-joint arm that stands still during straight motions.
    pub(crate) still: Option<usize>,
}

/// What the arm can do in one direction at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capability {
    /// The tip's largest speed in that direction, straight and without turning (m/s).
    pub speed_m_s: f64,
    /// What the tip feels like to what it hits (kg, Eq. 8).
    pub effective_mass_kg: f64,
}

/// Ways to turn a round striker about the vertical.
const ROUND_YAWS: u32 = 12;

impl Station {
    /// The postures at a place for a strike along `heading_rad`: all branches, for all ways the striker may be turned.
    pub(crate) fn postures(&self, place: Point, heading_rad: f64) -> Vec<Posture> {
        let step_rad = match &self.striker {
            Shape::Disc { .. } => TAU / f64::from(ROUND_YAWS),
            other => other.rotation_symmetry_rad().unwrap_or(TAU),
        };
        let turns = (TAU / step_rad).round() as u32;
        let yaws = (0..turns).map(|k| heading_rad + step_rad * f64::from(k));
        let all = yaws.flat_map(|yaw_rad| {
            let target = self.upright(place, self.strike_height_m, yaw_rad);
            self.arm.branches(&target).into_iter().map(move |angles| (yaw_rad, angles))
        });
        let with_still = all.map(|(yaw_rad, angles)| {
            let still = self.still_joint(&angles);
            Posture { yaw_rad, angles, still }
        });
        with_still.collect()
    }

    /// The joint of a seven-joint arm without which the tip moves most evenly.
    pub(crate) fn still_joint(&self, angles: &[f64]) -> Option<usize> {
        if self.arm.joint_count() == 6 {
            return None;
        }
        let jacobian = self.arm.jacobian(angles);
        let condition = |k: usize| condition_number(&jacobian.clone().remove_column(k));
        (0..self.arm.joint_count()).min_by(|&i, &j| condition(i).total_cmp(&condition(j)))
    }

    /// The tip's largest speed along a unit direction of the base (m/s), straight and without turning, all joints
    /// within their speeds; zero at a singular pose.
    pub(crate) fn straight_speed_m_s(&self, posture: &Posture, direction: &Vector3<f64>) -> f64 {
        let velocity = Vector6::new(direction.x, direction.y, direction.z, 0.0, 0.0, 0.0);
        let still = Vector6::zeros();
        let Some((speeds, _)) = self.arm.joint_rates(&posture.angles, &velocity, &still, posture.still)
        else {
            return 0.0;
        };
        let links = speeds.iter().zip(&self.arm.links);
        let least =
            links.map(|(speed, link)| link.joint.speed_rad_s / speed.abs()).fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { 0.0 }
    }

    /// What the arm can do at a place along a heading (rad), in its fastest posture; `None` out of its reach.
    pub fn capability(&self, place: Point, heading_rad: f64) -> Option<Capability> {
        let direction = self.direction_in_base(Vec2::from_heading(heading_rad));
        let abilities = self.postures(place, heading_rad).into_iter().filter_map(|posture| {
            let mobility = direction.dot(&(self.arm.tip_mobility(&posture.angles)? * direction));
            let speed_m_s = self.straight_speed_m_s(&posture, &direction);
            Some(Capability { speed_m_s, effective_mass_kg: 1.0 / mobility })
        });
        abilities.max_by(|a, b| a.speed_m_s.total_cmp(&b.speed_m_s))
    }

    /// Eq. 8's effective mass (kg) for the planner: zero where the arm cannot strike at `speed_m_s`.
    pub fn effective_mass_kg(&self, place: Point, heading_rad: f64, speed_m_s: f64) -> f64 {
        match self.capability(place, heading_rad) {
            Some(capability) if capability.speed_m_s >= speed_m_s => capability.effective_mass_kg,
            _ => 0.0,
        }
    }
}
