//! Objects drafted from one picture beside the truth: `cargo xtask validate objects [SEEDS] --lab LAB`.
//!
//! `cells.py` of the lab draws each cell; odd seeds are easy cells, even ones hard. One picture shows all of its objects, apart from each
//! other. The heights are given as a user would: a first draft shows which object has which number, a second one is given their heights.

use super::Program;
use super::row::{self, Row, rms};
use crate::venv;
use breakshot::capture::{Capture, Footage};
use breakshot::files;
use breakshot::geometry::outline::Outline;
use breakshot::geometry::{Point, Pose};
use breakshot::object::{Marker, Object};
use breakshot::scene::Placed;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Default seeds.
pub(crate) const SEEDS: &str = "101-110";
/// A drafted object whose centre is further off than this (m) is another one.
const SAME_M: f64 = 0.015;

/// What was found in one picture or several.
#[derive(Default)]
struct Figures {
    objects: usize,
    found: usize,
    superfluous: usize,
    /// Root mean square distance of each found outline from the true one, about the same centroid (m).
    outlines_m: Vec<f64>,
    /// Error of each marker's place on its object (m).
    markers_m: Vec<f64>,
    missing_markers: usize,
}

/// A drafted object and where it lies.
type Drafted = (Object, Pose);

/// Measures the pictures of these seeds; whether every target holds.
pub(crate) fn validate(program: &Program, lab: &Path, seeds: &str) -> Result<bool, String> {
    let python = venv::python("lab", &venv::LAB)?;
    let mut all = Figures::default();
    for seed in parsed(seeds)? {
        let level = if seed % 2 == 1 { "easy" } else { "hard" };
        let folder = crate::example::target().join("validate/objects").join(format!("{seed}-{level}"));
        std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
        let mut command = Command::new(&python);
        command.arg("xtask/peers/drawn_picture.py").arg(lab).args([&seed.to_string(), level]).arg(&folder);
        venv::succeed(command.env("MUJOCO_GL", "osmesa"))?;
        let mut figures = Figures::default();
        figures.add(program, &folder)?;
        println!("{seed}-{level}: {}", figures.line());
        all.join(figures);
    }
    Ok(row::print_all("Objects from one picture", &all.rows()))
}

/// `3` or `3-9`, separated by commas.
fn parsed(seeds: &str) -> Result<Vec<u64>, String> {
    let mut all = Vec::new();
    for word in seeds.split(',') {
        let number = |text: &str| {
            text.parse::<u64>().map_err(|_| format!("`{word}` is no seed and no range of seeds"))
        };
        let (first, last) = word.split_once('-').unwrap_or((word, word));
        all.extend(number(first)?..=number(last)?);
    }
    Ok(all)
}

impl Figures {
    /// Adds the picture in a folder.
    fn add(&mut self, program: &Program, folder: &Path) -> Result<(), String> {
        let load = |path: &Path| files::load_objects(path).map(|l| l.value).map_err(|e| e.to_string());
        let truth = load(&folder.join("objects.toml"))?;
        let text = std::fs::read_to_string(folder.join("poses.json")).map_err(|e| e.to_string())?;
        let poses: BTreeMap<String, [f64; 3]> = serde_json::from_str(&text).map_err(|e| e.to_string())?;
        let truth: Vec<Drafted> = truth
            .into_iter()
            .filter_map(|object| {
                let [x, y, yaw_rad] = *poses.get(&object.name)?;
                Some((object, Pose::new(x, y, yaw_rad)))
            })
            .collect();
        self.objects += truth.len();
        let Ok(first) = drafted(program, folder, &[]) else { return Ok(()) };
        let second = drafted(program, folder, &heights(folder, &first, &truth)?)?;
        self.superfluous +=
            second.iter().filter(|(_, pose)| nearest(&truth, pose.position).is_none()).count();
        for true_one in &truth {
            match nearest(&second, true_one.1.position) {
                Some(found) => self.compare(found, true_one),
                None => println!("  `{}` is not found", true_one.0.name),
            }
        }
        Ok(())
    }

    fn compare(&mut self, (object, pose): &Drafted, (true_object, true_pose): &Drafted) {
        self.found += 1;
        // The camera's pose displaces both: the size and the form are compared about the same centroid.
        let at = Pose { position: true_pose.position, yaw_rad: pose.yaw_rad };
        let border = Outline::new(&true_object.shape, *true_pose);
        let points = object.shape.outline_points();
        let off_m: Vec<f64> =
            points.iter().map(|&p| border.border_distance_m(at.table_from_body(p))).collect();
        let mm = 1e3 * rms(&off_m);
        if mm > 0.3 {
            println!(
                "  `{}`: outline {mm:.2} mm off, {:?} for {:?}",
                true_object.name, object.shape, true_object.shape
            );
        }
        self.outlines_m.push(rms(&off_m));
        let Some(true_marker) = &true_object.marker else { return };
        let Some(marker) = &object.marker else {
            self.missing_markers += 1;
            println!("  `{}`: its marker is not found", true_object.name);
            return;
        };
        let places = |marker: &Marker, yaw_rad: f64| -> Vec<Point> {
            let dot = marker.dot.map(|dot| dot.at_m);
            [Some(marker.at_m), dot]
                .into_iter()
                .flatten()
                .map(|p| Point::ORIGIN + p.to_vec().rotated(yaw_rad))
                .collect()
        };
        let (found, given) = (places(marker, pose.yaw_rad), places(true_marker, true_pose.yaw_rad));
        if found.len() != given.len() {
            self.missing_markers += 1;
            println!("  `{}`: {} of {} spots of its marker", true_object.name, found.len(), given.len());
            return;
        }
        self.markers_m.extend(found.iter().zip(&given).map(|(a, b)| a.distance(*b)));
    }

