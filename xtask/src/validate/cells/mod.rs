//! Tracks and estimates of drawn cells beside the truth: `cargo xtask validate cells [SEEDS]`.
//!
//! `cells.py` of the lab draws each cell from a seed: its objects, markers, lamps, shadows, table, lens and camera. An easy cell is
//! what `docs/filming.md` asks for, a hard one what people have. The films are kept in `target/validate/cells`. The true poses of the same films
//! are estimated as well: what these miss is not due to the tracks. The velocities of the bodies themselves show the mass ratios only as far as an impact
//! exchanges no momentum with the table.

mod true_poses;

use super::Program;
use super::estimation::properties::pooled_rows;
use super::row::{self, Row, mean_and_worst, rms};
use super::truth::{Clip, Truth};
use crate::venv;
use breakshot::detect::{Sample, Tracks};
use breakshot::files;
use breakshot::object::Object;
use breakshot::properties::Properties;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Default seeds; each is drawn as an easy and as a hard cell.
pub(crate) const SEEDS: &str = "501-512";
/// Default number of films of each cell.
pub(crate) const CLIPS: u64 = 8;
/// A position further off than this (m), or a yaw (rad), is wrong ...
const WRONG_M: f64 = 0.5e-3;
const WRONG_RAD: f64 = 2.0 * PI / 180.0;
/// ... and one further off than this (m) is not the object.
const FAR_M: f64 = 2e-3;
/// Below this speed (m/s) an object is at rest.
const REST_M_S: f64 = 1e-3;
/// Half of the duration of the lab's contacts (s).
const HALF_CONTACT_S: f64 = 0.5e-3;

/// One cell to be drawn.
#[derive(Clone, Copy)]
struct Drawn {
    seed: u64,
    hard: bool,
}

/// What the lab writes about the camera.
#[derive(Deserialize)]
struct Camera {
    fps: f64,
    shutter_s: f64,
}

/// A mass ratio as the velocities of the bodies themselves show it.
#[derive(Deserialize)]
struct MassByVelocities {
    pair: [String; 2],
    log_ratio: f64,
    truth: f64,
}

impl MassByVelocities {
    /// Error of the logarithm.
    fn error(&self) -> f64 {
        self.log_ratio - self.truth
    }

    /// The product of the errors of two pairs that share one body, with the sign of an error of that body in both; `None` for other pairs.
    fn product(&self, other: &Self) -> Option<f64> {
        let sides = [(0, 0, 1.0), (1, 1, 1.0), (0, 1, -1.0), (1, 0, -1.0)];
        let shared: Vec<f64> = (sides.iter())
            .filter(|(own, others, _)| self.pair[*own] == other.pair[*others])
            .map(|(.., sign)| sign * self.error() * other.error())
            .collect();
        (shared.len() == 1).then(|| shared[0])
    }
}

/// What was found in one cell or several.
#[derive(Default)]
struct Figures {
    /// Object tracks, and those with a sample in every frame.
    tracks: usize,
    whole: usize,
    /// Samples outside impacts, those not doubtful, and of these those that are wrong.
    samples: usize,
    trusted: usize,
    wrong: usize,
    far: usize,
    /// Position errors of samples that are not doubtful (m).
    rest_m: Vec<f64>,
    moving_m: Vec<f64>,
    /// Position errors along each axis over the stated standard deviation.
    standardized: Vec<f64>,
    /// Objects with a marker that were struck, and those of them without friction or restitution against the striker.
    struck: usize,
    silent: Vec<String>,
    /// The same of objects without a marker.
    struck_bare: usize,
    silent_bare: Vec<String>,
    /// What was estimated in each cell, and the truth.
    learned: Vec<(Truth, Properties)>,
    /// The same from the true poses in place of the tracks.
    by_true_poses: Vec<(Truth, Properties)>,
    /// The mass ratios by the velocities of the bodies of each cell.
    masses_by_velocities: Vec<Vec<MassByVelocities>>,
}

