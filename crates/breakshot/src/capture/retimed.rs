//! The frames of a film whose file says another frame rate.

use super::image::Frame;
use crate::error::Result;
use crate::retiming::Retiming;
use std::collections::VecDeque;

/// The frames of a film with the times of the rate at which they were taken.
pub(super) struct RetimedFrames {
    frames: Box<dyn Iterator<Item = Result<Frame>> + Send>,
    rate_hz: f64,
    /// The first frames, from whose times the interval in the file is known; `None` before they are read.
    first: Option<(VecDeque<Result<Frame>>, Option<Retiming>)>,
}

impl RetimedFrames {
    pub(super) fn new(frames: Box<dyn Iterator<Item = Result<Frame>> + Send>, rate_hz: f64) -> Self {
        Self { frames, rate_hz, first: None }
    }
}

impl Iterator for RetimedFrames {
    type Item = Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        let (first, retiming) = self.first.get_or_insert_with(|| {
            let first: VecDeque<_> = self.frames.by_ref().take(Retiming::FIRST_FRAMES).collect();
            let times_s: Vec<f64> = first.iter().flatten().map(|frame| frame.time_s).collect();
            (first, Retiming::new(self.rate_hz, &times_s))
        });
        let mut next = first.pop_front().or_else(|| self.frames.next());
        if let (Some(Ok(frame)), Some(retiming)) = (&mut next, retiming) {
            frame.time_s = retiming.time_s(frame.time_s);
        }
        next
    }
}
