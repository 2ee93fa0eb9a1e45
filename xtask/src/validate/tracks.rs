//! Tracked positions against the lab's own.

use super::row::{Row, rms};
use super::truth::Truth;
use breakshot::detect::Tracks;
use breakshot::files;
use std::path::Path;

/// Position errors (m) of all clips.
#[derive(Default)]
pub(super) struct Errors {
    /// First and last positions.
    ends_m: Vec<f64>,
    /// Every frame whose exposure holds no impact.
    every_m: Vec<f64>,
    /// Angles of objects whose marker determines them (rad), modulo pi.
    angles_rad: Vec<f64>,
    /// Tracks that do not reach from the first to the last frame.
    pub(super) incomplete: Vec<String>,
}

/// How a film was taken.
#[derive(Clone, Copy)]
pub(super) struct Film {
    pub(super) frame_rate_hz: f64,
    /// An exposure whose middle is this close to an impact holds it (s).
    pub(super) near_impact_s: f64,
}

/// The campaign's films.
const CAMPAIGN: Film = Film { frame_rate_hz: 60.0, near_impact_s: NEAR_IMPACT_S };

/// An exposure this close to an impact holds it (s): half the lab's shutter time and half a contact.
const NEAR_IMPACT_S: f64 = 0.0025;

/// Compares every track in `folder` with the truth.
pub(crate) fn rows(truth: &Truth, folder: &Path) -> Result<Vec<Row>, String> {
    let mut errors = Errors::default();
    for (video, clip) in &truth.clips {
        let path = folder.join(video).with_extension("json");
        let tracks: Tracks = files::read_json(&path).map_err(|e| e.to_string())?;
        errors.add(video, &tracks, clip, CAMPAIGN);
    }
    for line in &errors.incomplete {
        println!("incomplete: {line}");
    }
    let worst = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
    Ok(vec![
        Row::at_most("tracks that miss their first or last frame", errors.incomplete.len() as f64, 0.0, ""),
        Row::at_most("first and last positions, rms", rms(&errors.ends_m) * 1e3, 0.15, "mm"),
        Row::at_most("first and last positions, worst", worst(&errors.ends_m) * 1e3, 0.5, "mm"),
        Row::at_most("every frame without an impact, rms", errors.every_rms_mm(), 0.08, "mm"),
        Row::at_most("angles of bar markers, rms", errors.angle_rms_deg(), 0.5, "deg"),
    ])
}

impl Errors {
    /// Position errors of every frame without an impact (mm, rms).
    pub(super) fn every_rms_mm(&self) -> f64 {
        rms(&self.every_m) * 1e3
    }

    /// Angle errors (degrees, rms).
    pub(super) fn angle_rms_deg(&self) -> f64 {
        rms(&self.angles_rad).to_degrees()
    }

    /// Compares the tracks of one clip with its truth.
    pub(super) fn add(&mut self, video: &str, tracks: &Tracks, clip: &super::truth::Clip, film: Film) {
        let impacts: Vec<f64> = clip.measured.impacts.iter().map(|i| i.time_s).collect();
        for (object, poses) in &clip.frames {
            match tracks.tracks.iter().find(|t| &t.object == object) {
                Some(track) => compare(
                    self,
                    &format!("{video} {object}"),
                    track,
                    &Filmed { poses, impacts: &impacts, film },
                ),
                None => self.incomplete.push(format!("{video} {object}: no track")),
            }
        }
    }
}

/// The truth about one object of a film.
struct Filmed<'a> {
    /// Its pose in every frame: x, y (m) and yaw (rad).
    poses: &'a [[f64; 3]],
    /// Times of all impacts (s).
    impacts: &'a [f64],
    film: Film,
}

fn compare(errors: &mut Errors, name: &str, track: &breakshot::detect::Track, filmed: &Filmed) {
    let &Filmed { poses, impacts, film } = filmed;
    let frame = |time_s: f64| (time_s * film.frame_rate_hz).round() as usize;
    let reached: Vec<usize> = track.samples.iter().map(|s| frame(s.time_s)).collect();
    if reached.first() != Some(&0) || reached.last() != Some(&(poses.len() - 1)) {
        errors.incomplete.push(format!(
            "{name}: frames {:?}..{:?} of {}",
            reached.first(),
            reached.last(),
            poses.len()
        ));
    }
    for (k, sample) in track.samples.iter().enumerate() {
        let Some(pose) = poses.get(reached[k]) else { continue };
        let error_m = (sample.x_m - pose[0]).hypot(sample.y_m - pose[1]);
        if k == 0 || k + 1 == track.samples.len() {
            errors.ends_m.push(error_m);
        }
        if impacts.iter().all(|t| (t - sample.time_s).abs() > film.near_impact_s) {
            errors.every_m.push(error_m);
            if let Some(yaw_rad) = sample.yaw_rad {
                let half_revolutions = ((yaw_rad - pose[2]) / std::f64::consts::PI).round();
                errors.angles_rad.push((yaw_rad - pose[2] - half_revolutions * std::f64::consts::PI).abs());
            }
        }
    }
}
