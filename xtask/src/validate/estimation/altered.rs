//! The films' tracks, thinned or spoilt: do the intervals still have their coverage, and does a warning name every spoilt clip?

use super::bound;
use super::properties;
use super::saved::Saved;
use crate::validate::row::{self, Row};
use crate::validate::truth::Truth;
use breakshot::detect::Sample;
use breakshot::estimate::{self, ClipTracks, Estimation, Options};
use breakshot::geometry::{Point, Vec2};
use std::collections::BTreeMap;

/// All that is measured on altered tracks.
pub(crate) fn validate(saved: &Saved, truth: &Truth) -> Result<bool, String> {
    let whole = learned(saved, &saved.clips)?;
    let bounds = bound::bounds(&whole.clips, &whole.properties.reference);
    let mut holds = row::print_all(
        "Mean errors that the noise alone would leave (Cramer-Rao)",
        &properties::bound_rows(truth, &whole.properties, &bounds),
    );
    let every_second: Vec<ClipTracks> = saved.clips.iter().map(at_half_rate).collect();
    let campaigns = [
        ("two clips a case", fewer(&saved.clips, 2)),
        ("30 frames a second", every_second.clone()),
        ("two clips a case at 30 frames a second", fewer(&every_second, 2)),
    ];
    for (what, clips) in campaigns {
        let thin = learned(saved, &clips)?;
        let title = format!("With {what} ({} clips)", clips.len());
        holds &= row::print_all(&title, &properties::thin_rows(truth, &whole.properties, &thin.properties));
    }
    holds &= row::print_all("Spoilt clips", &spoilt_rows(saved, &whole)?);
    Ok(holds)
}

/// The estimation from these clips.
pub(crate) fn learned(saved: &Saved, clips: &[ClipTracks]) -> Result<Estimation, String> {
    let Saved { campaign, .. } = saved;
    estimate::estimation(clips, &campaign.cell, &campaign.objects, &Options::default())
        .map_err(|e| e.to_string())
}

/// The first clips of every case.
fn fewer(clips: &[ClipTracks], most: usize) -> Vec<ClipTracks> {
    let mut counts: BTreeMap<&[String], usize> = BTreeMap::new();
    let mut kept = Vec::new();
    for clip in clips {
        let count = counts.entry(&clip.objects).or_default();
        *count += 1;
        if *count <= most {
            kept.push(clip.clone());
        }
    }
    kept
}

/// A clip with its samples changed.
fn changed(clip: &ClipTracks, change: impl Fn(&[Sample]) -> Vec<Sample>) -> ClipTracks {
    let mut changed = clip.clone();
    for track in &mut changed.tracks.tracks {
        track.samples = change(&track.samples);
    }
    changed
}

fn at_half_rate(clip: &ClipTracks) -> ClipTracks {
    changed(clip, |samples| samples.iter().step_by(2).copied().collect())
}

/// Filmed at half of the frame rate in the file.
fn too_fast(clip: &ClipTracks) -> ClipTracks {
    changed(&at_half_rate(clip), |samples| {
        samples.iter().map(|s| Sample { time_s: s.time_s / 2.0, ..*s }).collect()
    })
}

/// Every picture comes twice.
fn doubled(clip: &ClipTracks) -> ClipTracks {
    changed(clip, |samples| {
        (0..samples.len()).map(|k| Sample { time_s: samples[k].time_s, ..samples[k - k % 2] }).collect()
    })
}

/// The camera is moved by a small shift and rotation in the second half of the clip.
fn nudged(clip: &ClipTracks) -> ClipTracks {
    const SHIFT: Vec2 = Vec2 { x: 0.002, y: -0.0015 };
    const ROTATION_RAD: f64 = 0.004;
    const AFTER: f64 = 0.55;
    let end_s = clip.tracks.tracks.iter().flat_map(|t| &t.samples).map(|s| s.time_s).fold(0.0, f64::max);
    changed(clip, |samples| {
        let moved = |s: &Sample| {
            let position = Point::ORIGIN + s.position().to_vec().rotated(ROTATION_RAD) + SHIFT;
            Sample {
                x_m: position.x,
                y_m: position.y,
                yaw_rad: s.yaw_rad.map(|yaw| yaw + ROTATION_RAD),
                ..*s
            }
        };
        samples.iter().map(|s| if s.time_s > AFTER * end_s { moved(s) } else { *s }).collect()
    })
}

