//! Numbers that are possible in a file but not on a table: refused by name, or simulated within bounds.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use breakshot::properties::{ContactFriction, Covariance, Properties};
use breakshot::uncertain::Estimate;
use common::{assert_refused, breakshot, demo};
use serde_json::{Value, json};
use std::fs;

/// The example's pile with properties of this friction and a slow push of this speed and travel.
fn workbench(friction: f64, speed_m_s: f64, travel_m: f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in ["cell.toml", "objects.toml", "pile.scene.toml"] {
        fs::copy(demo(file), folder.path().join(file)).unwrap();
    }
    let contact = Some(Estimate::exact(0.2));
    let mut properties = Properties {
        version: 1,
        reference: "a".into(),
        contact_friction: ContactFriction { objects: contact, striker: contact },
        ..Properties::default()
    };
    for name in ["a", "c", "e"] {
        properties.friction.insert(name.into(), Estimate::exact(friction));
        properties.striker_restitution.insert(name.into(), Estimate::exact(0.5));
        properties.mass_ratio.insert(name.into(), Estimate::exact(1.0));
    }
    for pair in ["a/c", "a/e", "c/e"] {
        properties.restitution.insert(pair.into(), Estimate::exact(0.5));
    }
    let names = vec!["friction/a".to_owned(), "friction/c".to_owned()];
    properties.covariance = Covariance { names, matrix: vec![vec![4e-4, 1e-4], vec![1e-4, 4e-4]] };
    breakshot::files::write_json(&folder.path().join("properties.json"), &properties).unwrap();
    let strike = json!({"object": "a", "start_m": [-0.288_705, 0.006_132], "heading_rad": 0.34702,
        "speed_m_s": speed_m_s, "travel_m": travel_m});
    fs::write(folder.path().join("strike.json"), strike.to_string()).unwrap();
    folder
}

const SIMULATE: [&str; 8] = [
    "simulate",
    "pile.scene.toml",
    "--properties",
    "properties.json",
    "--strike",
    "strike.json",
    "-o",
    "out.json",
];

#[test]
fn a_long_slow_push_is_written_with_a_bounded_number_of_samples() {
    let folder = workbench(0.25, 0.1, 0.3);
    let output = breakshot(folder.path(), &SIMULATE);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{message}");
    let text = fs::read_to_string(folder.path().join("out.json")).unwrap();
    assert!(text.len() < 30_000_000, "{} bytes", text.len());
    let trajectory: Value = serde_json::from_str(&text).unwrap();
    let motions = trajectory["motions"].as_object().unwrap();
    let segments: usize = motions.values().map(|list| list.as_array().unwrap().len()).sum();
    assert!(segments <= 40_000, "{segments} segments");
    assert!(trajectory["events"].as_array().unwrap().len() <= 10_000);
    // The last segment of every object ends where the object rests.
    for (object, pose) in trajectory["final"].as_object().unwrap() {
        let last = motions[object].as_array().unwrap().last().unwrap();
        let duration_s = last["end_s"].as_f64().unwrap() - last["start_s"].as_f64().unwrap();
        for (axis, k) in [("x_m", 0), ("y_m", 1)] {
            let powers = last[axis].as_array().unwrap().iter().rev();
            let end_m = powers.fold(0.0, |sum, c| sum * duration_s + c.as_f64().unwrap());
            let apart_m = end_m - pose["position"][k].as_f64().or(pose[k].as_f64()).unwrap();
            assert!(apart_m.abs() < 1e-9, "{object}: {apart_m} m");
        }
    }
}

#[test]
fn a_simulation_that_takes_too_many_steps_says_so_and_ends_doubtful() {
    // Between the fingers of friction 10 a push is a hundred thousand hops.
    let folder = workbench(10.0, 0.02, 0.5);
    let output = breakshot(folder.path(), &SIMULATE);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(message.contains("given up after") && message.contains("impacts"), "{message}");
    let bytes = fs::metadata(folder.path().join("out.json")).unwrap().len();
    assert!(bytes < 40_000_000, "{bytes} bytes");
    let text = fs::read_to_string(folder.path().join("out.json")).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&text).unwrap()["complete"], false);
}

#[test]
fn friction_speeds_and_travels_that_no_table_has_are_refused() {
    let folder = workbench(1000.0, 0.5, 0.2);
    assert_refused(folder.path(), &SIMULATE, &["properties.json", "friction of `a`", "1000", "needed"]);
    for (speed_m_s, travel_m, word) in
        [(1e5, 0.2, "speed_m_s"), (1e-9, 0.2, "speed_m_s"), (0.5, 1e4, "travel_m")]
    {
        let folder = workbench(0.25, speed_m_s, travel_m);
        assert_refused(folder.path(), &SIMULATE, &["strike.json", word, "needed"]);
    }
}