/// Measures the cells of these seeds, each with at least this number of films; whether every target holds.
pub(crate) fn validate(program: &Program, lab: &Path, seeds: &str, clips: u64) -> Result<bool, String> {
    let python = venv::python("lab", &venv::LAB)?;
    let (mut easy, mut hard) = (Figures::default(), Figures::default());
    for drawn in parsed(seeds)? {
        let folder = filmed(&python, lab, drawn, clips)?;
        if Truth::read(&folder)?.clips.is_empty() {
            println!("{}: the lab finds no strike that it can film", drawn.name());
            continue;
        }
        let mut figures = Figures::default();
        figures.add(program, &folder, drawn)?;
        figures.masses_by_velocities.push(masses_by_velocities(&python, lab, &folder, drawn)?);
        println!("{}: {}", drawn.name(), figures.line());
        if drawn.hard { &mut hard } else { &mut easy }.join(figures);
    }
    for (title, figures) in [("Easy cells", &easy), ("Hard cells", &hard)] {
        if figures.tracks > 0 {
            figures.print(title);
        }
    }
    easy.join(hard);
    Ok(easy.print("All drawn cells"))
}

/// `3`, `3-easy`, `3-hard` or `3-9`, separated by commas.
fn parsed(seeds: &str) -> Result<Vec<Drawn>, String> {
    let mut drawn = Vec::new();
    for word in seeds.split(',') {
        let number =
            |text: &str| text.parse().map_err(|_| format!("`{word}` is no seed and no range of seeds"));
        let (first, rest) = word.split_once('-').unwrap_or((word, ""));
        let first: u64 = number(first)?;
        let levels: &[bool] = match rest {
            "easy" => &[false],
            "hard" => &[true],
            _ => &[false, true],
        };
        let last = if rest.is_empty() || levels.len() == 1 { first } else { number(rest)? };
        drawn.extend((first..=last).flat_map(|seed| levels.iter().map(move |&hard| Drawn { seed, hard })));
    }
    Ok(drawn)
}

impl Drawn {
    fn level(self) -> &'static str {
        if self.hard { "hard" } else { "easy" }
    }

    fn name(self) -> String {
        format!("{}-{}", self.seed, self.level())
    }
}

/// The folder with a cell's films, which are made if they are not there.
fn filmed(python: &Path, lab: &Path, drawn: Drawn, clips: u64) -> Result<PathBuf, String> {
    let folder = crate::example::target().join("validate/cells").join(drawn.name());
    let mut command = Command::new(python);
    command
        .arg("xtask/peers/drawn_films.py")
        .arg(lab)
        .arg(drawn.seed.to_string())
        .args([clips.to_string().as_str(), drawn.level()]);
    venv::succeed(command.arg(&folder).env("MUJOCO_GL", "osmesa"))?;
    Ok(folder)
}

/// The mass ratios that the velocities of the bodies of a cell show.
fn masses_by_velocities(
    python: &Path,
    lab: &Path,
    folder: &Path,
    drawn: Drawn,
) -> Result<Vec<MassByVelocities>, String> {
    let path = folder.join("momentum.json");
    if !path.exists() {
        let mut command = Command::new(python);
        command.arg("xtask/peers/drawn_momentum.py").arg(lab);
        command.arg(folder.join(format!("campaign_{}.json", drawn.seed))).arg(&path);
        venv::succeed(command.env("MUJOCO_GL", "osmesa"))?;
    }
    files::read_json(&path).map_err(|e| e.to_string())
}

/// The number of pairs of pairs of a cell that share a body, and the correlation of their errors, which have this standard deviation.
fn shared_body_correlation(cells: &[Vec<MassByVelocities>], std: f64) -> (usize, f64) {
    let products_in = |cell: &Vec<MassByVelocities>| -> Vec<f64> {
        let others = |(k, one): (usize, &MassByVelocities)| -> Vec<f64> {
            cell[..k].iter().filter_map(|other| one.product(other)).collect()
        };
        cell.iter().enumerate().flat_map(others).collect()
    };
    let products: Vec<f64> = cells.iter().flat_map(products_in).collect();
    let covariance = products.iter().sum::<f64>() / products.len().max(1) as f64;
    (products.len(), covariance / (std * std))
}

