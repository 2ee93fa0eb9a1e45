//! `breakshot objects`: a draft of the objects file, from a picture to tracks.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use breakshot::files;
use breakshot::object::Shape;
use common::{assert_refused, breakshot, demo};
use std::fs;

fn workbench() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in ["cell.toml", "objects.toml", "single_a_3.mp4"] {
        fs::copy(demo(file), folder.path().join(file)).unwrap();
    }
    folder
}

#[test]
fn a_film_is_tracked_with_the_objects_that_its_first_frames_show() {
    let folder = workbench();
    let draft = ["objects", "cell.toml", "single_a_3.mp4", "-o", "drafted.toml", "--figure", "drafted.png"];
    let height = ["--height-m", "0.05"];
    let output = breakshot(folder.path(), &[&draft[..], &height].concat());
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(matches!(output.status.code(), Some(0 | 3)), "{message}");
    let given = files::load_objects(folder.path().join("objects.toml")).unwrap().value.swap_remove(0);
    let drafted = files::load_objects(folder.path().join("drafted.toml")).unwrap().value;
    let Shape::Disc { radius_m: given_m } = given.shape else { unreachable!("the example has discs") };
    let is_disc =
        |shape: &Shape| matches!(shape, Shape::Disc { radius_m } if (radius_m - given_m).abs() < 3e-4);
    let disc = drafted.into_iter().find(|object| is_disc(&object.shape)).unwrap();
    let marker = disc.marker.as_ref().unwrap();
    let Shape::Disc { radius_m: spot_m } = marker.shape else { unreachable!("its marker is a spot") };
    assert!((spot_m - 0.012).abs() < 3e-4 && marker.at_m.to_vec().length() < 3e-4, "{marker:?}");
    assert!(folder.path().join("drafted.png").is_file());

    // The tracks with the drafted object are those with the given one.
    let tracked = |objects: &str, name: &str, tracks: &str| {
        let args = ["detect", "cell.toml", objects, "single_a_3.mp4", "--objects", name, "-o", tracks];
        let output = breakshot(folder.path(), &args);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let text = fs::read_to_string(folder.path().join(tracks)).unwrap();
        let number = |cell: &str| cell.parse::<f64>().unwrap();
        let place = |row: &str| [2, 3].map(|column: usize| number(row.split(',').nth(column).unwrap()));
        text.lines().skip(1).map(place).collect::<Vec<_>>()
    };
    let (with_given, with_drafted) =
        (tracked("objects.toml", "a", "given.csv"), tracked("drafted.toml", &disc.name, "drafted.csv"));
    assert!(with_given.len() > 10 && with_given.len() == with_drafted.len());
    for ([x, y], [other_x, other_y]) in with_given.iter().zip(&with_drafted) {
        assert!((x - other_x).hypot(y - other_y) < 3e-4, "({x}, {y}) and ({other_x}, {other_y})");
    }
}

#[test]
fn heights_that_are_none_are_refused() {
    let folder = workbench();
    let refused = |height: &str, words: &[&str]| {
        let args = ["objects", "cell.toml", "single_a_3.mp4", "-o", "out.json", "--height-m", height];
        assert_refused(folder.path(), &args, words);
    };
    refused("tall", &["--height-m", "`tall`"]);
    refused("0", &["--height-m", "height_m is 0"]);
    refused("object_77=0.03", &["object_77", "one of object_1 to"]);
}
