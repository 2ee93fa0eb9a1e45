//! Properties of plans for a cell with an arm.

use super::{properties, scene};
use crate::cell::{RobotSpec, Transform};
use crate::geometry::Point;
use crate::physics;
use crate::plan::arm::{CellArm, Execution, laws};
use crate::plan::paper::{CentralStrike, central_strikes};
use crate::plan::*;
use crate::robot::{self, Answer};
use crate::scene::{Placed, Strike};
use std::f64::consts::FRAC_PI_2;

/// Three objects, and an Indy 7 whose base stands `behind_m` behind the middle of the table's long side.
fn with_indy7(behind_m: f64) -> Scene {
    let mut scene = scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.078, 0.002, 0.0), ("d", 0.02, 0.07, 0.3)]);
    scene.cell.robot = Some(RobotSpec {
        arm: "indy7".into(),
        base_from_table: Some(Transform {
            position_m: [behind_m, 0.0, 0.0],
            rpy_rad: [0.0, 0.0, -FRAC_PI_2],
        }),
        tool_offset_m: [0.0, 0.0, 0.15],
        ..RobotSpec::default()
    });
    scene
}

fn accepted(scene: &Scene, plan: &Plan) -> bool {
    let strike = plan.strike.as_ref().expect("a strike");
    let answer = robot::command(&scene.cell, strike, Some(scene), &robot::Options::default());
    matches!(answer.expect("a possible strike"), Answer::Ready(_))
}

#[test]
fn the_arm_accepts_the_plans_of_both_methods() {
    let scene = with_indy7(0.5);
    for method in [Method::Paper, Method::Robust] {
        let planned = plan(&scene, &properties(), &Options { method, ..Options::default() }).expect("a plan");
        assert_eq!(planned.arm.as_deref(), Some("indy7"), "{method:?}");
        assert!(accepted(&scene, &planned), "{method:?}");
    }
}

#[test]
fn any_arm_plans_as_without_an_arm() {
    let scene = with_indy7(0.5);
    let mut bare = scene.clone();
    bare.cell.robot = None;
    let any = plan(&scene, &properties(), &Options { any_arm: true, ..Options::default() }).expect("a plan");
    let without = plan(&bare, &properties(), &Options::default()).expect("a plan");
    assert_eq!(any.strike, without.strike);
    assert_eq!((any.arm, without.arm), (None, None));
    // An arm whose base pose was never measured says nothing about reach.
    let mut unknown = scene;
    unknown.cell.robot.as_mut().expect("an arm").base_from_table = None;
    let unknown = plan(&unknown, &properties(), &Options::default()).expect("a plan");
    assert_eq!((unknown.strike, unknown.arm), (without.strike, None));
}

#[test]
fn a_table_out_of_reach_is_named_as_the_reason() {
    let scene = with_indy7(2.0);
    for method in [Method::Paper, Method::Robust] {
        let planned = plan(&scene, &properties(), &Options { method, ..Options::default() }).expect("a plan");
        assert_eq!((planned.outcome, planned.strike), (Outcome::Unreachable, None), "{method:?}");
        assert!(planned.reason.contains("the arm's reach"), "{}", planned.reason);
    }
}

#[test]
fn the_heading_of_greatest_impulse_comes_first() {
    let scene = with_indy7(0.5);
    let arm = CellArm::of(&scene, &Options::default()).expect("readable").expect("an arm");
    let found = central_strikes(&scene, &properties(), Some(&arm), &scene.placed[0]).expect("measured");
    let found = found.expect("reachable");
    let mass_kg = |strike: &CentralStrike| {
        arm.capability(strike.line.contact_m, strike.line.heading_rad).expect("in reach").effective_mass_kg
    };
    assert!(found.windows(2).all(|pair| mass_kg(&pair[0]) >= mass_kg(&pair[1])));
    let [first, last] = [&found[0], &found[found.len() - 1]].map(|strike| (mass_kg(strike), strike.impulse));
    assert!(first.0 > 1.05 * last.0 && first.1 > last.1, "{first:?} and {last:?}");
}

