//! Drawn campaigns in which the film shows the striker touch what it strikes, or not.

use super::campaign_warnings;
use crate::detect::{StrikerSample, StrikerTrack};
use crate::estimate::{ClipTracks, Options, estimation};
use crate::geometry::{Point, Vec2};
use crate::object::{Shape, kind};
use crate::synthetic::campaign::{CampaignSpec, SyntheticCampaign, campaign};

/// Where the camera is in the table frame (m): beside the objects, so that a wrong height displaces them along the strikes.
const CAMERA_M: [f64; 3] = [0.5, -0.1, 1.2];
const FRAMES: u32 = 5;
const INTERVAL_S: f64 = 1.0 / 60.0;

/// A campaign whose films show the striker where it is.
fn drawn(seed: u64) -> SyntheticCampaign {
    let mut drawn = campaign(&CampaignSpec { objects: 3, ..CampaignSpec::default() }, seed);
    let fits = estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default()).expect("clips");
    for (clip, fit) in drawn.clips.iter_mut().zip(&fits.clips) {
        clip.tracks.camera_position_m = Some(CAMERA_M);
        let (Some(strike), Some(impact)) = (&clip.strike, fit.impacts.first()) else { continue };
        let Some(distance_m) = impact.striker_distance_m else { continue };
        let ahead = Vec2::from_heading(strike.heading_rad);
        let sample = |k: u32| {
            let before_s = f64::from(FRAMES - k) * INTERVAL_S;
            let at = strike.start_m + ahead * (distance_m - strike.speed_m_s * before_s);
            StrikerSample { time_s: impact.time.value - before_s, x_m: at.x, y_m: at.y }
        };
        let samples = (0..FRAMES).map(sample).collect();
        let start_m = Some(strike.start_m);
        clip.tracks.striker =
            Some(StrikerTrack { samples, start_m, std_m: 1e-4, offset_std_m: 5e-4, scale_std: 6e-3 });
    }
    drawn
}

/// The warnings about outlines at strikes.
fn warnings(drawn: &SyntheticCampaign, clips: &[ClipTracks]) -> Vec<String> {
    let estimation = estimation(clips, &drawn.cell, &drawn.objects, &Options::default()).expect("clips");
    let all = campaign_warnings(clips, &estimation, &drawn.cell, &drawn.objects);
    all.iter().map(ToString::to_string).filter(|text| text.contains("at the strike")).collect()
}

/// The clips as the camera gives them if the heights of these objects are given too large by `error_m`.
fn with_heights(drawn: &SyntheticCampaign, error_m: f64, concerns: fn(&str) -> bool) -> Vec<ClipTracks> {
    let mut clips = drawn.clips.clone();
    let [x, y, z] = CAMERA_M;
    for track in clips.iter_mut().flat_map(|clip| &mut clip.tracks.tracks) {
        let object = drawn.objects.iter().find(|object| object.name == kind(&track.object));
        let height_m = object.expect("an object of the campaign").height_m;
        if concerns(kind(&track.object)) {
            let scale = (z - height_m) / (z - height_m + error_m);
            for sample in &mut track.samples {
                (sample.x_m, sample.y_m) = (x + scale * (sample.x_m - x), y + scale * (sample.y_m - y));
            }
        }
    }
    clips
}

#[test]
fn right_heights_give_no_warning() {
    for seed in 1..4 {
        let drawn = drawn(seed);
        assert_eq!(warnings(&drawn, &drawn.clips), Vec::<String>::new(), "campaign {seed}");
    }
}

/// The first positions after the strike are doubtful and ahead: the strikes seem to be early, before the striker is there.
#[test]
fn strikes_after_which_the_positions_are_doubtful_give_no_gap() {
    const AHEAD_M: f64 = 3e-3;
    let drawn = drawn(1);
    let mut clips = drawn.clips.clone();
    for samples in clips.iter_mut().map(|clip| &mut clip.tracks.tracks[0].samples) {
        let (first, last) = (samples[0].position(), samples[samples.len() - 1].position());
        let along = (last - first).direction().expect("a motion");
        let moving = samples.iter_mut().filter(|s| s.position().distance(first) > 2e-4);
        for sample in moving.take(8) {
            sample.x_m += AHEAD_M * along.x;
            sample.y_m += AHEAD_M * along.y;
            (sample.std_m, sample.doubtful) = (1e-5, true);
        }
    }
    assert_eq!(warnings(&drawn, &clips), Vec::<String>::new());
}

#[test]
fn wrong_heights_of_all_objects_are_named_once() {
    let drawn = drawn(1);
    for (error_m, expected) in [(0.01, "10 mm too large"), (-0.01, "10 mm too small")] {
        let found = warnings(&drawn, &with_heights(&drawn, error_m, |_| true));
        assert_eq!(found.len(), 1, "{error_m} m: {found:?}");
        let mm = found[0].split("height_m were ").nth(1).and_then(|rest| rest.split(" mm").next());
        let mm: f64 = mm.and_then(|mm| mm.parse().ok()).expect(&found[0]);
        let sign = if found[0].contains("too large") { 1.0 } else { -1.0 };
        assert!((sign * mm - 1e3 * error_m).abs() <= 2.0, "{expected}: {found:?}");
    }
}

#[test]
fn a_wrong_height_of_one_object_is_named() {
    let drawn = drawn(1);
    let found = warnings(&drawn, &with_heights(&drawn, 0.015, |name| name == "b"));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].contains("`b`") && found[0].contains("too large"), "{found:?}");
}

#[test]
fn a_displaced_table_frame_of_the_robot_is_no_wrong_height() {
    let drawn = drawn(2);
    let mut clips = drawn.clips.clone();
    for clip in &mut clips {
        if let Some(strike) = &mut clip.strike {
            strike.start_m += Vec2::from_heading(strike.heading_rad) * 0.003;
        }
    }
    assert_eq!(warnings(&drawn, &clips), Vec::<String>::new());
}

#[test]
fn a_striker_seen_off_its_place_by_shade_is_no_wrong_height() {
    let drawn = drawn(2);
    let mut clips = drawn.clips.clone();
    let shade = Vec2::new(0.003, 0.0);
    for striker in clips.iter_mut().filter_map(|clip| clip.tracks.striker.as_mut()) {
        striker.samples.iter_mut().for_each(|sample| sample.x_m += shade.x);
        striker.start_m = striker.start_m.map(|start: Point| start + shade);
    }
    assert_eq!(warnings(&drawn, &clips), Vec::<String>::new());
}

#[test]
fn a_wrong_size_of_the_striker_is_named() {
    let mut drawn = drawn(3);
    let Shape::Disc { radius_m } = &mut drawn.cell.striker.shape else { panic!("a round striker") };
    *radius_m += 0.003;
    let found = warnings(&drawn, &drawn.clips);
    assert!(
        !found.is_empty() && found.iter().all(|text| text.contains("the striker's in cell.toml")),
        "{found:?}"
    );
}
