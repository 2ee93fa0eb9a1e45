//! Films to tracks, beside `ffmpeg` and OpenCV: CPU time, wall time, memory.

use super::ROUNDS;
use crate::example::target;
use crate::process::{self, children_cpu_s, own_cpu_s};
use crate::validate::row::{self, Row, median};
use breakshot::capture::Decoder;
use breakshot::files;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Frames of the 4K film, and how often it is played for the long one.
const FRAMES: usize = 120;
const LOOPS: usize = 17;

/// The cell and the objects of the 4K film.
const CELL: &str = "\
scale_px_per_m = 4000.0
[camera]
image_size_px = [3840, 2160]
[workspace]
min_m = [-0.5, -0.3]
max_m = [0.5, 0.3]
[striker]
shape = { disc = { radius_m = 0.01 } }
height_m = 0.05
speed_range_m_s = [0.1, 1.0]
";
const OBJECTS: &str = "\
[[objects]]
name = \"d\"
shape = { disc = { radius_m = 0.01 } }
height_m = 0.001
marker = { shape = { disc = { radius_m = 0.01 } } }
";

/// A 4K film to tracks with either decoder, beside `ffmpeg` decoding it for nothing and the OpenCV script; memory.
pub(crate) fn four_k(python: &Path) -> Result<bool, String> {
    let folder = target().join("bench");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let film = made(&folder.join("discs_4k.mp4"), |film| {
        let mut command = Command::new(python);
        command.arg("xtask/peers/discs_4k.py").arg(film).arg(FRAMES.to_string());
        command
    })?;
    let long = made(&folder.join("discs_4k_long.mp4"), |long| {
        let mut command = Command::new("ffmpeg");
        command.args(["-v", "error", "-stream_loop", &(LOOPS - 1).to_string(), "-i"]).arg(&film);
        command.args(["-c", "copy", "-y"]).arg(long);
        command
    })?;
    let cli = Cli::build(&folder)?;
    let mut times_ms = [const { Vec::new() }; 4];
    let per_frame = |cpu_s: f64| 1e3 * cpu_s / FRAMES as f64;
    for _ in 0..ROUNDS {
        let of_children = |run: &mut dyn FnMut() -> Result<process::Run, String>| -> Result<f64, String> {
            let before_s = children_cpu_s()?;
            run()?;
            Ok(per_frame(children_cpu_s()? - before_s))
        };
        let builtin = of_children(&mut || cli.detect(&film, "builtin"))?;
        let with_ffmpeg = of_children(&mut || cli.detect(&film, "ffmpeg"))?;
        let null = of_children(&mut || process::run(&mut null(&film)))?;
        let script = per_frame(opencv(python, std::slice::from_ref(&film))?);
        for (times, ms) in times_ms.iter_mut().zip([builtin, with_ffmpeg, null, script]) {
            times.push(ms);
        }
    }
    let [builtin, with_ffmpeg, null, script] = times_ms.map(median);
    let memory =
        |decoder: &str| Ok::<f64, String>(cli.detect(&long, decoder)?.peak_memory_mb.unwrap_or(f64::NAN));
    let rows = [
        Row::plain("4K film to tracks, built-in decoder, a frame", builtin, "ms"),
        Row::plain("the same through ffmpeg", with_ffmpeg, "ms"),
        Row::plain("ffmpeg -f null alone", null, "ms"),
        Row::plain("OpenCV script, start of Python left out", script, "ms"),
        Row::at_most("built-in decoder over the OpenCV script", builtin / script, 0.6, ""),
        Row::at_most("through ffmpeg over ffmpeg -f null", with_ffmpeg / null, 1.15, ""),
        Row::at_most(
            format!("peak memory, {} frames, built-in", FRAMES * LOOPS),
            memory("builtin")?,
            500.0,
            "MB",
        ),
        Row::at_most(
            format!("peak memory, {} frames, with ffmpeg's", FRAMES * LOOPS),
            memory("ffmpeg")?,
            500.0,
            "MB",
        ),
    ];
    let title = format!("A film of 3840 x 2160 px, H.264 at 60 Mbit/s: CPU time, medians of {ROUNDS}");
    Ok(row::print_all(&title, &rows))
}

/// The file, made if it is not there; under another name until it is whole.
fn made(file: &Path, command: impl FnOnce(&Path) -> Command) -> Result<PathBuf, String> {
    if !file.exists() {
        let unfinished = file.with_extension("unfinished.mp4");
        let run = process::run(&mut command(&unfinished))?;
        if run.code != 0 {
            return Err(format!("{} was not made (exit code {})", file.display(), run.code));
        }
        std::fs::rename(&unfinished, file).map_err(|e| format!("{}: {e}", file.display()))?;
    }
    Ok(file.into())
}

