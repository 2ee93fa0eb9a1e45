//! The images of a topic, decoded one after the other.

use super::Images;
use super::chunk::{Chunk, ChunkReader};
use super::image::video::{Video, check_format, is_start};
use super::image::{compressed, pixels};
use super::index::Entry;
use super::messages::{Image, Kind};
use super::records::read_bytes;
use crate::capture::image::{Frame, GreyImage};
use crate::capture::source::error::SourceError;
use crate::capture::source::timestamps::NEEDED_TIMES;
use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::{Path, PathBuf};

type Result<T> = std::result::Result<T, SourceError>;

/// The bytes of a bag's messages; the files and the chunks are read onwards as far as possible.
struct Messages {
    files: Vec<PathBuf>,
    chunks: Vec<Chunk>,
    /// The file that was read last, and its number.
    file: Option<(u32, BufReader<File>)>,
    /// The compressed chunk that was read last, and its number.
    chunk: Option<(u32, ChunkReader)>,
}

impl Messages {
    fn read(&mut self, entry: &Entry) -> Result<Vec<u8>> {
        let path = &self.files[entry.file as usize];
        let length = u64::from(entry.length);
        let Some(number) = entry.chunk else {
            let mut file = match self.file.take() {
                Some((number, file)) if number == entry.file => file,
                _ => BufReader::new(File::open(path).map_err(|e| SourceError::unreadable(&e))?),
            };
            file.seek(SeekFrom::Start(entry.offset)).map_err(|e| SourceError::unreadable(&e))?;
            let message = read_bytes(&mut file, length)?;
            self.file = Some((entry.file, file));
            return Ok(message);
        };
        let mut chunk = match self.chunk.take() {
            Some((other, chunk)) if other == number && chunk.at() <= entry.offset => chunk,
            _ => ChunkReader::open(path, self.chunks[number as usize], false)?,
        };
        chunk.skip(entry.offset - chunk.at())?;
        let message = read_bytes(&mut chunk, length)?;
        self.chunk = Some((number, chunk));
        Ok(message)
    }
}

/// The frames of a topic.
pub(super) struct BagReader {
    shown: PathBuf,
    kind: Kind,
    entries: Vec<Entry>,
    messages: Messages,
    video: Video,
    /// Number of frames returned.
    returned: usize,
    /// The size of all frames so far.
    size_px: Option<[usize; 2]>,
}

impl BagReader {
    /// A reader, and warnings; `shown` is the path in error messages.
    ///
    /// # Errors
    /// Times that do not grow, a video without a key frame.
    pub(super) fn of(images: Images, shown: &Path) -> Result<(Self, Vec<String>)> {
        let Images { files, topic, kind, chunks, entries, lens: _ } = images;
        if let Some(n) = (1..entries.len()).find(|&n| entries[n].taken_ns <= entries[n - 1].taken_ns) {
            let [last_s, time_s] = [n - 1, n].map(|n| entries[n].taken_ns as f64 * 1e-9);
            let found = format!(
                "time stamps that go back: image {} of `{topic}` has the stamp {time_s:.6} s after {last_s:.6} s",
                n + 1
            );
            let needed = format!("{NEEDED_TIMES} (`header.stamp`, which the driver of the camera sets)");
            return Err(SourceError::unsuitable(found, needed));
        }
        let messages = Messages { files, chunks, file: None, chunk: None };
        let mut reader = Self {
            shown: shown.into(),
            kind,
            entries,
            messages,
            video: Video::default(),
            returned: 0,
            size_px: None,
        };
        let warnings = reader.skip_to_key_frame()?;
        Ok((reader, warnings))
    }

    /// Leaves out the messages of a video before its first key frame.
    fn skip_to_key_frame(&mut self) -> Result<Vec<String>> {
        if !matches!(self.kind, Kind::Video | Kind::ProtobufVideo) {
            return Ok(Vec::new());
        }
        for (n, entry) in self.entries.iter().enumerate() {
            let message = self.messages.read(entry)?;
            let Image::Video { format, data } = self.kind.image(&message)? else { continue };
            check_format(format)?;
            if is_start(data) {
                self.entries.drain(..n);
                let lost = format!(
                    "its first {n} frames refer to pictures before the start of the recording and are left out"
                );
                return Ok(if n > 0 { vec![lost] } else { Vec::new() });
            }
        }
        Err(SourceError::damaged("a video without a key frame that holds its parameters (SPS)"))
    }

    /// The times of the frames (s).
    pub(super) fn times_s(&self) -> Vec<f64> {
        (0..self.entries.len()).map(|n| self.time_s(n)).collect()
    }

    fn time_s(&self, n: usize) -> f64 {
        let since_first_ns = i128::from(self.entries[n].taken_ns) - i128::from(self.entries[0].taken_ns);
        since_first_ns as f64 / 1e9
    }

    fn advance(&mut self) -> Result<Option<Frame>> {
        let Some(entry) = self.entries.get(self.returned) else { return Ok(None) };
        let time_s = self.time_s(self.returned);
        let message = self.messages.read(entry);
        let image = message.and_then(|message| self.image(&message)).map_err(|error| {
            let (n, count) = (self.returned + 1, self.entries.len());
            let found = format!("image {n} of {count} (taken at {time_s:.4} s): {}", error.found);
            SourceError { found, ..error }
        })?;
        self.returned += 1;
        Ok(Some(Frame { time_s, image }))
    }

    /// The image of a message.
    fn image(&mut self, message: &[u8]) -> Result<GreyImage> {
        let image = match self.kind.image(message)? {
            Image::Raw(image) => pixels::picture(&image)?,
            Image::Compressed { format, data } => compressed::picture(format, data)?,
            Image::Video { format, data } => self.video.picture(format, data)?,
        };
        let [width, height] = *self.size_px.get_or_insert([image.width, image.height]);
        if [image.width, image.height] == [width, height] {
            return Ok(image);
        }
        let found = format!("{} x {} px", image.width, image.height);
        Err(SourceError::unsuitable(found, format!("{width} x {height} px, as the first image")))
    }
}

impl Iterator for BagReader {
    type Item = crate::error::Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        self.advance().map_err(|error| error.for_file(&self.shown)).transpose()
    }
}
