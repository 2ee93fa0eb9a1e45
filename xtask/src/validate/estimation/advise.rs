//! Do advised clips reduce the uncertainty of predictions more than random ones?  `cargo xtask validate advise [CELLS]`.
//!
//! On synthetic cells of random objects, ten clips are advised from a first campaign.  Those clips, and ten random ones, are
//! simulated with the true properties, noise and variation from clip to clip of the cell, and added to the estimate.  The
//! comparison is of rollouts of new piles with parameters drawn from the new estimates, and of the errors of their predicted
//! final positions: neither uses the formulas of the advice.

use crate::splitmix::Draw;
use crate::validate::row::{self, Row};
use breakshot::cell::{CameraSpec, Cell, Striker, Workspace};
use breakshot::estimate::{
    self, AdviceOptions, ClipTracks, Draws, Experiment, Options, Setup, SimulatedCamera, StruckPile,
    predictive_std_m,
};
use breakshot::object::{Marker, Object, Shape, pair_key};
use breakshot::properties::Properties;
use breakshot::uncertain::Estimate;

/// Default number of cells.
pub(crate) const CELLS: u64 = 12;
/// Number of clips that are advised, and that are drawn at random.
const CLIPS: usize = 10;
/// Required reduction of the uncertainty by advised clips over that by random ones.
const TIMES: f64 = 1.5;
/// Number of sets of ten random clips per cell; their mean is compared.
const RANDOM_DRAWS: u64 = 3;
/// Number of new piles for the comparison, and of rollouts of each.
const PILES: usize = 40;
const ROLLOUTS: usize = 60;
/// Standard deviation from clip to clip (relative).
const FRICTION_STD: f64 = 0.03;
const RESTITUTION_STD: f64 = 0.02;

/// A cell with known true properties.
struct World {
    cell: Cell,
    objects: Vec<Object>,
    truth: Properties,
}

/// The clips of the first campaign.
#[derive(Clone, Copy, PartialEq)]
enum Start {
    /// Every object alone twice, and the first object twice into every other one.
    Few,
    /// Every object alone twice, and every pair once.
    EveryPair,
}

impl World {
    fn new(seed: u64) -> Self {
        let mut random = Draw::new(seed);
        let names = ["a", "b", "c", "d", "e", "f"];
        let objects: Vec<Object> =
            names.iter().enumerate().map(|(k, name)| object(name, k, &mut random)).collect();
        let mut truth = Properties { version: 1, reference: "a".into(), ..Properties::default() };
        let value = Estimate::exact;
        for (k, a) in names.iter().enumerate() {
            truth.friction.insert((*a).into(), value(random.between(0.15, 0.4)));
            truth.striker_restitution.insert((*a).into(), value(random.between(0.4, 0.75)));
            let mass = if k == 0 { 1.0 } else { random.between(0.15f64.ln(), 2f64.ln()).exp() };
            truth.mass_ratio.insert((*a).into(), value(mass));
            for b in &names[k..] {
                truth.restitution.insert(pair_key(a, b), value(random.between(0.35, 0.8)));
            }
        }
        truth.contact_friction.objects = Some(value(random.between(0.1, 0.3)));
        truth.contact_friction.striker = Some(value(random.between(0.1, 0.3)));
        Self { cell: cell(), objects, truth }
    }

    /// The properties in one clip: friction varies equally for all objects, every restitution independently.
    fn of_one_clip(&self, random: &mut Draw) -> Properties {
        let mut properties = self.truth.clone();
        let scale = 1.0 + FRICTION_STD * random.normal();
        properties.friction.values_mut().for_each(|e| e.mean *= scale);
        for e in properties.restitution.values_mut().chain(properties.striker_restitution.values_mut()) {
            e.mean = (e.mean * (1.0 + RESTITUTION_STD * random.normal())).clamp(0.0, 1.0);
        }
        properties
    }

