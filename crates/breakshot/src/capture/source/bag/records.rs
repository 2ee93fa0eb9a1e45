//! The records of an MCAP file (<https://mcap.dev/spec>), one after the other.

use super::chunk::{Chunk, Compression};
use crate::capture::source::error::SourceError;
use std::io::Read;

type Result<T> = std::result::Result<T, SourceError>;

pub(in crate::capture::source) const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";

pub(super) const FOOTER: u8 = 0x02;
pub(super) const SCHEMA: u8 = 0x03;
pub(super) const CHANNEL: u8 = 0x04;
pub(super) const MESSAGE: u8 = 0x05;
pub(super) const CHUNK: u8 = 0x06;
pub(super) const STATISTICS: u8 = 0x0b;

/// Bytes of a record before its content: the opcode and the length.
pub(super) const HEAD_BYTES: u64 = 9;
/// Bytes of a message before its data: channel, sequence number, time of recording, time of publication.
pub(super) const MESSAGE_HEAD_BYTES: u64 = 22;
/// Largest record that defines a schema or a channel (bytes): definitions of messages are text of some kilobytes.
const MAX_DEFINITION_BYTES: u64 = 4 << 20;

/// Opcode and length of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Head {
    pub opcode: u8,
    pub length: u64,
}

impl Head {
    pub(super) fn of(bytes: [u8; 9]) -> Self {
        let [opcode, length @ ..] = bytes;
        Self { opcode, length: u64::from_le_bytes(length) }
    }
}

/// A channel of messages as its records define it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Channel {
    pub id: u16,
    pub schema: u16,
    pub topic: String,
    /// How its messages are serialised: `cdr`, `protobuf`.
    pub encoding: String,
}

/// The head of a message record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MessageHead {
    pub channel: u16,
    /// When it was recorded (ns).
    pub recorded_ns: u64,
}

impl MessageHead {
    pub(super) fn read(bytes: &mut impl Read) -> Result<Self> {
        Bytes(&read_bytes(bytes, MESSAGE_HEAD_BYTES)?).message_head()
    }
}

/// The number and the name of a schema.
pub(super) fn schema(content: &[u8]) -> Result<(u16, String)> {
    let mut content = Bytes(content);
    Ok((content.u16()?, content.text()?))
}

/// The definition of a channel.
pub(super) fn channel(content: &[u8]) -> Result<Channel> {
    let mut content = Bytes(content);
    Ok(Channel {
        id: content.u16()?,
        schema: content.u16()?,
        topic: content.text()?,
        encoding: content.text()?,
    })
}

/// The number of messages in the file, by its statistics.
pub(super) fn message_count(content: &[u8]) -> Result<u64> {
    Bytes(content).u64()
}

/// The content of a record that is kept in memory: definitions, statistics.
pub(super) fn definition(bytes: &mut impl Read, length: u64) -> Result<Vec<u8>> {
    if length > MAX_DEFINITION_BYTES {
        return Err(SourceError::damaged(format!("a definition of {length} bytes in an MCAP file")));
    }
    read_bytes(bytes, length)
}

/// The head of a chunk of `length` bytes whose content starts at offset `start` of the file; its records follow.
pub(super) fn chunk_head(bytes: &mut impl Read, start: u64, length: u64) -> Result<Chunk> {
    // First and last time, size without compression, checksum
    let head = read_bytes(bytes, 32)?;
    let mut fields = Bytes(&head);
    fields.take(16)?;
    let (size, checksum, name_bytes) = (fields.u64()?, fields.u32()?, fields.u32()?);
    let too_long = || SourceError::damaged("a chunk whose compression has no name");
    let name_bytes = u8::try_from(name_bytes).map_err(|_| too_long())?;
    let rest = read_bytes(bytes, u64::from(name_bytes) + 8)?;
    let (name, stored) = rest.split_at(usize::from(name_bytes));
    let stored = Bytes(stored).u64()?;
    let head_bytes = 40 + u64::from(name_bytes);
    if stored.checked_add(head_bytes) != Some(length) {
        return Err(SourceError::damaged(format!(
            "a chunk of {length} bytes with {stored} bytes of records"
        )));
    }
    let compression = Compression::named(&String::from_utf8_lossy(name))?;
    if compression == Compression::None && stored != size {
        return Err(SourceError::damaged(format!(
            "an uncompressed chunk of {stored} bytes that claims {size}"
        )));
    }
    Ok(Chunk { offset: start + head_bytes, stored, size, checksum, compression })
}

/// The next `length` bytes; memory is reserved only for bytes that are there.
pub(super) fn read_bytes(bytes: &mut impl Read, length: u64) -> Result<Vec<u8>> {
    let mut read = Vec::new();
    bytes.take(length).read_to_end(&mut read).map_err(|e| SourceError::unreadable(&e))?;
    if read.len() as u64 == length { Ok(read) } else { Err(SourceError::of_cut_bag()) }
}

/// The fields of a record.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let (taken, rest) = self
            .0
            .split_at_checked(count)
            .ok_or_else(|| SourceError::damaged("a record that is shorter than its fields"))?;
        self.0 = rest;
        Ok(taken)
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut number = [0; N];
        number.copy_from_slice(self.take(N)?);
        Ok(number)
    }

    fn u16(&mut self) -> Result<u16> {
        self.number().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32> {
        self.number().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64> {
        self.number().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Result<String> {
        let length = self.u32()? as usize;
        let bytes = self.take(length)?;
        String::from_utf8(bytes.to_vec()).map_err(|_| SourceError::damaged("a name that is no text"))
    }

    fn message_head(&mut self) -> Result<MessageHead> {
        let channel = self.u16()?;
        self.u32()?;
        Ok(MessageHead { channel, recorded_ns: self.u64()? })
    }
}
