//! The frames of a YUV4MPEG2 film: a header line, then for each frame a line and its planes, luma first.

use super::error::SourceError;
use super::limits::{MAX_FRAMES, check_size};
use super::opened::Opened;
use crate::capture::image::{Frame, GreyImage};
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Largest length of a header line (bytes).
const MAX_LINE_BYTES: u64 = 1024;

/// The values of the header line.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Header {
    width: u64,
    height: u64,
    frame_rate_hz: f64,
    /// Bytes of the planes after luma.
    colour_bytes: u64,
}

/// Opens a Y4M film and finds the offsets of all its frames.
pub(super) fn open(path: &Path, file: File) -> Result<Opened> {
    let length = file.metadata().map_err(|source| Error::Read { path: path.into(), source })?.len();
    let mut file = BufReader::new(file);
    let (header, offsets) = frame_offsets(&mut file, length).map_err(|error| error.for_file(path))?;
    let (width, height) = (header.width as usize, header.height as usize);
    let frame_count = offsets.len();
    let path = PathBuf::from(path);
    let frames = offsets.into_iter().enumerate().map(move |(n, offset)| {
        let mut pixels = vec![0; width * height];
        let read = file.seek(SeekFrom::Start(offset)).and_then(|_| file.read_exact(&mut pixels));
        read.map_err(|source| Error::Read { path: path.clone(), source })?;
        Ok(Frame { time_s: n as f64 / header.frame_rate_hz, image: GreyImage { width, height, pixels } })
    });
    Ok(Opened {
        size_px: [width, height],
        frame_count: Some(frame_count),
        warnings: Vec::new(),
        frames: Box::new(frames),
        tick_s: None,
        lens: None,
    })
}

/// The header and the offset of each frame's luma (bytes).
fn frame_offsets(
    file: &mut BufReader<File>,
    length: u64,
) -> std::result::Result<(Header, Vec<u64>), SourceError> {
    let line = line(file)?;
    let header = Header::of(&line)?;
    let size = header.width * header.height + header.colour_bytes;
    let mut offsets = Vec::new();
    let mut at = line.len() as u64 + 1;
    while at < length {
        let frame = self::line(file)?;
        if !(frame == "FRAME" || frame.starts_with("FRAME ")) {
            return Err(SourceError::damaged(format!(
                "no frame where frame {} should begin",
                offsets.len() + 1
            )));
        }
        at += frame.len() as u64 + 1;
        if length - at < size {
            let (n, left) = (offsets.len() + 1, length - at);
            return Err(SourceError::damaged(format!(
                "the file breaks off: frame {n} has {left} of {size} bytes"
            )));
        }
        if offsets.len() as u64 == MAX_FRAMES {
            let found = format!("more than {MAX_FRAMES} frames");
            return Err(SourceError::unsuitable(found, "a shorter film"));
        }
        offsets.push(at);
        at += size;
        file.seek_relative(size.cast_signed())
            .map_err(|e| SourceError::damaged(format!("unreadable ({e})")))?;
    }
    if offsets.is_empty() {
        return Err(SourceError::unsuitable("a film of 0 frames", "at least one frame"));
    }
    Ok((header, offsets))
}

/// One line of text without its line break.
fn line(file: &mut BufReader<File>) -> std::result::Result<String, SourceError> {
    let mut bytes = Vec::new();
    let read = file.take(MAX_LINE_BYTES).read_until(b'\n', &mut bytes);
    read.map_err(|e| SourceError::damaged(format!("unreadable ({e})")))?;
    if bytes.pop() != Some(b'\n') {
        return Err(SourceError::damaged("a header line that does not end"));
    }
    String::from_utf8(bytes).map_err(|_| SourceError::damaged("a header line that is no text"))
}

/// A ratio such as `30000:1001`; `None` for any other text.
fn ratio(text: &str) -> Option<(u32, u32)> {
    let (numerator, denominator) = text.split_once(':')?;
    Some((numerator.parse().ok()?, denominator.parse().ok()?))
}

impl Header {
    fn of(line: &str) -> std::result::Result<Self, SourceError> {
        let (mut width, mut height, mut rate, mut colours) = (0, 0, None, "420");
        for field in line.split(' ').skip(1).filter(|field| field.is_ascii() && !field.is_empty()) {
            let (name, value) = field.split_at(1);
            match name {
                "W" => width = value.parse().unwrap_or(0),
                "H" => height = value.parse().unwrap_or(0),
                "F" => rate = ratio(value),
                "C" => colours = value,
                "I" if !matches!(value, "p" | "?") => {
                    return Err(SourceError::convertible("an interlaced Y4M"));
                }
                _ => {}
            }
        }
        check_size(width, height)?;
        let Some((numerator, denominator)) = rate.filter(|&(n, d)| n > 0 && d > 0) else {
            return Err(SourceError::unsuitable("no frame rate", "a rate such as F60:1 in its header"));
        };
        let (half_width, half_height) = (width.div_ceil(2), height.div_ceil(2));
        let colour_bytes = match colours {
            "mono" => 0,
            "420" | "420jpeg" | "420paldv" | "420mpeg2" => 2 * half_width * half_height,
            "411" => 2 * width.div_ceil(4) * height,
            "422" => 2 * half_width * height,
            "444" => 2 * width * height,
            "444alpha" => 3 * width * height,
            other => {
                let found = format!("a Y4M of colour space {other}");
                let needed =
                    "8 bits a sample: 420, 420jpeg, 420paldv, 420mpeg2, 411, 422, 444, 444alpha or mono";
                return Err(SourceError::unsuitable(found, needed));
            }
        };
        let frame_rate_hz = f64::from(numerator) / f64::from(denominator);
        Ok(Self { width, height, frame_rate_hz, colour_bytes })
    }
}
