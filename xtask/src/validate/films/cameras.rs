//! One strike filmed by other cameras, and coded by other codecs: `cargo xtask validate cameras LAB`.
//!
//! The lab films it (`peers/lab_cameras.py`): 30 to 120 frames a second, tilted, blurred, noisy, dim; HEVC, Motion JPEG,
//! 10 bits.  Truth is read for measuring only.

use crate::example::target;
use crate::validate::row::{Row, median, print_all, require};
use crate::validate::tracks::{Errors, Film};
use crate::validate::truth::Truth;
use crate::{process, venv};
use breakshot::campaign::{Campaign, Clip, Source};
use breakshot::capture::Decoder;
use breakshot::{estimate, files};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Films the strike by every camera (once), tracks it, and compares.
///
/// With `only`, tracks only the films of the cameras with this word in their names.
pub(crate) fn cameras(lab: &Path, only: Option<&str>, python: Option<&str>) -> Result<(), String> {
    let folder = target().join("cameras");
    let python = venv::given_or(python, "lab", &venv::LAB)?;
    let run = process::run(Command::new(python).arg("xtask/peers/lab_cameras.py").arg(lab).arg(&folder))?;
    if run.code != 0 {
        return Err(format!("the lab's cameras ended with {}", run.code));
    }
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut cameras: Vec<_> = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    let wanted = |camera: &PathBuf| {
        camera.file_name().is_some_and(|n| n.to_string_lossy().contains(only.unwrap_or("")))
    };
    cameras.retain(|camera| wanted(camera) && camera.join("truth.json").exists());
    cameras.sort();
    if cameras.is_empty() {
        return Err(format!("{}: no films of a camera named `{}`", folder.display(), only.unwrap_or("")));
    }
    let mut all_hold = true;
    for camera in &cameras {
        all_hold &= measured(camera)?;
        if camera.ends_with(FAST) {
            all_hold &= slowed(camera)?;
        }
    }
    require(all_hold)
}

/// The camera whose films are also played in slow motion.
const FAST: &str = "120 per second";
/// How many times slower.
const SLOWER: u32 = 4;

/// Films whose files say a quarter of the rate at which they were taken: with `frame_rate_hz` the tracks are those of the true files, and
/// without it a warning names the rate.
fn slowed(folder: &Path) -> Result<bool, String> {
    let mut campaign = files::load_campaign(folder.join("campaign.toml")).map_err(|e| e.to_string())?.value;
    let slow = folder.join("slow");
    std::fs::create_dir_all(&slow).map_err(|e| format!("{}: {e}", slow.display()))?;
    let tracks = |campaign: &Campaign, clip: &Clip| {
        breakshot::clip_tracks(campaign, clip, Decoder::Auto).map_err(|e| e.to_string())
    };
    let (mut different, mut unnamed) = (0, Vec::new());
    for k in 0..campaign.clips.len() {
        let Source::Film(film) = campaign.clips[k].source.clone() else { continue };
        let wanted = tracks(&campaign, &campaign.clips[k])?;
        let slow = slow.join(film.file_name().unwrap_or_default());
        let mut ffmpeg = Command::new("ffmpeg");
        ffmpeg.args(["-v", "error", "-y", "-itsscale", &SLOWER.to_string(), "-i"]).arg(&film);
        let run = process::run(ffmpeg.args(["-c", "copy"]).arg(&slow))?;
        if run.code != 0 {
            return Err(format!("ffmpeg ended with {}", run.code));
        }
        campaign.clips[k].source = Source::Film(slow);
        let found = tracks(&campaign, &campaign.clips[k])?;
        let options = estimate::Options::default();
        let properties = breakshot::campaign_properties(&campaign, None, &[found], Vec::new(), &options);
        let warnings = properties.map_or_else(|e| vec![e.to_string()], |properties| properties.warnings);
        if !warnings.iter().any(|line| line.contains("120 frames/s")) {
            unnamed.extend(warnings);
            unnamed.push(format!("{}: no warning names 120 frames/s", campaign.clips[k].name));
        }
        campaign.clips[k].frame_rate_hz = Some(120.0);
        different += u32::from(tracks(&campaign, &campaign.clips[k])? != wanted);
    }
    let rows = [
        Row::at_most("clips whose tracks differ with frame_rate_hz = 120", f64::from(different), 0.0, ""),
        Row::at_most("lines of clips whose warnings do not name 120", unnamed.len() as f64, 0.0, ""),
    ];
    let title = format!("Camera: {FAST}, in files of {} per second", 120 / SLOWER);
    let holds = print_all(&title, &rows);
    for line in &unnamed {
        println!("  {line}");
    }
    Ok(holds)
}

/// The films of one camera.
fn measured(folder: &Path) -> Result<bool, String> {
    let truth = Truth::read(folder)?;
    let campaign = files::load_campaign(folder.join("campaign.toml")).map_err(|e| e.to_string())?.value;
    let mut errors = Errors::default();
    let mut warnings = Vec::new();
    for clip in &campaign.clips {
        let name = clip.name.clone();
        let result = breakshot::clip_tracks(&campaign, clip, Decoder::Auto).map_err(|e| e.to_string())?;
        let steps = result.tracks.tracks.iter().flat_map(|track| track.samples.windows(2));
        let interval_s = median(steps.map(|pair| pair[1].time_s - pair[0].time_s).collect());
        // The exposure is shorter than the interval between frames.
        let film = Film { frame_rate_hz: 1.0 / interval_s, near_impact_s: 0.5 * interval_s };
        let known = truth.clips.get(&name).ok_or_else(|| format!("{name} is not in the truth"))?;
        errors.add(&name, &result.tracks, known, film);
        warnings.extend(result.tracks.warnings);
    }
    let rows = [
        Row::at_most("tracks that miss their first or last frame", errors.incomplete.len() as f64, 0.0, ""),
        Row::at_most("every frame without an impact, rms", errors.every_rms_mm(), 0.08, "mm"),
        Row::at_most("angles of bar markers, rms", errors.angle_rms_deg(), 0.5, "deg"),
    ];
    let title = folder.file_name().unwrap_or_default().to_string_lossy();
    let holds = print_all(&format!("Camera: {title}, {} films", campaign.clips.len()), &rows);
    for line in errors.incomplete.iter().chain(&warnings) {
        println!("  {line}");
    }
    Ok(holds)
}