impl Figures {
    /// Adds the films of one cell.
    fn add(&mut self, program: &Program, folder: &Path, drawn: Drawn) -> Result<(), String> {
        // Tracks and properties, as a user would get them
        let output = program.output.join("cells-estimated").join(drawn.name());
        let tracks = output.join("tracks");
        if tracks.exists() {
            std::fs::remove_dir_all(&tracks).map_err(|e| e.to_string())?;
        }
        std::fs::create_dir_all(&output).map_err(|e| e.to_string())?;
        let (campaign, properties) = (folder.join("campaign.toml"), output.join("properties.json"));
        let refused = program.estimate(&campaign, &properties, &tracks).err();

        // Beside the truth
        let text = std::fs::read_to_string(folder.join("camera.json")).map_err(|e| e.to_string())?;
        let camera: Camera = serde_json::from_str(&text).map_err(|e| e.to_string())?;
        let campaign = files::load_campaign(&campaign).map_err(|e| e.to_string())?.value;
        let truth = Truth::read(folder)?;
        let learned = match refused {
            None => Some(files::load_properties(&properties).map_err(|e| e.to_string())?),
            Some(reason) => {
                println!("{}: {reason}", drawn.name());
                None
            }
        };
        let mut struck: BTreeSet<&str> = BTreeSet::new();
        for clip in &campaign.clips {
            let video = clip.name.clone();
            struck.extend(clip.objects.first().map(|name| breakshot::object::kind(name)));
            let path = tracks.join(&video).with_extension("json");
            let found: Option<Tracks> = files::read_json(&path).ok();
            let name = format!("{} {video}", drawn.name());
            let film = Film { name, camera: &camera, clip: &truth.clips[&video], objects: &campaign.objects };
            for object in film.clip.frames.keys() {
                let track = found.as_ref().and_then(|f| f.tracks.iter().find(|t| &t.object == object));
                self.compare(&film, object, track.map(|t| &t.samples[..]));
            }
        }
        let known = |values: &BTreeMap<String, _>, name: &str| values.contains_key(name);
        let is_silent = |name: &&&str| {
            !learned.as_ref().is_some_and(|p| known(&p.friction, name) && known(&p.striker_restitution, name))
        };
        let has_marker = |name: &&str| campaign.objects.iter().any(|o| &o.name == name && o.marker.is_some());
        let (marked, bare): (Vec<&str>, Vec<&str>) = struck.into_iter().partition(has_marker);
        let silent = |names: &[&str]| {
            names.iter().filter(is_silent).map(|name| format!("{} {name}", drawn.name())).collect()
        };
        (self.struck, self.silent) = (marked.len(), silent(&marked));
        (self.struck_bare, self.silent_bare) = (bare.len(), silent(&bare));
        self.learned.extend(learned.map(|properties| (truth.clone(), properties)));
        let by_true_poses =
            true_poses::properties(program, folder, &truth.clips, camera.fps, &output.join("true-poses"))?;
        self.by_true_poses.extend(by_true_poses.map(|properties| (truth, properties)));
        Ok(())
    }

