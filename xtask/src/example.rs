//! The example `scenes` as a program: built, run, its lines read.

use crate::process;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A build of the example.
pub(crate) struct Scenes {
    binary: PathBuf,
}

/// What a run of it, or of a peer with the same output, printed.
pub(crate) struct Answer {
    pub(crate) rollouts_per_cpu_s: f64,
    pub(crate) impacts_per_rollout: f64,
    pub(crate) hash: Option<String>,
    pub(crate) peak_memory_mb: f64,
}

/// Final positions (m): of each scene by name, object after object.
pub(crate) type Finals = BTreeMap<String, Vec<[f64; 2]>>;

/// Where cargo builds.
pub(crate) fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| "target".into(), PathBuf::from)
}

impl Scenes {
    /// Builds it.
    pub(crate) fn build(release: bool) -> Result<Self, String> {
        let mut arguments = vec!["build", "--package", "breakshot", "--example", "scenes"];
        if release {
            arguments.push("--release");
        }
        crate::check::cargo(&arguments, &[])?;
        let profile = if release { "release" } else { "debug" };
        Ok(Self { binary: target().join(profile).join("examples/scenes") })
    }

    /// Runs it on a file.
    pub(crate) fn run(&self, file: &Path, flags: &[&str], threads: usize) -> Result<Answer, String> {
        let mut command = Command::new(&self.binary);
        command.arg(file).args(flags).env("RAYON_NUM_THREADS", threads.to_string());
        answer(&mut command)
    }

    /// The final positions of all scenes of a file.
    pub(crate) fn finals(&self, file: &Path, flags: &[&str]) -> Result<Finals, String> {
        let csv = tempfile::NamedTempFile::new().map_err(|e| e.to_string())?;
        let path = csv.path().to_string_lossy().into_owned();
        self.run(file, &[flags, &["--final", &path]].concat(), 1)?;
        finals(csv.path())
    }
}

/// Runs a program that prints the example's line.
pub(crate) fn answer(command: &mut Command) -> Result<Answer, String> {
    let run = process::run(command)?;
    if run.code != 0 {
        return Err(format!("{} ended with {}", command.get_program().to_string_lossy(), run.code));
    }
    let word = |key: &str| {
        let mut words = run.stdout.split_whitespace();
        words.find_map(|word| word.strip_prefix(key)?.strip_prefix('=').map(str::to_owned))
    };
    let number = |key: &str| word(key).and_then(|w| w.parse().ok()).unwrap_or(f64::NAN);
    Ok(Answer {
        rollouts_per_cpu_s: number("rollouts_per_cpu_s"),
        impacts_per_rollout: number("impacts_per_rollout"),
        hash: word("hash"),
        peak_memory_mb: run.peak_memory_mb.unwrap_or(f64::NAN),
    })
}

/// Reads `scene,object,x_m,y_m,yaw_rad`.
pub(crate) fn finals(csv: &Path) -> Result<Finals, String> {
    let text = std::fs::read_to_string(csv).map_err(|e| format!("{}: {e}", csv.display()))?;
    let mut finals = Finals::new();
    for line in text.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |k: usize| fields.get(k).and_then(|f| f.parse().ok()).unwrap_or(f64::NAN);
        finals.entry(fields[0].into()).or_default().push([number(2), number(3)]);
    }
    Ok(finals)
}

/// For each scene of both, the largest distance between the two final positions of an object (mm).
pub(crate) fn apart_mm(one: &Finals, other: &Finals) -> Vec<f64> {
    let worst = |a: &[[f64; 2]], b: &[[f64; 2]]| {
        a.iter().zip(b).map(|(p, q)| 1e3 * (p[0] - q[0]).hypot(p[1] - q[1])).fold(0.0, f64::max)
    };
    one.iter().filter_map(|(name, a)| Some(worst(a, other.get(name)?))).collect()
}
