//! How fast piles are simulated, beside rapier2d and MuJoCo: `cargo xtask bench physics`.
//!
//! All three run alternately on the same machine; the CPU time of one thread is measured, so the ratios are comparable.
//! rapier2d steps by a millisecond; MuJoCo at the step at which its own median error, against steps a quarter as long, is at most 2 mm.

use crate::example::{Scenes, answer, apart_mm, finals, target};
use crate::validate::row::{self, Row, median};
use crate::venv;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// How often each program runs; medians are printed.
const ROUNDS: usize = 5;
/// rapier2d's step (s).
const RAPIER_STEP_S: &str = "1e-3";

/// A kind of pile: our repeats, MuJoCo's step (s), and the targets of our speed over that of rapier2d and of MuJoCo.
const KINDS: [(&str, usize, f64, [Option<f64>; 2]); 3] = [
    ("S4g", 200, 31.25e-6, [Some(150.0), Some(2500.0)]),
    ("S4t", 50, 31.25e-6, [None, None]),
    ("G4", 30, 62.5e-6, [None, Some(350.0)]),
];
/// Scenes of a file that MuJoCo is timed on: it takes seconds for each.
const MUJOCO_SCENES: &str = "8";

/// Times the three on every kind of pile; then the growth with the number of objects.
pub(crate) fn bench(scenes: &Path, python: Option<&str>) -> Result<(), String> {
    let ours = Scenes::build(true)?;
    let peers = Peers { rapier: rapier()?, python: mujoco(python)? };
    let mut all_hold = true;
    for (name, repeat, step_s, wanted) in KINDS {
        let file = scenes.join(format!("{name}.txt"));
        let mut rates = [const { Vec::new() }; 3];
        for _ in 0..ROUNDS {
            rates[0].push(ours.run(&file, &["--repeat", &repeat.to_string()], 1)?.rollouts_per_cpu_s);
            rates[1].push(peers.rapier(&file, RAPIER_STEP_S)?);
            rates[2].push(peers.mujoco(&file, step_s, &["--scenes", MUJOCO_SCENES])?);
        }
        let times = |k: usize| median((0..ROUNDS).map(|r| rates[0][r] / rates[k][r]).collect());
        let faster = |who: &str, k: usize| {
            let what = format!("{name}: times as fast as {who}");
            wanted[k - 1]
                .map_or_else(|| Row::plain(&what, times(k), ""), |w| Row::at_least(&what, times(k), w, ""))
        };
        let rate = |who: &str, k: usize| {
            Row::plain(format!("{name}: {who}, rollouts/CPU s"), median(rates[k].clone()), "")
        };
        let rows = [
            rate("breakshot", 0),
            rate("rapier2d, 1 ms", 1),
            rate(&format!("MuJoCo, {:.1} us", step_s * 1e6), 2),
            Row::at_most(
                format!("{name}: MuJoCo's own median error at this step"),
                peers.own_error_mm(&file, step_s)?,
                2.0,
                "mm",
            ),
            faster("rapier2d", 1),
            faster("MuJoCo", 2),
        ];
        all_hold &=
            row::print_all(&format!("Speed on {name}, medians of {ROUNDS} alternating rounds"), &rows);
    }
    all_hold &= growth(&ours)?;
    row::require(all_hold)
}

/// The other programs.
struct Peers {
    rapier: PathBuf,
    python: PathBuf,
}

impl Peers {
    fn rapier(&self, file: &Path, step_s: &str) -> Result<f64, String> {
        let mut command = Command::new(&self.rapier);
        Ok(answer(command.arg(file).args(["--dt", step_s, "--repeat", "2"]))?.rollouts_per_cpu_s)
    }

    fn mujoco(&self, file: &Path, step_s: f64, flags: &[&str]) -> Result<f64, String> {
        let mut command = Command::new(&self.python);
        command.arg("xtask/peers/mujoco_scenes.py").arg(file).args(["--dt", &step_s.to_string()]).args(flags);
        Ok(answer(&mut command)?.rollouts_per_cpu_s)
    }

    /// Median distance between MuJoCo's final positions and its own with steps a quarter as long (mm).
    fn own_error_mm(&self, file: &Path, step_s: f64) -> Result<f64, String> {
        let mut positions = Vec::new();
        for step_s in [step_s, 0.25 * step_s] {
            let csv = tempfile::NamedTempFile::new().map_err(|e| e.to_string())?;
            self.mujoco(file, step_s, &["--repeat", "0", "--final", &csv.path().to_string_lossy()])?;
            positions.push(finals(csv.path())?);
        }
        Ok(median(apart_mm(&positions[0], &positions[1])))
    }
}

/// Builds the rapier2d program: a project of its own, outside this one's workspace.
fn rapier() -> Result<PathBuf, String> {
    let folder = target().join("peers/rapier");
    let manifest = "xtask/peers/rapier/Cargo.toml";
    let folder_text = folder.to_string_lossy().into_owned();
    crate::check::cargo(
        &["build", "--release", "--manifest-path", manifest, "--target-dir", &folder_text],
        &[],
    )?;
    Ok(folder.join("release/rapier-scenes"))
}

/// A Python interpreter with MuJoCo: the given one, or a virtual environment that is created once.
pub(crate) fn mujoco(python: Option<&str>) -> Result<PathBuf, String> {
    venv::given_or(python, "mujoco", &["mujoco==4.0.0"])
}

