//! Runs targets under libFuzzer: inputs that reach new edges are kept and mutated further.
//!
//! The stable compiler inserts the counters (`-C passes=sancov-module`, as `cargo fuzz` does); a sanitizer of addresses would need the nightly
//! one. The corpus stays in `target/fuzz/corpus`, so that each run continues the last one.

use crate::FOUND;
use breakshot_fuzz::Target;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Counters on all edges, and of the values that are compared.
const FLAGS: [&str; 6] = [
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "--cfg=fuzzing",
];
/// Where the corpora, the logs and the programs are.
const FOLDER: &str = "target/fuzz";
/// Largest size of an input (bytes).
const MOST_BYTES: usize = 1 << 16;
/// Largest memory of a whole program (MB): a reader that needs more than its target allows is found before.
const MOST_MEMORY_MB: usize = 2048;

/// What a run of a target found.
#[derive(Debug, Default, PartialEq)]
struct Found {
    executions: u64,
    /// Edges of the program that inputs have reached.
    edges: u64,
    /// Edges of the program.
    edges_in_all: u64,
    inputs_kept: u64,
    longest_s: f64,
    memory_mb: f64,
    /// The input that ended the run.
    crash: Option<PathBuf>,
}

/// Builds the programs of these targets, runs each for so many seconds, and prints a table.
pub(crate) fn run(targets: &[Target], seconds: u64) -> Result<(), String> {
    let programs = built(targets)?;
    let mut crashes = Vec::new();
    println!(
        "| target | what is read | executions | edges reached | edges in the program | inputs kept | longest (s) | memory of an input (MB) | crashes |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for target in targets {
        let found = fuzzed(target, &programs, seconds)?;
        let crash = found.crash.as_ref().map_or("0".into(), |file| format!("`{}`", file.display()));
        println!(
            "| {} | {} | {} | {} | {} | {} | {:.2} | {:.1} | {crash} |",
            target.name,
            target.what,
            found.executions,
            found.edges,
            found.edges_in_all,
            found.inputs_kept,
            found.longest_s,
            found.memory_mb
        );
        crashes.extend(found.crash);
    }
    match &crashes[..] {
        [] => Ok(()),
        crashes => {
            let names: Vec<_> = crashes.iter().map(|file| file.display().to_string()).collect();
            Err(format!(
                "{} (`cargo xtask fuzz repeat TARGET FILE`; logs in {FOLDER}/logs)",
                names.join(", ")
            ))
        }
    }
}

/// Builds the programs with counters, and gives their folder.
fn built(targets: &[Target]) -> Result<PathBuf, String> {
    let version =
        Command::new("rustc").arg("-vV").output().map_err(|e| format!("rustc cannot be started ({e})"))?;
    let version = String::from_utf8_lossy(&version.stdout).into_owned();
    let host =
        version.lines().find_map(|line| line.strip_prefix("host: ")).ok_or("`rustc -vV` names no host")?;
    let folder = format!("{FOLDER}/programs");
    let mut cargo = Command::new("cargo");
    // With a target named, build scripts and macros have no counters.
    cargo.args(["build", "--package", "breakshot-fuzz", "--features", "guided", "--profile", "fuzz"]);
    cargo.args(["--target", host, "--target-dir", &folder]).env("RUSTFLAGS", FLAGS.join(" "));
    for target in targets {
        cargo.args(["--bin", target.name]);
    }
    let status = cargo.status().map_err(|e| format!("cargo cannot be started ({e})"))?;
    if status.success() {
        Ok(Path::new(&folder).join(host).join("fuzz"))
    } else {
        Err("the programs cannot be built".into())
    }
}

