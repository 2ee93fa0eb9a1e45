//! H.264 that `ffmpeg` decodes, because the film is long enough for it to pay.
//!
//! Its frames are those of the built-in decoder, bit for bit; the times are our own reading of the file.  Whatever
//! `ffmpeg` complains about, the built-in decoder judges: it goes on from there.

use crate::capture::image::Frame;
use crate::capture::source::mp4::reader;
use crate::capture::source::prefetch::Ahead;
use crate::error::{Error, Result};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Times written in a file agree with `ffmpeg`'s within this (s): a clock ticks no faster.
const SAME_TIME_S: f64 = 1e-6;

/// The frames of one film.
pub(crate) struct Handed {
    path: PathBuf,
    program: Box<dyn Iterator<Item = Result<Frame>> + Send>,
    times_s: Vec<f64>,
    size_px: [usize; 2],
    shown: usize,
    /// The decoder of our own, once it had to take over.
    own: Option<std::iter::Skip<Ahead>>,
}

impl Handed {
    /// The frames that `program` gives, which are due at these times.
    pub(crate) fn new(
        path: &Path,
        program: Box<dyn Iterator<Item = Result<Frame>> + Send>,
        times_s: Vec<f64>,
        size_px: [usize; 2],
    ) -> Self {
        Self { path: path.into(), program, times_s, size_px, shown: 0, own: None }
    }

    /// The same frames by the built-in decoder, from the one that is due.
    fn taken_over(&self) -> Result<std::iter::Skip<Ahead>> {
        let file =
            File::open(&self.path).map_err(|source| Error::Read { path: self.path.clone(), source })?;
        let frames = reader::own(&self.path, file).map_err(|refusal| refusal.of(&self.path))?;
        Ok(frames.skip(self.shown))
    }
}

impl Iterator for Handed {
    type Item = Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Some(own) = &mut self.own {
            return own.next();
        }
        match (self.program.next(), self.times_s.get(self.shown)) {
            (None, None) => None,
            (Some(Ok(frame)), Some(&time_s))
                if (frame.time_s - time_s).abs() < SAME_TIME_S
                    && [frame.image.width, frame.image.height] == self.size_px =>
            {
                self.shown += 1;
                Some(Ok(Frame { time_s, ..frame }))
            }
            _ => {
                self.program = Box::new(std::iter::empty());
                match self.taken_over() {
                    Ok(own) => self.own.insert(own).next(),
                    Err(error) => {
                        self.times_s.truncate(self.shown);
                        Some(Err(error))
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::capture::image::Frame;
    use crate::capture::source::open_mp4;
    use std::fs::File;
    use std::path::{Path, PathBuf};

    fn data(film: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/footage").join(film)
    }

    /// All frames, and what was said about the film in their stead.
    fn read(path: &Path, handed_from_px: Option<u64>) -> (Vec<Frame>, String) {
        let mut frames = Vec::new();
        let opened = match open_mp4(path, File::open(path).unwrap(), handed_from_px) {
            Ok(opened) => opened,
            Err(refusal) => return (frames, refusal.found),
        };
        for frame in opened.frames {
            match frame {
                Ok(frame) => frames.push(frame),
                Err(error) => return (frames, error.to_string()),
            }
        }
        (frames, String::new())
    }

    #[test]
    #[ignore = "needs ffmpeg"]
    fn ffmpeg_and_the_built_in_decoder_give_the_same_frames_and_errors() {
        let folder = tempfile::tempdir().unwrap();
        let damaged = folder.path().join("damaged.mp4");
        let mut bytes = std::fs::read(data("b_frames.mp4")).unwrap();
        let media = bytes.windows(4).position(|window| window == b"mdat").unwrap();
        let middle = media + (bytes.len() - media) / 2;
        bytes[middle..middle + 200].fill(0xff);
        std::fs::write(&damaged, bytes).unwrap();
        for path in [data("b_frames.mp4"), data("turned_90.mp4"), data("ntsc.mp4"), damaged] {
            let (own, own_fault) = read(&path, None);
            let (handed, fault) = read(&path, Some(0));
            let times = |frames: &[Frame]| frames.iter().map(|f| f.time_s).collect::<Vec<_>>();
            assert_eq!(times(&own), times(&handed), "{}", path.display());
            assert!(own == handed, "{}: other luma", path.display());
            assert_eq!(own_fault, fault, "{}", path.display());
            assert_eq!(own_fault.is_empty(), !path.ends_with("damaged.mp4"), "{own_fault}");
        }
    }
}
