//! The program killed at random moments: its outputs are whole or absent, and the next run gives the same bytes.

use super::row;
use crate::splitmix::Draw;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Default number of kills.
pub(crate) const KILLS: usize = 200;
/// The moments are drawn from this part of the time that a run takes.
const OF_THE_RUN: f64 = 1.05;

/// A command that is killed: its name and its words; `OUT` is the folder of its outputs, `IN` that of what others wrote.
const COMMANDS: [(&str, &[&str]); 5] = [
    (
        "estimate",
        &["estimate", "FIXTURES/campaign.toml", "-o", "OUT/properties.json", "--tracks", "OUT/tracks"],
    ),
    (
        "plan",
        &[
            "plan",
            "FIXTURES/pile.scene.toml",
            "--properties",
            "IN/properties.json",
            "--any-arm",
            "-o",
            "OUT/plan.json",
        ],
    ),
    (
        "run",
        &[
            "run",
            "FIXTURES/pile.scene.toml",
            "--properties",
            "IN/properties.json",
            "--any-arm",
            "-o",
            "OUT/run",
        ],
    ),
    (
        "verify",
        &[
            "verify",
            "FIXTURES/pile.scene.toml",
            "FIXTURES/pile.mp4",
            "--properties",
            "IN/properties.json",
            "--strike",
            "FIXTURES/pile.strike.json",
            "-o",
            "OUT/report",
        ],
    ),
    ("demo", &["demo", "-o", "OUT/demo"]),
];

/// The files of a folder, by their paths in it.
type Files = BTreeMap<PathBuf, Vec<u8>>;

/// What was found after the kills of one command.
#[derive(Default)]
struct Found {
    kills: usize,
    /// Kills that came before the program's own end.
    killed: usize,
    whole: usize,
    /// Files that are neither whole nor absent, or that no run leaves behind.
    broken: usize,
    /// Next runs with another exit code or other bytes.
    different: usize,
}

/// Kills each command that many times in all, and prints the table.
pub(crate) fn run(kills: usize) -> Result<(), String> {
    crate::check::cargo(&["build", "--package", "breakshot-cli"], &[])?;
    let binary = crate::example::target().join("debug/breakshot");
    let binary = binary.canonicalize().map_err(|e| format!("{}: {e}", binary.display()))?;
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let inputs = folder.path().join("in");
    let mut draw = Draw::new(5);
    let mut all = Vec::new();
    for (k, (name, words)) in COMMANDS.iter().enumerate() {
        let each = kills / COMMANDS.len() + usize::from(k < kills % COMMANDS.len());
        let outputs = |name: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(&path).map(|()| path).map_err(|e| e.to_string())
        };
        // The first command writes what the others read.
        let out = if k == 0 { outputs("in")? } else { outputs(&format!("{name}_whole"))? };
        let command = |out: &Path| command(&binary, words, out, &inputs);
        let begun = Instant::now();
        let code = command(&out).status().map_err(|e| e.to_string())?.code();
        let lasts = begun.elapsed();
        if !matches!(code, Some(0 | 3)) {
            return Err(format!("`breakshot {name}` ended with {code:?}"));
        }
        let whole = files(&out)?;
        let mut found = Found::default();
        for kill in 0..each {
            let out = outputs(&format!("{name}_{kill}"))?;
            let after = lasts.mul_f64(draw.between(0.0, OF_THE_RUN));
            found.add(&whole, &out, after, &command)?;
            let again = command(&out).status().map_err(|e| e.to_string())?.code();
            found.different += usize::from(again != code || files(&out)? != whole);
            std::fs::remove_dir_all(&out).map_err(|e| e.to_string())?;
        }
        all.push((*name, lasts, found));
    }
    row::require(print(&all))
}

fn command(binary: &Path, words: &[&str], out: &Path, inputs: &Path) -> Command {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/demo");
    let placed = |word: &&str| {
        [("FIXTURES", fixtures.as_path()), ("OUT", out), ("IN", inputs)].iter().fold(
            (*word).to_owned(),
            |word, (name, path)| match word.strip_prefix(name) {
                Some(rest) if rest.starts_with('/') => format!("{}{rest}", path.display()),
                _ => word,
            },
        )
    };
    let mut command = Command::new(binary);
    // In one folder, so that no path differs between the runs.
    command.args(words.iter().map(placed)).current_dir(out).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

impl Found {
    /// Runs the command, kills it, and looks at what it left.
    fn add(
        &mut self,
        whole: &Files,
        out: &Path,
        after: Duration,
        command: &dyn Fn(&Path) -> Command,
    ) -> Result<(), String> {
        let mut child = command(out).spawn().map_err(|e| e.to_string())?;
        std::thread::sleep(after);
        let ended = child.try_wait().map_err(|e| e.to_string())?.is_some();
        if !ended {
            child.kill().map_err(|e| e.to_string())?;
            child.wait().map_err(|e| e.to_string())?;
        }
        self.kills += 1;
        self.killed += usize::from(!ended);
        for (path, bytes) in files(out)? {
            let is_whole = whole.get(&path) == Some(&bytes);
            self.whole += usize::from(is_whole);
            if !is_whole {
                println!(
                    "BROKEN: {} of {} bytes after {:.3} s",
                    path.display(),
                    bytes.len(),
                    after.as_secs_f64()
                );
            }
            self.broken += usize::from(!is_whole);
        }
        Ok(())
    }
}

fn files(folder: &Path) -> Result<Files, String> {
    let (mut found, mut folders) = (Files::new(), vec![folder.to_owned()]);
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(&next).map_err(|e| e.to_string())? {
            let path = entry.map_err(|e| e.to_string())?.path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let bytes = std::fs::read(&path).map_err(|e| e.to_string())?;
            let within = path.strip_prefix(folder).unwrap_or(&path).to_owned();
            found.insert(within, bytes);
        }
    }
    Ok(found)
}

fn print(all: &[(&str, Duration, Found)]) -> bool {
    println!(
        "\n| command | a run (s) | kills | before its end | whole files | broken or left over | next run differs |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (name, lasts, found) in all {
        let Found { kills, killed, whole, broken, different } = found;
        println!(
            "| `{name}` | {:.1} | {kills} | {killed} | {whole} | {broken} | {different} |",
            lasts.as_secs_f64()
        );
    }
    all.iter().all(|(_, _, found)| found.broken + found.different == 0)
}
