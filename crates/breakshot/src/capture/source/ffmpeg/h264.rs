//! Long H.264 films, decoded by `ffmpeg` because it is faster.
//!
//! The luma equals that of the built-in decoder bit for bit; the times are those of the built-in reader.  From the first
//! frame at which `ffmpeg` reports an error, the built-in decoder continues, so that the same films are errors with and
//! without `ffmpeg`.

use crate::capture::image::Frame;
use crate::capture::source::mp4::reader;
use crate::capture::source::prefetch::Prefetch;
use crate::error::{Error, Result};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Largest difference of a frame's time from `ffmpeg`'s (s): clocks of films have longer periods.
const SAME_TIME_S: f64 = 1e-6;

/// The frames of one film.
pub(crate) struct FfmpegH264 {
    path: PathBuf,
    ffmpeg: Box<dyn Iterator<Item = Result<Frame>> + Send>,
    times_s: Vec<f64>,
    size_px: [usize; 2],
    returned: usize,
    /// The built-in decoder, once `ffmpeg` has reported an error.
    builtin: Option<std::iter::Skip<Prefetch>>,
}

impl FfmpegH264 {
    /// The frames that `ffmpeg` decodes, with these display times.
    pub(crate) fn new(
        path: &Path,
        ffmpeg: Box<dyn Iterator<Item = Result<Frame>> + Send>,
        times_s: Vec<f64>,
        size_px: [usize; 2],
    ) -> Self {
        Self { path: path.into(), ffmpeg, times_s, size_px, returned: 0, builtin: None }
    }

    /// The remaining frames by the built-in decoder.
    fn builtin_frames(&self) -> Result<std::iter::Skip<Prefetch>> {
        let file =
            File::open(&self.path).map_err(|source| Error::Read { path: self.path.clone(), source })?;
        let frames = reader::frames(&self.path, file).map_err(|error| error.for_file(&self.path))?;
        Ok(frames.skip(self.returned))
    }
}

impl Iterator for FfmpegH264 {
    type Item = Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Some(builtin) = &mut self.builtin {
            return builtin.next();
        }
        match (self.ffmpeg.next(), self.times_s.get(self.returned)) {
            (None, None) => None,
            (Some(Ok(frame)), Some(&time_s))
                if (frame.time_s - time_s).abs() < SAME_TIME_S
                    && [frame.image.width, frame.image.height] == self.size_px =>
            {
                self.returned += 1;
                Some(Ok(Frame { time_s, ..frame }))
            }
            _ => {
                self.ffmpeg = Box::new(std::iter::empty());
                match self.builtin_frames() {
                    Ok(frames) => self.builtin.insert(frames).next(),
                    Err(error) => {
                        self.times_s.truncate(self.returned);
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
    use crate::capture::source::{Pictures, open_mp4};
    use std::fs::File;
    use std::path::{Path, PathBuf};

    fn data(film: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/footage").join(film)
    }

    /// The frames before the first error, and the error's message or an empty text.
    fn read(path: &Path, ffmpeg_from_px: Option<u64>) -> (Vec<Frame>, String) {
        let mut frames = Vec::new();
        let opened = match open_mp4(path, File::open(path).unwrap(), Pictures::All, ffmpeg_from_px) {
            Ok(opened) => opened,
            Err(error) => return (frames, error.found),
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
            let (builtin, builtin_error) = read(&path, None);
            let (ffmpeg, error) = read(&path, Some(0));
            let times = |frames: &[Frame]| frames.iter().map(|f| f.time_s).collect::<Vec<_>>();
            assert_eq!(times(&builtin), times(&ffmpeg), "{}", path.display());
            assert!(builtin == ffmpeg, "{}: other luma", path.display());
            assert_eq!(builtin_error, error, "{}", path.display());
            assert_eq!(builtin_error.is_empty(), !path.ends_with("damaged.mp4"), "{builtin_error}");
        }
    }
}
