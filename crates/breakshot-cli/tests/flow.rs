//! The program as a process: exit codes, files, the same bytes for any number of threads.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo")
}

fn breakshot(folder: &Path, args: &[&str], threads: usize) -> Output {
    Command::new(env!("CARGO_BIN_EXE_breakshot"))
        .current_dir(folder)
        .args(args)
        .env("RAYON_NUM_THREADS", threads.to_string())
        .output()
        .unwrap()
}

/// Runs a command that must succeed and returns its standard output.
fn ran(folder: &Path, args: &[&str]) -> String {
    let output = breakshot(folder, args, 2);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        matches!(output.status.code(), Some(0 | 3)),
        "{args:?} ended with {:?}: {message}",
        output.status
    );
    String::from_utf8(output.stdout).unwrap()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn the_demo_writes_the_output_of_every_stage_and_the_commands_run_on_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let printed = ran(folder.path(), &["demo", "-o", "demo"]);
    assert!(printed.contains("report.html"), "{printed}");
    let demo = folder.path().join("demo");
    let page = fs::read_to_string(demo.join("report.html")).unwrap();
    // The data of embedded images may contain any letters.
    let words: String = page
        .split("base64,")
        .enumerate()
        .map(|(k, part)| if k == 0 { part } else { part.split_once('"').map_or("", |(_, rest)| rest) })
        .collect();
    assert!(words.contains("<svg") && words.contains("Filmed against simulated"), "figures and chapters");
    for bad in ["NaN", "<script src", "http://", "https://"] {
        let at = words.replace("http://www.w3.org", "").find(bad);
        assert!(at.is_none(), "`{bad}` is in the page");
    }
    // The motions of a clip, of the planned strike and of the filmed one, and the script that plays them.
    let scripts = ["<script type=\"application/json\"", "<script type=\"module\"", "<script"];
    assert_eq!(scripts.map(|script| words.matches(script).count()), [3, 1, 4], "scripts in the page");

    // The weighed masses are not used in the estimation; they are the reference.
    let properties = json(&demo.join("properties.json"));
    for (object, ratio) in [("c", 112.0 / 143.0), ("e", 61.0 / 143.0)] {
        let estimated = properties["mass_ratio"][object]["mean"].as_f64().unwrap();
        assert!((estimated / ratio - 1.0).abs() < 0.03, "mass of {object}: {estimated}, weighed {ratio}");
    }

    // The filmed strike on the pile was planned by the robust method, and it works.
    let report = json(&demo.join("pile.report.json"));
    assert_eq!(report["goal"]["observed"]["fulfilled"], true, "{}", report["goal"]);

    // The simulation of the planned strike reproduces the prediction of the plan exactly.
    let plan = json(&demo.join("plan.json"));
    let inputs = ["pile.scene.toml", "--properties", "properties.json", "--strike"];
    ran(&demo, &[&["simulate"], inputs.as_slice(), &["plan.json", "-o", "again.json"]].concat());
    assert_eq!(plan["prediction"]["final"], json(&demo.join("again.json"))["final"]);
    let model = ["plan.json", "--to", "mjcf", "-o", "scene.xml"];
    ran(&demo, &[&["export"], inputs.as_slice(), &model].concat());
    let model = fs::read_to_string(demo.join("scene.xml")).unwrap();
    assert!(model.contains("<mujoco") && model.matches("<body ").count() == 4, "{model}");

    let verify = ["verify", "pile.scene.toml", "pile.mp4", "--properties", "properties.json"];
    let printed =
        ran(&demo, &[&verify, ["--strike", "pile.strike.json", "-o", "report"].as_slice()].concat());
    assert!(printed.contains("a - c"), "{printed}");
    for file in ["report.html", "report.json", "distances.csv", "tracks.json", "trajectory.json"] {
        assert!(demo.join("report").join(file).exists(), "{file} is missing");
    }
    let alignment = &json(&demo.join("report/report.json"))["alignment"];
    assert_eq!(*alignment, report["alignment"], "film and simulation have the same time axis as in the demo");
    assert_eq!(alignment["object"], "a", "the object that is struck");
}

