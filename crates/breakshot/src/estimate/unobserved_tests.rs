//! Motions between a strike and an impact of which no position is known, or a single one.

use super::{Options, estimation};
use crate::detect::Track;
use crate::properties::Properties;
use crate::synthetic::campaign::{CampaignSpec, SyntheticCampaign, campaign};
use crate::uncertain::Estimate;

/// Any instant of the strike between the last frame at rest and the impact explains the positions that are left.
#[test]
fn impacts_around_a_motion_that_no_position_shows_measure_nothing() {
    let (drawn, found) = estimated(|between| &between[..0]);
    assert!(found.restitution.is_empty(), "{:?}", found.restitution);
    assert!(found.pair_mass_ratio.is_empty(), "{:?}", found.pair_mass_ratio);
    let warning = "no position shows the motion of";
    assert!(found.warnings.iter().any(|w| w.contains(warning)), "{:?}", found.warnings);
    for (name, restitution) in &found.striker_restitution {
        let truth = drawn.truth.striker_restitution[name];
        assert!((restitution.mean / truth - 1.0).abs() < 0.05, "{name}: {restitution:?}, {truth} drawn");
    }
}

/// One position shows the instant and the speed together with the instant and the place of the impact, which the other body shows.
#[test]
fn impacts_around_a_motion_that_a_single_position_shows_are_measured() {
    let (drawn, found) = estimated(|between| &between[between.len() / 2..][..1]);
    assert_eq!(found.restitution.len(), 2, "{:?}", found.restitution);
    assert_eq!(found.pair_mass_ratio.len(), 2, "{:?}", found.pair_mass_ratio);
    assert_holds(&drawn, &found);
}

/// A position at about the instant of the strike does not show the instant.
#[test]
fn impacts_around_a_motion_of_which_only_the_first_position_is_left_measure_little() {
    let (drawn, found) = estimated(|between| &between[..1]);
    let warning = "a single position shows the motion of";
    assert!(found.warnings.iter().any(|w| w.contains(warning)), "{:?}", found.warnings);
    assert_holds(&drawn, &found);
}

/// Asserts that the restitutions and mass ratios that are given are the drawn ones within their intervals.
fn assert_holds(drawn: &SyntheticCampaign, found: &Properties) {
    let holds = |what: &str, given: &Estimate, truth: f64| {
        let [low, high] = given.interval_95;
        assert!((low..=high).contains(&truth), "{what}: {given:?}, {truth} drawn");
    };
    for (pair, restitution) in &found.restitution {
        holds(pair, restitution, drawn.truth.restitution[pair]);
    }
    for (pair, ratio) in &found.pair_mass_ratio {
        let (one, other) = pair.split_once('/').expect("two names");
        holds(pair, ratio, drawn.truth.mass_ratio[one] / drawn.truth.mass_ratio[other]);
    }
}

/// A campaign and its estimate from tracks of which, between the strike and the impact, only the positions at the chosen times are left.
fn estimated(chosen: impl Fn(&[f64]) -> &[f64]) -> (SyntheticCampaign, Properties) {
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
        let kept_s = chosen(&between);
        samples.retain(|s| !is_between(s.time_s) || kept_s.contains(&s.time_s));
    }
    let found =
        estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default()).expect("properties");
    (drawn, found.properties)
}
