//! The ways in which clips get into a campaign: films, tracks, films at another rate.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{assert_refused, breakshot, demo};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// A folder with the example's cell, objects and these films.
fn workbench(films: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in ["cell.toml", "objects.toml"].iter().chain(films) {
        fs::copy(demo(file), folder.path().join(file)).unwrap();
    }
    folder
}

/// Runs a command; its exit code and what it said.
fn run(folder: &Path, args: &[&str]) -> (Option<i32>, String) {
    let output = breakshot(folder, args);
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Runs a command that must succeed, with or without warnings.
fn done(folder: &Path, args: &[&str]) -> String {
    let (code, said) = run(folder, args);
    assert!(matches!(code, Some(0 | 3)), "{args:?} ended with {code:?}: {said}");
    said
}

const ESTIMATE: [&str; 4] = ["estimate", "campaign.toml", "-o", "out.json"];

/// The example's campaign, clips of these films only.
fn clips(films: &[&str]) -> Vec<String> {
    let text = fs::read_to_string(demo("campaign.toml")).unwrap();
    let clips = text.split("[[clips]]").skip(1).map(str::to_owned);
    clips.filter(|clip| films.iter().any(|film| clip.contains(film))).collect()
}

fn write_campaign(folder: &Path, clips: &[String]) {
    let head = "cell = \"cell.toml\"\nobjects = \"objects.toml\"\n";
    let clips: Vec<String> = clips.iter().map(|clip| format!("[[clips]]{clip}\n")).collect();
    fs::write(folder.join("campaign.toml"), head.to_owned() + &clips.concat()).unwrap();
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

const FILMS: [&str; 3] = ["single_a_3.mp4", "single_c_3.mp4", "pair_a_c_1.mp4"];

/// The properties without the names of the clips.
fn numbers(path: &Path) -> Vec<Value> {
    let properties = json(path);
    ["friction", "striker_restitution", "restitution", "mass_ratio"]
        .map(|key| properties[key].clone())
        .to_vec()
}

#[test]
fn tracks_in_json_give_the_estimate_of_their_films_to_the_bit_and_those_in_csv_nearly() {
    let folder = workbench(&FILMS);
    let folder = folder.path();
    write_campaign(folder, &clips(&FILMS));
    done(folder, &["estimate", "campaign.toml", "-o", "films.json", "--tracks", "tracks"]);
    let of_films = numbers(&folder.join("films.json"));

    let tracks = |extension: &str| -> Vec<String> {
        let as_tracks =
            |clip: &String| clip.replace("video = \"", "tracks = \"tracks/").replace("mp4", extension);
        clips(&FILMS).iter().map(as_tracks).collect()
    };
    write_campaign(folder, &tracks("json"));
    done(folder, &ESTIMATE);
    assert_eq!(numbers(&folder.join("out.json")), of_films);

    // The columns that `detect` writes; the cell needs no camera.
    for film in FILMS {
        let found = json(&folder.join("tracks").join(film).with_extension("json"));
        let mut table = String::from("object,time_s,x_m,y_m,yaw_rad\n");
        for track in found["tracks"].as_array().unwrap() {
            for s in track["samples"].as_array().unwrap() {
                let yaw = s["yaw_rad"].as_f64().map_or(String::new(), |yaw| format!("{yaw:.6}"));
                let [t, x, y] = ["time_s", "x_m", "y_m"].map(|key| s[key].as_f64().unwrap());
                writeln!(table, "{},{t:.6},{x:.7},{y:.7},{yaw}", track["object"].as_str().unwrap()).unwrap();
            }
        }
        fs::write(folder.join("tracks").join(film).with_extension("csv"), table).unwrap();
    }
    let cell = fs::read_to_string(demo("cell.toml")).unwrap();
    let from = cell.find("[workspace]").unwrap();
    fs::write(folder.join("cell.toml"), &cell[from..]).unwrap();
    write_campaign(folder, &tracks("csv"));
    done(folder, &ESTIMATE);
    let of_tables = numbers(&folder.join("out.json"));
    for (table, film) in of_tables.iter().zip(&of_films) {
        for (name, of_film) in film.as_object().unwrap() {
            let [table, film] = [&table[name], of_film].map(|estimate| estimate["mean"].as_f64().unwrap());
            assert!(
                (table / film - 1.0).abs() < 0.02,
                "{name}: {table} from the tables, {film} from the films"
            );
        }
    }
}

#[test]
fn a_cell_of_tracks_without_strikes_needs_no_camera_and_no_striker_and_each_is_missed_where_it_is_needed() {
    let folder = workbench(&["single_a_3.mp4"]);
    let folder = folder.path();
    fs::write(folder.join("cell.toml"), "[workspace]\nmin_m = [-0.4, -0.3]\nmax_m = [0.4, 0.3]\n").unwrap();
    // A slide from the first row on, in millimetres
    let rows = (0..60).map(|k| f64::from(k) / 60.0).map(|t| {
        let t = t.min(0.25);
        format!("{}\n", 1e3 * (0.5 * t - t * t))
    });
    fs::write(folder.join("run.csv"), format!("east\n{}", rows.collect::<String>())).unwrap();
    let columns = "columns = { objects = { a = { x = \"east\", y = \"east\" } }, length_unit = \"mm\" }";
    let clip = format!("\ntracks = \"run.csv\"\nobjects = [\"a\"]\nframe_rate_hz = 60.0\n{columns}\n");
    write_campaign(folder, std::slice::from_ref(&clip));
    done(folder, &["estimate", "campaign.toml", "-o", "found.json"]);
    let friction = json(&folder.join("found.json"))["friction"]["a"]["mean"].as_f64().unwrap();
    let truth = 2.0 * 2.0_f64.sqrt() / 9.80665;
    assert!((friction / truth - 1.0).abs() < 0.02, "{friction}, not {truth}");

    write_campaign(folder, &clips(&["single_a_3.mp4"]));
    assert_refused(folder, &ESTIMATE, &["clip `single_a_3.mp4`", "striker", "[striker] with shape"]);
    let strike =
        clips(&["single_a_3.mp4"])[0].lines().find(|line| line.starts_with("strike")).unwrap().to_owned();
    write_campaign(folder, &[clips(&["single_a_3.mp4"])[0].replace(&strike, "")]);
    assert_refused(folder, &ESTIMATE, &["clip `single_a_3.mp4`", "camera pose", "[[tags]]"]);
    write_campaign(folder, &[format!("{clip}{strike}\n")]);
    assert_refused(folder, &ESTIMATE, &["clip `run.csv`", "striker", "[striker] with shape"]);
    write_campaign(folder, &[clip.replace("frame_rate_hz = 60.0", "")]);
    assert_refused(folder, &ESTIMATE, &["clip `run.csv`", "frame_rate_hz"]);
    write_campaign(folder, &[clip.replace("east\" }", "west\" }")]);
    assert_refused(folder, &ESTIMATE, &["run.csv", "line 1", "no column `west`", "`east`"]);
    write_campaign(folder, &[clip.replace("tracks =", "video = \"single_a_3.mp4\"\ntracks =")]);
    assert_refused(folder, &ESTIMATE, &["campaign.toml", "both of them", "one of them"]);
}

#[test]
fn a_strike_is_verified_from_its_tracks_as_from_its_film() {
    let folder = workbench(&["pile.mp4", "pile.scene.toml", "pile.strike.json", "single_a_3.mp4"]);
    let folder = folder.path();
    let names = ["--objects", "a,c,e", "--scene", "pile.scene.toml"];
    let detect =
        [&["detect", "cell.toml", "objects.toml", "pile.mp4"], &names[..], &["-o", "pile.csv"]].concat();
    done(folder, &detect);
    let known = |mean: f64| serde_json::json!({ "mean": mean, "std": 0.01, "standard_error": 0.01, "interval_95": [0.1, 0.9], "n": 5 });
    let each = |mean: f64| serde_json::json!({ "a": known(mean), "c": known(mean), "e": known(mean) });
    let pairs = serde_json::json!({ "a/c": known(0.5), "a/e": known(0.5), "c/e": known(0.5) });
    let properties = serde_json::json!({ "version": 1, "reference": "a", "friction": each(0.3), "striker_restitution": each(0.5),
        "restitution": pairs, "mass_ratio": each(1.0), "pair_mass_ratio": {}, "contact_friction": {} });
    fs::write(folder.join("properties.json"), properties.to_string()).unwrap();
    let verify = |film: &str, output: &str| {
        let strike = ["--properties", "properties.json", "--strike", "pile.strike.json", "-o", output];
        done(folder, &[&["verify", "pile.scene.toml", film], &strike[..]].concat());
        json(&folder.join(output).join("report.json"))
    };
    let (film, table) = (verify("pile.mp4", "film"), verify("pile.csv", "table"));
    for object in ["a", "c", "e"] {
        for axis in 0..2 {
            let [film, table] =
                [&film, &table].map(|report| report["observed"][object][axis].as_f64().unwrap());
            assert!((film - table).abs() < 5e-5, "{object}: {film} m in the film, {table} m in its tracks");
        }
    }
}

/// The film with a time scale that makes it last four times as long, as slow motion is written.
fn slowed(film: &str) -> Vec<u8> {
    let mut bytes = fs::read(demo(film)).unwrap();
    for name in [b"mvhd", b"mdhd"] {
        let at = bytes.windows(4).position(|window| window == name).unwrap() + 16;
        let scale = u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
        bytes[at..at + 4].copy_from_slice(&(scale / 4).to_be_bytes());
    }
    bytes
}

#[test]
fn a_film_in_slow_motion_with_its_true_rate_gives_the_same_tracks_to_the_bit() {
    let folder = workbench(&["single_a_3.mp4"]);
    let folder = folder.path();
    fs::write(folder.join("slow.mp4"), slowed("single_a_3.mp4")).unwrap();
    let detect = |film: &str, more: &[&str]| {
        let fixed = ["detect", "cell.toml", "objects.toml", film, "--objects", "a", "-o", "tracks.json"];
        done(folder, &[&fixed[..], more].concat());
        json(&folder.join("tracks.json"))["tracks"].clone()
    };
    let true_tracks = detect("single_a_3.mp4", &[]);
    let slow = detect("slow.mp4", &[]);
    let last_s =
        |tracks: &Value| tracks[0]["samples"].as_array().unwrap().last().unwrap()["time_s"].as_f64().unwrap();
    assert!((last_s(&slow) / last_s(&true_tracks) - 4.0).abs() < 1e-9, "the test cannot fail");
    assert_eq!(detect("slow.mp4", &["--frame-rate-hz", "60"]), true_tracks);

    // The option comes before the clip, and the clip before the cell.
    let cell = fs::read_to_string(demo("cell.toml")).unwrap();
    fs::write(folder.join("cell.toml"), cell.replacen("[camera]", "[camera]\nframe_rate_hz = 60.0", 1))
        .unwrap();
    assert_eq!(detect("slow.mp4", &[]), true_tracks);
    fs::write(folder.join("cell.toml"), cell.replacen("[camera]", "[camera]\nframe_rate_hz = 30.0", 1))
        .unwrap();
    assert_eq!(detect("slow.mp4", &["--frame-rate-hz", "60"]), true_tracks);
    let clip = clips(&["single_a_3.mp4"])[0].replace("single_a_3.mp4\"", "slow.mp4\"\nframe_rate_hz = 60");
    write_campaign(folder, &[clip]);
    done(folder, &["estimate", "campaign.toml", "-o", "of_slow.json", "--tracks", "."]);
    fs::write(folder.join("cell.toml"), cell).unwrap();
    write_campaign(folder, &clips(&["single_a_3.mp4"]));
    done(folder, &["estimate", "campaign.toml", "-o", "of_true.json"]);
    assert_eq!(numbers(&folder.join("of_slow.json")), numbers(&folder.join("of_true.json")));
    let (code, said) = run(
        folder,
        &[
            "detect",
            "cell.toml",
            "objects.toml",
            "slow.mp4",
            "--objects",
            "a",
            "--frame-rate-hz",
            "0",
            "-o",
            "out.json",
        ],
    );
    assert!(code == Some(2) && said.contains("a positive number"), "{said}");
}

#[test]
fn a_clip_that_is_given_twice_is_an_error_that_names_both() {
    let folder = workbench(&FILMS);
    let folder = folder.path();
    // A copy of a film, and the same file by another path
    fs::copy(demo("single_a_3.mp4"), folder.join("copy.mp4")).unwrap();
    let once = clips(&FILMS);
    for other in ["copy.mp4", "./single_a_3.mp4"] {
        let again = once[0].replace("single_a_3.mp4", other);
        write_campaign(folder, &[once.as_slice(), &[again]].concat());
        assert_refused(
            folder,
            &ESTIMATE,
            &["campaign.toml", "single_a_3.mp4", other.trim_start_matches("./"), "every clip once"],
        );
    }
    // The same tracks in another file, their objects with exchanged names
    write_campaign(folder, &once);
    done(folder, &["estimate", "campaign.toml", "-o", "of_films.json", "--tracks", "."]);
    let tracks = fs::read_to_string(folder.join("pair_a_c_1.json")).unwrap();
    let exchanged = tracks
        .replace("\"object\": \"a\"", "\"object\": \"x\"")
        .replace("\"object\": \"c\"", "\"object\": \"a\"");
    fs::write(folder.join("exchanged.json"), exchanged.replace("\"object\": \"x\"", "\"object\": \"c\""))
        .unwrap();
    let again = once[2].replace("video = \"pair_a_c_1.mp4\"", "tracks = \"exchanged.json\"");
    write_campaign(folder, &[once.as_slice(), &[again]].concat());
    assert_refused(folder, &ESTIMATE, &["`pair_a_c_1.mp4`", "`exchanged.json`", "every clip once"]);
}

#[test]
fn clips_of_one_name_in_two_folders_keep_their_tracks_apart() {
    let folder = workbench(&[]);
    let folder = folder.path();
    for (day, film) in [("monday", "single_a_3.mp4"), ("tuesday", "single_a_5.mp4")] {
        fs::create_dir(folder.join(day)).unwrap();
        fs::copy(demo(film), folder.join(day).join("a.mp4")).unwrap();
    }
    let [mut one, mut two] = ["single_a_3.mp4", "single_a_5.mp4"].map(|film| clips(&[film])[0].clone());
    one = one.replace("single_a_3.mp4", "monday/a.mp4");
    two = two.replace("single_a_5.mp4", "tuesday/a.mp4");
    write_campaign(folder, &[one, two]);
    done(folder, &["estimate", "campaign.toml", "-o", "found.json", "--tracks", "tracks"]);
    let mut written: Vec<_> = fs::read_dir(folder.join("tracks"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    written.sort();
    assert_eq!(written, ["monday_a.json", "tuesday_a.json"]);
    let of = |name: &str| json(&folder.join("tracks").join(name))["tracks"].clone();
    assert_ne!(of("monday_a.json"), of("tuesday_a.json"));
    let names: Vec<Value> = json(&folder.join("found.json"))["evidence"]["clips"]
        .as_array()
        .unwrap()
        .iter()
        .map(|clip| clip["clip"].clone())
        .collect();
    assert_eq!(names, ["monday/a.mp4", "tuesday/a.mp4"]);
}

#[test]
fn the_draft_of_a_campaign_lists_every_film_once_and_runs_when_it_is_completed() {
    let folder = workbench(&[]);
    let folder = folder.path();
    fs::create_dir_all(folder.join("videos/monday")).unwrap();
    for (film, name) in [
        ("pair_c_e_1.mp4", "monday/c into e.mp4"),
        ("single_a_3.mp4", "A-1.mp4"),
        ("single_a_5.mp4", "film.mp4"),
    ] {
        fs::copy(demo(film), folder.join("videos").join(name)).unwrap();
    }
    fs::copy(demo("single_a_3.mp4"), folder.join("videos/copy of a.mp4")).unwrap();
    fs::write(folder.join("videos/notes.txt"), "none").unwrap();
    let draft = ["campaign", "videos", "-o", "campaign.toml"];
    let (code, said) = run(folder, &draft);
    assert_eq!(code, Some(3), "{said}");
    for words in ["film.mp4: no object", "copy of a.mp4 is left out"] {
        assert!(said.contains(words), "`{words}` is not in: {said}");
    }
    let text = fs::read_to_string(folder.join("campaign.toml")).unwrap();
    for entry in [
        "cell = \"cell.toml\"",
        "video = \"videos/A-1.mp4\"\nobjects = [\"a\"]",
        "video = \"videos/monday/c into e.mp4\"\nobjects = [\"c\", \"e\"]",
        "video = \"videos/film.mp4\"\nobjects = []    # FILL IN",
    ] {
        assert!(text.contains(entry), "`{entry}` is not in: {text}");
    }
    assert!(text.matches("[[clips]]").count() == 3 && !text.contains("notes"), "{text}");
    assert_refused(folder, &ESTIMATE, &["film.mp4", "objects"]);
    fs::write(folder.join("campaign.toml"), text.replace("objects = []", "objects = [\"a\"]")).unwrap();
    done(folder, &["estimate", "campaign.toml", "-o", "found.json"]);
    assert!(json(&folder.join("found.json"))["friction"]["a"]["n"].as_f64() == Some(2.0));

    // Work that was done by hand is not written over.
    let (code, said) = run(folder, &draft);
    assert!(code == Some(2) && said.contains("campaign.toml") && said.contains("exists"), "{said}");
    fs::create_dir(folder.join("empty")).unwrap();
    let (code, said) = run(folder, &["campaign", "empty", "-o", "other.toml"]);
    assert!(code == Some(2) && said.contains("empty") && !folder.join("other.toml").exists(), "{said}");
}
