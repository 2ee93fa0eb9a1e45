//! *Breakshot* learns how objects slide and bounce from strike videos, and plans the one robot strike that singulates a pile.
//!
//! The whole flow, on the example that comes with the repository:
//!
//! ```
//! use breakshot::{capture::Decoder, clip_tracks, estimate, files, physics, plan};
//!
//! # fn main() -> breakshot::Result<()> {
//! # let example = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo");
//! // capture, detect: films -> the track of each object, in metres and seconds
//! let campaign = files::load_campaign(&example.join("campaign.toml"))?.value;
//! let clips = campaign.clips.iter().map(|clip| clip_tracks(&campaign, clip, Decoder::Auto));
//! let clips = clips.collect::<breakshot::Result<Vec<_>>>()?;
//!
//! // estimate: tracks -> friction, restitution and mass ratios with intervals
//! let options = estimate::Options::default();
//! let properties = estimate::estimation(&clips, &campaign.cell, &campaign.objects, &options)?.properties;
//! assert!((properties.friction["a"].mean - 0.235).abs() < 0.01, "{:?}", properties.friction["a"]);
//!
//! // plan: the strike after which every two objects of the pile are far enough apart
//! let pile = files::load_scene(&example.join("pile.scene.toml"))?.value;
//! let plan = plan::plan(&pile, &properties, &plan::Options::default())?;
//! let (strike, prediction) = plan.strike.zip(plan.prediction).expect("a strike that singulates the pile");
//!
//! // physics: what this strike does to the pile, from impact to impact
//! let trajectory = physics::trajectory(&pile, &properties, &strike, &physics::Options::default())?;
//! let min_distance_m = prediction.min_distance_m.expect("a pile of several objects");
//! assert!(min_distance_m >= pile.goal.min_distance_m, "{min_distance_m} m");
//! assert!(trajectory.duration_s < 2.0, "everything rests after {} s", trajectory.duration_s);
//! # Ok(()) }
//! ```
//!
//! [`robot::command`] turns the strike into a joint path of an arm, and [`verify::comparison`] compares a film of the strike with its prediction.
//! The stages in the order of the data flow, each a folder with one public function:
//!
//! | stage | question | answer |
//! |---|---|---|
//! | [`capture`] | what did the camera see, and from where? | [`Footage`], [`Camera`] |
//! | [`detect`] | where was each object at each instant? | [`Tracks`] |
//! | [`estimate`] | how do the objects slide and bounce? | [`Properties`] |
//! | [`physics`] | what does this strike do to this pile? | [`Trajectory`](physics::Trajectory) |
//! | [`plan`] | which strike singulates it? | [`Plan`](plan::Plan) |
//! | [`robot`] | how does the arm carry it out? | [`Command`](robot::Command) |
//! | [`verify`] | did it happen as predicted? | [`Report`](verify::Report) |
//! | [`report`] | how are the results shown to a person? | a page, figures, drawn frames |
//!
//! The other modules are the vocabulary that all stages share. All quantities are in SI units and radians, in the table frame (x to the
//! right, y up, z out of the table) unless their names say otherwise.

pub mod campaign;
pub mod capture;
pub mod cell;
pub mod columns;
pub mod detect;
mod encoding;
pub mod error;
pub mod estimate;
pub mod files;
mod fingerprint;
pub mod geometry;
pub mod object;
mod ordered_map;
pub mod physics;
pub mod plan;
pub mod properties;
pub mod report;
mod retiming;
pub mod robot;
pub mod scene;
mod statistics;
#[cfg(any(test, feature = "synthetic"))]
pub mod synthetic;
pub mod uncertain;
pub mod verify;
pub mod warning;

pub use error::{Error, Result};

use campaign::{Campaign, Clip, Source};
use capture::{Camera, Capture, Decoder, Footage, GreyImage, Pictures};
use detect::Tracks;
use estimate::ClipTracks;
use properties::Properties;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use warning::{Cause, Warning};

/// The tracks of one clip: opens its film, determines the pose of its camera, and tracks its objects; or reads its tracks.
///
/// # Errors
/// See [`Footage::open_with`], [`Capture::of`], [`detect::tracks`] and [`detect::recorded_tracks`].
pub fn clip_tracks(campaign: &Campaign, clip: &Clip, decoder: Decoder) -> Result<ClipTracks> {
    clip_tracks_until(campaign, clip, decoder, || false)
}

