//! Films that the built-in decoder does not read, or not as fast, through the program `ffmpeg`: luma and times, nothing else.
//!
//! One process gives both: luma planes on its output (a Y4M stream of nothing but luma), and on its error output, in
//! front of each plane, a line with the time, size and depth of the frame (`showinfo`).  Frames come as they are
//! stored: none is doubled or dropped to keep a rate, and grey levels are not stretched.

use super::showinfo::{Info, Line};
use crate::capture::image::{Frame, GreyImage};
use crate::capture::source::error::Refusal;
use crate::capture::source::limits::check_size;
use crate::capture::source::opened::Opened;
use crate::capture::source::timestamps::NEEDED_TIMES;
use crate::error::{Error, Result};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};

/// Codings of pixels whose luma can be taken out as it is; `ffmpeg` turns any other into the nearest of these.
const PIXELS: &str = "yuv420p|yuvj420p|yuv422p|yuvj422p|yuv444p|yuvj444p|yuv440p|yuvj440p|yuv411p|yuv410p|gray\
    |yuv420p10le|yuv422p10le|yuv444p10le|yuv420p12le|yuv422p12le|yuv444p12le|gray10le|gray12le|gray16le";
/// Each field of an interlaced film becomes a frame of its own: it was taken at a time of its own.
const FIELDS: &str = "bwdif=mode=send_field:deint=interlaced,";
/// Threads that decode: more cost a tenth more CPU time, and films are worked on side by side.
const THREADS: &str = "1";

/// Starts decoding `path`; `refused` says what the built-in decoder had to say.
pub(crate) fn open(path: &Path, refused: &Refusal) -> Result<Opened> {
    let mut warnings = Vec::new();
    let (mut stream, mut first) = Stream::start(path, refused, "")?;
    if first.interlaced {
        warnings.push(
            "the film is interlaced: each frame was taken apart into two, each of half the height"
                .to_string(),
        );
        (stream, first) = Stream::start(path, refused, FIELDS)?;
    }
    check_size(first.width as u64, first.height as u64).map_err(|refusal| refusal.of(path))?;
    let size_px = [first.width, first.height];
    stream.next = Some(first);
    let tick_s = Some(stream.tick[0] / stream.tick[1]);
    Ok(Opened { size_px, frame_count: None, warnings, frames: Box::new(stream), tick_s })
}

/// A film that is being decoded.
struct Stream {
    path: PathBuf,
    program: Child,
    luma: ChildStdout,
    lines: Receiver<Line>,
    tick: [f64; 2],
    /// The frame whose line has been read already.
    next: Option<Info>,
    first_ticks: Option<i64>,
    last_ticks: Option<i64>,
    /// That of all frames so far.
    size_px: Option<[usize; 2]>,
}

