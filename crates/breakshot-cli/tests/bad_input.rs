//! Invalid input ends with exit code 2 (or 3) and one message that names the item, the value found and the value needed.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{assert_refused, breakshot, demo};
use std::fs;
use std::path::Path;
use std::process::Command;

/// A folder with the cell, the objects and one film of the example.
fn workbench() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in ["cell.toml", "objects.toml", "single_a_3.mp4"] {
        fs::copy(demo(file), folder.path().join(file)).unwrap();
    }
    folder
}

fn detect<'a>(film: &'a str, names: &'a str) -> Vec<&'a str> {
    vec![
        "detect",
        "cell.toml",
        "objects.toml",
        film,
        "--objects",
        names,
        "--strike-heading-rad",
        "0",
        "-o",
        "out.csv",
    ]
}

#[test]
fn a_text_file_named_mp4_is_refused() {
    let folder = workbench();
    fs::write(folder.path().join("notes.mp4"), "this is a shopping list\n".repeat(40)).unwrap();
    assert_refused(folder.path(), &detect("notes.mp4", "a"), &["notes.mp4", "needed"]);
}

#[test]
fn an_empty_film_is_refused_by_name() {
    let folder = workbench();
    fs::write(folder.path().join("empty.mp4"), "").unwrap();
    assert_refused(folder.path(), &detect("empty.mp4", "a"), &["empty.mp4", "needed"]);
}

#[test]
fn a_truncated_film_is_refused() {
    let folder = workbench();
    let whole = fs::read(demo("single_a_3.mp4")).unwrap();
    for keep_percent in [10, 50, 90] {
        fs::write(folder.path().join("cut.mp4"), &whole[..whole.len() * keep_percent / 100]).unwrap();
        assert_refused(folder.path(), &detect("cut.mp4", "a"), &["cut.mp4", "needed"]);
    }
}

#[test]
fn the_error_for_a_film_without_tags_names_the_tags() {
    let folder = workbench();
    let mut film = b"YUV4MPEG2 W1920 H1080 F60:1 Ip C420\n".to_vec();
    for _ in 0..3 {
        film.extend_from_slice(b"FRAME\n");
        film.extend(std::iter::repeat_n(128u8, 1920 * 1080 * 3 / 2));
    }
    fs::write(folder.path().join("grey.y4m"), film).unwrap();
    assert_refused(folder.path(), &detect("grey.y4m", "a"), &["grey.y4m", "tag", "needed"]);
}

#[test]
fn fewer_markers_than_objects_are_refused() {
    let folder = workbench();
    assert_refused(folder.path(), &detect("single_a_3.mp4", "a,c"), &["single_a_3.mp4", "needed"]);
}

#[test]
fn an_unknown_object_is_refused_by_name() {
    let folder = workbench();
    assert_refused(folder.path(), &detect("single_a_3.mp4", "zebra"), &["zebra", "a, c, e"]);
}

#[test]
fn a_missing_film_is_refused_by_name() {
    let folder = workbench();
    assert_refused(folder.path(), &detect("nowhere.mp4", "a"), &["nowhere.mp4"]);
}

/// A replacement in the text of a file.
#[derive(Clone, Copy)]
struct Change<'a> {
    from: &'a str,
    to: &'a str,
}

/// Applies the change to a file of the workbench and asserts that `detect` refuses it.
fn assert_file_refused(file: &str, change: Change, words: &[&str]) {
    let Change { from, to } = change;
    let folder = workbench();
    let path = folder.path().join(file);
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{file} has no `{from}`");
    fs::write(&path, text.replacen(from, to, 1)).unwrap();
    assert_refused(folder.path(), &detect("single_a_3.mp4", "a"), words);
}

#[test]
fn the_error_for_an_unknown_key_names_the_nearest_known_key() {
    assert_file_refused(
        "cell.toml",
        Change { from: "focal_px", to: "focal_pix" },
        &["cell.toml", "`focal_pix`", "line 5", "`focal_px`"],
    );
    assert_file_refused(
        "objects.toml",
        Change { from: "height_m", to: "hight_m" },
        &["objects.toml", "`hight_m`", "`height_m`"],
    );
    assert_file_refused(
        "objects.toml",
        Change { from: "{ disc =", to: "{ disk =" },
        &["objects.toml", "`disk`", "`disc`"],
    );
}

