//! Where an arm's model comes from: the built-in ones, a URDF, a cell.

use super::frame::frame;
use super::serial_arm::{Arm, GRAVITY_M_S2, Tool};
use super::{indy7, urdf};
use crate::cell::RobotSpec;
use crate::error::{Error, Result};
use crate::files;
use nalgebra::Vector3;
use std::path::Path;

/// The models that [`Arm::built_in`] gives.
const BUILT_IN: [&str; 4] = ["indy7", "indy7_published", "indy7_v2", "indy7_v2_published"];

impl Arm {
    /// A built-in arm: `indy7`, `indy7_v2`, and both with the inertias as their maker published them.
    ///
    /// The published tensors of the Indy 7 are taken about the link's origin with positive products of inertia, where a
    /// URDF means the centre of mass and negative ones; read as a URDF they are impossible for links of that
    /// size.  The unmarked models carry them converted.
    ///
    /// # Errors
    /// No built-in arm of that name.
    pub fn built_in(name: &str) -> Result<Self> {
        indy7::arm(name).ok_or_else(|| {
            Error::invalid("arm", "name", format!("`{name}`"), format!("a URDF file or one of {BUILT_IN:?}"))
        })
    }

    /// The arm of a URDF's text, from its root to the link `flange`, or to its outermost link where that is clear;
    /// `path` leads the messages.
    ///
    /// Read are links with inertials and primitive collision shapes, and joints with origin, axis and limits; a link
    /// without a shape counts as 12 cm thick.
    ///
    /// # Errors
    /// Not a plain URDF, not one root, not six or seven turning joints, joints without limits.
    pub fn from_urdf(text: &str, path: &Path, flange: Option<&str>) -> Result<Self> {
        urdf::arm(text, path, flange)
    }

    /// The arm of a cell with its tool, standing as `base_from_table` says.
    ///
    /// # Errors
    /// See [`Arm::built_in`], [`Arm::from_urdf`], [`Arm::with_tool`] and [`Arm::with_armature`].
    pub fn of_cell(robot: &RobotSpec) -> Result<Self> {
        let path = Path::new(&robot.arm);
        let arm = if robot.is_file() {
            Self::from_urdf(&files::text(path)?, path, robot.flange.as_deref())?
        } else {
            Self::built_in(&robot.arm)?
        };
        let mut arm = match &robot.armature_kg_m2 {
            Some(armature_kg_m2) => arm.with_armature(armature_kg_m2)?,
            None => arm,
        };
        // The table is level: an arm that stands askew feels gravity askew.
        if let Some(base_from_table) = robot.base_from_table {
            let turn = frame([0.0; 3], base_from_table.rpy_rad).rotation;
            arm.gravity_m_s2 = turn * Vector3::new(0.0, 0.0, -GRAVITY_M_S2);
        }
        arm.with_tool(Tool { offset_m: robot.tool_offset_m.into(), mass_kg: robot.tool_mass_kg })
    }
}
