//! The MCAP container (<https://mcap.dev/spec>): one uncompressed chunk with its index, supported by every reader.

use std::collections::BTreeMap;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// The record kinds that are written.
#[derive(Clone, Copy)]
enum Opcode {
    Header = 0x01,
    Footer = 0x02,
    Schema = 0x03,
    Channel = 0x04,
    Message = 0x05,
    Chunk = 0x06,
    MessageIndex = 0x07,
    ChunkIndex = 0x08,
    Statistics = 0x0b,
    SummaryOffset = 0x0e,
    DataEnd = 0x0f,
}

/// A file assembled in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Container {
    /// Schema and channel records, in order; they go into the chunk and again into the summary.
    schemas: Vec<u8>,
    channels: Vec<u8>,
    channel_count: u16,
    /// Message records.
    messages: Vec<u8>,
    /// For each channel: time (ns) and offset of its messages within `messages`.
    index: BTreeMap<u16, Vec<(u64, u64)>>,
}

impl Container {
    /// Adds a channel of JSON messages and returns its number.
    pub(crate) fn channel(&mut self, topic: &str, schema_name: &str, schema: &str) -> u16 {
        self.channel_count += 1;
        let id = self.channel_count;
        let mut body = Vec::new();
        body.extend(id.to_le_bytes());
        push_text(&mut body, schema_name);
        push_text(&mut body, "jsonschema");
        push_text(&mut body, schema);
        push_record(&mut self.schemas, Opcode::Schema, &body);
        body.clear();
        body.extend(id.to_le_bytes());
        body.extend(id.to_le_bytes());
        push_text(&mut body, topic);
        push_text(&mut body, "json");
        body.extend(0_u32.to_le_bytes());
        push_record(&mut self.channels, Opcode::Channel, &body);
        self.index.insert(id, Vec::new());
        id
    }

    /// Adds a message.
    pub(crate) fn message(&mut self, channel: u16, time_ns: u64, data: &[u8]) {
        let entries = self.index.entry(channel).or_default();
        let mut body = Vec::with_capacity(data.len() + 22);
        body.extend(channel.to_le_bytes());
        body.extend((entries.len() as u32).to_le_bytes());
        body.extend(time_ns.to_le_bytes());
        body.extend(time_ns.to_le_bytes());
        body.extend(data);
        entries.push((time_ns, self.messages.len() as u64));
        push_record(&mut self.messages, Opcode::Message, &body);
    }

    /// The whole file.
    pub(crate) fn finished(&self) -> Vec<u8> {
        let mut file = MAGIC.to_vec();
        let mut body = Vec::new();
        push_text(&mut body, "");
        push_text(&mut body, concat!("breakshot ", env!("CARGO_PKG_VERSION")));
        push_record(&mut file, Opcode::Header, &body);
        let (first_ns, last_ns) = self.span_ns();
        let chunk_index = self.push_chunk(&mut file, first_ns, last_ns);
        push_record(&mut file, Opcode::DataEnd, &0_u32.to_le_bytes());
        self.push_summary(&mut file, &chunk_index, first_ns, last_ns);
        file.extend(MAGIC);
        file
    }

    /// First and last time (ns).
    fn span_ns(&self) -> (u64, u64) {
        let times = || self.index.values().flatten().map(|entry| entry.0);
        (times().min().unwrap_or(0), times().max().unwrap_or(0))
    }

    /// Writes the chunk and its message indices; returns the body of the chunk's index record.
    fn push_chunk(&self, file: &mut Vec<u8>, first_ns: u64, last_ns: u64) -> Vec<u8> {
        let start = file.len() as u64;
        let records = [self.schemas.as_slice(), &self.channels, &self.messages].concat();
        let size = records.len() as u64;
        let before_messages = size - self.messages.len() as u64;
        let mut body = Vec::with_capacity(records.len() + 64);
        body.extend(first_ns.to_le_bytes());
        body.extend(last_ns.to_le_bytes());
        body.extend(size.to_le_bytes());
        // Zero: no checksum.
        body.extend(0_u32.to_le_bytes());
        push_text(&mut body, "");
        body.extend(size.to_le_bytes());
        body.extend(records);
        push_record(file, Opcode::Chunk, &body);
        let length = file.len() as u64 - start;

        let mut offsets = Vec::new();
        let indices_start = file.len() as u64;
        for (channel, entries) in &self.index {
            offsets.extend(channel.to_le_bytes());
            offsets.extend((file.len() as u64).to_le_bytes());
            body.clear();
            body.extend(channel.to_le_bytes());
            body.extend((entries.len() as u32 * 16).to_le_bytes());
            for (time_ns, offset) in entries {
                body.extend(time_ns.to_le_bytes());
                body.extend((before_messages + offset).to_le_bytes());
            }
            push_record(file, Opcode::MessageIndex, &body);
        }

        let mut index = Vec::new();
        index.extend(first_ns.to_le_bytes());
        index.extend(last_ns.to_le_bytes());
        index.extend(start.to_le_bytes());
        index.extend(length.to_le_bytes());
        index.extend((offsets.len() as u32).to_le_bytes());
        index.extend(offsets);
        index.extend((file.len() as u64 - indices_start).to_le_bytes());
        push_text(&mut index, "");
        index.extend(size.to_le_bytes());
        index.extend(size.to_le_bytes());
        index
    }

