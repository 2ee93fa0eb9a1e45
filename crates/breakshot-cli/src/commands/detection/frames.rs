//! Frames kept while the tracker reads a film, so that the film is decoded only once.

use breakshot::capture::{Footage, Frame, GreyImage};
use std::sync::{Arc, Mutex, PoisonError};

/// The memory limit for kept frames (bytes): 258 frames of 1920 x 1080 px.  A longer film is decoded a second time.
pub(crate) const FRAME_MEMORY_BYTES: usize = 512 << 20;

/// The frames of a film, up to a memory limit.
#[derive(Default)]
pub(crate) struct FrameBuffer(Arc<Mutex<Kept>>);

#[derive(Default)]
struct Kept {
    frames: Vec<Frame>,
    bytes: usize,
    /// Whether the film exceeded the limit; then no frame is kept.
    exceeded: bool,
}

impl FrameBuffer {
    /// The same film; its frames are copied into the buffer when they are read.
    pub(crate) fn keeping(&self, footage: Footage, limit_bytes: usize) -> Footage {
        let kept = Arc::clone(&self.0);
        footage.observed(move |frame| {
            let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
            kept.bytes += frame.image.pixels.len();
            if kept.bytes > limit_bytes {
                kept.exceeded = true;
                kept.frames = Vec::new();
            }
            if !kept.exceeded {
                kept.frames.push(frame.clone());
            }
        })
    }

    /// All frames that were read; none if they exceeded the limit.
    pub(crate) fn into_frames(self) -> Option<Vec<Frame>> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        (!kept.exceeded).then(|| std::mem::take(&mut kept.frames))
    }
}

/// The first and the last frame of a film.
#[derive(Default)]
pub(crate) struct EndFrames(Arc<Mutex<[Option<GreyImage>; 2]>>);

impl EndFrames {
    /// The same film; its first and its last frame are copied when they are read.
    pub(crate) fn keeping(&self, footage: Footage) -> Footage {
        let ends = Arc::clone(&self.0);
        footage.observed(move |frame| {
            let mut ends = ends.lock().unwrap_or_else(PoisonError::into_inner);
            match &mut *ends {
                [None, _] => ends[0] = Some(frame.image.clone()),
                // All frames of a film have one size: the buffer is reused.
                [_, Some(last)] => last.pixels.clone_from(&frame.image.pixels),
                [_, last] => *last = Some(frame.image.clone()),
            }
        })
    }

    /// The first and the last frame that were read; none for fewer than two frames.
    pub(crate) fn into_images(self) -> Option<[GreyImage; 2]> {
        let mut ends = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let [first, last] = std::mem::take(&mut *ends);
        Some([first?, last?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(levels: &[u8]) -> Footage {
        let frame = |(k, &level): (usize, &u8)| Frame {
            time_s: k as f64 / 60.0,
            image: GreyImage { width: 4, height: 2, pixels: vec![level; 8] },
        };
        Footage::from_frames("film", levels.iter().enumerate().map(frame).collect())
    }

    fn levels(frames: &[Frame]) -> Vec<u8> {
        frames.iter().map(|frame| frame.image.pixels[0]).collect()
    }

    #[test]
    fn a_film_within_the_memory_limit_is_kept_and_a_longer_one_is_not() {
        let buffer = FrameBuffer::default();
        assert_eq!(buffer.keeping(film(&[1, 2, 3]), 24).count(), 3);
        assert_eq!(buffer.into_frames().map(|frames| levels(&frames)), Some(vec![1, 2, 3]));
        let buffer = FrameBuffer::default();
        assert_eq!(buffer.keeping(film(&[1, 2, 3]), 23).count(), 3);
        assert!(buffer.into_frames().is_none(), "24 bytes were kept; the limit is 23 bytes");
    }

    #[test]
    fn the_first_and_the_last_frame_are_kept() {
        for (film_levels, expected) in
            [(&[5, 6, 7, 8][..], Some([5, 8])), (&[5, 6], Some([5, 6])), (&[5], None), (&[], None)]
        {
            let ends = EndFrames::default();
            assert_eq!(ends.keeping(film(film_levels)).count(), film_levels.len());
            assert_eq!(ends.into_images().map(|ends| ends.map(|image| image.pixels[0])), expected);
        }
    }
}
