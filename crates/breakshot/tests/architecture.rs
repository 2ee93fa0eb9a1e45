//! The rules of the folder structure: which stage may use which, how long files and functions may be, how many files a
//! folder may hold, and what the library never does.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod imports;

use imports::{SourceFile, circles, collect, is_test, is_test_item, source_files, used_paths};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

/// The stages in the order of the data flow, and of each the output types that other stages may use.
const STAGES: [(&str, &[&str]); 7] = [
    (
        "capture",
        &[
            "Capture",
            "Footage",
            "Camera",
            "CameraMotion",
            "CAMERA_MOVED",
            "RECORDED_LENS",
            "Frame",
            "GreyImage",
        ],
    ),
    (
        "detect",
        &[
            "Tracks",
            "Track",
            "Sample",
            "StrikerTrack",
            "StrikerSample",
            "Draft",
            "Drafted",
            // The record of the searches.
            "Explained",
            "ObjectSearches",
            "Search",
            "Outcome",
            "Sighting",
            "Spot",
            "Candidate",
            "Doubt",
            "Rejection",
        ],
    ),
    ("estimate", &["Estimation", "ClipFit", "BodyFit", "Impact", "Measured", "ClipTracks", "ClipValue"]),
    ("physics", &["*"]),
    (
        "plan",
        &["Plan", "Outcome", "Prediction", "Iteration", "Contact", "Method", "EvaluatedStrike", "Remedy"],
    ),
    // The planner asks the arm's model what the arm can execute.
    (
        "robot",
        &["Command", "MountedArm", "Answer", "Capability", "Limits", "FASTEST_M_S", "least_follow_through_m"],
    ),
    (
        "verify",
        &[
            "Report",
            "Alignment",
            "Divergence",
            "GoalCheck",
            "ObservedPose",
            "DistanceErrors",
            "PairDifference",
        ],
    ),
];
/// Shows the output of all stages; no stage uses it.
const REPORT: &str = "report";
/// Modules beside the stages that no stage uses.
const DOORS: [&str; 2] = [REPORT, "synthetic"];
const LONGEST_FILE_LINES: usize = 600;
const LONGEST_FUNCTION_LINES: usize = 80;
const MOST_FILES_IN_A_FOLDER: usize = 12;
/// The crates of the workspace, by the folder of their sources.
const CRATES: [&str; 7] = [
    "crates/breakshot/src",
    "crates/breakshot-cli/src",
    "crates/breakshot-drivers/src",
    "crates/breakshot-py/src",
    "crates/breakshot-studio/src",
    "fuzz/src",
    "xtask/src",
];

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

fn library() -> PathBuf {
    workspace().join("crates/breakshot/src")
}

/// Every Rust file of the workspace that people write.
fn written_files() -> Vec<PathBuf> {
    let mut found = Vec::new();
    for folder in ["crates", "fuzz", "xtask"] {
        collect(&workspace().join(folder), &mut found);
    }
    let unwritten = |path: &Path| path.iter().any(|part| part == "generated" || part == "target");
    found.retain(|path| !unwritten(path));
    found
}

/// A path as it is printed in a failure.
fn shown(path: &Path) -> String {
    path.strip_prefix(workspace()).unwrap_or(path).display().to_string()
}

fn assert_none(violations: &[String], rule: &str) {
    assert!(violations.is_empty(), "{rule}:\n  {}", violations.join("\n  "));
}

/// The code of a file without comments and without its unit tests.
fn code(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let before_tests = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let lines = before_tests.lines().filter(|line| !line.trim_start().starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

fn stage_of(file: &SourceFile) -> Option<&'static str> {
    STAGES.iter().map(|(stage, _)| *stage).find(|stage| file.module.first().is_some_and(|m| m == stage))
}

#[test]
fn no_file_is_longer_than_600_lines() {
    let lines = |path: &Path| std::fs::read_to_string(path).unwrap().lines().count();
    let violations: Vec<_> = written_files()
        .iter()
        .map(|path| (path, lines(path)))
        .filter(|(_, lines)| *lines > LONGEST_FILE_LINES)
        .map(|(path, lines)| format!("{}: {lines} lines", shown(path)))
        .collect();
    assert_none(&violations, "files of more than 600 lines");
}

/// Collects functions that are too long.
struct Functions<'a> {
    path: &'a Path,
    too_long: Vec<String>,
}

