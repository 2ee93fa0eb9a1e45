//! Single PNG images and folders of them.

use super::limits::MAX_FRAMES;
use super::opened::Opened;
use super::picture::{png_colours, png_decoder, png_picture, png_size_px};
use super::{sniff, timestamps};
use crate::capture::image::{Frame, GreyImage};
use crate::error::{Error, Result};
use crate::files;
use serde::Deserialize;
use std::cmp::Ordering;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

/// The file that holds the times of the images in a folder.
pub(super) const TIMING: &str = "timing.toml";
/// The requirement on such a folder, for messages.
const NEEDED_TIMING: &str =
    "a file timing.toml among the pictures with `frame_rate_hz = 60.0` or `times_s = [0.0, 0.0167, ...]`";

/// A single image: one frame at time 0.
pub(super) fn open_one(path: &Path) -> Result<Opened> {
    let size_px = size_px(path)?;
    let file = PathBuf::from(path);
    let frames = std::iter::once_with(move || Ok(Frame { time_s: 0.0, image: picture(&file)? }));
    Ok(Opened {
        size_px,
        frame_count: Some(1),
        warnings: Vec::new(),
        frames: Box::new(frames),
        tick_s: None,
        lens: None,
    })
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
    Ok(Opened { size_px, frame_count, warnings, frames: Box::new(frames), tick_s: None, lens: None })
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

fn size_px(path: &Path) -> Result<[usize; 2]> {
    let decoder = png_decoder(bytes_of(path)?);
    decoder.and_then(|mut decoder| png_size_px(&mut decoder)).map_err(|error| error.for_file(path))
}

/// The bytes of a file that starts with the PNG signature.
fn bytes_of(path: &Path) -> Result<BufReader<File>> {
    let unreadable = |source| Error::Read { path: path.into(), source };
    let mut head = Vec::new();
    File::open(path).and_then(|file| file.take(8).read_to_end(&mut head)).map_err(unreadable)?;
    if !sniff::is_png(&head) {
        return Err(Error::video(path, "a file that is no PNG", "a PNG picture"));
    }
    Ok(BufReader::new(File::open(path).map_err(unreadable)?))
}

/// The luma of a PNG.
fn picture(path: &Path) -> Result<GreyImage> {
    png_picture(bytes_of(path)?).map_err(|error| error.for_file(path))
}

/// Red, green and blue of a PNG file; nothing for one without colours and for files of other formats.
///
/// # Errors
/// A file that cannot be read, a PNG that is damaged.
pub fn colours(path: &Path) -> Result<Vec<GreyImage>> {
    if size_px(path).is_err() {
        return Ok(Vec::new());
    }
    png_colours(bytes_of(path)?).map_err(|error| error.for_file(path))
}
