//! The frames of an MP4 in display order, decoded by the built-in decoder.

use super::boxes;
use super::orientation::Orientation;
use super::samples::Sample;
use super::timeline::{self, Timeline};
use super::track::{self, Track};
use crate::capture::image::{Frame, GreyImage};
use crate::capture::source::Pictures;
use crate::capture::source::error::SourceError;
use crate::capture::source::h264::decoder::{DisplayOrder, H264Decoder};
use crate::capture::source::opened::Opened;
use crate::capture::source::prefetch::{Prefetch, prefetch};
use crate::capture::source::timestamps::{self, NEEDED_TIMES};
use crate::error::Result;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// A film's frames in display order.
pub(crate) fn frames(path: &Path, file: File) -> std::result::Result<Prefetch, SourceError> {
    Ok(prefetch(path.into(), Mp4Reader::of(path, file, Pictures::All)?.1))
}

/// The timeline of a film that does not start with an IDR picture: pictures displayed before the first key frame may
/// refer to pictures that are not in the file, and are left out with a warning.
fn without_leading(
    ticks: &[i64],
    track: &Track,
    warnings: &mut Vec<String>,
) -> std::result::Result<Timeline, SourceError> {
    let all = Timeline::of(ticks, &track.edits, track.timescale)?;
    let timeline = Timeline::of(ticks, &timeline::edits_from(ticks[0], &track.edits), track.timescale)?;
    let lost = all.times_s.len() - timeline.times_s.len();
    if lost > 0 {
        warnings.push(format!(
            "its first {lost} frames refer to pictures before the start of the file and are left out"
        ));
    }
    Ok(timeline)
}

/// A film during decoding.
pub(crate) struct Mp4Reader {
    path: PathBuf,
    file: File,
    samples: Vec<Sample>,
    pub(crate) timeline: Timeline,
    orientation: Orientation,
    pictures: Pictures,
    decoder: H264Decoder,
    coded: Vec<u8>,
    /// Number of samples decoded or skipped so far.
    decoded: usize,
    /// Number of frames returned or skipped so far.
    returned: u32,
    /// Decoded pictures that have not been returned yet, by their index in display order; `None` for one that is skipped.
    waiting: BTreeMap<u32, Option<Decoded>>,
    /// The display order and the sample number of the frame returned last.
    last: Option<(DisplayOrder, usize)>,
}

/// A picture, its position in the stream's own display order, and its sample number.
struct Decoded {
    image: GreyImage,
    order: DisplayOrder,
    sample: usize,
}

impl Mp4Reader {
    /// Reads the index, the decoder's configuration and the timeline; decodes nothing.
    pub(crate) fn of(
        path: &Path,
        mut file: File,
        pictures: Pictures,
    ) -> std::result::Result<(Opened, Self), SourceError> {
        let length = file.metadata().map_err(|e| SourceError::damaged(format!("unreadable ({e})")))?.len();
        let mut track = track::read(&mut file, length)?;
        let Some(&first) = track.samples.first() else {
            return Err(SourceError::unsuitable("a film of 0 frames", "at least one frame"));
        };
        let coded = boxes::read_at(&mut file, first.offset, u64::from(first.size))?;
        let decoder = H264Decoder::new(&track.config, &coded)?;
        let mut warnings = std::mem::take(&mut track.warnings);
        let ticks: Vec<i64> = track.samples.iter().map(|sample| sample.display_tick).collect();
        let timeline = if decoder.starts_with_idr {
            Timeline::of(&ticks, &track.edits, track.timescale)?
        } else {
            without_leading(&ticks, &track, &mut warnings)?
        };
        warnings.extend(timestamps::warnings(&timeline.times_s, 1.0 / f64::from(track.timescale)));
        let opened = Opened {
            size_px: Orientation::displayed_size(decoder.size_px()?, track.orientation),
            frame_count: Some(timeline.times_s.len()),
            warnings,
            frames: Box::new(std::iter::empty()),
            tick_s: None,
            lens: None,
        };
        let movie = Self {
            path: path.into(),
            file,
            samples: track.samples,
            timeline,
            orientation: track.orientation,
            pictures,
            decoder,
            coded,
            decoded: 0,
            returned: 0,
            waiting: BTreeMap::new(),
            last: None,
        };
        Ok((opened, movie))
    }

    /// The next frame in display order; `None` after the last one.
    fn advance(&mut self) -> std::result::Result<Option<Frame>, SourceError> {
        while let Some(&time_s) = self.timeline.times_s.get(self.returned as usize) {
            let Some(next) = self.waiting.remove(&self.returned) else {
                self.decode_next()?;
                continue;
            };
            self.returned += 1;
            if let Some(Decoded { image, order, sample }) = next {
                self.check_order(time_s, order, sample)?;
                return Ok(Some(Frame { time_s, image: self.orientation.upright(image) }));
            }
        }
        Ok(None)
    }

    /// Decodes the next sample and stores its picture, or skips it.
    pub(crate) fn decode_next(&mut self) -> std::result::Result<(), SourceError> {
        let number = self.decoded;
        let (Some(&sample), Some(&index)) =
            (self.samples.get(number), self.timeline.display_indices.get(number))
        else {
            return Err(SourceError::damaged("fewer pictures than time stamps"));
        };
        self.decoded += 1;
        self.coded.resize(sample.size as usize, 0);
        let coded = &mut self.coded;
        let read = boxes::read_into(&mut self.file, sample.offset, coded);
        let is_skipped =
            read.is_ok() && self.pictures == Pictures::References && self.decoder.is_unreferenced(coded);
        if is_skipped && number > 0 {
            self.waiting.extend(index.map(|index| (index, None)));
            return Ok(());
        }
        let picture = read.and_then(|()| self.decoder.picture(coded));
        let picture = picture.map_err(|error| {
            let when = match index {
                Some(index) => format!("shown at {:.4} s", self.timeline.times_s[index as usize]),
                None => "not shown".into(),
            };
            let found = format!("frame {} of {} ({when}): {}", number + 1, self.samples.len(), error.found);
            SourceError { found, ..error }
        })?;
        if let Some(index) = index {
            let decoded = Decoded { image: picture.image, order: picture.order, sample: number };
            self.waiting.insert(index, Some(decoded));
        }
        Ok(())
    }

    /// An error where the file's time stamps contradict the display order that the coded pictures hold.
    fn check_order(
        &mut self,
        time_s: f64,
        order: DisplayOrder,
        sample: usize,
    ) -> std::result::Result<(), SourceError> {
        let contradicted = self.last.is_some_and(|(last_order, last_sample)| {
            order < last_order || (order == last_order && sample < last_sample)
        });
        if contradicted {
            let found = format!(
                "time stamps that go back: the frame shown at {time_s:.4} s belongs before the last one"
            );
            return Err(SourceError::unsuitable(found, NEEDED_TIMES));
        }
        self.last = Some((order, sample));
        Ok(())
    }
}

impl Iterator for Mp4Reader {
    type Item = Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        self.advance().map_err(|error| error.for_file(&self.path)).transpose()
    }
}