    /// The summary, the offsets into it and the footer.
    fn push_summary(&self, file: &mut Vec<u8>, chunk_index: &[u8], first_ns: u64, last_ns: u64) {
        let mut statistics = Vec::new();
        let count: usize = self.index.values().map(Vec::len).sum();
        statistics.extend((count as u64).to_le_bytes());
        statistics.extend(self.channel_count.to_le_bytes());
        statistics.extend(u32::from(self.channel_count).to_le_bytes());
        // Attachments, metadata, chunks.
        for number in [0_u32, 0, 1] {
            statistics.extend(number.to_le_bytes());
        }
        statistics.extend(first_ns.to_le_bytes());
        statistics.extend(last_ns.to_le_bytes());
        statistics.extend((u32::from(self.channel_count) * 10).to_le_bytes());
        for (channel, entries) in &self.index {
            statistics.extend(channel.to_le_bytes());
            statistics.extend((entries.len() as u64).to_le_bytes());
        }
        let as_record = |opcode, body: &[u8]| {
            let mut record = Vec::new();
            push_record(&mut record, opcode, body);
            record
        };
        let groups = [
            (Opcode::Schema, self.schemas.clone()),
            (Opcode::Channel, self.channels.clone()),
            (Opcode::Statistics, as_record(Opcode::Statistics, &statistics)),
            (Opcode::ChunkIndex, as_record(Opcode::ChunkIndex, chunk_index)),
        ];
        let summary_start = file.len() as u64;
        let mut offsets = Vec::new();
        for (opcode, records) in groups {
            let mut body = vec![opcode as u8];
            body.extend((file.len() as u64).to_le_bytes());
            body.extend((records.len() as u64).to_le_bytes());
            push_record(&mut offsets, Opcode::SummaryOffset, &body);
            file.extend(records);
        }
        let offsets_start = file.len() as u64;
        file.extend(offsets);
        let mut footer = Vec::new();
        footer.extend(summary_start.to_le_bytes());
        footer.extend(offsets_start.to_le_bytes());
        footer.extend(0_u32.to_le_bytes());
        push_record(file, Opcode::Footer, &footer);
    }
}

fn push_record(file: &mut Vec<u8>, opcode: Opcode, body: &[u8]) {
    file.push(opcode as u8);
    file.extend((body.len() as u64).to_le_bytes());
    file.extend(body);
}

fn push_text(body: &mut Vec<u8>, text: &str) {
    body.extend((text.len() as u32).to_le_bytes());
    body.extend(text.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(bytes: &[u8]) -> u64 {
        bytes.iter().rev().fold(0, |sum, &byte| sum << 8 | u64::from(byte))
    }

    /// Opcode, offset and body of each record from `start` to `end`.
    fn records(file: &[u8], start: usize, end: usize) -> Vec<(u8, usize, &[u8])> {
        let (mut at, mut found) = (start, Vec::new());
        while at < end {
            let length = number(&file[at + 1..at + 9]) as usize;
            found.push((file[at], at, &file[at + 9..at + 9 + length]));
            at += 9 + length;
        }
        found
    }

    #[test]
    fn the_index_leads_to_every_message() {
        let mut container = Container::default();
        let (a, b) = (container.channel("/a", "A", "{}"), container.channel("/b", "B", "{}"));
        container.message(a, 5, b"first");
        container.message(b, 7, b"second");
        container.message(a, 9, b"third");
        let file = container.finished();
        assert!(file.starts_with(MAGIC) && file.ends_with(MAGIC), "magic at both ends");
        let all = records(&file, MAGIC.len(), file.len() - MAGIC.len());
        let kinds: Vec<u8> = all.iter().map(|record| record.0).collect();
        assert_eq!(kinds, [1, 6, 7, 7, 15, 3, 3, 4, 4, 11, 8, 14, 14, 14, 14, 2]);
        let (_, chunk_at, chunk) = all[1];
        // Times, size, checksum, no compression, size: then the records.
        let content = &chunk[8 + 8 + 8 + 4 + 4 + 8..];
        let index = all[2].2;
        for (k, word) in ["first", "third"].into_iter().enumerate() {
            let entry = &index[6 + 16 * k..];
            let offset = number(&entry[8..16]) as usize;
            let message = records(content, offset, offset + 1)[0];
            assert_eq!((message.0, &message.2[22..]), (5, word.as_bytes()));
            assert_eq!(number(&entry[..8]), number(&message.2[6..14]), "time of `{word}` in ns");
        }
        let footer = all[15].2;
        assert_eq!(number(&footer[..8]) as usize, all[5].1, "the summary starts at the first schema");
        assert_eq!(number(&all[10].2[16..24]) as usize, chunk_at, "the chunk's offset");
    }
}