    fn filmed(&self, name: String, experiment: &Experiment, random: &mut Draw) -> Result<ClipTracks, String> {
        let camera = SimulatedCamera {
            frame_rate_hz: 60.0,
            position_std_m: 4e-5,
            yaw_std_rad: 0.004,
            seed: Some(random.bits()),
        };
        let properties = self.of_one_clip(random);
        experiment
            .simulated_clip(&name, Setup { cell: &self.cell, objects: &self.objects }, &properties, &camera)
            .map_err(|e| e.to_string())
    }

    /// A random experiment after which all objects lie in the workspace.
    fn random_experiment(&self, random: &mut Draw) -> Result<Experiment, String> {
        const TRIALS: usize = 100;
        for _ in 0..TRIALS {
            let n = self.objects.len();
            let struck = random.below(n);
            // Alone with the same probability as into each of the others.
            let into = Some(random.below(n)).filter(|k| *k != struck);
            let experiment = Experiment {
                strike: self.objects[struck].name.clone(),
                into: into.map(|k| self.objects[k].name.clone()),
                speed_m_s: (random.between(0.3, 0.8) * 1e3).round() / 1e3,
                offset_m: 0.0,
            };
            let clip = self.filmed(String::new(), &experiment, &mut Draw::new(0))?;
            let mut ends = clip.tracks.tracks.iter().filter_map(|t| t.samples.last());
            if ends.all(|s| self.cell.workspace.contains(s.position())) {
                return Ok(experiment);
            }
        }
        Err("no random experiment stays in the workspace".into())
    }

    fn first_campaign(&self, start: Start, random: &mut Draw) -> Result<Vec<ClipTracks>, String> {
        let experiment = |strike: usize, into: Option<usize>| Experiment {
            strike: self.objects[strike].name.clone(),
            into: into.map(|k| self.objects[k].name.clone()),
            speed_m_s: 0.5,
            offset_m: 0.0,
        };
        let n = self.objects.len();
        let mut experiments: Vec<Experiment> =
            (0..n).flat_map(|k| [experiment(k, None), experiment(k, None)]).collect();
        match start {
            Start::Few => {
                experiments.extend((1..n).flat_map(|k| [experiment(0, Some(k)), experiment(0, Some(k))]));
            }
            Start::EveryPair => {
                experiments.extend(
                    (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).map(|(i, j)| experiment(i, Some(j))),
                );
            }
        }
        experiments
            .iter()
            .enumerate()
            .map(|(k, s)| self.filmed(format!("first_{k}.mp4"), s, random))
            .collect()
    }

    /// The estimate after these experiments have been filmed too.
    fn after(
        &self,
        first: &Properties,
        experiments: &[Experiment],
        random: &mut Draw,
    ) -> Result<Properties, String> {
        let clips: Vec<ClipTracks> = (experiments.iter().enumerate())
            .map(|(k, s)| self.filmed(format!("next_{k}.mp4"), s, random))
            .collect::<Result<_, _>>()?;
        let estimation = estimate::updated(first, &clips, &self.cell, &self.objects, &Options::default());
        estimation.map(|e| e.properties).map_err(|e| e.to_string())
    }
}