/// Changes the properties and asserts that `simulate` refuses them.
fn assert_properties_refused(change: &dyn Fn(&mut Value), words: &[&str]) {
    let folder = workbench(0.25, 0.5, 0.2);
    let path = folder.path().join("properties.json");
    let mut properties: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    change(&mut properties);
    fs::write(&path, properties.to_string()).unwrap();
    assert_refused(folder.path(), &SIMULATE, &[&["properties.json"], words].concat());
}

#[test]
fn impossible_uncertainties_are_refused_with_the_name_of_the_quantity() {
    assert_properties_refused(
        &|p| p["friction"]["c"]["std"] = json!(-0.1),
        &["friction of `c`", "std", "-0.1"],
    );
    assert_properties_refused(
        &|p| p["restitution"]["a/c"]["standard_error"] = json!(-1.0),
        &["restitution of `a/c`", "standard_error", "-1"],
    );
    assert_properties_refused(
        &|p| p["mass_ratio"]["e"]["interval_95"] = json!([2.0, 1.0]),
        &["mass_ratio of `e`", "interval_95", "[2, 1]"],
    );
    assert_properties_refused(
        &|p| p["contact_friction"]["striker"]["standard_error"] = json!(-0.2),
        &["contact_friction of striker", "-0.2"],
    );
}

#[test]
fn a_matrix_that_is_no_covariance_is_refused() {
    let matrix = |rows: Value| move |p: &mut Value| p["covariance"]["matrix"] = rows.clone();
    assert_properties_refused(
        &matrix(json!([[4e-4, 1e-4]])),
        &["covariance", "matrix", "2 rows and columns"],
    );
    assert_properties_refused(&matrix(json!([[4e-4], [1e-4, 4e-4]])), &["covariance", "matrix"]);
    assert_properties_refused(
        &matrix(json!([[4e-4, 1e-4], [2e-4, 4e-4]])),
        &["`friction/c` and `friction/a`", "mirrored"],
    );
    assert_properties_refused(&matrix(json!([[-4e-4, 0.0], [0.0, 4e-4]])), &["variance of `friction/a`"]);
    assert_properties_refused(&matrix(json!([[4e-4, 5e-4], [5e-4, 4e-4]])), &["at most"]);
    // Three correlations of -0.9 are possible for each pair and impossible together.
    assert_properties_refused(
        &|p| {
            p["covariance"]["names"] = json!(["x", "y", "z"]);
            p["covariance"]["matrix"] = json!([[1.0, -0.9, -0.9], [-0.9, 1.0, -0.9], [-0.9, -0.9, 1.0]]);
        },
        &["`z`", "positive semidefinite"],
    );
}

/// Replaces a text of one of the files and asserts that `simulate` refuses it.
fn assert_text_refused(file: &str, [old, new]: [&str; 2], words: &[&str]) {
    let folder = workbench(0.25, 0.5, 0.2);
    let path = folder.path().join(file);
    let text = fs::read_to_string(&path).unwrap();
    let changed = text.replacen(old, new, 1);
    assert_ne!(changed, text, "`{old}` is not in {file}");
    fs::write(&path, changed).unwrap();
    assert_refused(folder.path(), &SIMULATE, words);
}

