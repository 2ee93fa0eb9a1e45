//! Where in an MP4 does each coded picture lie, and when is it shown?  (ISO/IEC 14496-12, 8.6 to 8.8)
//!
//! All counts are checked against the bytes that back them before anything is allocated.

use super::boxes::{Boxes, Bytes};
use crate::capture::source::error::Refusal;
use crate::capture::source::limits::MAX_FRAMES;

type Result<T> = std::result::Result<T, Refusal>;

/// One coded picture, in decoding order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sample {
    /// Where it lies in the file.
    pub offset: u64,
    /// Its length (bytes).
    pub size: u32,
    /// When it is shown, in ticks of the track's clock, before edits.
    pub shown: i64,
    /// Which of the track's codec descriptions it needs, from 1.
    pub description: u32,
}

/// The samples that the tables of a whole film (`stbl`) name.
pub(super) fn of_tables(tables: &Boxes) -> Result<Vec<Sample>> {
    let places = places(tables)?;
    let count = places.len();
    let durations = runs(tables.need(*b"stts")?, count)?;
    let delays = match tables.find(*b"ctts")? {
        Some(delays) => runs(delays, count)?,
        None => vec![0; count],
    };
    let mut decoded = 0_i64;
    let mut samples = Vec::with_capacity(count);
    for (place, (duration, delay)) in places.into_iter().zip(durations.into_iter().zip(delays)) {
        samples.push(Sample { shown: decoded + i64::from(delay.cast_signed()), ..place });
        decoded += i64::from(duration);
    }
    Ok(samples)
}

/// Run lengths (`stts`, `ctts`) spread out to one value a sample.
fn runs(mut table: Bytes, count: usize) -> Result<Vec<u32>> {
    table.version_and_flags()?;
    let mut values = Vec::with_capacity(count);
    for _ in 0..table.entries(8)? {
        let (length, value) = (table.u32()? as usize, table.u32()?);
        let room = count - values.len();
        values.extend(std::iter::repeat_n(value, length.min(room)));
    }
    if values.len() < count {
        let found = format!("an index of {count} frames of which only {} have times", values.len());
        return Err(Refusal::damaged(found));
    }
    Ok(values)
}

/// Offsets, sizes and descriptions from `stsz`, `stsc` and `stco` or `co64`; the times are still open.
fn places(tables: &Boxes) -> Result<Vec<Sample>> {
    let sizes = sizes(tables)?;
    let chunks = chunk_offsets(tables)?;
    let mut table = tables.need(*b"stsc")?;
    table.version_and_flags()?;
    let mut spans = Vec::new();
    for _ in 0..table.entries(12)? {
        spans.push((table.u32()?, table.u32()?, table.u32()?));
    }
    let mut samples = Vec::with_capacity(sizes.len());
    let mut sizes = sizes.iter();
    let mut spans = spans.into_iter().peekable();
    let (mut per_chunk, mut description) = (0, 1);
    for (number, offset) in (1..).zip(chunks) {
        while let Some((_, per, which)) = spans.next_if(|(first, ..)| *first <= number) {
            (per_chunk, description) = (per, which);
        }
        let mut offset = offset;
        for &size in sizes.by_ref().take(per_chunk as usize) {
            samples.push(Sample { offset, size, shown: 0, description });
            offset = offset.saturating_add(u64::from(size));
        }
    }
    if sizes.len() > 0 {
        let (all, found) = (samples.len() + sizes.len(), samples.len());
        return Err(Refusal::damaged(format!("an index of {all} frames of which only {found} have a place")));
    }
    Ok(samples)
}

/// The length of every sample (`stsz`).
fn sizes(tables: &Boxes) -> Result<Vec<u32>> {
    if tables.find(*b"stz2")?.is_some() {
        return Err(Refusal::convertible("an index with compact sizes (`stz2`)"));
    }
    let mut table = tables.need(*b"stsz")?;
    table.version_and_flags()?;
    let uniform = table.u32()?;
    if uniform == 0 {
        let count = table.entries(4)?;
        check_count(count as u64)?;
        return (0..count).map(|_| table.u32()).collect();
    }
    let count = table.u32()?;
    check_count(u64::from(count))?;
    Ok(vec![uniform; count as usize])
}

fn check_count(count: u64) -> Result<()> {
    if count <= MAX_FRAMES {
        return Ok(());
    }
    Err(Refusal::unfit(format!("{count} frames"), format!("at most {MAX_FRAMES} frames")))
}

fn chunk_offsets(tables: &Boxes) -> Result<Vec<u64>> {
    if let Some(mut table) = tables.find(*b"co64")? {
        table.version_and_flags()?;
        let count = table.entries(8)?;
        check_count(count as u64)?;
        return (0..count).map(|_| table.u64()).collect();
    }
    let mut table = tables.need(*b"stco")?;
    table.version_and_flags()?;
    let count = table.entries(4)?;
    check_count(count as u64)?;
    (0..count).map(|_| table.u32().map(u64::from)).collect()
}

/// What holds for the samples of a fragment unless it says otherwise (`trex`, then `tfhd`).
#[derive(Clone, Copy, Debug, Default)]
struct Defaults {
    description: u32,
    duration: u32,
    size: u32,
}

