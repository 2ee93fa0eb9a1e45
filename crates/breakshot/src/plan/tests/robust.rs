//! Properties of robust plans.

use super::{paper_options, properties, scene};
use crate::error::Error;
use crate::geometry::Point;
use crate::physics::{self, Simulator, World};
use crate::plan::robust::budget::{Budget, Generation, Round};
use crate::plan::robust::evaluate::{Evaluation, success_probability};
use crate::plan::robust::robust;
use crate::plan::robust::scenarios::{Distribution, Draws, Nominal, Sampler, Scenario};
use crate::plan::*;
use crate::properties::{SlipDamping, TangentialDamping};
use crate::scene::goal_margin::GoalEvaluator;
use crate::scene::gripper::Gripper;
use crate::scene::{Goal, Strike};
use crate::uncertain::Estimate;
use proptest::prelude::*;

/// Enough to find a strike on a small pile.
pub(super) const QUICK: Budget = Budget {
    lines: 60,
    rounds: &[
        Round { strikes: 600, samples: 1 },
        Round { strikes: 120, samples: 2 },
        Round { strikes: 60, samples: 4 },
        Round { strikes: 16, samples: 8 },
        Round { strikes: 8, samples: 16 },
    ],
    finalists: 2,
    generations: &[Generation { strikes: 2, variants: 3, samples: 8 }],
    searches: 1,
    fresh: 40,
    sensitivities: true,
};

fn pair() -> Scene {
    scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.078, 0.002, 0.0)])
}

/// Wide enough for the discs from every direction.
const GRIPPER: Gripper = Gripper { opening_m: 0.1, finger_size_m: [0.01, 0.02], clearance_m: 0.005 };

/// Friction and restitution that vary from strike to strike.
pub(super) fn varying() -> Properties {
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
    let empty = Plan::unreachable(scene, Method::Robust);
    robust(empty, properties, options, &QUICK).expect("a scene that can be simulated")
}

#[test]
fn two_discs_are_singulated_with_high_probability_and_a_simulation_reproduces_the_prediction() {
    let (scene, properties) = (pair(), varying());
    let plan = planned(&scene, &properties, &Options::default());
    let robustness = plan.robustness.as_ref().expect("a robust plan");
    assert_eq!(plan.outcome, Outcome::Found, "{}", plan.reason);
    assert!(robustness.success_probability > 0.9, "{}", plan.reason);
    assert!(robustness.final_poses.values().all(|poses| poses.len() == 40));
    let world = World::new(&scene, &properties, &physics::Options::default()).expect("a world");
    let strike = plan.strike.as_ref().expect("a strike");
    let outcome = Simulator::new().run(&world, strike).expect("a strike that can be");
    let predicted = &plan.prediction.as_ref().expect("a prediction").final_poses;
    for (name, pose) in world.names().iter().zip(&outcome.poses) {
        assert_eq!(&predicted[name], pose);
    }
}

#[test]
fn the_grid_holds_good_and_bad_strikes_and_is_the_same_on_any_number_of_threads() {
    let evaluated = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let size = GridSize { strikes: 60, samples: 12 };
        pool.install(|| evaluate_grid(&pair(), &varying(), &Options::default(), size)).expect("a scene")
    };
    let one = evaluated(1);
    assert_eq!(one, evaluated(3));
    assert_eq!(one.len(), 60);
    assert!(
        one.iter().any(|s| s.success_probability > 0.9) && one.iter().any(|s| s.success_probability < 0.1)
    );
    assert!(one.iter().all(|s| s.strike.speed_m_s > 0.0 && s.expected_singulated <= 2.0));
    // Where the goal holds in every scenario, both objects are singulated in every scenario.
    let sure = one.iter().filter(|s| s.success_probability == 1.0);
    assert!(sure.clone().count() > 0 && sure.clone().all(|s| s.expected_singulated == 2.0));
    let size = GridSize { strikes: 5, samples: 2 };
    let [two_discs, nothing] = [&pair(), &scene(&[])]
        .map(|scene| evaluate_grid(scene, &varying(), &Options::default(), size).expect("a scene").len());
    assert_eq!((two_discs, nothing), (5, 0));
}

