//! Drawn films of strikes of known speed and heading.

use super::{is_redundant, without_outliers};
use crate::capture::{Camera, Capture, Footage, Lens};
use crate::cell::{Cell, Striker, Transform, Workspace};
use crate::detect::{Layout, Options, StrikerTrack, Tracks, tracks};
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{Marker, Object, Shape};
use crate::scene::Strike;
use crate::synthetic::film::{Thing, View, film};
use crate::uncertain::Measured;

/// When the striker starts (s), and the frame rate (Hz).
const START_S: f64 = 0.104;
const RATE_HZ: f64 = 60.0;
/// The struck object's friction deceleration (m/s2), and its speed over the striker's.
const DECELERATION_M_S2: f64 = 2.5;
const SPEED_FACTOR: f64 = 1.5;
/// Where the struck object lies.
const PUCK: Point = Point::new(-0.02, 0.01);
const PUCK_RADIUS_M: f64 = 0.025;

fn puck() -> Object {
    let marker = Some(Marker::centred(Shape::Disc { radius_m: 0.009 }));
    let shape = Shape::Disc { radius_m: PUCK_RADIUS_M };
    Object { name: "puck".into(), shape, height_m: 0.02, marker, mass_kg: None, support: None }
}

/// A strike onto the middle of the puck.
fn strike(speed_m_s: f64, heading_rad: f64) -> Strike {
    let start_m = PUCK - Vec2::from_heading(heading_rad) * 0.09;
    Strike { object: None, start_m, heading_rad, speed_m_s, travel_m: 0.08 }
}

/// 640 x 400 px from 0.7 m above a point ahead of the striker, tilted by 9 degrees.
fn view() -> View {
    let at = Transform { position_m: [0.06, -0.12, 0.7], rpy_rad: [0.15, 0.05, 0.05] };
    let mut camera = Camera::new([640, 400], Lens::pinhole([640, 400], 700.0), at);
    camera.exposure_s = Some(0.004);
    View { shading: [0.3, -0.2], noise: 3.0, ..View::new(camera) }
}

/// What a film of `real` shows if `given` is what the campaign says.
fn seen(real: &Strike, given: &Strike, striker: &Striker, is_drawn: bool) -> Option<StrikerTrack> {
    let drawn = if is_drawn { vec![Thing::striker(striker, Pose::default())] } else { Vec::new() };
    seen_from(view(), real, given, striker, &drawn).striker
}

fn seen_from(view: View, real: &Strike, given: &Strike, striker: &Striker, drawn: &[Thing]) -> Tracks {
    let puck = puck();
    let along = Vec2::from_heading(real.heading_rad);
    let gap_m = 0.09 - PUCK_RADIUS_M - striker.shape.reach_m(Vec2::new(1.0, 0.0));
    let impact_s = START_S + gap_m / real.speed_m_s;
    let times_s: Vec<f64> = (0..30).map(|k| f64::from(k) / RATE_HZ).collect();
    let frames = film(&view, &times_s, |t| {
        let moved_m = ((t - START_S).max(0.0) * real.speed_m_s).min(real.travel_m);
        let is_moving = t > START_S && moved_m < real.travel_m;
        let pose = Pose { position: real.start_m + along * moved_m, yaw_rad: real.heading_rad };
        let velocity = if is_moving { along * real.speed_m_s } else { Vec2::ZERO };
        let first_m_s = SPEED_FACTOR * real.speed_m_s;
        let slid_s = (t - impact_s).clamp(0.0, first_m_s / DECELERATION_M_S2);
        let slid_m = slid_s * (first_m_s - DECELERATION_M_S2 * slid_s / 2.0);
        let mut things =
            Thing::object(&puck, Pose { position: PUCK + along * slid_m, yaw_rad: 0.0 }).to_vec();
        let moving = |thing: &Thing| Thing { pose, velocity, ..thing.clone() };
        things.extend(drawn.iter().map(moving));
        things
    });
    let mut cell = Cell::from_above(1000.0, Workspace::centred([0.3, 0.2]), striker.clone());
    cell.camera.exposure_s = view.camera.exposure_s;
    let capture = Capture { footage: Footage::from_frames("drawn", frames), camera: view.camera, cell };
    let options = Options { strike: Some(given), ..Options::default() };
    tracks(capture, &[puck], &["puck".into()], &Layout::Unknown, &options).expect("a track")
}