/// The campaign file gives two objects each other's names.
fn swapped(clip: &ClipTracks) -> ClipTracks {
    let mut swapped = clip.clone();
    swapped.objects.reverse();
    for track in &mut swapped.tracks.tracks {
        let other = clip.objects.iter().find(|o| **o != track.object);
        track.object = other.unwrap_or(&track.object).clone();
    }
    swapped
}

/// What happens to a clip.
type Spoil = fn(&ClipTracks) -> ClipTracks;

fn spoilt_rows(saved: &Saved, whole: &Estimation) -> Result<Vec<Row>, String> {
    let pairs: Vec<usize> = (0..saved.clips.len())
        .filter(|&k| match saved.clips[k].objects.as_slice() {
            [a, b] => breakshot::object::kind(a) != breakshot::object::kind(b),
            _ => false,
        })
        .collect();
    // Spread over all pairs.
    let some = |count: usize, first: usize| -> Vec<usize> {
        (0..count).map(|n| pairs[(first + n * pairs.len() / count) % pairs.len()]).collect()
    };
    let mut rows = Vec::new();
    let spoils: [(&str, Spoil, Vec<usize>); 4] = [
        ("two names swapped in 5 clips", swapped, some(5, 3)),
        ("a clip filmed at half the frame rate", too_fast, some(1, 11)),
        ("a clip with every picture twice", doubled, some(1, 31)),
        ("a clip with the camera nudged", nudged, some(1, 52)),
    ];
    for (what, spoil, which) in spoils {
        let mut clips = saved.clips.clone();
        for &k in &which {
            clips[k] = spoil(&clips[k]);
        }
        let found = learned(saved, &clips)?;
        let new_warning = |name: &str| {
            let about = |w: &&String| w.starts_with(&format!("{name}:"));
            found.properties.warnings.iter().find(about).filter(|w| !whole.properties.warnings.contains(w))
        };
        let named_before =
            |name: &str| whole.properties.warnings.iter().any(|w| w.starts_with(&format!("{name}:")));
        let missed = which.iter().filter(|&&k| new_warning(&clips[k].name).is_none()).count();
        let others: Vec<&String> = (0..clips.len())
            .filter(|k| !which.contains(k) && !named_before(&clips[*k].name))
            .filter_map(|k| new_warning(&clips[k].name))
            .inspect(|warning| println!("{what}, newly named: {warning}"))
            .collect();
        for &k in &which {
            println!("{what}: {}", new_warning(&clips[k].name).map_or("NOT NAMED", String::as_str));
        }
        rows.push(Row::at_most(format!("{what}: clips not named"), missed as f64, 0.0, ""));
        rows.push(Row::plain(format!("{what}: other clips newly named"), others.len() as f64, ""));
        rows.push(Row::at_most(
            format!("{what}: largest change, in standard errors"),
            largest_change(whole, &found),
            1.0,
            "",
        ));
    }
    Ok(rows)
}

/// Largest change of a quantity by the spoilt clips, over its standard error without them.
fn largest_change(whole: &Estimation, found: &Estimation) -> f64 {
    let groups = |e: &Estimation| {
        let p = e.properties.clone();
        [p.friction, p.striker_restitution, p.restitution, p.mass_ratio]
    };
    let mut largest: f64 = 0.0;
    for (whole, found) in groups(whole).iter().zip(groups(found)) {
        for (name, estimate) in whole.iter().filter(|(_, e)| e.standard_error > 0.0) {
            let now = found.get(name).map_or(f64::INFINITY, |e| e.mean);
            largest = largest.max((now - estimate.mean).abs() / estimate.standard_error);
        }
    }
    largest
}