#[test]
fn the_search_is_repeated_only_while_the_best_strike_fails_too_often() {
    let rollouts_and_probability = |scene: &Scene, searches: u64| {
        let empty = Plan::unreachable(scene, Method::Robust);
        let budget = Budget { searches, ..QUICK };
        let plan = robust(empty, &varying(), &Options::default(), &budget).expect("a scene");
        let robustness = plan.robustness.expect("a robust plan");
        (robustness.rollouts, robustness.success_probability)
    };
    assert_eq!(rollouts_and_probability(&pair(), 1), rollouts_and_probability(&pair(), 3));
    // Six discs about one
    let names: Vec<String> = (2..8).map(|k| format!("a#{k}")).collect();
    let ring = names.iter().zip(0_u32..).map(|(name, k)| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 6.0).sin_cos();
        (name.as_str(), 0.082 * cos, 0.082 * sin, 0.0)
    });
    let pile = scene(&std::iter::once(("a", 0.0, 0.0, 0.0)).chain(ring).collect::<Vec<_>>());
    let (few, once) = rollouts_and_probability(&pile, 1);
    let (many, thrice) = rollouts_and_probability(&pile, 3);
    assert!(2 * few < many && many < 4 * few, "{few} {many}");
    assert!(thrice > once - 0.1, "{once} {thrice}");
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
fn a_stopped_plan_and_a_stopped_survey_end_with_an_error() {
    let asked = std::sync::atomic::AtomicUsize::new(0);
    let stopped = || asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed) >= 100;
    let options = Options { stopped: Some(&stopped), ..Options::default() };
    let planned = plan(&pair(), &varying(), &options);
    assert!(matches!(planned, Err(Error::Stopped)), "{planned:?}");
    let surveyed = evaluate_grid(&pair(), &varying(), &options, GridSize { strikes: 60, samples: 12 });
    assert!(matches!(surveyed, Err(Error::Stopped)), "{surveyed:?}");
}

#[test]
fn larger_noise_lowers_the_success_probability_of_a_strike() {
    let scene = scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.078, 0.002, 0.0), ("e", 0.02, 0.075, 0.0)]);
    let strike = planned(&scene, &varying(), &Options::default()).strike.expect("a strike");
    let evaluation = Evaluation::new(&scene, None).expect("known objects");
    let works = |noise: ExecutionNoise| {
        let varying = varying();
        let nominal = Nominal::new(&scene, &varying, noise, &physics::Options::default()).expect("a world");
        let scenarios = nominal.scenarios(Draws { seed: 5, count: 200, fixed: None }).expect("scenarios");
        success_probability(&evaluation.margins(&strike, &scenarios))
    };
    let exact = ExecutionNoise { position_m: 0.0, yaw_rad: 0.0, speed: 0.0, heading_rad: 0.0 };
    let poor = ExecutionNoise { position_m: 4e-3, yaw_rad: 0.1, speed: 0.2, heading_rad: 0.2 };
    assert!(works(exact) > works(poor) + 0.05, "{} against {}", works(exact), works(poor));
}

#[test]
fn without_uncertainty_all_scenarios_are_equal() {
    let scene = pair();
    let noise = ExecutionNoise { position_m: 0.0, yaw_rad: 0.0, speed: 0.0, heading_rad: 0.0 };
    let mut exact = properties();
    exact.contact_friction.objects = Some(Estimate::exact(0.1));
    exact.contact_friction.striker = Some(Estimate::exact(0.1));
    let options = Options { noise, ..Options::default() };
    let evaluation = Evaluation::new(&scene, None).expect("known objects");
    let nominal = Nominal::new(&scene, &exact, noise, &physics::Options::default()).expect("a world");
    let draws = Draws { seed: 5, count: 5, fixed: Some(Source::Contacts) };
    let scenarios = nominal.scenarios(draws).expect("scenarios");
    let strike = planned(&scene, &exact, &options).strike.expect("a strike");
    let margins = evaluation.margins(&strike, &scenarios);
    assert!(margins.windows(2).all(|w| w[0] == w[1]), "{margins:?}");
}

#[test]
fn the_laws_of_tangential_restitution_are_drawn_by_their_probability() {
    let drawn = |damping: Option<SlipDamping>, fixed: Option<Source>| {
        let mut properties = properties();
        properties.tangential_damping = TangentialDamping { objects: damping, striker: damping };
        let distribution = Distribution::of(&properties);
        let draw = |k: u64| Sampler::new(3, k, fixed).properties(&distribution).tangential_damping;
        let of_objects = (0..400).map(|k| draw(k).objects.expect("one law is drawn"));
        of_objects.collect::<Vec<SlipDamping>>()
    };
    let exponent = Estimate { standard_error: 0.3, ..Estimate::exact(1.5) };
    let likely = drawn(Some(SlipDamping { probability: 0.8, exponent }), None);
    assert!(likely.iter().all(|d| d.probability == 0.0 || d.probability == 1.0));
    let damped = likely.iter().filter(|d| d.probability == 1.0).count();
    assert!((280..=360).contains(&damped), "{damped} of 400");
    let mean = likely.iter().map(|d| d.exponent.mean.ln()).sum::<f64>() / 400.0;
    assert!((mean - 1.5_f64.ln()).abs() < 0.04, "{mean}");
    // What was never filmed is drawn from what is assumed, and means keep both laws.
    let unknown = drawn(None, None).iter().filter(|d| d.probability == 1.0).count();
    assert!((150..=250).contains(&unknown), "{unknown} of 400");
    assert!(drawn(None, Some(Source::Contacts)).iter().all(|d| *d == SlipDamping::assumed()));
}

