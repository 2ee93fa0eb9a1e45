//! `breakshot strike` as a user runs it: what it refuses, and how it ends.

#[cfg(unix)]
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
#[cfg(unix)]
use std::process::{Child, ChildStderr};
use std::process::{Command, Output};
use std::time::SystemTime;

/// The folder with all that a strike on one disc needs.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("cell.toml", include_str!("../../breakshot/tests/data/arms/indy7_cell.toml"));
    write(
        "objects.toml",
        "[[objects]]\nname = \"a\"\nshape = { disc = { radius_m = 0.03 } }\nheight_m = 0.04\n\
         marker = { shape = { disc = { radius_m = 0.01 } } }\n",
    );
    write("scene.toml", &scene(now_unix_s(), 0.0));
    write(
        "strike.json",
        r#"{ "object": "a", "start_m": [-0.1, 0.0], "heading_rad": 0.0, "speed_m_s": 0.2, "travel_m": 0.06 }"#,
    );
    let one = r#"{ "mean": 0.5, "std": 0.01, "standard_error": 0.01, "interval_95": [0.4, 0.6], "n": 5 }"#;
    write(
        "properties.json",
        &format!(
            r#"{{ "version": 1, "reference": "a", "friction": {{ "a": {one} }}, "striker_restitution": {{ "a": {one} }},
                 "restitution": {{}}, "mass_ratio": {{ "a": {one} }}, "pair_mass_ratio": {{}}, "contact_friction": {{}},
                 "warnings": [] }}"#
        ),
    );
    let made = run(
        folder.path(),
        &["command", "strike.json", "--cell", "cell.toml", "--scene", "scene.toml", "-o", "command.json"],
    );
    assert_eq!(made.status.code(), Some(0), "{}", String::from_utf8_lossy(&made.stderr));
    folder
}

fn scene(observed_unix_s: f64, x_m: f64) -> String {
    format!(
        "cell = \"cell.toml\"\nobjects = \"objects.toml\"\nobserved_unix_s = {observed_unix_s:?}\n\
         [[placed]]\nobject = \"a\"\nposition_m = [{x_m:?}, 0.0]\n"
    )
}

fn now_unix_s() -> f64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).expect("after 1970").as_secs_f64()
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_breakshot"));
    command.args(arguments).current_dir(folder).output().expect("the program")
}

fn text(output: &Output) -> String {
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    format!("{out}{err}")
}

/// The hash that a dry run prints.
fn hash(folder: &Path) -> String {
    let shown = run(folder, &["strike", "command.json", "--scene", "scene.toml"]);
    assert_eq!(shown.status.code(), Some(0), "{}", text(&shown));
    assert!(text(&shown).contains("nothing was moved"), "{}", text(&shown));
    let shown = text(&shown);
    let (_, after) = shown.split_once("--live --hash ").expect("how to go on");
    after.chars().take(8).collect()
}

const SIM: [&str; 6] = ["strike", "command.json", "--driver", "sim", "--properties", "properties.json"];

#[test]
fn a_strike_in_simulation_needs_live_and_the_hash_and_leaves_a_log() {
    let folder = folder();
    let hash = hash(folder.path());
    let look_again =
        || std::fs::write(folder.path().join("scene.toml"), scene(now_unix_s(), 0.0)).expect("a file");
    look_again();
    let dry = run(folder.path(), &[&SIM[..], &["--scene", "scene.toml"]].concat());
    assert_eq!(dry.status.code(), Some(0), "{}", text(&dry));
    assert!(text(&dry).contains("nothing was moved"), "{}", text(&dry));
    let without = run(folder.path(), &[&SIM[..], &["--live"]].concat());
    assert_eq!(without.status.code(), Some(3), "{}", text(&without));
    assert!(text(&without).contains("the hash is missing"), "{}", text(&without));
    look_again();
    let live =
        [&SIM[..], &["--scene", "scene.toml", "--live", "--hash", &hash, "--log", "log.jsonl"]].concat();
    let struck = looking_meanwhile(folder.path(), || run(folder.path(), &live));
    assert_eq!(struck.status.code(), Some(0), "{}", text(&struck));
    assert!(text(&struck).contains("struck at 0.200 m/s"), "{}", text(&struck));
    let log = std::fs::read_to_string(folder.path().join("log.jsonl")).expect("a log");
    assert_eq!(log.matches("\"event\":\"sent\"").count(), 5, "{log}");
    assert!(folder.path().join("log.mcap").exists());
    let again = run(folder.path(), &live);
    assert_eq!(again.status.code(), Some(2), "{}", text(&again));
    assert!(text(&again).contains("never overwritten"), "{}", text(&again));
    assert_eq!(std::fs::read_to_string(folder.path().join("log.jsonl")).expect("a log"), log);
}

