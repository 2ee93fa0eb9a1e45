//! Advice is judged by filming what it says.

use super::experiment::Shot;
use super::prior::Belief;
use super::sensitivity::Response;
use super::simulated_clip::Filming;
use super::{AdviceOptions, advice, mean_spread_m, predictive_spread_m, sensitivity, struck_piles};
use crate::estimate::joint::update_tests::{cell, estimated, object, objects, truth};
use crate::estimate::{ClipTracks, Options, updated};
use crate::geometry::Point;
use crate::object::{Object, Shape};
use crate::properties::Properties;
use crate::scene::{Goal, Placed, Scene};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn clip(number: usize, shot: &Shot) -> ClipTracks {
    let filming =
        Filming { frame_rate_hz: 60.0, place_std_m: 5e-5, yaw_std_rad: 0.004, seed: Some(number as u64) };
    shot.staged(&format!("{number}.mp4"), (&cell(), &objects()), &truth(number), &filming).expect("a clip")
}

fn shot(strike: &str, into: Option<&str>, speed_m_s: f64) -> Shot {
    Shot { strike: strike.into(), into: into.map(Into::into), speed_m_s, offset_m: 0.0 }
}

/// Every object alone, and the first into the second: masses of the third and two restitutions are open.
fn start() -> Properties {
    let shots =
        [shot("a", None, 0.45), shot("b", None, 0.45), shot("c", None, 0.45), shot("a", Some("b"), 0.45)];
    let clips: Vec<ClipTracks> = shots.iter().enumerate().map(|(k, s)| clip(k, s)).collect();
    estimated(&clips)
}

fn filmed(old: &Properties, shots: &[Shot], first_number: usize) -> Properties {
    let clips: Vec<ClipTracks> = shots.iter().enumerate().map(|(k, s)| clip(first_number + k, s)).collect();
    updated(old, &clips, &cell(), &objects(), &Options::default()).expect("an update").properties
}

#[test]
fn advised_clips_really_filmed_shrink_the_scatter_more_than_random_ones() {
    const CLIPS: usize = 3;
    const ROUNDS: usize = 4;
    let old = start();
    let options = AdviceOptions { clips: CLIPS, seed: 1, scene: None };
    let advised = advice(&old, &cell(), &objects(), &options).expect("advice");
    let piles = struck_piles(&truth(0), &cell(), &objects(), (12, 99)).expect("piles");
    let spread_m = |p: &Properties| predictive_spread_m(p, &objects(), &piles, (40, 7));
    let before_m = spread_m(&old);
    let shots: Vec<Shot> = advised.clips.iter().map(|c| c.shot.clone()).collect();
    let gain_m = before_m - spread_m(&filmed(&old, &shots, 100));
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut random_gain_m = 0.0;
    for round in 0..ROUNDS {
        let names = ["a", "b", "c"];
        let shots: Vec<Shot> = (0..CLIPS)
            .map(|_| {
                let struck = names[random.random_range(0..3usize)];
                let into = names[random.random_range(0..3usize)];
                shot(struck, Some(into).filter(|n| *n != struck), random.random_range(0.3..0.6))
            })
            .collect();
        random_gain_m += (before_m - spread_m(&filmed(&old, &shots, 200 + 10 * round))) / ROUNDS as f64;
    }
    // Of three objects random clips too find what is open: no more than twice their gain is possible here.
    assert!(gain_m > 1.25 * random_gain_m, "advised {gain_m} m, random {random_gain_m} m, of {before_m} m");
}

#[test]
fn the_linearized_spread_is_that_of_rollouts_where_everything_is_known_well() {
    let mut known = estimated(
        &(0..12)
            .map(|k| {
                let pairs = [("a", "b"), ("b", "c"), ("a", "c")];
                clip(k, &shot(pairs[k % 3].0, Some(pairs[k % 3].1), 0.45))
            })
            .collect::<Vec<_>>(),
    );
    // Contact friction has a wide prior, and bends the response: here it is known.
    known.contact_friction = truth(0).contact_friction;
    let contact =
        crate::uncertain::Estimate { standard_error: 1e-3, ..crate::uncertain::Estimate::exact(0.2) };
    known.contact_friction.objects = Some(contact);
    known.contact_friction.striker = Some(contact);
    let piles = struck_piles(&known, &cell(), &objects(), (30, 5)).expect("piles");
    let belief = Belief::new(&known, &objects(), false);
    let responses: Vec<Response> = sensitivity::responses(&belief, &piles);
    let linear_m = mean_spread_m(&responses, &belief.covariance);
    let rolled_m = predictive_spread_m(&known, &objects(), &piles, (60, 7));
    assert!((linear_m / rolled_m - 1.0).abs() < 0.25, "linearized {linear_m} m, rollouts {rolled_m} m");
}

#[test]
fn a_scene_of_two_objects_asks_for_that_pair_and_the_same_seed_for_the_same_clips() {
    let old = start();
    let at =
        |object: &str, x: f64| Placed { object: object.into(), position_m: Point::new(x, 0.0), yaw_rad: 0.0 };
    let scene = Scene {
        cell: cell(),
        objects: objects(),
        observed_unix_s: None,
        placed: vec![at("b", -0.04), at("c", 0.02)],
        walls: Vec::new(),
        keep_out: Vec::new(),
        goal: Goal::default(),
    };
    let options = AdviceOptions { clips: 2, seed: 4, scene: Some(&scene) };
    let first = advice(&old, &cell(), &objects(), &options).expect("advice");
    let Shot { strike, into, .. } = &first.clips[0].shot;
    let mut pair = [strike.as_str(), into.as_deref().unwrap_or_default()];
    pair.sort_unstable();
    assert_eq!(pair, ["b", "c"], "{:?}", first.clips[0]);
    assert!(first.spread_m > first.clips[0].spread_m && first.clips[0].spread_m >= first.clips[1].spread_m);
    assert_eq!(first, advice(&old, &cell(), &objects(), &options).expect("advice"));
}

#[test]
fn objects_that_nothing_can_strike_and_properties_without_evidence_are_refused() {
    let options = AdviceOptions { clips: 1, seed: 1, scene: None };
    let old = start();
    let without = Properties { evidence: None, ..old.clone() };
    let message = advice(&without, &cell(), &objects(), &options).expect_err("no evidence").to_string();
    assert!(message.contains("evidence"), "{message}");
    let huge: Vec<Object> = vec![object("a", Shape::Disc { radius_m: 3.0 })];
    let message = advice(&old, &cell(), &huge, &options).expect_err("no room").to_string();
    assert!(message.contains("needed"), "{message}");
}
