//! The arm compared with other programs: `cargo xtask validate robot`.
//!
//! Kinematics and dynamics against pinocchio's, strike paths in MuJoCo, the driver against a mock controller, the mock against the
//! vendor's own client.  The Python packages are installed into environments of their own.

mod arms;
mod impulse;
mod paths;
mod wire;

use breakshot::cell::{RobotSpec, Transform};
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs all comparisons of the arm, or the part named.
pub(crate) fn run(shared: &Path, part: Option<&str>) -> Result<bool, String> {
    let mut all_hold = true;
    let is_wanted = |name: &str| part.is_none_or(|part| part == name);
    if is_wanted("arms") {
        all_hold &= arms::run(&shared.join("reference/indy7"))?;
    }
    if is_wanted("impulse") {
        all_hold &= impulse::run(&shared.join("reference/indy7"))?;
    }
    if is_wanted("paths") {
        all_hold &= paths::run(&shared.join("lab/scatter"))?;
    }
    if is_wanted("wire") {
        all_hold &= wire::run()?;
    }
    Ok(all_hold)
}

/// An Indy 7 with the table's middle `ahead_m` in front of its base, the table turned by `yaw_rad`.
pub(crate) fn indy7([ahead_m, yaw_rad]: [f64; 2]) -> RobotSpec {
    RobotSpec {
        arm: "indy7".into(),
        base_from_table: Some(Transform { position_m: [ahead_m, 0.0, 0.0], rpy_rad: [0.0, 0.0, yaw_rad] }),
        tool_offset_m: [0.0, 0.0, 0.15],
        tool_mass_kg: 0.3,
        ..RobotSpec::default()
    }
}

/// A temporary file with this text, deleted when dropped.
fn temporary(text: &str, ending: &str) -> Result<tempfile::NamedTempFile, String> {
    let file = tempfile::Builder::new().suffix(ending).tempfile().map_err(|e| e.to_string())?;
    std::fs::write(file.path(), text).map_err(|e| e.to_string())?;
    Ok(file)
}

/// Runs a script and reads the JSON lines that it prints.
fn lines<T: DeserializeOwned>(python: &Path, script: &str, arguments: &[&Path]) -> Result<Vec<T>, String> {
    let script = PathBuf::from("xtask/peers").join(script);
    let run = crate::process::run(Command::new(python).arg(&script).args(arguments))?;
    if run.code != 0 {
        return Err(format!("{} ended with {}", script.display(), run.code));
    }
    let parsed = run.stdout.lines().map(serde_json::from_str).collect::<Result<Vec<T>, _>>();
    parsed.map_err(|e| format!("{}: {e}", script.display()))
}
