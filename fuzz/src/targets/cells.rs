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
    "a calibration of ROS, OpenCV or Kalibr",
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
        let xml = "<?xml version=\"1.0\"?>\n<opencv_storage><image_size>640 480</image_size>\n<camera_matrix type_id=\"opencv-matrix\"><rows>3</rows>\
                   <cols>3</cols><dt>d</dt>\n<data>600.5 0. 320. 0. 601. 240. 0. 0. 1.</data></camera_matrix>\n<distCoeffs \
                   type_id=\"opencv-matrix\"><rows>1</rows><cols>4</cols><dt>d</dt><data>0.1 -0.2 0.001 0.002</data></distCoeffs></opencv_storage>\n";
        let kalibr = "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [0.1, -0.2, 0.001, 0.002]\n  distortion_model: equidistant\n  \
                      intrinsics: [600.5, 601, 320.25, 240]\n  resolution: [640, 480]\n";
        let message = "height: 480\nwidth: 640\ndistortion_model: rational_polynomial\nd: [0.1, -0.2, 0.001, 0.002, 0.0, 0.1, 0, 0]\nk: [600.5, 0, \
                       320, 0, 601, 240, 0, 0, 1]\nbinning_x: 2\nbinning_y: 2\nroi: {x_offset: 10, y_offset: 20, height: 400, width: 600}\n";
        let fisheye = xml.replace("<image_size>", "<fisheye_model>1</fisheye_model>\n<image_size>");
        vec![ros.into(), opencv.into_bytes(), xml.into(), fisheye.into(), kalibr.into(), message.into()]
    },
    &[&[
        "---\n", "...\n", "- ", "? ", ": ", "&a ", "*a", "!!", "|\n", ">\n", "[", "]", "{", "}", "'", "\"",
        "#", "<", "</", "/>", "<_>", "<data>", "%YAML", "\t", "  ", ".inf", ".nan", "1e308", "~", "<<: ",
    ]],
);

/// The geometry of a calibration board.
pub const BOARD: Target = Target::of_text(
    "board",
    "board.toml, as TOML or JSON",
    |bytes| {
        let scratch = Scratch::folder();
        scratch.write("board.toml", bytes);
        outcome(files::load_board(scratch.path("board.toml")), &["board.toml"])
    },
    || {
        let tag = |k: u32| {
            format!("[[tags]]\nid = {k}\nsize_m = 0.036\ncenter_m = [{}.5e-2, 0.0]\nyaw_rad = 0.0\n", 4 * k)
        };
        let toml = format!("version = 1\nfamily = \"36h11\"\n{}{}{}{}", tag(1), tag(2), tag(3), tag(4));
        let of = |k: u32| {
            format!("{{\"id\": {k}, \"size_m\": 0.036, \"center_m\": [{k}.0, 0.5], \"yaw_rad\": 0.0}}")
        };
        let json =
            format!("{{\"family\": \"36h11\", \"tags\": [{}, {}, {}, {}]}}", of(1), of(2), of(3), of(4));
        vec![toml.into_bytes(), json.into_bytes()]
    },
    &[TOML],
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
