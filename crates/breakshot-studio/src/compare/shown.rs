//! A comparison as the page shows it: the files of `breakshot verify`, with outlines in the picture.

use crate::pile::request::Cache;
use crate::project::{Project, TRACKS, TRAJECTORY};
use breakshot::capture::{Camera, Capture, Footage};
use breakshot::detect::{Sample, Track, Tracks};
use breakshot::geometry::Pose;
use breakshot::object::{self, Object, Shape};
use breakshot::physics::Trajectory;
use breakshot::report::{DifferenceReason, difference_reasons};
use breakshot::scene::Scene;
use breakshot::verify::{Divergence, Report};
use breakshot::{Error, Result, files};
use serde::Serialize;
use std::path::Path;

/// Positions that differ by less are equal (m): they are written with all digits.
const SAME_M: f64 = 1e-9;
/// Most positions, each with two outlines, that a page is given: ten objects for a hundred seconds at 60 Hz.
const MOST_SHOTS: usize = 60_000;

/// A comparison, with everything that its drawings need.
#[derive(Serialize)]
pub(crate) struct Shown {
    report: Report,
    trajectory: Trajectory,
    /// What the difference may come from.
    reasons: Vec<DifferenceReason>,
    /// Distance from which on an object has left its simulated motion (m).
    divergence_m: f64,
    /// The scene file from whose poses the simulation starts, and what is in it.
    scene_file: String,
    scene: Scene,
    /// The film, if it is in the project.
    film: Option<Film>,
    /// Time of the film at which the striker starts (s); 0 where film and simulation have no common time.
    start_s: f64,
    /// The times of the frames (s after that).
    frames_s: Vec<f64>,
    objects: Vec<Compared>,
}

/// The film of a comparison.
#[derive(Serialize)]
struct Film {
    name: String,
    size_px: [usize; 2],
}

/// One object, frame by frame; none where it was not found.
#[derive(Serialize)]
struct Compared {
    name: String,
    samples: Vec<Option<Shot>>,
}

/// An object in one frame, filmed and simulated.
#[derive(Serialize)]
struct Shot {
    /// s after the striker starts; the rolling shutter shows objects of one frame at different times.
    time_s: f64,
    position_m: [f64; 2],
    yaw_rad: Option<f64>,
    is_doubtful: bool,
    /// The filmed outline in the picture; empty where its yaw is unknown and matters, and without a film.
    outline_px: Vec<[f64; 2]>,
    /// The simulated outline in the picture at the same time; empty without a common time and without a film.
    simulated_px: Vec<[f64; 2]>,
}

/// The comparison of this report; its scene is found by the poses, its film by the name.
///
/// # Errors
/// A file that is not of the project or not valid, no scene with the poses of the report, a camera that cannot be calibrated.
pub(crate) fn shown(project: &Project, cache: &Cache, file: &str) -> Result<Shown> {
    let report_file = project.file(file)?;
    let report: Report = files::read_json(&report_file)?;
    let beside = |name: &str| {
        let file = report_file.with_file_name(name);
        project.file(&project.name(&file))
    };
    let trajectory: Trajectory = files::read_json(&beside(TRAJECTORY)?)?;
    let tracks: Tracks = files::read_json(&beside(TRACKS)?)?;
    let contents = project.contents();
    let (scene_file, scene) = scene_of(project, cache, &contents.scenes, &report)?;
    let name = Path::new(&report.video).file_name().unwrap_or_default();
    let film = contents.films.into_iter().find(|film| Path::new(film).file_name() == Some(name));
    let path = film.as_ref().map(|film| project.file(film)).transpose()?;
    let camera =
        path.as_ref().map(|path| Ok(Capture::of(Footage::open(path)?, &scene.cell)?.camera)).transpose()?;
    let times_s = frame_times_s(path.as_deref(), &scene, &tracks)?;
    let start_s = report.alignment.as_ref().map(|alignment| alignment.start_s);
    let view = View { scene: &scene, camera: camera.as_ref(), trajectory: &trajectory, start_s };
    // A film may show more than the objects of the scene.
    let of_scene: Vec<&Track> =
        tracks.tracks.iter().filter(|t| report.before.contains_key(&t.object)).collect();
    let shots = of_scene.len().saturating_mul(times_s.len());
    if shots > MOST_SHOTS {
        let found = format!("{} objects in {} frames", of_scene.len(), times_s.len());
        let needed = format!("at most {MOST_SHOTS} positions to be shown");
        return Err(Error::invalid(&report.video, "its length", found, needed));
    }
    let objects = of_scene.into_iter().map(|track| view.compared(track, &times_s)).collect();
    let start_s = start_s.unwrap_or(0.0);
    Ok(Shown {
        reasons: difference_reasons(&report, Some(&trajectory)),
        divergence_m: Divergence::LEAST_M,
        film: film.zip(camera).map(|(name, camera)| Film { name, size_px: camera.size_px }),
        frames_s: times_s.iter().map(|time_s| time_s - start_s).collect(),
        objects,
        start_s,
        scene_file,
        scene,
        report,
        trajectory,
    })
}

/// The scene whose poses are those from which the report measures the initial ones.
fn scene_of(project: &Project, cache: &Cache, scenes: &[String], report: &Report) -> Result<(String, Scene)> {
    for name in scenes {
        if let Ok(loaded) = cache.scene_file(project, name)
            && fits(&loaded.0, report)
        {
            return Ok((name.clone(), loaded.0.clone()));
        }
    }
    let needed = "a scene with the poses from which the strike was simulated; compare anew if it was changed";
    Err(Error::invalid(&report.video, "the scene of its report", "none in this folder", needed))
}

