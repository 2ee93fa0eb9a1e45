//! Is contact friction learned well enough to predict strikes on piles?  `cargo xtask validate contact LAB [CELLS]`.
//!
//! Each drawn cell of the lab (`cells.py`) has its own objects, masses, friction and contact friction.  Its campaign is simulated
//! but not filmed: the tracks are the true motions with the noise of a camera, so that many cells can be measured in minutes.
//! Ten clips are advised and carried out in the lab, and planned strikes on random piles are simulated with the properties from
//! before and after, and with every contact friction in steps, of which the best is printed beside the lab's own.

use super::advised_films::{self, Films, Request, advised};
use super::altered::learned;
use super::saved::Saved;
use crate::validate::row::{self, Row, mean_and_worst, median};
use crate::validate::strikes::lab::{Lab, LabCell, Variation};
use crate::validate::strikes::{placed, planned};
use crate::validate::truth::Truth;
use crate::validate::{Program, scatter};
use crate::venv;
use breakshot::detect::{Sample, Track, Tracks};
use breakshot::estimate::ClipTracks;
use breakshot::files;
use breakshot::geometry::{Point, Pose};
use breakshot::object::kind;
use breakshot::physics;
use breakshot::plan::Method;
use breakshot::properties::Properties;
use breakshot::scene::{Goal, Placed, Scene, Strike};
use breakshot::uncertain::Estimate;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Default number of cells.
pub(crate) const CELLS: u64 = 12;
/// Clips of each cell's campaign, and piles that are struck.
const CLIPS: &str = "30";
const PILES: usize = 8;
/// The noise of the tracks: about that of the lab's films (m, rad).
const NOISE_M: f64 = 1e-4;
const NOISE_RAD: f64 = 4e-3;
/// The contact frictions that are tried, in steps.
const STEP: f64 = 0.025;
const STEPS: usize = 17;
/// How often each strike is repeated in the lab.
const REPEATS: usize = 4;
/// Largest accepted mean difference of pair distances after the advised clips (mm).
const MEAN_MM: f64 = 6.0;
/// The same for the lab's filmed strikes, and the largest accepted difference (mm).
const FILMED_MEAN_MM: f64 = 4.0;
const FILMED_WORST_MM: f64 = 12.0;
/// Accepted coverage of the effective contact friction (percent).
const COVERAGE_PERCENT: f64 = 90.0;

/// What the peer writes about the camera.
#[derive(Deserialize)]
struct Camera {
    fps: f64,
    /// Whether the marker of an object shows its yaw.
    yaw: BTreeMap<String, bool>,
}

/// The strikes on piles of one cell.
struct Outcomes {
    strikes: Vec<Outcome>,
}

type Poses = BTreeMap<String, Pose>;

/// A planned strike, as carried out in the lab.
struct Outcome {
    scene: Scene,
    strike: Strike,
    rest: Poses,
    /// Carried out again, with positions that are off by the noise of the tracks.
    repeated: Vec<Poses>,
}

/// What one cell showed.
struct Cell {
    /// The learned contact friction between objects: before and after the advised clips.
    learned: [Option<Estimate>; 2],
    /// The lab's nominal one, and the one that predicts best.
    nominal: f64,
    effective: f64,
    /// Mean difference of pair distances: before and after the advised clips, and with the effective contact friction (mm).
    mean_mm: [f64; 3],
    /// The same between executions of the same strike in the lab (mm).
    repeated_mm: f64,
}

/// Films ten advised clips of the lab's own cell, and predicts its filmed strikes on piles before and after; whether every target
/// holds.
pub(crate) fn advised_films(program: &Program, lab: &Path) -> Result<bool, String> {
    let [before, after] = advised_films::learned(program, &LabCell::own(lab))?;
    for (when, path) in [("Before", &before), ("After", &after)] {
        let learned = files::load_properties(path).map_err(|e| e.to_string())?.contact_friction;
        println!(
            "\n{when} the advised clips: contact friction {}, with the striker {}",
            shown(learned.objects),
            shown(learned.striker)
        );
    }
    let [before, after] = [before, after].map(|path| scatter::films(program, &lab.join("scatter"), &path));
    let (before, after) = (before?, after?);
    let rows = [
        Row::plain("mean difference of pair distances before", before.mean_mm, "mm"),
        Row::at_most("the same after the advised clips", after.mean_mm, FILMED_MEAN_MM, "mm"),
        Row::plain("largest difference before", before.worst_mm, "mm"),
        Row::at_most("the same after the advised clips", after.worst_mm, FILMED_WORST_MM, "mm"),
    ];
    Ok(row::print_all("The lab's filmed strikes on piles before and after ten advised clips", &rows))
}