/// Runs a program while the scene is observed again and again.
fn looking_meanwhile<T>(folder: &Path, program: impl FnOnce() -> T) -> T {
    let ended = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !ended.load(std::sync::atomic::Ordering::Relaxed) {
                let seen = scene(now_unix_s(), 0.0);
                breakshot::files::write_whole(&folder.join("scene.toml"), seen.as_bytes()).expect("a file");
                std::thread::sleep(std::time::Duration::from_millis(100));
            }
        });
        let result = program();
        ended.store(true, std::sync::atomic::Ordering::Relaxed);
        result
    })
}

#[test]
fn an_old_or_changed_table_is_refused_with_the_reason() {
    let folder = folder();
    for (scene, word) in [
        (scene(now_unix_s() - 100.0, 0.0), "100 s ago"),
        (scene(now_unix_s(), 0.02), "`a` lies 20.0 mm away"),
    ] {
        std::fs::write(folder.path().join("scene.toml"), scene).expect("a file");
        let refused = run(folder.path(), &["strike", "command.json", "--scene", "scene.toml"]);
        assert_eq!(refused.status.code(), Some(3), "{}", text(&refused));
        assert!(text(&refused).contains(word), "no `{word}` in {}", text(&refused));
    }
}

#[test]
fn bad_robots_and_damaged_commands_are_reported() {
    let folder = folder();
    let cases: [(&[&str], i32, &str); 3] = [
        (&["strike", "command.json", "--driver", "kuka:host"], 2, "`kuka:host`"),
        (&["strike", "command.json", "--driver", "sim"], 2, "--properties"),
        (&["strike", "command.json", "--driver", "indy:127.0.0.1:1"], 1, "nothing was moved"),
    ];
    for (arguments, code, word) in cases {
        let ended = run(folder.path(), arguments);
        assert_eq!(ended.status.code(), Some(code), "{arguments:?}: {}", text(&ended));
        assert!(text(&ended).contains(word), "no `{word}` in {}", text(&ended));
    }
    let path = folder.path().join("command.json");
    let command = std::fs::read_to_string(&path).expect("a command");
    let damaged = command.replacen("\"name\": \"strike\"", "\"name\": \"raise\"", 1);
    assert_ne!(damaged, command, "the test has to change something");
    std::fs::write(&path, damaged).expect("a file");
    let ended = run(folder.path(), &["strike", "command.json"]);
    assert_eq!(ended.status.code(), Some(2), "{}", text(&ended));
    assert!(text(&ended).contains("phases"), "{}", text(&ended));
}

#[cfg(unix)]
#[test]
fn signals_stop_the_arm_and_end_with_a_failure() {
    let folder = folder();
    let hash = hash(folder.path());
    for signal in ["-INT", "-TERM", "-HUP", "-QUIT"] {
        assert_stops(folder.path(), &hash, signal);
        std::fs::remove_file(folder.path().join("log.jsonl")).expect("a log");
        std::fs::remove_file(folder.path().join("log.mcap")).expect("a recording");
    }
}

/// A strike of the simulated arm, during its approach, and the rest of what it shows of its progress.
#[cfg(unix)]
fn approaching(folder: &Path, hash: &str, log: &str) -> (Child, BufReader<ChildStderr>) {
    std::fs::write(folder.join("scene.toml"), scene(now_unix_s(), 0.0)).expect("a file");
    let mut child = Command::new(env!("CARGO_BIN_EXE_breakshot"))
        .args(SIM)
        .args(["--scene", "scene.toml", "--live", "--hash", hash, "--log", log])
        .current_dir(folder)
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the program");
    let mut progress = BufReader::new(child.stderr.take().expect("piped"));
    let mut line = String::new();
    while !line.contains("approach") {
        line.clear();
        assert!(progress.read_line(&mut line).expect("text") > 0, "it ended before it moved");
    }
    (child, progress)
}

