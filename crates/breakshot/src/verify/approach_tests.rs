//! Drawn campaigns whose films show when the striker begins to move, but not the striker itself.

use super::approach::mean_speed;
use super::campaign_warnings;
use super::striker_tests::seen;
use crate::detect::{StrikerSample, StrikerTrack};
use crate::estimate::{ClipTracks, Options, estimation};
use crate::geometry::Vec2;
use crate::scene::Strike;
use crate::synthetic::campaign::{CampaignSpec, SyntheticCampaign, campaign};
use crate::uncertain::Measured;

const ONSET_STD_S: f64 = 1e-3;

/// A campaign whose strikers begin to move when their strikes say: at the impact less the distance over the speed.
fn drawn(seed: u64) -> SyntheticCampaign {
    let mut drawn = campaign(&CampaignSpec { objects: 3, ..CampaignSpec::default() }, seed);
    let onset = |value: f64| Some(Measured { value, std: ONSET_STD_S });
    drawn.clips.iter_mut().for_each(|clip| clip.tracks.striker_onset_s = onset(0.0));
    let fits =
        estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default()).expect("clips").clips;
    for (clip, fit) in drawn.clips.iter_mut().zip(&fits) {
        let speed_m_s = clip.strike.as_ref().expect("a strike").speed_m_s;
        // A clip whose first impact is not clear shows no duration.
        clip.tracks.striker_onset_s = mean_speed(clip, fit).and_then(|mean| {
            let impact_s = mean.distance_m / (mean.log_ratio.value.exp() * speed_m_s);
            onset(impact_s - mean.distance_m / speed_m_s)
        });
    }
    drawn
}

fn warnings(drawn: &SyntheticCampaign, change: impl Fn(usize, &mut ClipTracks)) -> Vec<String> {
    let mut clips = drawn.clips.clone();
    clips.iter_mut().enumerate().for_each(|(number, clip)| change(number, clip));
    let estimation = estimation(&clips, &drawn.cell, &drawn.objects, &Options::default()).expect("clips");
    let warnings = campaign_warnings(&clips, &estimation, &drawn.cell, &drawn.objects);
    warnings.iter().map(ToString::to_string).collect()
}

fn strike(clip: &mut ClipTracks) -> &mut Strike {
    clip.strike.as_mut().expect("a strike")
}

#[test]
fn strikers_that_reach_the_objects_in_time_give_no_warning() {
    for seed in 1..4 {
        let found = warnings(&drawn(seed), |_, _| {});
        assert!(found.is_empty(), "campaign {seed}: {found:?}");
    }
}

#[test]
fn a_wrong_speed_of_all_clips_is_named_by_the_time_to_the_impact() {
    let drawn = drawn(1);
    for (factor, expected) in [(1.1, "10 % too high"), (0.9, "10 % too low")] {
        let found = warnings(&drawn, |_, clip| strike(clip).speed_m_s *= factor);
        let named = |text: &&String| text.contains("first motion to the impact") && text.contains(expected);
        assert_eq!(found.iter().filter(named).count(), 1, "{factor}: {found:?}");
    }
}

#[test]
fn the_instant_of_a_strike_that_measures_nothing_is_known_to_a_frame() {
    let drawn = drawn(1);
    let fits =
        estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default()).expect("clips").clips;
    let known = drawn.clips.iter().zip(fits).filter_map(|(clip, mut fit)| {
        let measured = mean_speed(clip, &fit)?.log_ratio.std;
        fit.impacts[0].restitution = None;
        Some([measured, mean_speed(clip, &fit)?.log_ratio.std])
    });
    let stds: Vec<[f64; 2]> = known.collect();
    assert!(stds.len() > 20 && stds.iter().all(|[known, open]| *open > 0.03 && open > known), "{stds:?}");
}

/// The strikers of a third of the films are seen at rest, but their heights, and with them their speeds, are known to 3 % only.
#[test]
fn mean_speeds_name_a_common_error_that_strikers_of_uncertain_height_do_not_show() {
    let drawn = drawn(1);
    let found = warnings(&drawn, |number, clip| {
        if number % 3 == 0 {
            clip.tracks.striker = Some(StrikerTrack { scale_std: 0.03, ..seen(strike(clip)) });
        }
        strike(clip).speed_m_s *= 1.06;
    });
    let named = |text: &&String| {
        text.contains("first motion to the impact") && text.contains("speed_m_s is 6 % too high")
    };
    assert_eq!(found.iter().filter(named).count(), 1, "{found:?}");
}

