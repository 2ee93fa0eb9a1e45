//! Luma and times of a film's frames from a process of the program `ffmpeg`.
//!
//! The process writes luma planes to its standard output (a Y4M stream without colour) and, before each plane, a line
//! with the time, size and bit depth of the frame to its standard error (`showinfo`).  Frames are not duplicated or
//! dropped to keep a rate, and grey levels are not rescaled.

use super::showinfo::{Info, Line};
use super::watched::Watched;
use crate::capture::image::{Frame, GreyImage};
use crate::capture::source::error::SourceError;
use crate::capture::source::limits::check_size;
use crate::capture::source::opened::Opened;
use crate::capture::source::timestamps::NEEDED_TIMES;
use crate::error::{Error, Result};
use crate::files::check_file_name;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::process::{ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// Pixel formats whose luma plane is extracted unchanged; `ffmpeg` converts any other format into the nearest of these.
const PIXELS: &str = "yuv420p|yuvj420p|yuv422p|yuvj422p|yuv444p|yuvj444p|yuv440p|yuvj440p|yuv411p|yuv410p|gray\
    |yuv420p10le|yuv422p10le|yuv444p10le|yuv420p12le|yuv422p12le|yuv444p12le|gray10le|gray12le|gray16le";
/// The filter that makes a frame of each field of an interlaced film: fields are taken at different times.
const FIELDS: &str = "bwdif=mode=send_field:deint=interlaced,";
/// Decoding threads: more would cost 10 % more CPU time, and several films are processed in parallel.
const THREADS: &str = "1";

/// Longest time for one frame: the slowest ones take a second on a busy machine.
const PATIENCE: Duration = Duration::from_mins(1);

/// Starts decoding `path`; `reason` is the built-in decoder's reason not to decode it.
pub(crate) fn open(path: &Path, reason: &SourceError) -> Result<Opened> {
    let mut warnings = Vec::new();
    let (mut process, mut first) = Process::start(path, reason, "")?;
    if first.interlaced {
        warnings.push(
            "the film is interlaced: each frame was split into two, each of half the height".to_string(),
        );
        (process, first) = Process::start(path, reason, FIELDS)?;
    }
    check_size(first.width as u64, first.height as u64).map_err(|error| error.for_file(path))?;
    let size_px = [first.width, first.height];
    process.next = Some(first);
    let tick_s = Some(process.tick[0] / process.tick[1]);
    Ok(Opened { size_px, frame_count: None, warnings, frames: Box::new(process), tick_s, lens: None })
}

/// A running `ffmpeg` process and what is known about its frames.
struct Process {
    path: PathBuf,
    watched: Watched,
    luma: ChildStdout,
    lines: Receiver<Line>,
    /// The period of the clock as a fraction (s).
    tick: [f64; 2],
    /// A frame whose line has been read and whose luma has not.
    next: Option<Info>,
    first_ticks: Option<i64>,
    last_ticks: Option<i64>,
    /// The size of all frames so far.
    size_px: Option<[usize; 2]>,
}

impl Process {
    /// The running process and the line of its first frame.
    fn start(path: &Path, reason: &SourceError, filter: &str) -> Result<(Self, Info)> {
        // A line break in a name would be one in the log.
        check_file_name(path)?;
        let mut file = OsString::from("file:");
        file.push(std::path::absolute(path).map_err(|source| Error::Read { path: path.into(), source })?);
        let mut command = Command::new("ffmpeg");
        command.args(["-nostdin", "-hide_banner", "-nostats", "-loglevel", "level+info"]);
        // A film may refer to other files; only local ones are read.
        command.args(["-protocol_whitelist", "file", "-threads", THREADS, "-flags", "unaligned", "-i"]);
        command.arg(file).args(["-map", "0:V:0", "-vsync", "passthrough", "-vf"]);
        command.arg(format!("{filter}format={PIXELS},extractplanes=y,showinfo=checksum=0"));
        // Y4M with direct output writes rows from the decoded picture into the pipe; raw or buffered output would copy
        // them once more.
        command.args(["-avioflags", "direct", "-strict", "-1", "-f", "yuv4mpegpipe", "-"]);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|e| not_started(&e, reason).for_file(path))?;
        let (Some(luma), Some(log)) = (child.stdout.take(), child.stderr.take()) else {
            return Err(SourceError::damaged("an `ffmpeg` process without pipes").for_file(path));
        };
        widen(&luma);
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for text in BufReader::new(log).split(b'\n').map_while(std::result::Result::ok) {
                if let Some(line) = Line::of(&String::from_utf8_lossy(&text))
                    && sender.send(line).is_err()
                {
                    return;
                }
            }
        });
        let watched = Watched::new(child, PATIENCE);
        let mut process = Self {
            path: path.into(),
            watched,
            luma,
            lines,
            tick: [f64::NAN; 2],
            next: None,
            first_ticks: None,
            last_ticks: None,
            size_px: None,
        };
        let first = process.timed(Self::info).map_err(|error| error.for_file(path))?;
        let first = first.ok_or_else(|| {
            SourceError::damaged(format!("{}, and no frame in it", reason.found)).for_file(path)
        })?;
        Ok((process, first))
    }

    /// The next frame's line; `None` after the last frame, once the process has ended successfully.
    fn info(&mut self) -> std::result::Result<Option<Info>, SourceError> {
        if let Some(info) = self.next.take() {
            return Ok(Some(info));
        }
        // The log ends with the process.
        while let Ok(line) = self.lines.recv() {
            match line {
                Line::Tick(tick) => self.tick = tick,
                Line::Frame(info) => return Ok(Some(info)),
                Line::Error(message) => {
                    return Err(SourceError::damaged(format!("`ffmpeg` reports: {message}")));
                }
            }
        }
        match self.watched.ended() {
            Ok(status) if status.success() => Ok(None),
            Ok(status) => Err(SourceError::damaged(format!("`ffmpeg` gave up ({status})"))),
            Err(e) => Err(SourceError::damaged(format!("`ffmpeg` was lost ({e})"))),
        }
    }

    /// The result of `work`, which waits for the process; an error if it takes too long.
    fn timed<T>(
        &mut self,
        work: impl FnOnce(&mut Self) -> std::result::Result<T, SourceError>,
    ) -> std::result::Result<T, SourceError> {
        self.watched.begin();
        let result = work(self);
        if self.watched.end() {
            let silent_s = PATIENCE.as_secs_f64();
            return Err(SourceError::damaged(format!("`ffmpeg` gave no frame for {silent_s:.0} s")));
        }
        result
    }

    fn advance(&mut self) -> std::result::Result<Option<Frame>, SourceError> {
        let Some(Info { ticks, width, height, bits, .. }) = self.info()? else { return Ok(None) };
        let first = self.size_px.is_none();
        if *self.size_px.get_or_insert([width, height]) != [width, height] {
            return Err(SourceError::damaged(format!(
                "pictures whose size changes to {width} x {height} px"
            )));
        }
        let needed_times =
            |found: String| SourceError { needed: NEEDED_TIMES.into(), ..SourceError::damaged(found) };
        let ticks = ticks.ok_or_else(|| needed_times("a frame without a time stamp".into()))?;
        // The division is last, as in the built-in reader, so that times are equal bit for bit.
        let ticks_since_first = (ticks - *self.first_ticks.get_or_insert(ticks)) as f64;
        let time_s = ticks_since_first * self.tick[0] / self.tick[1];
        if !time_s.is_finite() || self.last_ticks.is_some_and(|last| ticks <= last) {
            return Err(needed_times(format!(
                "time stamps that go back: a frame at {time_s:.4} s after a later one"
            )));
        }
        self.last_ticks = Some(ticks);
        let read = self.skip_lines(first).and_then(|()| match bits {
            8 => self.read(width * height),
            _ => self.read_deep(width * height, bits),
        });
        let pixels = read.map_err(|e| {
            SourceError::damaged(format!("`ffmpeg` ended within the frame at {time_s:.4} s ({e})"))
        })?;
        Ok(Some(Frame { time_s, image: GreyImage { width, height, pixels } }))
    }

    /// Skips the header line before each plane and the stream's header before the first.
    fn skip_lines(&mut self, first: bool) -> std::io::Result<()> {
        for _ in 0..if first { 2 } else { 1 } {
            let mut byte = [0];
            while byte != *b"\n" {
                self.luma.read_exact(&mut byte)?;
            }
        }
        Ok(())
    }

    /// The next `count` bytes, without initializing the memory first.
    fn read(&mut self, count: usize) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::with_capacity(count);
        self.luma.by_ref().take(count as u64).read_to_end(&mut bytes)?;
        if bytes.len() == count { Ok(bytes) } else { Err(ErrorKind::UnexpectedEof.into()) }
    }

    /// `count` grey levels of more than eight bits, rounded to eight.
    fn read_deep(&mut self, count: usize, bits: u32) -> std::io::Result<Vec<u8>> {
        let bytes = self.read(2 * count)?;
        let shift = bits.saturating_sub(8).min(8);
        let rounded = |&level: &[u8; 2]| {
            let rounded = (u32::from(u16::from_le_bytes(level)) + (1 << shift >> 1)) >> shift;
            rounded.min(255) as u8
        };
        Ok(bytes.as_chunks::<2>().0.iter().map(rounded).collect())
    }
}

impl Iterator for Process {
    type Item = Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        self.timed(Self::advance).map_err(|error| error.for_file(&self.path)).transpose()
    }
}

/// Size of the pipe (bytes), so that both processes are woken less often; Linux allows this size to every user.
#[cfg(target_os = "linux")]
const PIPE_BYTES: usize = 1 << 20;

#[cfg(target_os = "linux")]
fn widen(pipe: &ChildStdout) {
    // On an error the pipe keeps its size and works as well.
    let _ = rustix::pipe::fcntl_setpipe_size(pipe, PIPE_BYTES);
}

#[cfg(not(target_os = "linux"))]
fn widen(_: &ChildStdout) {}

/// The error where `ffmpeg` is needed and cannot be started.
fn not_started(error: &std::io::Error, reason: &SourceError) -> SourceError {
    let why = match error.kind() {
        ErrorKind::NotFound => "which is not installed or not on the PATH".to_string(),
        _ => format!("which cannot be started ({error})"),
    };
    let needed = format!("the program `ffmpeg`, {why}; without it: {}", reason.needed);
    SourceError { needed, ..reason.clone() }
}
