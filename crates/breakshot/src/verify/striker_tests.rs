//! Drawn campaigns whose strikers are seen.

use super::campaign_warnings;
use crate::detect::{StrikerSample, StrikerTrack};
use crate::estimate::{ClipTracks, Options, estimation};
use crate::geometry::{Point, Vec2};
use crate::scene::Strike;
use crate::synthetic::campaign::{CampaignSpec, SyntheticCampaign, campaign};

/// Frames in which the striker is seen, the interval between them (s), and errors of its positions (m).
const FRAMES: u32 = 6;
const INTERVAL_S: f64 = 1.0 / 60.0;
const NOISE_M: f64 = 5e-5;

/// A campaign with a striker in each film that moves as its strike says.
fn drawn(seed: u64) -> SyntheticCampaign {
    let mut drawn = campaign(&CampaignSpec { objects: 3, ..CampaignSpec::default() }, seed);
    for clip in &mut drawn.clips {
        clip.tracks.striker = clip.strike.as_ref().map(seen);
    }
    drawn
}

/// A striker that is seen at rest and moves as its strike says.
pub(super) fn seen(strike: &Strike) -> StrikerTrack {
    let along = Vec2::from_heading(strike.heading_rad);
    let sample = |k: u32| {
        let time_s = f64::from(k) * INTERVAL_S;
        let noise_m = NOISE_M * [0.0, 1.0, -1.0, -1.0, 1.0, 0.0][k as usize];
        let at =
            strike.start_m + along * (0.01 + strike.speed_m_s * time_s) + along.perpendicular() * noise_m;
        StrikerSample { time_s: 0.2 + time_s, x_m: at.x, y_m: at.y }
    };
    StrikerTrack {
        samples: (0..FRAMES).map(sample).collect(),
        start_m: Some(strike.start_m),
        std_m: NOISE_M,
        offset_std_m: 6e-4,
        scale_std: 6e-3,
    }
}

fn warnings(drawn: &SyntheticCampaign, clips: &[ClipTracks]) -> Vec<String> {
    let estimation = estimation(clips, &drawn.cell, &drawn.objects, &Options::default()).expect("clips");
    let warnings = campaign_warnings(clips, &estimation, &drawn.cell, &drawn.objects);
    let mut warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    warnings.extend(estimation.properties.warnings.into_iter().filter(|w| w.contains("frame_rate_hz")));
    warnings
}

fn changed(drawn: &SyntheticCampaign, change: impl Fn(usize, &mut ClipTracks)) -> Vec<ClipTracks> {
    let mut clips = drawn.clips.clone();
    clips.iter_mut().enumerate().for_each(|(number, clip)| change(number, clip));
    clips
}

fn strike(clip: &mut ClipTracks) -> &mut Strike {
    clip.strike.as_mut().expect("a strike")
}

/// All times as if the file said another rate.
fn stretch(clip: &mut ClipTracks, factor: f64) {
    let tracks = &mut clip.tracks;
    tracks.tracks.iter_mut().flat_map(|track| &mut track.samples).for_each(|s| s.time_s *= factor);
    tracks.striker.iter_mut().flat_map(|striker| &mut striker.samples).for_each(|s| s.time_s *= factor);
}

#[test]
fn strikers_that_move_as_given_give_no_warning() {
    for seed in 1..5 {
        let drawn = drawn(seed);
        let found = warnings(&drawn, &drawn.clips);
        assert!(found.is_empty(), "campaign {seed}: {found:?}");
    }
}

#[test]
fn a_wrong_speed_of_all_clips_is_named_once() {
    let drawn = drawn(1);
    for (factor, expected) in [(1.1, "10 % too high"), (1.05, "5 % too high"), (0.95, "5 % too low")] {
        let found = warnings(&drawn, &changed(&drawn, |_, clip| strike(clip).speed_m_s *= factor));
        let named = |text: &&String| text.contains("strike.speed_m_s") && text.contains(expected);
        assert_eq!(found.iter().filter(named).count(), 1, "{factor}: {found:?}");
        assert_eq!(found.iter().filter(|text| text.contains("frame_rate_hz")).count(), 1, "{found:?}");
        assert!(found[0].contains("probably strike.speed_m_s"), "{found:?}");
    }
}

#[test]
fn a_wrong_frame_rate_of_all_films_is_named_once_with_the_true_one() {
    let drawn = drawn(2);
    let true_hz = drawn.clips[0].frame_rate_hz().expect("samples").round();
    // The file says 50 and 100 frames/s for 60 and 120, and half and twice the rate.
    for factor in [1.2, 2.0, 0.5] {
        let found = warnings(&drawn, &changed(&drawn, |_, clip| stretch(clip, factor)));
        let lines: Vec<&String> = found.iter().filter(|text| text.contains("frame_rate_hz")).collect();
        let fits = format!("write frame_rate_hz = {true_hz};");
        assert!(lines.len() == 1 && lines[0].contains(&fits), "{true_hz} Hz, factor {factor}: {found:?}");
        assert!(lines[0].contains("probably the films were taken"), "{lines:?}");
    }
}