/// The speeds of the strikers that are seen at rest are known to 8 % only, or to 2 %: that alone does not show errors of 25 and 8 %.
#[test]
fn a_mean_speed_names_the_wrong_speed_of_a_clip_whose_striker_is_seen() {
    let drawn = drawn(3);
    let number = drawn.clips.iter().rposition(|clip| clip.tracks.striker_onset_s.is_some()).expect("a clip");
    for (scale_std, factor) in [(0.08, 1.25), (0.02, 1.08)] {
        let found = warnings(&drawn, |k, clip| {
            clip.tracks.striker = Some(StrikerTrack { scale_std, ..seen(strike(clip)) });
            if k == number {
                strike(clip).speed_m_s *= factor;
            }
        });
        let named = |text: &&String| {
            text.starts_with(&drawn.clips[number].name) && text.contains("first motion to the impact")
        };
        assert_eq!(found.iter().filter(named).count(), 1, "{factor}: {found:?}");
    }
}

/// In two thirds of the films something is followed that is 12 % slower than the striker, and no first motion is seen.
#[test]
fn what_is_seen_gives_no_common_error_that_the_mean_speeds_contradict() {
    let drawn = drawn(1);
    let found = warnings(&drawn, |number, clip| {
        if number % 3 > 0 {
            let slower = Strike { speed_m_s: 0.88 * strike(clip).speed_m_s, ..strike(clip).clone() };
            clip.tracks.striker = Some(seen(&slower));
            clip.tracks.striker_onset_s = None;
        }
    });
    assert!(!found.iter().any(|text| text.starts_with("in ")), "{found:?}");
}

/// The starts of a robot are stated to half a millimetre; where those of all films agree better, 4 % of the speed are visible.
#[test]
fn films_that_agree_show_a_smaller_error_of_one_speed() {
    let drawn = drawn(3);
    let number = drawn.clips.iter().rposition(|clip| clip.tracks.striker_onset_s.is_some()).expect("a clip");
    let is_named = |start_error_m: f64| {
        let found = warnings(&drawn, |k, clip| {
            let error_m = [-1.0, 0.0, 1.0][k % 3] * start_error_m;
            let ahead = Vec2::from_heading(strike(clip).heading_rad) * error_m;
            strike(clip).start_m += ahead;
            if k == number {
                strike(clip).speed_m_s *= 1.04;
            }
        });
        let named = |text: &String| {
            text.starts_with(&drawn.clips[number].name) && text.contains("first motion to the impact")
        };
        found.iter().any(named)
    };
    assert!(is_named(0.0), "all starts are exact");
    assert!(!is_named(7e-4), "the starts differ by 0.7 mm");
}

#[test]
fn a_wrong_frame_rate_of_all_films_is_named_by_the_time_to_the_impact() {
    let drawn = drawn(2);
    let true_hz = drawn.clips[0].frame_rate_hz().expect("samples").round();
    for factor in [1.2, 0.5] {
        let found = warnings(&drawn, |_, clip| {
            let tracks = &mut clip.tracks;
            tracks.tracks.iter_mut().flat_map(|t| &mut t.samples).for_each(|s| s.time_s *= factor);
            tracks.striker_onset_s.iter_mut().for_each(|onset_s| onset_s.value *= factor);
        });
        let fits = format!("write frame_rate_hz = {true_hz};");
        assert_eq!(found.iter().filter(|text| text.contains(&fits)).count(), 1, "{factor}: {found:?}");
    }
}

#[test]
fn a_start_that_is_displaced_along_the_strike_is_named() {
    let drawn = drawn(3);
    let number = drawn.clips.iter().rposition(|clip| clip.tracks.striker_onset_s.is_some()).expect("a clip");
    let found = warnings(&drawn, |k, clip| {
        if k == number {
            let ahead = Vec2::from_heading(strike(clip).heading_rad) * 0.02;
            strike(clip).start_m += ahead;
        }
    });
    let name = &drawn.clips[number].name;
    let named = |text: &&String| text.starts_with(name) && text.contains("mm further back");
    assert_eq!(found.iter().filter(named).count(), 1, "{found:?}");
}

/// What is seen is the arm above the striker: 15 % faster, and aside.
#[test]
fn an_arm_that_hides_the_striker_gives_no_warning() {
    let drawn = drawn(1);
    let found = warnings(&drawn, |_, clip| {
        let Strike { start_m, heading_rad, speed_m_s, .. } = *strike(clip);
        let Some(Measured { value: onset_s, .. }) = clip.tracks.striker_onset_s else { return };
        let along = Vec2::from_heading(heading_rad);
        let sample = |k: u32| {
            let since_s = 0.03 + 0.01 * f64::from(k);
            let at = start_m + along * (1.15 * speed_m_s * since_s) + along.perpendicular() * 0.02;
            StrikerSample { time_s: onset_s + since_s, x_m: at.x, y_m: at.y }
        };
        clip.tracks.striker = Some(StrikerTrack {
            samples: (0..4).map(sample).collect(),
            start_m: None,
            std_m: 2e-4,
            offset_std_m: 6e-4,
            scale_std: 0.025,
        });
    });
    assert!(found.is_empty(), "{found:?}");
}
