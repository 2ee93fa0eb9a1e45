//! A recording by the program `ffmpeg`: H.264 in an MP4, each picture with the time at which it was taken.

use super::args::LONGEST_S;
use super::interrupt::interrupted;
use super::source::Source;
use breakshot::{Error, Result};
use std::collections::VecDeque;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Longest time without a picture.
const PATIENCE: Duration = Duration::from_secs(10);
/// Time between two looks at the process.
const LOOK: Duration = Duration::from_millis(50);
/// Quality of the coding: differences of tracks stay far below the noise of a camera.
const QUALITY: &str = "12";
/// The last messages of `ffmpeg` that are kept.
const MESSAGES: usize = 4;

/// What is recorded.
pub(crate) struct Recording<'a> {
    pub(crate) source: &'a Source,
    /// Settings of a camera of this machine.
    pub(crate) size: Option<[u32; 2]>,
    pub(crate) rate_hz: Option<f64>,
    pub(crate) coding: Option<&'a str>,
    /// Pictures that are left out at the beginning (s), while a camera adapts itself to the light.
    pub(crate) skipped_s: f64,
    /// The length; until the user interrupts it if not given.
    pub(crate) seconds: Option<f64>,
}

/// Records until the length is reached, the source ends or the user interrupts it; returns warnings.
///
/// # Errors
/// No `ffmpeg`; no such device or stream; no picture for ten seconds; a file that cannot be written.
pub(crate) fn record(recording: &Recording, output: &Path) -> Result<Vec<String>> {
    check_device(recording.source)?;
    let interrupted = interrupted();
    let is_ended = || interrupted.load(Ordering::Relaxed);
    let source = recording.source;
    let first = Process::start(recording, output, Times::Source)?.recorded(source, is_ended)?;
    let Ended::WithoutTimes(format) = first else { return Ok(Vec::new()) };
    Process::start(recording, output, Times::Arrival(format))?.recorded(source, is_ended)?;
    Ok(vec![format!(
        "{source}: its pictures have no times; the times of their arrival are used, which vary with the network"
    )])
}

/// The times of the pictures.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Times {
    /// Those of the camera or the stream.
    Source,
    /// Those at which the pictures of this format arrive.
    Arrival(&'static str),
}

/// How a recording ended.
enum Ended {
    Whole,
    /// Before its beginning, because pictures of this format have no times.
    WithoutTimes(&'static str),
}

/// Streams of single pictures, whose times `ffmpeg` would make up from a rate.
const WITHOUT_TIMES: [&str; 3] = ["mpjpeg", "mjpeg", "jpeg_pipe"];

/// An error unless a camera of this machine exists; it lists those that do.
fn check_device(source: &Source) -> Result<()> {
    let Source::Device(path) = source else { return Ok(()) };
    if path.exists() {
        return Ok(());
    }
    let entries = std::fs::read_dir("/dev").into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut cameras: Vec<String> = names.filter(|name| name.starts_with("video")).collect();
    cameras.sort();
    let needed = match cameras.as_slice() {
        [] => "a camera of this machine; it has none".to_owned(),
        names => format!("one of /dev/{}", names.join(", /dev/")),
    };
    Err(refused(source, "no such device", &needed))
}

fn refused(source: &Source, found: &str, needed: &str) -> Error {
    Error::invalid(source.to_string(), "the source", found, needed)
}

/// What a running `ffmpeg` reports.
enum Report {
    /// The format of the source.
    Format(String),
    /// New pictures.
    Pictures,
}

/// A running `ffmpeg`; it is ended when it is dropped.
struct Process {
    child: Child,
    times: Times,
    /// Closed when the process ends.
    reports: Receiver<Report>,
    messages: Option<JoinHandle<Vec<String>>>,
}

impl Process {
    fn start(recording: &Recording, output: &Path, times: Times) -> Result<Self> {
        let mut command = Command::new("ffmpeg");
        command.args(["-hide_banner", "-nostats", "-loglevel", "level+info"]);
        command.args(["-stats_period", "0.1", "-progress", "pipe:1"]);
        if let Times::Arrival(format) = times {
            // No picture is kept back to find out what the stream contains.
            command.args(["-fflags", "nobuffer", "-probesize", "32", "-analyzeduration", "0", "-f", format]);
        }
        input(&mut command, recording)?;
        coding(&mut command, recording, times);
        let mut file = OsString::from("file:");
        file.push(
            std::path::absolute(output).map_err(|source| Error::Write { path: output.into(), source })?,
        );
        command.arg(file).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // Ctrl-C is for this program, which then lets `ffmpeg` complete the file.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(|error| not_started(recording.source, &error))?;
        let (progress, log) = (child.stdout.take(), child.stderr.take());
        let (sender, reports) = channel();
        let formats = sender.clone();
        std::thread::spawn(move || {
            if let Some(progress) = progress {
                report_pictures(BufReader::new(progress), &sender);
            }
        });
        let messages = std::thread::spawn(move || {
            log.map(|log| last_errors(BufReader::new(log), &formats)).unwrap_or_default()
        });
        Ok(Self { child, times, reports, messages: Some(messages) })
    }