#[test]
fn a_wrong_strike_of_one_clip_is_named_with_what_the_film_shows() {
    let drawn = drawn(3);
    let number = drawn.clips.len() / 2;
    let right = drawn.clips[number].strike.clone().expect("a strike");
    let named = |change: &dyn Fn(&mut Strike), expected: &str| {
        let clips = changed(&drawn, |k, clip| {
            if k == number {
                change(strike(clip));
            }
        });
        let found = warnings(&drawn, &clips);
        let name = &drawn.clips[number].name;
        let ours = found.iter().filter(|text| text.starts_with(name) && text.contains(expected)).count();
        assert!(ours == 1 && found.len() == 1, "{expected}: {found:?}");
    };
    let along = Vec2::from_heading(right.heading_rad);
    named(&|strike| strike.speed_m_s *= 1.1, &format!("and {:.3} would fit", right.speed_m_s));
    named(&|strike| strike.heading_rad += 0.1, &format!("and {:.3} would fit", right.heading_rad));
    let start = format!("and [{:.4}, {:.4}] would fit", right.start_m.x, right.start_m.y);
    named(&|strike| strike.start_m += along * 0.02, &start);
    named(
        &|strike| strike.start_m += along.perpendicular() * -0.008,
        "8.0 mm to the left of the given start",
    );
}

/// Lengths that are too large displace every start away from the origin of the table frame.
#[test]
fn lengths_on_the_table_are_named_where_they_explain_the_starts() {
    let drawn = drawn(5);
    let clips = changed(&drawn, |_, clip| {
        let striker = clip.tracks.striker.as_mut().expect("a striker");
        striker.start_m = striker.start_m.map(|start| Point::ORIGIN + start.to_vec() * 1.05);
        for sample in &mut striker.samples {
            (sample.x_m, sample.y_m) = (1.05 * sample.x_m, 1.05 * sample.y_m);
        }
    });
    let found = warnings(&drawn, &clips);
    let named = |text: &&String| {
        text.contains("table frame is displaced") && text.contains("lengths on the table are 5 % too large")
    };
    assert_eq!(found.iter().filter(named).count(), 1, "{found:?}");
    // One displacement of all starts is not along their positions.
    let displaced = changed(&drawn, |_, clip| strike(clip).start_m += Vec2::new(0.01, -0.02));
    let found = warnings(&drawn, &displaced);
    assert!(found.iter().any(|text| text.contains("robot's table frame is displaced")), "{found:?}");
    assert!(!found.iter().any(|text| text.contains("lengths on the table")), "{found:?}");
}

#[test]
fn a_rotated_and_a_displaced_frame_are_named_once() {
    let drawn = drawn(4);
    let rotated = warnings(&drawn, &changed(&drawn, |_, clip| strike(clip).heading_rad += 0.1));
    let of_heading = rotated.iter().filter(|text| text.contains("strike.heading_rad or the robot")).count();
    assert!(of_heading == 1 && rotated[0].contains("5.7 degrees to the right"), "{rotated:?}");
    let displaced = warnings(
        &drawn,
        &changed(&drawn, |_, clip| {
            let ahead = Vec2::from_heading(strike(clip).heading_rad);
            strike(clip).start_m += ahead * -0.01;
        }),
    );
    assert!(displaced[0].contains("10.0 mm ahead of the given start"), "{displaced:?}");
}

/// Centres of tags that are 2 % too far apart in the cell: the tags look too wide, and the striker is seen to be as much too fast.
#[test]
fn tags_that_are_too_wide_beside_the_distances_of_their_centres_are_named_once() {
    let drawn = drawn(4);
    let spread = |factor: f64| {
        changed(&drawn, |_, clip| {
            clip.tracks.tag_width_ratio = Some(factor);
            for track in &mut clip.tracks.tracks {
                for sample in &mut track.samples {
                    (sample.x_m, sample.y_m) = (factor * sample.x_m, factor * sample.y_m);
                }
            }
            let striker = clip.tracks.striker.as_mut().expect("a striker");
            striker.start_m = striker.start_m.map(|start| Point::ORIGIN + start.to_vec() * factor);
            for sample in &mut striker.samples {
                (sample.x_m, sample.y_m) = (factor * sample.x_m, factor * sample.y_m);
            }
        })
    };
    let of_tags = |factor: f64| {
        let found = warnings(&drawn, &spread(factor));
        found.into_iter().filter(|text| text.contains("the tags are")).collect::<Vec<_>>()
    };
    let found = of_tags(1.02);
    assert!(found.len() == 1 && found[0].contains("2.0 % wider than size_m"), "{found:?}");
    let found = of_tags(0.99);
    assert!(found.len() == 1 && found[0].contains("1.0 % narrower than size_m"), "{found:?}");
    assert_eq!(of_tags(1.002), Vec::<String>::new());
}