fn assert_seen(seen: Option<StrikerTrack>, real: &Strike, what: &str) {
    let seen = seen.unwrap_or_else(|| panic!("{what}: the striker is not seen"));
    let (speed, heading) = (seen.speed_m_s(), seen.heading_rad());
    let ratio = speed.value / real.speed_m_s;
    assert!((ratio - 1.0).abs() < 0.01, "{what}: {ratio} times as fast");
    let turn_deg = (heading.value - real.heading_rad).to_degrees();
    assert!(turn_deg.abs() < 0.5, "{what}: turned by {turn_deg} degrees");
    let offset_m = (seen.middle().0 - real.start_m).cross(Vec2::from_heading(real.heading_rad));
    assert!(offset_m.abs() < 1e-3, "{what}: {offset_m} m aside");
    if let Some(start) = seen.start_m {
        let off_m = start.distance(real.start_m);
        assert!(off_m < 1.5e-3, "{what}: starts {off_m} m from where it did");
    }
    assert!(
        (ratio - 1.0).abs() < 4.0 * speed.std / speed.value && speed.std < 0.05 * speed.value,
        "{what}: {speed:?}"
    );
}

#[test]
fn speed_heading_and_start_of_a_drawn_striker_are_measured() {
    let rod = Striker::rod(0.012, [0.1, 1.0]);
    let block = Striker { shape: Shape::Rectangle { size_m: [0.016, 0.03] }, ..rod.clone() };
    for (striker, name) in [(&rod, "rod"), (&block, "block")] {
        for (speed_m_s, heading_rad) in [(0.3, 0.0), (0.5, 0.4), (0.4, -0.7)] {
            let real = strike(speed_m_s, heading_rad);
            let what = format!("{name} at {speed_m_s} m/s, {heading_rad} rad");
            let found = seen(&real, &real, striker, true);
            assert!(found.as_ref().is_some_and(|seen| seen.start_m.is_some()), "{what}: {found:?}");
            assert_seen(found, &real, &what);
        }
    }
}

#[test]
fn a_wrong_given_strike_does_not_change_what_is_seen() {
    let (real, striker) = (strike(0.4, 0.1), Striker::rod(0.012, [0.1, 1.0]));
    let left = Vec2::from_heading(0.1).perpendicular();
    let given = [
        Strike { speed_m_s: 0.6, ..real.clone() },
        Strike { speed_m_s: 0.2, ..real.clone() },
        Strike { heading_rad: 0.25, ..real.clone() },
        Strike { start_m: real.start_m + left * 0.01, ..real.clone() },
        Strike { start_m: real.start_m - left.perpendicular() * 0.015, ..real.clone() },
    ];
    for given in &given {
        assert_seen(seen(&real, given, &striker, true), &real, &format!("given {given:?}"));
    }
}

#[test]
fn a_striker_that_is_not_in_the_film_is_not_seen() {
    let (real, striker) = (strike(0.4, 0.1), Striker::rod(0.012, [0.1, 1.0]));
    assert_eq!(seen(&real, &real, &striker, false), None);
    let elsewhere = Strike { start_m: Point::new(5.0, 5.0), ..real.clone() };
    assert_eq!(seen(&real, &elsewhere, &striker, true), None);
}

/// The camera sees the front of the foot until the striker passes below it, and the top hides the foot afterwards.
#[test]
fn a_striker_that_passes_below_the_camera_is_measured_by_its_foot() {
    let striker = Striker::rod(0.012, [0.1, 1.0]);
    let real = strike(0.4, 0.0);
    let at = Transform { position_m: [real.start_m.x + 0.065, real.start_m.y, 0.7], rpy_rad: [0.0; 3] };
    let mut camera = Camera::new([640, 400], Lens::pinhole([640, 400], 700.0), at);
    camera.exposure_s = Some(0.004);
    let view = View { shading: [0.3, -0.2], noise: 3.0, ..View::new(camera) };
    let drawn = [Thing::striker(&striker, Pose::default())];
    assert_seen(seen_from(view, &real, &real, &striker, &drawn).striker, &real, "below the camera");
}

/// The instant of the first motion is known to two of its standard deviations.
fn assert_onset(view: View, drawn: &[Thing], real: &Strike) {
    let striker = Striker::rod(0.012, [0.1, 1.0]);
    let found = seen_from(view, real, real, &striker, drawn).striker_onset_s.expect("a motion");
    let error = (found.value - START_S) * RATE_HZ;
    println!("{error:.3} frames");
    assert!(error.abs() < 0.12, "{} m/s: {error} frames, {found:?}", real.speed_m_s);
}

/// A bar that moves by more than its width changes no more pixels in two frames than in one. Of the bar alone nothing is left to measure.
#[test]
fn the_first_motion_of_an_arm_with_a_narrow_bar_is_measured() {
    let flat =
        |size_m, height_m, grey| Thing::flat(Shape::Rectangle { size_m }, Pose::default(), height_m, grey);
    for (grey, speed_m_s) in [(60.0, 0.3), (220.0, 0.4), (60.0, 0.5)] {
        let drawn = [flat([0.06, 0.07], 0.1, 150.0), flat([0.008, 0.05], 0.101, grey)];
        let real = strike(speed_m_s, 0.1);
        assert_onset(view(), &drawn, &real);
        let striker = Striker::rod(0.012, [0.1, 1.0]);
        let alone = seen_from(view(), &real, &real, &striker, &drawn[1..]).striker_onset_s;
        let error_s = |onset_s: Measured| (onset_s.value - START_S).abs();
        assert!(alone.is_none_or(|onset_s| error_s(onset_s) < 2.0 * onset_s.std), "{alone:?}");
    }
}