/// Measures this many drawn cells; whether every target holds.
pub(crate) fn validate(lab: &Path, cells: u64) -> Result<bool, String> {
    let python = venv::python("lab", &venv::LAB)?;
    let mut measured = Vec::new();
    for seed in 1..=cells {
        let cell = cell(&python, lab, seed)?;
        let [before, after] = cell.learned.map(shown);
        let [mm_before, mm_after, mm_best] = cell.mean_mm;
        println!(
            "cell {seed}: {before}, after the advised clips {after}, the lab's {:.3}, predicts best {:.3}; mean {mm_before:.1}, {mm_after:.1}, {mm_best:.1} mm; repeated in the lab {:.1} mm",
            cell.nominal, cell.effective, cell.repeated_mm
        );
        measured.push(cell);
    }
    let given: Vec<(Estimate, f64)> =
        measured.iter().filter_map(|cell| Some((cell.learned[1]?, cell.effective))).collect();
    let covered =
        given.iter().filter(|(e, best)| (e.interval_95[0]..=e.interval_95[1]).contains(best)).count();
    let percent = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
    let means = |k: usize| median(measured.iter().map(|cell| cell.mean_mm[k]).collect());
    let within = measured.iter().filter(|cell| cell.mean_mm[1] <= MEAN_MM).count();
    let rows = [
        Row::plain(
            "cells with a contact friction before the advised clips",
            percent(measured.iter().filter(|c| c.learned[0].is_some()).count(), measured.len()),
            "%",
        ),
        Row::plain("cells with a contact friction after them", percent(given.len(), measured.len()), "%"),
        Row::at_least(
            "intervals with the friction that predicts best",
            percent(covered, given.len()),
            COVERAGE_PERCENT,
            "%",
        ),
        Row::plain("mean difference of pair distances before, median of the cells", means(0), "mm"),
        Row::at_most("the same after the advised clips", means(1), MEAN_MM, "mm"),
        Row::plain("the same with the friction that predicts best", means(2), "mm"),
        Row::plain(
            "the same between executions in the lab, positions off by 0.1 mm",
            median(measured.iter().map(|cell| cell.repeated_mm).collect()),
            "mm",
        ),
        Row::plain(
            "cells with a mean of at most 6 mm after the advised clips",
            percent(within, measured.len()),
            "%",
        ),
    ];
    Ok(row::print_all(&format!("Contact friction of {cells} drawn cells"), &rows))
}

fn shown(estimate: Option<Estimate>) -> String {
    estimate.map_or("not given".into(), |e| {
        format!("{:.3} ({:.3} to {:.3})", e.mean, e.interval_95[0], e.interval_95[1])
    })
}

