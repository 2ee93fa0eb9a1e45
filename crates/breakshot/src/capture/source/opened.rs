//! What every reader returns: a film whose header has been read.

use crate::capture::image::Frame;
use crate::capture::recorded_lens::RecordedLens;
use crate::error::Result;

/// A film whose header has been read and whose frames can be decoded.
pub(crate) struct Opened {
    pub size_px: [usize; 2],
    pub frame_count: Option<usize>,
    pub warnings: Vec<String>,
    pub frames: Box<dyn Iterator<Item = Result<Frame>> + Send>,
    /// The period of the clock of the time stamps (s), for a film whose times are known only frame by frame and have
    /// not been checked yet.
    pub tick_s: Option<f64>,
    /// The lens that the film's own file gives.
    pub lens: Option<RecordedLens>,
}
