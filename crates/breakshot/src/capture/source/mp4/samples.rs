//! Where in an MP4 is each coded picture stored, and when is it displayed?  (ISO/IEC 14496-12, 8.6 to 8.8)
//!
//! Every count is checked against the number of bytes that hold its entries before memory is allocated.

use super::boxes::{Boxes, Bytes};
use crate::capture::source::error::SourceError;
use crate::capture::source::limits::MAX_FRAMES;

type Result<T> = std::result::Result<T, SourceError>;

/// One coded picture, in decoding order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sample {
    /// Its offset in the file (bytes).
    pub offset: u64,
    /// Its length (bytes).
    pub size: u32,
    /// Its display time before edits, in ticks of the track's clock.
    pub display_tick: i64,
    /// The number of its codec description, from 1.
    pub description: u32,
}

/// The samples in the tables of a film without fragments (`stbl`).
pub(super) fn of_tables(tables: &Boxes) -> Result<Vec<Sample>> {
    let stored = stored_samples(tables)?;
    let count = stored.len();
    let durations = runs(tables.need(*b"stts")?, count)?;
    let delays = match tables.find(*b"ctts")? {
        Some(delays) => runs(delays, count)?,
        None => vec![0; count],
    };
    let mut decoded = 0_i64;
    let mut samples = Vec::with_capacity(count);
    for (sample, (duration, delay)) in stored.into_iter().zip(durations.into_iter().zip(delays)) {
        samples.push(Sample { display_tick: decoded + i64::from(delay.cast_signed()), ..sample });
        decoded += i64::from(duration);
    }
    Ok(samples)
}

/// One value per sample from run lengths (`stts`, `ctts`).
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
        return Err(SourceError::damaged(found));
    }
    Ok(values)
}

/// Samples with offset, size and description from `stsz`, `stsc` and `stco` or `co64`; their times are 0.
fn stored_samples(tables: &Boxes) -> Result<Vec<Sample>> {
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
            samples.push(Sample { offset, size, display_tick: 0, description });
            offset = offset.saturating_add(u64::from(size));
        }
    }
    if sizes.len() > 0 {
        let (all, found) = (samples.len() + sizes.len(), samples.len());
        return Err(SourceError::damaged(format!(
            "an index of {all} frames of which only {found} have an offset"
        )));
    }
    Ok(samples)
}

/// The size of each sample in bytes (`stsz`).
fn sizes(tables: &Boxes) -> Result<Vec<u32>> {
    if tables.find(*b"stz2")?.is_some() {
        return Err(SourceError::convertible("an index with compact sizes (`stz2`)"));
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
    Err(SourceError::unsuitable(format!("{count} frames"), format!("at most {MAX_FRAMES} frames")))
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

/// Default values for the samples of a fragment (`trex`, overridden by `tfhd`).
#[derive(Clone, Copy, Debug, Default)]
struct Defaults {
    description: u32,
    duration: u32,
    size: u32,
}

/// Appends the samples of track `track` in the film's fragments (`moof`).
pub(super) fn append_fragments(
    samples: &mut Vec<Sample>,
    track: u32,
    movie: &Boxes,
    fragments: &[(u64, Vec<u8>)],
) -> Result<()> {
    let defaults = track_defaults(track, movie)?;
    let mut run = Run { samples, decoded: 0, offset: 0 };
    for (start, payload) in fragments {
        let fragment = Bytes::of(*b"moof", payload).boxes();
        run.offset = *start;
        for track_fragment in fragment.all(*b"traf") {
            append_track_fragment(
                &mut run,
                &track_fragment?.boxes(),
                FragmentOf { track, start: *start },
                defaults,
            )?;
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

/// The samples of a fragmented film so far, and the decoding time and offset of the next one.
struct Run<'a> {
    samples: &'a mut Vec<Sample>,
    decoded: i64,
    offset: u64,
}

/// The wanted track and the offset of the fragment in the file.
#[derive(Clone, Copy)]
struct FragmentOf {
    track: u32,
    start: u64,
}

/// Appends the samples of one track fragment (`traf`); one of another track only advances the offset.
fn append_track_fragment(
    run: &mut Run,
    track_fragment: &Boxes,
    fragment: FragmentOf,
    defaults: Defaults,
) -> Result<()> {
    let mut header = track_fragment.need(*b"tfhd")?;
    let (_, flags) = header.version_and_flags()?;
    let wanted = header.u32()? == fragment.track;
    let base = match flags {
        own if own & 0x1 != 0 => header.u64()?,
        own if own & 0x2_0000 != 0 => fragment.start,
        _ => run.offset,
    };
    let mut optional = |bit: u32| (flags & bit != 0).then(|| header.u32()).transpose();
    let defaults = Defaults {
        description: optional(0x2)?.unwrap_or(defaults.description),
        duration: optional(0x8)?.unwrap_or(defaults.duration),
        size: optional(0x10)?.unwrap_or(defaults.size),
    };
    if let (true, Some(mut time)) = (wanted, track_fragment.find(*b"tfdt")?) {
        let (version, _) = time.version_and_flags()?;
        run.decoded = if version == 1 { time.u64()?.cast_signed() } else { i64::from(time.u32()?) };
    }
    run.offset = base;
    for table in track_fragment.all(*b"trun") {
        append_run(run, table?, base, wanted, defaults)?;
    }
    Ok(())
}

/// Appends the samples of one run (`trun`).
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
        // Unsigned in version 0, but no recorder writes a delay of half the clock's range.
        let delay = or(0x800, 0)?.cast_signed();
        if wanted {
            let display_tick = run.decoded.saturating_add(i64::from(delay));
            let sample = Sample { offset: run.offset, size, display_tick, description: defaults.description };
            run.samples.push(sample);
            run.decoded = run.decoded.saturating_add(i64::from(duration));
        }
        run.offset = run.offset.saturating_add(u64::from(size));
    }
    Ok(())
}

/// An error unless every sample is inside the file of `length` bytes and their total size does not exceed it.
pub(super) fn check_offsets(samples: &[Sample], length: u64) -> Result<()> {
    let count = samples.len();
    let mut total = 0_u64;
    for (n, sample) in samples.iter().enumerate() {
        let end = sample.offset.saturating_add(u64::from(sample.size));
        if sample.size == 0 {
            return Err(SourceError::damaged(format!("frame {} of {count} has no bytes", n + 1)));
        }
        if end > length {
            let found =
                format!("the file breaks off: frame {} of {count} ends at byte {end} of {length}", n + 1);
            return Err(SourceError::damaged(found));
        }
        total += u64::from(sample.size);
    }
    if total > length {
        return Err(SourceError::damaged(format!("{count} frames of {total} bytes in a file of {length}")));
    }
    Ok(())
}

/// The number of the codec description that all samples share.
pub(super) fn description(samples: &[Sample]) -> Result<u32> {
    let first = samples.first().map_or(1, |sample| sample.description);
    if samples.iter().all(|sample| sample.description == first) {
        return Ok(first);
    }
    Err(SourceError::convertible("a film whose coding changes between frames"))
}

/// The name and the payload of codec description `number` (from 1).
pub(super) fn codec<'a>(tables: &Boxes<'a>, number: u32) -> Result<([u8; 4], Bytes<'a>)> {
    let mut table = tables.need(*b"stsd")?;
    table.version_and_flags()?;
    table.u32()?;
    let entry = table.boxes().nth(number.saturating_sub(1) as usize).transpose()?;
    entry
        .map(|entry| (entry.name(), entry))
        .ok_or_else(|| SourceError::damaged(format!("its `stsd` box has no codec description {number}")))
}