#[cfg(unix)]
fn assert_stops(folder: &Path, hash: &str, signal: &str) {
    let (mut child, _progress) = approaching(folder, hash, "log.jsonl");
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
    let status = child.wait().expect("it ends");
    let mut shown = String::new();
    child.stdout.take().expect("piped").read_to_string(&mut shown).expect("text");
    assert_eq!(status.code(), Some(1), "{signal}: {shown}");
    assert!(shown.contains("STOPPED during the approach: stopped by the user"), "{shown}");
    let log = std::fs::read_to_string(folder.join("log.jsonl")).expect("a log");
    assert_eq!(log.matches("\"event\":\"sent\"").count(), 1, "{log}");
    assert!(log.contains("\"event\":\"stopped\""), "{log}");
}

#[cfg(unix)]
#[test]
fn the_log_of_a_killed_strike_is_complete_but_for_its_last_moment() {
    let folder = folder();
    let hash = hash(folder.path());
    // A busy machine may hold up the program just before it is killed.
    let late_s = (0..3).map(|k| late_when_killed_s(folder.path(), &hash, &format!("killed-{k}.jsonl")));
    let late_s: Vec<f64> = late_s.collect();
    assert!(late_s.iter().any(|late_s| *late_s < 0.1), "{late_s:?}");
}

/// Kills a strike during its approach; the time from the last line of its log to the kill (s).
#[cfg(unix)]
fn late_when_killed_s(folder: &Path, hash: &str, log: &str) -> f64 {
    let (mut child, _progress) = approaching(folder, hash, log);
    std::thread::sleep(std::time::Duration::from_millis(700));
    let killed_unix_s = now_unix_s();
    // SIGKILL
    child.kill().expect("it runs");
    child.wait().expect("it ends");
    let log = std::fs::read_to_string(folder.join(log)).expect("a log");
    let lines: Vec<serde_json::Value> =
        log.lines().map(|line| serde_json::from_str(line).expect("whole lines")).collect();
    assert!(lines.iter().any(|line| line["event"] == "sent"), "{log}");
    killed_unix_s - lines.last().and_then(|line| line["time_unix_s"].as_f64()).expect("a time")
}

#[test]
fn a_plan_names_the_arm_that_can_execute_it() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let one = scene(now_unix_s(), 0.0);
    let two = format!("{one}[[placed]]\nobject = \"a#2\"\nposition_m = [0.062, 0.01]\n");
    std::fs::write(path("scene.toml"), two).expect("a file");
    let plan = |flags: &[&str]| {
        let inputs = ["plan", "scene.toml", "--properties", "properties.json", "-o", "plan.json"];
        let planned = run(folder.path(), &[&inputs[..], flags].concat());
        // The restitution of the two copies is assumed.
        assert_eq!(planned.status.code(), Some(3), "{}", text(&planned));
        std::fs::read_to_string(path("plan.json")).expect("a plan")
    };
    assert!(!plan(&["--any-arm"]).contains("\n  \"arm\":"));
    assert!(plan(&["--method", "paper"]).contains("\n  \"arm\": \"indy7\""));
    let command =
        ["command", "plan.json", "--cell", "cell.toml", "-o", "planned.json", "--impulse-map", "map.svg"];
    let accepted = run(folder.path(), &command);
    assert_eq!(accepted.status.code(), Some(0), "{}", text(&accepted));
    assert!(std::fs::read_to_string(path("map.svg")).expect("a map").contains("<polygon"));
}

#[test]
fn a_plan_leaves_out_an_arm_of_unknown_base_pose_and_says_so() {
    let folder = folder();
    let path = folder.path().join("cell.toml");
    let cell = std::fs::read_to_string(&path).expect("a cell");
    let without: Vec<&str> = cell.lines().filter(|line| !line.starts_with("base_from_table")).collect();
    std::fs::write(&path, without.join("\n")).expect("a file");
    let planned =
        run(folder.path(), &["plan", "scene.toml", "--properties", "properties.json", "-o", "plan.json"]);
    assert!(text(&planned).contains("no base_from_table"), "{}", text(&planned));
}