/// As [`clip_tracks`]; ends with [`Error::Stopped`] at the first frame at which `stopped` holds.
///
/// # Errors
/// As [`clip_tracks`].
pub fn clip_tracks_until(
    campaign: &Campaign,
    clip: &Clip,
    decoder: Decoder,
    stopped: impl Fn() -> bool + Send + 'static,
) -> Result<ClipTracks> {
    let tracks = match &clip.source {
        Source::Film(path) => {
            return footage_tracks(campaign, clip, Footage::open_with(path, decoder)?.until(stopped));
        }
        Source::Tracks { path, columns } => {
            let (name, text) = (path.display().to_string(), files::tracks_text(path)?);
            let (columns, frame_rate_hz) = (columns.as_deref(), clip.frame_rate_hz);
            let recording = detect::Recording { name: &name, text: &text, columns, frame_rate_hz };
            detect::recorded_tracks(&recording, &clip.objects, &campaign.cell.workspace)?
        }
    };
    of_clip(clip, tracks)
}

/// The tracks of one clip whose film is already open.
///
/// # Errors
/// See [`Capture::of`] and [`detect::tracks`].
pub fn footage_tracks(campaign: &Campaign, clip: &Clip, footage: Footage) -> Result<ClipTracks> {
    tracks_of(clip_capture(campaign, clip, footage)?, campaign, clip)
}

/// A clip with what its film shows.
#[derive(Debug)]
pub struct ViewedClip {
    /// The first frame and the camera; `None` for a clip without a film.
    pub first: Option<(GreyImage, Camera)>,
    /// The tracks, or the reason why there are none.
    pub tracks: Result<ClipTracks>,
    /// Whether all frames of the film were read.
    pub is_whole: bool,
}

/// As [`clip_tracks`], of these pictures of the film, also with the first frame and the camera, which are there without tracks too.
///
/// # Errors
/// A film that cannot be opened, or whose camera cannot be calibrated.
pub fn viewed_clip(
    campaign: &Campaign,
    clip: &Clip,
    decoder: Decoder,
    pictures: Pictures,
) -> Result<ViewedClip> {
    let Source::Film(path) = &clip.source else {
        let tracks = clip_tracks(campaign, clip, decoder);
        return Ok(ViewedClip { first: None, tracks, is_whole: true });
    };
    // A frame rate that is given is that of all frames.
    let is_retimed = clip.frame_rate_hz.or(campaign.cell.camera.frame_rate_hz).is_some();
    let pictures = if is_retimed { Pictures::All } else { pictures };
    let footage = Footage::open_pictures(path, decoder, pictures)?;
    let (frame_count, read) = (footage.frame_count(), Arc::new(AtomicUsize::new(0)));
    let counter = Arc::clone(&read);
    let footage = footage.observed(move |_| _ = counter.fetch_add(1, Ordering::Relaxed));
    let mut capture = clip_capture(campaign, clip, footage)?;
    let first = capture.footage.first_image().map(|image| (image, capture.camera.clone()));
    let tracks = tracks_of(capture, campaign, clip);
    let is_whole = frame_count.is_none_or(|count| read.load(Ordering::Relaxed) >= count);
    Ok(ViewedClip { first, tracks, is_whole })
}

fn clip_capture(campaign: &Campaign, clip: &Clip, footage: Footage) -> Result<Capture> {
    Capture::of(footage.at_frame_rate(clip.frame_rate_hz), &campaign.cell)
}

fn tracks_of(capture: Capture, campaign: &Campaign, clip: &Clip) -> Result<ClipTracks> {
    let options = detect::Options { strike: clip.strike.as_ref(), ..detect::Options::default() };
    let objects = &campaign.objects;
    let tracks = detect::tracks(capture, objects, &clip.objects, &layout(clip), &options)?;
    of_clip(clip, tracks)
}