#[test]
fn the_striker_goes_on_at_least_until_the_arm_can_stop() {
    let scene = with_indy7(0.5);
    let planned = plan(&scene, &properties(), &Options::default()).expect("a plan");
    let strike = planned.strike.as_ref().expect("a strike");
    let Ok(Answer::Ready(command)) =
        robot::command(&scene.cell, strike, Some(&scene), &robot::Options::default())
    else {
        panic!("refused")
    };
    assert!(
        !command.warnings.iter().any(|warning| warning.contains("past the planned end")),
        "{:?}",
        command.warnings
    );
    let contact_m = command.stroke.contact_after_m.expect("the strike hits an object");
    let least_m = robot::least_follow_through_m(strike.speed_m_s);
    let planned_m = strike.travel_m - contact_m;
    assert!(planned_m > least_m - 1e-3, "{planned_m} m past the contact, {least_m} m needed");
}

#[test]
fn a_strike_that_the_arm_ends_past_its_end_overshoots() {
    let scene = with_indy7(0.5);
    let planned = plan(&scene, &properties(), &Options::default()).expect("a plan");
    let strike = planned.strike.as_ref().expect("a strike");
    let arm = CellArm::of(&scene, &Options::default()).expect("readable").expect("an arm");
    assert_eq!(arm.execution(strike), Execution::AsPlanned);
    let least_m = robot::least_follow_through_m(strike.speed_m_s);
    let short = Strike { travel_m: strike.travel_m - least_m, ..strike.clone() };
    let Execution::Overshoot(beyond_m) = arm.execution(&short) else { panic!("ends as planned") };
    assert!((1e-3..2.0 * least_m).contains(&beyond_m), "{beyond_m} m");
    assert_eq!(arm.refusal(&short), None);
    let distant = Strike { start_m: Point::new(3.0, 0.0), ..strike.clone() };
    assert!(matches!(arm.execution(&distant), Execution::Refused(_)), "{:?}", arm.execution(&distant));
}

#[test]
fn impacts_slow_the_striker_of_an_arm_whose_rotor_inertias_are_known() {
    let mut scene = with_indy7(0.5);
    assert_eq!(laws(&scene).expect("readable"), physics::Options::default());
    scene.cell.robot.as_mut().expect("an arm").armature_kg_m2 = Some(vec![0.3, 0.3, 0.3, 0.08, 0.08, 0.08]);
    let arm = laws(&scene).expect("readable");
    let mass_kg = arm.striker_mass_kg.expect("a mass");
    assert!((0.5..20.0).contains(&mass_kg), "{mass_kg} kg");

    // A free object leaves as in the films, where the same striker was taken to keep its speed; a row of three is slower.
    let strike =
        Strike { start_m: Point::new(-0.12, 0.0), speed_m_s: 0.5, travel_m: 0.08, ..Strike::default() };
    let ends_m = |scene: &Scene, laws: &physics::Options| {
        let last = scene.placed[scene.placed.len() - 1].object.clone();
        let trajectory = physics::trajectory(scene, &properties(), &strike, laws).expect("a run");
        trajectory.final_poses[&last].position.x
    };
    let free = Scene { placed: vec![scene.placed[0].clone()], ..scene.clone() };
    let difference_m = ends_m(&free, &arm) - ends_m(&free, &physics::Options::default());
    assert!(difference_m.abs() < 1e-9, "{difference_m} m");
    let mut row = scene.clone();
    row.placed = [("a", 0.0), ("c", 0.0750005), ("e", 0.140001)]
        .map(|(object, x)| Placed { object: object.into(), position_m: Point::new(x, 0.0), yaw_rad: 0.0 })
        .to_vec();
    assert!(ends_m(&row, &arm) < ends_m(&row, &physics::Options::default()) - 1e-3);
}
