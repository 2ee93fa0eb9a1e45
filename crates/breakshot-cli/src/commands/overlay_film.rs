//! A film with its tracks drawn on it: encoded by `ffmpeg` if it is installed, otherwise a folder of images.

use breakshot::capture::Frame;
use breakshot::report::Overlay;
use breakshot::{Error, Result, files};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// The frame rate of a film whose tracks have fewer than two samples (1/s).
const DEFAULT_RATE_HZ: f64 = 60.0;

/// The frames to draw on.
pub(crate) struct Frames<I> {
    /// The frames in order of time.
    pub(crate) frames: I,
    /// Their width and height (px).
    pub(crate) size_px: [usize; 2],
}

/// Writes the film, or a folder of PNG images with the same name without its extension; returns the path written.
pub(crate) fn write<I>(overlay: &Overlay, frames: Frames<I>, film: &Path) -> Result<PathBuf>
where
    I: Iterator<Item = Result<Frame>>,
{
    let times_s =
        || overlay.tracks.tracks.iter().map(|t| t.samples.iter().map(|s| s.time_s).collect::<Vec<_>>());
    let rate_hz = times_s().find_map(|times_s| frame_rate_hz(&times_s)).unwrap_or(DEFAULT_RATE_HZ);
    match encoder(film, frames.size_px, rate_hz) {
        Ok(encoder) => encode(overlay, frames.frames, film, encoder),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            write_images(overlay, frames.frames, &film.with_extension(""))
        }
        Err(source) => Err(Error::Write { path: film.into(), source }),
    }
}

/// The frame rate from the median time step (1/s).
fn frame_rate_hz(times_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).filter(|step| **step > 0.0).map(|step| 1.0 / step)
}

/// A running `ffmpeg` that encodes the raw RGB images it receives on its standard input.
fn encoder(film: &Path, [width, height]: [usize; 2], rate_hz: f64) -> std::io::Result<Child> {
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error", "-nostdin", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
    command.args(["-s", &format!("{width}x{height}"), "-r", &format!("{rate_hz:.4}"), "-i", "pipe:0"]);
    // Many players need even sizes and 4:2:0 chroma subsampling.
    command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-crf", "18"]);
    command.args(["-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", "-y"]).arg(film);
    command.stdin(Stdio::piped()).spawn()
}

fn encode(
    overlay: &Overlay,
    frames: impl Iterator<Item = Result<Frame>>,
    film: &Path,
    mut encoder: Child,
) -> Result<PathBuf> {
    let failed = |source| Error::Write { path: film.into(), source };
    if let Some(mut pipe) = encoder.stdin.take() {
        for frame in frames {
            pipe.write_all(&overlay.drawn(&frame?).rgb).map_err(failed)?;
        }
    }
    let status = encoder.wait().map_err(failed)?;
    if status.success() {
        return Ok(film.into());
    }
    Err(failed(std::io::Error::other(format!("`ffmpeg` ended with {status}"))))
}

/// Writes the images and their times in the layout that breakshot reads as a film.
fn write_images(
    overlay: &Overlay,
    frames: impl Iterator<Item = Result<Frame>>,
    folder: &Path,
) -> Result<PathBuf> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
    let mut times_s: Vec<String> = Vec::new();
    for frame in frames {
        let frame = frame?;
        let file = folder.join(format!("{:06}.png", times_s.len()));
        let needed = "an image with pixels";
        let bytes = (overlay.drawn(&frame).png())
            .ok_or_else(|| Error::invalid("overlay", "image", "no pixels", needed))?;
        files::write_whole(&file, &bytes)?;
        times_s.push(format!("{:.6}", frame.time_s));
    }
    let timing = format!("times_s = [{}]\n", times_s.join(", "));
    files::write_whole(&folder.join("timing.toml"), timing.as_bytes())?;
    Ok(folder.into())
}
