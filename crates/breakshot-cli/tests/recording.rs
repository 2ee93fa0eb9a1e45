//! Films from cameras: `breakshot film`, and `breakshot look` before a camera.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use common::{assert_refused, breakshot, demo};
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn impossible_sources_and_settings_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (args, words) in [
        (vec!["v4l2:/dev/video_none"], vec!["v4l2:/dev/video_none", "no such device", "needed"]),
        (vec!["none.mp4"], vec!["none.mp4", "no such file"]),
        (vec!["rtsp://10.0.0.1/", "--size", "640x480"], vec!["--size", "at the camera itself"]),
        (vec!["none.mp4", "--exposure-us", "2000"], vec!["--exposure-us"]),
    ] {
        assert_refused(folder.path(), &[&["film"], &args[..], &["-o", "out.mp4"]].concat(), &words);
    }
    for flags in [["--size", "640"], ["--fps", "0"], ["--seconds", "NaN"], ["--camera-coding", "a b"]] {
        let output =
            breakshot(folder.path(), &["film", "v4l2:/dev/video0", flags[0], flags[1], "-o", "out.mp4"]);
        assert_eq!(output.status.code(), Some(2), "{flags:?}: {}", text(&output));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "something was written");
}

#[test]
fn without_ffmpeg_or_with_one_that_fails_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(demo("single_a_3.mp4"), folder.path().join("in.mp4")).unwrap();
    let run = |path: &str| {
        let arguments = ["film", "in.mp4", "-o", "out.mp4"];
        let mut command = Command::new(env!("CARGO_BIN_EXE_breakshot"));
        command.current_dir(folder.path()).env("PATH", path).args(arguments).output().unwrap()
    };
    let output = run("none");
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output).contains("`ffmpeg`, which is not installed"), "{}", text(&output));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let programs = tempfile::tempdir().unwrap();
        let program = programs.path().join("ffmpeg");
        let script = "#!/bin/sh\nfor last; do :; done; echo half > \"${last#file:}\"; echo '[error] No space left on device' >&2; exit 1\n";
        fs::write(&program, script).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        let output = run(&format!("{}:{}", programs.path().display(), std::env::var("PATH").unwrap()));
        assert!(text(&output).contains("No space left on device"), "{}", text(&output));
        assert_eq!(output.status.code(), Some(2));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "something was left behind");
}

/// Tracks of a film of the example by name: times and positions.
fn tracks(folder: &Path, film: &Path) -> Vec<[f64; 3]> {
    let [cell, objects] = ["cell.toml", "objects.toml"].map(|file| demo(file).display().to_string());
    let film = film.display().to_string();
    let args = ["detect", &cell, &objects, &film, "--objects", "a", "-o", "tracks.csv"];
    let output = breakshot(folder, &args);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{}", text(&output));
    let table = fs::read_to_string(folder.join("tracks.csv")).unwrap();
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let columns = ["time_s", "x_m", "y_m"].map(|name| names.iter().position(|n| *n == name).unwrap());
    lines
        .map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            columns.map(|k| fields[k].parse().unwrap())
        })
        .collect()
}

