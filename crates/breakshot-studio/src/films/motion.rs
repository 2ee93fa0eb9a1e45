//! What was found in a film: outlines in the picture, distances, speeds and accelerations over time, impacts.

use super::clips::{finished_tracks, tracks, tracks_file};
use crate::jobs::Job;
use crate::project::Project;
use breakshot::campaign::{Campaign, Clip, Source};
use breakshot::capture::{Camera, Capture, Footage};
use breakshot::detect::{Sample, Tracks};
use breakshot::estimate::{self, ClipTracks};
use breakshot::geometry::{Pixel, Point, Pose};
use breakshot::object::{self, Shape};
use breakshot::{Error, Result};
use serde::Serialize;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What is known of a clip's motion.
#[derive(Serialize)]
pub(crate) struct Motion {
    objects: Vec<Tracked>,
    impacts: Vec<Impact>,
    /// What is doubtful, in words.
    warnings: Vec<String>,
}

/// One object through a film.
#[derive(Serialize)]
struct Tracked {
    name: String,
    samples: Vec<Shown>,
}

/// An object at one instant.
#[derive(Serialize)]
struct Shown {
    time_s: f64,
    /// Distance from its first position (m).
    distance_m: f64,
    speed_m_s: Option<f64>,
    acceleration_m_s2: Option<f64>,
    is_doubtful: bool,
    center_px: Option<Pixel>,
    /// Its outline in the picture; empty where its yaw is unknown and matters.
    outline_px: Vec<Pixel>,
}

#[derive(Serialize)]
struct Impact {
    time_s: f64,
    std_s: f64,
    /// The body that hits, if it is known.
    a: Option<String>,
    b: String,
    point_px: Option<Pixel>,
    restitution: Option<f64>,
}

/// The motion of a clip that has been tracked; none of another.
///
/// # Errors
/// Tracks that cannot be read, a film whose camera cannot be calibrated.
pub(crate) fn motion(project: &Project, campaign: &Campaign, clip: &Clip) -> Result<Option<Motion>> {
    let Some(tracks) = tracks(project, campaign, clip)? else { return Ok(None) };
    let camera = match &clip.source {
        Source::Film(path) => Some(Capture::of(Footage::open(path)?, &campaign.cell)?.camera),
        Source::Tracks { .. } => None,
    };
    let (impacts, mut warnings) = impacts(campaign, clip, &tracks, camera.as_ref());
    warnings.splice(0..0, tracks.warnings.iter().cloned());
    let objects = tracks.tracks.iter().map(|track| {
        let first = track.samples.first().map(Sample::position);
        let shown = |sample: &Sample| shown(campaign, camera.as_ref(), &track.object, first, sample);
        Tracked { name: track.object.clone(), samples: track.samples.iter().map(shown).collect() }
    });
    Ok(Some(Motion { objects: objects.collect(), impacts, warnings }))
}

fn shown(
    campaign: &Campaign,
    camera: Option<&Camera>,
    name: &str,
    first: Option<Point>,
    sample: &Sample,
) -> Shown {
    let object = object::find(&campaign.objects, name, "the clip").ok();
    let seen = camera.zip(object);
    let pixel = |point: Point| seen.map(|(camera, object)| camera.pixel_from_table(point, object.height_m));
    let pose = Pose { position: sample.position(), yaw_rad: sample.yaw_rad.unwrap_or(0.0) };
    let has_outline = |shape: &Shape| sample.yaw_rad.is_some() || matches!(shape, Shape::Disc { .. });
    let outline =
        object.filter(|object| has_outline(&object.shape)).map(|object| object.shape.outline_points());
    let on_table = outline.unwrap_or_default().into_iter().map(|point| pose.table_from_body(point));
    Shown {
        time_s: sample.time_s,
        distance_m: first.map_or(0.0, |first| first.distance(sample.position())),
        speed_m_s: sample.vx_m_s.zip(sample.vy_m_s).map(|(x, y)| x.hypot(y)),
        acceleration_m_s2: sample.ax_m_s2.zip(sample.ay_m_s2).map(|(x, y)| x.hypot(y)),
        is_doubtful: sample.doubtful,
        center_px: pixel(sample.position()),
        outline_px: on_table.filter_map(pixel).collect(),
    }
}

/// The impacts of the motion fit, and its remarks; a clip that cannot be fitted has none.
fn impacts(
    campaign: &Campaign,
    clip: &Clip,
    tracks: &Tracks,
    camera: Option<&Camera>,
) -> (Vec<Impact>, Vec<String>) {
    let (objects, strike) = (clip.objects.clone(), clip.strike.clone());
    let clip = ClipTracks { name: clip.name.clone(), objects, strike, tracks: tracks.clone() };
    let options = estimate::Options::default();
    let fitted = estimate::estimation(&[clip], &campaign.cell, &campaign.objects, &options);
    let Some(fit) = fitted.ok().and_then(|estimation| estimation.clips.into_iter().next()) else {
        return (Vec::new(), vec!["the motion of this clip cannot be fitted: no impacts are shown".into()]);
    };
    let height_m = |name: &str| object::find(&campaign.objects, name, "the clip").map_or(0.0, |o| o.height_m);
    let shown = |impact: &estimate::Impact| Impact {
        time_s: impact.time.value,
        std_s: impact.time.std,
        point_px: camera.map(|camera| camera.pixel_from_table(impact.point, height_m(&impact.b))),
        a: impact.a.clone(),
        b: impact.b.clone(),
        restitution: impact.restitution.map(|e| e.value),
    };
    (fit.impacts.iter().map(shown).collect(), fit.remarks)
}

/// The number of frames of a clip; infinite if its file does not hold it.
fn frame_count(clip: &Clip) -> f64 {
    let Source::Film(path) = &clip.source else { return f64::INFINITY };
    let count = Footage::open(path).ok().and_then(|footage| footage.frame_count());
    count.map_or(f64::INFINITY, |count| count as f64)
}

/// Tracks a clip and writes its tracks; the part that is done is that of the frames.
///
/// # Errors
/// A film that cannot be tracked, a folder that cannot be written.
pub(crate) fn track(
    project: &Project,
    campaign: &Campaign,
    clip: &Clip,
    job: &Job,
) -> Result<serde_json::Value> {
    let unnamed =
        || Error::invalid(&clip.name, "its name", "not that of a file", "a name without special characters");
    let file = tracks_file(project, campaign, &clip.name).ok_or_else(unnamed)?;
    if !job.goes_on(0.0) {
        return Err(Error::Stopped);
    }
    let (frames, done) = (frame_count(clip), AtomicUsize::new(0));
    let on_frame = move |job: &Job| {
        let read = done.fetch_add(1, Ordering::Relaxed);
        job.goes_on((read as f64 / frames).min(1.0));
    };
    finished_tracks(project, campaign, clip, (job, on_frame))?;
    if !job.goes_on(1.0) {
        return Err(Error::Stopped);
    }
    Ok(serde_json::json!({ "file": project.name(&file) }))
}
