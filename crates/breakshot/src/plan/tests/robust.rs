//! Laws of robust plans.

use super::{properties, scene};
use crate::geometry::Point;
use crate::gripper::Gripper;
use crate::physics::{self, Simulator, World};
use crate::plan::robust::evaluate::{part, verdicts};
use crate::plan::robust::goal_margin::{self as judge, Judge};
use crate::plan::robust::scenarios::possible_worlds;
use crate::plan::robust::{Effort, robust};
use crate::plan::*;
use crate::scene::Goal;
use crate::uncertain::Estimate;
use proptest::prelude::*;

/// Enough to find a strike on a small pile.
const QUICK: Effort = Effort {
    lines: 60,
    rounds: [(600, 1), (120, 2), (60, 4), (16, 8), (8, 16)],
    finalists: 2,
    generations: (1, 3, 8),
    fresh: 40,
};

fn pair() -> Scene {
    scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.078, 0.002, 0.0)])
}

/// Wide enough for the discs from every side.
const GRIPPER: Gripper = Gripper { opening_m: 0.1, finger_size_m: [0.01, 0.02], clearance_m: 0.005 };

/// Friction and restitution that vary from strike to strike.
fn varying() -> Properties {
    let mut varying = properties();
    for estimate in varying.friction.values_mut() {
        (estimate.std, estimate.standard_error) = (Some(0.02), 0.005);
    }
    for estimate in varying.restitution.values_mut() {
        (estimate.std, estimate.standard_error) = (Some(0.05), 0.02);
    }
    varying
}

fn planned(scene: &Scene, properties: &Properties, options: &Options) -> Plan {
    let empty = Plan {
        version: 1,
        method: Method::Robust,
        outcome: Outcome::Unreachable,
        reason: String::new(),
        scene: scene.clone(),
        strike: None,
        prediction: None,
        iterations: Vec::new(),
        robustness: None,
        then: Vec::new(),
    };
    robust(empty, properties, options, &QUICK).expect("a scene that can be simulated")
}

#[test]
fn two_discs_are_singulated_surely_and_the_promise_is_what_a_simulation_gives() {
    let (scene, properties) = (pair(), varying());
    let plan = planned(&scene, &properties, &Options::default());
    let robustness = plan.robustness.as_ref().expect("told");
    assert_eq!(plan.outcome, Outcome::Found, "{}", plan.reason);
    assert!(robustness.success_probability > 0.9, "{}", plan.reason);
    assert!(robustness.cloud.values().all(|poses| poses.len() == 40));
    let world = World::new(&scene, &properties, &physics::Options::default()).expect("a world");
    let strike = plan.strike.as_ref().expect("a strike");
    let outcome = Simulator::new().run(&world, strike).expect("a strike that can be");
    let promised = &plan.prediction.as_ref().expect("a promise").final_poses;
    for (name, pose) in world.names().iter().zip(&outcome.poses) {
        assert_eq!(&promised[name], pose);
    }
}

#[test]
fn a_survey_holds_good_and_bad_strikes_and_is_the_same_on_any_number_of_threads() {
    let surveyed = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| survey(&pair(), &varying(), &Options::default(), (60, 12))).expect("a scene")
    };
    let one = surveyed(1);
    assert_eq!(one, surveyed(3));
    assert_eq!(one.len(), 60);
    assert!(
        one.iter().any(|s| s.success_probability > 0.9) && one.iter().any(|s| s.success_probability < 0.1)
    );
    assert!(one.iter().all(|s| s.strike.speed_m_s > 0.0 && s.expected_singulated <= 2.0));
    // Where the goal holds in every world, both objects are singulated in every world.
    let sure = one.iter().filter(|s| s.success_probability == 1.0);
    assert!(sure.clone().count() > 0 && sure.clone().all(|s| s.expected_singulated == 2.0));
    let [two_discs, nothing] = [&pair(), &scene(&[])]
        .map(|scene| survey(scene, &varying(), &Options::default(), (5, 2)).expect("a scene").len());
    assert_eq!((two_discs, nothing), (5, 0));
}

#[test]
fn the_same_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let text = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let options = Options { seed, ..Options::default() };
        let plan = pool.install(|| planned(&pair(), &varying(), &options));
        serde_json::to_string(&plan).expect("JSON")
    };
    assert_eq!(text(1, 3), text(3, 3));
    assert_ne!(text(1, 3), text(1, 4));
}

