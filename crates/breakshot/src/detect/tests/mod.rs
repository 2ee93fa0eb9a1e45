//! Detection in synthetic images of known poses.

use super::*;
use crate::capture::{Footage, Lens};
use crate::cell::{CameraSpec, Cell, Striker, Tag, Transform, Workspace};
use crate::geometry::{Point, Pose, Vec2, wrapped_rad};
use crate::object::{Marker, Shape};
use crate::synthetic::film::{Thing, View, film, picture};

mod blurred;
mod covered;
mod dot;
mod markerless;
mod starts;
mod why;

fn object(name: &str, shape: Shape, marker: Shape) -> Object {
    let marker = Some(Marker::centred(marker));
    Object { name: name.into(), shape, height_m: 0.03, marker, mass_kg: None, support: None }
}

fn disc(radius_m: f64) -> Shape {
    Shape::Disc { radius_m }
}

fn bar(x: f64, y: f64) -> Shape {
    Shape::Rectangle { size_m: [x, y] }
}

/// 640 x 400 px from 0.7 m, tilted by 9 degrees, about 1 px a mm.
fn view() -> View {
    let lens = Lens::pinhole([640, 400], 700.0);
    let mut camera = Camera::new(
        [640, 400],
        lens,
        Transform { position_m: [0.01, -0.1, 0.7], rpy_rad: [0.15, 0.02, 0.05] },
    );
    camera.exposure_s = Some(0.004);
    View { shading: [0.3, -0.2], noise: 3.0, ..View::new(camera) }
}

fn times_s(frames: u32) -> Vec<f64> {
    (0..frames).map(|k| f64::from(k) / 60.0).collect()
}

fn found(view: &View, frames: Vec<Frame>, objects: &[Object], layout: &Layout) -> Result<Tracks> {
    let names: Vec<String> = objects.iter().map(|o| o.name.clone()).collect();
    Ok(explained_in(view, frames, (objects, &names), layout)?.tracks)
}

fn explained_in(
    view: &View,
    frames: Vec<Frame>,
    (objects, names): (&[Object], &[String]),
    layout: &Layout,
) -> Result<Explained> {
    let targets = targets(objects, names)?;
    let clip = Clip { name: "drawn".into(), camera: &view.camera, targets, given: None, is_recorded: true };
    clip.explained(objects, &mut frames.into_iter().map(Ok), layout, &Options::default())
}

/// Pose, velocity and angular velocity of an object that is at rest until 0.1 s and then decelerates by 2.5 m/s2.
fn slid(start: Pose, velocity: Vec2, yaw_rate_rad_s: f64, time_s: f64) -> (Pose, Vec2, f64) {
    let speed_m_s = velocity.length();
    let t = (time_s - 0.1).clamp(0.0, speed_m_s / 2.5);
    let remaining = if time_s > 0.1 { 1.0 - 2.5 * t / speed_m_s } else { 0.0 };
    let path = t * (1.0 - 1.25 * t / speed_m_s);
    let position = start.position + velocity * path;
    let pose = Pose { position, yaw_rad: start.yaw_rad + yaw_rate_rad_s * path };
    (pose, velocity * remaining, yaw_rate_rad_s * remaining)
}

/// An object, its marker and the dot beside it, if it has one, in the grey levels of its top and of the ink.
fn painted(object: &Object, pose: Pose, [top_grey, ink_grey]: [f64; 2]) -> Vec<Thing> {
    let [body, marker] = Thing::object(object, pose);
    let inked = [marker].into_iter().chain(Thing::dot(object, pose));
    let inked = inked.map(|thing| Thing { grey: ink_grey, ..thing });
    [Thing { grey: top_grey, ..body }].into_iter().chain(inked).collect()
}

