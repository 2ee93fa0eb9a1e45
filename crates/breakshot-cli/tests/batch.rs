//! The clips of a campaign in shares, as batch systems track them.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{assert_refused, breakshot, demo};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

const FILMS: [&str; 4] = ["single_a_3.mp4", "single_a_5.mp4", "single_c_3.mp4", "pair_a_c_1.mp4"];

/// A folder with the example's cell, objects and these films, and their campaign.
fn workbench() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in ["cell.toml", "objects.toml"].iter().chain(&FILMS) {
        fs::copy(demo(file), folder.path().join(file)).unwrap();
    }
    let text = fs::read_to_string(demo("campaign.toml")).unwrap();
    let clips = text.split("[[clips]]").skip(1).filter(|clip| FILMS.iter().any(|film| clip.contains(film)));
    let clips: Vec<String> = clips.map(|clip| format!("[[clips]]{clip}\n")).collect();
    let head = "cell = \"cell.toml\"\nobjects = \"objects.toml\"\n";
    fs::write(folder.path().join("campaign.toml"), format!("{head}{}", clips.concat())).unwrap();
    folder
}

/// Tracks a share of the clips; what happened to which clips.
fn detect(folder: &Path, shard: &str) -> [Vec<String>; 3] {
    let arguments =
        ["detect", "--campaign", "campaign.toml", "--tracks", "tracks", "--shard", shard, "--json"];
    let output = breakshot(folder, &arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{shard}: {:?}: {said}", output.status.code());
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    ["tracked", "finished", "failed"].map(|key| {
        let names = printed[key].as_array().unwrap();
        names.iter().map(|name| name.as_str().unwrap().to_owned()).collect()
    })
}

/// Name, bytes and time of writing of each file; a kill may leave one whose name begins with a dot.
fn content(folder: &Path) -> BTreeMap<String, (Vec<u8>, SystemTime)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let file = |entry: fs::DirEntry| {
        let written = entry.metadata().unwrap().modified().unwrap();
        (entry.file_name().into_string().unwrap(), (fs::read(entry.path()).unwrap(), written))
    };
    entries.map(file).filter(|(name, _)| !name.starts_with('.')).collect()
}

fn bytes(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    content(folder).into_iter().map(|(name, (bytes, _))| (name, bytes)).collect()
}

fn estimate(folder: &Path, more: &[&str]) -> Value {
    let output = breakshot(folder, &[&["estimate", "campaign.toml", "-o", "out.json"], more].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{said}");
    serde_json::from_slice(&fs::read(folder.join("out.json")).unwrap()).unwrap()
}

#[test]
fn shares_give_the_files_and_the_estimate_of_one_run_to_the_bit_and_nothing_is_tracked_twice() {
    let folder = workbench();
    let folder = folder.path();
    let whole = estimate(folder, &["--tracks", "whole"]);
    assert_eq!(whole, estimate(folder, &[]));

    let shares = ["2/3", "1/3", "3/3"].map(|shard| detect(folder, shard));
    assert_eq!(shares.each_ref().map(|[tracked, ..]| tracked.len()), [1, 2, 1]);
    assert!(shares.iter().all(|[_, finished, failed]| finished.is_empty() && failed.is_empty()));
    assert_eq!(bytes(&folder.join("tracks")), bytes(&folder.join("whole")));

    let before = content(&folder.join("tracks"));
    assert_eq!(detect(folder, "1/1")[1].len(), FILMS.len());
    assert_eq!(estimate(folder, &["--tracks", "tracks"]), whole);
    assert_eq!(content(&folder.join("tracks")), before, "a finished file was written again");
}

#[test]
fn a_clip_is_tracked_again_exactly_where_its_content_or_a_file_that_counts_has_changed() {
    let folder = workbench();
    let folder = folder.path();
    let change = |what: &str, change: &dyn Fn(&Path), expected: &[&str]| {
        change(folder);
        let [tracked, finished, failed] = detect(folder, "1/1");
        assert_eq!(tracked, expected, "{what}");
        assert_eq!((finished.len(), failed.len()), (FILMS.len() - expected.len(), 0), "{what}");
    };
    let edit = |file: &'static str, old: &'static str, new: &'static str| {
        move |folder: &Path| {
            let text = fs::read_to_string(folder.join(file)).unwrap();
            assert!(text.contains(old), "{file} has no `{old}`: the test cannot fail");
            fs::write(folder.join(file), text.replacen(old, new, 1)).unwrap();
        }
    };
    let in_order: Vec<String> = {
        let text = fs::read_to_string(folder.join("campaign.toml")).unwrap();
        let lines = text.lines().filter_map(|line| line.strip_prefix("video = \""));
        lines.map(|line| line.trim_end_matches('"').to_owned()).collect()
    };
    let all: Vec<&str> = in_order.iter().map(String::as_str).collect();
    change("first", &|_| (), &all);
    change("nothing", &|_| (), &[]);
    // A box of the format that players skip.
    let longer = |folder: &Path| {
        let mut film = fs::read(folder.join("single_a_3.mp4")).unwrap();
        film.extend(b"\0\0\0\x08free");
        fs::write(folder.join("single_a_3.mp4"), film).unwrap();
    };
    change("the film's bytes", &longer, &["single_a_3.mp4"]);
    let cut = |folder: &Path| {
        let file = folder.join("tracks/single_c_3.json");
        let text = fs::read(&file).unwrap();
        fs::write(file, &text[..text.len() / 2]).unwrap();
    };
    change("half a file of tracks", &cut, &["single_c_3.mp4"]);
    change("a comment", &edit("objects.toml", "[[objects]]", "# more\n[[objects]]"), &[]);
    let of_c = all.iter().copied().filter(|film| film.contains("_c_")).collect::<Vec<_>>();
    assert!(!of_c.is_empty() && of_c.len() < all.len());
    change("spaces", &edit("objects.toml", "height_m = 0.045", "height_m  =  0.0450"), &[]);
    change("the height of `c`", &edit("objects.toml", "0.0450", "0.0451"), &of_c);
    change("the workspace", &edit("cell.toml", "min_m = [-", "min_m = [-1"), &all);
    let moved = |folder: &Path| {
        fs::create_dir(folder.join("films")).unwrap();
        for film in FILMS {
            fs::rename(folder.join(film), folder.join("films").join(film)).unwrap();
        }
        let text = fs::read_to_string(folder.join("campaign.toml")).unwrap();
        fs::write(folder.join("campaign.toml"), text.replace("video = \"", "video = \"films/")).unwrap();
    };
    change("another folder", &moved, &[]);
}

