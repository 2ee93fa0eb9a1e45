//! Updates with new clips, figures and proposed clips, at the process boundary.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{assert_refused, breakshot, demo};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Files of the example, and the campaigns `first.toml` (one film) and `second.toml` (another one).
fn workbench() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in ["cell.toml", "objects.toml", "single_a_3.mp4", "pair_a_c_3.mp4"] {
        fs::copy(demo(file), folder.path().join(file)).unwrap();
    }
    let whole = fs::read_to_string(demo("campaign.toml")).unwrap();
    let (head, clips) = whole.split_once("[[clips]]").unwrap();
    for (name, film) in [("first.toml", "single_a_3.mp4"), ("second.toml", "pair_a_c_3.mp4")] {
        let clip = clips.split("[[clips]]").find(|clip| clip.contains(film)).unwrap();
        fs::write(folder.path().join(name), format!("{head}[[clips]]{clip}")).unwrap();
    }
    folder
}

fn json(folder: &Path, file: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join(file)).unwrap()).unwrap()
}

#[test]
fn an_update_adds_clips_draws_figures_and_proposes_clips() {
    let folder = workbench();
    let at = folder.path();
    let output = breakshot(at, &["estimate", "first.toml", "-o", "old.json", "--figures", "figures"]);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(message.contains("not drawn: fig9_mass_ratio: no clip"), "{message}");
    let svg = fs::read_to_string(at.join("figures/fig7_friction.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("<style>"));
    assert!(!at.join("figures/fig9_mass_ratio.svg").exists(), "an empty figure was drawn");

    let args =
        ["estimate", "second.toml", "--update", "old.json", "-o", "new.json", "--advise", "2", "--json"];
    let output = breakshot(at, &args);
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    let (old, new, advice) = (json(at, "old.json"), json(at, "new.json"), json(at, "advice.json"));
    assert_eq!((&old["friction"]["a"]["n"], &new["friction"]["a"]["n"]), (&Value::from(1), &Value::from(2)));
    assert_eq!(new["evidence"]["clips"].as_array().unwrap().len(), 2);
    assert_eq!(advice["clips"].as_array().unwrap().len(), 2);
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(printed["advice"], advice);
    assert!(printed.get("evidence").is_none());
}

#[test]
fn an_impossible_update_is_refused_before_any_film_is_read() {
    let folder = workbench();
    let at = folder.path();
    let output = breakshot(at, &["estimate", "first.toml", "-o", "old.json"]);
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    let update = |campaign| ["estimate", campaign, "--update", "old.json", "-o", "out.json"];
    assert_refused(at, &update("first.toml"), &["single_a_3.mp4", "name"]);
    fs::rename(at.join("single_a_3.mp4"), at.join("renamed.mp4")).unwrap();
    let first = fs::read_to_string(at.join("first.toml")).unwrap();
    fs::write(at.join("renamed.toml"), first.replace("single_a_3.mp4", "renamed.mp4")).unwrap();
    assert_refused(at, &update("renamed.toml"), &["renamed.mp4", "single_a_3.mp4", "content"]);
    let with_reference = [&update("second.toml")[..], &["--reference", "c"]].concat();
    assert_refused(at, &with_reference, &["reference", "`c`", "`a`"]);

    let change = |file: &str, (from, to): (&str, &str), words: &[&str]| {
        let text = fs::read_to_string(at.join(file)).unwrap();
        assert!(text.contains(from), "{file} has no `{from}`");
        fs::write(at.join(file), text.replacen(from, to, 1)).unwrap();
        assert_refused(at, &update("second.toml"), words);
        fs::write(at.join(file), text).unwrap();
    };
    change("objects.toml", ("height_m = 0.05", "height_m = 50.0"), &["`a`", "height_m", "50", "0.05"]);
    change("cell.toml", ("radius_m = 0.015", "radius_m = 0.02"), &["cell", "striker", "0.02"]);
    change("cell.toml", ("center_m = [0.4, 0.21]", "center_m = [0.41, 0.21]"), &["cell", "tag 2", "0.41"]);
    change("old.json", ("\"evidence\"", "\"evidences\""), &["old.json", "evidences"]);
    change("second.toml", ("objects = [\"a\"", "objects = [\"zebra\""), &["zebra"]);

    let mut bare = json(at, "old.json");
    bare.as_object_mut().unwrap().remove("evidence");
    fs::write(at.join("old.json"), bare.to_string()).unwrap();
    assert_refused(at, &update("second.toml"), &["evidence", "missing", "needed"]);
}

#[test]
fn invalid_numbers_of_proposed_clips_are_refused() {
    let folder = workbench();
    for args in [
        &["estimate", "first.toml", "-o", "out.json", "--advise", "0"][..],
        &["estimate", "first.toml", "-o", "out.json", "--advise", "many"],
        &["estimate", "first.toml", "-o", "out.json", "--seed", "3"],
    ] {
        let output = breakshot(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(!folder.path().join("out.json").exists());
    }
}

/// The example's cell and objects, what two films measure, and the plan of a strike on two of its objects.
fn planned_pile() -> tempfile::TempDir {
    let folder = workbench();
    let at = folder.path();
    let pile = |from: &str, apart_m: f64| {
        format!(
            "cell = \"{from}cell.toml\"\nobjects = \"{from}objects.toml\"\n\
             [[placed]]\nobject = \"a\"\nposition_m = [-0.1, 0.0]\n\
             [[placed]]\nobject = \"c\"\nposition_m = [{:?}, 0.0]\n",
            apart_m - 0.1
        )
    };
    fs::write(at.join("pile.toml"), pile("", 0.13)).unwrap();
    fs::write(at.join("apart.toml"), pile("../", 0.25)).unwrap();
    let output = breakshot(at, &["estimate", "second.toml", "-o", "old.json"]);
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    let plan =
        ["plan", "pile.toml", "--properties", "old.json", "--method", "paper", "-o", "plan.json", "--json"];
    let output = breakshot(at, &plan);
    assert!(json(at, "plan.json")["strike"].is_object(), "{}", String::from_utf8_lossy(&output.stderr));
    folder
}

/// Writes the simulated motion of the planned strike as tracks of 100 Hz with noise of about 0.05 mm from a seed.
fn write_simulated_tracks(at: &Path, file: &str, seed: u64) {
    let args =
        ["simulate", "pile.toml", "--properties", "old.json", "--strike", "plan.json", "-o", "motion.json"];
    breakshot(at, &args);
    let motion: breakshot::physics::Trajectory =
        serde_json::from_str(&fs::read_to_string(at.join("motion.json")).unwrap()).unwrap();
    let mut state = seed;
    let mut noise_m = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 40) as f64 / f64::from(1 << 24) - 0.5) * 1.7e-4
    };
    let mut table = "object,time_s,x_m,y_m,yaw_rad\n".to_owned();
    for frame in 0..=((motion.duration_s + 0.3) * 100.0) as u32 {
        let time_s = f64::from(frame) / 100.0;
        for object in ["a", "c"] {
            let pose = motion.pose(object, time_s).unwrap();
            let (x_m, y_m) = (pose.position.x + noise_m(), pose.position.y + noise_m());
            writeln!(table, "{object},{time_s},{x_m},{y_m},{}", pose.yaw_rad).unwrap();
        }
    }
    fs::write(at.join(file), table).unwrap();
}

