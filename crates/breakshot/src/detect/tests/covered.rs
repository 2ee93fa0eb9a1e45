//! Markers under shadows and behind the arm.

use super::*;
use crate::object::Dot;

/// Grey levels of a red brick and of the black ink on it, in luma, and of the table.
const BRICK_GREY: f64 = 79.0;
const INK_GREY: f64 = 13.0;
const TABLE_GREY: f64 = 150.0;
/// The light that remains in a shadow.
const SHADE: f64 = 0.4;
/// Half of the width of the shadow of the striker and its arm (m).
const SHADOW_HALF_WIDTH_M: f64 = 0.009;
/// Beyond these errors a sample is wrong unless it is doubtful, and beyond the last it is not the object.
const WRONG_MM: f64 = 0.5;
const WRONG_DEG: f64 = 2.0;
const FAR_MM: f64 = 2.0;

/// Checks that no sample of an object with a bar is wrong without being doubtful, and gives the number of doubtful ones.
fn doubtful_samples(samples: &[Sample], motion: impl Fn(f64) -> Pose) -> usize {
    for s in samples {
        let (off_mm, pose) = (error_mm(s, motion(s.time_s)), motion(s.time_s));
        let turned_rad = s.yaw_rad.map_or(0.0, |yaw_rad| wrapped_rad(2.0 * (yaw_rad - pose.yaw_rad)) / 2.0);
        let is_right = off_mm < WRONG_MM && turned_rad.to_degrees().abs() < WRONG_DEG;
        let seen =
            format!("{off_mm:.2} mm and {:.1} degrees off at {:.3} s", turned_rad.to_degrees(), s.time_s);
        assert!(is_right || s.doubtful, "{seen}, and not doubtful");
        assert!(off_mm < FAR_MM, "{seen}");
    }
    samples.iter().filter(|s| s.doubtful).count()
}

/// Shades the points at a height that are in the shadow at the time of each frame.
fn shade(view: &View, frames: &mut [Frame], height_m: f64, is_in_shadow: impl Fn(Point, f64) -> bool) {
    shade_by(SHADE, view, frames, height_m, is_in_shadow);
}

/// The same, where a part `light` of the light remains.
fn shade_by(
    light: f64,
    view: &View,
    frames: &mut [Frame],
    height_m: f64,
    is_in_shadow: impl Fn(Point, f64) -> bool,
) {
    for frame in frames {
        for (k, grey) in frame.image.pixels.iter_mut().enumerate() {
            let pixel = crate::geometry::Pixel::new((k % 640) as f64, (k / 640) as f64);
            if is_in_shadow(view.camera.table_from_pixel(pixel, height_m), frame.time_s) {
                *grey = (f64::from(*grey) * light).round() as u8;
            }
        }
    }
}

#[test]
fn the_bar_on_a_red_brick_is_followed_while_the_strikers_shadow_crosses_it() {
    let mut view = View { table_grey: TABLE_GREY, ..view() };
    view.camera.exposure_s = Some(0.004);
    let brick = object("brick", bar(0.06, 0.045), bar(0.024, 0.012));
    let start = Pose::new(-0.05, 0.0, 0.5);
    let motion = |t: f64| slid(start, Vec2::new(0.6, 0.1), 3.0, t);
    let mut frames = film(&view, &times_s(32), |t| {
        let (pose, velocity, rate) = motion(t);
        let [mut body, mut marker] = Thing::object(&brick, pose);
        (body.grey, body.side_grey, marker.grey) = (BRICK_GREY, 0.5 * BRICK_GREY, INK_GREY);
        [body, marker].map(|thing| thing.moving(velocity, rate)).to_vec()
    });
    // The shadow is ahead of the striker, which stops behind the brick.
    let tip_m = |t: f64| start.position.x + 0.02 + 0.5 * (t.min(0.2) - 0.1);
    shade(&view, &mut frames, brick.height_m, |at, t| {
        at.x < tip_m(t) && (at.y - 0.004).abs() < SHADOW_HALF_WIDTH_M
    });
    let tracks = found(&view, frames, &[brick], &Layout::Unknown).expect("tracks");
    let samples = &tracks.tracks[0].samples;
    assert_eq!(samples.len(), 32, "{:?}", tracks.warnings);
    let doubtful = doubtful_samples(samples, |t| motion(t).0);
    assert!(doubtful <= 8, "{doubtful} of 32 samples are doubtful");
}