    /// Compares one track with the object's true poses.
    fn compare(&mut self, film: &Film, object: &str, samples: Option<&[Sample]>) {
        let (name, poses) = (format!("{} {object}", film.name), &film.clip.frames[object]);
        self.tracks += 1;
        let Some(samples) = samples else {
            println!("{name}: no track");
            return;
        };
        let frame = |sample: &Sample| (sample.time_s * film.camera.fps).round() as usize;
        let mut seen: Vec<usize> = samples.iter().map(frame).filter(|&k| k < poses.len()).collect();
        seen.dedup();
        if seen.len() == poses.len() {
            self.whole += 1;
        } else {
            println!("{name}: {} of {} frames", seen.len(), poses.len());
        }
        let (mut wrong, mut doubtful) = (Vec::new(), 0);
        for sample in samples {
            let k = frame(sample);
            let Some(pose) = poses.get(k) else { continue };
            if film.holds_impact(object, sample.time_s) {
                continue;
            }
            self.samples += 1;
            if sample.doubtful {
                doubtful += 1;
                continue;
            }
            self.trusted += 1;
            let (dx, dy) = (sample.x_m - pose[0], sample.y_m - pose[1]);
            let off_m = dx.hypot(dy);
            let turned_rad = sample.yaw_rad.map_or(0.0, |yaw_rad| film.turned_rad(object, yaw_rad - pose[2]));
            if off_m > WRONG_M || turned_rad > WRONG_RAD {
                wrong.push(format!("{k}: {:.1} mm {:.0} deg", 1e3 * off_m, turned_rad.to_degrees()));
            }
            self.far += usize::from(off_m > FAR_M);
            let moving = film.speed_m_s(poses, k) > REST_M_S;
            if moving { &mut self.moving_m } else { &mut self.rest_m }.push(off_m);
            self.standardized.extend([dx / sample.std_m, dy / sample.std_m]);
        }
        self.wrong += wrong.len();
        if !wrong.is_empty() || doubtful * 4 > samples.len() {
            let first: Vec<String> = wrong.iter().take(3).cloned().collect();
            println!(
                "{name}: {doubtful} of {} doubtful, {} wrong ({})",
                samples.len(),
                wrong.len(),
                first.join(", ")
            );
        }
    }

    fn join(&mut self, other: Self) {
        self.tracks += other.tracks;
        self.whole += other.whole;
        self.samples += other.samples;
        self.trusted += other.trusted;
        self.wrong += other.wrong;
        self.far += other.far;
        self.struck += other.struck;
        self.struck_bare += other.struck_bare;
        self.silent_bare.extend(other.silent_bare);
        self.rest_m.extend(other.rest_m);
        self.moving_m.extend(other.moving_m);
        self.standardized.extend(other.standardized);
        self.silent.extend(other.silent);
        self.learned.extend(other.learned);
        self.by_true_poses.extend(other.by_true_poses);
        self.masses_by_velocities.extend(other.masses_by_velocities);
    }

    /// Prints the rows; whether every target holds. What the true poses miss does not count.
    fn print(&self, title: &str) -> bool {
        let all_hold = row::print_all(title, &self.rows());
        row::print_all(
            &format!("{title}, the true poses in place of the tracks"),
            &pooled_rows(&self.by_true_poses),
        );
        row::print_all(
            &format!("{title}, the velocities of the lab's bodies in place of positions"),
            &self.momentum_rows(),
        );
        all_hold
    }

    fn line(&self) -> String {
        let silent = [self.silent.as_slice(), self.silent_bare.as_slice()].concat();
        format!(
            "{} of {} tracks whole, {} of {} frames wrong, {} far off, {} doubtful; rms {:.3} mm at rest, {:.3} mm moving, spread {:.2}; silent: {}",
            self.whole,
            self.tracks,
            self.wrong,
            self.trusted,
            self.far,
            self.samples - self.trusted,
            1e3 * rms(&self.rest_m),
            1e3 * rms(&self.moving_m),
            rms(&self.standardized),
            if silent.is_empty() { "none".into() } else { silent.join(", ") }
        )
    }

