//! A command to carry out: an Indy 7 before a table with one disc.

use breakshot::cell::Cell;
use breakshot::geometry::{Point, Vec2};
use breakshot::object::{Object, Shape};
use breakshot::robot::{self, Answer, Command};
use breakshot::scene::{Goal, Placed, Scene, Strike};

/// When the table was looked at (s since 1970).
pub const OBSERVED_UNIX_S: f64 = 1_790_000_000.0;

/// A moment later.
pub fn just_after() -> f64 {
    OBSERVED_UNIX_S + 10.0
}

pub fn scene() -> Scene {
    let text = r#"
        [camera]
        scale_px_per_m = 1000.0
        [workspace]
        min_m = [-0.3, -0.2]
        max_m = [0.3, 0.2]
        [striker]
        shape = { disc = { radius_m = 0.015 } }
        height_m = 0.1
        speed_range_m_s = [0.05, 1.0]
        [robot]
        arm = "indy7"
        base_from_table = { position_m = [0.45, 0.0, 0.0], rpy_rad = [0.0, 0.0, 1.5707963] }
        tool_offset_m = [0.0, 0.0, 0.15]
        tool_mass_kg = 0.3
    "#;
    let cell: Cell = toml::from_str(text).expect("a cell");
    let object = Object {
        name: "a".into(),
        shape: Shape::Disc { radius_m: 0.03 },
        height_m: 0.04,
        marker: toml::from_str("shape = { disc = { radius_m = 0.01 } }").expect("a marker"),
        mass_kg: None,
    };
    Scene {
        cell,
        objects: vec![object],
        observed_unix_s: Some(OBSERVED_UNIX_S),
        placed: vec![Placed { object: "a".into(), position_m: Point::new(0.0, 0.0), yaw_rad: 0.0 }],
        walls: Vec::new(),
        keep_out: Vec::new(),
        goal: Goal::default(),
    }
}

pub fn command(speed_m_s: f64) -> Command {
    let heading_rad = 0.3;
    let start_m = Point::ORIGIN - Vec2::from_heading(heading_rad) * 0.1;
    let strike = Strike { object: Some("a".into()), start_m, heading_rad, speed_m_s, travel_m: 0.06 };
    let scene = scene();
    match robot::command(&scene.cell, &strike, Some(&scene), &robot::Options::default()) {
        Ok(Answer::Ready(command)) => *command,
        other => panic!("no command: {other:?}"),
    }
}