/// Checks that a sliding light bar is found in all 30 frames while an arm as light covers one end of it at some times, and gives the last
/// sample with its error (mm).
fn followed_behind_an_arm(is_covered: impl Fn(f64) -> bool) -> (Sample, f64) {
    let view = View { table_grey: 110.0, ..view() };
    let objects = [object("a", bar(0.07, 0.05), bar(0.024, 0.01))];
    let motion = |t: f64| slid(Pose::new(-0.03, 0.0, 0.3), Vec2::new(0.35, 0.0), 2.0, t);
    let frames = film(&view, &times_s(30), |t| {
        let (pose, velocity, rate) = motion(t);
        let [mut body, mut marker] = Thing::object(&objects[0], pose);
        (body.grey, marker.grey) = (80.0, 180.0);
        let mut things = [body, marker].map(|thing| thing.moving(velocity, rate)).to_vec();
        if is_covered(t) {
            let end = pose.table_from_body(Point::new(-0.032, 0.0));
            let arm = Thing::flat(disc(0.026), Pose { position: end, yaw_rad: 0.0 }, 0.031, 180.0);
            things.push(arm.moving(velocity, 0.0));
        }
        things
    });
    let mut tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    let samples = &mut tracks.tracks[0].samples;
    assert_eq!(samples.len(), 30, "{:?}", tracks.warnings);
    doubtful_samples(samples, |t| motion(t).0);
    let last = samples.pop().expect("a sample");
    let off_mm = error_mm(&last, motion(last.time_s).0);
    (last, off_mm)
}

#[test]
fn a_light_bar_is_followed_while_an_arm_as_light_covers_one_end_of_it() {
    let (last, off_mm) = followed_behind_an_arm(|t| (0.15..0.3).contains(&t));
    assert!(!last.doubtful && off_mm < 0.1, "{last:?}");
}

#[test]
fn a_bar_that_an_arm_covers_partly_at_first_is_tracked_from_the_first_frame_on() {
    followed_behind_an_arm(|t| t < 0.1);
}

#[test]
fn a_light_disc_and_its_dot_are_found_although_a_shadow_lies_across_them_in_all_frames() {
    let mut view = View { table_grey: TABLE_GREY, ..view() };
    view.camera.exposure_s = Some(0.004);
    let dot = Some(Dot { radius_m: 0.006, at_m: Point::new(0.017, 0.012) });
    let marker = Some(Marker { dot, ..Marker::centred(disc(0.0125)) });
    let puck = Object { marker, ..object("puck", disc(0.038), disc(0.01)) };
    let start = Pose::new(-0.05, 0.0, 0.8);
    let motion = |t: f64| slid(start, Vec2::new(0.5, 0.0), 3.0, t);
    let mut frames = film(&view, &times_s(32), |t| {
        let (pose, velocity, rate) = motion(t);
        let things = painted(&puck, pose, [75.0, 240.0]).into_iter();
        things.map(|thing| thing.moving(velocity, rate)).collect()
    });
    shade(&view, &mut frames, puck.height_m, |at, _| (0.0..0.018).contains(&at.y));
    let tracks = found(&view, frames, &[puck], &Layout::Unknown).expect("tracks");
    let samples = &tracks.tracks[0].samples;
    assert_eq!(samples.len(), 32, "{:?}", tracks.warnings);
    doubtful_samples(samples, |t| motion(t).0);
}

/// The number of doubtful samples of a disc and its dot that are struck and slide, blurred by some pixels, along the border of a shadow, which is
/// this far beside the centre of the disc.
fn doubtful_along_shadow(greys: [f64; 2], beside_m: f64) -> usize {
    const REMAINING_LIGHT: f64 = 0.6;
    let mut view = View { table_grey: TABLE_GREY, noise: 2.0, ..view() };
    view.camera.exposure_s = Some(0.014);
    let dot = Some(Dot { radius_m: 0.006, at_m: Point::new(0.004, 0.021) });
    let marker = Some(Marker { dot, ..Marker::centred(disc(0.0125)) });
    let puck = Object { marker, ..object("puck", disc(0.038), disc(0.01)) };
    let start = Pose::new(-0.05, 0.0, 0.3);
    let motion = |t: f64| slid(start, Vec2::new(0.5, 0.0), 0.0, t);
    let mut frames = film(&view, &times_s(20), |t| {
        let (pose, velocity, rate) = motion(t);
        painted(&puck, pose, greys).into_iter().map(|thing| thing.moving(velocity, rate)).collect()
    });
    let is_in_shadow = |at: Point, t: f64| t > 0.1 && at.y > beside_m;
    shade_by(REMAINING_LIGHT, &view, &mut frames, puck.height_m, is_in_shadow);
    let tracks = found(&view, frames, &[puck], &Layout::Unknown).expect("tracks");
    let samples = &tracks.tracks[0].samples;
    assert_eq!(samples.len(), 20, "{:?}", tracks.warnings);
    doubtful_samples(samples, |t| motion(t).0)
}