#[test]
fn a_run_learns_from_each_recorded_strike() {
    let folder = planned_pile();
    let at = folder.path();
    let run = |properties: &str, execute: &str, to: &str| {
        let flags = ["--method", "paper", "--execute", execute, "--look", "cp apart.toml {scene}", "-o", to];
        let output = breakshot(at, &[&["run", "pile.toml", "--properties", properties][..], &flags].concat());
        assert!(matches!(output.status.code(), Some(0 | 3)), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let clips = |file: &str| {
        let properties = json(at, file);
        let clips = properties["evidence"]["clips"].as_array().unwrap();
        clips.iter().map(|clip| clip["clip"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    write_simulated_tracks(at, "strike.csv", 1);
    write_simulated_tracks(at, "other.csv", 2);
    run("old.json", "cp strike.csv {tracks}", "first");
    assert_eq!(clips("first/properties_1.json"), ["pair_a_c_3.mp4", "strike_1.csv"]);
    let measured = |file: &str| json(at, file)["friction"]["a"]["n"].as_u64();
    assert_eq!(measured("first/properties_1.json"), measured("old.json").map(|n| n + 1));

    // The next pile: the recordings of every run have the same names.
    run("first/properties_1.json", "cp other.csv {tracks}", "second");
    assert_eq!(clips("second/properties_1.json"), ["pair_a_c_3.mp4", "strike_1.csv", "strike_1.csv (2)"]);

    // What shows nothing new or nothing at all is a warning; the run goes on.
    let message = run("first/properties_1.json", "cp strike.csv {tracks}", "third");
    assert!(message.contains("nothing is learned from strike 1") && message.contains("content"), "{message}");
    let message = run("old.json", "test {film}", "fourth");
    assert!(message.contains("nothing is learned from strike 1"), "{message}");
    assert!(!at.join("third/properties_1.json").exists() && !at.join("fourth/properties_1.json").exists());
}
