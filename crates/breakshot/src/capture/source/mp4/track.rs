//! What does an MP4, a MOV or a fragmented MP4 hold?  (ISO/IEC 14496-12, 14496-15)
//!
//! Only the film's own track is read; whatever cameras put beside it is passed over.

use super::boxes::{self, Boxes, Bytes, text};
use super::orientation::Orientation;
use super::samples::{self, Sample};
use super::timeline::Edit;
use crate::capture::source::error::Refusal;
use crate::capture::source::h264::parameters::Coding;
use crate::capture::source::limits::check_size;
use std::fs::File;

type Result<T> = std::result::Result<T, Refusal>;

/// The film's track.
#[derive(Debug)]
pub(super) struct Track {
    /// Ticks of its clock per second.
    pub timescale: u32,
    /// Its coded pictures, in decoding order.
    pub samples: Vec<Sample>,
    /// Which stretches of it are shown; none: all of it.
    pub edits: Vec<Edit>,
    /// How it is to be turned.
    pub orientation: Orientation,
    /// How its pictures are coded.
    pub coding: Coding,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Reads the index of a file of `length` bytes and checks that all that it names is there.
pub(super) fn read(file: &mut File, length: u64) -> Result<Track> {
    let outline = boxes::outline(file, length)?;
    let Some(movie) = &outline.movie else {
        let found = "no `moov` box (the film's index): the recording was cut off or never finished";
        return Err(Refusal::damaged(found));
    };
    let movie = Bytes::of(*b"moov", movie).boxes();
    let header = Header::of(movie.need(*b"mvhd")?)?;
    let (track, mut warnings) = film_track(&movie)?;
    let id = Header::of(track.need(*b"tkhd")?)?;
    let media = track.need(*b"mdia")?.boxes();
    let timescale = Header::of(media.need(*b"mdhd")?)?.timescale;
    let tables = media.need(*b"minf")?.boxes().need(*b"stbl")?.boxes();
    let mut samples = samples::of_tables(&tables)?;
    samples::append_fragments(&mut samples, id.track, &movie, &outline.fragments)?;
    let (name, codec) = samples::codec(&tables, samples::description(&samples)?)?;
    let coding = coding(name, codec)?;
    samples::check_places(&samples, length)?;
    if !outline.fragments.is_empty() && !outline.closed {
        warnings.push(
            "the film is a row of fragments without a table at its end: it may have been cut off".into(),
        );
    }
    let mut edits = match track.find(*b"edts")? {
        Some(list) => edits(list.boxes().need(*b"elst")?, header.timescale, timescale)?,
        None => Vec::new(),
    };
    // An edit list is written before the fragments are, and cannot know their length.
    if let (Some(last), false) = (edits.last_mut(), outline.fragments.is_empty()) {
        last.media_end = i64::MAX;
    }
    let orientation = Orientation::of(id.matrix)?.then(Orientation::of(header.matrix)?);
    Ok(Track { timescale, samples, edits, orientation, coding, warnings })
}

/// What is needed of `mvhd`, `tkhd` and `mdhd`, which begin alike.
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
            return Err(Refusal::damaged(format!("its `{}` box has a clock without ticks", text(name))));
        }
        // The duration, then what stands before the matrix.
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

/// The first video track, and a word if there are more.
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
            other => others.push(format!("`{}`", text(*other))),
        }
    }
    if films.is_empty() {
        let what =
            if others.is_empty() { "no track at all".into() } else { format!("only {}", others.join(", ")) };
        return Err(Refusal::foreign(format!("no film track: {what}")));
    }
    let mut warnings = Vec::new();
    if films.len() > 1 {
        warnings.push(format!("the file holds {} film tracks; the first one is used", films.len()));
    }
    Ok((films.swap_remove(0), warnings))
}

/// The names of codings that are not read.
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
fn coding(name: [u8; 4], mut entry: Bytes) -> Result<Coding> {
    if !matches!(&name, b"avc1" | b"avc3") {
        let known = CODINGS.iter().find(|(code, _)| *code == name);
        let what = known.map_or(format!("`{}`", text(name)), |(_, what)| (*what).to_string());
        return Err(Refusal::convertible(format!("a film coded as {what}")));
    }
    // What every visual sample entry begins with; the pictures' size lies within.
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
    Ok(Coding { length_bytes, parameter_sets })
}

/// The edit list (`elst`) in ticks of the track's clock.
fn edits(mut list: Bytes, movie_timescale: u32, timescale: u32) -> Result<Vec<Edit>> {
    let (version, _) = list.version_and_flags()?;
    let ticks = |duration: u64| {
        let (scaled, per) = (u128::from(duration) * u128::from(timescale), u128::from(movie_timescale));
        i64::try_from((scaled + per / 2) / per).unwrap_or(i64::MAX)
    };
    let mut edits: Vec<Edit> = Vec::new();
    let mut shown_at = 0_i64;
    for _ in 0..list.entries(if version == 1 { 20 } else { 12 })? {
        let (duration, start) = match version {
            1 => (list.u64()?, list.u64()?.cast_signed()),
            _ => (u64::from(list.u32()?), i64::from(list.i32()?)),
        };
        let (rate, _) = (list.u16()?, list.u16()?);
        let duration = ticks(duration);
        if start >= 0 {
            if rate != 1 {
                return Err(Refusal::convertible("an edit list that changes the film's speed"));
            }
            if edits.last().is_some_and(|last| start < last.media_end) {
                return Err(Refusal::convertible("an edit list that repeats or reorders parts of the film"));
            }
            // A duration of zero stands for all that is left.
            let media_end = if duration == 0 { i64::MAX } else { start.saturating_add(duration) };
            edits.push(Edit { media_start: start, media_end, shown_at });
        }
        shown_at = shown_at.saturating_add(duration);
    }
    Ok(edits)
}
