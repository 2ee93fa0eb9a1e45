//! A film with its tracks drawn on it: encoded by `ffmpeg` if it is installed, otherwise a folder of images.

use breakshot::capture::Frame;
use breakshot::report::Overlay;
use breakshot::{Error, files};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

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
            encoder.encode(overlay, frames.frames, film)?;
            output.finish()?;
            Ok(film.into())
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

/// The frame rate from the median time step (1/s).
fn frame_rate_hz(times_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).filter(|step| **step > 0.0).map(|step| 1.0 / step)
}

/// Longest time in which the encoder takes no frame, and in which it completes the film.
const PATIENCE: Duration = Duration::from_mins(2);
/// Time between two looks at a process that is about to end.
const LOOK: Duration = Duration::from_millis(5);

/// A running `ffmpeg` that encodes the raw RGB images it receives on its standard input; it is ended when it is dropped, and when it
/// takes no image for too long.
struct Encoder {
    process: Arc<Mutex<Child>>,
    images: Option<ChildStdin>,
    /// A message for each image that it has taken; without one for too long, the process is ended.
    taken: Sender<()>,
    has_stalled: Arc<AtomicBool>,
    /// Reads its messages and returns the last one.
    messages: Option<JoinHandle<String>>,
}

impl Encoder {
    fn start(film: &Path, [width, height]: [usize; 2], rate_hz: f64) -> std::io::Result<Self> {
        let mut command = Command::new("ffmpeg");
        command.args(["-v", "error", "-nostdin", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
        command.args(["-s", &format!("{width}x{height}"), "-r", &format!("{rate_hz:.4}"), "-i", "pipe:0"]);
        // Many players need even sizes and 4:2:0 chroma subsampling.
        command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-crf", "18"]);
        command.args(["-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", "-y"]);
        // A name with a colon would be a protocol, one with a hyphen an option.
        let mut file = OsString::from("file:");
        file.push(std::path::absolute(film)?);
        command.arg(file);
        Self::of(command, PATIENCE)
    }

    fn of(mut command: Command, patience: Duration) -> std::io::Result<Self> {
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = command.spawn()?;
        let (images, log) = (process.stdin.take(), process.stderr.take());
        let messages = std::thread::spawn(move || {
            let lines =
                log.into_iter().flat_map(|log| BufReader::new(log).split(b'\n').map_while(Result::ok));
            let texts = lines.map(|line| String::from_utf8_lossy(&line).replace(char::is_control, " "));
            texts.filter(|text| !text.trim().is_empty()).last().unwrap_or_default()
        });
        let process = Arc::new(Mutex::new(process));
        let has_stalled = Arc::new(AtomicBool::new(false));
        let (taken, progress) = channel();
        let (watched, stalled) = (Arc::clone(&process), Arc::clone(&has_stalled));
        std::thread::spawn(move || {
            loop {
                match progress.recv_timeout(patience) {
                    Ok(()) => {}
                    Err(RecvTimeoutError::Disconnected) => return,
                    Err(RecvTimeoutError::Timeout) => break,
                }
            }
            stalled.store(true, Ordering::Relaxed);
            // An error means that the process has already ended.
            let _ = locked(&watched).kill();
        });
        Ok(Self { process, images, taken, has_stalled, messages: Some(messages) })
    }

    fn encode(
        mut self,
        overlay: &Overlay,
        frames: impl Iterator<Item = breakshot::Result<Frame>>,
        film: &Path,
    ) -> breakshot::Result<()> {
        let mut written = Ok(());
        for frame in frames {
            written = self.write(&overlay.drawn(&frame?).rgb);
            if written.is_err() {
                break;
            }
        }
        // Where `ffmpeg` has given up, its own reason comes before that of the closed pipe.
        self.finished().and(written).map_err(|source| write_error(film, source))
    }

    fn write(&mut self, image: &[u8]) -> std::io::Result<()> {
        let Some(images) = &mut self.images else { return Ok(()) };
        images.write_all(image)?;
        // Without a receiver the process has stalled: the next image meets a closed pipe.
        let _ = self.taken.send(());
        Ok(())
    }

    fn finished(&mut self) -> std::io::Result<()> {
        drop(self.images.take());
        let status = loop {
            // Not `wait`, which would keep the lock that ending the process needs.
            if let Some(status) = locked(&self.process).try_wait()? {
                break status;
            }
            std::thread::sleep(LOOK);
        };
        if self.has_stalled.load(Ordering::Relaxed) {
            return Err(std::io::Error::other("`ffmpeg` took no picture for too long"));
        }
        if status.success() {
            return Ok(());
        }
        let message = self.messages.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        Err(std::io::Error::other(format!("`ffmpeg` ended with {status}: {message}")))
    }
}

impl Drop for Encoder {
    fn drop(&mut self) {
        // Errors mean that the process has already ended.
        let mut process = locked(&self.process);
        let _ = process.kill();
        let _ = process.wait();
    }
}

/// A panic of the other thread leaves nothing half-done.
fn locked(process: &Mutex<Child>) -> MutexGuard<'_, Child> {
    process.lock().unwrap_or_else(PoisonError::into_inner)
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

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn an_encoder_that_takes_no_picture_is_ended() {
        let mut command = Command::new("sleep");
        command.arg("1000");
        let mut encoder = Encoder::of(command, Duration::from_millis(50)).unwrap();
        let image = vec![0; 1 << 20];
        // The pipe takes less than the first image.
        let written = encoder.write(&image);
        let message = encoder.finished().unwrap_err().to_string();
        assert!(written.is_err() && message.contains("took no picture"), "{message}");
    }

    #[test]
    fn an_encoder_that_does_not_end_is_ended() {
        let mut command = Command::new("sleep");
        command.arg("1000");
        let mut encoder = Encoder::of(command, Duration::from_millis(50)).unwrap();
        let message = encoder.finished().unwrap_err().to_string();
        assert!(message.contains("took no picture"), "{message}");
    }
}
