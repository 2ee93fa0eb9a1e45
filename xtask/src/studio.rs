//! A person's way through `breakshot studio` and through the motions of `report.html` in headless Chromium, and the latencies on the way.

use crate::check::cargo;
use crate::example::target;
use crate::venv::python;
use std::path::Path;
use std::process::Command;

/// What drives the browser, and what checks that the page is accessible.
const PACKAGES: [&str; 2] = ["playwright==1.65.2", "axe-playwright-python==0.1.8"];
const STUDIO: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/breakshot-studio/tests/browser/studio.py");
const REPORT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/breakshot-cli/tests/browser/report.py");
const DEMO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/demo");

/// Builds the program and runs the scripts; reports them as skipped without a Chromium (`CHROMIUM`, or that of Debian).
///
/// # Errors
/// A step that does not show what it should, a latency beyond its bound.
pub(crate) fn test() -> Result<(), String> {
    let chromium = std::env::var("CHROMIUM").unwrap_or_else(|_| "/usr/bin/chromium".into());
    if !Path::new(&chromium).exists() {
        println!("xtask: SKIPPED the studio and the report in a browser: {chromium} is not installed");
        return Ok(());
    }
    cargo(&["build", "--release"], &[])?;
    let program = target().join("release/breakshot");
    let shots = target().join("studio");
    let python = python("studio", &PACKAGES)?;
    let run = |script: &str, arguments: &[&Path]| {
        let mut way = Command::new(&python);
        way.arg(script).arg(&program).args(arguments).env("CHROMIUM", &chromium);
        let status = way.status().map_err(|e| format!("{script} cannot be started ({e})"))?;
        if status.success() { Ok(()) } else { Err(format!("{script} in a browser: {status}")) }
    };
    run(REPORT, &[&shots])?;
    run(STUDIO, &[Path::new(DEMO), &shots])
}
