//! The records within a chunk, decompressed as they are read.

use crate::capture::source::catch_panic::catch_panic;
use crate::capture::source::error::SourceError;
use crc32fast::Hasher;
use lz4_flex::frame::FrameDecoder as Lz4;
use ruzstd::decoding::StreamingDecoder as Zstd;
use std::fs::File;
use std::io::{BufReader, Error as IoError, Read, Result as IoResult, Seek, SeekFrom, Take};
use std::path::Path;

/// Largest chunk, and largest window of its decompression (bytes, decompressed). Recorders close a chunk at some megabytes, but one
/// image may be larger: 160 million bytes in four channels.
const MAX_CHUNK_BYTES: u64 = 256 << 20;

/// How the records of a chunk are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compression {
    None,
    Zstd,
    Lz4,
}

impl Compression {
    pub(super) fn named(name: &str) -> Result<Self, SourceError> {
        match name {
            "" => Ok(Self::None),
            "zstd" => Ok(Self::Zstd),
            "lz4" => Ok(Self::Lz4),
            other => {
                let found = format!("chunks compressed by `{}`", other.escape_debug());
                Err(SourceError::unsuitable(found, "chunks without compression, by `zstd` or by `lz4`"))
            }
        }
    }
}

/// A chunk's records in its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Chunk {
    /// Their offset in the file.
    pub offset: u64,
    /// Bytes in the file.
    pub stored: u64,
    /// Bytes when they are decompressed.
    pub size: u64,
    /// CRC-32 of the decompressed bytes; 0 if there is none.
    pub checksum: u32,
    pub compression: Compression,
}

/// Reads the decompressed bytes of a chunk and counts them.
pub(super) struct ChunkReader {
    chunk: Chunk,
    source: Source,
    /// Number of bytes read.
    at: u64,
    /// The checksum of the bytes read, if it is to be compared.
    hasher: Option<Hasher>,
}

type Stored = Take<BufReader<File>>;

enum Source {
    Plain(Stored),
    Zstd(Box<Zstd<Stored, ruzstd::decoding::FrameDecoder>>),
    Lz4(Box<Lz4<Stored>>),
}

impl ChunkReader {
    /// A reader of a chunk in the file at `path`; with `verified` the checksum is compared at the chunk's end.
    pub(super) fn open(path: &Path, chunk: Chunk, verified: bool) -> Result<Self, SourceError> {
        if chunk.size > MAX_CHUNK_BYTES {
            let found = format!("a chunk of {} bytes", chunk.size);
            return Err(SourceError::unsuitable(found, format!("chunks of at most {MAX_CHUNK_BYTES} bytes")));
        }
        let mut file = File::open(path).map_err(|e| SourceError::unreadable(&e))?;
        file.seek(SeekFrom::Start(chunk.offset)).map_err(|e| SourceError::unreadable(&e))?;
        let stored = BufReader::new(file).take(chunk.stored);
        let source = match chunk.compression {
            Compression::None => Source::Plain(stored),
            Compression::Zstd => {
                let opened = catch_panic(|| Zstd::new_with_max_window_size(stored, MAX_CHUNK_BYTES));
                let opened = opened.ok_or_else(|| undecodable("zstd", "damaged"))?;
                Source::Zstd(Box::new(opened.map_err(|e| undecodable("zstd", e))?))
            }
            Compression::Lz4 => Source::Lz4(Box::new(Lz4::new(stored))),
        };
        let hasher = (verified && chunk.checksum != 0).then(Hasher::new);
        Ok(Self { chunk, source, at: 0, hasher })
    }

    /// Number of bytes read or skipped.
    pub(super) fn at(&self) -> u64 {
        self.at
    }

    /// Skips bytes; those of an uncompressed chunk without a checksum are not read.
    pub(super) fn skip(&mut self, count: u64) -> Result<(), SourceError> {
        if count > self.chunk.size.saturating_sub(self.at) {
            return Err(SourceError::damaged("a record that is longer than its chunk"));
        }
        if let (Source::Plain(stored), None) = (&mut self.source, &self.hasher) {
            stored.get_mut().seek_relative(count.cast_signed()).map_err(|e| SourceError::unreadable(&e))?;
            stored.set_limit(stored.limit() - count);
            self.at += count;
            return Ok(());
        }
        let skipped = std::io::copy(&mut self.by_ref().take(count), &mut std::io::sink());
        if skipped.map_err(|e| SourceError::unreadable(&e))? == count {
            Ok(())
        } else {
            Err(SourceError::of_cut_bag())
        }
    }

    /// An error unless all bytes of the chunk have been read, are as many as it claims and have its checksum.
    pub(super) fn finish(mut self) -> Result<(), SourceError> {
        let claimed = self.chunk.size;
        let further = self.read(&mut [0]).map_err(|e| SourceError::unreadable(&e))?;
        if self.at != claimed || further != 0 {
            return Err(SourceError::damaged(format!(
                "a chunk that does not hold the {claimed} bytes it claims"
            )));
        }
        match self.hasher.map(Hasher::finalize) {
            Some(found) if found != self.chunk.checksum => {
                Err(SourceError::damaged("a chunk whose checksum does not agree with its bytes"))
            }
            _ => Ok(()),
        }
    }
}

impl Read for ChunkReader {
    fn read(&mut self, buffer: &mut [u8]) -> IoResult<usize> {
        let source = &mut self.source;
        let read = catch_panic(|| match source {
            Source::Plain(stored) => stored.read(buffer),
            Source::Zstd(zstd) => zstd.read(buffer),
            Source::Lz4(lz4) => lz4.read(buffer),
        });
        let read =
            read.unwrap_or_else(|| Err(IoError::other("compressed bytes that the decompressor panics on")))?;
        self.at += read as u64;
        if self.at > self.chunk.size {
            return Err(IoError::other(format!(
                "a chunk of more than the {} bytes it claims",
                self.chunk.size
            )));
        }
        if let Some(hasher) = &mut self.hasher {
            hasher.update(&buffer[..read]);
        }
        Ok(read)
    }
}

fn undecodable(compression: &str, problem: impl std::fmt::Display) -> SourceError {
    SourceError::damaged(format!("a chunk that cannot be decompressed ({compression}: {problem})"))
}