fn fits(scene: &Scene, report: &Report) -> bool {
    let is_there = |difference: &breakshot::verify::ObjectDifference| {
        let placed = scene.placed.iter().find(|placed| placed.object == difference.object);
        let before = report.before.get(&difference.object);
        placed.zip(before).is_some_and(|(placed, before)| {
            let error_m = placed.position_m.distance(before.position);
            (error_m - difference.placement_error_m).abs() < SAME_M
        })
    };
    scene.placed.len() == report.objects.len() && report.objects.iter().all(is_there)
}

/// The times of the frames (s): those of the longest track if it has a sample of each.
fn frame_times_s(film: Option<&Path>, scene: &Scene, tracks: &Tracks) -> Result<Vec<f64>> {
    let longest = tracks.tracks.iter().max_by_key(|track| track.samples.len());
    let of_track: Vec<f64> = longest.iter().flat_map(|track| &track.samples).map(|s| s.time_s).collect();
    let Some(path) = film else { return Ok(of_track) };
    let footage = Footage::open(path)?.at_frame_rate(scene.cell.camera.frame_rate_hz);
    if footage.frame_count() == Some(of_track.len()) {
        return Ok(of_track);
    }
    footage.map(|frame| Ok(frame?.time_s)).collect()
}

/// What the drawings of a comparison need.
struct View<'a> {
    scene: &'a Scene,
    camera: Option<&'a Camera>,
    trajectory: &'a Trajectory,
    /// None without a common time.
    start_s: Option<f64>,
}

impl View<'_> {
    fn compared(&self, track: &Track, times_s: &[f64]) -> Compared {
        let object = object::find(&self.scene.objects, &track.object, "the scene").ok();
        let has_all = track.samples.len() == times_s.len();
        let sample = |k: usize| if has_all { track.samples.get(k) } else { near(&track.samples, times_s, k) };
        let shot = |k: usize| sample(k).map(|sample| self.shot(&track.object, object, sample));
        Compared { name: track.object.clone(), samples: (0..times_s.len()).map(shot).collect() }
    }

    fn shot(&self, name: &str, object: Option<&Object>, sample: &Sample) -> Shot {
        let outline =
            |pose: Pose| self.camera.zip(object).map_or(Vec::new(), |(c, o)| outline_px(c, o, pose));
        let has_outline = |o: &Object| sample.yaw_rad.is_some() || matches!(o.shape, Shape::Disc { .. });
        let filmed = Pose { position: sample.position(), yaw_rad: sample.yaw_rad.unwrap_or(0.0) };
        let simulated = self.start_s.and_then(|start_s| self.trajectory.pose(name, sample.time_s - start_s));
        Shot {
            time_s: sample.time_s - self.start_s.unwrap_or(0.0),
            position_m: sample.position().into(),
            yaw_rad: sample.yaw_rad,
            is_doubtful: sample.doubtful,
            outline_px: if object.is_some_and(has_outline) { outline(filmed) } else { Vec::new() },
            simulated_px: simulated.map(outline).unwrap_or_default(),
        }
    }
}

/// The sample that is nearer to frame `k` than to the frames beside it.
fn near<'a>(samples: &'a [Sample], times_s: &[f64], k: usize) -> Option<&'a Sample> {
    let apart = |other: Option<&f64>| other.map_or(f64::INFINITY, |other| (other - times_s[k]).abs());
    let before = k.checked_sub(1).and_then(|before| times_s.get(before));
    let room_s = apart(before).min(apart(times_s.get(k + 1))) / 2.0;
    let first = samples.partition_point(|sample| sample.time_s <= times_s[k] - room_s);
    samples.get(first).filter(|sample| sample.time_s < times_s[k] + room_s)
}

/// An outline in the picture (px, rounded to hundredths): every third point of a disc's, of others every second one, among them the corners.
fn outline_px(camera: &Camera, object: &Object, pose: Pose) -> Vec<[f64; 2]> {
    let stride = if matches!(object.shape, Shape::Disc { .. }) { 3 } else { 2 };
    let points = object.shape.outline_points().into_iter().step_by(stride);
    let pixels = points.map(|point| camera.pixel_from_table(pose.table_from_body(point), object.height_m));
    let rounded = pixels.map(|pixel| [pixel.x, pixel.y].map(|v| (v * 100.0).round() / 100.0));
    rounded.filter(|[x, y]| x.is_finite() && y.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use breakshot::geometry::Point;

    #[test]
    fn a_frame_gets_the_sample_that_is_nearest_to_it_and_none_of_its_neighbours() {
        let times_s = [0.0, 0.1, 0.2, 0.3];
        let sample = |time_s: f64| Sample::new(time_s, Point::ORIGIN, None, 1e-5);
        // A rolling shutter shows an object a little later; in one frame it was not found.
        let samples = [sample(0.01), sample(0.11), sample(0.31)];
        let found: Vec<Option<f64>> =
            (0..4).map(|k| near(&samples, &times_s, k).map(|sample| sample.time_s)).collect();
        assert_eq!(found, [Some(0.01), Some(0.11), None, Some(0.31)]);
        assert_eq!(near(&samples[..1], &times_s[..1], 0).map(|sample| sample.time_s), Some(0.01));
    }
}
