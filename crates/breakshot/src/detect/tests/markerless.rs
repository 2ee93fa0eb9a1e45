//! Objects without markers, in synthetic films.

use super::*;
use crate::detect::marker::target::Target;
use crate::detect::markerless::edge_fit::LEAST_MEASURED;
use crate::detect::markerless::edge_visibility::OutlineView;
use crate::synthetic::film::picture;
use std::f64::consts::TAU;

fn bare(name: &str, shape: Shape) -> Object {
    Object { marker: None, ..object(name, shape, disc(0.01)) }
}

fn body(object: &Object, pose: Pose, velocity: Vec2, rate: f64) -> Thing {
    let [body, _] = Thing::object(object, pose);
    body.moving(velocity, rate)
}

/// A regular polygon with corners at 30 mm.
fn regular(corners: u32) -> Shape {
    let step_rad = TAU / f64::from(corners);
    let corner = |k: u32| Point::ORIGIN + Vec2::new(0.03, 0.0).rotated(f64::from(k) * step_rad);
    Shape::Polygon { points_m: (0..corners).map(corner).collect() }
}

/// The shadow that a thing casts on the table in one direction, drawn in some parts from its foot to the shadow of its top at a distance.
fn shadow(shape: &Shape, pose: Pose, top_m: Vec2, parts: u32, grey: f64) -> impl Iterator<Item = Thing> {
    (0..=parts).map(move |k| {
        let position = pose.position + top_m * (f64::from(k) / f64::from(parts));
        Thing::flat(shape.clone(), Pose { position, ..pose }, 0.0, grey)
    })
}

fn corner() -> Shape {
    let points = [(0.0, 0.0), (0.07, 0.0), (0.07, 0.03), (0.03, 0.03), (0.03, 0.05), (0.0, 0.05)];
    let mut shape = Shape::Polygon { points_m: points.map(|(x, y)| Point::new(x, y)).to_vec() };
    shape.check_and_centre("a corner").expect("a polygon");
    shape
}

#[test]
fn outlines_are_tracked_like_markers() {
    let view = view();
    let objects = [bare("a", disc(0.028)), bare("b", bar(0.06, 0.04)), bare("c", corner())];
    let starts = [Pose::new(-0.17, 0.08, 0.0), Pose::new(-0.1, -0.09, 0.4), Pose::new(0.03, 0.03, 2.0)];
    let velocities = [Vec2::new(0.7, 0.1), Vec2::new(0.6, 0.0), Vec2::new(0.3, -0.2)];
    let motion = |k: usize, t: f64| slid(starts[k], velocities[k], 3.0 * k as f64, t);
    let frames = film(&view, &times_s(24), |t| {
        let thing = |k: usize| {
            let (pose, velocity, rate) = motion(k, t);
            body(&objects[k], pose, velocity, rate)
        };
        (0..3).map(thing).collect()
    });
    let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    for (k, track) in tracks.tracks.iter().enumerate() {
        assert_eq!(track.samples.len(), 24, "{}: {:?}", track.object, tracks.warnings);
        let off: Vec<f64> = track.samples.iter().map(|s| error_mm(s, motion(k, s.time_s).0)).collect();
        // The rectangle determines its yaw modulo half a turn.
        let period = if k == 1 { 2.0 } else { 1.0 };
        let yaw_error_deg = |s: &Sample| {
            let off_rad = s.yaw_rad.map_or(0.0, |yaw| yaw - motion(k, s.time_s).0.yaw_rad);
            (wrapped_rad(period * off_rad) / period).to_degrees()
        };
        let off_deg: Vec<f64> = track.samples.iter().map(yaw_error_deg).collect();
        println!("{}: position rms {:.3} mm, yaw rms {:.3} deg", track.object, rms(&off), rms(&off_deg));
        assert_eq!(track.samples[0].yaw_rad.is_none(), k == 0, "only the disc has no yaw");
        assert!(rms(&off) < 0.08, "{}: {:?} mm", track.object, off);
        assert!(rms(&off_deg) < 0.25, "{}: {:?} deg", track.object, off_deg);
    }
}