    fn join(&mut self, other: Self) {
        self.objects += other.objects;
        self.found += other.found;
        self.superfluous += other.superfluous;
        self.missing_markers += other.missing_markers;
        self.outlines_m.extend(other.outlines_m);
        self.markers_m.extend(other.markers_m);
    }

    fn line(&self) -> String {
        let (outline, marker) = (worst(&self.outlines_m), worst(&self.markers_m));
        format!(
            "{} of {} objects, {} superfluous, outlines {:.3} mm (worst {:.3}), markers {:.3} mm (worst {:.3}), {} not found",
            self.found,
            self.objects,
            self.superfluous,
            1e3 * rms(&self.outlines_m),
            1e3 * outline,
            1e3 * rms(&self.markers_m),
            1e3 * marker,
            self.missing_markers
        )
    }

    fn rows(&self) -> Vec<Row> {
        let found = 100.0 * self.found as f64 / self.objects.max(1) as f64;
        let within = self.outlines_m.iter().filter(|&&off_m| off_m <= 0.3e-3).count();
        let fraction = 100.0 * within as f64 / self.objects.max(1) as f64;
        vec![
            Row::at_least(format!("objects found, of {}", self.objects), found, 100.0, "%"),
            Row::at_most("superfluous objects", self.superfluous as f64, 0.0, ""),
            Row::at_least("objects with an outline within 0.3 mm rms", fraction, 100.0, "%"),
            Row::at_most("worst outline, rms", 1e3 * worst(&self.outlines_m), 0.3, "mm"),
            Row::at_most("markers not found", self.missing_markers as f64, 0.0, ""),
            Row::at_most("worst place of a marker", 1e3 * worst(&self.markers_m), 0.2, "mm"),
        ]
    }
}

fn worst(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// The object at a place.
fn nearest(objects: &[Drafted], at: Point) -> Option<&Drafted> {
    let distance_m = |(_, pose): &&Drafted| pose.position.distance(at);
    let best = objects.iter().min_by(|a, b| distance_m(a).total_cmp(&distance_m(b)))?;
    (distance_m(&best) < SAME_M).then_some(best)
}

/// The heights, as a person measures them who sees in the picture which object has which number: where the camera is tilted, a draft at the
/// default height places a tall object beside where it stands.
fn heights(folder: &Path, first: &[Drafted], truth: &[Drafted]) -> Result<Vec<String>, String> {
    let cell = files::load_cell(folder.join("cell.toml")).map_err(|e| e.to_string())?;
    let picture = Footage::open(&folder.join("picture.png")).map_err(|e| e.to_string())?;
    let camera = Capture::of(picture, &cell).map_err(|e| e.to_string())?.camera;
    let mut heights = Vec::new();
    for (object, pose) in first {
        let pixel = camera.pixel_from_table(pose.position, object.height_m);
        let off_m = |(true_object, true_pose): &&Drafted| {
            camera.table_from_pixel(pixel, true_object.height_m).distance(true_pose.position)
        };
        let seen = truth.iter().min_by(|a, b| off_m(a).total_cmp(&off_m(b)));
        if let Some((true_object, _)) = seen.filter(|seen| off_m(seen) < SAME_M) {
            heights.push(format!("{}={}", object.name, true_object.height_m));
        }
    }
    Ok(heights)
}

/// The objects of the program's file, and where its table says that they lie.
fn drafted(program: &Program, folder: &Path, heights: &[String]) -> Result<Vec<Drafted>, String> {
    let paths: [PathBuf; 4] =
        ["cell.toml", "picture.png", "drafted.toml", "drafted.png"].map(|name| folder.join(name));
    let [cell, picture, output, figure] = paths.each_ref().map(|path| path.to_string_lossy());
    let mut args = vec!["objects", &cell, &picture, "-o", &output, "--figure", &figure, "--json"];
    args.extend(heights.iter().flat_map(|height| ["--height-m", height.as_str()]));
    let run = program.run(&args)?;
    let placed: Vec<Placed> = serde_json::from_str(&run.stdout).map_err(|e| format!("--json: {e}"))?;
    let objects = files::load_objects(&paths[2]).map_err(|e| e.to_string())?.value;
    let pose = |placed: &Placed| Pose { position: placed.position_m, yaw_rad: placed.yaw_rad };
    Ok(objects.into_iter().zip(placed.iter().map(pose)).collect())
}
