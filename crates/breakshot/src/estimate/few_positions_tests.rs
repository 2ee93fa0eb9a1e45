//! Impacts that few positions show.

use super::{ClipTracks, Options, estimation};
use crate::detect::Track;
use crate::object::kind;
use crate::synthetic::campaign::{CampaignSpec, SyntheticCampaign, campaign};
use crate::uncertain::Estimate;
use std::collections::BTreeMap;

/// From such positions alone the friction of the struck body, its speed and the instant of the strike are known together only, and far from linearly; the
/// friction is known from the other clips.
#[test]
fn a_motion_that_few_positions_show_is_measured_near_the_friction_of_other_clips() {
    let errors: Vec<f64> = (11..=16).filter_map(error_of_mass_ratio).collect();
    println!("errors of the mass ratio: {errors:.3?}");
    assert!(errors.len() >= 5, "{errors:?}");
    let mean = errors.iter().map(|error| error.abs()).sum::<f64>() / errors.len() as f64;
    assert!(mean < 0.02, "mean error {mean} of {errors:?}");
}

/// The error of the logarithm of the mass ratio; `None` without the ratio.
fn error_of_mass_ratio(seed: u64) -> Option<f64> {
    let mut drawn = drawn(seed);
    let pair = drawn.clips.iter_mut().find(|clip| clip.tracks.tracks.len() == 2)?;
    keep_few_positions(pair);
    let found =
        estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default()).expect("properties");
    let ratio = found.properties.pair_mass_ratio.get("a/b")?;
    Some((ratio.mean * drawn.truth.mass_ratio["b"]).ln())
}

/// A campaign with one clip of the two different objects, the others of one object alone.
fn drawn(seed: u64) -> SyntheticCampaign {
    let spec = CampaignSpec {
        objects: 2,
        clips_per_case: 3,
        frame_s: 1.0 / 240.0,
        exposure_frames: 0.5,
        hidden_fraction: 0.0,
        outlier_fraction: 0.0,
        ..CampaignSpec::default()
    };
    let mut drawn = campaign(&spec, seed);
    let is_pair =
        |clip: &ClipTracks| clip.objects.len() == 2 && kind(&clip.objects[0]) != kind(&clip.objects[1]);
    let first = drawn.clips.iter().find(|clip| is_pair(clip)).map(|clip| clip.name.clone());
    drawn.clips.retain(|clip| clip.objects.len() == 1 || Some(&clip.name) == first.as_ref());
    drawn
}

/// Leaves three positions of the struck body from the strike to the impact, of which that in the middle is doubtful and wrong, and none from there to its
/// rest.
fn keep_few_positions(clip: &mut ClipTracks) {
    const WRONG_M: f64 = 0.75e-3;
    const STATED_STD_M: f64 = 1e-4;
    let starts_s = |track: &Track| {
        let first = track.samples[0].position();
        let moved = track.samples.iter().find(|s| s.position().distance(first) > 5e-4);
        moved.map_or(f64::INFINITY, |s| s.time_s)
    };
    let [from_s, to_s] = [0, 1].map(|k| starts_s(&clip.tracks.tracks[k]));
    let samples = &mut clip.tracks.tracks[0].samples;
    let last = samples[samples.len() - 1].position();
    let along = (last - samples[0].position()).direction().expect("a motion");
    let rests_s = samples.iter().find(|s| s.position().distance(last) < 2e-4).expect("a rest").time_s;
    let between: Vec<f64> = samples.iter().map(|s| s.time_s).filter(|t| (from_s..to_s).contains(t)).collect();
    let middle_s = between[between.len() / 2];
    let kept_s = [between[0], middle_s, between[between.len() - 1]];
    samples.retain(|s| s.time_s < from_s || s.time_s > rests_s || kept_s.contains(&s.time_s));
    for sample in samples.iter_mut().filter(|s| s.time_s == middle_s) {
        sample.x_m += WRONG_M * along.x;
        sample.y_m += WRONG_M * along.y;
        (sample.std_m, sample.doubtful) = (STATED_STD_M, true);
    }
}

/// The position of a marker in a frame whose exposure contains an impact is between that at mid-exposure and the mean over the exposure.
#[test]
fn the_position_in_a_frame_with_an_impact_is_uncertain_though_the_exposure_is_stated() {
    const STATED_FRAMES: f64 = 0.44;
    for exposure_frames in [0.0, STATED_FRAMES] {
        let errors: Vec<f64> =
            (31..=42).flat_map(|seed| errors_of_restitutions(seed, exposure_frames, STATED_FRAMES)).collect();
        let rms = (errors.iter().map(|error| error.powi(2)).sum::<f64>() / errors.len() as f64).sqrt();
        println!("exposure of {exposure_frames} frames: {} restitutions, rms error {rms:.4}", errors.len());
        assert!(errors.len() >= 50 && rms < 0.04, "{exposure_frames}: {rms} of {errors:.3?}");
    }
}

/// The relative errors of all restitutions that one clip of each case at 30 frames a second gives.
fn errors_of_restitutions(seed: u64, exposure_frames: f64, stated_frames: f64) -> Vec<f64> {
    let spec = CampaignSpec {
        objects: 3,
        clips_per_case: 1,
        frame_s: 1.0 / 30.0,
        exposure_frames,
        hidden_fraction: 0.0,
        outlier_fraction: 0.0,
        ..CampaignSpec::default()
    };
    let mut drawn = campaign(&spec, seed);
    drawn.cell.camera.exposure_s = Some(stated_frames * spec.frame_s);
    let found =
        estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default()).expect("properties");
    let (properties, truth) = (found.properties, drawn.truth);
    let errors = |found: &BTreeMap<String, Estimate>, truth: &BTreeMap<String, f64>| {
        found.iter().map(|(name, estimate)| estimate.mean / truth[name] - 1.0).collect::<Vec<_>>()
    };
    let of_strikes = errors(&properties.striker_restitution, &truth.striker_restitution);
    [of_strikes, errors(&properties.restitution, &truth.restitution)].concat()
}