/// Largest difference of positions at the same picture (m), and of times from the first picture (s).
fn differences(a: &[[f64; 3]], b: &[[f64; 3]]) -> [f64; 2] {
    let pairs = a.iter().zip(b);
    let position = |(a, b): (&[f64; 3], &[f64; 3])| (a[1] - b[1]).hypot(a[2] - b[2]);
    let time = |(p, q): (&[f64; 3], &[f64; 3])| ((p[0] - a[0][0]) - (q[0] - b[0][0])).abs();
    [pairs.clone().map(position).fold(0.0, f64::max), pairs.map(time).fold(0.0, f64::max)]
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_film_that_is_played_gives_the_tracks_of_the_original() {
    let folder = tempfile::tempdir().unwrap();
    let original = demo("single_a_3.mp4");
    let output = breakshot(folder.path(), &["film", original.to_str().unwrap(), "--json", "-o", "out.mp4"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    let recorded: Value = serde_json::from_slice(&output.stdout).unwrap();
    let (given, found) =
        (tracks(folder.path(), &original), tracks(folder.path(), &folder.path().join("out.mp4")));
    assert_eq!((recorded["missing_frames"].as_u64(), given.len()), (Some(0), found.len()));
    let [position_m, time_s] = differences(&given, &found);
    assert!(position_m < 1e-4 && time_s < 1e-5, "{position_m} m, {time_s} s");
}

/// An `ffmpeg` that plays a film of the example in real time as a server for one client, and its address.
fn served(coding: &[&str], format: &str) -> (Child, String) {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let address = format!("http://127.0.0.1:{port}/stream");
    let film = demo("single_a_3.mp4");
    let mut command = Command::new("ffmpeg");
    command.args(["-nostdin", "-v", "error", "-re", "-i", film.to_str().unwrap()]).args(coding);
    command.args(["-f", format, "-listen", "1", &address]).stdout(Stdio::null()).stderr(Stdio::null());
    let server = command.spawn().unwrap();
    std::thread::sleep(Duration::from_millis(700));
    (server, address)
}

#[test]
#[ignore = "needs ffmpeg"]
fn streams_are_recorded_with_their_times_or_those_of_their_arrival() {
    let folder = tempfile::tempdir().unwrap();
    let given = tracks(folder.path(), &demo("single_a_3.mp4"));
    let (mut server, address) = served(&["-c:v", "copy"], "mpegts");
    let output = breakshot(folder.path(), &["film", &address, "-o", "out.mp4"]);
    let _ = server.kill();
    let _ = server.wait();
    // The exposure of a camera of the network is not known.
    assert_eq!(output.status.code(), Some(3), "{}", text(&output));
    assert!(text(&output).contains("exposure") && !text(&output).contains("arrival"), "{}", text(&output));
    let found = tracks(folder.path(), &folder.path().join("out.mp4"));
    let [position_m, time_s] = differences(&given, &found);
    assert!(found.len() == given.len() && position_m < 1e-4 && time_s < 3e-5, "{position_m} m, {time_s} s");
    let address = served_pictures(folder.path());
    let output = breakshot(folder.path(), &["film", &address, "-o", "pictures.mp4"]);
    assert_eq!(output.status.code(), Some(3), "{}", text(&output));
    assert!(text(&output).contains("the times of their arrival are used"), "{}", text(&output));
    let found = tracks(folder.path(), &folder.path().join("pictures.mp4"));
    // Which of the first and last pictures arrive depends on the connection; the object rests in both.
    let [first, last] = [
        differences(&given[..1], &found[..1]),
        differences(&given[given.len() - 1..], &found[found.len() - 1..]),
    ];
    assert!(first[0] < 1e-4 && last[0] < 1e-4, "{first:?}, {last:?}");
    assert!(found.len() + 5 >= given.len() && found.len() <= given.len(), "{} pictures", found.len());
    assert!(found.windows(2).all(|pair| pair[1][0] > pair[0][0]), "times that do not grow");
}

/// The address of a server that sends single pictures of a film of the example, each when it is taken, to every client.
fn served_pictures(folder: &Path) -> String {
    const MARK: &[u8] = b"--ffmpeg";
    let (film, pictures) = (demo("single_a_3.mp4"), folder.join("pictures"));
    let coded = [
        "-nostdin",
        "-v",
        "error",
        "-i",
        film.to_str().unwrap(),
        "-c:v",
        "mjpeg",
        "-q:v",
        "1",
        "-f",
        "mpjpeg",
    ];
    assert!(Command::new("ffmpeg").args(coded).arg(&pictures).status().unwrap().success());
    let bytes = fs::read(pictures).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("http://{}/video.mjpg", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let mut starts: Vec<usize> = (0..bytes.len()).filter(|&k| bytes[k..].starts_with(MARK)).collect();
        starts.push(bytes.len());
        for client in listener.incoming() {
            let mut client = client.unwrap();
            let mut send = |bytes: &[u8]| client.write_all(bytes).is_ok();
            send(b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=ffmpeg\r\n\r\n");
            for part in starts.windows(2) {
                if !send(&bytes[part[0]..part[1]]) {
                    break;
                }
                std::thread::sleep(Duration::from_millis(16));
            }
            // The client closes the connection first, or has read all by now.
            std::thread::sleep(Duration::from_millis(500));
        }
    });
    address
}

#[test]
#[ignore = "needs ffmpeg"]
fn an_interrupted_recording_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let film = demo("single_a_3.mp4");
    let long = ["-nostdin", "-v", "error", "-stream_loop", "40", "-i", film.to_str().unwrap(), "-c", "copy"];
    let made = Command::new("ffmpeg").args(long).arg(folder.path().join("long.mp4")).status().unwrap();
    assert!(made.success());
    let mut command = Command::new(env!("CARGO_BIN_EXE_breakshot"));
    command.current_dir(folder.path()).args(["film", "long.mp4", "-o", "out.mp4"]);
    let recorder = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(4));
    let sent = Command::new("kill").args(["-INT", &recorder.id().to_string()]).status().unwrap();
    let output = recorder.wait_with_output().unwrap();
    assert!(sent.success() && output.status.code() == Some(0), "{}", text(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("pictures of"), "{}", text(&output));
    let mut names: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["long.mp4", "out.mp4"]);
}

#[test]
#[ignore = "needs ffmpeg"]
fn look_takes_pictures_from_a_stream() {
    let folder = tempfile::tempdir().unwrap();
    let [cell, objects] = ["cell.toml", "objects.toml"].map(|file| demo(file).display().to_string());
    let (mut server, address) = served(&["-c:v", "copy"], "mpegts");
    let output = breakshot(
        folder.path(),
        &["look", &cell, &objects, &address, "--objects", "a", "--json", "-o", "scene.toml"],
    );
    let _ = server.kill();
    let _ = server.wait();
    let message = text(&output);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{message}");
    let scene: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(scene["placed"][0]["object"], "a");
    // An address may deliver an old film: the pictures count as new only if the user says so.
    assert!(scene["observed_unix_s"].is_null() && message.contains("--taken-unix-s"), "{message}");
}
