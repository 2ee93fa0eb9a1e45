//! The motions of a player as JSON in the page: whole numbers, the first and then differences, which are short where little moves.

use crate::detect::{Track, Tracks};
use crate::estimate::{BodyFit, ClipFit};
use crate::geometry::Pose;
use crate::object::{Marker, Shape};
use crate::physics::{EventKind, Trajectory};
use crate::report::figures::Viewport;
use serde::Serialize;

/// The name of the striker in a trajectory, and its class in drawings.
pub(super) const STRIKER: &str = "striker";
/// More frames of a film are thinned.
const MOST_FRAMES: usize = 400;
/// Times of a computed motion beside those of its events: an object that slides from 1 m/s to rest within ten seconds is at
/// most 0.014 mm from the lines between its poses at these times.
const TIMES: usize = 300;
/// More events are left out: a push is a series of impacts.
const MOST_EVENTS: usize = 200;
/// The units of the numbers: microseconds, tenths of a millimetre, milliradians.
const PER_S: f64 = 1e6;
const PER_M: f64 = 1e4;
const PER_RAD: f64 = 1e3;

/// The contents of a player's data element.
#[derive(Serialize)]
pub(super) struct PlayerData<'a> {
    pub view: View,
    pub bodies: Vec<Body<'a>>,
    pub motions: Vec<DrawnMotion>,
    pub events: &'a [Moment],
    /// Whether all motions have one time axis.
    pub is_aligned: bool,
    pub film_start_s: f64,
}

impl PlayerData<'_> {
    /// As JSON that no name in it can end early: without the characters that begin and end elements and entities.
    pub(super) fn json(&self) -> String {
        // Names, numbers and lists always have a text.
        let text = serde_json::to_string(self).unwrap_or_default();
        text.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
    }
}

/// The transformation from the table (m) to the drawing (px, y downwards).
#[expect(clippy::struct_field_names, reason = "names end in units")]
#[derive(Serialize)]
pub(super) struct View {
    left_m: f64,
    top_m: f64,
    px_per_m: f64,
}

impl View {
    pub(super) fn of(view: Viewport, width_px: f64) -> Self {
        let [left_m, top_m] = view.top_left_m();
        Self { left_m, top_m, px_per_m: view.px_per_m(width_px) }
    }
}

/// A body as it is drawn.
#[derive(Serialize)]
pub(super) struct Body<'a> {
    pub name: &'a str,
    pub class: String,
    pub shape: &'a Shape,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub marker: Option<&'a Marker>,
}

/// An impact or another event.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report::html) struct Moment {
    /// Time on the player's axis (s).
    pub time_s: f64,
    pub kind: EventKind,
    pub bodies: Vec<String>,
}

impl Moment {
    /// The events of a trajectory; at most the first two hundred.
    pub(in crate::report::html) fn of(trajectory: &Trajectory) -> Vec<Self> {
        let moment = |event: &crate::physics::Event| Self {
            time_s: event.time_s,
            kind: event.kind,
            bodies: event.bodies.clone(),
        };
        trajectory.events.iter().take(MOST_EVENTS).map(moment).collect()
    }

    /// The impacts of a fitted clip (time of the film).
    pub(in crate::report::html) fn of_fit(fit: &ClipFit) -> Vec<Self> {
        let moment = |impact: &crate::estimate::Impact| Self {
            time_s: impact.time.value,
            kind: EventKind::Impact,
            bodies: vec![impact.a.clone().unwrap_or_else(|| "something".into()), impact.b.clone()],
        };
        fit.impacts.iter().take(MOST_EVENTS).map(moment).collect()
    }
}

/// One frame of a body's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Frame {
    time_s: f64,
    pose: Pose,
    doubtful: bool,
}

/// The motion of one body.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BodyMotion {
    pub name: String,
    frames: Vec<Frame>,
    has_yaw: bool,
}

/// The motion of all bodies.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::report::html) struct Motion {
    /// `filmed`, `fitted` or `simulated`.
    pub kind: &'static str,
    /// Each frame of the film, or each so many.
    pub stride: usize,
    pub(super) tracks: Vec<BodyMotion>,
}

impl Motion {
    /// The tracks of a film, on an axis that begins at its time `start_s`.
    pub(in crate::report::html) fn filmed(tracks: &Tracks, start_s: f64) -> Self {
        let most = tracks.tracks.iter().map(|track| track.samples.len()).max().unwrap_or(0);
        let stride = most.div_ceil(MOST_FRAMES).max(1);
        let shown = tracks.tracks.iter().filter(|track| !track.samples.is_empty());
        Self { kind: "filmed", stride, tracks: shown.map(|track| filmed(track, start_s, stride)).collect() }
    }

    /// What is drawn, and which frames, as the caption of a player.
    pub(in crate::report::html) fn caption(&self, drawn: &str) -> String {
        match self.stride {
            0 | 1 => drawn.into(),
            stride => format!("{drawn} One of {stride} frames is shown."),
        }
    }

    /// A simulation.
    pub(in crate::report::html) fn simulated(trajectory: &Trajectory) -> Self {
        let events = trajectory.events.iter().map(|event| event.time_s);
        let times = times(0.0, trajectory.duration_s, events);
        let track = |name: &String| {
            let frame = |&time_s: &f64| Some(Frame::of(time_s, trajectory.pose(name, time_s)?));
            BodyMotion { name: name.clone(), frames: times.iter().filter_map(frame).collect(), has_yaw: true }
        };
        let tracks = trajectory.motions.keys().map(track).filter(|track| !track.frames.is_empty());
        Self { kind: "simulated", stride: 1, tracks: tracks.collect() }
    }

