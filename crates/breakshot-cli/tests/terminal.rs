//! The program's surroundings: closed pipes, full disks, read-only folders, an empty environment.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn demo(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo").join(file)
}

fn breakshot() -> Command {
    Command::new(env!("CARGO_BIN_EXE_breakshot"))
}

fn look(output: &str) -> Vec<String> {
    let [cell, objects, film] =
        ["cell.toml", "objects.toml", "single_a_3.mp4"].map(|file| demo(file).display().to_string());
    ["look", &cell, &objects, &film, "--objects", "a", "-o", output].map(String::from).to_vec()
}

fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Asserts exit code 1 and one error line that contains all words.
fn assert_not_written(output: &Output, words: &[&str]) {
    let message = message(output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    let errors: Vec<&str> = message.lines().filter(|line| !line.starts_with("note: ")).collect();
    assert_eq!(errors.len(), 1, "expected one line: {message}");
    for word in words {
        assert!(errors[0].contains(word), "`{word}` is not in: {message}");
    }
}

#[test]
fn a_reader_that_closes_the_pipe_ends_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    let init = vec!["init".to_owned(), folder.path().join("cell").display().to_string()];
    for args in [look(scene.to_str().unwrap()), init, vec!["plan".into(), "--help".into()]] {
        // Both pipes are closed before the program writes.
        let mut child =
            breakshot().args(&args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop((child.stdout.take(), child.stderr.take()));
        assert_eq!(child.wait().unwrap().code(), Some(0), "{args:?}");
    }
    assert!(scene.exists() && folder.path().join("cell/cell.toml").exists(), "an output was not written");
}

#[test]
fn a_full_disk_is_one_sentence_and_exit_code_1() {
    let output = breakshot().args(look("/dev/full")).output().unwrap();
    assert_not_written(&output, &["error: /dev/full: cannot be written", "No space left"]);
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    let full = File::options().write(true).open("/dev/full").unwrap();
    let output = breakshot().args(look(scene.to_str().unwrap())).stdout(full).output().unwrap();
    assert_not_written(&output, &["error: stdout: cannot be written", "No space left"]);
}

#[test]
fn a_folder_that_cannot_be_written_is_one_sentence_and_exit_code_1() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    for place in
        ["/proc/scene.toml".into(), folder.path().join("file/scene.toml"), folder.path().to_path_buf()]
    {
        let output = breakshot().args(look(place.to_str().unwrap())).output().unwrap();
        assert_not_written(&output, &["cannot be written", place.to_str().unwrap()]);
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "a temporary file was left behind");
}

#[test]
fn the_result_is_the_same_without_home_and_locale() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = ["here.toml", "bare.toml"].map(|name| folder.path().join(name));
    let here = breakshot().args(look(scenes[0].to_str().unwrap())).output().unwrap();
    let bare = breakshot().args(look(scenes[1].to_str().unwrap())).env_clear().output().unwrap();
    assert_eq!((here.status.code(), bare.status.code()), (Some(0), Some(0)), "{}", message(&bare));
    assert_eq!(fs::read(&scenes[0]).unwrap(), fs::read(&scenes[1]).unwrap());
}

#[test]
fn names_with_control_characters_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("two\nlines.toml");
    let output = breakshot().args(look(name.to_str().unwrap())).output().unwrap();
    let message = message(&output);
    assert_eq!((output.status.code(), message.lines().count()), (Some(2), 1), "{message}");
    assert!(message.contains("two\\nlines") && message.contains("needed"), "{message}");
}

#[test]
fn an_overlay_may_have_the_name_of_an_option_or_a_protocol_and_is_whole_or_absent() {
    let folder = tempfile::tempdir().unwrap();
    let [cell, objects, film] =
        ["cell.toml", "objects.toml", "single_a_3.mp4"].map(|file| demo(file).display().to_string());
    let input = ["detect", &cell, &objects, &film, "--objects", "a", "-o", "tracks.csv"];
    for name in ["-vn.mp4", "http:film.mp4"] {
        let overlay = format!("--overlay={name}");
        let output = breakshot().current_dir(folder.path()).args(input).arg(overlay).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{name}: {}", message(&output));
        // Without `ffmpeg` it is a folder of images.
        let written = [name, name.trim_end_matches(".mp4")].map(|name| folder.path().join(name).exists());
        assert!(written.contains(&true), "{name} was not written");
    }
    let output =
        breakshot().current_dir(folder.path()).args(input).arg("--overlay=no/o.mp4").output().unwrap();
    assert_not_written(&output, &["no/o", "cannot be written"]);
    let parts = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
    assert_eq!(
        parts.filter(|name| name.to_string_lossy().starts_with('.')).count(),
        0,
        "a part was left behind"
    );
}

/// A folder with a program called `ffmpeg`, to be searched first.
fn with_ffmpeg(script: &str) -> (tempfile::TempDir, String) {
    use std::os::unix::fs::PermissionsExt;
    let programs = tempfile::tempdir().unwrap();
    let ffmpeg = programs.path().join("ffmpeg");
    fs::write(&ffmpeg, format!("#!/bin/sh\n{script}\n")).unwrap();
    fs::set_permissions(&ffmpeg, fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!("{}:{}", programs.path().display(), std::env::var("PATH").unwrap());
    (programs, path)
}

fn overlay(folder: &Path, path: &str, name: &str) -> Output {
    let [cell, objects, film] =
        ["cell.toml", "objects.toml", "single_a_3.mp4"].map(|file| demo(file).display().to_string());
    let input =
        ["detect", &cell, &objects, &film, "--objects", "a", "--decoder", "builtin", "-o", "tracks.csv"];
    let overlay = format!("--overlay={name}");
    breakshot().current_dir(folder).env("PATH", path).args(input).arg(overlay).output().unwrap()
}

/// The names of the files in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = entries.collect();
    names.sort();
    names
}

