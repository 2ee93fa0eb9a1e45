//! Where a person has seen the objects at the beginning of a clip (`starts` in `campaign.toml`).

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use common::{assert_refused, breakshot, demo};
use serde_json::Value;
use std::fs;
use std::path::Path;

const FILM: &str = "pair_a_c_3.mp4";

/// A folder with the cell, the objects and a film of two objects with equal markers.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in ["cell.toml", "objects.toml", FILM] {
        fs::copy(demo(file), folder.path().join(file)).unwrap();
    }
    folder
}

fn write_campaign(folder: &Path, more: &str) {
    let text = format!(
        "cell = \"cell.toml\"\nobjects = \"objects.toml\"\n\n[[clips]]\nvideo = \"{FILM}\"\nobjects = [\"a\", \"c\"]\n{more}\n"
    );
    fs::write(folder.join("campaign.toml"), text).unwrap();
}

/// The tracks of the film with further lines in its entry.
fn tracked(folder: &Path, more: &str) -> Value {
    write_campaign(folder, more);
    let result = breakshot(folder, &["detect", "--campaign", "campaign.toml", "--tracks", "tracks"]);
    assert!(matches!(result.status.code(), Some(0 | 3)), "{}", String::from_utf8_lossy(&result.stderr));
    serde_json::from_str(&fs::read_to_string(folder.join("tracks/pair_a_c_3.json")).unwrap()).unwrap()
}

/// Where an object is in the first frame (m).
fn first_m(tracks: &Value, object: &str) -> [f64; 2] {
    let track = tracks["tracks"].as_array().unwrap().iter().find(|track| track["object"] == object).unwrap();
    ["x_m", "y_m"].map(|key| track["samples"][0][key].as_f64().unwrap())
}

fn start(object: &str, [x, y]: [f64; 2]) -> String {
    format!("{{ object = \"{object}\", position_m = [{x}, {y}] }}")
}

#[test]
fn a_start_decides_which_marker_is_whose_and_does_not_enter_the_measurement() {
    let folder = folder();
    let folder = folder.path();
    let without = tracked(folder, "");
    let (a, c) = (first_m(&without, "a"), first_m(&without, "c"));
    // Right, and inaccurate by as much as a hand is: every sample stays as it is.
    let beside = |[x, y]: [f64; 2]| [x + 0.005, y - 0.004];
    let right = tracked(folder, &format!("starts = [{}, {}]", start("a", beside(a)), start("c", beside(c))));
    assert_eq!(right["tracks"], without["tracks"]);
    assert_ne!(right["input"], without["input"], "finished tracks are made again when a start changes");
    // Each at the place of the other: the person is believed.
    let exchanged = tracked(folder, &format!("starts = [{}]", start("a", beside(c))));
    for (object, [x, y]) in [("a", c), ("c", a)] {
        let [u, v] = first_m(&exchanged, object);
        // The same marker at the height of another object: a few millimetres of parallax.
        assert!((u - x).hypot(v - y) < 0.01, "`{object}` begins at {u}, {v} m, and was seen at {x}, {y} m");
    }
}

#[test]
fn starts_that_cannot_be_are_refused() {
    let folder = folder();
    let folder = folder.path();
    for (starts, words) in [
        ("[{ object = \"e\", position_m = [0.0, 0.0] }]", &["starts", "`e`", "a, c"][..]),
        ("[{ object = \"a\", position_m = [0.0, nan] }]", &["start of `a`", "position_m", "not a number"]),
        ("[{ object = \"a\", position_m = [0.0, 5e9] }]", &["start of `a`", "position_m"]),
        ("[{ object = \"a\", position_m = [0.0, 0.0], yaw_rad = inf }]", &["start of `a`", "yaw_rad"]),
        ("[{ object = \"a\", at_m = [0.0, 0.0] }]", &["at_m"]),
        (
            "[{ object = \"a\", position_m = [0.1, 0.0] }, { object = \"a\", position_m = [0.0, 0.0] }]",
            &["starts", "`a` twice"],
        ),
    ] {
        write_campaign(folder, &format!("starts = {starts}"));
        assert_refused(folder, &["detect", "--campaign", "campaign.toml", "--tracks", "tracks"], words);
    }
    // Where no marker is: the clip has no tracks, and says why.
    write_campaign(folder, "starts = [{ object = \"a\", position_m = [0.4, 0.2] }]");
    let result = breakshot(folder, &["detect", "--campaign", "campaign.toml", "--tracks", "tracks"]);
    let warnings = String::from_utf8_lossy(&result.stderr).into_owned();
    assert!(
        warnings.contains("`a`") && warnings.contains("near the start that is given, x = 0.400"),
        "{warnings}"
    );
    let table = "object,time_s,x_m,y_m\na,0.0,0.1,0.0\na,0.1,0.1,0.0\n";
    fs::write(folder.join("table.csv"), table).unwrap();
    let text = "cell = \"cell.toml\"\nobjects = \"objects.toml\"\n[[clips]]\ntracks = \"table.csv\"\nobjects = [\"a\"]\nstarts = [{ object = \"a\", position_m = [0.1, 0.0] }]\n";
    fs::write(folder.join("campaign.toml"), text).unwrap();
    assert_refused(folder, &["estimate", "campaign.toml", "-o", "out.json"], &["starts", "given for tracks"]);
}