    /// The motion that was fitted to a clip, from its first frame to its last.
    pub(in crate::report::html) fn fitted(fit: &ClipFit, tracks: &Tracks) -> Self {
        let samples = || tracks.tracks.iter().flat_map(|track| &track.samples).map(|sample| sample.time_s);
        let (from_s, until_s) = (samples().fold(f64::INFINITY, f64::min), samples().fold(0.0, f64::max));
        let times = times(from_s, until_s, fit.impacts.iter().map(|impact| impact.time.value));
        let track = |body: &BodyFit| BodyMotion {
            name: body.object.clone(),
            frames: times.iter().map(|&time_s| Frame::of(time_s, body.motion(time_s).pose)).collect(),
            has_yaw: true,
        };
        Self { kind: "fitted", stride: 1, tracks: fit.bodies.iter().map(track).collect() }
    }

    /// The motion in the numbers of the page; bodies that are not drawn are left out.
    pub(super) fn of_bodies(&self, bodies: &[Body]) -> DrawnMotion {
        let mut clocks: Vec<Vec<i64>> = Vec::new();
        let mut tracks = Vec::new();
        for track in &self.tracks {
            let Some(body) = bodies.iter().position(|body| body.name == track.name) else { continue };
            let times = differences(track.frames.iter().map(|frame| frame.time_s * PER_S));
            let clock = clocks.iter().position(|clock| *clock == times).unwrap_or(clocks.len());
            if clock == clocks.len() {
                clocks.push(times);
            }
            tracks.push(DrawnTrack::of(track, body, clock));
        }
        DrawnMotion { kind: self.kind, clocks, tracks }
    }
}

impl Frame {
    fn of(time_s: f64, pose: Pose) -> Self {
        Self { time_s, pose, doubtful: false }
    }
}

/// The track of a film, thinned; where the yaw is not known the last known one holds.
fn filmed(track: &Track, start_s: f64, stride: usize) -> BodyMotion {
    let first_yaw_rad = track.samples.iter().find_map(|sample| sample.yaw_rad);
    let mut yaw_rad = first_yaw_rad.unwrap_or(0.0);
    let last = track.samples.len() - 1;
    let mut frames = Vec::new();
    for (k, sample) in track.samples.iter().enumerate() {
        yaw_rad = sample.yaw_rad.unwrap_or(yaw_rad);
        if k % stride == 0 || k == last {
            let pose = Pose { position: sample.position(), yaw_rad };
            frames.push(Frame { time_s: sample.time_s - start_s, pose, doubtful: sample.doubtful });
        }
    }
    BodyMotion { name: track.object.clone(), frames, has_yaw: first_yaw_rad.is_some() }
}

/// Times from one to another (s) in equal steps, and those of events between them.
fn times(from_s: f64, until_s: f64, events: impl Iterator<Item = f64>) -> Vec<f64> {
    let step = |k: usize| from_s + (until_s - from_s) * k as f64 / (TIMES - 1) as f64;
    let events = events.filter(|time_s| (from_s..=until_s).contains(time_s)).take(MOST_EVENTS);
    let mut times: Vec<f64> =
        (0..TIMES).map(step).chain(events).filter(|time_s| time_s.is_finite()).collect();
    times.sort_by(f64::total_cmp);
    times.dedup_by_key(|time_s| (*time_s * PER_S).round());
    times
}

/// One motion in the numbers of the page.
#[derive(Serialize)]
pub(super) struct DrawnMotion {
    pub kind: &'static str,
    /// Times (microseconds, differences), each of which several tracks share.
    clocks: Vec<Vec<i64>>,
    tracks: Vec<DrawnTrack>,
}

impl DrawnMotion {
    pub(super) fn is_empty(&self) -> bool {
        self.tracks.is_empty()
    }
}

/// One track in the numbers of the page.
#[derive(Serialize)]
struct DrawnTrack {
    body: usize,
    clock: usize,
    /// Positions (tenths of a millimetre, differences).
    x: Vec<i64>,
    y: Vec<i64>,
    /// Milliradians, differences; absent where the marker shows no yaw, and where it is zero throughout.
    #[serde(skip_serializing_if = "Option::is_none")]
    yaw: Option<Vec<i64>>,
    /// The numbers of doubtful frames.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    doubtful: Vec<usize>,
}

impl DrawnTrack {
    fn of(track: &BodyMotion, body: usize, clock: usize) -> Self {
        let frames = &track.frames;
        let yaw = differences(frames.iter().map(|frame| frame.pose.yaw_rad * PER_RAD));
        Self {
            body,
            clock,
            x: differences(frames.iter().map(|frame| frame.pose.position.x * PER_M)),
            y: differences(frames.iter().map(|frame| frame.pose.position.y * PER_M)),
            yaw: Some(yaw).filter(|yaw| track.has_yaw && yaw.iter().any(|value| *value != 0)),
            doubtful: (0..frames.len()).filter(|&k| frames[k].doubtful).collect(),
        }
    }
}

/// The first of these numbers and then their differences, after rounding: sums of them are the rounded numbers.
fn differences(values: impl Iterator<Item = f64>) -> Vec<i64> {
    let mut last = 0;
    let difference = |value: f64| {
        // Numbers that are none become zero, those that are too large the largest.
        let rounded = value.round() as i64;
        let difference = rounded.saturating_sub(last);
        last = rounded;
        difference
    };
    values.map(difference).collect()
}
