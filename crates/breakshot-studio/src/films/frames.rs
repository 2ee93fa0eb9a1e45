//! The frames of a film, exactly as the detector sees them: the decoder's luma as PNG, without loss.

use breakshot::capture::{Footage, Frame, PngEffort};
use breakshot::{Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

/// Frames that are kept, encoded (bytes).
const MOST_BYTES: usize = 96 << 20;

/// A frame as the page gets it.
pub(crate) struct Picture {
    pub(crate) time_s: f64,
    pub(crate) png: Vec<u8>,
}

/// The film that is open: its decoder, and the frames that were shown last.
#[derive(Default)]
pub(crate) struct Films(Mutex<Option<Open>>);

struct Open {
    path: PathBuf,
    changed: Option<SystemTime>,
    frame_rate_hz: Option<f64>,
    footage: Footage,
    /// The number of the decoder's next frame.
    next: usize,
    pictures: BTreeMap<usize, Arc<Picture>>,
    /// The number of frames, known at the film's end.
    count: Option<usize>,
}

/// What is known of a film before its frames are shown.
#[derive(serde::Serialize)]
pub(crate) struct Film {
    frame_count: usize,
    size_px: [usize; 2],
    warnings: Vec<String>,
}

/// What the head of a film's file holds; frames that it does not count are decoded and counted.
///
/// # Errors
/// A film that cannot be opened.
pub(crate) fn film(path: &Path) -> Result<Film> {
    let mut footage = Footage::open(path)?;
    let (size_px, warnings) = (footage.size_px(), footage.warnings().to_vec());
    // Frames behind damage cannot be shown; the tracking of the clip ends with the damage as its error.
    let count = |footage: &mut Footage| footage.take_while(Result::is_ok).count();
    let frame_count = footage.frame_count().unwrap_or_else(|| count(&mut footage));
    Ok(Film { frame_count, size_px, warnings })
}

impl Films {
    /// Frame `number` of a film; none after its end.
    ///
    /// # Errors
    /// A film that cannot be decoded.
    pub(crate) fn picture(
        &self,
        path: &Path,
        frame_rate_hz: Option<f64>,
        number: usize,
    ) -> Result<Option<Arc<Picture>>> {
        let mut open = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let changed = path.metadata().and_then(|file| file.modified()).ok();
        let is_open = open.as_ref().is_some_and(|film| {
            film.path == path && film.changed == changed && film.frame_rate_hz == frame_rate_hz
        });
        let mut film = match open.take() {
            Some(film) if is_open => film,
            _ => Open::new(path, changed, frame_rate_hz)?,
        };
        let found = film.picture(number);
        // A film that failed is opened anew when it is asked for again.
        if found.is_ok() {
            *open = Some(film);
        }
        found
    }
}

impl Open {
    fn new(path: &Path, changed: Option<SystemTime>, frame_rate_hz: Option<f64>) -> Result<Self> {
        let footage = Footage::open(path)?.at_frame_rate(frame_rate_hz);
        let pictures = BTreeMap::new();
        Ok(Self { path: path.into(), changed, frame_rate_hz, footage, next: 0, pictures, count: None })
    }

    fn picture(&mut self, number: usize) -> Result<Option<Arc<Picture>>> {
        if let Some(picture) = self.pictures.get(&number) {
            return Ok(Some(picture.clone()));
        }
        if self.count.is_some_and(|count| number >= count) {
            return Ok(None);
        }
        if number < self.next {
            // It was dropped: the film is decoded once more from its start.
            let pictures = std::mem::take(&mut self.pictures);
            let count = self.count;
            *self = Self { pictures, count, ..Self::new(&self.path, self.changed, self.frame_rate_hz)? };
        }
        while self.next <= number {
            let Some(frame) = self.footage.next().transpose()? else {
                self.count = Some(self.next);
                return Ok(None);
            };
            // Frames far before the wanted one are passed over without being encoded.
            if number - self.next < AHEAD {
                let picture = Arc::new(Picture::of(&self.path, &frame)?);
                self.pictures.insert(self.next, picture);
                self.forget(number);
            }
            self.next += 1;
        }
        Ok(self.pictures.get(&number).cloned())
    }

    /// Drops the frames that are farthest from the wanted one.
    fn forget(&mut self, wanted: usize) {
        let mut bytes: usize = self.pictures.values().map(|picture| picture.png.len()).sum();
        while bytes > MOST_BYTES && self.pictures.len() > 1 {
            let (first, last) =
                (self.pictures.first_entry().map(|e| *e.key()), self.pictures.keys().next_back());
            let (Some(first), Some(&last)) = (first, last) else { return };
            let farthest = if wanted.abs_diff(first) > wanted.abs_diff(last) { first } else { last };
            bytes -= self.pictures.remove(&farthest).map_or(0, |picture| picture.png.len());
        }
    }
}

/// Frames before a wanted one that are kept too, so that a step back is short.
const AHEAD: usize = 24;

impl Picture {
    fn of(path: &Path, frame: &Frame) -> Result<Self> {
        let png = frame.image.png(PngEffort::Fast);
        let png = png.ok_or_else(|| Error::video(path, "a frame that cannot be shown", "a smaller film"))?;
        Ok(Self { time_s: frame.time_s, png })
    }
}
