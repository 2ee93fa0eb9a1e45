//! Where are the messages of a bag that hold images, and which calibrations are beside them?

use super::camera_info::{self, Calibrations};
use super::chunk::{Chunk, ChunkReader, Compression};
use super::messages::Kind;
use super::records::{
    self, CHANNEL, CHUNK, Channel, FOOTER, HEAD_BYTES, Head, MAGIC, MESSAGE, MESSAGE_HEAD_BYTES, MessageHead,
    SCHEMA, STATISTICS,
};
use crate::capture::source::error::SourceError;
use crate::capture::source::limits::MAX_FRAMES;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

type Result<T> = std::result::Result<T, SourceError>;

/// Largest message that holds an image (bytes): one of the largest size in four channels.
const MAX_MESSAGE_BYTES: u64 = 161 << 20;

/// A message that holds an image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    /// When it was recorded (ns): the order of the messages.
    pub recorded_ns: u64,
    /// When the image was taken (ns).
    pub taken_ns: i64,
    /// The number of its file.
    pub file: u32,
    /// The number of its chunk if that is compressed.
    pub chunk: Option<u32>,
    /// Its data's offset in the file, or in the decompressed chunk.
    pub offset: u64,
    /// Its data's length (bytes).
    pub length: u32,
}

/// A topic with messages that hold images.
pub(super) struct Topic {
    pub schema: String,
    pub kind: Result<Kind>,
    /// Number of its messages.
    pub count: u64,
    /// Its messages as long as nothing is wrong with them.
    pub entries: Vec<Entry>,
    /// What is wrong with one of its messages.
    pub problem: Option<SourceError>,
}

/// All messages of a bag that hold images.
#[derive(Default)]
pub(super) struct Index {
    pub topics: BTreeMap<String, Topic>,
    /// The topics without images, and the type of their messages.
    pub others: BTreeMap<String, String>,
    /// The topics of cameras' calibrations, which are also among the others.
    pub calibrations: BTreeMap<String, Calibrations>,
    /// The compressed chunks.
    pub chunks: Vec<Chunk>,
    entry_count: u64,
}

/// What the records of one file have defined so far.
struct Scan<'a> {
    index: &'a mut Index,
    path: &'a Path,
    file: u32,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Content>,
    /// Number of messages of all channels.
    message_count: u64,
}

/// What the messages of a channel hold.
#[derive(Clone, PartialEq, Eq)]
enum Content {
    /// The images of this topic.
    Images(String),
    /// The calibrations of this topic.
    Calibrations(String),
    Other,
}

impl Index {
    /// Adds the messages of file number `file`, at `path`; reads all its records once.
    pub(super) fn add_file(&mut self, file: u32, path: &Path) -> Result<()> {
        let (schemas, channels) = (BTreeMap::new(), BTreeMap::new());
        Scan { index: self, path, file, schemas, channels, message_count: 0 }.run()
    }
}

/// A source of records that knows how to skip.
trait Records: Read {
    fn skip(&mut self, count: u64) -> Result<()>;
    fn at(&self) -> u64;
}

impl Records for ChunkReader {
    fn skip(&mut self, count: u64) -> Result<()> {
        self.skip(count)
    }

    fn at(&self) -> u64 {
        self.at()
    }
}

/// A file and the offset in it.
struct FileReader {
    file: BufReader<File>,
    at: u64,
    length: u64,
}

impl Read for FileReader {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let read = self.file.read(buffer)?;
        self.at += read as u64;
        Ok(read)
    }
}

impl Records for FileReader {
    fn skip(&mut self, count: u64) -> Result<()> {
        if count > self.length.saturating_sub(self.at) {
            return Err(SourceError::of_cut_bag());
        }
        self.file.seek_relative(count.cast_signed()).map_err(|e| SourceError::unreadable(&e))?;
        self.at += count;
        Ok(())
    }

    fn at(&self) -> u64 {
        self.at
    }
}

