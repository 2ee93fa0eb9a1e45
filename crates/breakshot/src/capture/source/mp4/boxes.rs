//! The boxes of an MP4 file (ISO/IEC 14496-12, 4.2): each has a size, a four-character name and a payload.

use crate::capture::source::error::SourceError;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

type Result<T> = std::result::Result<T, SourceError>;

/// Largest index (bytes): two hours at 240 frames a second need less.
const MAX_INDEX_BYTES: u64 = 64 << 20;
/// Largest number of boxes: more than any recorder writes, so that reading them ends.
const MAX_BOXES: usize = 1_000_000;

/// A box's name for messages.
pub(super) fn four_cc(name: [u8; 4]) -> String {
    name.iter().map(|&b| if (0x20..0x7f).contains(&b) { char::from(b) } else { '?' }).collect()
}

/// A cursor over the payload of a box, which reads big-endian numbers.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a> {
    /// The name of the box.
    name: [u8; 4],
    rest: &'a [u8],
}

impl<'a> Bytes<'a> {
    pub(super) fn of(name: [u8; 4], rest: &'a [u8]) -> Self {
        Self { name, rest }
    }

    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let Some((taken, rest)) = self.rest.split_at_checked(count) else {
            return Err(SourceError::damaged(format!("its `{}` box ends too early", four_cc(self.name))));
        };
        self.rest = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub(super) fn u8(&mut self) -> Result<u8> {
        Ok(self.array::<1>()?[0])
    }

    pub(super) fn u16(&mut self) -> Result<u16> {
        Ok(u16::from_be_bytes(self.array()?))
    }

    pub(super) fn u32(&mut self) -> Result<u32> {
        Ok(u32::from_be_bytes(self.array()?))
    }

    pub(super) fn i32(&mut self) -> Result<i32> {
        Ok(i32::from_be_bytes(self.array()?))
    }

    pub(super) fn u64(&mut self) -> Result<u64> {
        Ok(u64::from_be_bytes(self.array()?))
    }

    pub(super) fn letters(&mut self) -> Result<[u8; 4]> {
        self.array()
    }

    /// The name of the box.
    pub(super) fn name(&self) -> [u8; 4] {
        self.name
    }

    /// The version and the flags at the start of a full box.
    pub(super) fn version_and_flags(&mut self) -> Result<(u8, u32)> {
        let word = self.u32()?;
        Ok(((word >> 24) as u8, word & 0x00ff_ffff))
    }

    /// The number of table entries of `size` bytes that follow.
    ///
    /// # Errors
    /// The payload is shorter than that number of entries.
    pub(super) fn entries(&mut self, size: usize) -> Result<usize> {
        let count = self.u32()? as usize;
        if self.rest.len() / size < count {
            let name = four_cc(self.name);
            return Err(SourceError::damaged(format!(
                "its `{name}` box claims {count} entries and holds fewer"
            )));
        }
        Ok(count)
    }

    /// The rest of the payload as boxes.
    pub(super) fn boxes(self) -> Boxes<'a> {
        Boxes { parent: self.name, rest: self.rest }
    }
}

/// An iterator over the boxes within a box.
#[derive(Clone)]
pub(super) struct Boxes<'a> {
    parent: [u8; 4],
    rest: &'a [u8],
}

impl<'a> Boxes<'a> {
    /// The first box with that name, if there is one.
    pub(super) fn find(&self, name: [u8; 4]) -> Result<Option<Bytes<'a>>> {
        self.all(name).next().transpose()
    }

    /// The first box with that name.
    ///
    /// # Errors
    /// There is none.
    pub(super) fn need(&self, name: [u8; 4]) -> Result<Bytes<'a>> {
        let missing = || format!("its `{}` box has no `{}`", four_cc(self.parent), four_cc(name));
        self.find(name)?.ok_or_else(|| SourceError::damaged(missing()))
    }

    /// All boxes with that name.
    pub(super) fn all(&self, name: [u8; 4]) -> impl Iterator<Item = Result<Bytes<'a>>> {
        self.clone().filter(move |child| child.as_ref().map_or(true, |child| child.name == name))
    }
}

impl<'a> Iterator for Boxes<'a> {
    type Item = Result<Bytes<'a>>;

    fn next(&mut self) -> Option<Self::Item> {
        // QuickTime ends some lists of boxes with four zero bytes.
        if self.rest.len() < 8 {
            return None;
        }
        let child = self.child();
        if child.is_err() {
            self.rest = &[];
        }
        Some(child)
    }
}

