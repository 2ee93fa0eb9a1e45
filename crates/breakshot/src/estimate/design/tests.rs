//! Advice is tested by simulating the advised clips with the true properties.

use super::experiment::{Experiment, Setup};
use super::prior::Prior;
use super::sensitivity::{Draws, OutcomeJacobian};
use super::simulated_clip::SimulatedCamera;
use super::{AdviceOptions, advice, mean_position_std_m, predictive_std_m, sensitivity, struck_piles};
use crate::estimate::joint::update_tests::{cell, estimated, object, objects, truth};
use crate::estimate::{ClipTracks, Options, updated};
use crate::geometry::Point;
use crate::object::{Object, Shape};
use crate::properties::Properties;
use crate::scene::{Placed, Scene};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn clip(number: usize, experiment: &Experiment) -> ClipTracks {
    let camera = SimulatedCamera {
        frame_rate_hz: 60.0,
        position_std_m: 5e-5,
        yaw_std_rad: 0.004,
        seed: Some(number as u64),
    };
    experiment
        .simulated_clip(
            &format!("{number}.mp4"),
            Setup { cell: &cell(), objects: &objects() },
            &truth(number),
            &camera,
        )
        .expect("a clip")
}

fn experiment(strike: &str, into: Option<&str>, speed_m_s: f64) -> Experiment {
    Experiment { strike: strike.into(), into: into.map(Into::into), speed_m_s, offset_m: 0.0 }
}

/// The estimate from every object alone, and the first into the second: the mass of the third and two restitutions are unknown.
fn start() -> Properties {
    let experiments = [
        experiment("a", None, 0.45),
        experiment("b", None, 0.45),
        experiment("c", None, 0.45),
        experiment("a", Some("b"), 0.45),
    ];
    let clips: Vec<ClipTracks> = experiments.iter().enumerate().map(|(k, s)| clip(k, s)).collect();
    estimated(&clips)
}

fn filmed(old: &Properties, experiments: &[Experiment], first_number: usize) -> Properties {
    let clips: Vec<ClipTracks> =
        experiments.iter().enumerate().map(|(k, s)| clip(first_number + k, s)).collect();
    updated(old, &clips, &cell(), &objects(), &Options::default()).expect("an update").properties
}

#[test]
fn advised_clips_reduce_the_uncertainty_of_rollouts_more_than_random_ones() {
    const CLIPS: usize = 2;
    const ROUNDS: usize = 12;
    let old = start();
    let options = AdviceOptions { clips: CLIPS, seed: 1, scene: None };
    let advised = advice(&old, &cell(), &objects(), &options).expect("advice");
    let piles = struck_piles(&truth(0), &cell(), &objects(), Draws { count: 12, seed: 99 }).expect("piles");
    let std_m = |p: &Properties| predictive_std_m(p, &objects(), &piles, Draws { count: 40, seed: 7 });
    let before_m = std_m(&old);
    let experiments: Vec<Experiment> = advised.clips.iter().map(|c| c.experiment.clone()).collect();
    let gain_m = before_m - std_m(&filmed(&old, &experiments, 100));
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut random_gain_m = 0.0;
    for round in 0..ROUNDS {
        let names = ["a", "b", "c"];
        let experiments: Vec<Experiment> = (0..CLIPS)
            .map(|_| {
                let struck = names[random.random_range(0..3usize)];
                let into = names[random.random_range(0..3usize)];
                experiment(struck, Some(into).filter(|n| *n != struck), random.random_range(0.3..0.6))
            })
            .collect();
        random_gain_m += (before_m - std_m(&filmed(&old, &experiments, 200 + 10 * round))) / ROUNDS as f64;
    }
    // With three objects random clips find the unknown parameters too.
    assert!(gain_m > 1.25 * random_gain_m, "advised {gain_m} m, random {random_gain_m} m, of {before_m} m");
}

#[test]
fn the_linearized_uncertainty_is_that_of_rollouts_for_small_uncertainties() {
    let mut known = estimated(
        &(0..12)
            .map(|k| {
                let pairs = [("a", "b"), ("b", "c"), ("a", "c")];
                clip(k, &experiment(pairs[k % 3].0, Some(pairs[k % 3].1), 0.45))
            })
            .collect::<Vec<_>>(),
    );
    // Contact friction has a wide prior, for which the response is not linear: here it is known.
    known.contact_friction = truth(0).contact_friction;
    let contact =
        crate::uncertain::Estimate { standard_error: 1e-3, ..crate::uncertain::Estimate::exact(0.2) };
    known.contact_friction.objects = Some(contact);
    known.contact_friction.striker = Some(contact);
    let piles = struck_piles(&known, &cell(), &objects(), Draws { count: 30, seed: 5 }).expect("piles");
    let prior = Prior::new(&known, &objects(), false);
    let jacobians: Vec<OutcomeJacobian> = sensitivity::jacobians(&prior, &piles);
    let linear_m = mean_position_std_m(&jacobians, &prior.covariance);
    let rollouts_m = predictive_std_m(&known, &objects(), &piles, Draws { count: 60, seed: 7 });
    assert!((linear_m / rollouts_m - 1.0).abs() < 0.25, "linearized {linear_m} m, rollouts {rollouts_m} m");
}

#[test]
fn advice_for_a_scene_of_two_objects_is_that_pair_and_depends_on_nothing_but_the_seed() {
    let old = start();
    let at =
        |object: &str, x: f64| Placed { object: object.into(), position_m: Point::new(x, 0.0), yaw_rad: 0.0 };
    let scene = Scene::on_free_table(cell(), objects(), vec![at("b", -0.04), at("c", 0.02)]);
    let options = AdviceOptions { clips: 2, seed: 4, scene: Some(&scene) };
    let first = advice(&old, &cell(), &objects(), &options).expect("advice");
    let Experiment { strike, into, .. } = &first.clips[0].experiment;
    let mut pair = [strike.as_str(), into.as_deref().unwrap_or_default()];
    pair.sort_unstable();
    assert_eq!(pair, ["b", "c"], "{:?}", first.clips[0]);
    assert!(first.spread_m > first.clips[0].spread_m && first.clips[0].spread_m >= first.clips[1].spread_m);
    assert_eq!(first, advice(&old, &cell(), &objects(), &options).expect("advice"));
}

#[test]
fn objects_that_do_not_fit_and_properties_without_evidence_are_errors() {
    let options = AdviceOptions { clips: 1, seed: 1, scene: None };
    let old = start();
    let without = Properties { evidence: None, ..old.clone() };
    let message = advice(&without, &cell(), &objects(), &options).expect_err("no evidence").to_string();
    assert!(message.contains("evidence"), "{message}");
    let huge: Vec<Object> = vec![object("a", Shape::Disc { radius_m: 3.0 })];
    let message = advice(&old, &cell(), &huge, &options).expect_err("no room").to_string();
    assert!(message.contains("needed"), "{message}");
}
