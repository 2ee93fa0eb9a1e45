//! Bags of ROS 2 as films: the images of one topic of an MCAP file, or of a folder of them.
//!
//! The order of the images is that of their recording, their times are those in the messages. One pass through the file finds
//! the messages and checks the checksums; images are decoded one after the other. The calibration in the same bag is the lens of the film.

mod camera_info;
mod cdr;
mod chunk;
mod folder;
mod image;
mod index;
mod messages;
mod protobuf;
mod reader;
mod records;

use super::error::SourceError;
use super::opened::Opened;
use super::prefetch::prefetch;
use super::timestamps;
use crate::capture::recorded_lens::RecordedLens;
use crate::cell::camera_info::SensorCalibration;
use crate::error::Result;
pub(super) use folder::is_bag;
use index::{Entry, Index};
use messages::{Kind, READ};
use reader::BagReader;
pub(super) use records::MAGIC;
use std::path::{Path, PathBuf};

/// Number of topics that an error lists.
const LISTED: usize = 12;
/// The clock of the time stamps (s).
const TICK_S: f64 = 1e-9;

/// A topic of a bag: its files, and its images in the order of their recording.
struct Images {
    files: Vec<PathBuf>,
    topic: String,
    kind: Kind,
    chunks: Vec<chunk::Chunk>,
    entries: Vec<Entry>,
    lens: Option<Lens>,
}

/// The calibration of the camera that took the images of a topic.
struct Lens {
    topic: String,
    calibration: std::result::Result<SensorCalibration, SourceError>,
    /// The number of the first message, from 1 on, that does not hold it.
    change: Option<u64>,
}

impl Lens {
    /// That of the topic that belongs to a topic of images; `None` without one, and from a driver without a calibration.
    fn of_images(index: &Index, image_topic: &str) -> Option<Self> {
        let topic = camera_info::topic_of(image_topic, index.calibrations.keys().map(String::as_str))?;
        let calibrations = index.calibrations.get(topic)?;
        let calibration = calibrations.of_images(camera_info::are_rectified(image_topic))?;
        Some(Self { topic: topic.to_owned(), calibration, change: calibrations.change })
    }

    /// The same for a film at the path `shown`.
    fn recorded(self, shown: &Path) -> RecordedLens {
        let name = format!("{}: `{}`", shown.display(), self.topic.escape_debug());
        let of_topic = |error: SourceError| {
            let found = format!("`{}`: {}", self.topic.escape_debug(), error.found);
            SourceError { found, ..error }.for_file(shown)
        };
        let intrinsics = self.calibration.map_err(of_topic).and_then(|lens| lens.intrinsics(&name));
        RecordedLens { topic: self.topic, intrinsics, change: self.change }
    }
}

/// Opens the topic of the bag in `file`, an MCAP file or a folder; `shown` is the path in error messages.
pub(super) fn open(file: &Path, topic: Option<&str>, shown: &Path) -> Result<Opened> {
    let mut images = images(file, topic).map_err(|error| error.for_file(shown))?;
    let lens = images.lens.take().map(|lens| lens.recorded(shown));
    let (mut reader, mut warnings) = BagReader::of(images, shown).map_err(|error| error.for_file(shown))?;
    let times_s = reader.times_s();
    warnings.extend(timestamps::warnings(&times_s, TICK_S));
    let first = reader.next().transpose()?;
    let first = first.ok_or_else(|| SourceError::damaged("a bag without an image").for_file(shown))?;
    let size_px = [first.image.width, first.image.height];
    let frames = std::iter::once(Ok(first)).chain(prefetch(shown.into(), reader));
    let (frame_count, frames) = (Some(times_s.len()), Box::new(frames));
    Ok(Opened { size_px, frame_count, warnings, frames, tick_s: None, lens })
}

/// When the first image of a topic was taken (ns); `None` for a bag that cannot be read.
pub(super) fn taken_ns(file: &Path, topic: Option<&str>) -> Option<i64> {
    let images = images(file, topic).ok()?;
    images.entries.first().map(|entry| entry.taken_ns)
}

/// The images of the topic, or of the only topic with images.
fn images(file: &Path, topic: Option<&str>) -> std::result::Result<Images, SourceError> {
    let files = if file.is_dir() { folder::files(file)? } else { vec![file.to_path_buf()] };
    let mut index = Index::default();
    for (number, file) in (0..).zip(&files) {
        index.add_file(number, file)?;
    }
    let topic = match topic {
        Some(topic) => topic.to_owned(),
        None => only_topic(&index)?,
    };
    let Some(chosen) = index.topics.remove(&topic) else {
        let found = match index.others.get(&topic) {
            Some(schema) => format!("messages of type {} in the topic `{topic}`", schema.escape_debug()),
            None => format!("no topic `{}`", topic.escape_debug()),
        };
        return Err(SourceError::unsuitable(found, format!("a topic with images: {}", listed(&index))));
    };
    let of_topic = |error: SourceError| SourceError { found: format!("`{topic}`: {}", error.found), ..error };
    if let Some(problem) = chosen.problem {
        return Err(of_topic(problem));
    }
    let kind = chosen.kind.map_err(of_topic)?;
    let mut entries = chosen.entries;
    entries.sort_by_key(|entry| entry.recorded_ns);
    if entries.is_empty() {
        return Err(SourceError::unsuitable(
            format!("no message in the topic `{topic}`"),
            "at least one image",
        ));
    }
    let lens = Lens::of_images(&index, &topic);
    Ok(Images { files, topic, kind, chunks: index.chunks, entries, lens })
}

/// The only topic with images.
fn only_topic(index: &Index) -> std::result::Result<String, SourceError> {
    let mut topics = index.topics.iter().filter(|(_, topic)| topic.count > 0);
    match (topics.next(), topics.next()) {
        (Some((name, _)), None) => Ok(name.clone()),
        (None, _) => {
            let types: Vec<String> = index.others.values().take(LISTED).cloned().collect();
            let found = format!("a bag without images (its messages: {})", types.join(", ").escape_debug());
            Err(SourceError::unsuitable(found, format!("messages of type {READ}")))
        }
        _ => {
            let found = format!("a bag with several topics of images: {}", listed(index));
            Err(SourceError::unsuitable(
                found,
                "one of them behind the name of the bag, as in `BAG#/camera/image_raw`",
            ))
        }
    }
}

/// The topics with images, for messages.
fn listed(index: &Index) -> String {
    let describe = |(name, topic): (&String, &index::Topic)| {
        format!("`{}` ({}, {} messages)", name.escape_debug(), topic.schema, topic.count)
    };
    let mut topics: Vec<String> = index.topics.iter().map(describe).take(LISTED).collect();
    if topics.is_empty() {
        return "none in this bag".into();
    }
    if let Some(more) = index.topics.len().checked_sub(LISTED).filter(|&more| more > 0) {
        topics.push(format!("and {more} more"));
    }
    topics.join(", ")
}