#[test]
fn the_error_for_a_file_of_another_format_names_its_line_and_what_is_needed() {
    let folder = workbench();
    fs::write(folder.path().join("README.md"), "# A table\n\nThe opening strike scatters the rack.\n")
        .unwrap();
    let simulate =
        ["simulate", "README.md", "--properties", "p.json", "--strike", "s.json", "-o", "out.json"];
    let cases: [(&[&str], &str); 5] = [
        (&["estimate", "README.md", "-o", "out.json"], "needed: a campaign file in TOML"),
        (&["calibrate", "README.md", "single_a_3.mp4"], "needed: a cell file in TOML"),
        (
            &["detect", "cell.toml", "README.md", "single_a_3.mp4", "--objects", "a", "-o", "out.csv"],
            "needed: an objects file in TOML",
        ),
        (&simulate, "needed: a scene file in TOML"),
        (
            &["lens", "single_a_3.mp4", "--board", "README.md", "-o", "out.yaml"],
            "needed: a board file in TOML",
        ),
    ];
    for (args, needed) in cases {
        assert_refused(
            folder.path(),
            args,
            &["README.md: key with no value, expected `=` (line 3); ", needed],
        );
    }
    fs::copy(demo("pile.scene.toml"), folder.path().join("scene.toml")).unwrap();
    assert_refused(
        folder.path(),
        &["plan", "scene.toml", "--properties", "README.md", "-o", "out.json"],
        &["README.md: expected value (line 1); needed: a file in JSON"],
    );
}

#[test]
fn invalid_outlines_and_sizes_are_refused_with_the_name_of_the_object() {
    let crossed = "{ polygon = { points_m = [[0, 0], [0.05, 0.05], [0.05, 0], [0, 0.05]] } }";
    assert_file_refused(
        "objects.toml",
        Change { from: "{ disc = { radius_m = 0.04 } }", to: crossed },
        &["`a`", "self-crossing"],
    );
    assert_file_refused(
        "objects.toml",
        Change { from: "radius_m = 0.04", to: "radius_m = -0.04" },
        &["`a`", "radius_m", "-0.04"],
    );
    assert_file_refused(
        "objects.toml",
        Change { from: "height_m = 0.05", to: "height_m = nan" },
        &["`a`", "height_m", "NaN"],
    );
    assert_file_refused(
        "objects.toml",
        Change { from: "name = \"c\"", to: "name = \"a\"" },
        &["`a`", "twice"],
    );
    assert_file_refused(
        "cell.toml",
        Change { from: "size_m = 0.05", to: "size_m = -0.05" },
        &["cell.toml", "tag 0", "-0.05"],
    );
    assert_file_refused(
        "cell.toml",
        Change { from: "[workspace]\nmin_m = [-0.48", to: "[workspace]\nmin_m = [0.58" },
        &["workspace"],
    );
}

#[test]
fn a_campaign_with_a_missing_file_is_refused_before_any_film_is_read() {
    let folder = workbench();
    let campaign = "cell = \"cell.toml\"\nobjects = \"objects.toml\"\n[[clips]]\nvideo = \"gone.mp4\"\nobjects = [\"a\"]\n\
        strike = { speed_m_s = 0.4, heading_rad = 0.0, start_m = [-0.3, 0.0], travel_m = 0.07 }\n";
    fs::write(folder.path().join("campaign.toml"), campaign).unwrap();
    let args = ["estimate", "campaign.toml", "-o", "out.json"];
    assert_refused(folder.path(), &args, &["campaign.toml", "gone.mp4", "needed"]);
    fs::write(folder.path().join("campaign.toml"), campaign.replace("cell.toml", "sell.toml")).unwrap();
    assert_refused(folder.path(), &args, &["sell.toml"]);
}