impl Functions<'_> {
    fn check(&mut self, name: &syn::Ident, block: &syn::Block) {
        let lines = block.span().end().line - block.span().start().line + 1;
        if lines > LONGEST_FUNCTION_LINES {
            self.too_long.push(format!("{} {name}: {lines} lines", shown(self.path)));
        }
    }
}

impl<'ast> Visit<'ast> for Functions<'_> {
    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.check(&item.sig.ident, &item.block);
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.check(&item.sig.ident, &item.block);
        visit::visit_impl_item_fn(self, item);
    }
}

#[test]
fn no_function_is_longer_than_80_lines() {
    let mut violations = Vec::new();
    for path in written_files() {
        let syntax = syn::parse_file(&std::fs::read_to_string(&path).unwrap()).unwrap();
        let mut functions = Functions { path: &path, too_long: Vec::new() };
        functions.visit_file(&syntax);
        violations.append(&mut functions.too_long);
    }
    assert_none(&violations, "functions of more than 80 lines");
}

#[test]
fn no_folder_holds_more_than_twelve_source_files() {
    let mut files_in = BTreeMap::<String, usize>::new();
    for root in CRATES.map(|root| workspace().join(root)) {
        let mut paths = Vec::new();
        collect(&root, &mut paths);
        for path in paths.iter().filter(|path| !is_test(path.strip_prefix(&root).unwrap())) {
            *files_in.entry(shown(path.parent().unwrap())).or_default() += 1;
        }
    }
    let violations: Vec<_> = files_in
        .iter()
        .filter(|(_, count)| **count > MOST_FILES_IN_A_FOLDER)
        .map(|(folder, count)| format!("{folder}: {count} files"))
        .collect();
    assert_none(&violations, "folders of more than twelve source files");
}

#[test]
fn no_files_of_a_crate_import_each_other_in_a_circle() {
    let mut violations = Vec::new();
    for root in CRATES.map(|root| workspace().join(root)) {
        let files = source_files(&root);
        let edges = imports::imports(&files);
        for circle in circles(&edges) {
            let name = |index: &usize| shown(&files[*index].path);
            let arrows = circle.iter().map(|from| {
                let to: Vec<_> = edges[*from].iter().filter(|to| circle.contains(to)).map(name).collect();
                format!("{} -> {}", name(from), to.join(", "))
            });
            violations.push(arrows.collect::<Vec<_>>().join("\n    "));
        }
    }
    assert_none(&violations, "circles of imports");
}

#[test]
fn a_stage_uses_of_another_only_its_output() {
    let mut violations = Vec::new();
    for file in source_files(&library()) {
        let is_report = file.module.first().is_some_and(|module| module == REPORT);
        let Some(own) = stage_of(&file).or(is_report.then_some(REPORT)) else { continue };
        for path in used_paths(&file) {
            let Some(first) = path.first().filter(|first| *first != own) else { continue };
            let is_door = DOORS.contains(&first.as_str());
            let used = STAGES.iter().find(|(stage, _)| stage == first);
            let is_output = |outputs: &[&str]| {
                own != "physics"
                    && (outputs.contains(&"*")
                        || path.get(1).is_some_and(|name| outputs.contains(&name.as_str())))
            };
            if is_door || used.is_some_and(|(_, outputs)| !is_output(outputs)) {
                violations.push(format!("{} uses {}", shown(&file.path), path.join("::")));
            }
        }
    }
    assert_none(&violations, "uses of more than another stage's output");
}

#[test]
fn the_vocabulary_uses_no_stage() {
    let mut violations = Vec::new();
    for file in source_files(&library()) {
        let is_vocabulary =
            stage_of(&file).is_none() && !file.module.is_empty() && !DOORS.contains(&file.module[0].as_str());
        for path in used_paths(&file).iter().filter(|_| is_vocabulary) {
            if STAGES.iter().any(|(stage, _)| path.first().is_some_and(|first| first == stage)) {
                violations.push(format!("{} uses {}", shown(&file.path), path.join("::")));
            }
        }
    }
    assert_none(&violations, "vocabulary that uses a stage");
}

