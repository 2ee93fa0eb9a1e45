//! The sources of an arm's model: built-in, a URDF, a cell.

use super::frame::frame;
use super::serial_arm::{Arm, GRAVITY_M_S2, Tool};
use super::{indy7, urdf};
use crate::cell::RobotSpec;
use crate::error::{Error, Result};
use nalgebra::Vector3;

/// The names of the built-in models.
const BUILT_IN: [&str; 4] = ["indy7", "indy7_published", "indy7_v2", "indy7_v2_published"];

impl Arm {
    /// A built-in arm: `indy7`, `indy7_v2`, or either with the inertias as published by the maker (`_published`).
    ///
    /// The published tensors of the Indy 7 refer to the link's origin and have positive products of inertia; a URDF uses the
    /// centre of mass and negative products. Read as a URDF, they are impossible for links of that size. The models without
    /// `_published` contain the converted tensors.
    ///
    /// # Errors
    /// No built-in arm of that name.
    pub fn built_in(name: &str) -> Result<Self> {
        indy7::arm(name).ok_or_else(|| {
            Error::invalid("arm", "name", format!("`{name}`"), format!("a URDF file or one of {BUILT_IN:?}"))
        })
    }

    /// The arm of a URDF's text, from its root to the link `flange`, or to the outermost link if it is unique. `file` is its
    /// name in error messages.
    ///
    /// Links with inertials and primitive collision shapes, and joints with origin, axis and limits are read; a link without
    /// a shape counts as 12 cm thick.
    ///
    /// # Errors
    /// Not a plain URDF, not one root, not six or seven revolute joints, or joints without limits.
    pub fn from_urdf(text: &str, file: &str, flange: Option<&str>) -> Result<Self> {
        urdf::arm(text, file, flange)
    }

    /// The arm of a cell with its tool, and gravity in the base frame according to `base_from_table`.
    ///
    /// # Errors
    /// See [`Arm::built_in`], [`Arm::from_urdf`], [`Arm::with_tool`] and [`Arm::with_armature`].
    pub fn of_cell(robot: &RobotSpec) -> Result<Self> {
        let arm = if let Some(text) = &robot.urdf {
            Self::from_urdf(text, &robot.arm, robot.flange.as_deref())?
        } else if robot.is_file() {
            let found = format!("`{}` without its text", robot.arm);
            return Err(Error::invalid("cell: robot", "arm", found, "a URDF loaded with the cell"));
        } else {
            Self::built_in(&robot.arm)?
        };
        let mut arm = match &robot.armature_kg_m2 {
            Some(armature_kg_m2) => arm.with_armature(armature_kg_m2)?,
            None => arm,
        };
        // The table is level: gravity in the frame of a tilted base is tilted.
        if let Some(base_from_table) = robot.base_from_table {
            let rotation = frame([0.0; 3], base_from_table.rpy_rad).rotation;
            arm.gravity_m_s2 = rotation * Vector3::new(0.0, 0.0, -GRAVITY_M_S2);
        }
        arm.with_tool(Tool { offset_m: robot.tool_offset_m.into(), mass_kg: robot.tool_mass_kg })
    }
}
