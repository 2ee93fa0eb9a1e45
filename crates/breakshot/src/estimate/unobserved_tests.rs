//! Motions between a strike and an impact of which no position is known, or a single one.

use super::{Options, estimation};
use crate::detect::Track;
use crate::synthetic::campaign::{CampaignSpec, campaign};

/// Any instant of the strike between the last frame at rest and the impact explains the positions that are left.
#[test]
fn impacts_around_a_motion_that_no_position_shows_measure_nothing() {
    impacts_measure_nothing(0, "no position shows the motion of");
}

/// One position shows neither the instant of the strike nor the speed.
#[test]
fn impacts_around_a_motion_that_a_single_position_shows_measure_nothing() {
    impacts_measure_nothing(1, "a single position shows the motion of");
}

/// Estimates clips of which this number of positions between the strike and the impact is left.
fn impacts_measure_nothing(left: usize, warning: &str) {
    let mut drawn = campaign(&CampaignSpec { objects: 2, ..CampaignSpec::default() }, 4);
    let whole =
        estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default()).expect("properties");
    assert!(!whole.properties.restitution.is_empty(), "{:?}", whole.properties.warnings);

    // The frame before the first one that is clearly off the position at rest: it may hold the first part of the motion.
    let onset_s = |track: &Track| {
        let first = track.samples[0].position();
        let moved = track.samples.iter().position(|s| s.position().distance(first) > 5e-4);
        moved.map_or(f64::INFINITY, |k| track.samples[k - 1].time_s)
    };
    for clip in drawn.clips.iter_mut().filter(|clip| clip.tracks.tracks.len() == 2) {
        let [from_s, to_s] = [0, 1].map(|k| onset_s(&clip.tracks.tracks[k]));
        let is_between = |time_s: f64| (from_s..=to_s).contains(&time_s);
        let samples = &mut clip.tracks.tracks[0].samples;
        let between: Vec<f64> = samples.iter().map(|s| s.time_s).filter(|t| is_between(*t)).collect();
        assert!(between.len() > 2, "{}: {between:?}", clip.name);
        // Those in the middle
        let kept_s = &between[between.len() / 2..][..left];
        samples.retain(|s| !is_between(s.time_s) || kept_s.contains(&s.time_s));
    }
    let found =
        estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default()).expect("properties");
    let found = found.properties;
    assert!(found.restitution.is_empty(), "{:?}", found.restitution);
    assert!(found.pair_mass_ratio.is_empty(), "{:?}", found.pair_mass_ratio);
    assert!(found.warnings.iter().any(|w| w.contains(warning)), "{:?}", found.warnings);
    for (name, restitution) in &found.striker_restitution {
        let truth = drawn.truth.striker_restitution[name];
        assert!((restitution.mean / truth - 1.0).abs() < 0.05, "{name}: {restitution:?}, {truth} drawn");
    }
}
