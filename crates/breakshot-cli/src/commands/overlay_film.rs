//! A film with its tracks drawn on it: encoded by `ffmpeg` if it is installed, otherwise a folder of images.

use breakshot::capture::Frame;
use breakshot::report::Overlay;
use breakshot::{Error, Result, files};
use std::ffi::OsString;
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
    files::check_file_name(film)?;
    let part = part_of(film);
    match encoder(&part, frames.size_px, rate_hz) {
        Ok(encoder) => {
            let written = encode(overlay, frames.frames, &part, encoder)
                .and_then(|()| std::fs::rename(&part, film).map_err(|source| write_error(film, source)));
            if written.is_err() {
                let _ = std::fs::remove_file(&part);
            }
            written.map(|()| film.into())
        }
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            write_images(overlay, frames.frames, &film.with_extension(""))
        }
        Err(source) => Err(write_error(film, source)),
    }
}

fn write_error(path: &Path, source: std::io::Error) -> Error {
    Error::Write { path: path.into(), source }
}

/// The path of an output beside it while it is not complete.
fn part_of(output: &Path) -> PathBuf {
    let name = output.file_name().unwrap_or_default().to_string_lossy();
    output.with_file_name(format!(".{name}.{}.part", std::process::id()))
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
    command.args(["-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", "-y"]);
    // A name with a colon would be a protocol, one with a hyphen an option.
    let mut file = OsString::from("file:");
    file.push(std::path::absolute(film)?);
    command.arg(file).stdin(Stdio::piped()).spawn()
}

fn encode(
    overlay: &Overlay,
    frames: impl Iterator<Item = Result<Frame>>,
    film: &Path,
    mut encoder: Child,
) -> Result<()> {
    let failed = |source| write_error(film, source);
    if let Some(mut pipe) = encoder.stdin.take() {
        for frame in frames {
            pipe.write_all(&overlay.drawn(&frame?).rgb).map_err(failed)?;
        }
    }
    let status = encoder.wait().map_err(failed)?;
    if status.success() {
        return Ok(());
    }
    Err(failed(std::io::Error::other(format!("`ffmpeg` ended with {status}"))))
}

/// Writes the images and their times in the layout that breakshot reads as a film; the folder is complete when it has its name.
fn write_images(
    overlay: &Overlay,
    frames: impl Iterator<Item = Result<Frame>>,
    folder: &Path,
) -> Result<PathBuf> {
    let part = part_of(folder);
    std::fs::create_dir_all(&part).map_err(|source| write_error(folder, source))?;
    let written = write_each_image(overlay, frames, &part).and_then(|()| {
        // Images of an earlier film would be taken for frames of this one.
        if folder.join(TIMING).exists() {
            std::fs::remove_dir_all(folder).map_err(|source| write_error(folder, source))?;
        }
        std::fs::rename(&part, folder).map_err(|source| write_error(folder, source))
    });
    if written.is_err() {
        let _ = std::fs::remove_dir_all(&part);
    }
    written.map(|()| folder.into())
}

/// The file of the images' times.
const TIMING: &str = "timing.toml";

fn write_each_image(
    overlay: &Overlay,
    frames: impl Iterator<Item = Result<Frame>>,
    folder: &Path,
) -> Result<()> {
    let mut times_s: Vec<String> = Vec::new();
    for frame in frames {
        let frame = frame?;
        let file = folder.join(format!("{:06}.png", times_s.len()));
        let needed = "an image with pixels";
        let bytes = (overlay.drawn(&frame).png())
            .ok_or_else(|| Error::invalid("overlay", "image", "no pixels", needed))?;
        std::fs::write(&file, &bytes).map_err(|source| write_error(&file, source))?;
        times_s.push(format!("{:.6}", frame.time_s));
    }
    let timing = format!("times_s = [{}]\n", times_s.join(", "));
    files::write_whole(&folder.join(TIMING), timing.as_bytes())
}