#[test]
fn numbers_that_no_cell_and_no_pile_has_are_refused_by_their_key() {
    let speeds = "speed_range_m_s = [0.05, 1.0]";
    let robot = "[robot]\narm = \"indy7\"\n";
    let with_robot = |key: &str| format!("{robot}{key}\n\n[workspace]");
    for (old, new, word) in [
        (speeds, "speed_range_m_s = [1e-7, 1.0]".to_owned(), "speed_range_m_s[0]"),
        (speeds, "speed_range_m_s = [0.05, 1e6]".into(), "speed_range_m_s[1]"),
        (speeds, format!("{speeds}\nretract_speed_m_s = 1e-9"), "retract_speed_m_s"),
        ("min_m = [-0.48", "min_m = [-1e9".into(), "workspace"),
        ("center_m = [0.4, -0.21]", "center_m = [nan, -0.21]".into(), "center_m"),
        ("[camera]", "[camera]\nframe_rate_hz = 1e-30".into(), "frame_rate_hz"),
        ("[workspace]", with_robot("home_rad = [0, 0, nan, 0, 0, 0]"), "home_rad"),
        ("[workspace]", with_robot("tool_mass_kg = -1.0"), "tool_mass_kg"),
        ("[workspace]", with_robot("base_from_table = { position_m = [inf, 0, 0] }"), "base_from_table"),
    ] {
        assert_text_refused("cell.toml", [old, &new], &["cell.toml", word, "needed"]);
    }
    for (old, new, word) in [
        ("radius_m = 0.04", "radius_m = 1e5".to_owned(), "radius_m"),
        (
            "disc = { radius_m = 0.04 }",
            format!("polygon = {{ points_m = [{}] }}", "[0, 0], ".repeat(1001)),
            "1001 points",
        ),
        ("height_m = 0.05", "height_m = 1e-30".into(), "height_m"),
        ("mass_kg = 0.143", "mass_kg = 1e300".into(), "mass_kg"),
    ] {
        assert_text_refused("objects.toml", [old, &new], &["object `a`", word, "needed"]);
    }
    for (old, new, word) in [
        ("position_m = [-0.16855", "position_m = [1e200".to_owned(), "position_m"),
        ("yaw_rad = 1.24729", "yaw_rad = 1e30".into(), "yaw_rad"),
        (
            "[goal]",
            "[[walls]]\nfrom_m = [0, 0]\nto_m = [1e7, 0]\nrestitution = 0.5\n[goal]".into(),
            "walls[0]",
        ),
        (
            "[goal]",
            "[[placed]]\nobject = \"a\"\nposition_m = [0, 0]\n".repeat(1000) + "[goal]",
            "number of placed",
        ),
    ] {
        assert_text_refused("pile.scene.toml", [old, &new], &["pile.scene.toml", word, "needed"]);
    }
    assert_properties_refused(
        &|p| p["mass_ratio"]["e"]["mean"] = json!(1e9),
        &["mass_ratio of `e`", "1000000000"],
    );
}

#[test]
fn option_values_that_are_no_deviations_are_refused() {
    let folder = workbench(0.25, 0.5, 0.2);
    let plan = ["plan", "pile.scene.toml", "--properties", "properties.json", "-o", "out.json"];
    for (flag, value) in [
        ("--position-std-m", "nan"),
        ("--position-std-m=-0.1", ""),
        ("--yaw-std-rad", "inf"),
        ("--speed-std", "40"),
        ("--heading-std-rad", "nan"),
    ] {
        let values = [flag, value];
        let given = if value.is_empty() { &values[..1] } else { &values[..] };
        let name = flag.trim_start_matches("--").split('=').next().unwrap().replace('-', "_");
        assert_refused(folder.path(), &[&plan, given].concat(), &[&name, "needed"]);
    }
    let tags = ["tags", "--ids", "0", "-o", "out.json", "--size-m", "nan"];
    assert_refused(folder.path(), &tags, &["NaN", "needed"]);
    let viscoelastic = ["--restitution-law", "viscoelastic", "--reference-speed-m-s"];
    for (flags, word) in [
        (&[&viscoelastic[..], &["1e30"]].concat()[..], "reference_speed_m_s"),
        (&[&viscoelastic[..], &["nan"]].concat(), "reference_speed_m_s"),
        (
            &["--restitution-law", "power", "--reference-speed-m-s", "1", "--restitution-exponent", "2"],
            "exponent",
        ),
        (&["--striker-mass-kg", "0"], "striker_mass_kg"),
        (&["--friction-growth-s-m", "1e9"], "growth_s_m"),
        (&["--friction-across-grain", "1e9"], "across"),
        (&["--grain-rad", "nan"], "grain_rad"),
        (&["--assume-restitution", "nan"], "restitution"),
    ] {
        assert_refused(folder.path(), &[&SIMULATE, flags].concat(), &[word, "needed"]);
    }
    // The parser of the arguments reports these with its usage.
    for (flag, value) in [
        ("--frame-rate-hz", "1e-30"),
        ("--frame-rate-hz", "inf"),
        ("--strike-heading-rad", "nan"),
        ("--strike-heading-rad", "1e30"),
    ] {
        let detect = ["detect", "cell.toml", "objects.toml", "film.mp4", "--objects", "a", "-o", "out.csv"];
        let output = breakshot(folder.path(), &[&detect[..], &[flag, value]].concat());
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(flag) && message.contains("needed"), "{message}");
    }
}
