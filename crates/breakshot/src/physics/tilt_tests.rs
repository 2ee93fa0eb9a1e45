//! Strikes on a tilted table.

use super::{GRAVITY_M_S2, Options, Simulator, Trajectory, World, trajectory};
use crate::cell::{Cell, Striker, Workspace};
use crate::geometry::{Point, Vec2};
use crate::object::{Object, Shape};
use crate::properties::{Properties, Tilt};
use crate::scene::{Placed, Scene, Strike};
use crate::uncertain::Estimate;

const FRICTION: f64 = 0.25;

fn scene() -> Scene {
    let disc = |name: &str| {
        let shape = Shape::Disc { radius_m: 0.03 };
        Object { name: name.into(), shape, height_m: 0.03, marker: None, mass_kg: Some(0.1), support: None }
    };
    let at =
        |object: &str, x: f64| Placed { object: object.into(), position_m: Point::new(x, 0.0), yaw_rad: 0.0 };
    let cell = Cell::from_above(1000.0, Workspace::centred([2.0, 2.0]), Striker::rod(0.015, [0.01, 2.0]));
    Scene::new(cell, vec![disc("a"), disc("b")], vec![at("a", 0.0), at("b", 0.1)]).expect("a scene")
}

fn properties(slope: Option<[f64; 2]>) -> Properties {
    let both = |v: f64| [("a".to_owned(), Estimate::exact(v)), ("b".to_owned(), Estimate::exact(v))].into();
    let tilt = slope.map(|[x, y]| Tilt {
        x: Estimate::exact(x),
        y: Estimate::exact(y),
        covariance: 0.0,
        level: false,
    });
    Properties {
        version: 1,
        reference: "a".into(),
        friction: both(FRICTION),
        striker_restitution: both(0.5),
        restitution: [("a/b".to_owned(), Estimate::exact(0.6))].into(),
        mass_ratio: both(1.0),
        tilt,
        ..Properties::default()
    }
}

/// A strike off the centre of `a`, which then hits `b`.
fn struck(slope: Option<[f64; 2]>) -> Trajectory {
    let strike =
        Strike { start_m: Point::new(-0.1, 0.008), speed_m_s: 0.6, travel_m: 0.07, ..Strike::default() };
    trajectory(&scene(), &properties(slope), &strike, &Options::default()).expect("a strike")
}

#[test]
fn a_level_table_is_simulated_as_without_a_tilt() {
    let level = |tilt: Option<Tilt>| {
        let properties = Properties { tilt, ..properties(None) };
        let world = World::new(&scene(), &properties, &Options::default()).expect("a world");
        let strike =
            Strike { start_m: Point::new(-0.1, 0.008), speed_m_s: 0.6, travel_m: 0.07, ..Strike::default() };
        Simulator::new().run(&world, &strike).expect("a strike").bit_hash()
    };
    let tilt = properties(Some([0.0004, -0.0002])).tilt.map(|tilt| Tilt { level: true, ..tilt });
    assert_eq!(level(tilt), level(None));
}

#[test]
fn tilt_and_striker_do_the_work_that_friction_and_impacts_take() {
    let slope = Vec2::new(0.03, -0.04);
    let trajectory = struck(Some([slope.x, slope.y]));
    let energy = trajectory.energy;
    let gained = energy.striker_work_j + energy.tilt_work_j;
    let lost = energy.impact_loss_j + energy.friction_loss_j;
    assert!((gained - lost).abs() < 1e-9, "{energy:?}");
    // Gravity's work is that of the ways from start to end.
    let scene = scene();
    let ways = scene.placed.iter().map(|p| trajectory.final_poses[&p.object].position - p.position_m);
    let work_j: f64 = ways.map(|way| 0.1 * GRAVITY_M_S2 * slope.dot(way)).sum();
    assert!((energy.tilt_work_j - work_j).abs() < 1e-6, "{energy:?}, not {work_j}");
    // Friction takes at most its coefficient times the weight times the way of the rims.
    let normal_n = 0.1 * GRAVITY_M_S2 * (1.0 - slope.length_squared()).sqrt();
    let step_s = 1e-4;
    let mut most_j = 0.0;
    for name in ["a", "b"] {
        let pose = |k: f64| trajectory.pose(name, k * step_s).expect("a pose");
        for k in 0..(trajectory.duration_s / step_s) as u32 {
            let (from, to) = (pose(f64::from(k)), pose(f64::from(k) + 1.0));
            let turned_m = 0.03 * (to.yaw_rad - from.yaw_rad).abs();
            most_j += FRICTION * normal_n * (to.position.distance(from.position) + turned_m);
        }
    }
    assert!(energy.friction_loss_j > 0.7 * most_j && energy.friction_loss_j < most_j, "{energy:?} {most_j}");
}

#[test]
fn objects_come_to_rest_further_down_a_slope() {
    let (level, tilted) = (struck(None), struck(Some([0.0, 0.03])));
    for name in ["a", "b"] {
        let moved = tilted.final_poses[name].position - level.final_poses[name].position;
        assert!(moved.y > 0.001, "`{name}` moved by {moved:?}");
    }
}

#[test]
fn an_object_that_slides_on_its_own_is_an_error() {
    let error =
        World::new(&scene(), &properties(Some([0.2, 0.2])), &Options::default()).expect_err("a slope");
    let text = error.to_string();
    assert!(
        text.contains("`a`") && text.contains("slides on its own") && text.contains("16.4 degrees"),
        "{text}"
    );
}
