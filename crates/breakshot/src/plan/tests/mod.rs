//! Properties of the plan as a whole: reproducible predictions, and reasons.

mod arm;
mod central_strikes;
mod remedies;
mod robust;
mod sequence;

use super::*;
use crate::geometry::Point;
use crate::object::{Marker, Object, Shape};
use crate::physics;
use crate::scene::{Goal, Placed, Wall};
use crate::uncertain::Estimate;

/// Disc `a` (40 mm), triangle `b`, disc `c` (35 mm), square `d` (40 mm), disc `e` (30 mm) and a long triangle `t`.
fn objects() -> Vec<Object> {
    let polygon =
        |points: &[[f64; 2]]| Shape::Polygon { points_m: points.iter().map(|&p| p.into()).collect() };
    let shapes = [
        ("a", Shape::Disc { radius_m: 0.04 }),
        ("b", polygon(&[[-0.0275, -0.015_877], [0.0275, -0.015_877], [0.0, 0.031_754]])),
        ("c", Shape::Disc { radius_m: 0.035 }),
        ("d", Shape::Rectangle { size_m: [0.04, 0.04] }),
        ("e", Shape::Disc { radius_m: 0.03 }),
        ("t", polygon(&[[0.0, 0.0], [0.2, 0.0], [-0.05, 0.03]])),
    ];
    let object = |(name, shape): (&str, Shape)| {
        let marker = Some(Marker::centred(Shape::Disc { radius_m: 0.01 }));
        let mut object =
            Object { name: name.into(), shape, height_m: 0.03, marker, mass_kg: None, support: None };
        object.check().expect("an object");
        object
    };
    shapes.into_iter().map(object).collect()
}

pub(super) fn scene(placed: &[(&str, f64, f64, f64)]) -> Scene {
    let cell = "[camera]\nscale_px_per_m = 1000.0\n[workspace]\nmin_m = [-0.5, -0.4]\nmax_m = [0.5, 0.4]\n\
                [striker]\nshape = { disc = { radius_m = 0.015 } }\nheight_m = 0.08\nspeed_range_m_s = [0.05, 1.0]";
    let place = |&(object, x, y, yaw_rad): &(&str, f64, f64, f64)| Placed {
        object: object.into(),
        position_m: Point::new(x, y),
        yaw_rad,
    };
    Scene::on_free_table(toml::from_str(cell).expect("a cell"), objects(), placed.iter().map(place).collect())
}

pub(super) fn properties() -> Properties {
    let names = ["a", "b", "c", "d", "e", "t"];
    let all = |value: fn(usize) -> f64| {
        names.iter().enumerate().map(|(k, n)| ((*n).to_owned(), Estimate::exact(value(k)))).collect()
    };
    let pairs = names.iter().flat_map(|a| names.iter().map(move |b| crate::object::pair_key(a, b)));
    Properties {
        version: 1,
        reference: "a".into(),
        friction: all(|k| 0.2 + 0.03 * k as f64),
        striker_restitution: all(|_| 0.6),
        restitution: pairs.map(|pair| (pair, Estimate::exact(0.55))).collect(),
        mass_ratio: all(|k| 1.0 / (1.0 + k as f64)),
        ..Properties::default()
    }
}

/// The method of the paper.
fn paper_options() -> Options<'static> {
    Options { method: Method::Paper, ..Options::default() }
}

fn planned(scene: &Scene) -> Plan {
    plan(scene, &properties(), &paper_options()).expect("measured objects")
}

/// Touching objects, as the paper's piles are.
fn piles() -> Vec<Scene> {
    vec![
        scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.075, 0.0, 0.0)]),
        scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.07, 0.028, 0.0), ("e", 0.05, -0.0495, 0.0)]),
        scene(&[("a", 0.0, 0.0, 0.0), ("b", 0.066, 0.0, 1.1), ("d", 0.0, 0.065, 0.3)]),
        scene(&[
            ("a", 0.0, 0.0, 0.0),
            ("a#2", 0.081, 0.0, 0.0),
            ("d", 0.04, 0.08, 0.7),
            ("e", 0.04, -0.06, 0.0),
        ]),
    ]
}

#[test]
fn simulating_the_strike_reproduces_the_prediction_bit_for_bit() {
    for scene in piles() {
        let plan = planned(&scene);
        assert_ne!(plan.outcome, Outcome::Unreachable, "{}", plan.reason);
        // As it is written and read again.
        let text = serde_json::to_string(&plan).expect("JSON");
        let read: Plan = serde_json::from_str(&text).expect("the same plan");
        assert_eq!(read, plan);
        let (strike, predicted) = (read.strike.expect("a strike"), read.prediction.expect("a prediction"));
        let done =
            physics::trajectory(&scene, &properties(), &strike, &physics::Options::default()).expect("a run");
        assert_eq!(done.final_poses, predicted.final_poses);
        let distances = Singulation::of(&scene, &done.final_poses).expect("known objects");
        assert_eq!(distances.min_distance_m(), predicted.min_distance_m);
        assert_eq!(distances.mean_distance_m(), predicted.mean_distance_m);
        assert_eq!(distances.violations().is_empty(), plan.outcome == Outcome::Found, "{}", plan.reason);
    }
}

