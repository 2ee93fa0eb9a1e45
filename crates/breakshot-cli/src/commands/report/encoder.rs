//! Films that `ffmpeg` encodes from images.

use breakshot::Error;
use breakshot::report::RgbImage;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// The error of an output that cannot be written.
pub(crate) fn write_error(path: &Path, source: std::io::Error) -> Error {
    Error::Write { path: path.into(), source }
}

/// Longest time in which the encoder takes no frame, and in which it completes the film.
const PATIENCE: Duration = Duration::from_mins(2);
/// Time between two looks at a process that is about to end.
const LOOK: Duration = Duration::from_millis(5);

/// A running `ffmpeg` that encodes the raw RGB images it receives on its standard input; it is ended when it is dropped, and when it
/// takes no image for too long.
pub(crate) struct Encoder {
    process: Arc<Mutex<Child>>,
    images: Option<ChildStdin>,
    /// A message for each image that it has taken; without one for too long, the process is ended.
    taken: Sender<()>,
    has_stalled: Arc<AtomicBool>,
    /// Reads its messages and returns the last one.
    messages: Option<JoinHandle<String>>,
}

impl Encoder {
    /// Starts `ffmpeg` for a film of images of this size.
    ///
    /// # Errors
    /// It is not installed ([`std::io::ErrorKind::NotFound`]), or cannot be started.
    pub(crate) fn start(film: &Path, [width, height]: [usize; 2], rate_hz: f64) -> std::io::Result<Self> {
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

    /// Encodes all images and completes the film; errors name `film`.
    pub(crate) fn encode(
        mut self,
        images: impl Iterator<Item = breakshot::Result<RgbImage>>,
        film: &Path,
    ) -> breakshot::Result<()> {
        let mut written = Ok(());
        for image in images {
            written = self.write(&image?.rgb);
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
