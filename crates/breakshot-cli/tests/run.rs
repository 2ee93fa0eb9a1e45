//! `breakshot run` and `breakshot plan --strikes` as processes, on two touching discs.

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// A folder with a pile and its properties.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("a file");
    write("cell.toml", include_str!("../../breakshot/tests/data/arms/indy7_cell.toml"));
    let disc = |name: &str| {
        format!(
            "[[objects]]\nname = \"{name}\"\nshape = {{ disc = {{ radius_m = 0.03 }} }}\nheight_m = 0.04\n\
             marker = {{ shape = {{ disc = {{ radius_m = 0.01 }} }} }}\n"
        )
    };
    write("objects.toml", &(disc("a") + &disc("b")));
    write("scene.toml", &scene("", 0.0605));
    write("observed_unchanged.toml", &scene("../", 0.0605));
    write("observed_apart.toml", &scene("../", 0.2));
    let one = r#"{ "mean": 0.5, "std": 0.01, "standard_error": 0.01, "interval_95": [0.4, 0.6], "n": 5 }"#;
    let known = |names: &[&str]| {
        let entries: Vec<String> = names.iter().map(|name| format!("\"{name}\": {one}")).collect();
        format!("{{ {} }}", entries.join(", "))
    };
    let (alone, pair) = (known(&["a", "b"]), known(&["a/b"]));
    let properties = format!(
        r#"{{ "version": 1, "reference": "a", "friction": {alone}, "striker_restitution": {alone}, "restitution": {pair},
             "mass_ratio": {alone}, "pair_mass_ratio": {pair}, "contact_friction": {{}}, "warnings": [] }}"#
    );
    write("properties.json", &properties);
    folder
}

fn scene(from: &str, apart_m: f64) -> String {
    format!(
        "cell = \"{from}cell.toml\"\nobjects = \"{from}objects.toml\"\n\
         [[placed]]\nobject = \"a\"\nposition_m = [0.0, 0.0]\n\
         [[placed]]\nobject = \"b\"\nposition_m = [{apart_m:?}, 0.0]\n"
    )
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_breakshot"));
    let known = ["scene.toml", "--properties", "properties.json"];
    let (what, flags) = arguments.split_first().expect("a command");
    command.arg(what).args(known).args(flags).current_dir(folder).output().expect("the program")
}

fn json(file: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(file).expect("a file")).expect("JSON")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_pile_on_a_simulated_table_is_struck_until_it_is_singulated() {
    let folder = folder();
    let output = run(folder.path(), &["run", "--method", "paper", "-o", "out"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let ended = json(&folder.path().join("out/run.json"));
    assert_eq!(ended["singulated"], true, "{ended}");
    let strikes = ended["strikes"].as_array().expect("a list").len();
    assert!((1..=3).contains(&strikes), "{ended}");
    for number in 1..=strikes {
        assert!(folder.path().join(format!("out/plan_{number}.json")).is_file());
    }
}

#[test]
fn the_programs_of_the_user_execute_and_observe() {
    let folder = folder();
    let flags = ["run", "--method", "paper", "--execute", "test -s {plan}", "-o", "out", "--look"];
    let output = run(folder.path(), &[&flags[..], &["cp observed_apart.toml {scene}"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let ended = json(&folder.path().join("out/run.json"));
    assert_eq!(ended["strikes"].as_array().map(Vec::len), Some(1), "{ended}");
    assert_eq!(ended["placed"][1]["position_m"][0], 0.2, "{ended}");
    // The observed poses never change: three strikes without success.
    let output = run(folder.path(), &[&flags[..], &["cp observed_unchanged.toml {scene}"]].concat());
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let ended = json(&folder.path().join("out/run.json"));
    assert_eq!(
        (ended["singulated"].as_bool(), ended["strikes"].as_array().map(Vec::len)),
        (Some(false), Some(3))
    );
}

#[test]
fn a_program_that_fails_ends_the_run_with_its_name() {
    let folder = folder();
    for (execute, word) in [("false", "`false`"), ("no_such_program {plan}", "`no_such_program`")] {
        let flags = ["run", "--method", "paper", "--execute", execute, "--look", "true", "-o", "out"];
        let output = run(folder.path(), &flags);
        assert_eq!(output.status.code(), Some(2));
        assert!(
            stderr(&output).contains(word) && stderr(&output).contains("--execute"),
            "{}",
            stderr(&output)
        );
    }
    let output = run(folder.path(), &["run", "--execute", "true", "-o", "out"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("--look"), "{}", stderr(&output));
}

#[test]
fn more_strikes_are_planned_ahead_and_drawn() {
    let folder = folder();
    let flags = ["plan", "--method", "paper", "--strikes", "3", "--figure", "plan.svg", "-o", "plan.json"];
    let output = run(folder.path(), &flags);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let plan = json(&folder.path().join("plan.json"));
    // The first strike is expected to reach the goal, so that none follows.
    assert_eq!((plan["outcome"].as_str(), plan.get("then")), (Some("found"), None));
    let drawing = fs::read_to_string(folder.path().join("plan.svg")).expect("a drawing");
    assert!(drawing.starts_with("<svg") && drawing.trim_end().ends_with("</svg>"));
}

#[test]
fn proposals_are_evaluated_and_the_survey_lists_strikes_with_their_success_probability() {
    let folder = folder();
    let aims = |object: &str| {
        format!(
            r#"[{{ "object": "{object}", "heading_rad": 0.0, "speed_m_s": 0.5, "follow_through_m": 0.01 }}]"#
        )
    };
    fs::write(folder.path().join("aims.json"), aims("a")).expect("a file");
    let survey =
        ["--survey", "survey.json", "--survey-strikes", "20", "--survey-samples", "5", "--map", "map.svg"];
    let planned = |proposals: &str| {
        let robust = ["plan", "--method", "robust", "--proposals", proposals, "-o", "plan.json"];
        run(folder.path(), &[&robust[..], &survey[..]].concat())
    };
    let output = planned("aims.json");
    assert!(output.status.success(), "{}", stderr(&output));
    let written = json(&folder.path().join("survey.json"));
    assert_eq!((&written["version"], &written["samples"]), (&1.into(), &5.into()));
    let strikes = written["strikes"].as_array().expect("strikes");
    assert_eq!(strikes.len(), 20);
    // The proposals come first.
    assert_eq!(strikes[0]["aim"]["speed_m_s"], 0.5, "m/s");
    for strike in strikes {
        let probability = strike["success_probability"].as_f64().expect("a number");
        assert!((0.0..=1.0).contains(&probability), "{probability}");
        assert_eq!(strike["aim"]["object"], strike["strike"]["object"]);
    }
    // The map shows the same strikes, those on one line once.
    let map = fs::read_to_string(folder.path().join("map.svg")).expect("a drawing");
    let drawn = map.matches("class=\"approach p").count() - 5;
    assert!(map.contains("success probability") && (1..=20).contains(&drawn), "{drawn}");

    // The survey is itself a source of proposals.
    let proposed: Vec<&Value> = strikes.iter().map(|s| &s["aim"]).collect();
    fs::write(folder.path().join("surveyed.json"), serde_json::to_string(&proposed).expect("JSON"))
        .expect("a file");
    assert!(planned("surveyed.json").status.success());
    fs::write(folder.path().join("unknown.json"), aims("x")).expect("a file");
    let output = planned("unknown.json");
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("one of the placed objects: a, b"), "{}", stderr(&output));
}