#[test]
fn an_outline_of_another_size_is_found_and_its_size_reported() {
    let view = view();
    let pose = Pose::new(0.02, 0.03, 0.5);
    for (given, drawn, seen) in [
        (disc(0.0258), disc(0.028), "radius"),
        (disc(0.0302), disc(0.028), "radius"),
        (bar(0.0645, 0.043), bar(0.06, 0.04), "x"),
    ] {
        let (given, drawn) = (bare("a", given), bare("a", drawn));
        let frames = film(&view, &times_s(8), |_| vec![body(&drawn, pose, Vec2::ZERO, 0.0)]);
        let tracks = found(&view, frames, std::slice::from_ref(&given), &Layout::Unknown).expect("tracks");
        let off = tracks.tracks[0].samples.iter().map(|s| error_mm(s, pose)).fold(0.0, f64::max);
        println!("{:?}: {off:.3} mm, {:?}", given.shape, tracks.warnings);
        assert!(off < 0.1 && tracks.tracks[0].samples.len() == 8, "{off} mm: {:?}", tracks.warnings);
        let sizes: Vec<&String> =
            tracks.warnings.iter().filter(|w| w.starts_with("the outline of `a` is")).collect();
        assert!(sizes.len() == 1 && sizes[0].contains(seen), "{:?}", tracks.warnings);
        // The size in the warning is the drawn one.
        let words: Vec<&str> = sizes[0].split(": ").nth(1).unwrap_or_default().split(' ').collect();
        let mm: f64 = words.iter().find_map(|word| word.parse().ok()).expect("a number");
        let right_mm = match drawn.shape {
            Shape::Disc { radius_m } => 1e3 * radius_m,
            Shape::Rectangle { size_m } => 1e3 * size_m[0],
            Shape::Polygon { .. } => f64::NAN,
        };
        assert!((mm / right_mm - 1.0).abs() < 0.015, "{mm} mm, drawn with {right_mm}");
    }
}

#[test]
fn an_outline_that_is_not_there_is_not_found_in_another_size() {
    let view = view();
    let (there, absent) = (bare("a", disc(0.028)), bare("b", bar(0.09, 0.02)));
    let frames =
        film(&view, &times_s(8), |_| vec![body(&there, Pose::new(0.02, 0.03, 0.0), Vec2::ZERO, 0.0)]);
    let error =
        found(&view, frames, &[there.clone(), absent], &Layout::Unknown).expect_err("one object is missing");
    assert!(error.to_string().contains("none of them for `b`"), "{error}");
}

#[test]
fn an_outline_specified_too_large_causes_no_bias() {
    let view = view();
    let (specified, drawn) = (bare("a", disc(0.0283)), bare("a", disc(0.028)));
    for pose in [Pose::new(-0.17, 0.08, 0.0), Pose::new(0.08, -0.06, 0.0)] {
        let frames = film(&view, &times_s(4), |_| vec![body(&drawn, pose, Vec2::ZERO, 0.0)]);
        let tracks =
            found(&view, frames, std::slice::from_ref(&specified), &Layout::Unknown).expect("tracks");
        let off: Vec<f64> = tracks.tracks[0].samples.iter().map(|s| error_mm(s, pose)).collect();
        println!("0.3 mm too large: {:.3} mm off", rms(&off));
        assert!(off.len() == 4 && rms(&off) < 0.08, "{off:?} mm");
    }
}

#[test]
fn outlines_that_touch_are_distinguished() {
    let view = view();
    let objects = [bare("a", disc(0.028)), bare("b", bar(0.05, 0.04))];
    // The disc stops at the side of the bar, and the bar moves on.
    let contact_s = 0.25;
    let disc_at = |t: f64| Pose::new(-0.1 + 0.6 * (t.min(contact_s) - 0.1).max(0.0), 0.0, 0.0);
    let bar_at = |t: f64| {
        Pose::new(0.0435 + 0.5 * (t - contact_s).max(0.0), 0.0, 0.1 + 2.0 * (t - contact_s).max(0.0))
    };
    let frames = film(&view, &times_s(26), |t| {
        let (before, after) = (t > 0.1 && t < contact_s, t > contact_s);
        let velocity = |moves: bool, speed_m_s: f64| Vec2::new(if moves { speed_m_s } else { 0.0 }, 0.0);
        vec![
            body(&objects[0], disc_at(t), velocity(before, 0.6), 0.0),
            body(&objects[1], bar_at(t), velocity(after, 0.5), if after { 2.0 } else { 0.0 }),
        ]
    });
    let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    for (track, truth) in tracks.tracks.iter().zip([&disc_at as &dyn Fn(f64) -> Pose, &bar_at]) {
        assert_eq!(track.samples.len(), 26, "{}: {:?}", track.object, tracks.warnings);
        for s in &track.samples {
            let off = error_mm(s, truth(s.time_s));
            assert!(off < 0.4 || s.doubtful, "{} is {off} mm off at {} s", track.object, s.time_s);
        }
    }
}

