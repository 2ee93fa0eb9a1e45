//! Builds the Python package and checks it: `cargo xtask python [--wheel FILE] [PYTHON..]`, or `--quick`.
//!
//! One wheel is installed with NumPy alone for each interpreter, its size and the time of its import are measured, its tests run, and its
//! declared types are compared with what is there.  The examples for many machines run on a cluster of several nodes of this machine, one
//! of which is killed.  `cargo xtask python --quick` runs the quick part of it on the debug build.

use crate::check::cargo;
use crate::example::target;
use crate::process::timed;
use crate::validate::row::{self, Row, median};
use crate::venv;
use std::path::{Path, PathBuf};
use std::process::Command;

const PACKAGE: &str = "crates/breakshot-py";
const MOST_MEGABYTES: f64 = 8.0;
/// Longest import (ms of CPU time): of the package by itself, which loads NumPy when rollouts are first asked for.
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

/// The oldest versions that the package supports; the NumPy is not built for later versions of Python.
const OLDEST: [&str; 3] = ["numpy==1.26.0", "gymnasium==1.1.0", "pytest==9.2.0"];
const LAST_PYTHON_OF_OLDEST: (u32, u32) = (3, 12);
const OLDEST_TESTS: [&str; 2] = ["tests/test_gym.py", "tests/test_rollouts.py"];
/// Calls with random arguments: of the whole check, and of the quick one.
const WHOLE: (&str, &str) = ("BREAKSHOT_RANDOM_CALLS", "100000");
const QUICK: (&str, &str) = ("BREAKSHOT_RANDOM_CALLS", "3000");
/// Rollouts whose memory is measured, with the first interpreter alone.
const MANY: (&str, &str) = ("BREAKSHOT_ROLLOUTS", "10000000");
const MEMORY_TEST: &str = "tests/test_memory.py";
/// Tests of the quick check: those whose time the debug build hardly lengthens, and none that measures time.
const QUICK_TESTS: [&str; 5] = [
    "tests/test_conformance.py",
    "tests/test_values.py",
    "tests/test_rollouts.py",
    "tests/test_gym.py",
    "tests/test_random_calls.py",
];

/// What executes the notebook.
const NOTEBOOK: [&str; 4] = ["numpy", "pytest==9.2.0", "nbclient==0.11.0", "ipykernel==7.4.0"];
const NOTEBOOK_TEST: &str = "tests/test_notebook.py";

/// Builds the wheel, or takes the one given, and checks it with some interpreters.
pub(crate) fn python(words: &[&str]) -> Result<(), String> {
    let (given, interpreters) = match words {
        ["--wheel", file, rest @ ..] => (Some(PathBuf::from(file)), rest),
        rest => (None, rest),
    };
    let interpreters = if interpreters.is_empty() { &["python3"] } else { interpreters };
    cargo(&["build", "--release", "--package", "breakshot-cli"], &[])?;
    let wheel = given.map_or_else(|| wheel(interpreters[0]), Ok)?;
    let megabytes = std::fs::metadata(&wheel).map_err(|e| e.to_string())?.len() as f64 * 1e-6;
    let mut rows = vec![Row::at_most("size of the wheel", megabytes, MOST_MEGABYTES, "MB")];
    for interpreter in interpreters {
        rows.push(checked(interpreter, &wheel)?);
    }
    let suite = Suite::release(&installed(interpreters[0], "breakshot-notebook", &NOTEBOOK, &wheel)?)?;
    suite.run(&[NOTEBOOK_TEST])?;
    suite.with(MANY).run(&[MEMORY_TEST])?;
    let suite = Suite::release(&installed(interpreters[0], "breakshot-cluster", &CLUSTER, &wheel)?)?;
    suite.run(&[CLUSTER_TEST])?;
    row::require(row::print_all("The Python package", &rows))
}

/// Checks the wheel with one interpreter; the result is the time of its import.
fn checked(interpreter: &str, wheel: &Path) -> Result<Row, String> {
    let version = version(interpreter)?;
    let label = format!("{}.{}", version.0, version.1);
    println!("xtask: the wheel with Python {label} ({interpreter})");
    let import_ms = import_with_numpy_alone(interpreter, wheel)?;
    let checkers = installed(interpreter, "breakshot-checks", &CHECKERS, wheel)?;
    // Without Ray and a notebook's kernel, whose tests skip themselves.
    Suite::release(&checkers)?.run(&["tests"])?;
    types(&checkers, None)?;
    if version <= LAST_PYTHON_OF_OLDEST {
        let oldest = installed(interpreter, "breakshot-oldest", &OLDEST, wheel)?;
        Suite::release(&oldest)?.run(&OLDEST_TESTS)?;
    } else {
        println!(
            "xtask: SKIPPED the oldest NumPy and Gymnasium: {} is not built for Python {label}",
            OLDEST[0]
        );
    }
    let what = format!("CPU time of the import with Python {label}, median of {IMPORTS}");
    Ok(Row::at_most(what, import_ms, MOST_IMPORT_MS, "ms"))
}

/// The quick part of the check: the debug build beside the package's files, its tests without those that
/// take or measure time, and its types.
///
/// Prints that it is skipped where there is no Python, or where the packages of the tests can neither be found nor installed.
pub(crate) fn quick() -> Result<(), String> {
    timed("the Python package: ", quickly)
}