/// Appends the samples of track `track` that the film's fragments (`moof`) name.
pub(super) fn append_fragments(
    samples: &mut Vec<Sample>,
    track: u32,
    movie: &Boxes,
    fragments: &[(u64, Vec<u8>)],
) -> Result<()> {
    let defaults = track_defaults(track, movie)?;
    let mut run = Run { samples, decoded: 0, offset: 0 };
    for (start, payload) in fragments {
        let parts = Bytes::of(*b"moof", payload).boxes();
        run.offset = *start;
        for part in parts.all(*b"traf") {
            append_part(&mut run, &part?.boxes(), track, *start, defaults)?;
        }
    }
    Ok(())
}

fn track_defaults(track: u32, movie: &Boxes) -> Result<Defaults> {
    let Some(extends) = movie.find(*b"mvex")? else {
        return Ok(Defaults { description: 1, ..Defaults::default() });
    };
    for entry in extends.boxes().all(*b"trex") {
        let mut entry = entry?;
        entry.version_and_flags()?;
        if entry.u32()? == track {
            return Ok(Defaults { description: entry.u32()?, duration: entry.u32()?, size: entry.u32()? });
        }
    }
    Ok(Defaults { description: 1, ..Defaults::default() })
}

/// Where the next sample of a fragmented film lies and when it is decoded.
struct Run<'a> {
    samples: &'a mut Vec<Sample>,
    decoded: i64,
    offset: u64,
}

/// The samples of one track fragment (`traf`); those of other tracks only move the place where the next one lies.
fn append_part(run: &mut Run, part: &Boxes, track: u32, start: u64, defaults: Defaults) -> Result<()> {
    let mut header = part.need(*b"tfhd")?;
    let (_, flags) = header.version_and_flags()?;
    let wanted = header.u32()? == track;
    let base = match flags {
        own if own & 0x1 != 0 => header.u64()?,
        own if own & 0x2_0000 != 0 => start,
        _ => run.offset,
    };
    let mut optional = |bit: u32| (flags & bit != 0).then(|| header.u32()).transpose();
    let defaults = Defaults {
        description: optional(0x2)?.unwrap_or(defaults.description),
        duration: optional(0x8)?.unwrap_or(defaults.duration),
        size: optional(0x10)?.unwrap_or(defaults.size),
    };
    if let (true, Some(mut time)) = (wanted, part.find(*b"tfdt")?) {
        let (version, _) = time.version_and_flags()?;
        run.decoded = if version == 1 { time.u64()?.cast_signed() } else { i64::from(time.u32()?) };
    }
    run.offset = base;
    for table in part.all(*b"trun") {
        append_run(run, table?, base, wanted, defaults)?;
    }
    Ok(())
}

/// The samples of one run (`trun`).
fn append_run(run: &mut Run, mut table: Bytes, base: u64, wanted: bool, defaults: Defaults) -> Result<()> {
    let (_, flags) = table.version_and_flags()?;
    let count = table.u32()?;
    check_count(u64::from(count) + run.samples.len() as u64)?;
    if flags & 0x1 != 0 {
        run.offset = base.saturating_add_signed(i64::from(table.i32()?));
    }
    if flags & 0x4 != 0 {
        table.u32()?;
    }
    for _ in 0..count {
        let mut or = |bit: u32, default| if flags & bit != 0 { table.u32() } else { Ok(default) };
        let duration = or(0x100, defaults.duration)?;
        let size = or(0x200, defaults.size)?;
        or(0x400, 0)?;
        // Unsigned in version 0, but no recorder delays a picture by half the clock's range.
        let delay = or(0x800, 0)?.cast_signed();
        if wanted {
            let shown = run.decoded.saturating_add(i64::from(delay));
            let sample = Sample { offset: run.offset, size, shown, description: defaults.description };
            run.samples.push(sample);
            run.decoded = run.decoded.saturating_add(i64::from(duration));
        }
        run.offset = run.offset.saturating_add(u64::from(size));
    }
    Ok(())
}

/// An error unless every sample lies within the file of `length` bytes, and all of them fit in it side by side.
pub(super) fn check_places(samples: &[Sample], length: u64) -> Result<()> {
    let count = samples.len();
    let mut total = 0_u64;
    for (n, sample) in samples.iter().enumerate() {
        let end = sample.offset.saturating_add(u64::from(sample.size));
        if sample.size == 0 {
            return Err(Refusal::damaged(format!("frame {} of {count} has no bytes", n + 1)));
        }
        if end > length {
            let found =
                format!("the file breaks off: frame {} of {count} ends at byte {end} of {length}", n + 1);
            return Err(Refusal::damaged(found));
        }
        total += u64::from(sample.size);
    }
    if total > length {
        return Err(Refusal::damaged(format!("{count} frames of {total} bytes in a file of {length}")));
    }
    Ok(())
}

/// The one codec description that all samples use.
pub(super) fn description(samples: &[Sample]) -> Result<u32> {
    let first = samples.first().map_or(1, |sample| sample.description);
    if samples.iter().all(|sample| sample.description == first) {
        return Ok(first);
    }
    Err(Refusal::convertible("a film whose coding changes on the way"))
}

/// The payload of codec description `number` (from 1) and its name.
pub(super) fn codec<'a>(tables: &Boxes<'a>, number: u32) -> Result<([u8; 4], Bytes<'a>)> {
    let mut table = tables.need(*b"stsd")?;
    table.version_and_flags()?;
    table.u32()?;
    let entry = table.boxes().nth(number.saturating_sub(1) as usize).transpose()?;
    entry
        .map(|entry| (entry.name(), entry))
        .ok_or_else(|| Refusal::damaged(format!("its `stsd` box has no codec description {number}")))
}
