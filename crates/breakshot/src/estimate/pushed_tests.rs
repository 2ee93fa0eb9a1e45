//! Clips without strikes: friction, restitution and mass ratios of objects that were pushed or thrown by hand.

use super::{ClipTracks, Options, estimation};
use crate::cell::{Cell, Striker, Workspace};
use crate::detect::{Sample, Track, Tracks};
use crate::geometry::{Point, Vec2};
use crate::object::{Object, Shape};
use crate::physics::GRAVITY_M_S2;
use crate::properties::Properties;
use crate::synthetic::campaign::{CampaignSpec, SyntheticCampaign, campaign};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// The clips without their strikes: they begin when the first object moves, and end soon after the impact.
fn pushed(mut drawn: SyntheticCampaign) -> SyntheticCampaign {
    const AFTER_S: f64 = 0.15;
    for clip in &mut drawn.clips {
        clip.strike = None;
        let moves_s = |track: &Track| {
            let first = track.samples[0].position();
            track.samples.iter().find(|s| s.position().distance(first) > 1e-3).map(|s| s.time_s)
        };
        let onsets_s: Vec<f64> = clip.tracks.tracks.iter().filter_map(moves_s).collect();
        let from_s = onsets_s[0];
        let until_s = onsets_s.get(1).map_or(f64::INFINITY, |impact_s| impact_s + AFTER_S);
        for track in &mut clip.tracks.tracks {
            track.samples.retain(|s| (from_s..until_s).contains(&s.time_s));
        }
    }
    drawn
}

/// Root mean square errors of friction and mass ratios (relative) and of restitution, and which values are absent.
fn errors(campaigns: impl Iterator<Item = SyntheticCampaign>) -> ([f64; 3], Vec<String>) {
    let (mut squares, mut counts, mut absent) = ([0.0; 3], [0.0; 3], Vec::new());
    for (campaign, drawn) in campaigns.enumerate() {
        let found =
            estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default()).expect("properties");
        let Properties { friction, restitution, mass_ratio, .. } = found.properties;
        let kinds = [
            (&drawn.truth.friction, friction),
            (&drawn.truth.mass_ratio, mass_ratio),
            (&drawn.truth.restitution, restitution),
        ];
        for (kind, (truth, found)) in kinds.into_iter().enumerate() {
            for (name, truth) in truth {
                let Some(found) = found.get(name) else {
                    absent.push(format!("campaign {campaign}, kind {kind}: {name}"));
                    continue;
                };
                let scale = if kind == 2 { 1.0 } else { *truth };
                squares[kind] += ((found.mean - truth) / scale).powi(2);
                counts[kind] += 1.0;
            }
        }
    }
    ([0, 1, 2].map(|kind| (squares[kind] / counts[kind]).sqrt()), absent)
}

#[test]
fn a_campaign_pushed_by_hand_is_as_accurate_as_a_struck_one() {
    let drawn = |seed| campaign(&CampaignSpec { objects: 3, ..CampaignSpec::default() }, seed);
    let (struck, absent) = errors((1..=4).map(drawn));
    let (by_hand, absent_by_hand) = errors((1..=4).map(drawn).map(pushed));
    assert_eq!(absent_by_hand, absent);
    for ((struck, by_hand), what) in struck.iter().zip(by_hand).zip(["friction", "mass ratio", "restitution"])
    {
        println!("{what}: rms error {by_hand:.4} pushed by hand, {struck:.4} struck");
        // Errors of a hundredth are those of the drawn variation from clip to clip.
        assert!(by_hand < 1.5 * struck.max(0.01), "{what}: error {by_hand}, of struck clips {struck}");
    }
}

const RADIUS_M: f64 = 0.03;
const FRICTION: [f64; 2] = [0.2, 0.15];
const RESTITUTION: f64 = 0.6;
/// The mass of the second puck over that of the first one.
const MASS_RATIO: f64 = 0.7;

/// A slide that began at time 0, seen from the instants of an impact.
#[derive(Clone, Copy)]
struct Slide {
    position: Point,
    velocity: Vec2,
    friction: f64,
}