/// The tracks of a clip, without the frames that it leaves out.
fn of_clip(clip: &Clip, mut tracks: Tracks) -> Result<ClipTracks> {
    for track in &mut tracks.tracks {
        let had_samples = !track.samples.is_empty();
        track.samples.retain(|sample| !clip.excludes(sample.time_s));
        if had_samples && track.samples.is_empty() {
            let found = format!("every frame of `{}`", track.object);
            let needed = "frames outside of the stretches, or `exclude = true` for the whole clip";
            return Err(Error::invalid(&clip.name, "exclude", found, needed));
        }
    }
    let (objects, strike) = (clip.objects.clone(), clip.strike.clone());
    Ok(ClipTracks { name: clip.name.clone(), objects, strike, tracks })
}

/// The tracks of all clips that can be read, and a warning for each of the others; clips are tracked in parallel.
///
/// # Errors
/// No clip can be read: the error of the last one. [`Error::Stopped`] where `tracks` was stopped.
pub fn campaign_tracks(
    campaign: &Campaign,
    tracks: impl Fn(&Clip) -> Result<ClipTracks> + Sync + Send,
) -> Result<(Vec<ClipTracks>, Vec<Warning>)> {
    let results: Vec<Result<ClipTracks>> = campaign.clips.par_iter().map(tracks).collect();
    let (mut clips, mut unreadable, mut last_error) = (Vec::new(), Vec::new(), None);
    for (clip, result) in campaign.clips.iter().zip(results) {
        match result {
            Ok(tracks) => clips.push(tracks),
            Err(Error::Stopped) => return Err(Error::Stopped),
            Err(error) => {
                unreadable.push(unreadable_clip(clip, &error));
                last_error = Some(error);
            }
        }
    }
    match last_error {
        Some(error) if clips.is_empty() => Err(error),
        _ => Ok((clips, unreadable)),
    }
}

/// The warning that a clip is left out for this reason.
pub fn unreadable_clip(clip: &Clip, error: &Error) -> Warning {
    let text = error.to_string();
    let reason = text.strip_prefix(&format!("{}: ", clip.name)).unwrap_or(&text);
    Warning::of_clip(Cause::Unreadable, &clip.name, format!("left out: {reason}"))
}

/// The properties that the clips of a campaign measure, together with the `old` ones if there are any, with all warnings: clips that could not
/// be read (what [`campaign_tracks`] gives), what the tracking of each clip found ([`track_warnings`]), and files that do not fit the films
/// ([`verify::campaign_warnings`]).
///
/// # Errors
/// See [`estimate::estimation`] and [`estimate::updated`].
pub fn campaign_properties(
    campaign: &Campaign,
    old: Option<&Properties>,
    clips: &[ClipTracks],
    unreadable: Vec<Warning>,
    options: &estimate::Options,
) -> Result<Properties> {
    let (cell, objects) = (&campaign.cell, &campaign.objects);
    let estimation = match old {
        Some(old) => estimate::updated(old, clips, cell, objects, options),
        None => estimate::estimation(clips, cell, objects, options),
    }?;
    let mut warnings = unreadable;
    warnings.extend(track_warnings(clips));
    warnings.extend(verify::campaign_warnings(clips, &estimation, cell, objects));
    warnings.extend(estimation.warnings);
    let mut properties = estimation.properties;
    properties.set_warnings(warnings);
    Ok(properties)
}

/// The warnings that the tracks of these clips contain: cameras that moved, and objects that were lost or found doubtfully.
pub fn track_warnings(clips: &[ClipTracks]) -> Vec<Warning> {
    let of_clip = |clip: &ClipTracks| {
        clip.tracks.causes().map(|(cause, text)| Warning::of_clip(cause, &clip.name, text)).collect()
    };
    clips.iter().flat_map::<Vec<Warning>, _>(of_clip).collect()
}

/// What is known of where the objects of a film lie.
fn layout(clip: &Clip) -> detect::Layout {
    let known = match (&clip.placed, &clip.strike) {
        (Some(placed), _) => detect::Layout::Placed(placed.clone()),
        (None, Some(strike)) => {
            detect::Layout::AlongStrike { heading_rad: strike.heading_rad, start_m: Some(strike.start_m) }
        }
        (None, None) => detect::Layout::Unknown,
    };
    if clip.starts.is_empty() {
        return known;
    }
    detect::Layout::Started { starts: clip.starts.clone(), others: Box::new(known) }
}