/// The next record's head; `None` at the end.
fn next_head(records: &mut impl Records) -> Result<Option<Head>> {
    let mut head = Vec::new();
    records.take(HEAD_BYTES).read_to_end(&mut head).map_err(|e| SourceError::unreadable(&e))?;
    match <[u8; 9]>::try_from(head) {
        Ok(head) => Ok(Some(Head::of(head))),
        Err(head) if head.is_empty() => Ok(None),
        Err(_) => Err(SourceError::of_cut_bag()),
    }
}

impl Scan<'_> {
    fn run(&mut self) -> Result<()> {
        let file = File::open(self.path).map_err(|e| SourceError::unreadable(&e))?;
        let length = file.metadata().map_err(|e| SourceError::unreadable(&e))?.len();
        let mut file = FileReader { file: BufReader::new(file), at: 0, length };
        if records::read_bytes(&mut file, 8)? != MAGIC {
            return Err(SourceError::damaged("a file that is no MCAP"));
        }
        loop {
            let head = next_head(&mut file)?.ok_or_else(SourceError::of_cut_bag)?;
            if head.length > length - file.at.min(length) {
                return Err(SourceError::of_cut_bag());
            }
            match head.opcode {
                CHUNK => {
                    let next = file.at + head.length;
                    let start = file.at;
                    let chunk = records::chunk_head(&mut file, start, head.length)?;
                    self.add_chunk(chunk)?;
                    file.skip(next - file.at)?;
                }
                STATISTICS => {
                    let claimed = records::message_count(&records::definition(&mut file, head.length)?)?;
                    if claimed != self.message_count {
                        return Err(SourceError::damaged(format!(
                            "an MCAP file with {} of the {claimed} messages that it claims",
                            self.message_count
                        )));
                    }
                }
                FOOTER => {
                    file.skip(head.length)?;
                    let end = records::read_bytes(&mut file, 8)?;
                    return if end == MAGIC { Ok(()) } else { Err(SourceError::of_cut_bag()) };
                }
                _ => self.add_record(&mut file, head, None)?,
            }
        }
    }

    /// Adds the records of a chunk.
    fn add_chunk(&mut self, chunk: Chunk) -> Result<()> {
        let mut reader = ChunkReader::open(self.path, chunk, true)?;
        let number = self.index.chunks.len() as u32;
        let place = match chunk.compression {
            Compression::None => Place::File(chunk.offset),
            _ => Place::Chunk(number),
        };
        let before = self.index.entry_count;
        while let Some(head) = next_head(&mut reader)? {
            self.add_record(&mut reader, head, Some(place))?;
        }
        reader.finish()?;
        if self.index.entry_count > before && matches!(place, Place::Chunk(_)) {
            self.index.chunks.push(chunk);
        }
        Ok(())
    }

    /// Adds the record with this head, which is not a chunk.
    fn add_record(&mut self, records: &mut impl Records, head: Head, place: Option<Place>) -> Result<()> {
        match head.opcode {
            SCHEMA => {
                let (id, name) = records::schema(&records::definition(records, head.length)?)?;
                self.schemas.insert(id, name);
                Ok(())
            }
            CHANNEL => {
                let content = records::definition(records, head.length)?;
                self.add_channel(records::channel(&content)?)
            }
            MESSAGE if head.length >= MESSAGE_HEAD_BYTES => {
                let message = MessageHead::read(records)?;
                self.message_count += 1;
                self.add_message(records, message, head.length - MESSAGE_HEAD_BYTES, place)
            }
            MESSAGE | CHUNK => Err(SourceError::damaged("a damaged record in an MCAP file")),
            _ => records.skip(head.length),
        }
    }

    fn add_channel(&mut self, channel: Channel) -> Result<()> {
        let schema = self.schemas.get(&channel.schema).map_or("", String::as_str);
        let content = match Kind::of(schema, &channel.encoding) {
            None => {
                self.index.others.insert(channel.topic.clone(), schema.to_owned());
                match Calibrations::of(schema, &channel.encoding) {
                    None => Content::Other,
                    Some(calibrations) => {
                        self.index.calibrations.entry(channel.topic.clone()).or_insert(calibrations);
                        Content::Calibrations(channel.topic.clone())
                    }
                }
            }
            Some(kind) => {
                let topic = self.index.topics.entry(channel.topic.clone()).or_insert_with(|| Topic {
                    schema: schema.to_owned(),
                    kind: kind.clone(),
                    count: 0,
                    entries: Vec::new(),
                    problem: None,
                });
                if topic.kind != kind {
                    topic.problem = Some(SourceError::damaged(format!(
                        "the topic `{}` with messages of two types: {} and {schema}",
                        channel.topic, topic.schema
                    )));
                }
                Content::Images(channel.topic.clone())
            }
        };
        match self.channels.insert(channel.id, content.clone()) {
            Some(other) if other != content => {
                Err(SourceError::damaged(format!("two topics in channel {} of an MCAP file", channel.id)))
            }
            _ => Ok(()),
        }
    }

    fn add_message(
        &mut self,
        records: &mut impl Records,
        message: MessageHead,
        length: u64,
        place: Option<Place>,
    ) -> Result<()> {
        let topic = match self.channels.get(&message.channel) {
            Some(Content::Images(topic)) => self.index.topics.get_mut(topic),
            Some(Content::Calibrations(topic)) => {
                let calibrations = self.index.calibrations.get_mut(topic);
                return add_calibration(calibrations, records, length);
            }
            Some(Content::Other) => None,
            None => {
                return Err(SourceError::damaged(format!(
                    "a message in channel {}, which is not defined",
                    message.channel
                )));
            }
        };
        let Some(topic) = topic else { return records.skip(length) };
        topic.count += 1;
        let (Ok(kind), None) = (&topic.kind, &topic.problem) else { return records.skip(length) };
        if length > MAX_MESSAGE_BYTES {
            topic.problem = Some(SourceError::damaged(format!("a message of {length} bytes")));
            return records.skip(length);
        }
        let offset = records.at();
        let looked_at = kind.time_bytes().unwrap_or(length).min(length);
        let start = records::read_bytes(records, looked_at)?;
        records.skip(length - looked_at)?;
        match kind.time_ns(&start) {
            Err(error) => topic.problem = Some(error),
            Ok(taken_ns) => {
                self.index.entry_count += 1;
                if self.index.entry_count > MAX_FRAMES {
                    let found = format!("more than {MAX_FRAMES} images");
                    return Err(SourceError::unsuitable(found, "a shorter bag"));
                }
                let (chunk, offset) = match place {
                    Some(Place::Chunk(number)) => (Some(number), offset),
                    Some(Place::File(start)) => (None, start + offset),
                    None => (None, offset),
                };
                let (recorded_ns, length) = (message.recorded_ns, length as u32);
                topic.entries.push(Entry { recorded_ns, taken_ns, file: self.file, chunk, offset, length });
            }
        }
        Ok(())
    }
}

/// Adds the next message to a topic's calibrations.
fn add_calibration(
    calibrations: Option<&mut Calibrations>,
    records: &mut impl Records,
    length: u64,
) -> Result<()> {
    let Some(calibrations) = calibrations.filter(|calibrations| calibrations.wants_more()) else {
        return records.skip(length);
    };
    if length > camera_info::MAX_BYTES {
        calibrations.add(Err(SourceError::damaged(format!("a calibration of {length} bytes"))));
        return records.skip(length);
    }
    let message = records::read_bytes(records, length)?;
    calibrations.add(Ok(&message));
    Ok(())
}

/// Where the records of a chunk are.
#[derive(Clone, Copy)]
enum Place {
    /// From this offset of the file on.
    File(u64),
    /// In the compressed chunk of this number.
    Chunk(u32),
}
