//! What a fresh build costs: `cargo xtask bench build [OTHER]`.

use super::BUILDS;
use crate::process::children_cpu_s;
use crate::validate::row::{self, Row, median};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Builds this project, and another checkout of it alternately, from an empty target folder with the crates already fetched.
pub(crate) fn bench(other: Option<&Path>) -> Result<(), String> {
    let own = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let folders: Vec<&Path> = std::iter::once(own.as_path()).chain(other).collect();
    for folder in &folders {
        cargo(folder, &["fetch", "--locked"], None)?;
    }
    let mut cpu_s = vec![Vec::new(); folders.len()];
    for _ in 0..BUILDS {
        for (folder, times) in folders.iter().zip(&mut cpu_s) {
            times.push(fresh_build_cpu_s(folder)?);
        }
    }
    let times: Vec<f64> = cpu_s.into_iter().map(median).collect();
    let mut rows = vec![Row::plain("this project, CPU time", times[0], "s")];
    if let Some(other) = times.get(1) {
        rows.push(Row::plain("the other checkout, CPU time", *other, "s"));
        rows.push(Row::plain("ratio", times[0] / other, ""));
    }
    row::print_all(&format!("A fresh `cargo build --release`, medians of {BUILDS}"), &rows);
    Ok(())
}

/// User and system time of all processes of one build (s).
fn fresh_build_cpu_s(folder: &Path) -> Result<f64, String> {
    let target = tempfile::tempdir().map_err(|e| e.to_string())?;
    let before_s = children_cpu_s()?;
    cargo(folder, &["build", "--release", "--locked", "--offline", "--quiet"], Some(target.path()))?;
    Ok(children_cpu_s()? - before_s)
}

fn cargo(folder: &Path, arguments: &[&str], target: Option<&Path>) -> Result<(), String> {
    let mut command = Command::new("cargo");
    command.args(arguments).current_dir(folder).stdin(Stdio::null());
    if let Some(target) = target {
        command.env("CARGO_TARGET_DIR", target);
    }
    let status = command.status().map_err(|e| format!("cargo cannot be started ({e})"))?;
    if status.success() {
        return Ok(());
    }
    Err(format!("`cargo {}` failed in {} ({status})", arguments.join(" "), folder.display()))
}
