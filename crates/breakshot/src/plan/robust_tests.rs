//! Laws of robust plans.

use super::judge::Judge;
use super::possible::{Source, possible_worlds};
use super::robust::{Effort, part, robust, verdicts};
use super::tests::{properties, scene};
use super::*;
use crate::physics::Simulator;
use crate::uncertain::Estimate;
use proptest::prelude::*;

/// Enough to find a strike on a small pile.
const QUICK: Effort = Effort {
    lines: 60,
    rounds: [(600, 1), (60, 4), (16, 8), (8, 16)],
    finalists: 2,
    generations: (1, 3, 8),
    fresh: 40,
};

fn pair() -> Scene {
    scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.078, 0.002, 0.0)])
}

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

proptest! {
    #[test]
    fn the_judge_agrees_with_the_goal_in_words(
        places in prop::collection::vec((-0.55f64..0.55, -0.45f64..0.45, -3.0f64..3.0), 3),
        gap_m in prop_oneof![Just(0.0), Just(0.03)],
    ) {
        let mut scene = scene(&[("a", 0.0, 0.0, 0.0), ("b", 0.2, 0.0, 0.0), ("d", 0.0, 0.2, 0.0)]);
        scene.goal.min_gap_m = gap_m;
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