#[test]
fn a_pair_without_a_measured_restitution_is_assumed_by_name() {
    let folder = workbench();
    for file in ["pile.scene.toml", "pile.strike.json"] {
        fs::copy(demo(file), folder.path().join(file)).unwrap();
    }
    let known = |mean: f64| {
        format!(
            "{{\"mean\": {mean}, \"std\": 0.01, \"standard_error\": 0.01, \"interval_95\": [0.1, 0.9], \"n\": 5}}"
        )
    };
    let objects = |mean: f64| format!("{{\"a\": {0}, \"c\": {0}, \"e\": {0}}}", known(mean));
    let properties = format!(
        "{{\"version\": 1, \"reference\": \"a\", \"friction\": {0}, \"striker_restitution\": {0}, \"restitution\": \
         {{\"a/c\": {1}, \"a/e\": {1}}}, \"mass_ratio\": {0}, \"pair_mass_ratio\": {{}}, \"contact_friction\": {{}}}}",
        objects(0.4),
        known(0.5)
    );
    fs::write(folder.path().join("properties.json"), properties).unwrap();
    let strike = ["--properties", "properties.json", "--strike", "pile.strike.json", "-o", "out.json"];
    let args = [&["simulate", "pile.scene.toml"], strike.as_slice()].concat();
    let export = [&["export", "pile.scene.toml", "--to", "mjcf"], strike.as_slice()].concat();
    for command in [&args, &export] {
        let output = breakshot(folder.path(), command);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(3), "{message}");
        assert!(
            ["c/e", "restitution", "assumed 0.5", "a clip of the pair"].iter().all(|w| message.contains(w)),
            "{message}"
        );
    }
    let elsewhere = [&["export", "pile.scene.toml", "--to", "doom"], strike.as_slice()].concat();
    let output = breakshot(folder.path(), &elsewhere);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.code() == Some(2) && message.contains("doom") && message.contains("mjcf"),
        "{message}"
    );

    let output = breakshot(folder.path(), &[args.as_slice(), &["--assume-restitution", "0.5"]].concat());
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(message.contains("c/e") && message.contains("given by hand"), "{message}");
}

#[test]
fn a_film_that_needs_ffmpeg_is_refused_with_a_hint_where_it_is_not_installed() {
    let folder = workbench();
    let films = Path::new(env!("CARGO_MANIFEST_DIR")).join("../breakshot/tests/data/footage");
    for (film, coding) in [
        ("h265.mp4", "H.265 (HEVC)"),
        ("ten_bit.mp4", "bit depth > 8"),
        ("full_colour.mp4", "non-4:2:0"),
        ("lossless.mp4", "lossless"),
        ("motion_jpeg.mov", "Motion JPEG"),
        ("interlaced.mp4", "interlace"),
    ] {
        fs::copy(films.join(film), folder.path().join(film)).unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_breakshot"))
            .current_dir(folder.path())
            .args(detect(film, "a"))
            .env("PATH", folder.path())
            .output()
            .unwrap();
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{film}: {message}");
        for word in [film, coding, "the program `ffmpeg`", "not installed"] {
            assert!(message.contains(word), "`{word}` is not in: {message}");
        }
    }
}

#[test]
fn a_missing_or_broken_camera_info_file_is_named_when_the_cell_is_read() {
    let lens = "focal_px = [";
    let folder = workbench();
    let path = folder.path().join("cell.toml");
    let text = fs::read_to_string(&path).unwrap();
    let without_lens: String = text
        .lines()
        .filter(|line| !["focal_px", "center_px", "distortion"].iter().any(|key| line.starts_with(key)))
        .map(|line| line.to_string() + "\n")
        .collect();
    assert!(
        text.contains(lens) && !without_lens.contains(lens),
        "the example gives its lens otherwise: {text}"
    );
    let named = without_lens.replacen("[camera]", "[camera]\ncamera_info = \"lens.yaml\"", 1);
    fs::write(&path, &named).unwrap();
    let args = detect("single_a_3.mp4", "a");
    assert_refused(folder.path(), &args, &["lens.yaml", "cannot be read"]);
    fs::write(folder.path().join("lens.yaml"), "image_width: 640\n").unwrap();
    assert_refused(folder.path(), &args, &["lens.yaml", "needed: a ROS CameraInfo file"]);
    fs::write(&path, text.replacen("[camera]", "[camera]\ncamera_info = \"lens.yaml\"", 1)).unwrap();
    assert_refused(folder.path(), &args, &["cell.toml", "both camera_info", "needed: the lens once"]);
}
