//! Labelling and tracking beside OpenCV: `cargo run --release -p xtask -- bench detect [LAB]`.
//!
//! Both process the same frames and films alternately; the table shows medians of the CPU time over the rounds.

use super::ROUNDS;
use crate::process::{self, own_cpu_s};
use crate::validate::row::{self, Row, median};
use crate::venv;
use breakshot::capture::GreyImage;
use breakshot::detect::label::{Component, Labeller, Level, Window};
use std::path::Path;
use std::process::Command;

/// The grey level between marker and table.
const LEVEL: u8 = 110;
/// Components of fewer pixels are left out, as noise; of the peer's as well, after it has found them.
const LEAST_AREA_PX: u64 = 2;

/// A frame that is labelled.
struct Task {
    name: &'static str,
    size_px: [usize; 2],
    /// Density of salt-and-pepper noise: the fraction of pixels that are set to black.
    salt: f64,
    /// Our repeats a round, and the peer's.
    repeats: [usize; 2],
    /// Whether the targets are meant for it: with salt for the usual call only.
    targets: bool,
}

const TASKS: [Task; 4] = [
    Task { name: "8 discs", size_px: [3840, 2160], salt: 0.0, repeats: [600, 6], targets: true },
    Task { name: "1 % salt", size_px: [3840, 2160], salt: 0.01, repeats: [200, 6], targets: true },
    Task { name: "2 % salt", size_px: [3840, 2160], salt: 0.02, repeats: [200, 6], targets: true },
    // What memory allows and what the method can do are two things: this frame stays in the cache.
    Task { name: "8 discs", size_px: [960, 540], salt: 0.0, repeats: [10_000, 100], targets: false },
];

/// OpenCV from `PyPI`.
const OPENCV: [&str; 2] = ["opencv-python-headless==5.0.0.93", "numpy"];

/// Times labelling, then a 4K film and its memory, then (if given) films of the lab.
pub(crate) fn bench(lab: Option<&Path>, python: Option<&str>) -> Result<(), String> {
    if cfg!(debug_assertions) {
        return Err("speed is that of a release build: cargo run --release -p xtask -- bench detect".into());
    }
    let python = venv::given_or(python, "opencv", &OPENCV)?;
    let mut all_hold = true;
    for task in &TASKS {
        all_hold &= labelling(task, &python)?;
    }
    all_hold &= super::films::four_k(&python)?;
    if let Some(lab) = lab {
        all_hold &= super::films::lab(lab, &python)?;
    }
    row::require(all_hold)
}

