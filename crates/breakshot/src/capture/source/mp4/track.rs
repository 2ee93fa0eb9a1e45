//! The index of an MP4, a MOV or a fragmented MP4 (ISO/IEC 14496-12, 14496-15).
//!
//! Only the video track is read; other tracks are ignored.

use super::boxes::{self, Boxes, Bytes, four_cc};
use super::orientation::Orientation;
use super::samples::{self, Sample};
use super::timeline::Edit;
use crate::capture::source::error::SourceError;
use crate::capture::source::h264::config::{Framing, H264Config};
use crate::capture::source::limits::check_size;
use std::fs::File;

type Result<T> = std::result::Result<T, SourceError>;

/// The video track.
#[derive(Debug)]
pub(super) struct Track {
    /// Ticks of its clock per second.
    pub timescale: u32,
    /// Its coded pictures, in decoding order.
    pub samples: Vec<Sample>,
    /// The intervals that are displayed; empty if all of the track is.
    pub edits: Vec<Edit>,
    /// The rotation for display.
    pub orientation: Orientation,
    /// The decoder's configuration.
    pub config: H264Config,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// Reads the index of a file of `length` bytes and checks that the file holds all samples.
///
/// # Errors
/// A damaged or incomplete file, no video track, a coding other than H.264.
pub(super) fn read(file: &mut File, length: u64) -> Result<Track> {
    // Index boxes
    let index = boxes::index_boxes(file, length)?;
    let Some(movie) = &index.movie else {
        let found = "no `moov` box (the film's index): the recording was cut off or never finished";
        return Err(SourceError::damaged(found));
    };
    let movie = Bytes::of(*b"moov", movie).boxes();
    let header = Header::of(movie.need(*b"mvhd")?)?;
    let (track, mut warnings) = film_track(&movie)?;
    let id = Header::of(track.need(*b"tkhd")?)?;
    let media = track.need(*b"mdia")?.boxes();
    let timescale = Header::of(media.need(*b"mdhd")?)?.timescale;
    let tables = media.need(*b"minf")?.boxes().need(*b"stbl")?.boxes();
    // Samples and their coding
    let mut samples = samples::of_tables(&tables)?;
    samples::append_fragments(&mut samples, id.track, &movie, &index.fragments)?;
    let (name, codec) = samples::codec(&tables, samples::description(&samples)?)?;
    let config = decoder_config(name, codec)?;
    samples::check_offsets(&samples, length)?;
    if !index.fragments.is_empty() && !index.closed {
        warnings.push(
            "the film consists of fragments without a table at its end: it may have been cut off".into(),
        );
    }
    // Edit list and orientation
    let mut edits = match track.find(*b"edts")? {
        Some(list) => edits(list.boxes().need(*b"elst")?, header.timescale, timescale)?,
        None => Vec::new(),
    };
    // A recorder writes the edit list before the fragments, without their length.
    if let (Some(last), false) = (edits.last_mut(), index.fragments.is_empty()) {
        last.media_end = i64::MAX;
    }
    let orientation = Orientation::of(id.matrix)?.then(Orientation::of(header.matrix)?);
    Ok(Track { timescale, samples, edits, orientation, config, warnings })
}

/// When the film was recorded (s since 1970), from its own header; `None` if it does not say.
pub(crate) fn recorded_unix_s(file: &mut File, length: u64) -> Option<f64> {
    /// From 1904, the beginning of the time of these files, to 1970 (s).
    const SINCE_1904_S: u64 = 2_082_844_800;
    let movie = boxes::index_boxes(file, length).ok()?.movie?;
    let mut header = Bytes::of(*b"moov", &movie).boxes().find(*b"mvhd").ok()??;
    let (version, _) = header.version_and_flags().ok()?;
    let created_s = if version == 1 { header.u64().ok()? } else { u64::from(header.u32().ok()?) };
    // Recorders without a clock write zero.
    created_s.checked_sub(SINCE_1904_S).map(|created_s| created_s as f64)
}

/// The fields of `mvhd`, `tkhd` and `mdhd`, whose first fields agree.
struct Header {
    track: u32,
    timescale: u32,
    matrix: [i32; 4],
}

impl Header {
    fn of(mut header: Bytes) -> Result<Self> {
        let name = header.name();
        let (version, _) = header.version_and_flags()?;
        header.take(if version == 1 { 16 } else { 8 })?;
        let number = header.u32()?;
        if &name != b"tkhd" && number == 0 {
            return Err(SourceError::damaged(format!(
                "its `{}` box has a clock without ticks",
                four_cc(name)
            )));
        }
        // The duration, then the fields before the matrix.
        header.take(if version == 1 { 8 } else { 4 })?;
        let matrix = match &name {
            b"mdhd" => [1, 0, 0, 1],
            b"tkhd" => matrix(header, 4 + 16)?,
            _ => matrix(header, 16)?,
        };
        Ok(Self { track: number, timescale: number, matrix })
    }
}

/// The entries a, b, c and d of the matrix that follows `before` bytes.
fn matrix(mut header: Bytes, before: usize) -> Result<[i32; 4]> {
    header.take(before)?;
    let mut numbers = [0; 5];
    for number in &mut numbers {
        *number = header.i32()?;
    }
    let [a, b, _, c, d] = numbers;
    Ok([a, b, c, d])
}

/// The first video track, and a warning if there are more.
fn film_track<'a>(movie: &Boxes<'a>) -> Result<(Boxes<'a>, Vec<String>)> {
    let mut films = Vec::new();
    let mut others = Vec::new();
    for track in movie.all(*b"trak") {
        let track = track?.boxes();
        let mut handler = track.need(*b"mdia")?.boxes().need(*b"hdlr")?;
        handler.take(8)?;
        match &handler.letters()? {
            b"vide" => films.push(track),
            b"soun" => others.push("sound".into()),
            b"text" | b"sbtl" | b"subt" => others.push("text".into()),
            b"pict" => others.push("a still picture".into()),
            other => others.push(format!("`{}`", four_cc(*other))),
        }
    }
    if films.is_empty() {
        let what =
            if others.is_empty() { "no track at all".into() } else { format!("only {}", others.join(", ")) };
        return Err(SourceError::unsupported(format!("no film track: {what}")));
    }
    let mut warnings = Vec::new();
    if films.len() > 1 {
        warnings.push(format!("the file holds {} film tracks; the first one is used", films.len()));
    }
    Ok((films.swap_remove(0), warnings))
}