fn cell(python: &Path, lab: &Path, seed: u64) -> Result<Cell, String> {
    let folder = motions(python, lab, seed)?;
    let saved = saved(&folder, &folder, seed)?;
    let before = learned(&saved, &saved.clips)?.properties;
    let drawn = LabCell::drawn(lab, &folder)?;

    // The advised clips
    let clips = folder.join("advised.json");
    std::fs::write(&clips, advised(&saved.campaign, &before)?.to_string()).map_err(|e| e.to_string())?;
    let advised = folder.join("advised");
    let request =
        Request { specification: &drawn.specification, clips: &clips, folder: &advised, films: Films::Empty };
    request.carry_out(python, lab)?;
    let more = self::saved(&advised, &folder, seed + 1)?;
    let all: Vec<ClipTracks> = saved.clips.iter().chain(&more.clips).cloned().collect();
    let after = learned(&saved, &all)?.properties;

    // Strikes on piles
    let outcomes = Outcomes::new(&drawn, &saved, &before)?;
    let with = |friction: f64| {
        let mut properties = after.clone();
        properties.contact_friction.objects = Some(Estimate::exact(friction));
        outcomes.mean_mm(&properties)
    };
    let tried: Vec<(f64, f64)> = (0..STEPS)
        .map(|k| k as f64 * STEP)
        .map(|friction| Ok((friction, with(friction)?)))
        .collect::<Result<_, String>>()?;
    let best = tried.iter().copied().min_by(|p, q| p.1.total_cmp(&q.1)).unwrap_or_default();
    let mean_mm = [outcomes.mean_mm(&before)?, outcomes.mean_mm(&after)?, best.1];
    outcomes.print(seed, &after)?;
    let learned = [before, after].map(|properties| properties.contact_friction.objects);
    let nominal = Truth::read(&folder)?.surface_friction.unwrap_or_default();
    Ok(Cell { learned, nominal, effective: best.0, mean_mm, repeated_mm: outcomes.repeated_mm() })
}

impl Outcomes {
    /// Plans robust strikes on random piles with these properties and carries them out.
    fn new(cell: &LabCell, saved: &Saved, properties: &Properties) -> Result<Self, String> {
        let mut lab = Lab::start(cell)?;
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let mut strikes = Vec::new();
        for (k, pile) in lab.piles(PILES, 1)?.into_iter().enumerate() {
            let scene = Scene {
                cell: saved.campaign.cell.clone(),
                objects: saved.campaign.objects.clone(),
                observed_unix_s: None,
                placed: placed(&pile.poses),
                walls: Vec::new(),
                keep_out: Vec::new(),
                goal: Goal::default(),
            };
            let plan = planned(&scene, properties, Method::Robust, k as u64).map_err(|e| e.to_string())?;
            let Some(strike) = plan.strike else { continue };
            let mut executed = |placed: &[Placed]| {
                let rest = lab.strike(placed, &strike, Variation { friction_scale: 1.0, seed: None })?;
                Ok::<_, String>(rest.map(|rest| rest.poses.into_iter().collect::<Poses>()))
            };
            let Some(rest) = executed(&scene.placed)? else { continue };
            let mut repeated = Vec::new();
            for _ in 0..REPEATS {
                let displaced = scene.placed.iter().cloned().map(|placed| displaced(placed, &mut random));
                repeated.extend(executed(&displaced.collect::<Vec<_>>())?);
            }
            strikes.push(Outcome { scene, strike, rest, repeated });
        }
        Ok(Self { strikes })
    }

    /// The mean difference of all pair distances between simulation and lab (mm).
    fn mean_mm(&self, properties: &Properties) -> Result<f64, String> {
        let errors_mm: Vec<Vec<f64>> =
            self.strikes.iter().map(|outcome| outcome.errors_mm(properties)).collect::<Result<_, _>>()?;
        Ok(mean_and_worst(&errors_mm.concat()).0)
    }

    /// The mean difference of all pair distances between a strike and its repetitions in the lab (mm).
    fn repeated_mm(&self) -> f64 {
        mean_and_worst(&self.strikes.iter().flat_map(Outcome::repeated_mm).collect::<Vec<_>>()).0
    }

    /// Prints how well each strike is predicted with these properties.
    fn print(&self, seed: u64, properties: &Properties) -> Result<(), String> {
        for (k, outcome) in self.strikes.iter().enumerate() {
            let (mean_mm, worst_mm) = mean_and_worst(&outcome.errors_mm(properties)?);
            println!(
                "cell {seed}, pile {}: {} objects, struck at {:.2} m/s, mean {mean_mm:.1}, worst {worst_mm:.1} mm; repeated in the lab {:.1} mm",
                k + 1,
                outcome.scene.placed.len(),
                outcome.strike.speed_m_s,
                mean_and_worst(&outcome.repeated_mm()).0
            );
        }
        Ok(())
    }
}