/// One frame: ours, reading it, our bare threshold, OpenCV as usual, with its best algorithm, its threshold (ms a call).
fn labelling(task: &Task, python: &Path) -> Result<bool, String> {
    let [width, height] = task.size_px;
    let image = frame(task);
    let file = tempfile::NamedTempFile::new().map_err(|e| e.to_string())?;
    std::fs::write(file.path(), &image.pixels).map_err(|e| e.to_string())?;
    let mut labeller = Labeller::default();
    let mut binary = vec![0; image.pixels.len()];
    let mut times_ms = [const { Vec::new() }; 6];
    for _ in 0..ROUNDS {
        let mut found = Vec::new();
        let ours = cpu_ms(task.repeats[0], || {
            let areas_px = LEAST_AREA_PX..=u64::MAX;
            let all = labeller.components(&image, Window::whole(&image), Level::Below(LEVEL), &areas_px);
            found.clear();
            found.extend_from_slice(all);
        })?;
        let reading = cpu_ms(task.repeats[0], || {
            let darkest = std::hint::black_box(&image.pixels).iter().fold(u8::MAX, |least, &p| least.min(p));
            std::hint::black_box(darkest);
        })?;
        let threshold = cpu_ms(task.repeats[0], || {
            for (to, &from) in binary.iter_mut().zip(std::hint::black_box(&image.pixels)) {
                *to = if from < LEVEL { u8::MAX } else { 0 };
            }
            std::hint::black_box(&mut binary);
        })?;
        let peer = opencv(python, file.path(), task)?;
        if peer[3..] != sums(&found)[..] {
            return Err(format!("{}: found {:?}, OpenCV {:?}", task.name, sums(&found), &peer[3..]));
        }
        for (times, ms) in times_ms.iter_mut().zip([ours, reading, threshold, peer[0], peer[1], peer[2]]) {
            times.push(ms);
        }
    }
    let [ours, reading, threshold, usual, best, opencv_threshold] = times_ms.map(median);
    let (clean, over) = (task.salt == 0.0, ours / threshold.min(opencv_threshold));
    let faster = |who: &str, times: f64, target: f64| {
        let what = format!("times as fast as {who}");
        if task.targets { Row::at_least(what, times, target, "") } else { Row::plain(what, times, "") }
    };
    let mut rows = vec![
        Row::plain("ours: threshold, areas, boxes, first and second moments", ours, "ms"),
        Row::plain("reading the pixels alone", reading, "ms"),
        Row::plain("threshold alone, compiled as usual", threshold, "ms"),
        Row::plain("threshold alone, OpenCV", opencv_threshold, "ms"),
        Row::plain("OpenCV, threshold + connectedComponentsWithStats", usual, "ms"),
        Row::plain("OpenCV, the same with its best algorithm (BBDT)", best, "ms"),
        faster("OpenCV as users call it", usual / ours, if clean { 200.0 } else { 30.0 }),
    ];
    if clean {
        rows.push(faster("OpenCV's best algorithm", best / ours, 60.0));
        rows.push(Row::at_most("time over the faster bare threshold", over, 2.0, ""));
    }
    rows.push(Row::plain("the most that reading alone would allow", usual / reading, ""));
    let title = format!("Labelling {width} x {height} px, {}: CPU time, medians of {ROUNDS}", task.name);
    Ok(row::print_all(&title, &rows))
}

/// CPU time of a call (ms).
fn cpu_ms(repeats: usize, mut call: impl FnMut()) -> Result<f64, String> {
    call();
    let before_s = own_cpu_s()?;
    (0..repeats).for_each(|_| call());
    Ok(1e3 * (own_cpu_s()? - before_s) / repeats as f64)
}

/// What the peer prints: its three times (ms), then its sums.
fn opencv(python: &Path, frame: &Path, task: &Task) -> Result<Vec<f64>, String> {
    let mut command = Command::new(python);
    command.arg("xtask/peers/opencv_label.py").arg(frame);
    let numbers = [task.size_px[0], task.size_px[1], LEVEL.into(), task.repeats[1], LEAST_AREA_PX as usize];
    command.args(numbers.map(|n| n.to_string()));
    let run = process::run(&mut command)?;
    let numbers: Vec<f64> = run.stdout.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    if numbers.len() == 7 { Ok(numbers) } else { Err(format!("the OpenCV peer said: {}", run.stdout)) }
}

/// How many components, their area, the sums of their first columns and last rows.
fn sums(found: &[Component]) -> [f64; 4] {
    let sum = |value: fn(&Component) -> u64| found.iter().map(value).sum::<u64>() as f64;
    [found.len() as f64, sum(|c| c.area_px), sum(|c| c.x[0].into()), sum(|c| c.y[1].into())]
}

/// Eight dark discs on a light, grainy table, with salt-and-pepper noise of black pixels.
fn frame(task: &Task) -> GreyImage {
    let [width, height] = task.size_px;
    let scale = width as f64 / 3840.0;
    let mut random = 1_u64;
    let mut next = move || {
        // Knuth's MMIX generator; its upper bits are the random ones.
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 40) as f64 / f64::from(1_u32 << 24)
    };
    let pixel = |at: usize| {
        let (x, y) = ((at % width) as f64 / scale, (at / width) as f64 / scale);
        let inside = (0..8).any(|k| {
            let centre = (400.3 + 420.0 * f64::from(k), 300.7 + 210.0 * f64::from(k));
            (x - centre.0).hypot(y - centre.1) < 40.0
        });
        let grain = 16.0 * (next() - 0.5);
        let black = next() < task.salt;
        if black { 0 } else { (if inside { 25.0 } else { 185.0 } + grain) as u8 }
    };
    GreyImage { width, height, pixels: (0..width * height).map(pixel).collect() }
}
