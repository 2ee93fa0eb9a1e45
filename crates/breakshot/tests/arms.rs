//! Arms from URDF files: reading, inverse kinematics and strikes.

use breakshot::cell::Cell;
use breakshot::geometry::{Point, Vec2};
use breakshot::robot::{self, Answer, Arm, Command, Frame, MountedArm, Options, PhaseName};
use breakshot::scene::Strike;
use std::path::{Path, PathBuf};

const ARMS: [&str; 3] = ["offset_wrist", "seven_joints", "with_gripper"];

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/arms").join(name).with_extension("urdf")
}

fn arm(name: &str) -> Arm {
    let text = std::fs::read_to_string(file(name)).expect("a test file");
    Arm::from_urdf(&text, name, None).expect("a good arm")
}

/// A cell whose arm is mounted half a metre behind the middle of the table.
fn cell(name: &str) -> Cell {
    let text = format!(
        "[camera]\nscale_px_per_m = 1000.0\n[workspace]\nmin_m = [-0.3, -0.2]\nmax_m = [0.3, 0.2]\n[striker]\n\
         shape = {{ disc = {{ radius_m = 0.015 }} }}\nheight_m = 0.1\nspeed_range_m_s = [0.05, 1.0]\n[robot]\n\
         arm = {:?}\nbase_from_table = {{ position_m = [0.5, 0.0, 0.0] }}\ntool_offset_m = [0.0, 0.0, 0.15]\n\
         tool_mass_kg = 0.3\n",
        file(name).display().to_string()
    );
    let mut cell: Cell = toml::from_str(&text).expect("a cell");
    breakshot::files::load_arm(cell.robot.as_mut().expect("an arm")).expect("a test file");
    cell
}

fn strike() -> Strike {
    Strike { object: None, start_m: Point::new(-0.05, 0.0), heading_rad: 0.4, speed_m_s: 0.3, travel_m: 0.08 }
}

#[test]
fn every_arm_is_read_with_its_flange_and_plausible_inertias() {
    let expected = [("tool0", 6, 0), ("tool0", 7, 0), ("tcp", 6, 2)];
    for (name, (flange, joints, notes)) in ARMS.iter().zip(expected) {
        let arm = arm(name);
        assert_eq!((arm.flange.as_str(), arm.joint_count()), (flange, joints), "{name}");
        assert_eq!(arm.warnings.len(), notes, "{name}: {:?}", arm.warnings);
    }
}

#[test]
fn bodies_fixed_to_a_link_add_to_its_mass() {
    let arm = arm("with_gripper");
    let forearm = arm.links.iter().find(|link| link.name == "forearm").expect("a forearm");
    assert!((forearm.inertia.mass_kg - 3.25).abs() < 1e-12, "with its camera {} kg", forearm.inertia.mass_kg);
    let wrist = arm.links.last().expect("a wrist");
    assert!(
        (wrist.inertia.mass_kg - 1.3).abs() < 1e-12,
        "with gripper and fingers {} kg",
        wrist.inertia.mass_kg
    );
}

#[test]
fn the_inverse_reaches_points_in_front_of_every_arm() {
    for name in ARMS {
        let arm = arm(name);
        for k in 0..20 {
            let target = Frame::from_parts(
                nalgebra::Translation3::new(0.45 + 0.005 * f64::from(k), -0.2 + 0.02 * f64::from(k), 0.3),
                nalgebra::Rotation3::from_euler_angles(3.0, 0.1, 0.1 * f64::from(k)),
            );
            let start = vec![0.3; arm.joint_count()];
            let angles =
                arm.inverse(&target, &start).unwrap_or_else(|| panic!("{name}: target {k} not reached"));
            let apart = (arm.tip(&angles).to_homogeneous() - target.to_homogeneous()).amax();
            assert!(apart < 1e-9, "{name}: the tip is {apart} off");
        }
    }
}

#[test]
fn every_arm_strikes_straight_at_the_planned_speed() {
    for name in ARMS {
        let cell = cell(name);
        let answer = robot::command(&cell, &strike(), None, &Options::default()).expect("a cell with an arm");
        let Answer::Ready(command) = answer else { panic!("{name}: {answer:?}") };
        let speed_m_s = command.stroke.contact_speed_m_s;
        assert!((speed_m_s - 0.3).abs() < 0.003, "{name}: {speed_m_s} m/s");
        let mounted = MountedArm::of_cell(&cell).expect("an arm");
        for q in &command.phase(PhaseName::Strike).expect("a strike").q_rad {
            let aside_m = Vec2::from_heading(0.4).cross(mounted.tip_on_table(q).0 - strike().start_m);
            assert!(aside_m.abs() < 1e-9, "{name}: {aside_m} m off the line");
        }
    }
}

#[test]
fn a_command_contains_the_urdf_of_its_arm() {
    let answer = robot::command(&cell(ARMS[0]), &strike(), None, &Options::default()).expect("an arm");
    let Answer::Ready(command) = answer else { panic!("{answer:?}") };
    let text = serde_json::to_string(&command).expect("JSON");
    let mut again: Command = serde_json::from_str(&text).expect("the command just written");
    again.robot.arm = "moved.urdf".into();
    again.check().expect("an arm without its file");
}

#[test]
fn a_urdf_that_was_not_loaded_is_an_error() {
    let mut cell = cell(ARMS[0]);
    cell.robot.as_mut().expect("an arm").urdf = None;
    let message = MountedArm::of_cell(&cell).expect_err("no text").to_string();
    assert!(message.contains("loaded with the cell"), "{message}");
}