#[test]
fn a_disc_and_its_dot_are_followed_while_they_slide_along_a_shadow() {
    for greys in [[150.0, 20.0], [80.0, 200.0]] {
        for beside_m in [0.0, 0.008] {
            let doubtful = doubtful_along_shadow(greys, beside_m);
            assert!(doubtful <= 1, "{doubtful} of {greys:?}, {beside_m} m beside the centre");
        }
    }
}

/// Checks that no trusted sample is wrong of a light bar that lies or slides under two shadows: the first one ends this far ahead of the bar's
/// start and follows at half of its speed, and the second one lies along a line of this slope at this distance from it (m).
fn check_under_two_shadows(ahead_m: f64, slope: f64, beside_m: f64, speed_m_s: f64) {
    let mut view = View { table_grey: TABLE_GREY, ..view() };
    view.camera.exposure_s = Some(0.015);
    let puck = object("puck", disc(0.036), bar(0.038, 0.018));
    let start = Pose::new(-0.03, 0.0, 0.0);
    let motion = |t: f64| slid(start, Vec2::new(speed_m_s + 1e-9, 0.0), 0.0, t);
    let mut frames = film(&view, &times_s(24), |t| {
        let (pose, velocity, rate) = motion(t);
        let [mut body, mut marker] = Thing::object(&puck, pose);
        (body.grey, marker.grey) = (60.0, 230.0);
        [body, marker].map(|thing| thing.moving(velocity, rate)).to_vec()
    });
    let struck_s = |t: f64| (t - 0.1).clamp(0.0, 0.2);
    let end_m = |t: f64| start.position.x + ahead_m + 0.5 * speed_m_s * struck_s(t);
    shade(&view, &mut frames, puck.height_m, |at, t| at.x < end_m(t));
    shade(&view, &mut frames, puck.height_m, |at, t| {
        at.y + slope * (at.x - start.position.x) > beside_m - 0.2 * struck_s(t)
    });
    let tracks = found(&view, frames, std::slice::from_ref(&puck), &Layout::Unknown).expect("tracks");
    for s in tracks.tracks[0].samples.iter().filter(|s| !s.doubtful) {
        let off_mm = error_mm(s, motion(s.time_s).0);
        assert!(off_mm < WRONG_MM, "{off_mm:.2} mm off at {:.3} s", s.time_s);
    }
}

#[test]
fn a_bar_that_slides_out_of_a_shadow_is_right_or_doubtful() {
    check_under_two_shadows(0.009, -1.0, -0.018, 0.6);
    check_under_two_shadows(0.0, -1.0, 0.0, 0.6);
    check_under_two_shadows(-0.012, 0.0, -0.018, 0.6);
}

#[test]
fn a_bar_that_lies_partly_in_a_shadow_is_right_or_doubtful() {
    check_under_two_shadows(-0.015, 0.0, -0.018, 0.0);
    check_under_two_shadows(-0.012, 0.0, -0.018, 0.0);
}

/// Checks that the yaw of a dark bar is right or doubtful on a moving top that is a little darker on one side of a line of this slope and
/// height above its centre (m), and that its error is below a limit (degrees, rms).
fn check_under_a_faint_shadow(slope: f64, above_m: f64, most_deg: f64) {
    const FAINT: f64 = 0.8;
    let mut view = View { table_grey: TABLE_GREY, ..view() };
    view.camera.exposure_s = Some(0.014);
    let puck = object("puck", disc(0.03), bar(0.028, 0.011));
    let motion = |t: f64| slid(Pose::new(-0.05, 0.0, 0.7), Vec2::new(0.5, 0.08), 0.5, t);
    let mut frames = film(&view, &times_s(32), |t| {
        let (pose, velocity, rate) = motion(t);
        let [mut body, mut marker] = Thing::object(&puck, pose);
        (body.grey, marker.grey) = (75.0, INK_GREY);
        [body, marker].map(|thing| thing.moving(velocity, rate)).to_vec()
    });
    shade_by(FAINT, &view, &mut frames, puck.height_m, |at, t| {
        let off = at - motion(t).0.position;
        off.y + slope * off.x > above_m
    });
    let tracks = found(&view, frames, &[puck], &Layout::Unknown).expect("tracks");
    let samples = &tracks.tracks[0].samples;
    assert_eq!(samples.len(), 32, "{:?}", tracks.warnings);
    doubtful_samples(samples, |t| motion(t).0);
    let turned_deg = |s: &Sample| {
        s.yaw_rad.map(|yaw_rad| (yaw_rad - motion(s.time_s).0.yaw_rad).sin().asin().to_degrees())
    };
    let turned_deg: Vec<f64> = samples.iter().filter_map(turned_deg).collect();
    assert!(rms(&turned_deg) < most_deg, "{turned_deg:?}");
}

