//! A Python of our own with the packages that a peer needs, made once in the target folder.

use crate::example::target;
use std::path::PathBuf;
use std::process::Command;

/// What the lab's scripts import.
pub(crate) const LAB: [&str; 3] = ["mujoco==4.0.0", "numpy", "opencv-python-headless==5.0.0.93"];

/// The given interpreter, or that of an environment with these packages.
///
/// # Errors
/// As [`python`].
pub(crate) fn given_or(given: Option<&str>, name: &str, packages: &[&str]) -> Result<PathBuf, String> {
    given.map_or_else(|| python(name, packages), |given| Ok(given.into()))
}

/// The interpreter of an environment that holds these packages (as `pip` writes them).
///
/// # Errors
/// No `python3`, or a package that cannot be installed.
pub(crate) fn python(name: &str, packages: &[&str]) -> Result<PathBuf, String> {
    python_of("python3", name, packages)
}

/// As [`python`], of a given interpreter.
///
/// # Errors
/// As [`python`].
pub(crate) fn python_of(interpreter: &str, name: &str, packages: &[&str]) -> Result<PathBuf, String> {
    let own = if interpreter == "python3" {
        name.to_owned()
    } else {
        format!("{name}-{}", interpreter.replace('/', "_"))
    };
    let folder = target().join("python").join(own);
    let python = folder.join("bin/python");
    let complete = folder.join("complete");
    let wanted = packages.join("\n");
    if std::fs::read_to_string(&complete).is_ok_and(|made| made == wanted) {
        return Ok(python);
    }
    succeed(Command::new(interpreter).args(["-m", "venv"]).arg(&folder))?;
    succeed(Command::new(&python).args(["-m", "pip", "install", "--quiet"]).args(packages))?;
    std::fs::write(&complete, wanted).map_err(|e| format!("{}: {e}", complete.display()))?;
    Ok(python)
}

pub(crate) fn succeed(command: &mut Command) -> Result<(), String> {
    let run = crate::process::run(command)?;
    if run.code == 0 { Ok(()) } else { Err(format!("{command:?} ended with {}", run.code)) }
}
