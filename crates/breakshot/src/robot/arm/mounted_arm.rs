//! The arm at its table.

use super::joint_state::JointState;
use super::model::frame::{Frame, frame};
use super::model::serial_arm::Arm;
use crate::cell::{Cell, RobotSpec};
use crate::error::{Error, Result};
use crate::geometry::{Point, Vec2};
use crate::object::Shape;
use nalgebra::Vector3;
use std::f64::consts::PI;

/// The arm at its table.
#[derive(Clone, Debug, PartialEq)]
pub struct Station {
    pub(crate) arm: Arm,
    pub(crate) base_from_table: Frame,
    /// How high the tip runs above the table (m).
    pub(crate) strike_height_m: f64,
    /// The striker's outline.
    pub(crate) striker: Shape,
    /// The waiting pose (rad), if the cell or the arm's maker tells one.
    pub(crate) home_rad: Option<Vec<f64>>,
}

/// Low enough for flat objects, above what the arm's place and the table's flatness are known to (m).
const STRIKE_HEIGHT_M: f64 = 0.01;
/// The Indy 7's home (deg), as its maker's examples have it.
const INDY7_HOME_DEG: [f64; 6] = [0.0, -15.0, -90.0, 0.0, -75.0, 0.0];
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
    pub(crate) fn upright(&self, place: Point, height_m: f64, yaw_rad: f64) -> Frame {
        let table_from_tip = frame([place.x, place.y, height_m], [PI, 0.0, yaw_rad]);
        self.base_from_table * table_from_tip
    }

    /// A direction on the table as seen from the base.
    pub(crate) fn direction_in_base(&self, direction: Vec2) -> Vector3<f64> {
        self.base_from_table.rotation * Vector3::new(direction.x, direction.y, 0.0)
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
