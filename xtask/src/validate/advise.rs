//! Is the advice on what to film next worth following?  `cargo xtask validate advise [CELLS]`.
//!
//! Synthetic cells of random objects.  From a first campaign the advisor names ten clips; those clips, and ten random ones,
//! are really staged with the cell's own truth, noise and variation from clip to clip, and estimated together with the
//! first campaign.  What counts is how far final places scatter in rollouts of fresh piles when the quantities are drawn from
//! the new estimates, and how far the predictions are from the truth: neither is the advisor's own formula.

use super::row::{self, Row};
use crate::splitmix::Draw;
use breakshot::cell::{CameraSpec, Cell, Striker, Workspace};
use breakshot::estimate::{
    self, AdviceOptions, ClipTracks, Filming, Options, Shot, StruckPile, predictive_spread_m,
};
use breakshot::object::{Marker, Object, Shape, pair_key};
use breakshot::properties::Properties;
use breakshot::uncertain::Estimate;

/// Cells unless told otherwise.
pub(crate) const CELLS: u64 = 12;
/// Clips that are advised, and drawn.
const CLIPS: usize = 10;
/// So many times more than random clips the advised ones are to shrink the scatter.
const TIMES: f64 = 1.5;
/// Draws of ten random clips a cell: their mean counts.
const RANDOM_DRAWS: u64 = 3;
/// Fresh piles to judge by, and rollouts of each.
const PILES: usize = 40;
const ROLLOUTS: usize = 60;
/// One standard deviation from clip to clip (relative).
const FRICTION_SPREAD: f64 = 0.03;
const RESTITUTION_SPREAD: f64 = 0.02;

/// A cell whose truth is known.
struct World {
    cell: Cell,
    objects: Vec<Object>,
    truth: Properties,
}

/// What was filmed before anyone asked.
#[derive(Clone, Copy, PartialEq)]
enum Start {
    /// Every object alone twice, and the first object twice into every other one.
    Few,
    /// Every object alone twice, and every pair once.
    EveryPair,
}

impl World {
    fn new(seed: u64) -> Self {
        let mut dice = Draw::new(seed);
        let names = ["a", "b", "c", "d", "e", "f"];
        let objects: Vec<Object> =
            names.iter().enumerate().map(|(k, name)| object(name, k, &mut dice)).collect();
        let mut truth = Properties { version: 1, reference: "a".into(), ..Properties::default() };
        let value = Estimate::exact;
        for (k, a) in names.iter().enumerate() {
            truth.friction.insert((*a).into(), value(dice.between(0.15, 0.4)));
            truth.striker_restitution.insert((*a).into(), value(dice.between(0.4, 0.75)));
            let mass = if k == 0 { 1.0 } else { dice.between(0.15f64.ln(), 2f64.ln()).exp() };
            truth.mass_ratio.insert((*a).into(), value(mass));
            for b in &names[k..] {
                truth.restitution.insert(pair_key(a, b), value(dice.between(0.35, 0.8)));
            }
        }
        truth.contact_friction.objects = Some(value(dice.between(0.1, 0.3)));
        truth.contact_friction.striker = Some(value(dice.between(0.1, 0.3)));
        Self { cell: cell(), objects, truth }
    }

    /// The truth in one clip: friction varies alike for all objects, restitutions each by itself.
    fn today(&self, dice: &mut Draw) -> Properties {
        let mut today = self.truth.clone();
        let scale = 1.0 + FRICTION_SPREAD * dice.normal();
        today.friction.values_mut().for_each(|e| e.mean *= scale);
        for e in today.restitution.values_mut().chain(today.striker_restitution.values_mut()) {
            e.mean = (e.mean * (1.0 + RESTITUTION_SPREAD * dice.normal())).clamp(0.0, 1.0);
        }
        today
    }

    fn filmed(&self, name: String, shot: &Shot, dice: &mut Draw) -> Result<ClipTracks, String> {
        let filming =
            Filming { frame_rate_hz: 60.0, place_std_m: 4e-5, yaw_std_rad: 0.004, seed: Some(dice.bits()) };
        let today = self.today(dice);
        shot.staged(&name, (&self.cell, &self.objects), &today, &filming).map_err(|e| e.to_string())
    }