#[test]
fn an_object_as_grey_as_the_table_is_found_with_an_image_of_the_empty_table() {
    // A table with a broad dark stripe, against which the object alone has no contrast.
    let view = view();
    let objects = [bare("a", disc(0.03))];
    let pose = Pose::new(-0.02, 0.01, 0.0);
    let stripe = Thing::flat(bar(0.2, 0.5), Pose::new(-0.1, 0.0, 0.0), 0.0, 120.0);
    let empty = picture(&view, std::slice::from_ref(&stripe));
    let frames = film(&view, &times_s(3), |_| vec![stripe.clone(), body(&objects[0], pose, Vec2::ZERO, 0.0)]);
    let names = ["a".to_string()];
    let clip = Clip {
        name: "drawn".into(),
        camera: &view.camera,
        targets: targets(&objects, &names).expect("one"),
        given: None,
        is_recorded: false,
    };
    let options = Options { table: Some(&empty), ..Options::default() };
    let tracks = clip
        .explained(&objects, &mut frames.into_iter().map(Ok), &Layout::Unknown, &options)
        .expect("tracks")
        .tracks;
    let off: Vec<f64> = tracks.tracks[0].samples.iter().map(|s| error_mm(s, pose)).collect();
    assert!(off.len() == 3 && rms(&off) < 0.15, "{off:?} mm");
}

#[test]
fn an_irregular_outline_is_found_at_any_yaw_beside_its_shadow() {
    // The shadow is as dark as the top: the centroid of their silhouette is millimetres off.
    const SHADOW: Vec2 = Vec2 { x: 0.003, y: -0.004 };
    let view = view();
    let points = [
        (0.0404, 0.0104),
        (0.0132, 0.0337),
        (-0.0111, 0.0338),
        (-0.0403, -0.0062),
        (-0.0126, -0.0346),
        (0.0101, -0.0356),
    ];
    let mut shape = Shape::Polygon { points_m: points.map(|(x, y)| Point::new(x, y)).to_vec() };
    shape.check_and_centre("a stone").expect("a polygon");
    let stone = bare("a", shape.clone());
    for k in 0..16 {
        let pose = Pose::new(-0.05 + 0.003 * f64::from(k), 0.02, 0.4 * f64::from(k));
        let shadow = Pose { position: pose.position + SHADOW, ..pose };
        let frames = film(&view, &times_s(2), |_| {
            let body = body(&stone, pose, Vec2::ZERO, 0.0);
            vec![
                Thing::flat(shape.clone(), shadow, 1e-4, 90.0),
                Thing { grey: 95.0, side_grey: 40.0, ..body },
            ]
        });
        let tracks = found(&view, frames, std::slice::from_ref(&stone), &Layout::Unknown).expect("tracks");
        let sample = tracks.tracks[0].samples[0];
        let off_deg = wrapped_rad(sample.yaw_rad.expect("a yaw") - pose.yaw_rad).abs().to_degrees();
        let off_mm = error_mm(&sample, pose);
        println!("{k}: {off_mm:.2} mm, {off_deg:.2} deg");
        assert!(off_mm < 0.3 && off_deg < 1.0, "yaw {}: {off_mm} mm, {off_deg} degrees off", pose.yaw_rad);
    }
}

#[test]
fn an_outline_of_which_one_direction_is_hardly_measured_is_less_certain() {
    let view = view();
    let brick = bare("a", bar(0.06, 0.045));
    let pose = Pose::new(-0.02, 0.01, 0.0);
    let plain = body(&brick, pose, Vec2::ZERO, 0.0);
    // Sheets as grey as the brick along one of its long sides and along half of the other.
    let sheet = |x: f64, y: f64| Thing::flat(bar(0.2, 0.08), Pose::new(x, y, 0.0), 0.03, plain.grey);
    let fit = |things: &[Thing]| {
        let image = picture(&view, things);
        let target = Target::new("a", &brick);
        let fit = OutlineView::of_target(&image, &view.camera, &target).fitted(pose, [0.0, 0.0]);
        fit.expect("an outline")
    };
    let (whole, part) = (
        fit(std::slice::from_ref(&plain)),
        fit(&[plain.clone(), sheet(-0.02, 0.0715), sheet(-0.115, -0.0515)]),
    );
    assert!(whole.measured_fraction > 0.8, "{whole:?}");
    assert!(part.measured_fraction < LEAST_MEASURED, "{part:?}");
    assert!(part.std_px > 1.5 * whole.std_px, "{part:?} beside {whole:?}");
}

