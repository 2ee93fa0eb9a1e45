//! Where a person has seen the objects in the first frame (`detect::Layout::Started`), in drawn films of known poses.

#![allow(clippy::expect_used, missing_docs)]

use breakshot::Result;
use breakshot::campaign::ClipStart;
use breakshot::capture::{Capture, Footage, Frame, GreyImage, camera};
use breakshot::cell::{Cell, Striker, Workspace};
use breakshot::detect::{Layout, Options, Tracks, tracks};
use breakshot::geometry::{Pose, Vec2, wrapped_rad};
use breakshot::object::{Marker, Object, Shape};
use breakshot::synthetic::film::{Thing, View, film};
use std::f64::consts::PI;

/// A camera above the table, 1 mm a pixel.
fn cell() -> Cell {
    Cell::from_above(1000.0, Workspace::centred([0.5, 0.3]), Striker::rod(0.01, [0.1, 1.0]))
}

fn object(name: &str, shape: Shape) -> Object {
    let marker = Some(Marker::centred(Shape::Disc { radius_m: 0.011 }));
    Object { name: name.into(), shape, height_m: 0.03, marker, mass_kg: None, support: None }
}

/// Two frames of objects at rest.
fn frames(objects: &[Object], poses: &[Pose]) -> Vec<Frame> {
    let blank = GreyImage { width: 640, height: 400, pixels: vec![0; 640 * 400] };
    let view = View { noise: 2.0, ..View::new(camera("drawn", &[&blank], &cell()).expect("a camera")) };
    let things: Vec<Thing> =
        objects.iter().zip(poses).flat_map(|(o, &pose)| Thing::object(o, pose)).collect();
    film(&view, &[0.0, 0.02], |_| things.clone())
}

fn found(frames: &[Frame], objects: &[Object], layout: &Layout) -> Result<Tracks> {
    let names: Vec<String> = objects.iter().map(|object| object.name.clone()).collect();
    let capture = Capture::of(Footage::from_frames("drawn", frames.to_vec()), &cell())?;
    tracks(capture, objects, &names, layout, &Options::default())
}

fn started(starts: Vec<ClipStart>, others: Layout) -> Layout {
    Layout::Started { starts, others: Box::new(others) }
}

#[test]
fn a_start_says_which_marker_is_whose_and_measures_nothing() {
    // Equal discs with equal markers: nothing but the order along the strike says which is which.
    let objects = [object("a", Shape::Disc { radius_m: 0.03 }), object("c", Shape::Disc { radius_m: 0.03 })];
    let poses = [Pose::new(0.06, 0.01, 0.0), Pose::new(-0.05, 0.02, 0.0)];
    let frames = frames(&objects, &poses);
    let along = Layout::AlongStrike { heading_rad: 0.0, start_m: None };
    let near = |object: &str, pose: Pose| ClipStart {
        object: object.into(),
        position_m: pose.position + Vec2::new(0.006, -0.005),
        yaw_rad: None,
    };
    let off_m = |layout: &Layout| {
        let tracks = found(&frames, &objects, layout).expect("tracks");
        let off_m = |k: usize| tracks.tracks[k].samples[0].position().distance(poses[k].position);
        off_m(0).max(off_m(1))
    };
    assert!(off_m(&along) > 0.05, "the order along the strike is the other one");
    let (a, c) = (near("a", poses[0]), near("c", poses[1]));
    for starts in [vec![a.clone()], vec![c.clone()], vec![c, a]] {
        for others in [Layout::Unknown, along.clone()] {
            let layout = started(starts.clone(), others);
            let off_m = off_m(&layout);
            assert!(off_m < 1e-4, "{layout:?}: {off_m} m off");
        }
    }
    let nowhere = started(vec![near("a", Pose::new(0.2, 0.1, 0.0))], Layout::Unknown);
    let error = found(&frames, &objects, &nowhere).expect_err("there is no marker").to_string();
    assert!(error.contains("`a`") && error.contains("near the start that is given"), "{error}");
}

#[test]
fn the_yaw_of_a_start_chooses_among_those_that_fit_and_is_corrected_by_the_image() {
    // A bar on a rectangle: half a turn changes nothing that the image shows.
    let marker = Some(Marker::centred(Shape::Rectangle { size_m: [0.024, 0.012] }));
    let objects = [Object { marker, ..object("b", Shape::Rectangle { size_m: [0.06, 0.04] }) }];
    let truth = Pose::new(0.02, 0.01, 0.7);
    let frames = frames(&objects, &[truth]);
    for (turned_rad, wanted_rad) in [(0.1, truth.yaw_rad), (PI - 0.1, truth.yaw_rad + PI)] {
        let yaw_rad = Some(truth.yaw_rad + turned_rad);
        let start = ClipStart { object: "b".into(), position_m: truth.position, yaw_rad };
        let tracks = found(&frames, &objects, &started(vec![start], Layout::Unknown)).expect("tracks");
        let yaw_rad = tracks.tracks[0].samples[0].yaw_rad.expect("a yaw");
        let off_rad = wrapped_rad(yaw_rad - wanted_rad);
        assert!(off_rad.abs() < 0.03, "{off_rad} rad from the yaw nearest to that of the start");
    }
}
