//! Clips, and stretches of clips, that a campaign leaves out.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use common::{assert_refused, breakshot, demo};
use serde_json::Value;
use std::fs;
use std::path::Path;

const HEAD: &str = "cell = \"cell.toml\"\nobjects = \"objects.toml\"\n";

/// A folder with the cell, the objects and three films of the example.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in ["cell.toml", "objects.toml", "single_a_3.mp4", "single_a_5.mp4", "pair_a_c_1.mp4"] {
        fs::copy(demo(file), folder.path().join(file)).unwrap();
    }
    folder
}

/// An entry of a film, with further lines.
fn clip(film: &str, more: &str) -> String {
    let objects = if film.starts_with("pair") { "[\"a\", \"c\"]" } else { "[\"a\"]" };
    format!("\n[[clips]]\nvideo = \"{film}\"\nobjects = {objects}\n{more}\n")
}

fn estimated(folder: &Path, clips: &[String], output: &str) -> Vec<u8> {
    fs::write(folder.join("campaign.toml"), HEAD.to_owned() + &clips.concat()).unwrap();
    let result = breakshot(folder, &["estimate", "campaign.toml", "--tracks", "tracks", "-o", output]);
    assert!(matches!(result.status.code(), Some(0 | 3)), "{}", String::from_utf8_lossy(&result.stderr));
    fs::read(folder.join(output)).unwrap()
}

#[test]
fn an_excluded_clip_is_as_if_it_were_not_listed() {
    let folder = folder();
    let folder = folder.path();
    let kept = [clip("single_a_3.mp4", ""), clip("pair_a_c_1.mp4", "exclude = false")];
    let without = estimated(folder, &kept, "without.json");
    let excluded = [&kept[..], &[clip("single_a_5.mp4", "exclude = true")]].concat();
    assert_eq!(estimated(folder, &excluded, "excluded.json"), without);
    let missing = [&kept[..], &[clip("none.mp4", "exclude = true")]].concat();
    assert_eq!(estimated(folder, &missing, "missing.json"), without, "its film need not exist");
    let with = [&kept[..], &[clip("single_a_5.mp4", "")]].concat();
    assert_ne!(estimated(folder, &with, "with.json"), without);
}

#[test]
fn the_frames_of_an_excluded_stretch_are_not_in_the_tracks() {
    let folder = folder();
    let folder = folder.path();
    let samples = |clips: &[String]| -> Vec<Value> {
        estimated(folder, clips, "properties.json");
        let text = fs::read_to_string(folder.join("tracks/single_a_3.json")).unwrap();
        let tracks: Value = serde_json::from_str(&text).unwrap();
        tracks["tracks"][0]["samples"].as_array().unwrap().clone()
    };
    let all = samples(&[clip("single_a_3.mp4", ""), clip("single_a_5.mp4", "")]);
    let time_s = |sample: &Value| sample["time_s"].as_f64().unwrap();
    let [from_s, until_s] = [time_s(&all[12]), time_s(&all[17])];
    let stretch = clip("single_a_3.mp4", &format!("exclude = [[{from_s:?}, {until_s:?}]]"));
    let left = samples(&[stretch, clip("single_a_5.mp4", "")]);
    let wanted: Vec<&Value> =
        all.iter().filter(|sample| !(from_s..=until_s).contains(&time_s(sample))).collect();
    assert_eq!(wanted.len(), all.len() - 6);
    assert_eq!(left.iter().collect::<Vec<_>>(), wanted, "the other samples stay as they are");
}

#[test]
fn what_cannot_be_left_out_is_refused() {
    let folder = folder();
    let folder = folder.path();
    let refused = |clips: &[String], words: &[&str]| {
        fs::write(folder.join("campaign.toml"), HEAD.to_owned() + &clips.concat()).unwrap();
        assert_refused(folder, &["estimate", "campaign.toml", "-o", "out.json"], words);
    };
    refused(
        &[clip("single_a_3.mp4", "exclude = \"yes\"")],
        &["campaign.toml", "exclude", "[from_s, until_s]"],
    );
    refused(
        &[clip("single_a_3.mp4", "exclude = [[0.5, 0.2]]")],
        &["single_a_3.mp4", "exclude", "[0.5, 0.2]"],
    );
    refused(&[clip("single_a_3.mp4", "exclude = [[0.5, nan]]")], &["single_a_3.mp4", "exclude"]);
    let many: Vec<String> = (0..101).map(|k| format!("[{k}.0, {k}.5]")).collect();
    refused(
        &[clip("single_a_3.mp4", &format!("exclude = [{}]", many.join(", ")))],
        &["exclude", "at most 100"],
    );
    refused(&[clip("single_a_3.mp4", "exclude = true")], &["clips", "not excluded"]);
    refused(&[clip("single_a_3.mp4", "exclude = [[-1.0, 1000.0]]")], &["exclude", "every frame of `a`"]);
}
