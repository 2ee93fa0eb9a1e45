//! Frames decoded while the last ones are still looked at.

use super::error::Refusal;
use crate::capture::image::Frame;
use crate::error::Result;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, sync_channel};

/// So many frames wait to be looked at: more would only take memory.
const FRAMES: usize = 2;

/// The same frames, decoded by a thread of their own.
pub(super) fn ahead<I>(path: PathBuf, frames: I) -> Ahead
where
    I: Iterator<Item = Result<Frame>> + Send + 'static,
{
    let (sender, frames_to_come) = sync_channel(FRAMES);
    std::thread::spawn(move || {
        for frame in frames {
            if sender.send(Some(frame)).is_err() {
                return;
            }
        }
        // Whoever hears no end must take it for an accident; whoever has gone needs no end.
        let _ = sender.send(None);
    });
    Ahead { path, frames: Some(frames_to_come) }
}

/// The receiving end.
pub(super) struct Ahead {
    path: PathBuf,
    frames: Option<Receiver<Option<Result<Frame>>>>,
}

impl Iterator for Ahead {
    type Item = Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        let received = self.frames.as_ref()?.recv();
        let next = received.unwrap_or_else(|_| {
            Some(Err(Refusal::damaged("a film whose decoding ended without a word").of(&self.path)))
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
        let frames: Vec<f64> = ahead("film".into(), (0..9).map(|n| Ok(frame(f64::from(n)))))
            .map(|f| f.expect("a frame").time_s)
            .collect();
        assert_eq!(frames, (0..9).map(f64::from).collect::<Vec<_>>());
    }

    #[test]
    fn a_film_that_is_left_early_ends_its_thread_and_a_lost_thread_is_an_error() {
        assert!(ahead("film".into(), (0..).map(|n| Ok(frame(f64::from(n))))).nth(3).is_some());
        let (sender, frames) = sync_channel(1);
        drop::<std::sync::mpsc::SyncSender<_>>(sender);
        let mut lost = Ahead { path: "film".into(), frames: Some(frames) };
        assert!(
            lost.next().is_some_and(|said| said.is_err_and(|e| e.to_string().contains("without a word")))
        );
        assert!(lost.next().is_none());
    }
}