    /// Waits for the end of the recording.
    fn recorded(mut self, source: &Source, is_ended: impl Fn() -> bool) -> Result<Ended> {
        let mut is_asked_to_end = false;
        let mut has_pictures = false;
        let mut last_picture = Instant::now();
        loop {
            match self.reports.recv_timeout(LOOK) {
                Ok(Report::Pictures) => (has_pictures, last_picture) = (true, Instant::now()),
                Ok(Report::Format(format)) => {
                    let lacks_times = matches!(source, Source::Address(_)) && self.times == Times::Source;
                    let known =
                        WITHOUT_TIMES.into_iter().find(|known| format.split(',').any(|name| name == *known));
                    if let Some(format) = known.filter(|_| lacks_times) {
                        return Ok(Ended::WithoutTimes(format));
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                // Its outputs are closed: it ends.
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if is_ended() && !is_asked_to_end {
                is_asked_to_end = true;
                self.ask_to_end();
            }
            if last_picture.elapsed() > PATIENCE {
                let found = format!("no picture for {:.0} s", PATIENCE.as_secs_f64());
                return Err(refused(source, &found, "a camera or stream that delivers pictures"));
            }
        }
        self.finished(source)?;
        if has_pictures {
            return Ok(Ended::Whole);
        }
        Err(refused(source, "a recording that ended before its first picture", "a longer recording"))
    }

    /// Asks it to complete the file and to end, as a user at its terminal would.
    fn ask_to_end(&mut self) {
        if let Some(input) = &mut self.child.stdin {
            // An error means that the process has already ended.
            let _ = input.write_all(b"q").and_then(|()| input.flush());
        }
    }

    /// Waits for its end; an error with its own reason if it failed.
    fn finished(mut self, source: &Source) -> Result<()> {
        let begun = Instant::now();
        let status = loop {
            match self.child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) if begun.elapsed() < PATIENCE => std::thread::sleep(LOOK),
                Ok(None) => return Err(refused(source, "an `ffmpeg` that does not end", "a running camera")),
                Err(error) => return Err(not_started(source, &error)),
            }
        };
        if status.success() {
            return Ok(());
        }
        let messages = self.messages.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        Err(reason(source, &messages))
    }
}

/// Reports pictures whenever the number of those recorded has grown.
fn report_pictures(progress: impl BufRead, reports: &Sender<Report>) {
    let mut count = 0;
    for line in progress.lines().map_while(std::result::Result::ok) {
        let number = line.strip_prefix("frame=").and_then(|number| number.trim().parse::<u64>().ok());
        if let Some(number) = number.filter(|&number| number > count) {
            count = number;
            if reports.send(Report::Pictures).is_err() {
                return;
            }
        }
    }
}

/// The last errors of a log; the format of the source is reported.
fn last_errors(log: impl BufRead, reports: &Sender<Report>) -> Vec<String> {
    let mut last = VecDeque::new();
    for text in log.split(b'\n').map_while(std::result::Result::ok) {
        let text = String::from_utf8_lossy(&text).replace(char::is_control, " ");
        // `[info] Input #0, mpjpeg, from 'http://..':`
        if let Some((format, _)) =
            text.strip_prefix("[info] Input #0, ").and_then(|rest| rest.split_once(", from "))
        {
            // An error means that nobody waits any more.
            let _ = reports.send(Report::Format(format.into()));
        }
        let Some((_, message)) = ["[error] ", "[fatal] "].iter().find_map(|level| text.split_once(level))
        else {
            continue;
        };
        last.push_back(message.trim().to_owned());
        if last.len() > MESSAGES {
            last.pop_front();
        }
    }
    last.into()
}

impl Drop for Process {
    fn drop(&mut self) {
        // Errors mean that the process has already ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The arguments that open the source.
fn input(command: &mut Command, recording: &Recording) -> Result<()> {
    match recording.source {
        Source::Device(path) => {
            // The kernel's times of the pictures.
            command.args(["-f", "v4l2", "-timestamps", "default"]);
            if let Some([width, height]) = recording.size {
                command.args(["-video_size", &format!("{width}x{height}")]);
            }
            if let Some(rate_hz) = recording.rate_hz {
                command.args(["-framerate", &rate_hz.to_string()]);
            }
            if let Some(coding) = recording.coding {
                command.args(["-input_format", coding]);
            }
            command.arg("-i").arg(path);
        }
        Source::Address(address) if address.starts_with("rtsp") => {
            // Over TCP no part of a picture is lost.
            command.args(["-protocol_whitelist", "rtsp,rtsps,rtp,srtp,tcp,tls,udp,crypto"]);
            command.args(["-rtsp_transport", "tcp", "-i", address]);
        }
        Source::Address(address) => {
            command.args(["-protocol_whitelist", "http,https,httpproxy,tcp,tls,crypto", "-i", address]);
        }
        Source::File(path) => {
            let mut file = OsString::from("file:");
            file.push(
                std::path::absolute(path).map_err(|source| Error::Read { path: path.clone(), source })?,
            );
            if !path.is_file() {
                let needed = "a video file, v4l2:/dev/video0, rtsp://.. or http://..";
                return Err(refused(recording.source, "no such file", needed));
            }
            command.args(["-protocol_whitelist", "file", "-re", "-i"]).arg(file);
        }
    }
    Ok(())
}

/// The arguments of the coding: pictures as they come, with their own times, none repeated or left out.
fn coding(command: &mut Command, recording: &Recording, times: Times) {
    command.args(["-map", "0:V:0", "-an", "-vsync", "passthrough"]);
    let (clock, stamps) = match times {
        Times::Source => ("-1", ""),
        // In microseconds: the streams' own clock counts pictures of a rate that is made up.
        Times::Arrival(_) => ("1:1000000", "settb=1/1000000,setpts=RTCTIME-RTCSTART,"),
    };
    command.args(["-enc_time_base", clock]);
    if recording.skipped_s > 0.0 {
        command.args(["-ss", &recording.skipped_s.to_string()]);
    }
    command.args(["-t", &recording.seconds.unwrap_or(LONGEST_S).to_string()]);
    // Odd sizes have no 4:2:0 chroma.
    command.args(["-vf", &format!("{stamps}crop=trunc(iw/2)*2:trunc(ih/2)*2:0:0"), "-pix_fmt", "yuv420p"]);
    command.args(["-c:v", "libx264", "-preset", "veryfast", "-tune", "zerolatency", "-crf", QUALITY]);
    if recording.source.takes_now() {
        command.args(["-metadata", "creation_time=now"]);
    } else {
        command.args(["-map_metadata", "-1"]);
    }
    command.args(["-f", "mp4", "-y"]);
}

fn not_started(source: &Source, error: &std::io::Error) -> Error {
    let found = match error.kind() {
        ErrorKind::NotFound => "not readable without the program `ffmpeg`, which is not installed".to_owned(),
        _ => format!("not readable: the program `ffmpeg` cannot be started ({error})"),
    };
    refused(source, &found, "an installed `ffmpeg`")
}

/// The error of `ffmpeg`'s own messages, with what would help where that is known.
fn reason(source: &Source, messages: &[String]) -> Error {
    let all = messages.join("; ").replace(&source_text(source), "the source");
    let needed = match () {
        () if all.contains("Device or resource busy") => "a camera that no other program uses",
        () if all.contains("Permission denied") => "the right to read it (on many systems the group `video`)",
        () if all.contains("No space left") => "space for the recording",
        () if matches!(source, Source::Device(_)) => {
            "a size, rate and coding of the camera (`v4l2-ctl --list-formats-ext` lists them)"
        }
        () => "a camera or stream that `ffmpeg` can read",
    };
    refused(source, &format!("refused by `ffmpeg` ({all})"), needed)
}

/// The source as `ffmpeg` was given it; it may contain a password.
fn source_text(source: &Source) -> String {
    match source {
        Source::Device(path) | Source::File(path) => path.display().to_string(),
        Source::Address(address) => address.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_gives_the_format_and_the_last_errors() {
        let log = "[info] Input #0, mov,mp4,m4a, from 'a.mp4':\n[info] x\n[v4l2 @ 0x1] [error] first\n[fatal] second\n";
        let (sender, reports) = channel();
        assert_eq!(last_errors(log.as_bytes(), &sender), ["first", "second"]);
        assert!(matches!(reports.try_recv(), Ok(Report::Format(format)) if format == "mov,mp4,m4a"));
        let many: Vec<String> = (0..9).map(|k| format!("[error] {k}\n")).collect();
        assert_eq!(last_errors(many.concat().as_bytes(), &sender), ["5", "6", "7", "8"]);
    }

    #[test]
    fn pictures_are_reported_when_their_number_grows() {
        let (sender, reports) = channel();
        report_pictures("frame=0\nframe= 2\nframe=2\nframe=x\nfps=3\nframe=5\n".as_bytes(), &sender);
        drop(sender);
        assert_eq!(reports.iter().count(), 2);
    }

    #[test]
    fn errors_name_what_helps_and_no_password() {
        let source = Source::of("rtsp://user:secret@cam/x").unwrap();
        let message = reason(&source, &["rtsp://user:secret@cam/x: 401 Unauthorized".into()]).to_string();
        assert!(message.contains("401") && !message.contains("secret"), "{message}");
        let device = Source::of("v4l2:/dev/video0").unwrap();
        for (found, needed) in
            [("Device or resource busy", "no other program"), ("Invalid argument", "list-formats")]
        {
            let message = reason(&device, &[found.into()]).to_string();
            assert!(message.contains(needed), "{message}");
        }
    }
}