/// Contrasts that are little more than noise show a change of pixels only after some displacement.
#[test]
fn the_first_motion_of_an_arm_of_little_contrast_is_measured() {
    for speed_m_s in [0.3, 0.4, 0.5] {
        let shape = Shape::Rectangle { size_m: [0.06, 0.07] };
        let arm = Thing::flat(shape, Pose::default(), 0.1, 118.0);
        let view = View { noise: 1.0, ..view() };
        assert_onset(view, &[arm], &strike(speed_m_s, 0.1));
    }
}

/// The arm hides the striker, and its length and height are not given.
#[test]
fn the_first_motion_of_an_arm_above_the_striker_is_measured() {
    let striker = Striker::rod(0.012, [0.1, 1.0]);
    for (grey, speed_m_s) in [(200.0, 0.3), (60.0, 0.5), (150.0, 0.7)] {
        let shape = Shape::Rectangle { size_m: [0.06, 0.07] };
        let flat = Thing::flat(shape, Pose::default(), 0.1, grey);
        let arm = Thing { thickness_m: 0.03, ..flat };
        let real = strike(speed_m_s, 0.1);
        assert_onset(view(), &[arm], &real);
    }
    let elsewhere = Strike { start_m: Point::new(5.0, 5.0), ..strike(0.4, 0.1) };
    let found = seen_from(view(), &strike(0.4, 0.1), &elsewhere, &striker, &[]);
    assert_eq!(found.striker_onset_s, None);
}

/// Foot and top are as light as each other and equally round, and a dark rod on the top leaves a ring of it.
#[test]
fn a_light_striker_below_a_dark_rod_is_measured_by_foot_and_top_together() {
    let striker = Striker { height_m: 0.055, ..Striker::rod(0.012, [0.1, 1.0]) };
    let body = Thing { grey: 215.0, side_grey: 165.0, ..Thing::striker(&striker, Pose::default()) };
    let shape = Shape::Disc { radius_m: 0.0063 };
    let flat = Thing::flat(shape, Pose::default(), 0.3, 25.0);
    let rod = Thing { thickness_m: 0.3 - striker.height_m, ..flat };
    for (speed_m_s, heading_rad) in [(0.45, 0.0), (0.55, 0.1), (0.4, -0.1)] {
        let real = strike(speed_m_s, heading_rad);
        let at = Transform { position_m: [0.08, 0.02, 1.12], rpy_rad: [0.0; 3] };
        let mut camera = Camera::new([640, 400], Lens::pinhole([640, 400], 1100.0), at);
        camera.exposure_s = Some(0.002);
        let view = View { table_grey: 90.0, noise: 2.0, ..View::new(camera) };
        let found = seen_from(view, &real, &real, &striker, &[body.clone(), rod.clone()]);
        assert_seen(found.striker, &real, &format!("{speed_m_s} m/s, {heading_rad} rad"));
    }
}

/// A motion through two or three positions of which one is something else fits as well as one through the striker's.
#[test]
fn two_or_three_positions_are_no_motion_unless_the_rest_position_is_on_their_line() {
    let times_s = [0.0, 0.1, 0.2, 0.3, 0.4];
    let position = |k: usize| (times_s[k], Point::new(0.1 * times_s[k], 0.0));
    let (rest, all) = (Some(Point::ORIGIN), [0, 1, 2, 3].map(position));
    assert!(is_redundant(&all, None, &times_s));
    assert!(!is_redundant(&all[..3], None, &times_s));
    assert!(is_redundant(&all[..3], rest, &times_s));
    assert!(!is_redundant(&all[..2], rest, &times_s));
    let with_gaps = [0, 2, 4].map(position);
    assert!(is_redundant(&with_gaps, rest, &times_s));
    let finer_s: Vec<f64> = (0..9).map(|k| 0.05 * f64::from(k)).collect();
    assert!(!is_redundant(&with_gaps, rest, &finer_s), "seen in three of nine frames");
}

/// Where the struck object hides a part of the outline, the last position before the impact lags behind.
#[test]
fn a_last_position_that_lags_is_no_position() {
    let step_m = 6e-4;
    let scatter_m = [1e-4, -1e-4, 0.0, 1e-4, -1e-4, 0.0];
    let at = |k: usize| (k as f64 / 60.0, Point::new(6e-3 * k as f64 + scatter_m[k], scatter_m[5 - k]));
    let mut positions: Vec<(f64, Point)> = (0..6).map(at).collect();
    assert_eq!(without_outliers(positions.clone(), step_m), positions);
    positions[5].1.x -= 2e-3;
    assert_eq!(without_outliers(positions.clone(), step_m), positions[..5]);
}
