//! The frames of an MP4, in the order in which they are shown.

use super::boxes;
use super::orientation::Orientation;
use super::samples::Sample;
use super::timeline::{self, Timeline};
use super::track::{self, Track};
use crate::capture::image::{Frame, GreyImage};
use crate::capture::source::error::Refusal;
use crate::capture::source::h264::decoder::{Order, Stream};
use crate::capture::source::opened::Opened;
use crate::capture::source::prefetch::{Ahead, ahead};
use crate::capture::source::timestamps::{self, NEEDED_TIMES};
use crate::error::Result;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// A film's frames by the built-in decoder.
pub(crate) fn own(path: &Path, file: File) -> std::result::Result<Ahead, Refusal> {
    Ok(ahead(path.into(), Movie::of(path, file)?.1))
}

/// The timeline of a film cut out of a longer one: the first pictures may need others that were cut away.
fn without_leading(
    ticks: &[i64],
    track: &Track,
    warnings: &mut Vec<String>,
) -> std::result::Result<Timeline, Refusal> {
    let all = Timeline::of(ticks, &track.edits, track.timescale)?;
    let timeline = Timeline::of(ticks, &timeline::from(ticks[0], &track.edits), track.timescale)?;
    let lost = all.times_s.len() - timeline.times_s.len();
    if lost > 0 {
        warnings.push(format!("its first {lost} frames need pictures that were cut away, and are left out"));
    }
    Ok(timeline)
}

/// A film that is being decoded.
pub(crate) struct Movie {
    path: PathBuf,
    file: File,
    samples: Vec<Sample>,
    pub(crate) timeline: Timeline,
    orientation: Orientation,
    stream: Stream,
    coded: Vec<u8>,
    /// How many samples are decoded, and how many frames are shown.
    decoded: usize,
    shown: u32,
    /// Pictures that wait for their turn, by their place; each with its number in decoding order.
    waiting: BTreeMap<u32, (GreyImage, Order, usize)>,
    last: Option<(Order, usize)>,
}

impl Movie {
    pub(crate) fn of(path: &Path, mut file: File) -> std::result::Result<(Opened, Self), Refusal> {
        let length = file.metadata().map_err(|e| Refusal::damaged(format!("unreadable ({e})")))?.len();
        let mut track = track::read(&mut file, length)?;
        let Some(&first) = track.samples.first() else {
            return Err(Refusal::unfit("a film of 0 frames", "at least one frame"));
        };
        let coded = boxes::read_at(&mut file, first.offset, u64::from(first.size))?;
        let stream = Stream::new(&track.coding, &coded)?;
        let mut warnings = std::mem::take(&mut track.warnings);
        let ticks: Vec<i64> = track.samples.iter().map(|sample| sample.shown).collect();
        let timeline = if stream.begins_anew {
            Timeline::of(&ticks, &track.edits, track.timescale)?
        } else {
            without_leading(&ticks, &track, &mut warnings)?
        };
        warnings.extend(timestamps::warnings(&timeline.times_s, 1.0 / f64::from(track.timescale)));
        let opened = Opened {
            size_px: Orientation::size(stream.size_px()?, track.orientation),
            frame_count: Some(timeline.times_s.len()),
            warnings,
            frames: Box::new(std::iter::empty()),
            tick_s: None,
        };
        let movie = Self {
            path: path.into(),
            file,
            samples: track.samples,
            timeline,
            orientation: track.orientation,
            stream,
            coded,
            decoded: 0,
            shown: 0,
            waiting: BTreeMap::new(),
            last: None,
        };
        Ok((opened, movie))
    }

    /// Decodes until the next frame in the order of showing is there; nothing after the last one.
    fn advance(&mut self) -> std::result::Result<Option<Frame>, Refusal> {
        let Some(&time_s) = self.timeline.times_s.get(self.shown as usize) else {
            return Ok(None);
        };
        while !self.waiting.contains_key(&self.shown) {
            self.decode_next()?;
        }
        let Some((image, order, number)) = self.waiting.remove(&self.shown) else {
            return Ok(None);
        };
        self.check_order(time_s, order, number)?;
        self.shown += 1;
        Ok(Some(Frame { time_s, image: self.orientation.upright(image) }))
    }

    pub(crate) fn decode_next(&mut self) -> std::result::Result<(), Refusal> {
        let number = self.decoded;
        let (Some(&sample), Some(&place)) = (self.samples.get(number), self.timeline.places.get(number))
        else {
            return Err(Refusal::damaged("fewer pictures than time stamps"));
        };
        self.decoded += 1;
        self.coded.resize(sample.size as usize, 0);
        let coded = &mut self.coded;
        let picture =
            boxes::read_into(&mut self.file, sample.offset, coded).and_then(|()| self.stream.picture(coded));
        let picture = picture.map_err(|refusal| {
            let when = match place {
                Some(place) => format!("shown at {:.4} s", self.timeline.times_s[place as usize]),
                None => "not shown".into(),
            };
            let found = format!("frame {} of {} ({when}): {}", number + 1, self.samples.len(), refusal.found);
            Refusal { found, ..refusal }
        })?;
        if let Some(place) = place {
            self.waiting.insert(place, (picture.image, picture.order, number));
        }
        Ok(())
    }

    /// An error where the file's time stamps contradict the order that the coded pictures themselves tell.
    fn check_order(&mut self, time_s: f64, order: Order, number: usize) -> std::result::Result<(), Refusal> {
        let contradicted = self.last.is_some_and(|(last_order, last_number)| {
            order < last_order || (order == last_order && number < last_number)
        });
        if contradicted {
            let found = format!(
                "time stamps that go back: the frame shown at {time_s:.4} s belongs before the last one"
            );
            return Err(Refusal::unfit(found, NEEDED_TIMES));
        }
        self.last = Some((order, number));
        Ok(())
    }
}

impl Iterator for Movie {
    type Item = Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        self.advance().map_err(|refusal| refusal.of(&self.path)).transpose()
    }
}