fn null(film: &Path) -> Command {
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error", "-nostdin", "-threads", "1", "-i"]).arg(film).args(["-f", "null", "-"]);
    command.stdin(Stdio::null());
    command
}

/// CPU time of the script on these films (s), as the script reports it.
fn opencv(python: &Path, films: &[PathBuf]) -> Result<f64, String> {
    let run = process::run(Command::new(python).arg("xtask/peers/opencv_tracks.py").args(films))?;
    let said = run.stdout.lines().find_map(|line| line.strip_prefix("cpu_s=")?.parse().ok());
    said.ok_or_else(|| format!("the OpenCV script ended with {}", run.code))
}

/// The program, on the 4K film's cell.
struct Cli {
    binary: PathBuf,
    folder: PathBuf,
}

impl Cli {
    fn build(folder: &Path) -> Result<Self, String> {
        crate::check::cargo(&["build", "--release", "--package", "breakshot-cli"], &[])?;
        let write =
            |name: &str, text: &str| std::fs::write(folder.join(name), text).map_err(|e| e.to_string());
        write("cell.toml", CELL)?;
        write("objects.toml", OBJECTS)?;
        Ok(Self { binary: target().join("release/breakshot"), folder: folder.into() })
    }

    /// Tracks the eight discs.
    fn detect(&self, film: &Path, decoder: &str) -> Result<process::Run, String> {
        let names: Vec<String> =
            (1..=8).map(|k| if k == 1 { "d".into() } else { format!("d#{k}") }).collect();
        let mut command = Command::new(&self.binary);
        command
            .arg("detect")
            .args(["cell.toml", "objects.toml"].map(|name| self.folder.join(name)))
            .arg(film);
        command
            .args(["--objects", &names.join(","), "--decoder", decoder, "-o"])
            .arg(self.folder.join("tracks.json"));
        let run = process::run(&mut command)?;
        if matches!(run.code, 0 | 3) { Ok(run) } else { Err(format!("{command:?} ended with {}", run.code)) }
    }
}

/// Every so manieth film of the lab is taken.
const LAB_STEP: usize = 12;

/// Films of the lab to tracks, two at a time, beside the OpenCV script.
pub(crate) fn lab(lab: &Path, python: &Path) -> Result<bool, String> {
    let loaded = files::load_campaign(lab.join("campaign/campaign.toml")).map_err(|e| e.to_string())?;
    let campaign = loaded.value;
    let clips: Vec<_> = campaign.clips.iter().step_by(LAB_STEP).collect();
    let films: Vec<PathBuf> = clips.iter().map(|clip| clip.source.path().to_path_buf()).collect();
    let mut times_s = [const { Vec::new() }; 4];
    for _ in 0..ROUNDS {
        let (before_s, started) = (own_cpu_s()? + children_cpu_s()?, Instant::now());
        let next = AtomicUsize::new(0);
        let track = || -> Result<(), String> {
            while let Some(clip) = clips.get(next.fetch_add(1, Ordering::Relaxed)) {
                breakshot::clip_tracks(&campaign, clip, Decoder::Auto).map_err(|e| e.to_string())?;
            }
            Ok(())
        };
        std::thread::scope(|scope| {
            let other = scope.spawn(track);
            track().and(other.join().unwrap_or_else(|_| Err("a thread ended early".into())))
        })?;
        let (wall_s, cpu_s) = (started.elapsed().as_secs_f64(), own_cpu_s()? + children_cpu_s()? - before_s);
        let started = Instant::now();
        let script_s = opencv(python, &films)?;
        let script_wall_s = started.elapsed().as_secs_f64();
        for (times, s) in times_s.iter_mut().zip([cpu_s, wall_s, script_s, script_wall_s]) {
            times.push(s);
        }
    }
    let [cpu_s, wall_s, script_s, script_wall_s] = times_s.map(median);
    let rows = [
        Row::plain("ours: CPU time", cpu_s, "s"),
        Row::plain("ours: wall time, two threads", wall_s, "s"),
        Row::plain("OpenCV script: CPU time, start of Python left out", script_s, "s"),
        Row::plain("OpenCV script: wall time", script_wall_s, "s"),
        Row::at_least("times less CPU time", script_s / cpu_s, 1.8, ""),
        Row::at_least("times less wall time", script_wall_s / wall_s, 3.0, ""),
    ];
    Ok(row::print_all(&format!("{} films of the lab to tracks: medians of {ROUNDS}", films.len()), &rows))
}
