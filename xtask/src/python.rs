//! Builds the Python package and checks it: `cargo xtask python [PYTHON]`.
//!
//! The wheel is installed with NumPy alone, its size and the time of its import are measured, its tests run, and its declared types are
//! compared with what is there. The examples for many machines run on a cluster of several nodes of this machine, one of which is killed.

use crate::check::cargo;
use crate::example::target;
use crate::validate::row::{self, Row, median};
use crate::venv;
use std::path::{Path, PathBuf};
use std::process::Command;

const PACKAGE: &str = "crates/breakshot-py";
const MOST_MEGABYTES: f64 = 8.0;
/// Longest import (ms): of the package by itself, which loads NumPy when rollouts are first asked for.
const MOST_IMPORT_MS: f64 = 80.0;
/// Imports whose median is taken.
const IMPORTS: usize = 9;
/// What builds the wheel.
const BUILDER: [&str; 1] = ["maturin==1.16.0"];
/// What tests and checks need besides the wheel.
const CHECKERS: [&str; 4] = ["numpy", "gymnasium==1.4.0", "pytest==9.2.0", "mypy==2.4.1"];

/// What the examples for many machines need besides the wheel.
const CLUSTER: [&str; 4] = ["numpy", "gymnasium==1.4.0", "pytest==9.2.0", "ray==2.60.0"];
const CLUSTER_TEST: &str = "tests/test_ray.py";

/// What executes the notebook.
const NOTEBOOK: [&str; 4] = ["numpy", "pytest==9.2.0", "nbclient==0.11.0", "ipykernel==7.4.0"];
const NOTEBOOK_TEST: &str = "tests/test_notebook.py";

/// Builds and checks the package for an interpreter.
pub(crate) fn python(interpreter: &str) -> Result<(), String> {
    cargo(&["build", "--release", "--package", "breakshot-cli"], &[])?;
    let wheel = wheel(interpreter)?;
    let megabytes = std::fs::metadata(&wheel).map_err(|e| e.to_string())?.len() as f64 * 1e-6;
    let import_ms = import_with_numpy_alone(interpreter, &wheel)?;
    let checkers = installed(interpreter, "breakshot-checks", &CHECKERS, &wheel)?;
    // Without Ray and a notebook's kernel, whose tests skip themselves.
    tests(&checkers, "tests")?;
    types(&checkers)?;
    tests(&installed(interpreter, "breakshot-notebook", &NOTEBOOK, &wheel)?, NOTEBOOK_TEST)?;
    tests(&installed(interpreter, "breakshot-cluster", &CLUSTER, &wheel)?, CLUSTER_TEST)?;
    let rows = [
        Row::at_most("size of the wheel", megabytes, MOST_MEGABYTES, "MB"),
        Row::at_most(format!("import, median of {IMPORTS}"), import_ms, MOST_IMPORT_MS, "ms"),
    ];
    row::require(row::print_all("The Python package", &rows))
}

/// Builds the wheel into a folder of its own.
pub(crate) fn wheel(interpreter: &str) -> Result<PathBuf, String> {
    let folder = target().join("python/wheel");
    if folder.exists() {
        std::fs::remove_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    let python = venv::python_of(interpreter, "maturin", &BUILDER)?;
    let manifest = format!("{PACKAGE}/Cargo.toml");
    let arguments =
        ["-m", "maturin", "build", "--release", "--locked", "--manifest-path", &manifest, "--out"];
    venv::succeed(Command::new(python).args(arguments).arg(&folder))?;
    let files = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let found =
        files.flatten().map(|file| file.path()).find(|path| path.extension().is_some_and(|e| e == "whl"));
    found.ok_or_else(|| format!("{}: no wheel; needed: one from maturin", folder.display()))
}

/// The interpreter of an environment with these packages and the wheel.
pub(crate) fn installed(
    interpreter: &str,
    name: &str,
    packages: &[&str],
    wheel: &Path,
) -> Result<PathBuf, String> {
    let python = venv::python_of(interpreter, name, packages)?;
    let arguments = ["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps"];
    venv::succeed(Command::new(&python).args(arguments).arg(wheel))?;
    // Fails if the wheel needs a package that is not there.
    venv::succeed(Command::new(&python).args(["-m", "pip", "check"]))?;
    Ok(python)
}

/// The time of an import (ms) in an environment that has nothing but NumPy, after a simulator has worked there.
fn import_with_numpy_alone(interpreter: &str, wheel: &Path) -> Result<f64, String> {
    const SIMULATOR: &str = "import breakshot; breakshot.Simulator()";
    const IMPORT: &str = "import time; start = time.perf_counter(); import breakshot; print(1e3 * (time.perf_counter() - start))";
    let python = installed(interpreter, "breakshot-alone", &["numpy"], wheel)?;
    venv::succeed(Command::new(&python).args(["-c", SIMULATOR]))?;
    let time_ms = || {
        let run = crate::process::run(Command::new(&python).args(["-c", IMPORT]))?;
        run.stdout.trim().parse::<f64>().map_err(|_| format!("the import printed `{}`", run.stdout))
    };
    Ok(median((0..IMPORTS).map(|_| time_ms()).collect::<Result<_, String>>()?))
}

/// Tests of the package, with the program beside which its answers are compared.
fn tests(python: &Path, which: &str) -> Result<(), String> {
    let program = target().join("release/breakshot").canonicalize().map_err(|e| e.to_string())?;
    let python = python.parent().and_then(|bin| bin.canonicalize().ok()).map(|bin| bin.join("python"));
    let python = python.ok_or("the interpreter of the environment is not there")?;
    println!("xtask: pytest {PACKAGE}/{which}");
    let status = Command::new(python)
        .args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider", which])
        .current_dir(PACKAGE)
        .env("BREAKSHOT_PROGRAM", program)
        .status()
        .map_err(|e| format!("pytest cannot be started ({e})"))?;
    if status.success() { Ok(()) } else { Err(format!("pytest failed ({status})")) }
}

/// The declared types against the module, and the types of the package and of the examples.
fn types(python: &Path) -> Result<(), String> {
    let run = |arguments: &[&str]| {
        println!("xtask: python -m {}", arguments.join(" "));
        let status = Command::new(python).arg("-m").args(arguments).status().map_err(|e| e.to_string())?;
        if status.success() { Ok(()) } else { Err(format!("python -m {} failed", arguments.join(" "))) }
    };
    run(&["mypy.stubtest", "breakshot"])?;
    run(&["mypy", "--strict", "--package", "breakshot"])?;
    run(&["mypy", "--strict", &format!("{PACKAGE}/examples")])
}