/// Objects of a pile whose time and memory are measured.
const SIZES: [usize; 5] = [10, 25, 50, 100, 200];
/// Piles of each size.
const HEAPS: u32 = 40;

/// Time per impact and memory from ten to two hundred objects.
fn growth(ours: &Scenes) -> Result<bool, String> {
    let (mut times_us, mut memory_mb) = (Vec::new(), Vec::new());
    for size in SIZES {
        let file = tempfile::NamedTempFile::new().map_err(|e| e.to_string())?;
        std::fs::write(file.path(), heaps(size)).map_err(|e| e.to_string())?;
        let repeat = (1000 / size).to_string();
        let mut rounds = Vec::new();
        for _ in 0..ROUNDS {
            let run = ours.run(file.path(), &["--repeat", &repeat], 1)?;
            rounds.push(1e6 / run.rollouts_per_cpu_s / run.impacts_per_rollout);
            memory_mb.push(run.peak_memory_mb);
        }
        times_us.push(median(rounds));
    }
    let memory: Vec<f64> = memory_mb.chunks(ROUNDS).map(|rounds| median(rounds.to_vec())).collect();
    let mut rows: Vec<Row> = (SIZES.iter().zip(&times_us).zip(&memory))
        .flat_map(|((size, time), memory)| {
            [
                Row::plain(format!("{size} objects: time per impact"), *time, "us"),
                Row::plain(format!("{size} objects: peak memory"), *memory, "MB"),
            ]
        })
        .collect();
    rows.push(Row::at_most("time per impact, 200 over 10 objects", times_us[4] / times_us[0], 2.0, ""));
    rows.push(Row::at_most(
        "time per impact, 10 objects and 190 bystanders over 10 objects",
        bystanders(ours)?,
        2.0,
        "",
    ));
    let per_object =
        |large: usize, small: usize| (memory[large] - memory[small]) / (SIZES[large] - SIZES[small]) as f64;
    rows.push(Row::at_most(
        "memory per object, 100 to 200 over 10 to 100",
        per_object(4, 3) / per_object(3, 0),
        1.5,
        "",
    ));
    Ok(row::print_all(
        "Growth with the number of objects (discs of 40 mm in round piles, gaps of 2 to 4 mm, struck through the middle at 1 m/s)",
        &rows,
    ))
}

/// Time of the same strikes on ten objects with 190 more that nothing reaches, over that without them.
fn bystanders(ours: &Scenes) -> Result<f64, String> {
    let (few, many) = (heaps(10), heaps(10).replace("end\n", &(rows_far_away(190) + "end\n")));
    let mut ratios = Vec::new();
    let [few_file, many_file] = [few, many].map(|text| {
        let file = tempfile::NamedTempFile::new().map_err(|e| e.to_string())?;
        std::fs::write(file.path(), text).map_err(|e| e.to_string())?;
        Ok::<_, String>(file)
    });
    let (few_file, many_file) = (few_file?, many_file?);
    for _ in 0..ROUNDS {
        let rate = |file: &Path| ours.run(file, &["--repeat", "100"], 1).map(|run| run.rollouts_per_cpu_s);
        ratios.push(rate(few_file.path())? / rate(many_file.path())?);
    }
    Ok(median(ratios))
}

/// Discs in rows a metre and more away from the piles.
fn rows_far_away(count: usize) -> String {
    (0..count).fold(String::new(), |mut text, k| {
        let (x, y) = (2.0 + 0.05 * (k / 20) as f64, -0.5 + 0.05 * (k % 20) as f64);
        let _ = writeln!(text, "disc 0.05 0.3 0.8 0.0 {x} {y} 0.0 0.02 {}", 0.04 / 3.0);
        text
    })
}

/// Piles of alike discs, as round as can be, struck through their middle; so many that no single one counts much and their
/// memory stands out.
fn heaps(size: usize) -> String {
    let (radius, pitch) = (0.02, 0.043);
    let mut text = String::new();
    for number in 0..HEAPS {
        let mut draw = 0.37 + 0.1 * f64::from(number);
        // A sequence that never repeats (the fractional parts of multiples of the golden ratio).
        let mut jitter = || {
            draw = (draw + 0.618_033_988_749_894_9) % 1.0;
            0.002 * (draw - 0.5)
        };
        let positions = nearest_points(size);
        let left = positions.iter().map(|(x, _)| *x).min().unwrap_or(0);
        let start_x = pitch * f64::from(left) - 0.045;
        let _ = writeln!(text, "scene heap {number}");
        let _ = writeln!(text, "striker 0.015 {start_x} {} 1.0 0.1 0.75 0.0", 2.0 * jitter());
        for (x, y) in positions {
            let (x, y) = (pitch * f64::from(x) + 0.5 * jitter(), pitch * f64::from(y) + 0.5 * jitter());
            let _ = writeln!(text, "disc 0.05 0.3 0.8 0.0 {x} {y} 0.0 {radius} {}", radius * 2.0 / 3.0);
        }
        text.push_str("end\n");
    }
    text
}

/// The points of a square grid that are nearest to its middle.
fn nearest_points(count: usize) -> Vec<(i32, i32)> {
    let mut positions: Vec<(i32, i32)> = (-10..=10).flat_map(|x| (-10..=10).map(move |y| (x, y))).collect();
    positions.sort_by_key(|&(x, y)| (x * x + y * y, x, y));
    positions.truncate(count);
    positions
}
