//! Single PNG images and folders of them.

use super::error::SourceError;
use super::limits::{MAX_FRAMES, check_size};
use super::opened::Opened;
use super::{sniff, timestamps};
use crate::capture::image::{Frame, GreyImage};
use crate::error::{Error, Result};
use crate::files;
use png::{BitDepth, ColorType, Decoder, Limits, Transformations};
use serde::Deserialize;
use std::cmp::Ordering;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

/// The file that holds the times of the images in a folder.
const TIMING: &str = "timing.toml";
/// The requirement on such a folder, for messages.
const NEEDED_TIMING: &str =
    "a file timing.toml among the pictures with `frame_rate_hz = 60.0` or `times_s = [0.0, 0.0167, ...]`";
/// Memory limit of the PNG decoder (bytes): twice the largest image.
const MAX_PNG_BYTES: usize = 512 << 20;

/// A single image: one frame at time 0.
pub(super) fn open_one(path: &Path) -> Result<Opened> {
    let size_px = size_px(path)?;
    let file = PathBuf::from(path);
    let frames = std::iter::once_with(move || Ok(Frame { time_s: 0.0, image: picture(&file)? }));
    Ok(Opened { size_px, frame_count: Some(1), warnings: Vec::new(), frames: Box::new(frames), tick_s: None })
}

/// A folder of images in the natural order of their names.
pub(super) fn open_folder(path: &Path) -> Result<Opened> {
    let files = pictures_in(path)?;
    let times_s = times_s(path, files.len())?;
    let size_px = size_px(&files[0])?;
    let frame_count = Some(files.len());
    let warnings = timestamps::warnings(&times_s, 0.0);
    let frames = files.into_iter().zip(times_s).map(move |(file, time_s)| {
        let image = picture(&file)?;
        if [image.width, image.height] != size_px {
            let found = format!("{} x {} px", image.width, image.height);
            let needed = format!("{} x {} px, as the folder's first picture", size_px[0], size_px[1]);
            return Err(Error::video(&file, found, needed));
        }
        Ok(Frame { time_s, image })
    });
    Ok(Opened { size_px, frame_count, warnings, frames: Box::new(frames), tick_s: None })
}

fn pictures_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let unreadable = |source| Error::Read { path: folder.into(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
            files.push(file);
        }
    }
    if files.is_empty() || files.len() as u64 > MAX_FRAMES {
        let found = format!("a folder with {} PNG pictures", files.len());
        return Err(Error::video(
            folder,
            found,
            format!("1 to {MAX_FRAMES} files *.png and, for a film, {TIMING}"),
        ));
    }
    files.sort_unstable_by(|a, b| natural_order(&name(a), &name(b)).then_with(|| a.cmp(b)));
    Ok(files)
}

fn name(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// `frame_9` before `frame_10`: runs of digits are compared as numbers.
fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    while !a.is_empty() && !b.is_empty() {
        let (part_a, part_b);
        (part_a, a) = leading_part(a);
        (part_b, b) = leading_part(b);
        let digits = |part: &str| part.starts_with(|c: char| c.is_ascii_digit());
        let order = if digits(part_a) && digits(part_b) {
            let (value_a, value_b) = (part_a.trim_start_matches('0'), part_b.trim_start_matches('0'));
            value_a.len().cmp(&value_b.len()).then_with(|| value_a.cmp(value_b))
        } else {
            part_a.cmp(part_b)
        };
        if order.is_ne() {
            return order;
        }
    }
    a.len().cmp(&b.len())
}