impl<'a> Boxes<'a> {
    fn child(&mut self) -> Result<Bytes<'a>> {
        let mut head = Bytes::of(self.parent, self.rest);
        let short = head.u32()?;
        let name = head.letters()?;
        let (size, header) = match short {
            0 => (self.rest.len() as u64, 8),
            1 => (head.u64()?, 16),
            size => (u64::from(size), 8),
        };
        if size < header || size > self.rest.len() as u64 {
            let (child, parent) = (four_cc(name), four_cc(self.parent));
            let found =
                format!("its `{child}` box claims {size} bytes within the {} of `{parent}`", self.rest.len());
            return Err(SourceError::damaged(found));
        }
        let (whole, rest) = self.rest.split_at(size as usize);
        self.rest = rest;
        Ok(Bytes::of(name, &whole[header as usize..]))
    }
}

/// The index boxes of a whole file; the coded pictures stay on disk.
#[derive(Default)]
pub(super) struct IndexBoxes {
    /// The payload of `moov`.
    pub movie: Option<Vec<u8>>,
    /// The offset of each `moof` in the file, and its payload.
    pub fragments: Vec<(u64, Vec<u8>)>,
    /// Whether the file has the table of fragments (`mfra`), which a recorder writes last.
    pub closed: bool,
}

/// Reads the index boxes of a file of `length` bytes.
///
/// # Errors
/// The file ends within a box, holds two `moov` boxes, or its index is too large.
pub(super) fn index_boxes(file: &mut File, length: u64) -> Result<IndexBoxes> {
    let mut index = IndexBoxes::default();
    let mut indexed = 0;
    let mut at = 0;
    for _ in 0..MAX_BOXES {
        let Some((name, start, end)) = top_box(file, at, length)? else {
            return Ok(index);
        };
        if matches!(&name, b"moov" | b"moof") {
            indexed += end - start;
            if indexed > MAX_INDEX_BYTES {
                return Err(SourceError::damaged(format!(
                    "an index of more than {} MB",
                    MAX_INDEX_BYTES >> 20
                )));
            }
            let payload = read_at(file, start, end - start)?;
            if &name == b"moof" {
                index.fragments.push((at, payload));
            } else if index.movie.replace(payload).is_some() {
                return Err(SourceError::damaged("two `moov` boxes (indices)"));
            }
        }
        index.closed |= &name == b"mfra";
        at = end;
    }
    Err(SourceError::damaged(format!("more than {MAX_BOXES} boxes")))
}

/// Name, start and end of the payload of the box at `at`; `None` at the end of the file.
fn top_box(file: &mut File, at: u64, length: u64) -> Result<Option<([u8; 4], u64, u64)>> {
    let left = length - at;
    let head = read_at(file, at, left.min(16))?;
    // Some recorders pad the file with zeros.
    if left == 0 || (left >= 8 && head.iter().all(|&byte| byte == 0)) {
        return Ok(None);
    }
    let mut numbers = Bytes::of(*b"file", &head);
    let cut = |_| SourceError::damaged(format!("the file breaks off {left} bytes into a box at byte {at}"));
    let short = numbers.u32().map_err(cut)?;
    let name = numbers.letters().map_err(cut)?;
    let (size, header) = match short {
        0 => (left, 8),
        1 => (numbers.u64().map_err(cut)?, 16),
        size => (u64::from(size), 8),
    };
    if !name.iter().all(|&b| (0x20..0x7f).contains(&b) || b == 0xa9) || size < header {
        return Err(SourceError::damaged(format!("no box where one should begin, at byte {at} of {length}")));
    }
    if size > left {
        let found = format!(
            "the file breaks off: its `{}` box should have {size} bytes and has {left}",
            four_cc(name)
        );
        return Err(SourceError::damaged(found));
    }
    Ok(Some((name, at + header, at + size)))
}

/// `count` bytes of the file; the caller has checked that the file is long enough.
pub(super) fn read_at(file: &mut File, offset: u64, count: u64) -> Result<Vec<u8>> {
    let mut bytes = vec![0; count as usize];
    read_into(file, offset, &mut bytes)?;
    Ok(bytes)
}

/// Fills `bytes` from the file.
pub(super) fn read_into(file: &mut File, offset: u64, bytes: &mut [u8]) -> Result<()> {
    let failed = |e: std::io::Error| SourceError::damaged(format!("byte {offset} cannot be read ({e})"));
    file.seek(SeekFrom::Start(offset)).map_err(failed)?;
    file.read_exact(bytes).map_err(failed)
}