#[test]
fn a_missing_property_widens_the_prediction_and_is_listed() {
    let mut lacking = varying();
    lacking.striker_restitution.remove("a");
    lacking.restitution.clear();
    lacking.friction.remove("c");
    let hit = Strike { start_m: Point::new(-0.12, 0.0), speed_m_s: 0.6, travel_m: 0.08, ..Strike::default() };
    let spread_m = |properties: &Properties| {
        let scene = pair();
        let nominal =
            Nominal::new(&scene, properties, ExecutionNoise::default(), &physics::Options::default())
                .expect("a world");
        let scenarios = nominal.scenarios(Draws { seed: 5, count: 100, fixed: None }).expect("scenarios");
        let mut simulator = Simulator::new();
        let mut end_m =
            |s: &Scenario| simulator.run(&s.world, &s.executed(&hit)).expect("a run").poses[1].position.x;
        let ends_m: Vec<f64> = scenarios.iter().map(&mut end_m).collect();
        let mean_m = ends_m.iter().sum::<f64>() / ends_m.len() as f64;
        (ends_m.iter().map(|x| (x - mean_m).powi(2)).sum::<f64>() / ends_m.len() as f64).sqrt()
    };
    assert!(
        spread_m(&lacking) > 1.2 * spread_m(&varying()),
        "{} {}",
        spread_m(&lacking),
        spread_m(&varying())
    );
    let plan_without = planned(&pair(), &lacking, &Options::default());
    assert_eq!(plan_without.outcome, Outcome::Found, "{}", plan_without.reason);
    let paper = plan(&pair(), &lacking, &paper_options()).expect("a plan");
    let names: Vec<&str> = paper.assumed.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names, ["a", "a/c", "c"]);
    assert!(plan(&pair(), &varying(), &paper_options()).expect("a plan").assumed.is_empty());
}

#[test]
fn a_pile_between_walls_is_unreachable_and_the_reason_names_the_obstacles() {
    let mut scene = pair();
    let corners = [[-0.06, -0.06], [0.13, -0.06], [0.13, 0.06], [-0.06, 0.06]].map(Point::from);
    let side =
        |k: usize| crate::scene::Wall { from_m: corners[k], to_m: corners[(k + 1) % 4], restitution: 0.5 };
    scene.walls = (0..4).map(side).collect();
    let plan = planned(&scene, &properties(), &Options::default());
    assert_eq!((plan.outcome, &plan.strike), (Outcome::Unreachable, &None));
    assert!(plan.reason.contains("its path is blocked by a, a wall, c"), "{}", plan.reason);
}

#[test]
fn a_proposal_is_evaluated_in_addition_to_the_grid() {
    let (scene, properties) = (pair(), varying());
    let aim = Aim {
        object: "a".into(),
        heading_rad: 0.026,
        offset_m: 0.0,
        speed_m_s: 0.8,
        follow_through_m: 0.012,
    };
    let only = |_: &Scene| vec![aim.clone()];
    let options = Options { proposals: Some(&only), ..Options::default() };
    let plan = planned(&scene, &properties, &options);
    assert!(plan.robustness.expect("a robust plan").success_probability > 0.9, "{}", plan.reason);
}

#[test]
fn a_proposal_for_an_object_that_is_not_placed_is_an_error_with_its_name() {
    let aim =
        Aim { object: "x".into(), heading_rad: 0.0, offset_m: 0.0, speed_m_s: 0.8, follow_through_m: 0.01 };
    let only = |_: &Scene| vec![aim.clone()];
    let options = Options { method: Method::Robust, proposals: Some(&only), ..Options::default() };
    let error = plan(&pair(), &varying(), &options).expect_err("no such object");
    assert!(error.to_string().contains("object is x; needed: one of the placed objects: a, c"), "{error}");
}