fn object(name: &str, k: usize, random: &mut Draw) -> Object {
    // Every third object is a block with a bar marker, which shows the yaw.
    let block = k % 3 == 2;
    let shape = if block {
        Shape::Rectangle { size_m: [random.between(0.04, 0.06), random.between(0.04, 0.06)] }
    } else {
        Shape::Disc { radius_m: random.between(0.025, 0.04) }
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

/// Uncertainty and error of predicted final positions (m).
#[derive(Clone, Copy, Default)]
struct Quality {
    std_m: f64,
    error_m: f64,
}

impl Quality {
    fn of(world: &World, learned: &Properties, piles: &[StruckPile]) -> Self {
        Self {
            std_m: predictive_std_m(learned, &world.objects, piles, Draws { count: ROLLOUTS, seed: 7 }),
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
    predicted_m: f64,
}

fn compared(seed: u64, start: Start) -> Result<Comparison, String> {
    let world = World::new(seed);
    let mut random = Draw::new(seed ^ 0x5eed);
    let text = |e: breakshot::Error| e.to_string();
    let clips = world.first_campaign(start, &mut random)?;
    let first = estimate::estimation(&clips, &world.cell, &world.objects, &Options::default())
        .map_err(text)?
        .properties;
    let piles = estimate::struck_piles(
        &world.truth,
        &world.cell,
        &world.objects,
        Draws { count: PILES, seed: seed + 1000 },
    )
    .map_err(text)?;
    let options = AdviceOptions { clips: CLIPS, seed, scene: None };
    let advice = estimate::advice(&first, &world.cell, &world.objects, &options).map_err(text)?;
    let experiments: Vec<Experiment> = advice.clips.iter().map(|c| c.experiment.clone()).collect();
    let quality = |learned: &Properties| Quality::of(&world, learned, &piles);
    let mut comparison = Comparison {
        before: quality(&first),
        advised: quality(&world.after(&first, &experiments, &mut random)?),
        predicted_m: advice.clips.last().map_or(advice.spread_m, |c| c.spread_m),
        ..Comparison::default()
    };
    for _ in 0..RANDOM_DRAWS {
        let experiments: Vec<Experiment> =
            (0..CLIPS).map(|_| world.random_experiment(&mut random)).collect::<Result<_, _>>()?;
        let random = quality(&world.after(&first, &experiments, &mut random)?);
        comparison.random.std_m += random.std_m / RANDOM_DRAWS as f64;
        comparison.random.error_m += random.error_m / RANDOM_DRAWS as f64;
    }
    Ok(comparison)
}

/// Prints the reductions of uncertainty by ten advised and by ten random clips; whether the target holds.
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
                sum.std_m += q.std_m / cells as f64;
                sum.error_m += q.error_m / cells as f64;
            };
            add(&mut sum.before, one.before);
            add(&mut sum.advised, one.advised);
            add(&mut sum.random, one.random);
            sum.predicted_m += one.predicted_m / cells as f64;
            better += u32::from(one.advised.std_m < one.random.std_m);
        }
        let Comparison { before, advised, random, predicted_m } = sum;
        let [by_random, by_advised] = [random, advised].map(|q| 1e3 * (before.std_m - q.std_m));
        let wanted = (TIMES * by_random.max(0.0) * 1e3).round() / 1e3;
        let [less_by_random, less_by_advised] = [random, advised].map(|q| 1e3 * (before.error_m - q.error_m));
        holds &= row::print_all(
            &format!("{what} ({cells} cells)"),
            &[
                Row::plain(
                    "standard deviation of predicted final positions before",
                    before.std_m * 1e3,
                    "mm",
                ),
                Row::plain("after ten random clips", random.std_m * 1e3, "mm"),
                Row::plain("after ten advised clips", advised.std_m * 1e3, "mm"),
                Row::plain("as the advice predicted", predicted_m * 1e3, "mm"),
                Row::plain("random clips reduce it by", by_random, "mm"),
                // Random clips may increase it: then any reduction is enough.
                Row::at_least("advised clips reduce it by", by_advised, wanted, "mm"),
                Row::plain("cells in which they do better than random ones", f64::from(better), ""),
                Row::plain("error of predicted final positions before", before.error_m * 1e3, "mm"),
                Row::plain("after ten random clips", random.error_m * 1e3, "mm"),
                Row::plain("after ten advised clips", advised.error_m * 1e3, "mm"),
                Row::plain("random clips reduce the error by", less_by_random, "mm"),
                Row::plain("advised clips reduce the error by", less_by_advised, "mm"),
            ],
        );
    }
    Ok(holds)
}