#[test]
fn an_object_as_grey_as_its_long_shadow_is_not_taken_for_it() {
    let view = view();
    let brick = bare("a", bar(0.06, 0.045));
    let pose = Pose::new(-0.04, -0.02, 0.2);
    let mut top = body(&brick, pose, Vec2::ZERO, 0.0);
    (top.grey, top.side_grey) = (112.0, 95.0);
    // The shadow reaches from the foot to the image of the outline 58 mm away.
    let things: Vec<Thing> =
        shadow(&brick.shape, pose, Vec2::new(0.026, 0.052), 24, 95.0).chain([top]).collect();
    let frames = film(&view, &times_s(6), |_| things.clone());
    let tracks = found(&view, frames, &[brick], &Layout::Unknown).expect("tracks");
    for s in &tracks.tracks[0].samples {
        assert!(error_mm(s, pose) < 0.3 && !s.doubtful, "{s:?}");
    }
}

#[test]
fn a_dark_pentagon_is_not_taken_for_its_darker_shadow() {
    let view = View { table_grey: 118.0, ..view() };
    let pentagon = bare("a", regular(5));
    for k in 0..30 {
        // Multiples of irrational numbers modulo one are uniformly distributed.
        let n = f64::from(10 * k);
        let uniform = |factor: f64| (n * factor).fract() - 0.5;
        let pose = Pose::new(0.3 * uniform(0.618_034), 0.2 * uniform(0.754_878), 0.37 * n);
        let shadow_m = Vec2::from_heading(0.8 * n) * (0.026 + 0.012 * uniform(0.4142));
        let mut top = body(&pentagon, pose, Vec2::ZERO, 0.0);
        (top.grey, top.side_grey) = (58.0, 11.0);
        let things: Vec<Thing> = shadow(&pentagon.shape, pose, shadow_m, 12, 32.0).chain([top]).collect();
        let frames = film(&view, &times_s(1), |_| things.clone());
        let tracks = found(&view, frames, std::slice::from_ref(&pentagon), &Layout::Unknown).expect("tracks");
        let sample = tracks.tracks[0].samples[0];
        let off_mm = error_mm(&sample, pose);
        assert!(off_mm < 0.3 || sample.doubtful, "{k}: {off_mm} mm off");
    }
}

#[test]
fn an_octagon_that_is_struck_between_two_of_thirty_frames_a_second_does_not_rotate_by_its_symmetry() {
    let view = view();
    let octagon = bare("a", regular(8));
    let times_s: Vec<f64> = (0..9).map(|k| f64::from(k) / 30.0).collect();
    for variant in 0..6 {
        let start = Pose::new(-0.15, -0.02, 0.12 * f64::from(variant));
        let motion = |t: f64| slid(start, Vec2::new(0.8, 0.1), -1.0, t + 0.005 * f64::from(variant));
        let frames = film(&view, &times_s, |t| {
            let (pose, velocity, rate) = motion(t);
            vec![body(&octagon, pose, velocity, rate)]
        });
        let tracks = found(&view, frames, std::slice::from_ref(&octagon), &Layout::Unknown).expect("tracks");
        let samples = &tracks.tracks[0].samples;
        let rotation_rad = |s: &Sample| s.yaw_rad.expect("a yaw") - samples[0].yaw_rad.expect("a yaw");
        for s in samples {
            let off_rad = rotation_rad(s) - (motion(s.time_s).0.yaw_rad - start.yaw_rad);
            assert!(off_rad.abs() < 0.1, "{variant}: {s:?}: {} degrees off", off_rad.to_degrees());
        }
    }
}

