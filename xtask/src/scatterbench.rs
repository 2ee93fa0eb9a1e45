//! The benchmark beside the project: `cargo xtask scatterbench [PYTHON]`.
//!
//! Its tests run, its adapters print their table from nothing, and the adapter that is wrong on purpose must fail.

use crate::example::target;
use crate::python;
use crate::validate::row::{self, Row};
use std::path::Path;
use std::process::Command;
use std::time::Instant;

const FOLDER: &str = "scatterbench";
/// What benchmark and adapters need besides the wheel.
const PACKAGES: [&str; 7] = [
    "numpy",
    "mujoco==4.0.0",
    "jsonschema==4.26.0",
    "opencv-python-headless==5.0.0.93",
    "scipy",
    "pymunk==7.3.1",
    "pytest==9.2.0",
];
/// Longest time from nothing to the table of these two adapters (minutes).
const MOST_MINUTES: f64 = 10.0;
const TIMED: [&str; 2] = ["random", "breakshot"];
const OTHERS: [&str; 3] = ["opencv_scipy", "mujoco_default", "pymunk_planar"];
/// The exit code of a table with a submission that fails.
const FAILED: i32 = 1;

/// Builds the wheel, tests the benchmark, and prints the tables of its adapters.
pub(crate) fn scatterbench(interpreter: &str) -> Result<(), String> {
    let wheel = python::wheel(interpreter)?;
    let python = python::installed(interpreter, "scatterbench", &PACKAGES, &wheel)?;
    let python = std::path::absolute(python).map_err(|e| e.to_string())?;
    let data = std::path::absolute(target().join("scatterbench")).map_err(|e| e.to_string())?;
    if data.exists() {
        std::fs::remove_dir_all(&data).map_err(|e| format!("{}: {e}", data.display()))?;
    }
    let pytest = ["-m", "pytest", "--quiet", "-p", "no:cacheprovider", "tests"];
    succeeded(run(&python, &pytest, None)?, "pytest")?;
    let start = Instant::now();
    succeeded(table(&python, &data, &TIMED)?, "the table of random and breakshot")?;
    let minutes = start.elapsed().as_secs_f64() / 60.0;
    succeeded(table(&python, &data, &OTHERS)?, "the table of the other adapters")?;
    let wrong = table(&python, &data, &["wrong"])?;
    if wrong != FAILED {
        return Err(format!(
            "the adapter `wrong` ended with {wrong}; needed: {FAILED}, a submission that fails"
        ));
    }
    let time = Row::at_most("random and breakshot, data included", minutes, MOST_MINUTES, "minutes");
    row::require(row::print_all("ScatterBench", &[time]))
}

/// The exit code of the table of some adapters, which is printed.
fn table(python: &Path, data: &Path, adapters: &[&str]) -> Result<i32, String> {
    let arguments: Vec<&str> = ["-m", "scatterbench", "table"].iter().chain(adapters).copied().collect();
    run(python, &arguments, Some(data))
}

fn run(python: &Path, arguments: &[&str], data: Option<&Path>) -> Result<i32, String> {
    println!("xtask: python {} (in {FOLDER})", arguments.join(" "));
    let mut command = Command::new(python);
    command.args(arguments).current_dir(FOLDER);
    if let Some(data) = data {
        command.arg("--data").arg(data);
    }
    let status = command.status().map_err(|e| format!("python cannot be started ({e})"))?;
    status.code().ok_or_else(|| format!("python {} was ended ({status})", arguments.join(" ")))
}

fn succeeded(code: i32, what: &str) -> Result<(), String> {
    if code == 0 { Ok(()) } else { Err(format!("{what} ended with {code}")) }
}