#[test]
fn a_picture_does_not_become_new_by_being_copied() {
    let folder = tempfile::tempdir().expect("a folder");
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo");
    for file in ["cell.toml", "objects.toml", "single_a_3.mp4"] {
        std::fs::copy(demo.join(file), folder.path().join(file)).expect("a copy");
    }
    let look = ["look", "cell.toml", "objects.toml", "single_a_3.mp4", "--objects", "a", "-o", "scene.toml"];
    let seen = |flags: &[&str]| {
        let output = run(folder.path(), &[&look[..], flags].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output));
        let scene = std::fs::read_to_string(folder.path().join("scene.toml")).expect("a scene");
        (scene, text(&output))
    };
    let (scene, printed) = seen(&[]);
    let now_s = now_unix_s();
    let dated = scene.lines().find_map(|line| line.strip_prefix("observed_unix_s = ")?.parse::<f64>().ok());
    assert!(dated.is_none_or(|time_s| now_s - time_s > 3600.0), "the copy's date: {scene}");
    assert!(dated.is_some() || printed.contains("--taken-unix-s"), "{printed}");
    let (scene, _) = seen(&["--taken-unix-s", "1790000000.5"]);
    assert!(scene.contains("observed_unix_s = 1790000000.5"), "{scene}");
    for wrong in ["nan", "-1", "1e300"] {
        let refused = run(folder.path(), &[&look[..], &["--taken-unix-s", wrong]].concat());
        assert_eq!(refused.status.code(), Some(2), "{wrong}: {}", text(&refused));
    }
}

#[test]
fn touches_with_large_residuals_are_not_written_unless_accepted() {
    let folder = folder();
    let cell_path = folder.path().join("cell.toml");
    let before = std::fs::read_to_string(&cell_path).expect("a cell");
    // A square whose last corner is 20 mm too high.
    let touches: String = [
        ("0.0, 0.0", "0.5, 0.0, 0.0"),
        ("0.1, 0.0", "0.6, 0.0, 0.0"),
        ("0.0, 0.1", "0.5, 0.1, 0.0"),
        ("0.1, 0.1", "0.6, 0.1, 0.02"),
    ]
    .iter()
    .fold(String::new(), |all, (table, base)| {
        all + &format!("[[touches]]\ntable_m = [{table}]\nbase_m = [{base}]\n")
    });
    std::fs::write(folder.path().join("touches.toml"), touches).expect("a file");
    let touch = ["command", "--touch", "touches.toml", "--cell", "cell.toml"];
    let refused = run(folder.path(), &touch);
    assert_eq!(refused.status.code(), Some(3), "{}", text(&refused));
    assert!(text(&refused).contains("--accept-residuals"), "{}", text(&refused));
    assert_eq!(std::fs::read_to_string(&cell_path).expect("a cell"), before);
    let accepted = run(folder.path(), &[&touch[..], &["--accept-residuals"]].concat());
    assert_eq!(accepted.status.code(), Some(3), "{}", text(&accepted));
    let after = std::fs::read_to_string(&cell_path).expect("a cell");
    assert_ne!(after, before);
    let others = |text: &str| -> Vec<String> {
        text.lines().filter(|line| !line.contains("base_from_table")).map(str::to_owned).collect()
    };
    assert!(before.starts_with("# A table") && others(&after) == others(&before), "{after}");
    breakshot::files::load_cell(&cell_path).expect("a cell that loads");
    // A cell that would not load is not written.
    std::fs::write(&cell_path, format!("{before}\nhome_rad = [nan]\n")).expect("a file");
    let refused = run(folder.path(), &[&touch[..], &["--accept-residuals"]].concat());
    assert_eq!(refused.status.code(), Some(2), "{}", text(&refused));
    assert!(std::fs::read_to_string(&cell_path).expect("a cell").ends_with("home_rad = [nan]\n"));
}
