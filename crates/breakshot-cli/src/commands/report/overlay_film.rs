//! A film with its tracks drawn on it: encoded by `ffmpeg` if it is installed, otherwise a folder of images.

use super::encoder::{Encoder, write_error};
use breakshot::capture::Frame;
use breakshot::report::Overlay;
use breakshot::{Error, files};
use std::path::{Path, PathBuf};

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
pub(crate) fn write<I>(overlay: &Overlay, frames: Frames<I>, film: &Path) -> breakshot::Result<PathBuf>
where
    I: Iterator<Item = breakshot::Result<Frame>>,
{
    let times_s =
        || overlay.tracks.tracks.iter().map(|t| t.samples.iter().map(|s| s.time_s).collect::<Vec<_>>());
    let rate_hz = times_s().find_map(|times_s| frame_rate_hz(&times_s)).unwrap_or(DEFAULT_RATE_HZ);
    let output = files::Unfinished::file(film)?;
    match Encoder::start(&output.path(), frames.size_px, rate_hz) {
        Ok(encoder) => {
            let images = frames.frames.map(|frame| frame.map(|frame| overlay.drawn(&frame)));
            encoder.encode(images, film)?;
            output.finish()?;
            Ok(film.into())
        }
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            write_images(overlay, frames.frames, &film.with_extension(""))
        }
        Err(source) => Err(write_error(film, source)),
    }
}

/// The frame rate from the median time step (1/s).
fn frame_rate_hz(times_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).filter(|step| **step > 0.0).map(|step| 1.0 / step)
}

/// The file of the images' times.
const TIMING: &str = "timing.toml";
/// Its first line: only what it says is replaced by a later overlay.
const DRAWN: &str = "# Drawn by `breakshot detect --overlay`.";

/// Writes the images and their times in the layout that breakshot reads as a film; the folder is complete when it has its name.
fn write_images(
    overlay: &Overlay,
    frames: impl Iterator<Item = breakshot::Result<Frame>>,
    folder: &Path,
) -> breakshot::Result<PathBuf> {
    let is_earlier =
        std::fs::read_to_string(folder.join(TIMING)).is_ok_and(|text| text.lines().next() == Some(DRAWN));
    if !is_earlier && std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) {
        let needed = "a new name, or the folder of an earlier overlay";
        return Err(Error::invalid(
            folder.display().to_string(),
            "the folder",
            "one that holds something",
            needed,
        ));
    }
    let output = files::Unfinished::folder(folder)?;
    write_each_image(overlay, frames, &output.path())?;
    if is_earlier {
        std::fs::remove_dir_all(folder).map_err(|source| write_error(folder, source))?;
    }
    output.finish()?;
    Ok(folder.into())
}

fn write_each_image(
    overlay: &Overlay,
    frames: impl Iterator<Item = breakshot::Result<Frame>>,
    folder: &Path,
) -> breakshot::Result<()> {
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
    let file = folder.join(TIMING);
    let timing = format!("{DRAWN}\ntimes_s = [{}]\n", times_s.join(", "));
    std::fs::write(&file, timing).map_err(|source| write_error(&file, source))
}