#[test]
fn an_object_is_found_again_after_another_outline_was_taken_for_it_in_one_frame() {
    let view = view();
    let puck = bare("a", disc(0.028));
    let motion = |t: f64| slid(Pose::new(-0.14, 0.02, 0.0), Vec2::new(0.6, 0.0), 0.0, t);
    let frames = film(&view, &times_s(30), |t| {
        let (pose, velocity, rate) = motion(t);
        let mut things = vec![body(&puck, pose, velocity, rate)];
        if (t - 0.15).abs() < 1e-3 {
            // A sheet as grey as the table hides the puck, and half of another one shows.
            let other = Pose { position: pose.position + Vec2::new(-0.004, 0.029), ..pose };
            things.push(body(&puck, other, Vec2::ZERO, 0.0));
            let edge = other.position + Vec2::new(0.1, 0.0);
            things.push(Thing::flat(bar(0.2, 0.2), Pose { position: edge, ..pose }, 0.031, view.table_grey));
        }
        things
    });
    let tracks = found(&view, frames, &[puck], &Layout::Unknown).expect("tracks");
    let samples = &tracks.tracks[0].samples;
    assert!(samples.len() >= 28, "{} samples: {:?}", samples.len(), tracks.warnings);
    assert!(
        samples.iter().any(|s| error_mm(s, motion(s.time_s).0) > 5.0),
        "the other one was not taken for it"
    );
    for s in samples {
        let off_mm = error_mm(s, motion(s.time_s).0);
        assert!(off_mm < 0.3 || s.doubtful, "{off_mm} mm off: {s:?}");
    }
    let after = samples.iter().filter(|s| s.time_s > 0.19);
    assert!(after.clone().count() >= 18 && after.clone().all(|s| !s.doubtful), "{:?}", tracks.warnings);
}

/// From the side the camera sees half of the top's outline before the object's own side, which is as dark: the foot shows the other half.
#[test]
fn a_black_disc_with_a_black_side_is_measured_by_its_foot_too() {
    let at = Transform { position_m: [0.0, -0.3, 0.7], rpy_rad: [0.4, 0.0, 0.0] };
    let mut camera = Camera::new([640, 400], Lens::pinhole([640, 400], 700.0), at);
    camera.exposure_s = Some(0.004);
    let tilted = View { camera, ..view() };
    let puck = bare("a", disc(0.028));
    let motion = |t: f64| slid(Pose::new(-0.1, 0.03, 0.0), Vec2::new(0.5, -0.2), 0.0, t);
    let frames = film(&tilted, &times_s(24), |t| {
        let (pose, velocity, rate) = motion(t);
        vec![Thing { grey: 25.0, side_grey: 25.0, ..body(&puck, pose, velocity, rate) }]
    });
    let tracks = found(&tilted, frames, std::slice::from_ref(&puck), &Layout::Unknown).expect("a track");
    let samples = &tracks.tracks[0].samples;
    let off_mm: Vec<f64> = samples.iter().map(|s| error_mm(s, motion(s.time_s).0)).collect();
    println!("{off_mm:.3?} mm");
    assert!(samples.len() == 24 && samples.iter().all(|s| !s.doubtful), "{:?}", tracks.warnings);
    assert!(rms(&off_mm) < 0.1, "{off_mm:?} mm");
}

#[test]
fn a_disc_exactly_as_grey_as_its_shadow_is_the_one_or_the_other_and_therefore_doubtful() {
    let view = view();
    let puck = bare("a", disc(0.028));
    let mut followed = 0;
    for k in 0..16 {
        let heading_rad = 0.4 * f64::from(k);
        let pose = Pose::new(0.012 * f64::from(k) - 0.07, 0.04 - 0.007 * f64::from(k), 0.0);
        let mut top = body(&puck, pose, Vec2::ZERO, 0.0);
        (top.grey, top.side_grey) = (95.0, 95.0);
        let away_m = Vec2::from_heading(heading_rad) * (0.011 + 0.0002 * f64::from(k));
        let things: Vec<Thing> = shadow(&puck.shape, pose, away_m, 12, 95.0).chain([top]).collect();
        let frames = film(&view, &times_s(6), |_| things.clone());
        // Where neither is visible enough, the film is refused.
        let Ok(tracks) = found(&view, frames, std::slice::from_ref(&puck), &Layout::Unknown) else {
            continue;
        };
        for s in &tracks.tracks[0].samples {
            let off_mm = error_mm(s, pose);
            println!("{k}: {off_mm:.2} mm, {}", s.doubtful);
            followed += 1;
            assert!(off_mm < 0.5 || s.doubtful, "shadow at {heading_rad} rad: {off_mm} mm off: {s:?}");
        }
    }
    assert!(followed > 40, "{followed} samples");
}