fn error_mm(sample: &Sample, truth: Pose) -> f64 {
    sample.position().distance(truth.position) * 1e3
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn a_sliding_rotating_object_is_found_in_every_frame() {
    let view = view();
    let objects = [object("b", bar(0.06, 0.045), bar(0.024, 0.012))];
    let start = Pose::new(-0.12, -0.03, 2.2);
    let motion = |t: f64| slid(start, Vec2::new(0.7, 0.15), 4.0, t);
    let frames = film(&view, &times_s(30), |t| {
        let (pose, velocity, rate) = motion(t);
        Thing::object(&objects[0], pose).map(|thing| thing.moving(velocity, rate)).to_vec()
    });
    let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    let samples = &tracks.tracks[0].samples;
    assert_eq!(samples.len(), 30, "{:?}", tracks.warnings);
    let off: Vec<f64> = samples.iter().map(|s| error_mm(s, motion(s.time_s).0)).collect();
    // A rectangle determines its yaw modulo half a turn.
    let yaw_error_deg = |s: &Sample| {
        let off_rad = wrapped_rad(2.0 * (s.yaw_rad.expect("a yaw") - motion(s.time_s).0.yaw_rad)) / 2.0;
        off_rad.to_degrees()
    };
    let off_deg: Vec<f64> = samples.iter().map(yaw_error_deg).collect();
    println!("position rms {:.3} mm, yaw rms {:.3} deg", rms(&off), rms(&off_deg));
    assert!(rms(&off) < 0.06, "position rms {} mm", rms(&off));
    assert!(rms(&off_deg) < 0.5, "yaw rms {} deg", rms(&off_deg));
    assert!(samples.iter().all(|s| !s.doubtful), "nothing covers the marker");
}

#[test]
fn an_object_whose_marker_is_covered_for_ten_frames_is_followed_by_its_own_outline() {
    let view = view();
    let objects = [object("a", disc(0.03), disc(0.011))];
    let motion = |t: f64| slid(Pose::new(-0.1, 0.0, 0.0), Vec2::new(0.5, 0.0), 0.0, t);
    let frames = film(&view, &times_s(32), |t| {
        let (pose, velocity, _) = motion(t);
        let mut things = Thing::object(&objects[0], pose).map(|thing| thing.moving(velocity, 0.0)).to_vec();
        // A light grey disc covers the marker and moves with it for some frames.
        let beside_m = 0.25 * ((t - 0.22).abs() - 0.08).max(0.0) * 2.0;
        let shaft = Pose { position: pose.position + Vec2::new(0.0, beside_m), yaw_rad: 0.0 };
        things.push(Thing::flat(disc(0.016), shaft, 0.031, 165.0));
        things
    });
    let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    let samples = &tracks.tracks[0].samples;
    for s in samples {
        let off = error_mm(s, motion(s.time_s).0);
        assert!(off < 0.3 || s.doubtful, "{off} mm off at {} s, and not doubtful", s.time_s);
        assert!(
            off < 3.0 * s.std_m * 1e3 + 0.3,
            "{off} mm off at {} s, with a standard deviation of {} m",
            s.time_s,
            s.std_m
        );
    }
    assert_eq!(samples.len(), 32, "{:?}", tracks.warnings);
    let doubtful = samples.iter().filter(|s| s.doubtful).count();
    assert!((9..=14).contains(&doubtful), "{doubtful} of 32 samples are doubtful");
    let last = samples.last().expect("a sample");
    assert!(error_mm(last, motion(last.time_s).0) < 0.1 && !last.doubtful, "{last:?}");
}

#[test]
fn motion_blur_oblique_to_a_bar_does_not_change_its_yaw() {
    let mut view = view();
    view.camera.exposure_s = Some(0.012);
    let objects = [object("b", bar(0.06, 0.045), bar(0.024, 0.012))];
    let motion = |t: f64| slid(Pose::new(-0.15, -0.03, 0.85), Vec2::new(0.9, 0.1), 0.0, t);
    let frames = film(&view, &times_s(30), |t| {
        let (pose, velocity, rate) = motion(t);
        Thing::object(&objects[0], pose).map(|thing| thing.moving(velocity, rate)).to_vec()
    });
    let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    // Without the exposure during which the motion starts.
    let free = tracks.tracks[0].samples.iter().filter(|s| (s.time_s - 0.1).abs() > 0.006);
    let off_deg: Vec<f64> = free
        .map(|s| wrapped_rad(2.0 * (s.yaw_rad.expect("a yaw") - motion(s.time_s).0.yaw_rad)) / 2.0)
        .map(f64::to_degrees)
        .collect();
    println!("blur of up to 11 px: yaw rms {:.3} deg", rms(&off_deg));
    assert!(off_deg.len() >= 29 && rms(&off_deg) < 0.5, "yaw rms {} deg: {off_deg:?}", rms(&off_deg));
}

#[test]
fn a_dark_region_beside_a_covered_marker_is_not_taken_for_it() {
    let view = view();
    let objects = [object("a", bar(0.07, 0.05), bar(0.024, 0.012))];
    let motion = |t: f64| slid(Pose::new(-0.06, 0.0, 0.2), Vec2::new(0.4, 0.0), 2.0, t);
    let covered = |t: f64| (0.19..0.26).contains(&t);
    // A shadow, longer than the marker and less dark, near the object's final position.
    let strip = Thing::flat(bar(0.04, 0.0105), Pose::new(-0.02, 0.048, 0.3), 0.0, 75.0);
    let frames = film(&view, &times_s(40), |t| {
        let (pose, velocity, rate) = motion(t);
        let mut things = vec![strip.clone()];
        things.extend(Thing::object(&objects[0], pose).map(|thing| thing.moving(velocity, rate)));
        if covered(t) {
            things.push(Thing::flat(bar(0.06, 0.03), pose, 0.031, 165.0));
        }
        things
    });
    let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    let samples = &tracks.tracks[0].samples;
    assert_eq!(samples.len(), 40, "{:?}", tracks.warnings);
    for s in samples {
        let off = error_mm(s, motion(s.time_s).0);
        assert!(off < 0.3, "{off} mm off at {} s", s.time_s);
        assert!(s.doubtful || !covered(s.time_s), "not doubtful at {} s", s.time_s);
    }
}

#[test]
fn objects_with_equal_markers_that_pass_closely_are_not_exchanged() {
    let view = view();
    let objects = [object("a", disc(0.018), disc(0.011)), object("c", disc(0.019), disc(0.011))];
    let starts = [Pose::new(-0.08, 0.0185, 0.0), Pose::new(0.08, -0.019, 0.0)];
    let velocities = [Vec2::new(0.9, 0.0), Vec2::new(-0.9, 0.0)];
    let motion = |k: usize, t: f64| slid(starts[k], velocities[k], 0.0, t);
    let frames = film(&view, &times_s(28), |t| {
        let thing = |k: usize| {
            let (pose, velocity, _) = motion(k, t);
            Thing::object(&objects[k], pose).map(|thing| thing.moving(velocity, 0.0))
        };
        [thing(0), thing(1)].concat()
    });
    let placed =
        |k: usize| Placed { object: objects[k].name.clone(), position_m: starts[k].position, yaw_rad: 0.0 };
    let layout = Layout::Placed(vec![placed(0), placed(1)]);
    let tracks = found(&view, frames, &objects, &layout).expect("tracks");
    for (k, track) in tracks.tracks.iter().enumerate() {
        assert_eq!(track.samples.len(), 28, "{:?}", tracks.warnings);
        for s in &track.samples {
            let off = error_mm(s, motion(k, s.time_s).0);
            assert!(off < 0.3, "`{}` is {off} mm off at {} s", track.object, s.time_s);
        }
    }
}

/// Three discs with equal markers, and a triangle whose marker determines the yaw modulo half a turn.
fn pile() -> ([Object; 4], [Pose; 4]) {
    let third = |k: f64| Point::ORIGIN + Vec2::from_heading(k * std::f64::consts::TAU / 3.0) * 0.04;
    let triangle = Shape::Polygon { points_m: vec![third(0.0), third(1.0), third(2.0)] };
    let objects = [
        object("a", disc(0.04), disc(0.011)),
        object("c", disc(0.033), disc(0.011)),
        object("e", disc(0.026), disc(0.011)),
        object("t", triangle, bar(0.02, 0.01)),
    ];
    let poses = [
        Pose::new(0.05, 0.03, 0.0),
        Pose::new(-0.03, 0.045, 0.0),
        Pose::new(0.0, -0.02, 0.0),
        Pose::new(-0.1, -0.03, 2.9),
    ];
    (objects, poses)
}

fn still_frames(view: &View, objects: &[Object], poses: &[Pose], frames: u32) -> Vec<Frame> {
    let things: Vec<Thing> =
        objects.iter().zip(poses).flat_map(|(o, &pose)| Thing::object(o, pose)).collect();
    film(view, &times_s(frames), |_| things.clone())
}

#[test]
fn outlines_distinguish_objects_with_equal_markers() {
    let view = view();
    let (objects, poses) = pile();
    let frames = still_frames(&view, &objects, &poses, 2);
    let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    for (track, pose) in tracks.tracks.iter().zip(poses) {
        let off = error_mm(&track.samples[0], pose);
        assert!(off < 0.1, "`{}` is {off} mm off; {:?}", track.object, tracks.warnings);
    }
    let third = std::f64::consts::TAU / 3.0;
    let off_rad = tracks.tracks[3].samples[0].yaw_rad.expect("a yaw") - poses[3].yaw_rad;
    let off_rad = off_rad - (off_rad / third).round() * third;
    assert!(off_rad.abs() < 0.02, "the yaw of the triangle is wrong by {off_rad} rad");
}

#[test]
fn names_in_the_wrong_order_give_a_warning() {
    let view = view();
    let (objects, poses) = pile();
    let (objects, poses) = (&objects[..2], &poses[..2]);
    let frames = still_frames(&view, objects, poses, 2);
    let along = |heading_rad: f64| Layout::AlongStrike { heading_rad, start_m: None };
    let right = found(&view, frames.clone(), objects, &along(std::f64::consts::PI)).expect("tracks");
    assert!(right.warnings.is_empty(), "{:?}", right.warnings);
    let wrong = found(&view, frames, objects, &along(0.0)).expect("tracks");
    assert!(wrong.warnings.iter().any(|w| w.contains("swapped")), "{:?}", wrong.warnings);
}

#[test]
fn light_markers_on_dark_objects_are_tracked() {
    let view = View { table_grey: 90.0, ..view() };
    let objects = [object("a", disc(0.03), disc(0.011))];
    let pose = Pose::new(0.02, 0.01, 0.0);
    let [mut body, mut marker] = Thing::object(&objects[0], pose);
    (body.grey, marker.grey) = (45.0, 190.0);
    let frames = film(&view, &times_s(3), |_| vec![body.clone(), marker.clone()]);
    let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    let off: Vec<f64> = tracks.tracks[0].samples.iter().map(|s| error_mm(s, pose)).collect();
    assert!(off.len() == 3 && rms(&off) < 0.06, "{off:?} mm");
}

#[test]
fn the_error_for_missing_markers_counts_the_candidates() {
    let view = view();
    let (objects, poses) = pile();
    let frames = still_frames(&view, &objects[..1], &poses[..1], 1);
    let error = found(&view, frames, &objects[..3], &Layout::Unknown).expect_err("two markers are missing");
    let message = error.to_string();
    assert!(message.contains("drawn: 1 blobs") && message.contains("3 markers"), "{message}");
}

#[test]
fn the_error_for_an_image_without_contrast_names_its_grey_levels() {
    let view = view();
    let (objects, _) = pile();
    for grey in [0, 255] {
        let image = GreyImage { width: 640, height: 400, pixels: vec![grey; 640 * 400] };
        let frames = vec![Frame { time_s: 0.0, image }];
        let message = found(&view, frames, &objects, &Layout::Unknown).expect_err("no markers").to_string();
        assert!(message.contains(&format!("grey levels {grey} to {grey}")), "{message}");
    }
    let message = found(&view, Vec::new(), &objects, &Layout::Unknown).expect_err("no frames").to_string();
    assert!(message.contains("no frame"), "{message}");
}

#[test]
fn the_track_of_an_object_that_leaves_the_image_ends_with_a_warning() {
    let view = view();
    let objects = [object("a", disc(0.03), disc(0.011))];
    let motion = |t: f64| slid(Pose::new(0.2, 0.0, 0.0), Vec2::new(1.0, 0.0), 0.0, t);
    let frames = film(&view, &times_s(26), |t| {
        let (pose, velocity, _) = motion(t);
        Thing::object(&objects[0], pose).map(|thing| thing.moving(velocity, 0.0)).to_vec()
    });
    let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    let samples = &tracks.tracks[0].samples;
    assert!((10..26).contains(&samples.len()), "{} of 26 samples", samples.len());
    assert!(tracks.warnings.iter().any(|w| w.contains("left the image")), "{:?}", tracks.warnings);
    for s in samples {
        let off = error_mm(s, motion(s.time_s).0);
        assert!(off < 0.3 || s.doubtful, "{off} mm off at {} s, and not doubtful", s.time_s);
    }
}

#[test]
fn an_object_that_left_the_image_is_not_found_inside_it() {
    let view = view();
    let objects = [object("a", disc(0.03), disc(0.011))];
    let motion = |t: f64| slid(Pose::new(0.2, 0.0, 0.0), Vec2::new(1.0, 0.0), 0.0, t);
    let frames = film(&view, &times_s(40), |t| {
        let (pose, velocity, _) = motion(t);
        let mut things = Thing::object(&objects[0], pose).map(|thing| thing.moving(velocity, 0.0)).to_vec();
        // Later a region that looks like its marker appears: the striker, a shadow.
        if t > 0.4 {
            things.push(Thing::flat(disc(0.011), Pose::new(0.1, 0.05, 0.0), 0.03, 20.0));
        }
        things
    });
    let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    for s in &tracks.tracks[0].samples {
        let off = error_mm(s, motion(s.time_s).0);
        assert!(off < 20.0, "{off} mm off at {} s", s.time_s);
    }
}

/// A cell with four tags around the objects and the camera of the drawn films.
fn tagged_cell() -> Cell {
    let places = [(-0.2, -0.12), (0.2, -0.12), (0.2, 0.1), (-0.2, 0.1)].into_iter().zip(0..);
    let tag = |((x, y), id)| Tag {
        family: "36h11".into(),
        id,
        size_m: 0.06,
        center_m: Point::new(x, y),
        yaw_rad: 0.0,
    };
    let camera =
        CameraSpec { focal_px: Some([700.0; 2]), center_px: Some([319.5, 199.5]), ..CameraSpec::default() };
    let from_above = Cell::from_above(1000.0, Workspace::centred([0.4, 0.2]), Striker::rod(0.01, [0.1, 1.0]));
    Cell { camera, tags: places.map(tag).collect(), scale_px_per_m: None, ..from_above }
}

/// The tags of a cell and an object in the middle of the table.
fn beside_tags(cell: &Cell, object: &Object) -> Vec<Thing> {
    cell.tags.iter().map(Thing::tag).chain(Thing::object(object, Pose::default())).collect()
}

#[test]
fn the_motion_of_a_camera_during_the_clip_is_removed_and_reported() {
    let view = view();
    let cell = tagged_cell();
    let objects = [object("a", disc(0.03), disc(0.011))];
    let things = |_: f64| beside_tags(&cell, &objects[0]);
    let found = |shift_m: f64| {
        let mut shifted = view.clone();
        let position = Transform { position_m: [0.01 + shift_m, -0.1, 0.7], rpy_rad: [0.15, 0.02, 0.05] };
        shifted.camera = Camera::new([640, 400], Lens::pinhole([640, 400], 700.0), position);
        let mut frames = film(&view, &times_s(6), things);
        frames.extend(film(&shifted, &times_s(12), things).into_iter().skip(6));
        let capture = Capture::of(Footage::from_frames("drawn", frames), &cell).expect("tags");
        let names = ["a".to_string()];
        tracks(capture, &objects, &names, &Layout::Unknown, &Options::default()).expect("a track")
    };
    let fixed = found(0.0);
    assert!(fixed.warnings.is_empty(), "{:?}", fixed.warnings);
    // 0.5, 3 and 50 mm at 0.7 m are 0.5, 3 and 50 px.
    for shift_mm in [0.5, 3.0, 50.0] {
        let moved = found(shift_mm / 1e3);
        let warning = moved.warnings.join("; ");
        let moved_px: f64 = warning
            .strip_prefix("the camera moved by up to ")
            .and_then(|rest| rest.split(' ').next()?.parse().ok())
            .unwrap_or_else(|| panic!("no motion in: {warning}"));
        assert!((moved_px - shift_mm).abs() < 0.1 + 0.02 * shift_mm, "{warning}");
        assert!(warning.contains("from 0.100 s on") && warning.contains("removed"), "{warning}");
        for (k, (before, after)) in fixed.tracks[0].samples.iter().zip(&moved.tracks[0].samples).enumerate() {
            let off_mm = 1e3 * (before.x_m - after.x_m).hypot(before.y_m - after.y_m);
            assert!(off_mm < 0.15, "{off_mm} mm off in frame {k} after a motion by {shift_mm} mm");
        }
    }
}

#[test]
fn the_error_of_the_pose_is_a_part_of_the_standard_deviation_of_each_position() {
    let cell = tagged_cell();
    let objects = [object("a", disc(0.03), disc(0.011))];
    let names = ["a".to_string()];
    let sample = |cell: &Cell| {
        let frames = film(&view(), &times_s(4), |_| beside_tags(&tagged_cell(), &objects[0]));
        let capture = Capture::of(Footage::from_frames("drawn", frames), cell).expect("tags");
        let found = tracks(capture, &objects, &names, &Layout::Unknown, &Options::default());
        found.expect("a track").tracks[0].samples[0]
    };
    let four = sample(&cell);
    let one = sample(&Cell { tags: cell.tags[..1].to_vec(), ..cell.clone() });
    println!("{:.1} um by four tags, {:.1} um by one", 1e6 * four.pose_std_m, 1e6 * one.pose_std_m);
    assert!(four.pose_std_m > 0.0 && one.pose_std_m > 3.0 * four.pose_std_m, "{four:?} and {one:?}");
    for sample in [four, one] {
        assert!(sample.std_m > sample.pose_std_m, "{sample:?}");
        let noise_m = sample.noise_std_m();
        assert!((noise_m.hypot(sample.pose_std_m) / sample.std_m - 1.0).abs() < 1e-9, "{sample:?}");
        assert!((noise_m / four.noise_std_m() - 1.0).abs() < 0.2, "{noise_m} m: the marker is seen alike");
        let off_m = sample.position().distance(Point::ORIGIN);
        assert!(off_m < 4.0 * sample.std_m, "{off_m} m off: {sample:?}");
    }
}

#[test]
fn one_frame_gives_a_position_and_no_velocity() {
    let view = view();
    let objects = [object("a", disc(0.03), disc(0.011))];
    let pose = Pose::new(0.03, -0.02, 0.0);
    let tracks =
        found(&view, still_frames(&view, &objects, &[pose], 1), &objects, &Layout::Unknown).expect("tracks");
    let samples = &tracks.tracks[0].samples;
    assert!(samples.len() == 1 && error_mm(&samples[0], pose) < 0.1, "{samples:?}");
    assert!(samples[0].vx_m_s.is_none() && samples[0].ax_m_s2.is_none(), "{samples:?}");
}

#[test]
fn a_marker_of_another_size_is_not_accepted() {
    let view = view();
    let (wanted, large) = (object("a", disc(0.05), disc(0.011)), object("a", disc(0.05), disc(0.03)));
    for pose in [Pose::default(), Pose::new(0.1, 0.05, 0.0)] {
        let frames = still_frames(&view, std::slice::from_ref(&large), &[pose], 2);
        let error = found(&view, frames, std::slice::from_ref(&wanted), &Layout::Unknown)
            .expect_err("nothing of that size");
        let message = error.to_string();
        assert!(message.contains("`a` (") && message.contains("of the shape and size"), "{message}");
    }
}

#[test]
fn twenty_objects_that_slide_past_each_other_are_not_exchanged() {
    let view = view();
    let objects: Vec<Object> = (0..20).map(|k| object(&format!("o{k}"), disc(0.014), disc(0.007))).collect();
    let start = |k: usize| Pose::new((k % 5) as f64 * 0.09 - 0.18, (k / 5) as f64 * 0.06 - 0.10, 0.0);
    let motion = |k: usize, t: f64| {
        let speed_m_s = if (k / 5).is_multiple_of(2) { 0.45 } else { -0.45 };
        slid(start(k), Vec2::new(speed_m_s, 0.0), 0.0, t + 0.08)
    };
    let frames = film(&view, &times_s(12), |t| {
        let things = objects.iter().enumerate().flat_map(|(k, object)| {
            let (pose, velocity, _) = motion(k, t);
            Thing::object(object, pose).map(|thing| thing.moving(velocity, 0.0))
        });
        things.collect()
    });
    let placed = objects.iter().enumerate().map(|(k, object)| {
        let Pose { position, yaw_rad } = motion(k, 0.0).0;
        Placed { object: object.name.clone(), position_m: position, yaw_rad }
    });
    let tracks = found(&view, frames, &objects, &Layout::Placed(placed.collect())).expect("tracks");
    for (k, track) in tracks.tracks.iter().enumerate() {
        assert_eq!(track.samples.len(), 12, "{}: {:?}", track.object, tracks.warnings);
        for s in &track.samples {
            let off = error_mm(s, motion(k, s.time_s).0);
            assert!(off < 0.3, "{} is {off} mm off at {} s", track.object, s.time_s);
        }
    }
}

#[test]
fn a_position_under_a_shadow_is_right_or_doubtful() {
    let view = view();
    let objects = [object("a", disc(0.03), disc(0.011))];
    let pose = Pose::new(0.02, 0.01, 0.0);
    let mut frames = still_frames(&view, &objects, &[pose], 14);
    let edge = view.camera.pixel_from_table(pose.position, 0.03);
    for frame in &mut frames[6..10] {
        for (k, grey) in frame.image.pixels.iter_mut().enumerate() {
            if (k % 640) as f64 > edge.x {
                *grey = (f64::from(*grey) * 0.4) as u8;
            }
        }
    }
    let tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    let samples = &tracks.tracks[0].samples;
    assert!(samples.len() >= 10, "{} of 14 samples", samples.len());
    for s in samples {
        let off = error_mm(s, pose);
        assert!(off < 0.2 || s.doubtful, "{off} mm off at {} s, and not doubtful", s.time_s);
    }
}
