//! A film that is ready to be read.

use crate::capture::image::Frame;
use crate::error::Result;

/// A film whose header is read and whose frames are ready to come.
pub(crate) struct Opened {
    pub size_px: [usize; 2],
    pub frame_count: Option<usize>,
    pub warnings: Vec<String>,
    pub frames: Box<dyn Iterator<Item = Result<Frame>> + Send>,
    /// The step of the clock (s) of a film that tells its times only frame by frame: they are still to be checked.
    pub tick_s: Option<f64>,
}