/// The leading run of digits or of other characters, and the rest.
fn leading_part(text: &str) -> (&str, &str) {
    let digit = text.starts_with(|c: char| c.is_ascii_digit());
    text.split_at(text.find(|c: char| c.is_ascii_digit() != digit).unwrap_or(text.len()))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Timing {
    frame_rate_hz: Option<f64>,
    times_s: Option<Vec<f64>>,
}

/// The times of the folder's `count` images (s); the first one is 0.
fn times_s(folder: &Path, count: usize) -> Result<Vec<f64>> {
    let file = folder.join(TIMING);
    if !file.exists() {
        if count == 1 {
            return Ok(vec![0.0]);
        }
        return Err(Error::video(folder, format!("{count} pictures and no {TIMING}"), NEEDED_TIMING));
    }
    let timing: Timing = files::read_toml(&file)?;
    match timing {
        Timing { frame_rate_hz: Some(rate), times_s: None } if rate.is_finite() && rate > 0.0 => {
            Ok((0..count).map(|n| n as f64 / rate).collect())
        }
        Timing { frame_rate_hz: Some(rate), times_s: None } => {
            Err(Error::video(&file, format!("frame_rate_hz = {rate}"), "a positive number"))
        }
        Timing { frame_rate_hz: None, times_s: Some(times_s) } => {
            if times_s.len() != count {
                let found = format!("{} times for {count} pictures", times_s.len());
                return Err(Error::video(&file, found, "one time for each picture"));
            }
            if let Some(n) = (1..count).find(|&n| !(times_s[n - 1] < times_s[n] && times_s[n].is_finite())) {
                let found = format!("time stamps that go back: {} s after {} s", times_s[n], times_s[n - 1]);
                return Err(Error::video(&file, found, timestamps::NEEDED_TIMES));
            }
            Ok(times_s.iter().map(|time_s| time_s - times_s[0]).collect())
        }
        _ => Err(Error::video(&file, "not just one of `frame_rate_hz` and `times_s`", NEEDED_TIMING)),
    }
}

fn undecodable(path: &Path, error: &png::DecodingError) -> Error {
    SourceError::damaged(format!("a PNG that cannot be decoded ({error})")).for_file(path)
}

fn size_px(path: &Path) -> Result<[usize; 2]> {
    let mut decoder = decoder(path)?;
    let info = decoder.read_header_info().map_err(|e| undecodable(path, &e))?;
    Ok([info.width as usize, info.height as usize])
}

/// A decoder of a file that starts with the PNG signature and has an accepted size.
fn decoder(path: &Path) -> Result<Decoder<BufReader<File>>> {
    let unreadable = |source| Error::Read { path: path.into(), source };
    let mut head = Vec::new();
    File::open(path).and_then(|file| file.take(8).read_to_end(&mut head)).map_err(unreadable)?;
    if !sniff::is_png(&head) {
        return Err(Error::video(path, "a file that is no PNG", "a PNG picture"));
    }
    let file = File::open(path).map_err(unreadable)?;
    let mut decoder = Decoder::new_with_limits(BufReader::new(file), Limits { bytes: MAX_PNG_BYTES });
    decoder.set_transformations(Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    let info = decoder.read_header_info().map_err(|e| undecodable(path, &e))?;
    check_size(u64::from(info.width), u64::from(info.height)).map_err(|error| error.for_file(path))?;
    Ok(decoder)
}

/// The luma of a PNG.
fn picture(path: &Path) -> Result<GreyImage> {
    let undecodable = |e| undecodable(path, &e);
    let mut reader = decoder(path)?.read_info().map_err(undecodable)?;
    let size = reader.output_buffer_size();
    let size = size.ok_or_else(|| SourceError::damaged("a PNG without an end").for_file(path))?;
    let mut samples = vec![0; size];
    let info = reader.next_frame(&mut samples).map_err(undecodable)?;
    if info.bit_depth == BitDepth::Sixteen {
        samples =
            samples.chunks_exact(2).map(|pair| eight_bits(u16::from_be_bytes([pair[0], pair[1]]))).collect();
    }
    let pixels = match info.color_type {
        ColorType::Grayscale | ColorType::Indexed => samples,
        ColorType::GrayscaleAlpha => samples.chunks_exact(2).map(|pixel| pixel[0]).collect(),
        ColorType::Rgb => samples.chunks_exact(3).map(luma).collect(),
        ColorType::Rgba => samples.chunks_exact(4).map(luma).collect(),
    };
    Ok(GreyImage { width: info.width as usize, height: info.height as usize, pixels })
}

/// The nearest 8-bit level.
fn eight_bits(level: u16) -> u8 {
    ((u32::from(level) * 255 + 32_767) / 65_535) as u8
}

/// Luma of red, green and blue (Rec. ITU-R BT.709), rounded.
fn luma(pixel: &[u8]) -> u8 {
    let weigh = |weight: u32, level: u8| weight * u32::from(level);
    ((weigh(2126, pixel[0]) + weigh(7152, pixel[1]) + weigh(722, pixel[2]) + 5000) / 10_000) as u8
}
