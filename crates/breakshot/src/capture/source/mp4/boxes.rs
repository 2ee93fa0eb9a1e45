//! The boxes that an MP4 is made of (ISO/IEC 14496-12, 4.2): a size, a four-letter name, a payload.

use crate::capture::source::error::Refusal;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

type Result<T> = std::result::Result<T, Refusal>;

/// The index of two hours at 240 frames a second needs less.
const MAX_INDEX_BYTES: u64 = 64 << 20;
/// More boxes than any recorder writes: the walk over them must end.
const MAX_BOXES: usize = 1_000_000;

/// A box's name as messages write it.
pub(super) fn text(name: [u8; 4]) -> String {
    name.iter().map(|&b| if (0x20..0x7f).contains(&b) { char::from(b) } else { '?' }).collect()
}

/// Big-endian numbers, read one after the other.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a> {
    /// The box they belong to.
    name: [u8; 4],
    rest: &'a [u8],
}

impl<'a> Bytes<'a> {
    pub(super) fn of(name: [u8; 4], rest: &'a [u8]) -> Self {
        Self { name, rest }
    }

    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let Some((taken, rest)) = self.rest.split_at_checked(count) else {
            return Err(Refusal::damaged(format!("its `{}` box ends too early", text(self.name))));
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

    /// The name of the box they belong to.
    pub(super) fn name(&self) -> [u8; 4] {
        self.name
    }

    /// The version and the flags that full boxes begin with.
    pub(super) fn version_and_flags(&mut self) -> Result<(u8, u32)> {
        let word = self.u32()?;
        Ok(((word >> 24) as u8, word & 0x00ff_ffff))
    }

    /// How many table entries of `size` bytes follow: said and, checked, there.
    pub(super) fn entries(&mut self, size: usize) -> Result<usize> {
        let count = self.u32()? as usize;
        if self.rest.len() / size < count {
            let name = text(self.name);
            return Err(Refusal::damaged(format!("its `{name}` box claims {count} entries and holds fewer")));
        }
        Ok(count)
    }

    /// The boxes that follow from here.
    pub(super) fn boxes(self) -> Boxes<'a> {
        Boxes { parent: self.name, rest: self.rest }
    }
}

/// The boxes within a box, one after the other.
#[derive(Clone)]
pub(super) struct Boxes<'a> {
    parent: [u8; 4],
    rest: &'a [u8],
}

impl<'a> Boxes<'a> {
    /// The first box of that name, if there is one.
    pub(super) fn find(&self, name: [u8; 4]) -> Result<Option<Bytes<'a>>> {
        self.all(name).next().transpose()
    }

    /// The first box of that name, which must be there.
    pub(super) fn need(&self, name: [u8; 4]) -> Result<Bytes<'a>> {
        let missing = || format!("its `{}` box has no `{}`", text(self.parent), text(name));
        self.find(name)?.ok_or_else(|| Refusal::damaged(missing()))
    }

    /// All boxes of that name.
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
            let (child, parent) = (text(name), text(self.parent));
            let found =
                format!("its `{child}` box claims {size} bytes within the {} of `{parent}`", self.rest.len());
            return Err(Refusal::damaged(found));
        }
        let (whole, rest) = self.rest.split_at(size as usize);
        self.rest = rest;
        Ok(Bytes::of(name, &whole[header as usize..]))
    }
}

/// The indices of a whole file; the pictures themselves stay on disk.
#[derive(Default)]
pub(super) struct Outline {
    /// The payload of `moov`.
    pub movie: Option<Vec<u8>>,
    /// Where each `moof` begins in the file, and its payload.
    pub fragments: Vec<(u64, Vec<u8>)>,
    /// Whether the table of fragments, which a recorder writes last, is there.
    pub closed: bool,
}

/// Walks over the boxes of a file of `length` bytes and keeps the indices; a file that ends within a box is refused.
pub(super) fn outline(file: &mut File, length: u64) -> Result<Outline> {
    let mut outline = Outline::default();
    let mut indexed = 0;
    let mut at = 0;
    for _ in 0..MAX_BOXES {
        let Some((name, start, end)) = top_box(file, at, length)? else {
            return Ok(outline);
        };
        if matches!(&name, b"moov" | b"moof") {
            indexed += end - start;
            if indexed > MAX_INDEX_BYTES {
                return Err(Refusal::damaged(format!("an index of more than {} MB", MAX_INDEX_BYTES >> 20)));
            }
            let payload = read_at(file, start, end - start)?;
            if &name == b"moof" {
                outline.fragments.push((at, payload));
            } else if outline.movie.replace(payload).is_some() {
                return Err(Refusal::damaged("two `moov` boxes (indices)"));
            }
        }
        outline.closed |= &name == b"mfra";
        at = end;
    }
    Err(Refusal::damaged(format!("more than {MAX_BOXES} boxes")))
}

/// Name, start and end of the payload of the box at `at`, or nothing at the end of the file.
fn top_box(file: &mut File, at: u64, length: u64) -> Result<Option<([u8; 4], u64, u64)>> {
    let left = length - at;
    let head = read_at(file, at, left.min(16))?;
    // Some recorders fill the file up with zeros.
    if left == 0 || (left >= 8 && head.iter().all(|&byte| byte == 0)) {
        return Ok(None);
    }
    let mut numbers = Bytes::of(*b"file", &head);
    let cut = |_| Refusal::damaged(format!("the file breaks off {left} bytes into a box at byte {at}"));
    let short = numbers.u32().map_err(cut)?;
    let name = numbers.letters().map_err(cut)?;
    let (size, header) = match short {
        0 => (left, 8),
        1 => (numbers.u64().map_err(cut)?, 16),
        size => (u64::from(size), 8),
    };
    if !name.iter().all(|&b| (0x20..0x7f).contains(&b) || b == 0xa9) || size < header {
        return Err(Refusal::damaged(format!("no box where one should begin, at byte {at} of {length}")));
    }
    if size > left {
        let found =
            format!("the file breaks off: its `{}` box should have {size} bytes and has {left}", text(name));
        return Err(Refusal::damaged(found));
    }
    Ok(Some((name, at + header, at + size)))
}

/// `count` bytes of the file, which were checked to be there.
pub(super) fn read_at(file: &mut File, offset: u64, count: u64) -> Result<Vec<u8>> {
    let mut bytes = vec![0; count as usize];
    read_into(file, offset, &mut bytes)?;
    Ok(bytes)
}

/// Fills `bytes` from the file.
pub(super) fn read_into(file: &mut File, offset: u64, bytes: &mut [u8]) -> Result<()> {
    let failed = |e: std::io::Error| Refusal::damaged(format!("byte {offset} cannot be read ({e})"));
    file.seek(SeekFrom::Start(offset)).map_err(failed)?;
    file.read_exact(bytes).map_err(failed)
}