#[test]
fn a_faint_shadow_beside_a_moving_bar_does_not_turn_it() {
    // The second moments alone are off by 0.6, 0.8 and 1.5 degrees, and by up to 5.
    check_under_a_faint_shadow(-0.5, -0.002, 0.5);
    check_under_a_faint_shadow(-1.5, 0.006, 0.7);
    check_under_a_faint_shadow(-0.5, 0.006, 1.0);
}

/// The shadow leaves a part of the marker that is too small to be it, while a marker of the same size lies a hand's breadth away.
#[test]
fn a_marker_under_a_shadow_is_not_exchanged_for_that_of_another_object() {
    let mut view = View { table_grey: TABLE_GREY, ..view() };
    view.camera.exposure_s = Some(0.004);
    let plain =
        Object { marker: Some(Marker::centred(disc(0.0084))), ..object("plain", disc(0.025), disc(0.0084)) };
    let dot = Some(Dot { radius_m: 0.0065, at_m: Point::new(0.004, 0.0165) });
    let marker = Some(Marker { dot, ..Marker::centred(disc(0.0088)) });
    let dotted = Object { marker, ..object("dotted", disc(0.03), disc(0.0088)) };
    let poses = [Pose::new(0.04, -0.01, 0.0), Pose::new(-0.03, 0.02, 0.2)];
    let objects = [plain, dotted];
    let mut frames = film(&view, &times_s(32), |_| {
        objects.iter().zip(poses).flat_map(|(object, pose)| painted(object, pose, [150.0, 30.0])).collect()
    });
    shade_by(0.25, &view, &mut frames, objects[0].height_m, |at, t| {
        at.distance(poses[0].position) < 0.03 && at.x < poses[0].position.x + 0.12 * (t - 0.2)
    });
    let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    for (track, pose) in tracks.tracks.iter().zip(poses) {
        let far = track.samples.iter().find(|s| error_mm(s, pose) > FAR_MM);
        assert!(far.is_none(), "`{}`: {far:?}", track.object);
    }
}

/// The border of a shadow lies across a marker of a few pixels in all frames; the outline of the block is well visible.
#[test]
fn a_block_is_followed_by_its_own_outline_where_a_shadow_lies_across_a_small_marker() {
    let view = View { table_grey: 200.0, ..view() };
    let block = object("block", bar(0.065, 0.045), bar(0.012, 0.005));
    let motion = |t: f64| slid(Pose::new(-0.06, 0.0, 0.4), Vec2::new(0.3, 0.0), 1.0, t);
    let mut frames = film(&view, &times_s(32), |t| {
        let (pose, velocity, rate) = motion(t);
        let [mut body, mut marker] = Thing::object(&block, pose);
        (body.grey, body.side_grey, marker.grey) = (90.0, 60.0, INK_GREY);
        [body, marker].map(|thing| thing.moving(velocity, rate)).to_vec()
    });
    shade_by(0.5, &view, &mut frames, block.height_m, |at, _| (0.0..0.015).contains(&at.y));
    let tracks = found(&view, frames, &[block], &Layout::Unknown).expect("tracks");
    let samples = &tracks.tracks[0].samples;
    assert_eq!(samples.len(), 32, "{:?}", tracks.warnings);
    let doubtful = doubtful_samples(samples, |t| motion(t).0);
    let off_mm: Vec<f64> = samples.iter().map(|s| error_mm(s, motion(s.time_s).0)).collect();
    println!("{doubtful} of 32 samples are doubtful; {:.3} mm off (root mean square)", rms(&off_mm));
    assert!(doubtful <= 1 && rms(&off_mm) < 0.15, "{doubtful} doubtful, {:.3} mm off", rms(&off_mm));
}
