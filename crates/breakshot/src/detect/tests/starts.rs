//! Where an object is in the first frames, where its marker alone does not show it.

use super::*;

/// A disc whose bar is off its centre, in a film of 30 frames in which it slides and rotates; the camera sees it darker or lighter than the table.
fn slid_disc(off_m: f64, grey: f64) -> (Vec<Sample>, Vec<String>, impl Fn(f64) -> Pose) {
    let view = View { table_grey: 150.0, ..view() };
    let at_m = Point::new(off_m, 0.0);
    let marker = Marker { at_m, ..Marker::centred(bar(0.024, 0.012)) };
    let objects = [Object { marker: Some(marker), ..object("a", disc(0.03), disc(0.01)) }];
    let motion = |t: f64| slid(Pose::new(-0.1, -0.02, 0.4), Vec2::new(0.5, 0.1), 5.0, t);
    let frames = film(&view, &times_s(30), |t| {
        let (pose, velocity, rate) = motion(t);
        let [mut body, mut marker] = Thing::object(&objects[0], pose);
        (body.grey, body.side_grey, marker.grey) = (grey, grey, 30.0);
        [body, marker].map(|thing| thing.moving(velocity, rate)).to_vec()
    });
    let mut tracks = found(&view, frames, &objects, &Layout::Unknown).expect("tracks");
    let samples = tracks.tracks.remove(0).samples;
    assert_eq!(samples.len(), 30, "{:?}", tracks.warnings);
    (samples, tracks.warnings, move |t| motion(t).0)
}

#[test]
fn where_half_a_turn_is_open_the_position_is_the_markers_known_to_its_distance_from_the_centre() {
    let off_m = 4e-4;
    let (samples, warnings, pose) = slid_disc(off_m, 90.0);
    assert!(warnings.iter().any(|w| w.contains("half a turn")), "{warnings:?}");
    for s in &samples {
        let marker = pose(s.time_s).table_from_body(Point::new(off_m, 0.0));
        let off_mm = 1e3 * s.position().distance(marker);
        assert!(off_mm < 0.15, "{off_mm:.2} mm off the marker at {:.3} s", s.time_s);
        assert!(s.std_m >= off_m && !s.doubtful, "{s:?}");
    }
}

#[test]
fn where_half_a_turn_is_open_and_the_marker_far_off_the_centre_the_positions_are_doubtful() {
    // As grey as the table: no outline shows on which side of the marker the object is.
    let (samples, warnings, pose) = slid_disc(4e-3, 150.0);
    assert!(warnings.iter().any(|w| w.contains("half a turn")), "{warnings:?}");
    for s in &samples {
        let off_m = s.position().distance(pose(s.time_s).position);
        assert!(s.doubtful && off_m < 1.1 * s.std_m, "{s:?} is {off_m} m off");
    }
    // A visible outline shows it.
    let (samples, warnings, pose) = slid_disc(4e-3, 90.0);
    assert!(warnings.is_empty(), "{warnings:?}");
    let off: Vec<f64> = samples.iter().map(|s| error_mm(s, pose(s.time_s))).collect();
    assert!(rms(&off) < 0.1 && samples.iter().all(|s| !s.doubtful), "{} mm", rms(&off));
}

#[test]
fn a_round_spot_on_the_striker_is_not_the_marker_of_the_object_that_it_strikes() {
    let view = View { table_grey: 90.0, ..view() };
    let objects = [object("a", disc(0.03), disc(0.011))];
    let (pose, start_m) = (Pose::new(0.04, 0.0, 0.0), Point::new(-0.13, 0.0));
    // Something covers the marker until the striker has moved by 30 mm; it stops before the object.
    let frames = film(&view, &times_s(30), |t| {
        let [mut body, mut marker] = Thing::object(&objects[0], pose);
        (body.grey, marker.grey) = (45.0, 190.0);
        let striker = Pose { position: start_m + Vec2::new(0.12 * t.min(0.5), 0.0), yaw_rad: 0.0 };
        let moving = |thing: Thing| if t < 0.5 { thing.moving(Vec2::new(0.12, 0.0), 0.0) } else { thing };
        let mut things = vec![body, marker];
        things.push(moving(Thing::flat(disc(0.018), striker, 0.03, 60.0)));
        things.push(moving(Thing::flat(disc(0.011), striker, 0.031, 190.0)));
        if t < 0.25 {
            things.push(Thing::flat(bar(0.03, 0.03), pose, 0.031, 45.0));
        }
        things
    });
    let strike = Strike { object: None, start_m, heading_rad: 0.0, speed_m_s: 0.12, travel_m: 0.06 };
    let striker = Striker { height_m: 0.03, ..Striker::rod(0.018, [0.05, 1.0]) };
    let given = Some(GivenStrike { strike: &strike, striker: &striker });
    let names = ["a".to_string()];
    let targets = targets(&objects, &names).expect("a target");
    let clip = Clip { name: "drawn".into(), camera: &view.camera, targets, given, is_recorded: false };
    let layout = Layout::AlongStrike { heading_rad: 0.0, start_m: Some(start_m) };
    let mut frames = frames.into_iter().map(Ok);
    let explained = clip.explained(&objects, &mut frames, &layout, &Options::default()).expect("tracks");
    let tracks = explained.tracks;
    let samples = &tracks.tracks[0].samples;
    assert!(samples.len() >= 15, "{:?}", tracks.warnings);
    for s in samples {
        assert!(error_mm(s, pose) < 0.3, "{} mm off at {:.3} s", error_mm(s, pose), s.time_s);
    }
}

#[test]
fn the_outline_of_an_object_with_a_marker_is_not_that_of_one_without() {
    let view = View { table_grey: 120.0, ..view() };
    let plain = Object { marker: None, ..object("a", disc(0.03), disc(0.01)) };
    let objects = [plain, object("c", disc(0.0297), disc(0.009))];
    let poses = [Pose::new(-0.08, 0.0, 0.0), Pose::new(0.03, 0.02, 0.0)];
    let frames = film(&view, &times_s(4), |_| {
        let [mut dim, _] = Thing::object(&objects[0], poses[0]);
        let [mut bright, marker] = Thing::object(&objects[1], poses[1]);
        (dim.grey, dim.side_grey) = (105.0, 100.0);
        (bright.grey, bright.side_grey) = (220.0, 60.0);
        vec![dim, bright, marker]
    });
    for layout in [Layout::Unknown, Layout::AlongStrike { heading_rad: 0.0, start_m: None }] {
        let tracks = found(&view, frames.clone(), &objects, &layout).expect("tracks");
        for (track, pose) in tracks.tracks.iter().zip(poses) {
            let off_mm = error_mm(&track.samples[0], pose);
            assert!(off_mm < 0.5, "`{}` is {off_mm} mm off: {:?}", track.object, tracks.warnings);
        }
    }
}