impl Outcome {
    /// The differences of the pair distances between simulation and lab (mm).
    fn errors_mm(&self, properties: &Properties) -> Result<Vec<f64>, String> {
        let simulated =
            physics::trajectory(&self.scene, properties, &self.strike, &physics::Options::default())
                .map_err(|e| e.to_string())?;
        Ok(differences_mm(&simulated.final_poses, &self.rest))
    }

    /// The differences of the pair distances between the repetitions and the strike in the lab (mm).
    fn repeated_mm(&self) -> Vec<f64> {
        self.repeated.iter().flat_map(|poses| differences_mm(poses, &self.rest)).collect()
    }
}

/// The differences of the pair distances of two final states (mm).
fn differences_mm(poses: &Poses, others: &Poses) -> Vec<f64> {
    let names: Vec<&String> = others.keys().collect();
    let pairs = names.iter().enumerate().flat_map(|(k, a)| names[k + 1..].iter().map(move |b| (*a, *b)));
    let apart = |poses: &Poses, a: &String, b: &String| poses[a].position.distance(poses[b].position);
    pairs.map(|(a, b)| 1e3 * (apart(poses, a, b) - apart(others, a, b))).collect()
}

/// An object whose position is off by the noise of the tracks.
fn displaced(placed: Placed, random: &mut Pcg64Mcg) -> Placed {
    let mut noise = || NOISE_M * random.sample::<f64, _>(StandardNormal);
    Placed { position_m: Point::new(placed.position_m.x + noise(), placed.position_m.y + noise()), ..placed }
}

/// The folder with the simulated campaign of a cell, which is drawn once.
fn motions(python: &Path, lab: &Path, seed: u64) -> Result<PathBuf, String> {
    let folder = crate::example::target().join("validate/drawn").join(seed.to_string());
    let mut command = Command::new(python);
    command.arg("xtask/peers/drawn_motions.py").args([
        lab,
        Path::new(&seed.to_string()),
        Path::new(CLIPS),
        &folder,
    ]);
    venv::succeed(&mut command)?;
    Ok(folder)
}

/// The campaign with the true motions as tracks, with noise.
fn saved(folder: &Path, drawn: &Path, seed: u64) -> Result<Saved, String> {
    let campaign = files::load_campaign(folder.join("campaign.toml")).map_err(|e| e.to_string())?.value;
    let truth = Truth::read(folder)?;
    let text = std::fs::read_to_string(drawn.join("camera.json")).map_err(|e| e.to_string())?;
    let camera: Camera = serde_json::from_str(&text).map_err(|e| e.to_string())?;
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let clips = campaign.clips.iter().map(|clip| {
        let video = clip.name.clone();
        let motion = truth.clips.get(&video).ok_or_else(|| format!("{video} has no truth"))?;
        let tracks = motion.frames.iter().map(|(object, frames)| {
            let kind = kind(object);
            let shows_yaw = camera.yaw.get(kind).copied().unwrap_or(false);
            let mut last_yaw = frames.first().map_or(0.0, |&[_, _, yaw]| yaw);
            let samples = frames.iter().enumerate().map(|(frame, &[x, y, yaw])| {
                // The lab writes yaws from -pi to pi; a track is continuous.
                last_yaw += (yaw - last_yaw + PI).rem_euclid(TAU) - PI;
                let mut noise = |std: f64| std * random.sample::<f64, _>(StandardNormal);
                let position = Point::new(x + noise(NOISE_M), y + noise(NOISE_M));
                let yaw_rad = shows_yaw.then(|| last_yaw + noise(NOISE_RAD));
                Sample::new(frame as f64 / camera.fps, position, yaw_rad, NOISE_M)
            });
            Track { object: object.clone(), samples: samples.collect() }
        });
        let tracks = Tracks { version: 1, video, tracks: tracks.collect(), ..Tracks::default() };
        Ok(ClipTracks {
            name: clip.name.clone(),
            objects: clip.objects.clone(),
            strike: clip.strike.clone(),
            tracks,
        })
    });
    let clips = clips.collect::<Result<_, String>>()?;
    Ok(Saved { campaign, clips })
}
