//! The poses measured in a film: every object at rest before the strike and at rest after it.

use crate::detect::{Sample, Track, Tracks};
use crate::geometry::{Point, Vec2};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A pose measured in a film; serialized as `[x, y, yaw]`, with a null yaw where the marker shows none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "(f64, f64, Option<f64>)", into = "(f64, f64, Option<f64>)")]
pub struct ObservedPose {
    /// The centroid of the object.
    pub position: Point,
    /// The yaw (rad, counter-clockwise).
    pub yaw_rad: Option<f64>,
}

impl From<(f64, f64, Option<f64>)> for ObservedPose {
    fn from((x, y, yaw_rad): (f64, f64, Option<f64>)) -> Self {
        Self { position: Point::new(x, y), yaw_rad }
    }
}

impl From<ObservedPose> for (f64, f64, Option<f64>) {
    fn from(pose: ObservedPose) -> Self {
        (pose.position.x, pose.position.y, pose.yaw_rad)
    }
}

/// The poses of the objects of a film before and after the strike.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observed {
    /// The name of the film.
    pub video: String,
    /// The poses before the strike.
    pub before: BTreeMap<String, ObservedPose>,
    /// The poses after it.
    pub after: BTreeMap<String, ObservedPose>,
    /// The tracker's warnings, and the objects that still moved when the film ended.
    pub warnings: Vec<String>,
}

/// At most this many frames are averaged: the mean of 16 has a quarter of the noise of one.
const MOST_FRAMES: usize = 16;
/// An object is at rest while it stays within this many standard deviations of the position noise.
pub(super) const REST_SIGMAS: f64 = 5.0;
/// A drift below this (m) does not count as motion, however small the stated noise is.
const REST_M: f64 = 1e-4;
/// A film with fewer frames at rest at its end stopped too early.
const FEWEST_FRAMES: usize = 3;

impl Observed {
    /// The mean poses over the frames at rest at the beginning and at the end of the tracks.
    ///
    /// Objects without a sample are left out.
    pub fn from_tracks(tracks: &Tracks) -> Self {
        let mut observed =
            Self { video: tracks.video.clone(), warnings: tracks.warnings.clone(), ..Self::default() };
        for track in &tracks.tracks {
            let first = at_rest(clear_samples(track).into_iter());
            let last = at_rest(clear_samples(track).into_iter().rev());
            if let (Some(before), Some(after)) = (first, last) {
                observed.before.insert(track.object.clone(), before.pose);
                observed.after.insert(track.object.clone(), after.pose);
                if after.frames < FEWEST_FRAMES {
                    observed.warnings.push(format!("{} still moved when the film ended", track.object));
                }
            }
        }
        observed
    }
}

/// The samples that are not doubtful; all samples if every one is doubtful.
fn clear_samples(track: &Track) -> Vec<&Sample> {
    let clear: Vec<_> = track.samples.iter().filter(|s| !s.doubtful).collect();
    if clear.is_empty() { track.samples.iter().collect() } else { clear }
}

/// A mean pose over frames at rest.
struct Rest {
    pose: ObservedPose,
    frames: usize,
}

/// The mean over the first samples that stay at the position of the very first one.
fn at_rest<'a>(samples: impl Iterator<Item = &'a Sample>) -> Option<Rest> {
    let mut run: Vec<&Sample> = Vec::new();
    for sample in samples.take(MOST_FRAMES) {
        let first = *run.first().unwrap_or(&sample);
        let tolerance_m = REST_M.max(REST_SIGMAS * sample.noise_std_m().max(first.noise_std_m()));
        if first.position().distance(sample.position()) > tolerance_m {
            break;
        }
        run.push(sample);
    }
    let first = run.first()?;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let offsets: Vec<_> = run.iter().map(|s| s.position() - first.position()).collect();
    let mean_offset = offsets.iter().fold(Vec2::ZERO, |sum, &offset| sum + offset) / offsets.len() as f64;
    let yaws: Vec<f64> = run.iter().filter_map(|s| s.yaw_rad).collect();
    let yaw_rad = (!yaws.is_empty()).then(|| mean(&yaws));
    let pose = ObservedPose { position: first.position() + mean_offset, yaw_rad };
    Some(Rest { pose, frames: run.len() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(k: usize, x_m: f64) -> Sample {
        Sample::new(k as f64 / 60.0, Point::new(x_m, 0.0), Some(x_m), 2e-5)
    }

    fn tracks(x_m: &[f64]) -> Tracks {
        let samples = x_m.iter().enumerate().map(|(k, &x_m)| sample(k, x_m)).collect();
        Tracks { tracks: vec![Track { object: "a".into(), samples }], ..Tracks::default() }
    }

    #[test]
    fn the_frames_at_rest_are_averaged_and_those_in_motion_are_not() {
        let x_m: Vec<f64> = (0..30)
            .map(|k| match k {
                0..10 => 0.1 + if k % 2 == 0 { 4e-5 } else { -4e-5 },
                10..20 => 0.1 + 0.01 * f64::from(k - 9),
                _ => 0.25 + if k % 2 == 0 { 4e-5 } else { -4e-5 },
            })
            .collect();
        let observed = Observed::from_tracks(&tracks(&x_m));
        let (before, after) = (observed.before["a"], observed.after["a"]);
        assert!((before.position.x - 0.1).abs() < 1e-12, "{} m", before.position.x);
        assert!((after.position.x - 0.25).abs() < 1e-12, "{} m", after.position.x);
        assert!((after.yaw_rad.expect("a yaw") - 0.25).abs() < 1e-12);
        assert!(observed.warnings.is_empty());
    }

    #[test]
    fn a_film_that_ends_during_motion_causes_a_warning() {
        let x_m: Vec<f64> = (0..20).map(|k| 0.001 * f64::from(k)).collect();
        let observed = Observed::from_tracks(&tracks(&x_m));
        assert_eq!(observed.warnings, ["a still moved when the film ended"]);
    }

    #[test]
    fn a_pose_without_a_yaw_is_serialized_with_null() {
        let pose = ObservedPose { position: Point::new(0.5, -0.25), yaw_rad: None };
        let text = serde_json::to_string(&pose).expect("JSON");
        assert_eq!(text, "[0.5,-0.25,null]");
        assert_eq!(serde_json::from_str::<ObservedPose>(&text).expect("the same"), pose);
    }
}