    /// A random shot whose objects stay in the workspace.
    fn random_shot(&self, dice: &mut Draw) -> Result<Shot, String> {
        const TRIALS: usize = 100;
        for _ in 0..TRIALS {
            let n = self.objects.len();
            let struck = dice.below(n);
            // As likely alone as into any one of the others.
            let into = Some(dice.below(n)).filter(|k| *k != struck);
            let shot = Shot {
                strike: self.objects[struck].name.clone(),
                into: into.map(|k| self.objects[k].name.clone()),
                speed_m_s: (dice.between(0.3, 0.8) * 1e3).round() / 1e3,
                offset_m: 0.0,
            };
            let clip = self.filmed(String::new(), &shot, &mut Draw::new(0))?;
            let mut ends = clip.tracks.tracks.iter().filter_map(|t| t.samples.last());
            if ends.all(|s| self.cell.workspace.contains(s.position())) {
                return Ok(shot);
            }
        }
        Err("no random shot stays in the workspace".into())
    }

    fn first_campaign(&self, start: Start, dice: &mut Draw) -> Result<Vec<ClipTracks>, String> {
        let shot = |strike: usize, into: Option<usize>| Shot {
            strike: self.objects[strike].name.clone(),
            into: into.map(|k| self.objects[k].name.clone()),
            speed_m_s: 0.5,
            offset_m: 0.0,
        };
        let n = self.objects.len();
        let mut shots: Vec<Shot> = (0..n).flat_map(|k| [shot(k, None), shot(k, None)]).collect();
        match start {
            Start::Few => shots.extend((1..n).flat_map(|k| [shot(0, Some(k)), shot(0, Some(k))])),
            Start::EveryPair => {
                shots.extend(
                    (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).map(|(i, j)| shot(i, Some(j))),
                );
            }
        }
        shots.iter().enumerate().map(|(k, s)| self.filmed(format!("first_{k}.mp4"), s, dice)).collect()
    }

    /// The estimate after these shots were filmed too.
    fn after(&self, first: &Properties, shots: &[Shot], dice: &mut Draw) -> Result<Properties, String> {
        let clips: Vec<ClipTracks> = (shots.iter().enumerate())
            .map(|(k, s)| self.filmed(format!("next_{k}.mp4"), s, dice))
            .collect::<Result<_, _>>()?;
        let estimation = estimate::updated(first, &clips, &self.cell, &self.objects, &Options::default());
        estimation.map(|e| e.properties).map_err(|e| e.to_string())
    }
}

fn object(name: &str, k: usize, dice: &mut Draw) -> Object {
    // Every third one is a block with a bar, whose turn is seen.
    let block = k % 3 == 2;
    let shape = if block {
        Shape::Rectangle { size_m: [dice.between(0.04, 0.06), dice.between(0.04, 0.06)] }
    } else {
        Shape::Disc { radius_m: dice.between(0.025, 0.04) }
    };
    let marker =
        if block { Shape::Rectangle { size_m: [0.018, 0.009] } } else { Shape::Disc { radius_m: 0.01 } };
    let marker = Some(Marker::centred(marker));
    Object { name: name.into(), shape, height_m: 0.04, marker, mass_kg: None, support: None }
}

fn cell() -> Cell {
    let camera = CameraSpec { exposure_s: Some(1e-4), ..CameraSpec::default() };
    let striker = Striker::rod(0.015, [0.1, 1.0]);
    Cell { camera, ..Cell::from_above(1000.0, Workspace::centred([1.2, 0.8]), striker) }
}

/// Scatter and error of predicted final places (m).
#[derive(Clone, Copy, Default)]
struct Quality {
    spread_m: f64,
    error_m: f64,
}

impl Quality {
    fn of(world: &World, learned: &Properties, piles: &[StruckPile]) -> Self {
        Self {
            spread_m: predictive_spread_m(learned, &world.objects, piles, (ROLLOUTS, 7)),
            error_m: estimate::prediction_error_m(learned, &world.truth, &world.objects, piles),
        }
    }
}

/// Before, after the advised clips, after random ones.
#[derive(Clone, Copy, Default)]
struct Comparison {
    before: Quality,
    advised: Quality,
    random: Quality,
    promised_m: f64,
}

