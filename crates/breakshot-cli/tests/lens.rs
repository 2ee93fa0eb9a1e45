//! The calibration of a lens as a user makes it: a printed board, a film of it, a cell that names the result.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use breakshot::capture::{Camera, Lens};
use breakshot::cell::Transform;
use breakshot::files;
use breakshot::geometry::Pixel;
use breakshot::synthetic::film::{Thing, View, film};
use common::{assert_refused, breakshot, demo};
use std::fs;
use std::path::Path;

const SIZE: [usize; 2] = [640, 480];

/// A film of the board in `folder` from twelve sides, as Y4M.
fn film_of_the_board(folder: &Path, lens: &Lens) {
    let board = files::load_board(folder.join("board.toml")).unwrap();
    let mut y4m = format!("YUV4MPEG2 W{} H{} F30:1 Ip Cmono\n", SIZE[0], SIZE[1]).into_bytes();
    for k in 0..12_u32 {
        let (a, b) = (f64::from(k % 4) - 1.5, f64::from(k / 4) - 1.0);
        let rpy_rad = [0.3 * a, 0.35 * b, 0.1 * a];
        // The camera moves aside as it tilts: its axis meets the board in the middle.
        let posed = |position_m| Camera::new(SIZE, lens.clone(), Transform { position_m, rpy_rad });
        let [cx, cy] = lens.center_px();
        let met = posed([0.0, 0.0, 1.0]).table_from_pixel(Pixel::new(cx, cy), 0.0);
        let height_m = 0.24 + 0.03 * f64::from(k % 3);
        let camera = posed([-height_m * met.x, -height_m * met.y, height_m]);
        let view = View { noise: 1.5, seed: u64::from(k), ..View::new(camera) };
        let frames = film(&view, &[0.0], |_| board.tags.iter().map(Thing::tag).collect());
        y4m.extend_from_slice(b"FRAME\n");
        y4m.extend_from_slice(&frames[0].image.pixels);
    }
    fs::write(folder.join("board.y4m"), y4m).unwrap();
}

#[test]
fn a_printed_board_is_filmed_and_its_lens_is_the_cells() {
    let folder = tempfile::tempdir().unwrap();
    let tags = ["tags", "--board", "6x4", "-o", "board.svg"];
    let printed = breakshot(folder.path(), &tags);
    assert_eq!(printed.status.code(), Some(0), "{printed:?}");
    let lens = Lens::new([560.0, 561.0], [322.0, 238.0], [-0.15, 0.04, 0.0, 0.0, 0.0]);
    film_of_the_board(folder.path(), &lens);
    let calibrate =
        ["lens", "board.y4m", "--board", "board.toml", "-o", "lens.yaml", "--figure", "lens.svg", "--json"];
    let output = breakshot(folder.path(), &calibrate);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(matches!(output.status.code(), Some(0 | 3)), "{message}");
    assert!(message.contains("only 12 different views"), "{message}");
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["parameters"][0]["name"], "fx");
    let focal_px = result["parameters"][0]["value"].as_f64().unwrap();
    assert!((focal_px / 560.0 - 1.0).abs() < 0.01, "{result:#}");
    assert!(fs::read_to_string(folder.path().join("lens.svg")).unwrap().contains("px rms"));
    // The cell reads it, and refuses it for another size.
    let read = files::load_intrinsics(folder.path().join("lens.yaml"), Some([640, 480])).unwrap();
    assert!((read.focal_px[0] - focal_px).abs() < 1e-9);
    assert!(files::load_intrinsics(folder.path().join("lens.yaml"), Some([1280, 720])).is_err());
}

#[test]
fn what_is_no_board_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(demo("single_a_3.mp4"), folder.path().join("clip.mp4")).unwrap();
    let lens = ["lens", "clip.mp4", "--board", "board.toml", "-o", "out.json"];
    assert_refused(folder.path(), &lens, &["board.toml", "cannot be read"]);
    fs::write(folder.path().join("board.toml"), "family = \"25h9\"\n").unwrap();
    assert_refused(folder.path(), &lens, &["board.toml", "25h9", "36h11"]);
    fs::write(folder.path().join("board.toml"), "[[tags]]\nid = 1\nsize_m = 0.04\ncenter_m = [0, 0]\n")
        .unwrap();
    assert_refused(folder.path(), &lens, &["board.toml", "4 to 587 [[tags]]"]);
    let four = |id: u32| format!("[[tags]]\nid = {}\nsize_m = 0.04\ncenter_m = [0.{id}, 0.0]\n", id + 100);
    fs::write(folder.path().join("board.toml"), (0..4).map(four).collect::<String>()).unwrap();
    assert_refused(folder.path(), &lens, &["clip.mp4", "the board in 0 frames"]);
    assert_refused(folder.path(), &["tags", "--board", "6", "-o", "out.json"], &["6x4"]);
}
