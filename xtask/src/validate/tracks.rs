//! Tracked positions against the lab's own.

use super::row::Row;
use super::truth::Truth;
use breakshot::detect::Tracks;
use breakshot::files;
use std::path::Path;

/// Position errors (m) of all clips.
#[derive(Default)]
struct Errors {
    /// First and last positions.
    ends_m: Vec<f64>,
    /// Every frame whose exposure holds no impact.
    every_m: Vec<f64>,
    /// Angles of objects whose marker tells them (rad), modulo half a turn.
    angles_rad: Vec<f64>,
    /// Tracks that do not reach from the first to the last frame.
    incomplete: Vec<String>,
}

/// An exposure this close to an impact holds it (s): half the lab's shutter time and half a contact.
const NEAR_IMPACT_S: f64 = 0.0025;

/// Compares every track in `folder` with the truth.
pub(crate) fn rows(truth: &Truth, folder: &Path) -> Result<Vec<Row>, String> {
    let mut errors = Errors::default();
    for (video, clip) in &truth.clips {
        let path = folder.join(video).with_extension("json");
        let tracks: Tracks = files::read_json(&path).map_err(|e| e.to_string())?;
        for (object, poses) in &clip.frames {
            let Some(track) = tracks.tracks.iter().find(|t| &t.object == object) else {
                errors.incomplete.push(format!("{video} {object}: no track"));
                continue;
            };
            let impacts: Vec<f64> = clip.measured.impacts.iter().map(|i| i.time_s).collect();
            compare(&mut errors, &format!("{video} {object}"), track, (poses, &impacts));
        }
    }
    for line in &errors.incomplete {
        println!("incomplete: {line}");
    }
    let rms = |v: &[f64]| (v.iter().map(|e| e * e).sum::<f64>() / v.len().max(1) as f64).sqrt();
    let worst = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
    Ok(vec![
        Row::at_most("tracks that miss their first or last frame", errors.incomplete.len() as f64, 0.0, ""),
        Row::at_most("first and last positions, rms", rms(&errors.ends_m) * 1e3, 0.15, "mm"),
        Row::at_most("first and last positions, worst", worst(&errors.ends_m) * 1e3, 0.5, "mm"),
        Row::at_most("every frame without an impact, rms", rms(&errors.every_m) * 1e3, 0.08, "mm"),
        Row::at_most("angles of bar markers, rms", rms(&errors.angles_rad).to_degrees(), 0.5, "deg"),
    ])
}

fn compare(
    errors: &mut Errors,
    name: &str,
    track: &breakshot::detect::Track,
    (poses, impacts): (&[[f64; 3]], &[f64]),
) {
    const FRAME_RATE_HZ: f64 = 60.0;
    let frame = |time_s: f64| (time_s * FRAME_RATE_HZ).round() as usize;
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
        if impacts.iter().all(|t| (t - sample.time_s).abs() > NEAR_IMPACT_S) {
            errors.every_m.push(error_m);
            if let Some(yaw_rad) = sample.yaw_rad {
                let half_turns = ((yaw_rad - pose[2]) / std::f64::consts::PI).round();
                errors.angles_rad.push((yaw_rad - pose[2] - half_turns * std::f64::consts::PI).abs());
            }
        }
    }
}
