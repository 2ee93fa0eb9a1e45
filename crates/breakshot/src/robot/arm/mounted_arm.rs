//! The arm in its position at the table.

use super::joint_state::JointState;
use super::model::frame::{Frame, frame};
use super::model::serial_arm::Arm;
use crate::cell::{Cell, RobotSpec};
use crate::error::{Error, Result};
use crate::geometry::{Point, Vec2};
use crate::object::Shape;
use nalgebra::Vector3;
use std::f64::consts::PI;

/// An arm with its base pose at the table, its striker and its home pose.
#[derive(Clone, Debug, PartialEq)]
pub struct MountedArm {
    pub(crate) arm: Arm,
    pub(crate) base_from_table: Frame,
    /// Height of the tip above the table during the strike (m).
    pub(crate) strike_height_m: f64,
    /// The striker's outline.
    pub(crate) striker: Shape,
    /// The home pose (rad), if the cell or the arm's maker gives one.
    pub(crate) home_rad: Option<Vec<f64>>,
}

/// Default height of the tip (m): low enough for flat objects, above the errors of the base pose and the table's flatness.
const STRIKE_HEIGHT_M: f64 = 0.01;
/// The home pose of the Indy 7 (deg), from its maker's examples.
const INDY7_HOME_DEG: [f64; 6] = [0.0, -15.0, -90.0, 0.0, -75.0, 0.0];
impl MountedArm {
    /// The arm of a cell.
    ///
    /// # Errors
    /// A cell without `[robot]`, and see [`Arm::of_cell`].
    pub fn of_cell(cell: &Cell) -> Result<Self> {
        let needed = "a [robot] table with `arm` and `base_from_table`";
        let robot = cell.robot.as_ref().ok_or_else(|| Error::invalid("cell", "robot", "missing", needed))?;
        Self::new(robot, cell.striker.shape.clone())
    }

    /// The arm with a striker of that outline.
    ///
    /// # Errors
    /// A missing `base_from_table`, and see [`Arm::of_cell`].
    pub fn new(robot: &RobotSpec, striker: Shape) -> Result<Self> {
        let needed = "the table's pose in the robot's base frame; `breakshot command --touch` finds it";
        let base_from_table = robot
            .base_from_table
            .ok_or_else(|| Error::invalid("cell: robot", "base_from_table", "missing", needed))?;
        let arm = Arm::of_cell(robot)?;
        let strike_height_m = robot.strike_height_m.unwrap_or(STRIKE_HEIGHT_M);
        crate::error::bounds::positive("cell: robot", "strike_height_m", strike_height_m)?;
        let home_rad = home(&arm, robot)?;
        let base_from_table = frame(base_from_table.position_m, base_from_table.rpy_rad);
        Ok(Self { arm, base_from_table, strike_height_m, striker, home_rad })
    }

    /// The tip's position in the table plane and its height (m).
    pub fn tip_on_table(&self, angles_rad: &[f64]) -> (Point, f64) {
        let tip = (self.base_from_table.inverse() * self.arm.tip(angles_rad)).translation;
        (Point::new(tip.x, tip.y), tip.z)
    }

    /// The tip's velocity along the table (m/s).
    pub fn tip_velocity_on_table(&self, state: &JointState) -> Vec2 {
        let velocity = self.base_from_table.rotation.inverse() * self.arm.tip_velocity(state);
        Vec2::new(velocity.x, velocity.y)
    }

    /// The origins of base, joints, flange and tip (m, table frame).
    pub fn skeleton_on_table(&self, angles_rad: &[f64]) -> Vec<[f64; 3]> {
        let table_from_base = self.base_from_table.inverse();
        let on_table = |point: [f64; 3]| (table_from_base * nalgebra::Point3::from(point)).into();
        self.arm.skeleton(angles_rad).into_iter().map(on_table).collect()
    }

    /// The position of the base in the table plane.
    pub fn base_on_table(&self) -> Point {
        let base = self.base_from_table.inverse().translation;
        Point::new(base.x, base.y)
    }

    /// The arm.
    pub fn arm(&self) -> &Arm {
        &self.arm
    }

    /// The tip frame in the base frame for an upright striker `height_m` above a point, its z axis pointing down.
    pub(crate) fn upright(&self, position: Point, height_m: f64, yaw_rad: f64) -> Frame {
        let table_from_tip = frame([position.x, position.y, height_m], [PI, 0.0, yaw_rad]);
        self.base_from_table * table_from_tip
    }

    /// A direction in the table plane, in the base frame.
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