#[test]
fn a_film_that_cannot_be_read_is_listed_and_leaves_no_file() {
    let folder = workbench();
    let folder = folder.path();
    fs::write(folder.join("single_c_3.mp4"), b"no film").unwrap();
    let arguments = ["detect", "--campaign", "campaign.toml", "--tracks", "tracks"];
    let output = breakshot(folder, &arguments);
    let (said, printed) = (String::from_utf8_lossy(&output.stderr), String::from_utf8_lossy(&output.stdout));
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("single_c_3.mp4: left out"), "{said}");
    assert!(printed.contains("4 of 4 clips: 3 tracked, 0 finished before, 1 left out"), "{printed}");
    assert!(!folder.join("tracks/single_c_3.json").exists());

    fs::copy(demo("single_c_3.mp4"), folder.join("single_c_3.mp4")).unwrap();
    let [tracked, finished, failed] = detect(folder, "1/1");
    assert_eq!((tracked, finished.len(), failed.len()), (vec!["single_c_3.mp4".to_owned()], 3, 0));
}

#[test]
fn a_program_that_is_killed_leaves_whole_files_and_the_next_one_completes_them() {
    let folder = workbench();
    let folder = folder.path();
    detect(folder, "1/1");
    fs::rename(folder.join("tracks"), folder.join("undisturbed")).unwrap();
    let arguments = ["detect", "--campaign", "campaign.toml", "--tracks", "tracks"];
    let mut program = Command::new(env!("CARGO_BIN_EXE_breakshot"))
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "1")
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let tracks = folder.join("tracks");
    while !tracks.is_dir() || content(&tracks).is_empty() {
        assert!(program.try_wait().unwrap().is_none(), "it ended before it could be killed");
        std::thread::sleep(Duration::from_millis(1));
    }
    program.kill().unwrap();
    program.wait().unwrap();
    let (left, undisturbed) = (bytes(&tracks), bytes(&folder.join("undisturbed")));
    assert!(!left.is_empty() && left.len() < FILMS.len(), "{} files: nothing was interrupted", left.len());
    assert!(left.iter().all(|(name, bytes)| undisturbed[name] == *bytes), "a file that is not whole");

    let [tracked, finished, _] = detect(folder, "1/1");
    assert_eq!((tracked.len(), finished.len()), (FILMS.len() - left.len(), left.len()));
    assert_eq!(bytes(&tracks), undisturbed);
}

#[test]
fn wrong_combinations_of_arguments_are_refused() {
    let folder = workbench();
    let folder = folder.path();
    let batch = ["detect", "--campaign", "campaign.toml"];
    let tracks = ["--tracks", "tracks"];
    for (more, word) in [
        (vec![], "--tracks"),
        (vec!["--tracks", "tracks", "cell.toml"], "[CELL]"),
        (vec!["--tracks", "tracks", "-o", "out.csv"], "--output"),
    ] {
        let output = breakshot(folder, &[&batch[..], &more].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{more:?}: {said}");
        assert!(said.contains(word), "{more:?}: {said}");
    }
    for wrong in ["0/3", "4/3", "3"] {
        let arguments = [&batch[..], &tracks, &["--shard", wrong]].concat();
        assert_refused(folder, &arguments, &["--shard", wrong, "I/N with I from 1 to N"]);
    }
    let one = ["detect", "cell.toml", "objects.toml", "single_a_3.mp4", "--objects", "a", "-o", "out.csv"];
    for more in [&tracks[..], &["--shard", "1/2"]] {
        let output = breakshot(folder, &[&one[..], more].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("[VIDEO]"), "{said}");
    }
    fs::write(folder.join("tracks"), b"a file").unwrap();
    let output = breakshot(folder, &[&batch[..], &tracks].concat());
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_campaign_of_ten_thousand_clips_is_read_in_seconds() {
    let folder = workbench();
    let folder = folder.path();
    let mut clips = String::from("cell = \"cell.toml\"\nobjects = \"objects.toml\"\n");
    for number in 0..10_000 {
        let (day, name) = (number / 5000, number % 5000);
        let file = format!("day{day}/{name}.csv");
        fs::create_dir_all(folder.join(format!("day{day}"))).unwrap();
        // Every file has a content of its own, and no clip can be tracked: there are no rows.
        fs::write(folder.join(&file), format!("object,time_s,x_m,y_m\n{}", "#".repeat(number))).unwrap();
        writeln!(clips, "[[clips]]\ntracks = \"{file}\"\nobjects = [\"a\"]").unwrap();
    }
    fs::write(folder.join("campaign.toml"), clips).unwrap();
    let start = Instant::now();
    let [tracked, finished, failed] = detect(folder, "1/1000");
    let took = start.elapsed();
    assert_eq!((tracked.len(), finished.len(), failed.len()), (0, 0, 10));
    assert_eq!(failed[0], "day0/0.csv");
    assert!(took < Duration::from_secs(20), "{took:?}");
}
