//! Decoding the next frames in a thread of its own while the caller processes the last ones.

use super::error::SourceError;
use crate::capture::image::Frame;
use crate::error::Result;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, sync_channel};

/// Number of decoded frames that may wait for the caller: more would only take memory.
const FRAMES: usize = 2;

/// The same frames, decoded by another thread.
pub(super) fn prefetch<I>(path: PathBuf, frames: I) -> Prefetch
where
    I: Iterator<Item = Result<Frame>> + Send + 'static,
{
    let (sender, receiver) = sync_channel(FRAMES);
    std::thread::spawn(move || {
        for frame in frames {
            if sender.send(Some(frame)).is_err() {
                return;
            }
        }
        // An explicit end marker: without it the receiver reports that this thread died.  An error here means that the
        // receiver has been dropped and needs no end.
        let _ = sender.send(None);
    });
    Prefetch { path, frames: Some(receiver) }
}

/// The receiving end of a decoding thread.
pub(super) struct Prefetch {
    path: PathBuf,
    frames: Option<Receiver<Option<Result<Frame>>>>,
}

impl Iterator for Prefetch {
    type Item = Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        let received = self.frames.as_ref()?.recv();
        let next = received.unwrap_or_else(|_| {
            Some(Err(SourceError::damaged("a film whose decoding thread died").for_file(&self.path)))
        });
        if !matches!(next, Some(Ok(_))) {
            self.frames = None;
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::image::GreyImage;

    fn frame(time_s: f64) -> Frame {
        Frame { time_s, image: GreyImage { width: 1, height: 1, pixels: vec![0] } }
    }

    #[test]
    fn all_frames_come_in_their_order() {
        let frames: Vec<f64> = prefetch("film".into(), (0..9).map(|n| Ok(frame(f64::from(n)))))
            .map(|f| f.expect("a frame").time_s)
            .collect();
        assert_eq!(frames, (0..9).map(f64::from).collect::<Vec<_>>(), "times (s)");
    }

    #[test]
    fn dropping_the_frames_ends_the_thread_and_a_dead_thread_is_an_error() {
        assert!(prefetch("film".into(), (0..).map(|n| Ok(frame(f64::from(n))))).nth(3).is_some());
        let (sender, frames) = sync_channel(1);
        drop::<std::sync::mpsc::SyncSender<_>>(sender);
        let mut lost = Prefetch { path: "film".into(), frames: Some(frames) };
        assert!(lost.next().is_some_and(|next| next.is_err_and(|e| e.to_string().contains("thread died"))));
        assert!(lost.next().is_none());
    }
}
