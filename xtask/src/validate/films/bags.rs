//! The demo's films as bags of ROS 2: `cargo xtask validate bags [CLIPS]`.
//!
//! Other programs repack the decoded frames (`peers/ros_bags.py`: the packages `rosbags`, `mcap`, OpenCV, and ffmpeg for H.264); the
//! tracks of each bag are compared with those of the film; those of a bag with `CameraInfo` are tracked in a cell without a lens.

use super::Differences;
use crate::example::target;
use crate::validate::row::{Row, print_all, require};
use crate::{process, venv};

use breakshot::campaign::{Campaign, Clip, Source};
use breakshot::capture::Footage;
use breakshot::cell::{CameraSpec, Cell};
use breakshot::detect::Tracks;
use breakshot::files;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

const PACKAGES: [&str; 5] =
    ["rosbags==0.11.9", "mcap==1.6.0", "lz4==4.4.5", "zstandard==0.25.0", "opencv-python-headless==5.0.0.93"];
/// Largest difference between the tracks of a film and of its bag where the pixels differ (mm).
const CLOSE_MM: f64 = 0.02;
/// The bag that holds the lens.
const WITH_LENS: &str = "camera_info";
/// The codings of the bags that keep the pixels.
const EXACT: [&str; 3] = ["mono8", "bgr8", "png"];

/// Repacks and tracks the first `clips` films of the demo's campaign, or all.
pub(crate) fn bags(clips: Option<usize>) -> Result<(), String> {
    let python = venv::python("bags", &PACKAGES)?;
    let campaign = files::load_campaign("fixtures/demo/campaign.toml").map_err(|e| e.to_string())?.value;
    let without_lens = without_lens(&campaign);
    let mut differences_mm: BTreeMap<String, Differences> = BTreeMap::new();
    for (k, clip) in campaign.clips.iter().enumerate().take(clips.unwrap_or(usize::MAX)) {
        println!("{}", clip.name);
        let folder = target().join("bags");
        emptied(&folder)?;
        let film = decoded(&campaign, clip, &folder)?;
        let wanted = tracks(&campaign, clip, clip.source.path())?;
        pack(&python, &film, &folder, false)?;
        let h264 = tracks(&campaign, clip, &folder.join("h264.mp4"))?;
        if k == 0 {
            pack(&python, &film, &folder, true)?;
        }
        for bag in bags_in(&folder)? {
            let name = bag.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let found = tracks(if name == WITH_LENS { &without_lens } else { &campaign }, clip, &bag)?;
            let mut add = |name: String, wanted: &Tracks| {
                differences_mm.entry(name).or_default().add(&found, wanted);
            };
            if name.starts_with("h264") {
                add(format!("{name}, against the MP4 of the same stream"), &h264);
            }
            add(name, &wanted);
        }
        emptied(&folder)?;
    }
    let is_exact = |name: &str| {
        name.contains("against") || !name.contains('-') || EXACT.iter().any(|coding| name.starts_with(coding))
    };
    let rows = differences_mm.into_iter().flat_map(|(name, differences)| {
        let target = if is_exact(&name) { 0.0 } else { CLOSE_MM };
        let rms = Row::plain(format!("{name}, rms"), differences.rms_mm(), "mm");
        [Row::at_most(format!("{name}, largest difference"), differences.largest_mm, target, "mm"), rms]
    });
    let rows: Vec<Row> = rows.collect();
    require(print_all("Tracks of bags beside those of the films they were made from", &rows))
}

fn emptied(folder: &Path) -> Result<(), String> {
    let failed = |e| format!("{}: {e}", folder.display());
    if folder.exists() {
        std::fs::remove_dir_all(folder).map_err(failed)?;
    }
    std::fs::create_dir_all(folder).map_err(failed)
}

/// The same campaign in a cell without a lens.
fn without_lens(campaign: &Campaign) -> Campaign {
    let camera = CameraSpec {
        image_size_px: None,
        focal_px: None,
        center_px: None,
        distortion: None,
        ..campaign.cell.camera.clone()
    };
    Campaign { cell: Cell { camera, ..campaign.cell.clone() }, ..campaign.clone() }
}

/// Writes the luma and the times of a film's frames, and the lens; returns the file that names them.
fn decoded(campaign: &Campaign, clip: &Clip, folder: &Path) -> Result<PathBuf, String> {
    let (mut times_s, mut luma) = (Vec::new(), Vec::new());
    let footage = Footage::open(clip.source.path()).map_err(|e| e.to_string())?;
    let size_px = footage.size_px();
    for frame in footage {
        let frame = frame.map_err(|e| e.to_string())?;
        times_s.push(frame.time_s);
        luma.extend(frame.image.pixels);
    }
    let (luma_file, film) = (folder.join("luma"), folder.join("film.json"));
    let CameraSpec { focal_px, center_px, distortion, .. } = &campaign.cell.camera;
    let description = serde_json::json!({
        "size_px": size_px, "times_s": times_s, "luma": luma_file,
        "focal_px": focal_px, "center_px": center_px, "distortion": distortion,
    });
    std::fs::write(&luma_file, luma).map_err(|e| e.to_string())?;
    std::fs::write(&film, description.to_string()).map_err(|e| e.to_string())?;
    Ok(film)
}

fn pack(python: &Path, film: &Path, folder: &Path, converted: bool) -> Result<(), String> {
    let mut command = Command::new(python);
    command.arg("xtask/peers/ros_bags.py").arg(film).arg(folder);
    if converted {
        command.arg("--converted");
    }
    let run = process::run(&mut command)?;
    if run.code == 0 { Ok(()) } else { Err(format!("ros_bags.py ended with {}", run.code)) }
}

/// The MCAP files and the folders that are bags.
fn bags_in(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut bags: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    bags.retain(|path| path.extension().is_some_and(|e| e == "mcap") || path.join("metadata.yaml").is_file());
    bags.sort();
    Ok(bags)
}

fn tracks(campaign: &Campaign, clip: &Clip, film: &Path) -> Result<Tracks, String> {
    let clip = Clip { source: Source::Film(film.into()), ..clip.clone() };
    super::tracks(campaign, &clip)
}