#[test]
fn a_less_certain_arm_makes_the_same_strike_less_certain() {
    let scene = scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.078, 0.002, 0.0), ("e", 0.02, 0.075, 0.0)]);
    let strike = planned(&scene, &varying(), &Options::default()).strike.expect("a strike");
    let judge = Judge::new(&scene).expect("known objects");
    let mean = World::new(&scene, &varying(), &physics::Options::default()).expect("a world");
    let works = |scatter: Scatter| {
        let options = Options { scatter, ..Options::default() };
        let worlds = possible_worlds((&scene, &varying(), &mean), &options, (5, 200), None).expect("worlds");
        part(&verdicts(&strike, &worlds, &judge), judge::Verdict::fulfilled)
    };
    let exact = Scatter { position_m: 0.0, yaw_rad: 0.0, speed: 0.0, heading_rad: 0.0 };
    let poor = Scatter { position_m: 4e-3, yaw_rad: 0.1, speed: 0.2, heading_rad: 0.2 };
    assert!(works(exact) > works(poor) + 0.05, "{} against {}", works(exact), works(poor));
}

#[test]
fn knowing_everything_leaves_one_world() {
    let scene = pair();
    let judge = Judge::new(&scene).expect("known objects");
    let scatter = Scatter { position_m: 0.0, yaw_rad: 0.0, speed: 0.0, heading_rad: 0.0 };
    let mut exact = properties();
    exact.contact_friction.objects = Some(Estimate::exact(0.1));
    exact.contact_friction.striker = Some(Estimate::exact(0.1));
    let options = Options { scatter, ..Options::default() };
    let mean = World::new(&scene, &exact, &physics::Options::default()).expect("a world");
    let worlds =
        possible_worlds((&scene, &exact, &mean), &options, (5, 5), Some(Source::Contacts)).expect("worlds");
    let strike = planned(&scene, &exact, &options).strike.expect("a strike");
    let verdicts = verdicts(&strike, &worlds, &judge);
    assert!(verdicts.windows(2).all(|w| w[0] == w[1]), "{verdicts:?}");
}

#[test]
fn what_nobody_reaches_is_said_with_the_reason() {
    let mut scene = pair();
    let corners = [[-0.06, -0.06], [0.13, -0.06], [0.13, 0.06], [-0.06, 0.06]].map(Point::from);
    let side =
        |k: usize| crate::scene::Wall { from_m: corners[k], to_m: corners[(k + 1) % 4], restitution: 0.5 };
    scene.walls = (0..4).map(side).collect();
    let plan = planned(&scene, &properties(), &Options::default());
    assert_eq!((plan.outcome, &plan.strike), (Outcome::Unreachable, &None));
    assert!(plan.reason.contains("in its way are a, a wall, c"), "{}", plan.reason);
}

#[test]
fn a_proposal_is_judged_beside_the_others() {
    let (scene, properties) = (pair(), varying());
    let aim = Aim { object: 0, heading_rad: 0.026, offset_m: 0.0, speed_m_s: 0.8, follow_through_m: 0.012 };
    let only = |_: &Scene| vec![aim.clone()];
    let options = Options { proposals: Some(&only), ..Options::default() };
    let plan = planned(&scene, &properties, &options);
    assert!(plan.robustness.expect("told").success_probability > 0.9, "{}", plan.reason);
}

#[test]
fn a_target_alone_is_enough_where_the_others_may_stay_together() {
    // Discs a and c press against each other behind e.
    let mut scene = scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.0, 0.0755, 0.0), ("e", 0.0665, 0.03, 0.0)]);
    scene.goal = Goal { target: Some("e".into()), keep_still: vec!["a".into()], ..Goal::default() };
    let wanted = planned(&scene, &varying(), &Options::default());
    assert_eq!(wanted.outcome, Outcome::Found, "{}", wanted.reason);
    let promised = wanted.prediction.expect("a promise");
    let [a, c, e] = ["a", "c", "e"].map(|name| promised.final_poses[name].position);
    assert!(e.distance(a).min(e.distance(c)) >= 0.09 && a.distance(Point::ORIGIN) <= crate::scene::STILL_M);
    scene.goal.keep_still = vec!["e".into()];
    let still = planned(&scene, &varying(), &Options::default());
    let lies = still.prediction.expect("a promise").final_poses["e"].position;
    assert!(still.outcome == Outcome::BestEffort || lies.distance(scene.placed[2].position_m) < 0.005);
    // The paper's planner strikes the largest object, `a`: nothing may ask that to stay.
    scene.goal.keep_still.clear();
    let paper = plan(&scene, &properties(), &Options::default()).expect("a plan");
    assert!(paper.reason.ends_with("e lies by itself then"), "{}", paper.reason);
}