/// Names of codings that the built-in decoder does not support.
const CODINGS: [([u8; 4], &str); 21] = [
    (*b"hvc1", "H.265 (HEVC)"),
    (*b"hev1", "H.265 (HEVC)"),
    (*b"dvh1", "H.265 (Dolby Vision)"),
    (*b"dvhe", "H.265 (Dolby Vision)"),
    (*b"vvc1", "H.266 (VVC)"),
    (*b"av01", "AV1"),
    (*b"vp08", "VP8"),
    (*b"vp09", "VP9"),
    (*b"mp4v", "MPEG-4 Part 2"),
    (*b"jpeg", "Motion JPEG"),
    (*b"mjpa", "Motion JPEG"),
    (*b"mjpb", "Motion JPEG"),
    (*b"apch", "ProRes"),
    (*b"apcn", "ProRes"),
    (*b"apcs", "ProRes"),
    (*b"apco", "ProRes"),
    (*b"ap4h", "ProRes"),
    (*b"ap4x", "ProRes"),
    (*b"s263", "H.263"),
    (*b"encv", "something encrypted"),
    (*b"png ", "PNG pictures"),
];

/// The decoder's configuration from the track's codec description.
fn decoder_config(name: [u8; 4], mut entry: Bytes) -> Result<H264Config> {
    if !matches!(&name, b"avc1" | b"avc3") {
        let known = CODINGS.iter().find(|(code, _)| *code == name);
        let what = known.map_or(format!("`{}`", four_cc(name)), |(_, what)| (*what).to_string());
        return Err(SourceError::convertible(format!("a film coded as {what}")));
    }
    // The fields of every visual sample entry, among them the pictures' size.
    entry.take(24)?;
    let (width, height) = (entry.u16()?, entry.u16()?);
    check_size(u64::from(width), u64::from(height))?;
    entry.take(50)?;
    let mut config = entry.boxes().need(*b"avcC")?;
    config.take(4)?;
    let length_bytes = usize::from(config.u8()? & 3) + 1;
    let mut parameter_sets = Vec::new();
    for mask in [0x1f, 0xff] {
        for _ in 0..config.u8()? & mask {
            let size = config.u16()?;
            let unit = config.take(usize::from(size))?;
            if !unit.is_empty() {
                parameter_sets.push(unit.to_vec());
            }
        }
    }
    Ok(H264Config { framing: Framing::Lengths(length_bytes), parameter_sets })
}

/// The edit list (`elst`) in ticks of the track's clock.
fn edits(mut list: Bytes, movie_timescale: u32, timescale: u32) -> Result<Vec<Edit>> {
    let (version, _) = list.version_and_flags()?;
    let ticks = |duration: u64| {
        let (scaled, per) = (u128::from(duration) * u128::from(timescale), u128::from(movie_timescale));
        i64::try_from((scaled + per / 2) / per).unwrap_or(i64::MAX)
    };
    let mut edits: Vec<Edit> = Vec::new();
    let mut display_start = 0_i64;
    for _ in 0..list.entries(if version == 1 { 20 } else { 12 })? {
        let (duration, start) = match version {
            1 => (list.u64()?, list.u64()?.cast_signed()),
            _ => (u64::from(list.u32()?), i64::from(list.i32()?)),
        };
        let (rate, _) = (list.u16()?, list.u16()?);
        let duration = ticks(duration);
        if start >= 0 {
            if rate != 1 {
                return Err(SourceError::convertible("an edit list that changes the film's speed"));
            }
            if edits.last().is_some_and(|last| start < last.media_end) {
                return Err(SourceError::convertible(
                    "an edit list that repeats or reorders parts of the film",
                ));
            }
            // A duration of zero means the rest of the track.
            let media_end = if duration == 0 { i64::MAX } else { start.saturating_add(duration) };
            edits.push(Edit { media_start: start, media_end, display_start });
        }
        display_start = display_start.saturating_add(duration);
    }
    Ok(edits)
}