/// Collects paths into the parts of the standard library that reach the disk.
#[derive(Default)]
struct DiskPaths(Vec<String>);

impl<'ast> Visit<'ast> for DiskPaths {
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !is_test_item(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let mut text = String::new();
        for token in quote::ToTokens::to_token_stream(&item.tree) {
            text.push_str(&token.to_string());
        }
        if text.starts_with("std::path") || text.starts_with("std::fs") {
            self.0.push(text);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        if matches!(segments.as_slice(), [first, second, ..] if first == "std" && (second == "path" || second == "fs"))
        {
            self.0.push(segments.join("::"));
        }
        visit::visit_path(self, path);
    }
}

#[test]
fn no_stage_but_capture_takes_a_path_or_asks_the_disk() {
    let mut violations = Vec::new();
    for file in source_files(&library()) {
        if stage_of(&file).is_some_and(|stage| stage != "capture") {
            let mut disk = DiskPaths::default();
            disk.visit_file(&file.syntax);
            violations.extend(disk.0.iter().map(|used| format!("{} uses {used}", shown(&file.path))));
        }
    }
    assert_none(&violations, "stages that take a path or ask the disk");
}

#[test]
fn only_the_loaders_touch_files_and_nothing_prints() {
    const BANNED: [&str; 7] =
        ["std::fs", "File::open", "std::net", "println!", "eprintln!", "std::env", "std::process"];
    let mut violations = Vec::new();
    for file in source_files(&library()) {
        let within = file.path.strip_prefix(library()).unwrap().to_string_lossy().into_owned();
        let reads_files =
            within == "files.rs" || within.starts_with("files/") || within.starts_with("capture/source");
        let code = code(&file.path);
        for word in BANNED {
            let is_reading = reads_files && (word == "std::fs" || word == "File::open");
            // The one program that is ever started decodes films.
            let is_decoder =
                word == "std::process" && within.starts_with("capture/source") && within.contains("ffmpeg");
            if code.contains(word) && !is_reading && !is_decoder {
                violations.push(format!("{within} uses {word}"));
            }
        }
    }
    assert_none(&violations, "files that touch more than they may");
}

#[test]
fn the_map_of_the_paper_names_files_and_tests_that_exist() {
    let root = workspace().join("crates/breakshot");
    let map = std::fs::read_to_string(workspace().join("docs/paper.md")).unwrap();
    let mut paths = Vec::new();
    collect(&root.join("src"), &mut paths);
    collect(&root.join("tests"), &mut paths);
    let all_code: String = paths.iter().map(|path| std::fs::read_to_string(path).unwrap()).collect();
    let mut violations = Vec::new();
    for name in map.split('`').skip(1).step_by(2) {
        let is_there = if Path::new(name).extension().is_some_and(|e| e == "rs") {
            root.join("src").join(name).exists() || root.join(name).exists()
        } else if name.contains('_') && name.chars().all(|c| c.is_ascii_lowercase() || c == '_') {
            all_code.contains(name)
        } else {
            true
        };
        if !is_there {
            violations.push(name.to_owned());
        }
    }
    assert_none(&violations, "names in docs/paper.md that are not in the code");
}

#[test]
fn every_test_that_needs_ffmpeg_is_run_or_reported_as_skipped_by_the_one_check() {
    let check = std::fs::read_to_string(workspace().join("xtask/src/check.rs")).unwrap();
    let mark = concat!("#[ignore = \"needs ", "ffmpeg\"]");
    let mut found = 0;
    for path in written_files() {
        let text = std::fs::read_to_string(&path).unwrap();
        for after in text.split(mark).skip(1) {
            let name = after.split("fn ").nth(1).and_then(|rest| rest.split('(').next()).unwrap();
            let listed = check.contains(&format!("\"{name}\"")) || check.contains(&format!("::{name}\""));
            assert!(listed, "{}: {name} is not in NEEDS_FFMPEG of xtask/src/check.rs", path.display());
            found += 1;
        }
    }
    assert!(check.contains(&format!("NEEDS_FFMPEG: [&str; {found}]")), "{found} tests need ffmpeg");
}