#[test]
fn a_gripper_gets_the_room_it_needs() {
    let mut scene = pair();
    scene.goal = Goal { min_distance_m: 0.0, mean_distance_m: [0.0, 0.9], ..Goal::default() };
    let lying = plan(&scene, &properties(), &Options::default()).expect("a plan");
    assert_eq!((lying.outcome, lying.strike), (Outcome::Found, None));
    // Both discs can be taken from the sides of the pair; two more leave the first no side.
    scene.goal.gripper = Some(GRIPPER);
    assert!(plan(&scene, &properties(), &Options::default()).expect("a plan").strike.is_none());
    for (object, x, y) in [("a#2", -0.0815, 0.0), ("c#2", 0.0, 0.0765), ("c#3", 0.0, -0.0765)] {
        let position_m = Point::new(x, y);
        scene.placed.push(crate::scene::Placed { object: object.into(), position_m, yaw_rad: 0.0 });
    }
    let held = Singulation::of(&scene, &scene.placed.iter().map(|p| (p.object.clone(), p.pose())).collect());
    let words: Vec<_> =
        held.expect("known").violations(&scene.goal).iter().map(ToString::to_string).collect();
    assert_eq!(words, ["the gripper finds no room around a"]);
    scene.goal.gripper = Some(Gripper { opening_m: 0.07, ..GRIPPER });
    let plan = plan(&scene, &properties(), &Options::default()).expect("a plan");
    assert!(
        plan.strike.is_none() && plan.reason.contains("a is wider in every direction"),
        "{}",
        plan.reason
    );
}

#[test]
fn goals_about_objects_that_do_not_lie_there_are_errors_with_their_names() {
    for (goal, words) in [
        (Goal { target: Some("x".into()), ..Goal::default() }, "target is x"),
        (Goal { keep_still: vec!["e".into()], ..Goal::default() }, "one of the placed objects: a, c"),
        (
            Goal { keep_still: vec!["a".into(), "c".into()], ..Goal::default() },
            "at least one object that may move",
        ),
        (
            Goal { gripper: Some(Gripper { opening_m: 0.0, ..GRIPPER }), ..Goal::default() },
            "gripper.opening_m",
        ),
    ] {
        let error = Scene { goal, ..pair() }.check("scene.toml").expect_err("no such goal");
        assert!(error.to_string().contains(words), "{error}");
    }
}

proptest! {
    #[test]
    fn the_judge_agrees_with_the_goal_in_words(
        places in prop::collection::vec((-0.55f64..0.55, -0.45f64..0.45, -3.0f64..3.0), 3),
        gap_m in prop_oneof![Just(0.0), Just(0.03)],
        target in prop_oneof![Just(None), Just(Some("b".to_owned()))],
        keep_still in prop_oneof![Just(Vec::new()), Just(vec!["d".to_owned()])],
        gripper in prop_oneof![Just(None), Just(Some(GRIPPER))],
    ) {
        let mut scene = scene(&[("a", 0.0, 0.0, 0.0), ("b", 0.2, 0.0, 0.0), ("d", 0.0, 0.2, 0.0)]);
        scene.goal = Goal { min_gap_m: gap_m, target, keep_still, gripper, ..Goal::default() };
        let points_m = [[0.2, 0.1], [0.4, 0.1], [0.4, 0.3], [0.2, 0.3]].map(Point::from).to_vec();
        scene.keep_out = vec![crate::scene::KeepOut { points_m }];
        let poses: Vec<Pose> = places.iter().map(|&(x, y, yaw)| Pose::new(x, y, yaw)).collect();
        let named = scene.placed.iter().map(|p| p.object.clone()).zip(poses.iter().copied()).collect();
        let violations = Singulation::of(&scene, &named).expect("known objects").violations(&scene.goal);
        let outcome = physics::Outcome { poses, duration_s: 0.0, impacts: 0, complete: true, fallen: Vec::new() };
        let verdict = Judge::new(&scene).expect("known objects").verdict(&outcome);
        prop_assert_eq!(verdict.fulfilled(), violations.is_empty(), "{:?} {:?}", verdict, violations);
    }
}
