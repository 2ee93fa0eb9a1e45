//! Clips of simulated strikes give the properties of the simulation back, where impacts follow each other fast or are oblique.

#![allow(clippy::expect_used, missing_docs)]

mod piles;

use breakshot::detect::{Sample, Track, Tracks};
use breakshot::estimate::{ClipTracks, Options, estimation};
use breakshot::geometry::{Point, Pose, Vec2};
use breakshot::object::Shape;
use breakshot::physics::ImpactLaw;
use breakshot::properties::Properties;
use breakshot::scene::Strike;
use breakshot::uncertain::Estimate;
use piles::{Pile, draw, regular};

const FRAME_S: f64 = 1.0 / 60.0;
/// The strike begins this long after the film (s).
const SETTLE_S: f64 = 0.2;
/// The noise of positions (m) and yaws (rad).
const NOISE_M: f64 = 4e-5;
const NOISE_RAD: f64 = 2e-3;

/// Two objects on a line, the first of which is struck: shape, mass, friction and restitution of each, and the pose of the second.
struct Pair {
    shapes: [Shape; 2],
    materials: [(f64, f64, f64); 2],
    poses: [Pose; 2],
    contact_friction: f64,
}

impl Pair {
    /// A clip of a central strike on the first object.
    fn clip(&self, seed: u64) -> (Pile, ClipTracks) {
        let mut pile = Pile::new();
        for ((shape, &material), &pose) in self.shapes.iter().zip(&self.materials).zip(&self.poses) {
            pile.add(shape.clone(), material, pose);
        }
        pile.contact_friction(self.contact_friction);
        let start_m = self.poses[0].position - Vec2::new(0.12, 0.0);
        pile.strike = Strike { start_m, speed_m_s: 0.4 + 0.01 * seed as f64, travel_m: 0.1, ..pile.strike };
        // The estimate gives the ratio of the speeds of the contact points (Eq. 32): Newton's law.
        pile.options.impact = ImpactLaw::Newton;
        let motion = pile.run();
        let mut noise = draw(seed);
        // A sum of four uniform numbers is nearly normal, with a variance of a third.
        let mut normal = || (0..4).map(|_| noise.between(-1.0, 1.0)).sum::<f64>() / (4.0_f64 / 3.0).sqrt();
        let frames = ((motion.duration_s + 2.0 * SETTLE_S) / FRAME_S) as usize;
        let names: Vec<String> = pile.scene.placed.iter().map(|placed| placed.object.clone()).collect();
        let tracks = names.iter().map(|name| {
            let sample = |k: usize| {
                let time_s = k as f64 * FRAME_S;
                let pose = motion.pose(name, (time_s - SETTLE_S).max(0.0)).expect("a known object");
                let position = pose.position + Vec2::new(normal(), normal()) * NOISE_M;
                Sample::new(time_s, position, Some(pose.yaw_rad + NOISE_RAD * normal()), NOISE_M)
            };
            Track { object: name.clone(), samples: (0..frames).map(sample).collect() }
        });
        let tracks = Tracks {
            version: 1,
            video: format!("{seed}.mp4"),
            tracks: tracks.collect(),
            ..Tracks::default()
        };
        let clip = ClipTracks {
            name: tracks.video.clone(),
            objects: names,
            strike: Some(pile.strike.clone()),
            tracks,
        };
        (pile, clip)
    }

    /// What three such clips show.
    fn learned(&self) -> (Pile, Properties) {
        let (piles, clips): (Vec<Pile>, Vec<ClipTracks>) = (1..4).map(|seed| self.clip(seed)).unzip();
        let scene = &piles[0].scene;
        let found =
            estimation(&clips, &scene.cell, &scene.objects, &Options::default()).expect("an estimate");
        (piles[0].clone(), found.properties)
    }
}

/// Whether an interval, widened by this part of the truth, holds the truth.
fn holds(estimate: &Estimate, truth: f64, slack: f64) -> bool {
    let [low, high] = estimate.interval_95;
    (low - slack * truth..=high + slack * truth).contains(&truth)
}

/// A rectangle with these half sides, as a polygon.
fn block(x: f64, y: f64) -> Shape {
    let corners = [(-x, -y), (x, -y), (x, y), (-x, y)];
    Shape::Polygon { points_m: corners.map(|(x, y)| Point::new(x, y)).to_vec() }
}

/// A heavy hexagon that slides far follows a light block that does not, and hits it again and again.
fn follower() -> Pair {
    let hexagon = regular(6, 0.0285);
    Pair {
        shapes: [hexagon, block(0.034, 0.017)],
        materials: [(1.64, 0.15, 0.85), (1.0, 0.35, 0.6)],
        poses: [Pose::new(-0.1, 0.0, 0.1), Pose::new(-0.01, 0.004, 1.3)],
        contact_friction: 0.3,
    }
}

#[test]
fn impacts_that_follow_each_other_fast_give_no_wrong_friction() {
    let (pile, found) = follower().learned();
    assert!(!found.friction.is_empty(), "no friction was found");
    for (name, friction) in &found.friction {
        let truth = pile.properties.friction[name].mean;
        assert!(holds(friction, truth, 0.03), "friction of {name}: {friction:?}, not {truth}");
    }
    for (pair, restitution) in &found.restitution {
        let truth = pile.properties.restitution[pair].mean;
        assert!(holds(restitution, truth, 0.05), "restitution of {pair}: {restitution:?}, not {truth}");
    }
}

/// A block that meets the nearly parallel face of another one with a corner, off its centre and with much contact friction.
fn oblique() -> Pair {
    Pair {
        shapes: [block(0.03, 0.024), block(0.028, 0.03)],
        materials: [(1.0, 0.25, 0.8), (0.7, 0.3, 0.7)],
        poses: [Pose::new(-0.1, 0.0, 0.0), Pose::new(-0.01, 0.03, 0.08)],
        contact_friction: 0.35,
    }
}

#[test]
fn oblique_impacts_with_contact_friction_give_their_restitution() {
    let (pile, found) = oblique().learned();
    let (pair, restitution) = found.restitution.iter().next().expect("a restitution");
    let truth = pile.properties.restitution[pair].mean;
    assert!(holds(restitution, truth, 0.03), "restitution of {pair}: {restitution:?}, not {truth}");
}