impl Slide {
    fn after(self, t: f64) -> Self {
        let braking = self.velocity.direction().unwrap_or_default() * (self.friction * GRAVITY_M_S2);
        let position = self.position + self.velocity * t - braking * (t * t / 2.0);
        Self { position, velocity: self.velocity - braking * t, ..self }
    }
}

/// Two pucks that both move from the first frame to the last, and hit each other between them.
fn crossing(number: usize, random: &mut Pcg64Mcg) -> ClipTracks {
    const NOISE_M: f64 = 3e-5;
    const FRAME_S: f64 = 1.0 / 120.0;
    let offset_m = random.random_range(-0.02..0.02);
    let pucks = [
        Slide {
            position: Point::new(-0.13, offset_m),
            velocity: Vec2::new(random.random_range(0.9..1.1), 0.0),
            friction: FRICTION[0],
        },
        Slide {
            position: Point::ORIGIN,
            velocity: Vec2::from_heading(random.random_range(-0.2..0.2)) * random.random_range(0.3..0.4),
            friction: FRICTION[1],
        },
    ];
    let distance_m = |t: f64| pucks[0].after(t).position.distance(pucks[1].after(t).position);
    let hit_s = (0..20_000)
        .map(|k| 1e-5 * f64::from(k))
        .find(|t| distance_m(*t) <= 2.0 * RADIUS_M)
        .expect("an impact");
    let [mut a, mut b] = pucks.map(|puck| puck.after(hit_s));
    let normal = (b.position - a.position).direction().expect("two places");
    let approach = (a.velocity - b.velocity).dot(normal);
    let impulse = (1.0 + RESTITUTION) * approach / (1.0 + 1.0 / MASS_RATIO);
    a.velocity -= normal * impulse;
    b.velocity += normal * (impulse / MASS_RATIO);
    let mut track = |name: &str, before: Slide, after: Slide| {
        let samples = (0..24).map(|k| FRAME_S * f64::from(k)).map(|time_s| {
            let at = if time_s < hit_s { before.after(time_s) } else { after.after(time_s - hit_s) };
            let mut noise = || NOISE_M * random.random_range(-1.7..1.7);
            let error = Vec2::new(noise(), noise());
            Sample::new(time_s, at.position + error, None, NOISE_M)
        });
        Track { object: name.into(), samples: samples.collect() }
    };
    let tracks = vec![track("a", pucks[0], a), track("b", pucks[1], b)];
    let tracks = Tracks { version: 1, tracks, ..Tracks::default() };
    ClipTracks {
        name: format!("crossing_{number}"),
        objects: vec!["a".into(), "b".into()],
        strike: None,
        tracks,
    }
}

#[test]
fn two_pucks_that_move_from_the_first_frame_to_the_last_tell_their_masses_and_restitution() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let clips: Vec<ClipTracks> = (0..8).map(|number| crossing(number, &mut random)).collect();
    let mut cell = Cell::from_above(1.0, Workspace::centred([1.0, 1.0]), Striker::none());
    cell.scale_px_per_m = None;
    let object = |name: &str| Object {
        name: name.into(),
        shape: Shape::Disc { radius_m: RADIUS_M },
        height_m: 0.02,
        marker: None,
        mass_kg: None,
        support: None,
    };
    let found = estimation(&clips, &cell, &[object("a"), object("b")], &Options::default())
        .expect("properties")
        .properties;
    let ratio = found.mass_ratio.get("b").unwrap_or_else(|| panic!("no mass ratio: {:?}", found.warnings));
    let restitution =
        found.restitution.get("a/b").unwrap_or_else(|| panic!("no restitution: {:?}", found.warnings));
    for (what, found, truth) in [
        ("mass ratio", ratio, MASS_RATIO),
        ("restitution", restitution, RESTITUTION),
        ("friction of a", &found.friction["a"], FRICTION[0]),
        ("friction of b", &found.friction["b"], FRICTION[1]),
    ] {
        let [low, high] = found.interval_95;
        println!("{what}: {:.4} in {low:.4} to {high:.4}, drawn {truth}", found.mean);
        assert!(
            low <= truth && truth <= high && high - low < 0.2 * truth,
            "{what}: {found:?}, drawn {truth}"
        );
    }
}
