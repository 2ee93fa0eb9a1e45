//! What the film saw: where every object lay before the strike, and where it came to rest.

use crate::detect::{Sample, Track, Tracks};
use crate::geometry::Point;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Where the film saw an object; written as `[x, y, yaw]`, yaw null where the marker cannot tell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "(f64, f64, Option<f64>)", into = "(f64, f64, Option<f64>)")]
pub struct Seen {
    /// Its centroid.
    pub position: Point,
    /// How it is turned (rad).
    pub yaw_rad: Option<f64>,
}

impl From<(f64, f64, Option<f64>)> for Seen {
    fn from((x, y, yaw_rad): (f64, f64, Option<f64>)) -> Self {
        Self { position: Point::new(x, y), yaw_rad }
    }
}

impl From<Seen> for (f64, f64, Option<f64>) {
    fn from(seen: Seen) -> Self {
        (seen.position.x, seen.position.y, seen.yaw_rad)
    }
}

/// Where the objects of a film lay before and after the strike.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observed {
    /// The film.
    pub video: String,
    /// Before the strike.
    pub before: BTreeMap<String, Seen>,
    /// After it.
    pub after: BTreeMap<String, Seen>,
    /// Objects that still moved when the film ended, and what the tracker warned of.
    pub warnings: Vec<String>,
}

/// So many frames are averaged at most: enough to take the noise down to a quarter.
const MOST_FRAMES: usize = 16;
/// An object rests while it stays within so many standard deviations of the noise.
const REST_SIGMAS: f64 = 5.0;
/// Drift below this is no motion, whatever the noise is said to be (m).
const REST_M: f64 = 1e-4;
/// With fewer frames at rest than this at its end, the film stopped too early.
const FEWEST_FRAMES: usize = 3;

impl Observed {
    /// From tracks: the average over the frames at rest at the film's beginning and at its end.
    ///
    /// Objects without a sample are left out.
    pub fn from_tracks(tracks: &Tracks) -> Self {
        let mut observed =
            Self { video: tracks.video.clone(), warnings: tracks.warnings.clone(), ..Self::default() };
        for track in &tracks.tracks {
            let first = at_rest(clear_samples(track).into_iter());
            let last = at_rest(clear_samples(track).into_iter().rev());
            if let (Some((before, _)), Some((after, frames))) = (first, last) {
                observed.before.insert(track.object.clone(), before);
                observed.after.insert(track.object.clone(), after);
                if frames < FEWEST_FRAMES {
                    observed.warnings.push(format!("{} still moved when the film ended", track.object));
                }
            }
        }
        observed
    }
}

/// The samples that nothing spoilt; all of them if none is.
fn clear_samples(track: &Track) -> Vec<&Sample> {
    let clear: Vec<_> = track.samples.iter().filter(|s| !s.doubtful).collect();
    if clear.is_empty() { track.samples.iter().collect() } else { clear }
}

/// The average over the first samples that stay in one place, and how many they are.
fn at_rest<'a>(samples: impl Iterator<Item = &'a Sample>) -> Option<(Seen, usize)> {
    let mut run: Vec<&Sample> = Vec::new();
    for sample in samples.take(MOST_FRAMES) {
        let place = *run.first().unwrap_or(&sample);
        let tolerance_m = REST_M.max(REST_SIGMAS * sample.std_m.max(place.std_m));
        if place.position().distance(sample.position()) > tolerance_m {
            break;
        }
        run.push(sample);
    }
    let first = run.first()?;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let ways: Vec<_> = run.iter().map(|s| s.position() - first.position()).collect();
    let middle = ways.iter().fold(crate::geometry::Vec2::ZERO, |sum, &way| sum + way) / ways.len() as f64;
    let yaws: Vec<f64> = run.iter().filter_map(|s| s.yaw_rad).collect();
    let yaw_rad = (!yaws.is_empty()).then(|| mean(&yaws));
    Some((Seen { position: first.position() + middle, yaw_rad }, run.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(k: usize, x_m: f64) -> Sample {
        Sample {
            time_s: k as f64 / 60.0,
            x_m,
            y_m: 0.0,
            yaw_rad: Some(x_m),
            vx_m_s: None,
            vy_m_s: None,
            yaw_rate_rad_s: None,
            ax_m_s2: None,
            ay_m_s2: None,
            std_m: 2e-5,
            doubtful: false,
        }
    }

    fn tracks(places: &[f64]) -> Tracks {
        let samples = places.iter().enumerate().map(|(k, &x_m)| sample(k, x_m)).collect();
        Tracks { tracks: vec![Track { object: "a".into(), samples }], ..Tracks::default() }
    }

    #[test]
    fn rest_is_averaged_and_motion_is_not() {
        let places: Vec<f64> = (0..30)
            .map(|k| match k {
                0..10 => 0.1 + if k % 2 == 0 { 4e-5 } else { -4e-5 },
                10..20 => 0.1 + 0.01 * f64::from(k - 9),
                _ => 0.25 + if k % 2 == 0 { 4e-5 } else { -4e-5 },
            })
            .collect();
        let observed = Observed::from_tracks(&tracks(&places));
        let (before, after) = (observed.before["a"], observed.after["a"]);
        assert!((before.position.x - 0.1).abs() < 1e-12, "{} m", before.position.x);
        assert!((after.position.x - 0.25).abs() < 1e-12, "{} m", after.position.x);
        assert!((after.yaw_rad.expect("a yaw") - 0.25).abs() < 1e-12);
        assert!(observed.warnings.is_empty());
    }

    #[test]
    fn a_film_that_ends_too_early_is_told() {
        let places: Vec<f64> = (0..20).map(|k| 0.001 * f64::from(k)).collect();
        let observed = Observed::from_tracks(&tracks(&places));
        assert_eq!(observed.warnings, ["a still moved when the film ended"]);
    }

    #[test]
    fn a_place_without_a_yaw_is_written_with_null() {
        let seen = Seen { position: Point::new(0.5, -0.25), yaw_rad: None };
        let text = serde_json::to_string(&seen).expect("JSON");
        assert_eq!(text, "[0.5,-0.25,null]");
        assert_eq!(serde_json::from_str::<Seen>(&text).expect("the same"), seen);
    }
}