#[test]
fn with_a_target_the_other_objects_may_stay_together() {
    // Discs a and c press against each other behind e.
    let mut scene = scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.0, 0.0755, 0.0), ("e", 0.0665, 0.03, 0.0)]);
    scene.goal = Goal { target: Some("e".into()), keep_still: vec!["a".into()], ..Goal::default() };
    let singled = planned(&scene, &varying(), &Options::default());
    assert_eq!(singled.outcome, Outcome::Found, "{}", singled.reason);
    let predicted = singled.prediction.expect("a prediction");
    let [a, c, e] = ["a", "c", "e"].map(|name| predicted.final_poses[name].position);
    assert!(e.distance(a).min(e.distance(c)) >= 0.09 && a.distance(Point::ORIGIN) <= crate::scene::STILL_M);
    scene.goal.keep_still = vec!["e".into()];
    let still = planned(&scene, &varying(), &Options::default());
    let end = still.prediction.expect("a prediction").final_poses["e"].position;
    assert!(still.outcome == Outcome::BestEffort || end.distance(scene.placed[2].position_m) < 0.005);
    // The paper's planner strikes the largest object, `a`, which therefore must be free to move.
    scene.goal.keep_still.clear();
    let paper = plan(&scene, &properties(), &paper_options()).expect("a plan");
    assert!(paper.reason.ends_with("e is singulated"), "{}", paper.reason);
}

#[test]
fn the_goal_requires_clearance_for_the_gripper() {
    let mut scene = pair();
    scene.goal = Goal { min_distance_m: 0.0, mean_distance_m: [0.0, 0.9], ..Goal::default() };
    let lying = plan(&scene, &properties(), &paper_options()).expect("a plan");
    assert_eq!((lying.outcome, lying.strike), (Outcome::Found, None));
    // Both discs can be grasped from the sides of the pair; three more discs leave the first one no free direction.
    scene.goal.gripper = Some(GRIPPER);
    assert!(plan(&scene, &properties(), &paper_options()).expect("a plan").strike.is_none());
    for (object, x, y) in [("a#2", -0.0815, 0.0), ("c#2", 0.0, 0.0765), ("c#3", 0.0, -0.0765)] {
        let position_m = Point::new(x, y);
        scene.placed.push(crate::scene::Placed { object: object.into(), position_m, yaw_rad: 0.0 });
    }
    let held = Singulation::of(&scene, &scene.placed.iter().map(|p| (p.object.clone(), p.pose())).collect());
    let words: Vec<_> = held.expect("known").violations().iter().map(ToString::to_string).collect();
    assert_eq!(words, ["the gripper finds no room around a"]);
    scene.goal.gripper = Some(Gripper { opening_m: 0.07, ..GRIPPER });
    let plan = plan(&scene, &properties(), &paper_options()).expect("a plan");
    assert!(
        plan.strike.is_none() && plan.reason.contains("a is wider in every direction"),
        "{}",
        plan.reason
    );
}

#[test]
fn goals_about_objects_that_are_not_placed_are_errors_with_their_names() {
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
    fn the_margin_is_negative_exactly_where_the_goal_is_violated(
        coordinates in prop::collection::vec((-0.55f64..0.55, -0.45f64..0.45, -3.0f64..3.0), 3),
        gap_m in prop_oneof![Just(0.0), Just(0.03)],
        target in prop_oneof![Just(None), Just(Some("b".to_owned()))],
        keep_still in prop_oneof![Just(Vec::new()), Just(vec!["d".to_owned()])],
        gripper in prop_oneof![Just(None), Just(Some(GRIPPER))],
    ) {
        let mut scene = scene(&[("a", 0.0, 0.0, 0.0), ("b", 0.2, 0.0, 0.0), ("d", 0.0, 0.2, 0.0)]);
        scene.goal = Goal { min_gap_m: gap_m, target, keep_still, gripper, ..Goal::default() };
        let points_m = [[0.2, 0.1], [0.4, 0.1], [0.4, 0.3], [0.2, 0.3]].map(Point::from).to_vec();
        scene.keep_out = vec![crate::scene::KeepOut { points_m }];
        let poses: Vec<Pose> = coordinates.iter().map(|&(x, y, yaw)| Pose::new(x, y, yaw)).collect();
        let named = scene.placed.iter().map(|p| p.object.clone()).zip(poses.iter().copied()).collect();
        let violations = Singulation::of(&scene, &named).expect("known objects").violations().to_vec();
        let margin = GoalEvaluator::new(&scene).expect("known objects").margin(&poses, &[]);
        prop_assert_eq!(margin.fulfilled(), violations.is_empty(), "{:?} {:?}", margin, violations);
    }
}
