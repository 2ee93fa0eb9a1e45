//! `breakshot film-report`: the film of a whole procedure.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use common::{assert_refused, breakshot, demo};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The example's folder with properties and a plan of a few scenarios.
fn procedure(folder: &Path) {
    for entry in demo("").read_dir().unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, folder.join(path.file_name().unwrap())).unwrap();
    }
    let output =
        breakshot(folder, &["estimate", "campaign.toml", "--tracks", "tracks", "-o", "properties.json"]);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{}", text(&output));
    let plan = ["plan", "pile.scene.toml", "--properties", "properties.json", "-o", "plan.json"];
    let output = breakshot(folder, &plan);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{}", text(&output));
}

#[test]
fn a_film_of_nothing_and_one_without_its_scene_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = breakshot(folder.path(), &["film-report", "-o", "out.mp4"]);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    assert!(text(&output).contains("--campaign") && text(&output).contains("--strike"), "{}", text(&output));
    for flags in [["--size", "1280"], ["--speed", "0"], ["--speed", "NaN"], ["--clips", "25"]] {
        let args = ["film-report", "--campaign", "campaign.toml", flags[0], flags[1], "-o", "out.mp4"];
        let output = breakshot(folder.path(), &args);
        assert_eq!(output.status.code(), Some(2), "{flags:?}: {}", text(&output));
        assert!(text(&output).contains(flags[0]), "{flags:?}: {}", text(&output));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "something was written");
}

#[test]
fn without_ffmpeg_the_error_names_it_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let campaign = demo("campaign.toml").display().to_string();
    let arguments = ["film-report", "--campaign", &campaign, "-o", "out.mp4"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_breakshot"));
    let output = command.current_dir(folder.path()).env("PATH", "none").args(arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output).contains("`ffmpeg`, which is not installed"), "{}", text(&output));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "something was written");
}

/// A field of the film's stream.
fn probed(film: &Path, field: &str) -> String {
    let mut command = Command::new("ffprobe");
    command.args(["-v", "error", "-select_streams", "v", "-count_packets", "-of", "csv=p=0"]);
    let output = command.args(["-show_entries", &format!("stream={field}")]).arg(film).output().unwrap();
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_film_of_a_procedure_has_all_its_parts_and_is_whole_or_absent() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    procedure(folder);
    // A strike without a scene, an odd size, a film that is none: each is refused before something is encoded.
    let strike = ["film-report", "--strike", "pile.strike.json", "-o", "out.mp4"];
    assert_refused(folder, &strike, &["pile.strike.json", "--scene"]);
    let odd = ["film-report", "--properties", "properties.json", "--size", "641x480", "-o", "out.mp4"];
    assert_refused(folder, &odd, &["641x480", "even"]);
    fs::write(folder.join("broken.mp4"), "no film").unwrap();
    let pile =
        ["--scene", "pile.scene.toml", "--strike", "pile.strike.json", "--properties", "properties.json"];
    let broken = [&["film-report"], &pile[..], &["--executed", "broken.mp4", "-o", "out.mp4"]].concat();
    assert_refused(folder, &broken, &["broken.mp4"]);
    assert!(!folder.join("out.mp4").exists());

    let frames = |args: &[&str]| {
        let all = [&["film-report", "--size", "320x240"], args, &["-o", "out.mp4"]].concat();
        let output = breakshot(folder, &all);
        assert!(matches!(output.status.code(), Some(0 | 3)), "{args:?}: {}", text(&output));
        let film = folder.join("out.mp4");
        assert_eq!(probed(&film, "width,height,pix_fmt,r_frame_rate"), "320,240,yuv420p,30/1");
        assert_eq!(probed(&film, "codec_name"), "h264");
        probed(&film, "nb_read_packets").parse::<usize>().unwrap()
    };
    // Each part makes it longer; the title and a page of values are 3 s and 5 s.
    let values = frames(&["--properties", "properties.json"]);
    assert!(values >= 240 && values.is_multiple_of(30), "{values} frames");
    let one = frames(&["--campaign", "campaign.toml", "--tracks", "tracks", "--clips", "1"]);
    let two = frames(&["--campaign", "campaign.toml", "--tracks", "tracks", "--clips", "2"]);
    assert!(one > 90 + 45 && two > one + 45, "{one} and {two} frames");
    let slow =
        frames(&["--campaign", "campaign.toml", "--tracks", "tracks", "--clips", "1", "--speed", "0.25"]);
    // Title and last image stay as long.
    let moving = |frames: usize| (frames - 90 - 45) as f64;
    assert!((moving(slow) / moving(one) - 2.0).abs() < 0.1, "{one} frames, {slow} at half the speed");
    let plan = frames(&["--strike", "plan.json"]);
    assert_eq!(plan, 90 + 210, "a title and a plan that is not simulated");
    let planned = frames(&["--strike", "plan.json", "--properties", "properties.json"]);
    assert!(planned > values + 210, "{planned} frames");
    let executed = frames(&[&pile[..], &["--executed", "pile.mp4"]].concat());
    assert!(executed > values + 210, "{executed} frames");
    let names: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(names.iter().all(|name| !name.to_string_lossy().starts_with('.')), "{names:?}");
}
