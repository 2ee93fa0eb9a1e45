//! What tracks would the detector give if the truth were this?
//!
//! Draws whole campaigns: objects with masses, frictions and restitutions from a seed, the paper's cases (the striker
//! against each object, and each pair), and the tracks of every clip.  The bodies move by a law of its own (`world`),
//! which shares no code with the fit, and are seen through an open shutter, noise, a codec and a striker's arm that
//! hides them (`observation`).  Tests and tutorials measure against such campaigns.

mod observation;
mod world;

use crate::cell::{Cell, Striker, Workspace};
use crate::detect::Tracks;
use crate::estimate::ClipTracks;
use crate::geometry::{Point, Vec2};
use crate::object::{Marker, Object, Shape, pair_key};
use crate::scene::Strike;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use world::{Body, Laws, World};

/// How a campaign is filmed, and how much the table and the impacts vary.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// How many kinds of objects; every third one is a square, the others are discs.
    pub objects: usize,
    /// Clips of every case.
    pub clips_per_case: usize,
    /// Time from frame to frame (s).
    pub frame_s: f64,
    /// How long the shutter is open, over the time from frame to frame.
    pub exposure_frames: f64,
    /// One standard deviation of the positions' noise along each axis while a body moves (m).
    pub noise_m: f64,
    /// The part of that noise that is drawn anew in every frame while a body rests; the rest is one offset, as a codec
    /// that repeats the picture makes it (deviations, 0 to 1).
    pub still_noise: f64,
    /// The share of the frames in which a marker is hidden.
    pub hidden: f64,
    /// The share of the positions that are wrong, by millimetres.
    pub wrong: f64,
    /// Friction differs from clip to clip by this (relative, one deviation), alike for all objects of a clip.
    pub friction_spread: f64,
    /// Restitution differs from impact to impact by this (relative, one deviation).
    pub restitution_spread: f64,
    /// Impacts are up to this far off the centre, over the distance at which they would miss.
    pub off_centre: f64,
    /// Whether all markers tell how their objects are turned; else only those of squares do.
    pub bars: bool,
}

impl Default for Recipe {
    /// Paper-like films: five clips a case at 60 frames a second, central impacts.
    fn default() -> Self {
        Self {
            objects: 4,
            clips_per_case: 5,
            frame_s: 1.0 / 60.0,
            exposure_frames: 0.25,
            noise_m: 2e-5,
            still_noise: 0.3,
            hidden: 0.02,
            wrong: 0.002,
            friction_spread: 0.03,
            restitution_spread: 0.02,
            off_centre: 0.1,
            bars: false,
        }
    }
}

/// What a drawn campaign would show if it were filmed for ever.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Friction against the table, by object.
    pub friction: BTreeMap<String, f64>,
    /// Restitution against the striker, by object.
    pub striker_restitution: BTreeMap<String, f64>,
    /// Restitution of a pair, by [`pair_key`].
    pub restitution: BTreeMap<String, f64>,
    /// Mass over the mass of the first object, by object.
    pub mass_ratio: BTreeMap<String, f64>,
    /// Friction where objects touch each other.
    pub contact_friction: f64,
    /// Friction where objects touch the striker.
    pub striker_friction: f64,
}

/// A drawn campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct Campaign {
    /// The striker and the camera's spec; the exposure is not told.
    pub cell: Cell,
    /// The objects as a ruler would tell them.
    pub objects: Vec<Object>,
    /// The clips.
    pub clips: Vec<ClipTracks>,
    /// What they were drawn from.
    pub truth: Truth,
}

const STRIKER_M: f64 = 0.015;
/// The striker starts this far from the object and goes on for this long after the first touch.
const RUN_UP_M: f64 = 0.03;
const FOLLOW_M: f64 = 0.005;
const RETRACT_M_S: f64 = 0.15;
/// How long a clip is.
const CLIP_S: f64 = 1.1;

/// The campaign that belongs to a recipe and a seed.
pub fn campaign(recipe: &Recipe, seed: u64) -> Campaign {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let objects: Vec<Object> = (0..recipe.objects).map(|k| object(k, recipe, &mut random)).collect();
    let (truth, laws) = laws(&objects, &mut random);
    let mut cases: Vec<Vec<usize>> = (0..objects.len()).map(|k| vec![k]).collect();
    for i in 0..objects.len() {
        for j in i..objects.len() {
            // The first object also meets its copy; squares meet no squares: flat sides have no single restitution.
            let flat = |k: usize| !matches!(objects[k].shape, Shape::Disc { .. });
            if (i != j || i == 0) && !(flat(i) && flat(j)) {
                cases.push(if random.random_bool(0.5) { vec![i, j] } else { vec![j, i] });
            }
        }
    }
    let mut clips = Vec::new();
    for case in &cases {
        for n in 0..recipe.clips_per_case {
            let names: Vec<&str> = case.iter().map(|&k| objects[k].name.as_str()).collect();
            let name = format!("{}_{}.mp4", names.join("_"), n + 1);
            clips.push(clip(name, case, (&objects, &laws, recipe), &mut random));
        }
    }
    Campaign { cell: cell(), objects, clips, truth }
}

/// The cell of every drawn campaign: a small round striker, and a camera of unknown exposure that looks straight down.
pub fn cell() -> Cell {
    let striker = Striker { retract_speed_m_s: RETRACT_M_S, ..Striker::rod(STRIKER_M, [0.1, 1.0]) };
    Cell::from_above(2000.0, Workspace::centred([2.0, 2.0]), striker)
}