#[test]
fn the_same_pile_gives_the_same_bytes_in_any_order_of_its_objects() {
    for scene in piles() {
        let text = |plan: &Plan| serde_json::to_string(plan).expect("JSON");
        assert_eq!(text(&planned(&scene)), text(&planned(&scene)));
        let mut reversed = scene.clone();
        reversed.placed.reverse();
        assert_eq!(planned(&reversed).strike, planned(&scene).strike);
    }
}

#[test]
fn two_touching_discs_are_singulated() {
    let plan = planned(&piles()[0]);
    assert_eq!(plan.outcome, Outcome::Found, "{}", plan.reason);
    let strike = plan.strike.expect("a strike");
    assert_eq!(strike.object.as_deref(), Some("a"));
    assert!(strike.heading_rad.abs() < 1e-6, "through the other disc: {} rad", strike.heading_rad);
    assert!(plan.iterations.last().expect("steps").fulfilled && plan.iterations.len() <= 12);
}

#[test]
fn when_no_speed_works_the_plan_has_the_best_strike_and_names_the_violated_condition() {
    let mut slow = piles()[1].clone();
    slow.cell.striker.speed_range_m_s = [0.05, 0.12];
    let plan = planned(&slow);
    assert_eq!(plan.outcome, Outcome::BestEffort);
    assert!(plan.reason.contains("wanted") && plan.reason.contains("headings"), "{}", plan.reason);
    let speed_m_s = plan.strike.expect("a strike").speed_m_s;
    assert!((0.05..=0.12).contains(&speed_m_s), "{speed_m_s} m/s");
    assert!(plan.iterations.iter().all(|i| !i.fulfilled));
}

#[test]
fn the_largest_object_is_struck_and_another_one_where_it_cannot_be() {
    assert_eq!(planned(&piles()[2]).strike.expect("a strike").object.as_deref(), Some("a"));
    // Walls close around the largest disc, but not around its neighbour.
    let mut scene = scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.1, 0.0, 0.0)]);
    let wall = |from: [f64; 2], to: [f64; 2]| Wall { from_m: from.into(), to_m: to.into(), restitution: 0.5 };
    scene.walls = vec![
        wall([-0.05, -0.05], [-0.05, 0.05]),
        wall([-0.05, 0.05], [0.06, 0.05]),
        wall([-0.05, -0.05], [0.06, -0.05]),
    ];
    let plan = planned(&scene);
    assert_eq!(plan.strike.expect("a strike").object.as_deref(), Some("c"));
    assert!(plan.reason.contains("a is blocked by a wall, c"), "{}", plan.reason);
}

#[test]
fn an_impossible_goal_is_unreachable_with_the_reason() {
    let walled = |mut scene: Scene| {
        let corners = [[-0.075, -0.075], [0.075, -0.075], [0.075, 0.075], [-0.075, 0.075]].map(Point::from);
        let side = |k: usize| Wall { from_m: corners[k], to_m: corners[(k + 1) % 4], restitution: 0.5 };
        scene.walls = (0..4).map(side).collect();
        scene
    };
    let far_goal = |mut scene: Scene, goal: Goal| {
        scene.goal = goal;
        scene
    };
    let wide = Goal { min_distance_m: 0.95, mean_distance_m: [0.0, 2.0], ..Goal::default() };
    let mean = Goal { mean_distance_m: [1.3, 2.0], ..Goal::default() };
    for (scene, words) in [
        (scene(&[]), "nothing lies on the table"),
        (
            walled(scene(&[("d", 0.0, 0.0, 0.0), ("b", 0.0, 0.0365, 0.0)])),
            "no central strike reaches any object",
        ),
        (far_goal(piles()[1].clone(), wide), "do not fit into the workspace of 1000 x 800 mm"),
        (far_goal(piles()[0].clone(), mean), "at most 1280.6 mm apart on average"),
    ] {
        let plan = planned(&scene);
        assert_eq!((plan.outcome, &plan.strike, &plan.prediction), (Outcome::Unreachable, &None, &None));
        assert!(plan.iterations.is_empty() && plan.reason.contains(words), "{}", plan.reason);
    }
}

#[test]
fn a_singulated_pile_needs_no_strike() {
    for (scene, words) in [
        (scene(&[("a", 0.0, 0.0, 0.0)]), "only a lies on the table"),
        (scene(&[("a", 0.0, 0.0, 0.0), ("b", 0.2, 0.0, 0.0)]), "already fulfils the goal"),
    ] {
        let plan = planned(&scene);
        assert_eq!((plan.outcome, &plan.strike), (Outcome::Found, &None));
        assert!(plan.reason.contains(words), "{}", plan.reason);
        let unmoved = plan.prediction.expect("the poses as they are").final_poses;
        assert!(scene.placed.iter().all(|p| unmoved[&p.object] == p.pose()));
    }
}

#[test]
fn a_pair_without_a_measured_restitution_is_assumed_by_name() {
    let mut properties = properties();
    properties.restitution.remove("a/c");
    let plan = plan(&piles()[0], &properties, &paper_options()).expect("a plan");
    let [assumed] = &plan.assumed[..] else { panic!("{:?}", plan.assumed) };
    assert!(assumed.to_string().contains("a/c") && (assumed.mean - 0.55).abs() < 0.02, "{assumed}");
}
