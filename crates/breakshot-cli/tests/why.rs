//! The page of the frames in which an object was lost or doubtful, as a user asks for it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use breakshot::capture::{GreyImage, camera};
use breakshot::files;
use breakshot::geometry::Pose;
use breakshot::object::Shape;
use breakshot::synthetic::film::{Thing, View, film};
use common::{assert_refused, breakshot, demo};
use std::fs;
use std::path::Path;

const CELL: &str = "[camera]\nscale_px_per_m = 1000.0\n[workspace]\nmin_m = [-0.2, -0.1]\nmax_m = [0.2, 0.1]\n\
     [striker]\nshape = { disc = { radius_m = 0.01 } }\nheight_m = 0.08\nspeed_range_m_s = [0.1, 1.0]\n";
const OBJECTS: &str = "[[objects]]\nname = \"puck\"\nshape = { disc = { radius_m = 0.03 } }\nheight_m = 0.02\n\
     marker = { shape = { disc = { radius_m = 0.01 } } }\n";
const SIZE: [usize; 2] = [320, 200];

/// A folder with a cell, a puck, and a film of the puck at rest, which a lid covers in frames 8 to 11.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cell.toml"), CELL).unwrap();
    fs::write(folder.path().join("objects.toml"), OBJECTS).unwrap();
    let cell = files::load_cell(folder.path().join("cell.toml")).unwrap();
    let objects = files::load_objects(folder.path().join("objects.toml")).unwrap().value;
    let [width, height] = SIZE;
    let blank = GreyImage { width, height, pixels: vec![0; width * height] };
    let view = View { noise: 2.0, ..View::new(camera("drawn", &[&blank], &cell).unwrap()) };
    let pose = Pose::new(0.02, -0.01, 0.0);
    let times_s: Vec<f64> = (0..16).map(|k| f64::from(k) / 30.0).collect();
    let frames = film(&view, &times_s, |t| {
        let mut things = Thing::object(&objects[0], pose).to_vec();
        if (7.5..11.5).contains(&(t * 30.0)) {
            things.push(Thing::flat(Shape::Disc { radius_m: 0.035 }, pose, 0.03, 165.0));
        }
        things
    });
    let mut y4m = format!("YUV4MPEG2 W{width} H{height} F30:1 Ip Cmono\n").into_bytes();
    for frame in frames {
        y4m.extend_from_slice(b"FRAME\n");
        y4m.extend_from_slice(&frame.image.pixels);
    }
    fs::write(folder.path().join("film.y4m"), y4m).unwrap();
    folder
}

/// The page, after `detect` with these further arguments.
fn page(folder: &Path, film: &str, object: &str, more: &[&str]) -> String {
    let args = ["detect", "cell.toml", "objects.toml", film, "--objects", object, "-o", "tracks.json"];
    let output = breakshot(folder, &[&args[..], &["--why", "why.html"], more].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(matches!(output.status.code(), Some(0 | 3)), "{said}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("Wrote why.html"), "the page is listed");
    fs::read_to_string(folder.join("why.html")).unwrap()
}

#[test]
fn the_page_shows_where_a_covered_puck_was_searched() {
    let folder = folder();
    let page = page(folder.path(), "film.y4m", "puck", &[]);
    for words in [
        "Lost and doubtful frames of film.y4m",
        "puck: not found in 4 frames",
        "0.267 to 0.367 s (frames 8 to 11)",
        "0.233 s, frame 7: <span class=\"yes\">found</span>",
        "0.267 s, frame 8: <span class=\"no\">not found</span>",
        "class=\"why-expected\"",
        "class=\"why-region\"",
        "`puck` was not found in 4 frames",
    ] {
        assert!(page.contains(words), "`{words}` is not on the page");
    }
    assert_eq!(page.matches("data:image/png;base64,").count(), 4);
    assert!(!page.contains("<script") && !page.contains("http://127"), "the page is complete in itself");
}

#[test]
fn the_page_changes_no_track_and_goes_with_an_overlay() {
    let folder = folder();
    let film = page(folder.path(), "film.y4m", "puck", &["--overlay", "overlay.mp4"]);
    let with = fs::read(folder.path().join("tracks.json")).unwrap();
    assert!(folder.path().join("overlay.mp4").exists() || folder.path().join("overlay").exists());
    let args = ["detect", "cell.toml", "objects.toml", "film.y4m", "--objects", "puck", "-o", "tracks.json"];
    assert_eq!(breakshot(folder.path(), &args).status.code(), Some(3));
    assert_eq!(fs::read(folder.path().join("tracks.json")).unwrap(), with);
    assert_eq!(page(folder.path(), "film.y4m", "puck", &[]), film, "the same film gives the same page");
}

#[test]
fn a_film_without_doubt_is_said_to_be_that() {
    let folder = tempfile::tempdir().unwrap();
    for file in ["cell.toml", "objects.toml", "single_a_3.mp4"] {
        fs::copy(demo(file), folder.path().join(file)).unwrap();
    }
    let page = page(folder.path(), "single_a_3.mp4", "a", &[]);
    assert!(page.contains("Nothing is lost or doubtful: every object was found in all"), "{page}");
    assert!(!page.contains("data:image/png;base64,"));
}

#[test]
fn the_page_is_of_one_film() {
    let folder = folder();
    let args = ["detect", "--campaign", "campaign.toml", "--tracks", "tracks", "--why", "why.html"];
    let output = breakshot(folder.path(), &args);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--why"));
}

#[test]
fn a_page_that_cannot_be_written_is_named() {
    let folder = folder();
    let args = ["detect", "cell.toml", "objects.toml", "film.y4m", "--objects", "puck", "-o"];
    let output = breakshot(folder.path(), &[&args[..], &["tracks.csv", "--why", "no/why.html"]].concat());
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("error: no/why.html: cannot be written"));
    let refused = [&args[..], &["tracks.txt", "--why", "why.html"]].concat();
    assert_refused(folder.path(), &refused, &["tracks.txt", ".csv or .json"]);
    assert!(!folder.path().join("why.html").exists(), "nothing is tracked for it");
}