fn object(k: usize, recipe: &Recipe, random: &mut Pcg64Mcg) -> Object {
    const EVERY_THIRD: usize = 3;
    let square = k % EVERY_THIRD == EVERY_THIRD - 1;
    let radius_m = random.random_range(0.025..0.04);
    let shape =
        if square { Shape::Rectangle { size_m: [1.6 * radius_m; 2] } } else { Shape::Disc { radius_m } };
    let bar = Shape::Rectangle { size_m: [0.018, 0.009] };
    let marker = if square || recipe.bars { bar } else { Shape::Disc { radius_m: 0.01 } };
    let name = char::from(b'a' + (k % 26) as u8).to_string();
    let marker = Some(Marker::centred(marker));
    Object { name, shape, height_m: random.random_range(0.025..0.05), marker, mass_kg: None }
}

/// Draws what the objects are like.
fn laws(objects: &[Object], random: &mut Pcg64Mcg) -> (Truth, Laws) {
    let mut truth = Truth {
        contact_friction: random.random_range(0.1..0.3),
        striker_friction: random.random_range(0.1..0.3),
        ..Truth::default()
    };
    let mut laws = Laws {
        contact_friction: truth.contact_friction,
        striker_friction: truth.striker_friction,
        // Which share of contact friction acts along the vertical: unknown where the taller strikes, and even its
        // direction where the shorter does.
        pressing: [random.random_range(-0.5..0.5), random.random_range(0.0..1.0)],
        ..Laws::default()
    };
    // As the paper's objects: 8 to 143 g.
    for object in objects {
        let mass_kg = random.random_range(0.008f64.ln()..0.143f64.ln()).exp();
        laws.masses_kg.insert(object.name.clone(), mass_kg);
        truth.friction.insert(object.name.clone(), random.random_range(0.15..0.4));
        truth.striker_restitution.insert(object.name.clone(), random.random_range(0.4..0.75));
    }
    let unit_kg = laws.masses_kg.get(&objects[0].name).copied().unwrap_or(1.0);
    truth.mass_ratio = laws.masses_kg.iter().map(|(name, kg)| (name.clone(), kg / unit_kg)).collect();
    for (k, one) in objects.iter().enumerate() {
        for other in &objects[k..] {
            let key = pair_key(&one.name, &other.name);
            truth.restitution.insert(key.clone(), random.random_range(0.35..0.85));
            // Bodies rock: every pair's ratio is off by a little, alike in all its clips.
            let rocking = if k + 1 == objects.len() { 0.0 } else { world::ROCKING_STD * normal(random) };
            laws.rocking.insert(key, if one.name == other.name { 0.0 } else { rocking });
        }
    }
    laws.friction = truth.friction.clone();
    laws.striker_restitution = truth.striker_restitution.clone();
    laws.restitution = truth.restitution.clone();
    (truth, laws)
}

fn normal(random: &mut Pcg64Mcg) -> f64 {
    StandardNormal.sample(random)
}

/// Films one clip.
fn clip(
    name: String,
    case: &[usize],
    (objects, laws, recipe): (&[Object], &Laws, &Recipe),
    random: &mut Pcg64Mcg,
) -> ClipTracks {
    let heading_rad = random.random_range(-0.4..0.4);
    let along = Vec2::from_heading(heading_rad);
    let yaw = |k: usize, random: &mut Pcg64Mcg| match objects[k].shape {
        Shape::Disc { .. } => random.random_range(-PI..PI),
        // A face meets the striker; an edge would be struck in a random direction.
        _ => heading_rad + random.random_range(-0.05..0.05),
    };
    let reach = |k: usize| world::half_width_m(&objects[k].shape);
    let mut off = |reach_m: f64| recipe.off_centre * reach_m * random.random_range(-1.0..1.0);
    let (aside_m, beside_m) =
        (off(reach(case[0]) + STRIKER_M), off(case.iter().map(|&k| reach(k)).sum::<f64>()));
    let friction_scale = 1.0 + recipe.friction_spread * normal(random);
    let mut bodies = Vec::new();
    let mut place = Point::ORIGIN;
    for (n, &k) in case.iter().enumerate() {
        if n > 0 {
            // A disc that is hit off its centre leaves along the line of centres.
            let leaves = world::leaves(&objects[case[0]].shape, along, aside_m);
            let gap_m = random.random_range(0.012..0.03);
            place = Point::ORIGIN + leaves * (reach(case[0]) + reach(k) + gap_m);
            place += leaves.perpendicular() * beside_m;
        }
        let copy =
            if n > 0 && case[0] == k { format!("{}#2", objects[k].name) } else { objects[k].name.clone() };
        let turned = yaw(k, random);
        bodies.push(Body::new(copy, &objects[k], laws, (place, turned), friction_scale));
    }
    let speed_m_s = random.random_range(0.3..0.6);
    let start_m =
        Point::ORIGIN - along * (reach(case[0]) + STRIKER_M + RUN_UP_M) + along.perpendicular() * aside_m;
    let strike = Strike {
        object: None,
        start_m,
        heading_rad,
        speed_m_s,
        travel_m: RUN_UP_M + FOLLOW_M + world::deeper_m(&objects[case[0]].shape, aside_m),
    };
    let begins_s = random.random_range(0.1..0.16);
    let restitution_spread = recipe.restitution_spread;
    let mut world = World::new(bodies, strike.clone(), begins_s);
    let filmed = world.run(laws, CLIP_S + 2.0 * recipe.frame_s, || 1.0 + restitution_spread * normal(random));
    let tracks = filmed.iter().map(|path| observation::track(path, recipe, random)).collect();
    ClipTracks {
        name,
        objects: filmed.iter().map(|path| path.object.clone()).collect(),
        strike: Some(strike),
        tracks: Tracks { version: 1, tracks, ..Tracks::default() },
    }
}
