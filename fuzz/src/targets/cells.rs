//! The cell: its TOML, its camera (YAML), its arm (URDF), touched points.

use super::{fixture, fixture_text, outcome};
use crate::{Outcome, Scratch, Target};
use breakshot::cell::RobotSpec;
use breakshot::robot::{self, Arm, MountedArm, TouchedPoint};
use breakshot::{files, object::Shape};
use serde::Deserialize;
use std::collections::BTreeMap;

/// What TOML is made of.
pub(super) const TOML: &[&str] = &[
    "[",
    "]",
    "[[",
    "]]",
    "=",
    ".",
    "\"",
    "'''",
    "#",
    "{",
    "}",
    "\n",
    "inf",
    "nan",
    "-1",
    "1e308",
    "1e-320",
    "0",
    "0x7fffffffffffffff",
    "true",
    "1979-05-27",
    "\\u0000",
    ",",
    "[[tags]]\n",
    "[striker]\n",
    "shape = ",
    "disc",
    "polygon",
    "points_m",
    "rectangle",
];

/// `cell.toml`.
pub const CELL: Target = Target::of_text(
    "cell",
    "cell.toml, and the arm in it",
    |bytes| {
        let text = String::from_utf8_lossy(bytes).into_owned();
        let cell = files::cell_of(Scratch::folder().path("cell.toml"), text);
        if let Ok(cell) = &cell
            && let Some(robot) = &cell.robot
        {
            // An arm that cannot be built is an error; whether it can be is not in question here.
            drop(MountedArm::new(robot, cell.striker.shape.clone()));
        }
        outcome(cell, &["cell.toml"])
    },
    || {
        vec![
            fixture("fixtures/demo/cell.toml"),
            fixture("crates/breakshot/tests/data/arms/indy7_cell.toml"),
            fixture("crates/breakshot-cli/templates/cell.toml"),
        ]
    },
    &[TOML],
);

/// The intrinsics of a camera, as ROS and OpenCV write them.
pub const CAMERA_INFO: Target = Target::of_text(
    "camera_info",
    "a ROS CameraInfo or OpenCV's YAML",
    |bytes| {
        let scratch = Scratch::folder();
        scratch.write("camera_info.yaml", bytes);
        let cell = fixture_text("fixtures/demo/cell.toml");
        let camera = cell.split_once("[camera]").and_then(|(_, rest)| rest.split_once("[["));
        let rest = camera.map(|(_, rest)| rest).ok_or("the fixture has no camera")?;
        let text = format!("[camera]\ncamera_info = \"camera_info.yaml\"\n[[{rest}");
        let read = files::cell_of(scratch.path("cell.toml"), text);
        outcome(read, &["camera_info.yaml"])
    },
    || {
        let ros = "image_width: 640\nimage_height: 480\ncamera_name: head\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
                   data: [600.5, 0, 320.25, 0, 601, 240.0, 0., 0., 1.]\ndistortion_model: plumb_bob\n\
                   distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.1, -0.2, 0.001, 0.002, 0.0]\n";
        let opencv = format!("%YAML:1.0\n---\n{}", ros.replace("matrix:\n", "matrix: !!opencv-matrix\n"));
        vec![ros.into(), opencv.into_bytes()]
    },
    &[&[
        "---\n", "...\n", "- ", "? ", ": ", "&a ", "*a", "!!", "|\n", ">\n", "[", "]", "{", "}", "'", "\"",
        "#", "%YAML", "\t", "  ", ".inf", ".nan", "1e308", "~", "<<: ",
    ]],
);

/// The URDF of an arm, of which the flange is the outermost link.
pub const URDF: Target = Target::of_text(
    "urdf",
    "URDF: the arm, mounted",
    |bytes| {
        let text = String::from_utf8_lossy(bytes);
        match Arm::from_urdf(&text, "arm.urdf", None) {
            Ok(_) => {
                let robot = RobotSpec { urdf: Some(text.into_owned()), ..robot_spec("arm.urdf")? };
                // As in `cell`.
                drop(MountedArm::new(&robot, Shape::Disc { radius_m: 0.015 }));
                Ok(Outcome::Read)
            }
            Err(error) => outcome::<()>(Err(error), &["arm.urdf"]),
        }
    },
    || {
        let arm = |name: &str| fixture(&format!("crates/breakshot/tests/data/arms/{name}.urdf"));
        ["offset_wrist", "seven_joints", "with_gripper"].map(arm).to_vec()
    },
    &[&[
        "<link name=\"",
        "<joint name=\"",
        "type=\"revolute\"",
        "<parent link=\"",
        "<child link=\"",
        "<origin xyz=\"",
        "rpy=\"",
        "<axis xyz=\"",
        "<limit lower=\"",
        "<inertial>",
        "<mass value=\"",
        "<inertia ixx=\"",
        "<collision>",
        "<geometry>",
        "<box size=\"",
        "<mesh filename=\"",
        "<cylinder radius=\"",
        "<sphere radius=\"",
        "<mimic joint=\"",
        "/>",
        "<!--",
        "-->",
        "<![CDATA[",
        "&amp;",
        "&#0;",
        "<!DOCTYPE",
        "<!ENTITY",
        "xmlns:",
        "nan",
        "inf",
        "1e308",
        "0 0 0",
        "-1",
    ]],
);

/// The points that an arm touched, to find the table in its frame.
pub const TOUCHES: Target = Target::of_text(
    "touches",
    "touched points (TOML), and the fit of the base",
    |bytes| {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct TouchFile {
            touches: Vec<TouchedPoint>,
        }
        let path = Scratch::folder().write("touches.toml", bytes);
        let arm = Arm::built_in("indy7").map_err(|e| e.to_string())?;
        let read = files::read_toml::<TouchFile>(&path)
            .and_then(|file| robot::base_registration(&arm, &file.touches));
        if let Ok(fit) = &read
            && !(fit.rms_mm.is_finite() && fit.base_from_table.position_m.iter().all(|x| x.is_finite()))
        {
            return Err(format!("a fit without numbers: {fit:?}"));
        }
        outcome(read, &["touch"])
    },
    || {
        let line = |table: [f64; 2], rest: &str| format!("[[touches]]\ntable_m = {table:?}\n{rest}\n");
        let base = |x: f64, y: f64| line([x, y], &format!("base_m = [{}, {}, 0.01]", 0.4 + x, y));
        let joints = "q_deg = [0.0, -20.0, -90.0, 0.0, -70.0, 10.0]";
        let turned = |k: f64| joints.replace("[0.0", &format!("[{}", 10.0 * k));
        vec![
            [base(0.1, 0.1), base(-0.1, 0.1), base(0.1, -0.1), base(-0.1, -0.1)].concat().into_bytes(),
            [
                line([0.1, 0.0], &turned(0.0)),
                line([0.08, 0.05], &turned(3.0)),
                line([0.0, 0.1], &turned(7.0)),
            ]
            .concat()
            .into_bytes(),
        ]
    },
    &[&[
        "[[touches]]\n",
        "table_m = ",
        "q_rad = ",
        "q_deg = ",
        "base_m = ",
        "[",
        "]",
        "inf",
        "nan",
        "1e308",
        "-1",
        "0",
        ",",
    ]],
);

/// The built-in settings of a robot whose arm is this file.
fn robot_spec(arm: &str) -> Result<RobotSpec, String> {
    let settings: BTreeMap<&str, &str> = [("arm", arm)].into();
    let value = serde_json::to_value(settings).map_err(|e| e.to_string())?;
    serde_json::from_value(value).map_err(|e| e.to_string())
}