/// Runs one target.
fn fuzzed(target: &Target, programs: &Path, seconds: u64) -> Result<Found, String> {
    let failed = |path: &Path| {
        let path = path.display().to_string();
        move |e: std::io::Error| format!("{path}: {e}")
    };
    let folder = |kind: &str| -> Result<PathBuf, String> {
        let path = Path::new(FOLDER).join(kind);
        std::fs::create_dir_all(&path).map_err(failed(&path))?;
        Ok(path)
    };
    let (corpus, seeds) =
        (folder(&format!("corpus/{}", target.name))?, folder(&format!("seeds/{}", target.name))?);
    for (k, seed) in (target.seeds)().iter().enumerate() {
        let path = seeds.join(k.to_string());
        std::fs::write(&path, seed).map_err(failed(&path))?;
    }
    let (logs, kept) = (folder("logs")?, folder("found")?);
    debug_assert_eq!(kept, Path::new(FOUND), "one folder for what was found");
    let (log, costs, words) = (
        logs.join(target.name),
        logs.join(format!("{}.costs", target.name)),
        logs.join(format!("{}.words", target.name)),
    );
    std::fs::write(&words, dictionary(target.pieces)).map_err(failed(&words))?;
    std::fs::write(&costs, "0 0\n").map_err(failed(&costs))?;
    let scratch =
        tempfile::Builder::new().prefix("breakshot-fuzz-").tempdir_in(memory()).map_err(|e| e.to_string())?;
    let prefix = kept.join(format!("{}-", target.name));
    let started = std::time::SystemTime::now();
    let mut command = Command::new(programs.join(target.name));
    command.arg(&corpus).arg(&seeds).args([
        format!("-max_total_time={seconds}"),
        format!("-timeout={}", target.longest_s.ceil()),
        format!("-max_len={MOST_BYTES}"),
        format!("-rss_limit_mb={MOST_MEMORY_MB}"),
        format!("-dict={}", words.display()),
        format!("-artifact_prefix={}", prefix.display()),
        "-print_final_stats=1".into(),
        "-reload=0".into(),
    ]);
    command.env("BREAKSHOT_FUZZ_COSTS", &costs).env("BREAKSHOT_FUZZ_FOLDER", scratch.path());
    let output = File::create(&log).map_err(failed(&log))?;
    let status = command.stdout(Stdio::null()).stderr(output).status();
    let status = status.map_err(|e| format!("{}: cannot be started ({e})", target.name))?;
    let text = std::fs::read(&log).map_err(failed(&log))?;
    let mut found =
        Found::of(&String::from_utf8_lossy(&text), &std::fs::read_to_string(&costs).unwrap_or_default());
    if !status.success() {
        let since = |file: &PathBuf| {
            file.metadata().and_then(|data| data.modified()).is_ok_and(|time| time >= started)
        };
        let entries =
            std::fs::read_dir(&kept).map_err(failed(&kept))?.filter_map(|entry| Some(entry.ok()?.path()));
        let own = |file: &PathBuf| file.to_string_lossy().starts_with(&*prefix.to_string_lossy());
        found.crash = Some(entries.filter(own).find(since).unwrap_or(log));
    }
    Ok(found)
}

/// A folder for files in memory, where the system has one.
fn memory() -> PathBuf {
    let memory = Path::new("/dev/shm");
    if memory.is_dir() { memory.into() } else { std::env::temp_dir() }
}

/// The pieces of a format as a dictionary of libFuzzer.
fn dictionary(pieces: &[&[&str]]) -> String {
    let escaped =
        |piece: &&str| piece.bytes().map(|byte| format!("\\x{byte:02x}")).collect::<Vec<_>>().concat();
    let lines = pieces.iter().copied().flatten().map(|piece| format!("\"{}\"\n", escaped(piece)));
    lines.collect::<Vec<_>>().concat()
}

impl Found {
    /// The numbers in a log of libFuzzer, and in the file of the costs.
    fn of(log: &str, costs: &str) -> Self {
        let after = |line: &str, key: &str| -> Option<u64> {
            let rest = line.split_once(key)?.1.trim_start();
            rest[..rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len())].parse().ok()
        };
        let last = |key: &str| log.lines().rev().find_map(|line| after(line, key)).unwrap_or(0);
        let edges_in_all = log.lines().find_map(|line| {
            let (_, counters) = line.split_once(" modules ")?;
            after(counters, "(")
        });
        // The number of executions stands at the start of each line of progress, and in the statistics at the end.
        let progress = log.lines().rev().find_map(|line| after(line.strip_prefix('#')?, ""));
        let mut costs = costs.split_whitespace().map(|number| number.parse().unwrap_or(f64::NAN));
        Self {
            executions: last("stat::number_of_executed_units:").max(progress.unwrap_or(0)),
            edges: last(" cov: "),
            edges_in_all: edges_in_all.unwrap_or(0),
            inputs_kept: last(" corp: "),
            longest_s: costs.next().unwrap_or(f64::NAN),
            memory_mb: costs.next().unwrap_or(f64::NAN),
            crash: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_of_libfuzzer_is_read() {
        let log = "INFO: Loaded 1 modules   (33195 inline 8-bit counters): 33195 [0x5, 0x6), \n\
                   #2\tINITED cov: 100 ft: 110 corp: 1/3b exec/s: 0 rss: 40Mb\n\
                   #4096\tpulse  cov: 1202 ft: 3000 corp: 45/2kb lim: 60 exec/s: 2048 rss: 60Mb\n\
                   stat::number_of_executed_units: 5000\nstat::peak_rss_mb: 61\n";
        let wanted = Found {
            executions: 5000,
            edges: 1202,
            edges_in_all: 33195,
            inputs_kept: 45,
            longest_s: 0.25,
            memory_mb: 3.5,
            crash: None,
        };
        assert_eq!(Found::of(log, "0.25 3.5\n"), wanted);
        let broken_off = log.split("stat::").next().expect("a part");
        assert_eq!(Found::of(broken_off, "").executions, 4096);
    }

    #[test]
    fn a_dictionary_has_one_escaped_piece_a_line() {
        assert_eq!(dictionary(&[&["a\""], &["\n"]]), "\"\\x61\\x22\"\n\"\\x0a\"\n");
    }
}