fn compared(seed: u64, start: Start) -> Result<Comparison, String> {
    let world = World::new(seed);
    let mut dice = Draw::new(seed ^ 0x5eed);
    let text = |e: breakshot::Error| e.to_string();
    let clips = world.first_campaign(start, &mut dice)?;
    let first = estimate::estimation(&clips, &world.cell, &world.objects, &Options::default())
        .map_err(text)?
        .properties;
    let piles = estimate::struck_piles(&world.truth, &world.cell, &world.objects, (PILES, seed + 1000))
        .map_err(text)?;
    let options = AdviceOptions { clips: CLIPS, seed, scene: None };
    let advice = estimate::advice(&first, &world.cell, &world.objects, &options).map_err(text)?;
    let shots: Vec<Shot> = advice.clips.iter().map(|c| c.shot.clone()).collect();
    let quality = |learned: &Properties| Quality::of(&world, learned, &piles);
    let mut comparison = Comparison {
        before: quality(&first),
        advised: quality(&world.after(&first, &shots, &mut dice)?),
        promised_m: advice.clips.last().map_or(advice.spread_m, |c| c.spread_m),
        ..Comparison::default()
    };
    for _ in 0..RANDOM_DRAWS {
        let shots: Vec<Shot> = (0..CLIPS).map(|_| world.random_shot(&mut dice)).collect::<Result<_, _>>()?;
        let random = quality(&world.after(&first, &shots, &mut dice)?);
        comparison.random.spread_m += random.spread_m / RANDOM_DRAWS as f64;
        comparison.random.error_m += random.error_m / RANDOM_DRAWS as f64;
    }
    Ok(comparison)
}

/// Prints how much more ten advised clips shrink the uncertainty than ten random ones.
pub(crate) fn validate(cells: u64) -> Result<bool, String> {
    let mut holds = true;
    for (start, what) in [
        (Start::Few, "First campaign: every object alone, the first one into the others, two clips each"),
        (Start::EveryPair, "First campaign: every object alone twice, every pair once"),
    ] {
        let mut sum = Comparison::default();
        let mut better = 0;
        for seed in 1..=cells {
            let one = compared(seed, start)?;
            let add = |sum: &mut Quality, q: Quality| {
                sum.spread_m += q.spread_m / cells as f64;
                sum.error_m += q.error_m / cells as f64;
            };
            add(&mut sum.before, one.before);
            add(&mut sum.advised, one.advised);
            add(&mut sum.random, one.random);
            sum.promised_m += one.promised_m / cells as f64;
            better += u32::from(one.advised.spread_m < one.random.spread_m);
        }
        let Comparison { before, advised, random, promised_m } = sum;
        let [by_random, by_advised] = [random, advised].map(|q| 1e3 * (before.spread_m - q.spread_m));
        let wanted = (TIMES * by_random.max(0.0) * 1e3).round() / 1e3;
        let [less_by_random, less_by_advised] = [random, advised].map(|q| 1e3 * (before.error_m - q.error_m));
        holds &= row::print_all(
            &format!("{what} ({cells} cells)"),
            &[
                Row::plain("scatter of predicted final places before", before.spread_m * 1e3, "mm"),
                Row::plain("after ten random clips", random.spread_m * 1e3, "mm"),
                Row::plain("after ten advised clips", advised.spread_m * 1e3, "mm"),
                Row::plain("as the advice promised", promised_m * 1e3, "mm"),
                Row::plain("random clips shrink it by", by_random, "mm"),
                // Random clips may widen it: then anything that shrinks it is enough.
                Row::at_least("advised clips shrink it by", by_advised, wanted, "mm"),
                Row::plain("cells in which they do", f64::from(better), ""),
                Row::plain("error of predicted final places before", before.error_m * 1e3, "mm"),
                Row::plain("after ten random clips", random.error_m * 1e3, "mm"),
                Row::plain("after ten advised clips", advised.error_m * 1e3, "mm"),
                Row::plain("random clips shrink the error by", less_by_random, "mm"),
                Row::plain("advised clips shrink the error by", less_by_advised, "mm"),
            ],
        );
    }
    Ok(holds)
}
