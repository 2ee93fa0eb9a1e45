//! The house plan, enforced: which stage may use which, how long a file may be, and what the library never does.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

/// The stages in the order in which data flows, and of each the output types that other stages may use.
const STAGES: [(&str, &[&str]); 8] = [
    ("capture", &["Capture", "Footage", "Camera", "Frame", "GreyImage"]),
    ("detect", &["Tracks", "Track", "Sample"]),
    ("estimate", &["Estimation", "ClipFit", "BodyFit", "Impact", "Measured", "ClipTracks", "ClipValue"]),
    ("physics", &["*"]),
    ("plan", &["Plan", "Outcome", "Prediction", "Iteration", "Contact", "Method"]),
    ("robot", &["Command"]),
    ("verify", &["Report", "GoalCheck", "ObservedPose", "DistanceErrors"]),
    // A door: no stage uses it.
    ("report", &[]),
];
const LONGEST_FILE_LINES: usize = 600;

fn library() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    let mut found = Vec::new();
    for path in entries {
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found
}

/// The code of a file before its unit tests, without comments; a file or folder of tests has none.
fn code(path: &Path) -> String {
    let within = path.strip_prefix(library()).unwrap();
    if within.iter().any(|part| part.to_string_lossy().trim_end_matches(".rs").ends_with("tests")) {
        return String::new();
    }
    let text = std::fs::read_to_string(path).unwrap();
    let before_tests = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let lines = before_tests.lines().filter(|line| !line.trim_start().starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

/// Every `crate::stage::...` in the code: the stage and the names taken from it.
fn uses(code: &str) -> Vec<(&'static str, Vec<String>)> {
    let word = |s: &str| s.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut found = Vec::new();
    for (at, prefix) in code.match_indices("crate::") {
        let rest = &code[at + prefix.len()..];
        let first = word(rest);
        let Some(stage) = STAGES.iter().map(|(stage, _)| *stage).find(|stage| *stage == first) else {
            continue;
        };
        let after = rest[stage.len()..].trim_start_matches("::");
        let names = match after.strip_prefix('{') {
            Some(list) => {
                list.split('}').next().unwrap_or_default().split(',').map(|n| word(n.trim())).collect()
            }
            None => vec![word(after)],
        };
        found.push((stage, names.into_iter().filter(|n| !n.is_empty()).collect()));
    }
    found
}

#[test]
fn no_file_is_longer_than_a_reader_can_hold() {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for path in ["crates", "xtask"].iter().flat_map(|folder| sources(&workspace.join(folder))) {
        let lines = std::fs::read_to_string(&path).unwrap().lines().count();
        assert!(
            lines <= LONGEST_FILE_LINES,
            "{}: {lines} lines; at most {LONGEST_FILE_LINES}",
            path.display()
        );
    }
}

#[test]
fn a_stage_uses_of_another_only_its_output() {
    for path in sources(&library()) {
        let relative = path.strip_prefix(library()).unwrap();
        let own = relative.iter().next().unwrap().to_string_lossy();
        if !STAGES.iter().any(|(stage, _)| *stage == own) {
            continue;
        }
        for (stage, names) in uses(&code(&path)).into_iter().filter(|(stage, _)| *stage != own) {
            assert!(
                own != "physics",
                "physics uses vocabulary only, but {} uses {stage}",
                relative.display()
            );
            let allowed = STAGES.iter().find(|(name, _)| *name == stage).unwrap().1;
            for name in names {
                assert!(
                    allowed.contains(&"*") || allowed.contains(&name.as_str()),
                    "{} uses {stage}::{name}; only its output is allowed: {allowed:?}",
                    relative.display()
                );
            }
        }
    }
}

#[test]
fn the_vocabulary_knows_no_stage() {
    for path in sources(&library()) {
        let relative = path.strip_prefix(library()).unwrap();
        if relative.iter().count() == 1 && relative != Path::new("lib.rs") {
            let used = uses(&code(&path));
            assert!(used.is_empty(), "{} uses {used:?}", relative.display());
        }
    }
}

#[test]
fn only_the_loaders_touch_files_and_nothing_prints() {
    const BANNED: [&str; 7] =
        ["std::fs", "File::open", "std::net", "println!", "eprintln!", "std::env", "std::process"];
    for path in sources(&library()) {
        let relative = path.strip_prefix(library()).unwrap().to_string_lossy().into_owned();
        let may_read = relative == "files.rs" || relative.starts_with("capture/source");
        let code = code(&path);
        for word in BANNED {
            let read = may_read && (word == "std::fs" || word == "File::open");
            // The one program that is ever started decodes films.
            let started = word == "std::process" && relative == "capture/source/ffmpeg/process.rs";
            let allowed = read || started;
            assert!(allowed || !code.contains(word), "{relative} uses {word}");
        }
    }
}

#[test]
fn the_map_of_the_paper_names_files_and_tests_that_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let map = std::fs::read_to_string(root.join("../../docs/paper.md")).unwrap();
    let mut all_code: Vec<PathBuf> = sources(&root.join("src"));
    all_code.extend(sources(&root.join("tests")));
    let all_code: String = all_code.iter().map(|path| std::fs::read_to_string(path).unwrap()).collect();
    for name in map.split('`').skip(1).step_by(2) {
        if Path::new(name).extension().is_some_and(|e| e == "rs") {
            let found = root.join("src").join(name).exists() || root.join(name).exists();
            assert!(found, "docs/paper.md names {name}, which is not there");
        } else if name.contains('_') && name.chars().all(|c| c.is_ascii_lowercase() || c == '_') {
            assert!(all_code.contains(name), "docs/paper.md names {name}, which is not in the code");
        }
    }
}