impl Stream {
    /// The program at work, and its first frame's line.
    fn start(path: &Path, refused: &Refusal, filter: &str) -> Result<(Self, Info)> {
        let mut file = OsString::from("file:");
        file.push(std::path::absolute(path).map_err(|source| Error::Read { path: path.into(), source })?);
        let mut command = Command::new("ffmpeg");
        command.args(["-nostdin", "-hide_banner", "-nostats", "-loglevel", "level+info"]);
        // A file may name others; none is fetched from anywhere.
        command.args(["-protocol_whitelist", "file", "-threads", THREADS, "-flags", "unaligned", "-i"]);
        command.arg(file).args(["-map", "0:V:0", "-vsync", "passthrough", "-vf"]);
        command.arg(format!("{filter}format={PIXELS},extractplanes=y,showinfo=checksum=0"));
        // Written row by row from the decoded picture into the pipe: raw video would be copied once more, and so would
        // rows that are first gathered.
        command.args(["-avioflags", "direct", "-strict", "-1", "-f", "yuv4mpegpipe", "-"]);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut program = command.spawn().map_err(|e| without(&e, refused).of(path))?;
        let (Some(luma), Some(said)) = (program.stdout.take(), program.stderr.take()) else {
            return Err(Refusal::damaged("no way to hear from `ffmpeg`").of(path));
        };
        widen(&luma);
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for text in BufReader::new(said).split(b'\n').map_while(std::result::Result::ok) {
                if let Some(line) = Line::of(&String::from_utf8_lossy(&text))
                    && sender.send(line).is_err()
                {
                    return;
                }
            }
        });
        let mut stream = Self {
            path: path.into(),
            program,
            luma,
            lines,
            tick: [f64::NAN; 2],
            next: None,
            first_ticks: None,
            last_ticks: None,
            size_px: None,
        };
        let first = stream.info().map_err(|refusal| refusal.of(path))?;
        let first = first
            .ok_or_else(|| Refusal::damaged(format!("{}, and no frame in it", refused.found)).of(path))?;
        Ok((stream, first))
    }

    /// The next frame's line; none once the film has ended as it should.
    fn info(&mut self) -> std::result::Result<Option<Info>, Refusal> {
        if let Some(info) = self.next.take() {
            return Ok(Some(info));
        }
        while let Ok(line) = self.lines.recv() {
            match line {
                Line::Tick(tick) => self.tick = tick,
                Line::Frame(info) => return Ok(Some(info)),
                Line::Error(said) => return Err(Refusal::damaged(format!("`ffmpeg` says: {said}"))),
            }
        }
        match self.program.wait() {
            Ok(status) if status.success() => Ok(None),
            Ok(status) => Err(Refusal::damaged(format!("`ffmpeg` gave up ({status})"))),
            Err(e) => Err(Refusal::damaged(format!("`ffmpeg` was lost ({e})"))),
        }
    }

    fn advance(&mut self) -> std::result::Result<Option<Frame>, Refusal> {
        let Some(Info { ticks, width, height, bits, .. }) = self.info()? else { return Ok(None) };
        let first = self.size_px.is_none();
        if *self.size_px.get_or_insert([width, height]) != [width, height] {
            return Err(Refusal::damaged(format!("pictures whose size changes to {width} x {height} px")));
        }
        let needed_times = |found: String| Refusal { needed: NEEDED_TIMES.into(), ..Refusal::damaged(found) };
        let ticks = ticks.ok_or_else(|| needed_times("a frame without a time stamp".into()))?;
        // Divided last, as by the demuxer of our own: the same bits.
        let shown = (ticks - *self.first_ticks.get_or_insert(ticks)) as f64;
        let time_s = shown * self.tick[0] / self.tick[1];
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
            Refusal::damaged(format!("`ffmpeg` broke off in the frame at {time_s:.4} s ({e})"))
        })?;
        Ok(Some(Frame { time_s, image: GreyImage { width, height, pixels } }))
    }

    /// The line in front of each plane, and the one in front of all.
    fn skip_lines(&mut self, first: bool) -> std::io::Result<()> {
        for _ in 0..if first { 2 } else { 1 } {
            let mut byte = [0];
            while byte != *b"\n" {
                self.luma.read_exact(&mut byte)?;
            }
        }
        Ok(())
    }

    /// So many bytes, into memory that nobody filled before.
    fn read(&mut self, count: usize) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::with_capacity(count);
        self.luma.by_ref().take(count as u64).read_to_end(&mut bytes)?;
        if bytes.len() == count { Ok(bytes) } else { Err(ErrorKind::UnexpectedEof.into()) }
    }

    /// Grey levels of more than eight bits, rounded to eight.
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

impl Iterator for Stream {
    type Item = Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        self.advance().map_err(|refusal| refusal.of(&self.path)).transpose()
    }
}

impl Drop for Stream {
    /// Nobody waits for frames that nobody reads.
    fn drop(&mut self) {
        // It may have ended by itself; either way it is gone then.
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// Lets more of a frame wait in the pipe (bytes), so that both sides are woken less often; Linux lends so much to everybody.
#[cfg(target_os = "linux")]
const PIPE_BYTES: usize = 1 << 20;

#[cfg(target_os = "linux")]
fn widen(pipe: &ChildStdout) {
    // A pipe that stays as it is works as well.
    let _ = rustix::pipe::fcntl_setpipe_size(pipe, PIPE_BYTES);
}

#[cfg(not(target_os = "linux"))]
fn widen(_: &ChildStdout) {}

/// What to say where `ffmpeg` would be needed and cannot be started.
fn without(error: &std::io::Error, refused: &Refusal) -> Refusal {
    let why = match error.kind() {
        ErrorKind::NotFound => "which is not installed or not on the PATH".to_string(),
        _ => format!("which cannot be started ({error})"),
    };
    let needed = format!("the program `ffmpeg`, {why}; without it: {}", refused.needed);
    Refusal { needed, ..refused.clone() }
}
