//! A person's way through `breakshot studio` and through the motions of `report.html` in headless Chromium, and the latencies on the way.

use crate::check::cargo;
use crate::example::target;
use crate::process::{children_cpu_s, timed};
use crate::venv::python;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::SystemTime;

/// What drives the browser, and what checks that the page is accessible.
const PACKAGES: [&str; 2] = ["playwright==1.65.2", "axe-playwright-python==0.1.8"];
const STUDIO: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/breakshot-studio/tests/browser/studio.py");
const REPORT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/breakshot-cli/tests/browser/report.py");
const DEMO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/demo");

/// Browsers that the scripts can drive, by the names of their programs.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
/// Why the way is skipped.
const NO_BROWSER: &str = "no Chromium is installed, or can be";
/// The package that holds the first of them.
const PACKAGE: &str = "chromium";

/// Crates that are in the program for the studio alone, and a file of the crate that is compiled and linked anew with them.
const CRATES: [&str; 2] = ["breakshot-studio", "httparse"];
const PROGRAM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/breakshot-cli/src/main.rs");
/// Most CPU time that they may add to a fresh build (s).
const MOST_BUILD_S: f64 = 25.0;

/// The whole way with a release build: the CPU time that the studio adds to it, every step, and the bounds of the latencies.
///
/// # Errors
/// A step that does not show what it should, a latency or a build time beyond its bound.
pub(crate) fn test() -> Result<(), String> {
    let Some(chromium) = chromium() else {
        skipped(NO_BROWSER);
        return Ok(());
    };
    cargo(&["build", "--release"], &[])?;
    build_time()?;
    let program = target().join("release/breakshot");
    scripts(&program, &chromium, &python("studio", &PACKAGES)?, &[])
}

/// The way with the program that the tests have built, without bounds of latencies. It is reported as skipped where no browser is installed, or
/// can be, and where the scripts' packages cannot be installed.
///
/// # Errors
/// A step that does not show what it should.
pub(crate) fn walk() -> Result<(), String> {
    timed("the studio in a browser: ", walked)
}

fn walked() -> Result<(), String> {
    let program = target().join("debug/breakshot");
    if !program.is_file() {
        skipped("the tests have built no program");
        return Ok(());
    }
    let Some(chromium) = chromium() else {
        skipped(NO_BROWSER);
        return Ok(());
    };
    let python = match python("studio", &PACKAGES) {
        Ok(python) => python,
        Err(reason) => {
            skipped(&reason);
            return Ok(());
        }
    };
    scripts(&program, &chromium, &python, &["--no-bounds"])
}

fn skipped(reason: &str) {
    println!("xtask: SKIPPED the studio and the report in a browser: {reason}");
}

/// Both scripts with this program and browser.
fn scripts(program: &Path, chromium: &Path, python: &Path, flags: &[&str]) -> Result<(), String> {
    let shots = target().join("studio");
    let run = |script: &str, arguments: &[&Path], flags: &[&str]| {
        let mut way = Command::new(python);
        way.arg("-B").arg(script).arg(program).args(arguments).args(flags).env("CHROMIUM", chromium);
        let status = way.status().map_err(|e| format!("{script} cannot be started ({e})"))?;
        if status.success() { Ok(()) } else { Err(format!("{script} in a browser: {status}")) }
    };
    run(REPORT, &[&shots], &[])?;
    run(STUDIO, &[Path::new(DEMO), &shots], flags)
}

/// A browser: `CHROMIUM`, one that is installed, or the Debian package where it may be installed.
fn chromium() -> Option<PathBuf> {
    let given = std::env::var_os("CHROMIUM").map(PathBuf::from);
    given.filter(|browser| browser.is_file()).or_else(installed).or_else(|| {
        println!("xtask: installing the package {PACKAGE}");
        install().then(installed).flatten()
    })
}

fn installed() -> Option<PathBuf> {
    let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    let mut all = BROWSERS.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    all.find(|browser| browser.is_file())
}

/// Installs the package, as the user or through `sudo` where that asks for no password; false where it is not permitted.
fn install() -> bool {
    let apt = |words: &[&str]| {
        let done = |program: &str, before: &[&str]| {
            let mut command = Command::new(program);
            command.args(before).args(words).env("DEBIAN_FRONTEND", "noninteractive");
            command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
            command.status().is_ok_and(|status| status.success())
        };
        done("apt-get", &[]) || done("sudo", &["-n", "apt-get"])
    };
    let install = ["install", "--yes", "--no-install-recommends", PACKAGE];
    // A fresh machine has no lists of packages.
    apt(&install) || apt(&["update"]) && apt(&install)
}

/// Prints the CPU time that the studio adds to a fresh release build, which must have been made: that of its crates and the program less
/// that of the program alone.
fn build_time() -> Result<(), String> {
    let build_s = || -> Result<f64, String> {
        let before_s = children_cpu_s()?;
        cargo(&["build", "--release"], &[])?;
        Ok(children_cpu_s()? - before_s)
    };
    let packages: Vec<&str> = CRATES.iter().flat_map(|name| ["--package", name]).collect();
    cargo(&[&["clean", "--release"][..], &packages].concat(), &[])?;
    let with_s = build_s()?;
    // Cargo would also clean the library with the program, whose names are alike.
    let touched = std::fs::File::options().append(true).open(PROGRAM);
    touched.and_then(|file| file.set_modified(SystemTime::now())).map_err(|e| format!("{PROGRAM}: {e}"))?;
    let added_s = with_s - build_s()?;
    println!("the studio in a fresh release build: {added_s:.1} s of CPU time, at most {MOST_BUILD_S} s");
    if added_s <= MOST_BUILD_S { Ok(()) } else { Err("the studio takes too long to build".into()) }
}