fn quickly() -> Result<(), String> {
    let python = match venv::python("breakshot-checks", &CHECKERS) {
        Ok(python) => python,
        Err(reason) => {
            println!("xtask: SKIPPED the Python package: its tests need {} ({reason})", CHECKERS.join(", "));
            return Ok(());
        }
    };
    // With all tests of the workspace, which `cargo xtask test` runs: a package by itself, or the workspace without its tests,
    // has other features, and would be compiled again.
    cargo(&["build", "--workspace", "--lib", "--tests"], &[])?;
    let package = debug_package()?;
    let program = target().join("debug/breakshot");
    let suite = Suite { python, program, package: Some(package), settings: vec![QUICK] };
    suite.run(&QUICK_TESTS)?;
    types(&suite.python, suite.package.as_deref())
}

/// A folder that holds the package with the module of the debug build, for Python's path.
fn debug_package() -> Result<PathBuf, String> {
    let folder = target().join("python/debug");
    let failed = |e: std::io::Error| format!("{}: {e}", folder.display());
    if folder.exists() {
        std::fs::remove_dir_all(&folder).map_err(failed)?;
    }
    let mut folders = vec![PathBuf::from("breakshot")];
    while let Some(part) = folders.pop() {
        std::fs::create_dir_all(folder.join(&part)).map_err(failed)?;
        for entry in std::fs::read_dir(Path::new(PACKAGE).join("python").join(&part)).map_err(failed)? {
            let from = entry.map_err(failed)?.path();
            let Some(name) = from.file_name() else { continue };
            if from.is_dir() {
                folders.push(part.join(name));
            } else {
                std::fs::copy(&from, folder.join(&part).join(name)).map_err(failed)?;
            }
        }
    }
    let module = target().join("debug/lib_breakshot.so");
    std::fs::copy(&module, folder.join("breakshot/_breakshot.abi3.so"))
        .map_err(|e| format!("{}: {e}", module.display()))?;
    std::path::absolute(folder).map_err(|e| e.to_string())
}

/// The version of an interpreter, as `(3, 11)`.
fn version(interpreter: &str) -> Result<(u32, u32), String> {
    const PRINT: &str = "import sys; print(*sys.version_info[:2])";
    let run = crate::process::run(Command::new(interpreter).args(["-c", PRINT]))?;
    let mut numbers = run.stdout.split_whitespace().map(str::parse);
    match (numbers.next(), numbers.next()) {
        (Some(Ok(major)), Some(Ok(minor))) => Ok((major, minor)),
        _ => Err(format!("{interpreter} printed `{}`; needed: the version of a Python", run.stdout.trim())),
    }
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

/// The CPU time of an import (ms) in an environment that has nothing but NumPy, after a simulator has worked there.
fn import_with_numpy_alone(interpreter: &str, wheel: &Path) -> Result<f64, String> {
    const SIMULATOR: &str = "import breakshot; breakshot.Simulator()";
    const IMPORT: &str = "import time; start = time.process_time(); import breakshot; print(1e3 * (time.process_time() - start))";
    let python = installed(interpreter, "breakshot-alone", &["numpy"], wheel)?;
    venv::succeed(Command::new(&python).args(["-c", SIMULATOR]))?;
    let time_ms = || {
        let run = crate::process::run(Command::new(&python).args(["-c", IMPORT]))?;
        run.stdout.trim().parse::<f64>().map_err(|_| format!("the import printed `{}`", run.stdout))
    };
    Ok(median((0..IMPORTS).map(|_| time_ms()).collect::<Result<_, String>>()?))
}

/// The tests of the package, with an interpreter, and the program beside which the package's answers are compared.
struct Suite {
    python: PathBuf,
    program: PathBuf,
    /// The folder of the package if it is not installed.
    package: Option<PathBuf>,
    /// Variables of the environment by which the tests take more or less time.
    settings: Vec<(&'static str, &'static str)>,
}

impl Suite {
    /// All tests, of the installed wheel.
    fn release(python: &Path) -> Result<Self, String> {
        let python = std::path::absolute(python).map_err(|e| e.to_string())?;
        Ok(Self { python, program: target().join("release/breakshot"), package: None, settings: vec![WHOLE] })
    }

    /// The same with one more setting.
    fn with(mut self, setting: (&'static str, &'static str)) -> Self {
        self.settings.push(setting);
        self
    }

    /// Runs the tests of some files or folders.
    fn run(&self, which: &[&str]) -> Result<(), String> {
        println!("xtask: pytest {} (in {PACKAGE})", which.join(" "));
        let absolute = |path: &Path| std::path::absolute(path).map_err(|e| e.to_string());
        let mut command = Command::new(absolute(&self.python)?);
        command.args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider"]).args(which);
        command.current_dir(PACKAGE).env("BREAKSHOT_PROGRAM", absolute(&self.program)?);
        command.envs(self.settings.iter().copied());
        if let Some(package) = &self.package {
            command.env("PYTHONPATH", package);
        }
        let status = command.status().map_err(|e| format!("pytest cannot be started ({e})"))?;
        if status.success() { Ok(()) } else { Err(format!("pytest failed ({status})")) }
    }
}

/// The declared types against the module, and the types of the package and of the examples.
fn types(python: &Path, package: Option<&Path>) -> Result<(), String> {
    let run = |arguments: &[&str]| {
        println!("xtask: python -m {}", arguments.join(" "));
        let mut command = Command::new(python);
        command.arg("-m").args(arguments);
        if let Some(package) = package {
            command.env("PYTHONPATH", package).env("MYPYPATH", package);
        }
        let status = command.status().map_err(|e| e.to_string())?;
        if status.success() { Ok(()) } else { Err(format!("python -m {} failed", arguments.join(" "))) }
    };
    run(&["mypy.stubtest", "breakshot"])?;
    run(&["mypy", "--strict", "--package", "breakshot"])?;
    run(&["mypy", "--strict", &format!("{PACKAGE}/examples")])
}
