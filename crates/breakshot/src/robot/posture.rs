//! The ways an arm can hold the striker upright at a place on the table, and what it can do there.

use super::kinematics::condition_number;
use super::model::{Arm, frame};
use super::{Frame, JointState};
use crate::cell::{Cell, RobotSpec};
use crate::error::{Error, Result};
use crate::geometry::{Point, Vec2};
use crate::object::Shape;
use nalgebra::{Vector3, Vector6};
use std::f64::consts::{PI, TAU};

/// The arm at its table.
#[derive(Clone, Debug, PartialEq)]
pub struct Station {
    pub(super) arm: Arm,
    pub(super) base_from_table: Frame,
    /// How high the tip runs above the table (m).
    pub(super) strike_height_m: f64,
    /// The striker's outline.
    pub(super) striker: Shape,
    /// The waiting pose (rad), if the cell or the arm's maker tells one.
    pub(super) home_rad: Option<Vec<f64>>,
}

/// One way to hold the striker at a place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Posture {
    /// How the tool is turned about the vertical (rad, table).
    pub(super) yaw_rad: f64,
    /// The joint angles (rad).
    pub(super) angles: Vec<f64>,
    /// The joint of a seven-joint arm that stands still during straight motions.
    pub(super) still: Option<usize>,
}

/// What the arm can do in one direction at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capability {
    /// The tip's largest speed in that direction, straight and without turning (m/s).
    pub speed_m_s: f64,
    /// What the tip feels like to what it hits (kg, Eq. 8).
    pub effective_mass_kg: f64,
}

/// Low enough for flat objects, above what the arm's place and the table's flatness are known to (m).
const STRIKE_HEIGHT_M: f64 = 0.01;
/// The Indy 7's home (deg), as its maker's examples have it.
const INDY7_HOME_DEG: [f64; 6] = [0.0, -15.0, -90.0, 0.0, -75.0, 0.0];
/// Ways to turn a round striker about the vertical.
const ROUND_YAWS: u32 = 12;

impl Station {
    /// The arm of a cell in its place.
    ///
    /// # Errors
    /// A cell without `[robot]`, and see [`Arm::of_cell`].
    pub fn of_cell(cell: &Cell) -> Result<Self> {
        let needed = "a [robot] table with `arm` and `base_from_table`";
        let robot = cell.robot.as_ref().ok_or_else(|| Error::invalid("cell", "robot", "missing", needed))?;
        Self::new(robot, cell.striker.shape.clone())
    }

    /// The arm in its place, with a striker of that outline.
    ///
    /// # Errors
    /// Where the table lies is not told, and see [`Arm::of_cell`].
    pub fn new(robot: &RobotSpec, striker: Shape) -> Result<Self> {
        let needed = "where the table lies for the robot; `breakshot command --touch` finds it";
        let base_from_table = robot
            .base_from_table
            .ok_or_else(|| Error::invalid("cell: robot", "base_from_table", "missing", needed))?;
        let arm = Arm::of_cell(robot)?;
        let strike_height_m = robot.strike_height_m.unwrap_or(STRIKE_HEIGHT_M);
        crate::object::positive("cell: robot", "strike_height_m", strike_height_m)?;
        let home_rad = home(&arm, robot)?;
        let base_from_table = frame(base_from_table.position_m, base_from_table.rpy_rad);
        Ok(Self { arm, base_from_table, strike_height_m, striker, home_rad })
    }

    /// The place of the tip on the table, and its height (m).
    pub fn tip_on_table(&self, angles_rad: &[f64]) -> (Point, f64) {
        let tip = (self.base_from_table.inverse() * self.arm.tip(angles_rad)).translation;
        (Point::new(tip.x, tip.y), tip.z)
    }

    /// The velocity of the tip along the table (m/s).
    pub fn tip_velocity_on_table(&self, state: &JointState) -> Vec2 {
        let velocity = self.base_from_table.rotation.inverse() * self.arm.tip_velocity(state);
        Vec2::new(velocity.x, velocity.y)
    }

    /// The arm.
    pub fn arm(&self) -> &Arm {
        &self.arm
    }

    /// The tip's frame in the base's frame for an upright striker `height_m` above a place, its axis pointing down.
    pub(super) fn upright(&self, place: Point, height_m: f64, yaw_rad: f64) -> Frame {
        let table_from_tip = frame([place.x, place.y, height_m], [PI, 0.0, yaw_rad]);
        self.base_from_table * table_from_tip
    }

    /// A direction on the table as seen from the base.
    pub(super) fn direction_in_base(&self, direction: Vec2) -> Vector3<f64> {
        self.base_from_table.rotation * Vector3::new(direction.x, direction.y, 0.0)
    }

    /// The postures at a place for a strike along `heading_rad`: all branches, for all ways the striker may be turned.
    pub(super) fn postures(&self, place: Point, heading_rad: f64) -> Vec<Posture> {
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
    pub(super) fn still_joint(&self, angles: &[f64]) -> Option<usize> {
        if self.arm.joint_count() == 6 {
            return None;
        }
        let jacobian = self.arm.jacobian(angles);
        let condition = |k: usize| condition_number(&jacobian.clone().remove_column(k));
        (0..self.arm.joint_count()).min_by(|&i, &j| condition(i).total_cmp(&condition(j)))
    }

    /// The tip's largest speed along a unit direction of the base (m/s), straight and without turning, all joints
    /// within their speeds; zero at a singular pose.
    pub(super) fn straight_speed_m_s(&self, posture: &Posture, direction: &Vector3<f64>) -> f64 {
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

fn home(arm: &Arm, robot: &RobotSpec) -> Result<Option<Vec<f64>>> {
    let Some(home_rad) = &robot.home_rad else {
        return Ok(arm.name.starts_with("indy7").then(|| INDY7_HOME_DEG.map(f64::to_radians).to_vec()));
    };
    if home_rad.len() != arm.joint_count() {
        let needed = format!("{}, one per joint", arm.joint_count());
        return Err(Error::invalid("cell: robot", "home_rad", format!("{} numbers", home_rad.len()), needed));
    }
    Ok(Some(home_rad.clone()))
}