#[test]
fn an_encoder_that_fails_leaves_no_overlay_and_its_own_reason() {
    let folder = tempfile::tempdir().unwrap();
    let fails =
        "for last; do :; done; echo half > \"${last#file:}\"; echo 'No space left on device' >&2; exit 1";
    let (_programs, path) = with_ffmpeg(fails);
    let output = overlay(folder.path(), &path, "o.mp4");
    assert_not_written(&output, &["o.mp4", "`ffmpeg` ended with", "No space left on device"]);
    assert_eq!(names(folder.path()), ["tracks.csv"]);
    // One that succeeds gives the file its name.
    let (_programs, path) = with_ffmpeg("for last; do :; done; cat > \"${last#file:}\"");
    let output = overlay(folder.path(), &path, "o.mp4");
    assert_eq!(output.status.code(), Some(0), "{}", message(&output));
    assert_eq!(names(folder.path()), ["o.mp4", "tracks.csv"]);
    assert!(fs::metadata(folder.path().join("o.mp4")).unwrap().len() > 1_000_000);
}

#[test]
fn images_of_an_overlay_replace_those_of_an_earlier_one_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let nowhere = tempfile::tempdir().unwrap();
    let path = nowhere.path().to_str().unwrap();
    for _ in 0..2 {
        let output = overlay(folder.path(), path, "o.mp4");
        assert_eq!(output.status.code(), Some(0), "{}", message(&output));
        assert_eq!(names(folder.path()), ["o", "tracks.csv"]);
    }
    // The user's own images have times too.
    let own = folder.path().join("own");
    fs::create_dir(&own).unwrap();
    fs::write(own.join("timing.toml"), "times_s = [0.0]\n").unwrap();
    let output = overlay(folder.path(), path, "own.mp4");
    let message = message(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("own") && message.contains("needed: a new name"), "{message}");
    assert_eq!(names(&own), ["timing.toml"]);
}

#[test]
fn what_a_killed_overlay_leaves_is_removed_by_the_next_run() {
    let folder = tempfile::tempdir().unwrap();
    let (programs, path) = with_ffmpeg("echo $$ > \"$(dirname \"$0\")/pid\"; exec sleep 1000");
    let [cell, objects, film] =
        ["cell.toml", "objects.toml", "single_a_3.mp4"].map(|file| demo(file).display().to_string());
    let args = [
        "detect",
        &cell,
        &objects,
        &film,
        "--objects",
        "a",
        "--decoder",
        "builtin",
        "-o",
        "t.csv",
        "--overlay=o.mp4",
    ];
    let mut child = breakshot().current_dir(folder.path()).env("PATH", &path).args(args).spawn().unwrap();
    let pid = programs.path().join("pid");
    while !fs::read_to_string(&pid).is_ok_and(|text| text.ends_with('\n')) {
        assert!(child.try_wait().unwrap().is_none(), "it ended");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    Command::new("kill").arg(fs::read_to_string(&pid).unwrap().trim()).status().unwrap();
    // The next output in the folder removes what is left, if there is anything.
    let output = breakshot().current_dir(folder.path()).args(look("scene.toml")).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", message(&output));
    assert_eq!(names(folder.path()), ["scene.toml", "t.csv"]);
}

#[test]
fn a_full_disk_is_one_sentence_for_every_command_that_writes() {
    let folder = tempfile::tempdir().unwrap();
    let init = breakshot().args(["init", folder.path().to_str().unwrap()]).output().unwrap();
    assert_eq!(init.status.code(), Some(0), "{}", message(&init));
    let file = |name: &str| demo(name).display().to_string();
    let [cell, objects, film, scene, strike] =
        ["cell.toml", "objects.toml", "single_a_3.mp4", "pile.scene.toml", "pile.strike.json"].map(file);
    // All properties are assumed.
    let properties = folder.path().join("properties.json").display().to_string();
    fs::write(&properties, PROPERTIES).unwrap();
    let of_strike = ["--properties", &properties, "--strike", &strike];
    let commands: [Vec<&str>; 6] = [
        vec!["tags"],
        vec!["calibrate", &cell, &film],
        vec!["look", &cell, &objects, &film, "--objects", "a"],
        [&["simulate", &scene][..], &of_strike].concat(),
        [&["export", &scene, "--to", "mjcf"][..], &of_strike].concat(),
        vec!["plan", &scene, "--properties", &properties, "--method", "paper"],
    ];
    for command in commands {
        let output =
            breakshot().current_dir(folder.path()).args(&command).args(["-o", "/dev/full"]).output().unwrap();
        let message = message(&output);
        assert_eq!(output.status.code(), Some(1), "{command:?}: {message}");
        let errors: Vec<&str> = message.lines().filter(|line| line.starts_with("error: ")).collect();
        assert_eq!(errors.len(), 1, "{command:?}: {message}");
        assert!(errors[0].contains("/dev/full") && errors[0].contains("No space left"), "{message}");
        assert!(!message.contains("panicked"), "{message}");
    }
}

/// Properties without measurements.
const PROPERTIES: &str = r#"{ "version": 1, "reference": "a", "friction": {}, "striker_restitution": {}, "restitution": {},
    "mass_ratio": {}, "pair_mass_ratio": {}, "contact_friction": {}, "warnings": [] }"#;