    fn momentum_rows(&self) -> Vec<Row> {
        let log_errors: Vec<f64> =
            self.masses_by_velocities.iter().flatten().map(MassByVelocities::error).collect();
        let errors: Vec<f64> = log_errors.iter().map(|error| error.exp() - 1.0).collect();
        let (mean, worst) = mean_and_worst(&errors);
        let (pairs_of_pairs, correlation) =
            shared_body_correlation(&self.masses_by_velocities, rms(&log_errors));
        vec![
            Row::plain(
                format!("mass ratio of a first impact: mean error of {}", errors.len()),
                100.0 * mean,
                "%",
            ),
            Row::plain("mass ratio of a first impact: worst error", 100.0 * worst, "%"),
            Row::plain(
                format!("correlation of their errors in {pairs_of_pairs} pairs of pairs that share a body"),
                correlation,
                "",
            ),
        ]
    }

    fn rows(&self) -> Vec<Row> {
        let percent = |part: usize, all: usize| 100.0 * part as f64 / all.max(1) as f64;
        let spread = rms(&self.standardized);
        let mut rows = vec![
            Row::at_least(
                format!("whole tracks, of {}", self.tracks),
                percent(self.whole, self.tracks),
                97.0,
                "%",
            ),
            Row::plain("doubtful samples", percent(self.samples - self.trusted, self.samples), "%"),
            Row::at_most(
                "samples off by 0.5 mm or 2 degrees, not doubtful",
                percent(self.wrong, self.trusted),
                0.1,
                "%",
            ),
            Row::at_most("samples off by 2 mm, not doubtful", self.far as f64, 0.0, ""),
            Row::at_most("positions at rest, rms", 1e3 * rms(&self.rest_m), 0.10, "mm"),
            Row::at_most("positions while moving, rms", 1e3 * rms(&self.moving_m), 0.20, "mm"),
            Row::at_least("errors over their standard deviation, rms", spread, 0.7, ""),
            Row::at_most("errors over their standard deviation, rms", spread, 1.5, ""),
            Row::at_most(
                format!("struck objects with a marker and without a value, of {}", self.struck),
                self.silent.len() as f64,
                0.0,
                "",
            ),
            Row::plain(
                format!("struck objects without marker and value, of {}", self.struck_bare),
                self.silent_bare.len() as f64,
                "",
            ),
        ];
        rows.extend(pooled_rows(&self.learned));
        rows
    }
}

/// A film, its truth and the objects in it.
struct Film<'a> {
    /// The cell and the file.
    name: String,
    camera: &'a Camera,
    clip: &'a Clip,
    objects: &'a [Object],
}

impl Film<'_> {
    /// Whether the exposure in the middle of which this time is holds an impact of the object.
    fn holds_impact(&self, object: &str, time_s: f64) -> bool {
        let reach_s = self.camera.shutter_s / 2.0 + HALF_CONTACT_S;
        let impacts = self.clip.measured.impacts.iter();
        impacts.filter(|i| i.pair.iter().any(|n| n == object)).any(|i| (i.time_s - time_s).abs() < reach_s)
    }

    /// The size of a rotation after which the marker, or the outline without one, looks different (rad).
    fn turned_rad(&self, object: &str, turned_rad: f64) -> f64 {
        let kind = breakshot::object::kind(object);
        let object = self.objects.iter().find(|o| o.name == kind);
        let period_rad = match object.map(|o| (&o.marker, &o.shape)) {
            Some((Some(marker), _)) if marker.dot.is_some() => TAU,
            Some((Some(_), _)) => PI,
            Some((None, shape)) => shape.rotation_symmetry_rad().unwrap_or(TAU),
            None => TAU,
        };
        let turns = if period_rad > 0.0 { (turned_rad / period_rad).round() } else { 0.0 };
        if period_rad > 0.0 { (turned_rad - turns * period_rad).abs() } else { 0.0 }
    }

    /// The true speed around a frame (m/s).
    fn speed_m_s(&self, poses: &[[f64; 3]], k: usize) -> f64 {
        let (first, last) = (k.saturating_sub(1), (k + 1).min(poses.len() - 1));
        let (from, to) = (poses[first], poses[last]);
        (to[0] - from[0]).hypot(to[1] - from[1]) * self.camera.fps / (last - first).max(1) as f64
    }
}
