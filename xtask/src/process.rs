//! Runs a program and watches what it costs.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// What a run printed and cost.
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) wall_s: f64,
    /// User and system time; unknown where the system has no `/proc`.
    pub(crate) cpu_s: Option<f64>,
    pub(crate) peak_memory_mb: Option<f64>,
}

/// How often the program's own account is read (its last reading may be this old).
const POLL: Duration = Duration::from_millis(20);

/// Runs a program to its end; its messages go to our own stderr.
pub(crate) fn run(command: &mut Command) -> Result<Run, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let started = Instant::now();
    let out = tempfile::tempfile().map_err(|e| e.to_string())?;
    let writer = out.try_clone().map_err(|e| e.to_string())?;
    let mut child =
        command.stdout(Stdio::from(writer)).spawn().map_err(|e| format!("{name} cannot be started ({e})"))?;
    let account = Path::new("/proc").join(child.id().to_string());
    let (mut cpu_s, mut peak_memory_mb) = (None, None);
    let status = loop {
        cpu_s = cpu_seconds(&account).or(cpu_s);
        // A program that it started may have ended since.
        peak_memory_mb =
            peak_megabytes(&account).map(|mb| mb.max(peak_memory_mb.unwrap_or(0.0))).or(peak_memory_mb);
        if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
            break status;
        }
        std::thread::sleep(POLL);
    };
    let wall_s = started.elapsed().as_secs_f64();
    let stdout = read_from_start(out).map_err(|e| e.to_string())?;
    Ok(Run { code: status.code().unwrap_or(-1), stdout, wall_s, cpu_s, peak_memory_mb })
}

/// What this process has used so far: user and system time of all its threads (s).
pub(crate) fn own_cpu_s() -> Result<f64, String> {
    cpu_seconds(Path::new("/proc/self")).ok_or_else(|| "/proc/self/stat cannot be read".into())
}

/// CPU time of all child processes that have ended and were waited for (s).
pub(crate) fn children_cpu_s() -> Result<f64, String> {
    let ticks = ticks(Path::new("/proc/self"), 13).ok_or("/proc/self/stat cannot be read")?;
    Ok(ticks / TICKS_PER_S)
}

/// Does some work and prints how long it took and the CPU time of the programs that it ran.
pub(crate) fn timed(what: &str, work: impl FnOnce() -> Result<(), String>) -> Result<(), String> {
    let (begun, before_s) = (Instant::now(), children_cpu_s());
    let done = work();
    let cpu_s = children_cpu_s().unwrap_or(f64::NAN) - before_s.unwrap_or(f64::NAN);
    let minutes = begun.elapsed().as_secs_f64() / 60.0;
    println!("xtask: {what}{minutes:.1} minutes, {:.1} of CPU time", cpu_s / 60.0);
    done
}

fn read_from_start(mut file: std::fs::File) -> std::io::Result<String> {
    use std::io::{Read, Seek, SeekFrom};
    let mut text = String::new();
    file.seek(SeekFrom::Start(0))?;
    file.read_to_string(&mut text)?;
    Ok(text)
}

/// Linux counts process time in hundredths of a second for every program.
const TICKS_PER_S: f64 = 100.0;

fn cpu_seconds(account: &Path) -> Option<f64> {
    Some(ticks(account, 11)? / TICKS_PER_S)
}

/// User and system ticks; their columns are counted from the end of the name.
fn ticks(account: &Path, field: usize) -> Option<f64> {
    let text = std::fs::read_to_string(account.join("stat")).ok()?;
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let number = |k: usize| fields.get(k)?.parse::<f64>().ok();
    Some(number(field)? + number(field + 1)?)
}

/// The most memory that a process has had, and the programs that it runs.
fn peak_megabytes(account: &Path) -> Option<f64> {
    let text = std::fs::read_to_string(account.join("status")).ok()?;
    let line = text.lines().find(|line| line.starts_with("VmHWM"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    let threads = std::fs::read_dir(account.join("task")).ok()?.filter_map(Result::ok);
    let children = threads.filter_map(|thread| std::fs::read_to_string(thread.path().join("children")).ok());
    let started: f64 = children
        .flat_map(|pids| pids.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
        .filter_map(|pid| peak_megabytes(&Path::new("/proc").join(pid)))
        .sum();
    Some(kilobytes / 1024.0 + started)
}
