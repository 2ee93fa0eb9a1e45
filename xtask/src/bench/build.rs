//! What a fresh build costs: `cargo xtask bench build [OTHER]`.

use super::BUILDS;
use crate::check::cargo;
use crate::process::children_cpu_s;
use crate::validate::row::{self, Row, median};
use std::path::Path;

/// Builds this project, and another checkout of it alternately, from an empty target folder with the crates already fetched.
pub(crate) fn bench(other: Option<&Path>) -> Result<(), String> {
    let own = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let manifest = |folder: &Path| folder.join("Cargo.toml").display().to_string();
    let manifests: Vec<String> = std::iter::once(own).chain(other).map(manifest).collect();
    for manifest in &manifests {
        cargo(&["fetch", "--locked", "--manifest-path", manifest], &[])?;
    }
    let mut cpu_s = vec![Vec::new(); manifests.len()];
    for _ in 0..BUILDS {
        for (manifest, times) in manifests.iter().zip(&mut cpu_s) {
            times.push(fresh_build_cpu_s(manifest)?);
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
fn fresh_build_cpu_s(manifest: &str) -> Result<f64, String> {
    let target = tempfile::tempdir().map_err(|e| e.to_string())?;
    let arguments = ["build", "--release", "--locked", "--offline", "--quiet", "--manifest-path", manifest];
    let before_s = children_cpu_s()?;
    cargo(&arguments, &[("CARGO_TARGET_DIR", &target.path().to_string_lossy())])?;
    Ok(children_cpu_s()? - before_s)
}
