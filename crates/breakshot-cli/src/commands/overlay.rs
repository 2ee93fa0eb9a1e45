//! The film with its tracks drawn on it, coded by `ffmpeg` if it is installed, else as pictures.

use breakshot::capture::{Footage, Frame};
use breakshot::report::Overlay;
use breakshot::{Error, Result, files};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// A film of which only one frame is known has this rate (1/s).
const USUAL_RATE_HZ: f64 = 60.0;

/// Writes the film, or a folder of pictures beside where it would be; says which.
pub(crate) fn write(overlay: &Overlay, frames: Footage, film: &Path) -> Result<PathBuf> {
    let size_px = frames.size_px();
    let times_s =
        || overlay.tracks.tracks.iter().map(|t| t.samples.iter().map(|s| s.time_s).collect::<Vec<_>>());
    let rate_hz = times_s().find_map(|times_s| rate_hz(&times_s)).unwrap_or(USUAL_RATE_HZ);
    match coder(film, size_px, rate_hz) {
        Ok(coder) => coded(overlay, frames, film, coder),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            pictures(overlay, frames, &film.with_extension(""))
        }
        Err(source) => Err(Error::Write { path: film.into(), source }),
    }
}

/// The usual number of frames a second.
fn rate_hz(times_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).filter(|step| **step > 0.0).map(|step| 1.0 / step)
}

/// `ffmpeg`, waiting for pictures.
fn coder(film: &Path, [width, height]: [usize; 2], rate_hz: f64) -> std::io::Result<Child> {
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error", "-nostdin", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
    command.args(["-s", &format!("{width}x{height}"), "-r", &format!("{rate_hz:.4}"), "-i", "pipe:0"]);
    // Players want even sizes and this coding of colours.
    command.args([
        "-vf",
        "pad=ceil(iw/2)*2:ceil(ih/2)*2",
        "-c:v",
        "libx264",
        "-crf",
        "18",
        "-pix_fmt",
        "yuv420p",
    ]);
    command.args(["-movflags", "+faststart", "-f", "mp4", "-y"]).arg(film);
    command.stdin(Stdio::piped()).spawn()
}

fn coded(overlay: &Overlay, frames: Footage, film: &Path, mut coder: Child) -> Result<PathBuf> {
    let failed = |source| Error::Write { path: film.into(), source };
    if let Some(mut pipe) = coder.stdin.take() {
        for frame in frames {
            pipe.write_all(&overlay.drawn(&frame?).rgb).map_err(failed)?;
        }
    }
    let status = coder.wait().map_err(failed)?;
    if status.success() {
        return Ok(film.into());
    }
    Err(failed(std::io::Error::other(format!("`ffmpeg` ended with {status}"))))
}

/// A folder that can be read as a film again: pictures and their times.
fn pictures(overlay: &Overlay, frames: Footage, folder: &Path) -> Result<PathBuf> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
    let mut times_s: Vec<String> = Vec::new();
    for frame in frames {
        let frame: Frame = frame?;
        let file = folder.join(format!("{:06}.png", times_s.len()));
        let png: Option<Vec<u8>> = overlay.drawn(&frame).png();
        let needed = "a picture with pixels";
        let bytes = png.ok_or_else(|| Error::invalid("overlay", "picture", "nothing in it", needed))?;
        files::write_whole(&file, &bytes)?;
        times_s.push(format!("{:.6}", frame.time_s));
    }
    let timing = format!("times_s = [{}]\n", times_s.join(", "));
    files::write_whole(&folder.join("timing.toml"), timing.as_bytes())?;
    Ok(folder.into())
}
