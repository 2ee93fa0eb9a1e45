//! An example command: an Indy 7 at a table with one disc.

use breakshot::cell::Cell;
use breakshot::geometry::{Point, Vec2};
use breakshot::object::{Object, Shape};
use breakshot::robot::{self, Answer, Command};
use breakshot::scene::{Goal, Placed, Scene, Strike};

/// Time of the observation of the table (s since 1970).
pub const OBSERVED_UNIX_S: f64 = 1_790_000_000.0;

/// Ten seconds after the observation (s since 1970).
pub fn just_after() -> f64 {
    OBSERVED_UNIX_S + 10.0
}

pub fn scene() -> Scene {
    let text = include_str!("../../../breakshot/tests/data/arms/indy7_cell.toml");
    let cell: Cell = toml::from_str(text).expect("a cell");
    let object = Object {
        name: "a".into(),
        shape: Shape::Disc { radius_m: 0.03 },
        height_m: 0.04,
        marker: None,
        mass_kg: None,
        support: None,
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