#[test]
fn the_same_clips_give_the_same_bytes_on_one_and_on_three_threads() {
    let folder = tempfile::tempdir().unwrap();
    let campaign = fixtures().join("campaign.toml").display().to_string();
    let properties = [1, 3].map(|threads| {
        let output = breakshot(folder.path(), &["estimate", &campaign, "-o", "p.json"], threads);
        assert!(matches!(output.status.code(), Some(0 | 3)), "{}", String::from_utf8_lossy(&output.stderr));
        fs::read(folder.path().join("p.json")).unwrap()
    });
    assert!(properties[0] == properties[1], "the number of threads changed the result");
}

#[test]
fn look_finds_the_objects_at_the_poses_of_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| fixtures().join(name).display().to_string();
    let (cell, objects, film) = (file("cell.toml"), file("objects.toml"), file("pile.mp4"));
    let args = ["look", &cell, &objects, &film, "--objects", "e,a,c", "-o", "scene.toml", "--json"];
    let observed: Value = serde_json::from_str(&ran(folder.path(), &args)).unwrap();
    let scene = fs::read_to_string(fixtures().join("pile.scene.toml")).unwrap();
    for placed in observed["placed"].as_array().unwrap() {
        let name = placed["object"].as_str().unwrap();
        let entry = scene.split("[[placed]]").find(|e| e.contains(&format!("\"{name}\""))).unwrap();
        let numbers = entry.split('[').nth(1).unwrap().split(']').next().unwrap();
        for (k, number) in numbers.split(',').enumerate() {
            let (expected_m, observed_m) =
                (number.trim().parse::<f64>().unwrap(), placed["position_m"][k].as_f64().unwrap());
            assert!(
                (expected_m - observed_m).abs() < 5e-4,
                "{name}: observed {observed_m} m, in the scene {expected_m} m"
            );
        }
    }
    assert!(fs::read_to_string(folder.path().join("scene.toml")).unwrap().contains("[[placed]]"));
}

#[test]
fn the_tracks_are_a_table_with_the_documented_columns() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| fixtures().join(name).display().to_string();
    let (cell, objects, film) = (file("cell.toml"), file("objects.toml"), file("pair_a_c_3.mp4"));
    let args =
        ["detect", &cell, &objects, &film, "--objects", "a,c", "--strike-heading-rad", "0", "-o", "t.csv"];
    ran(folder.path(), &args);
    let table = fs::read_to_string(folder.path().join("t.csv")).unwrap();
    let mut lines = table.lines();
    assert_eq!(
        lines.next(),
        Some("object,time_s,x_m,y_m,yaw_rad,vx_m_s,vy_m_s,yaw_rate_rad_s,ax_m_s2,ay_m_s2")
    );
    let of = |name: &str| table.lines().filter(|line| line.starts_with(&format!("{name},"))).count();
    assert!(of("a") == of("c") && of("a") > 40, "a has {} samples, c has {}", of("a"), of("c"));
    assert!(lines.all(|line| line.split(',').count() == 10));
}

#[test]
fn templates_can_be_read_and_are_never_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    ran(folder.path(), &["init", "cell"]);
    let cell = folder.path().join("cell");
    for file in ["cell.toml", "objects.toml", "campaign.toml", "scene.toml", "FILMING.md"] {
        assert!(cell.join(file).exists(), "{file} is missing");
    }
    // The templates are valid; only the films are missing.
    let output = breakshot(&cell, &["estimate", "campaign.toml", "-o", "p.json"], 1);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("puck_1.mp4"), "{message}");
    assert_eq!(breakshot(folder.path(), &["init", "cell"], 1).status.code(), Some(2));
}

#[test]
fn the_help_of_every_command_has_an_example() {
    let folder = tempfile::tempdir().unwrap();
    let help = ran(folder.path(), &["--help"]);
    let commands = help.split("Commands:").nth(1).unwrap().split("\n\n").next().unwrap();
    // A continuation line is indented further.
    let names = commands.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    for name in names.filter(|name| !name.is_empty() && *name != "help") {
        let help = ran(folder.path(), &[name, "--help"]);
        assert!(help.contains("Example: breakshot "), "{name} has no example:\n{help}");
    }
}
