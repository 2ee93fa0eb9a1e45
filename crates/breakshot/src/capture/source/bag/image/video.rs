//! The luma of the messages of a foxglove `CompressedVideo`: H.264 with start codes, one picture a message.

use crate::capture::image::GreyImage;
use crate::capture::source::error::SourceError;
use crate::capture::source::h264::config::{Framing, H264Config};
use crate::capture::source::h264::decoder::{DisplayOrder, H264Decoder};

type Result<T> = std::result::Result<T, SourceError>;

/// The NAL unit type of a sequence parameter set.
const SEQUENCE: u8 = 7;

/// The decoder of a topic, from its first key frame on.
#[derive(Default)]
pub(crate) struct Video {
    decoder: Option<H264Decoder>,
    last: Option<DisplayOrder>,
}

impl Video {
    /// The picture of the next message.
    ///
    /// # Errors
    /// Another format than `h264`, pictures that are displayed in another order than they are coded in, damaged bytes.
    pub(crate) fn picture(&mut self, format: &str, data: &[u8]) -> Result<GreyImage> {
        check_format(format)?;
        let decoder = match &mut self.decoder {
            Some(decoder) => decoder,
            none => {
                let config = H264Config { framing: Framing::StartCodes, parameter_sets: Vec::new() };
                let decoder = H264Decoder::new(&config, data).map_err(without_conversion)?;
                if !decoder.starts_with_idr {
                    return Err(SourceError::damaged("a video that does not begin with a key frame"));
                }
                none.insert(decoder)
            }
        };
        let picture = decoder.picture(data).map_err(without_conversion)?;
        if self.last.is_some_and(|last| picture.order <= last) {
            let found =
                "H.264 whose pictures are displayed in another order than they are coded in (B frames)";
            return Err(SourceError::unsuitable(found, "video without B frames, as foxglove defines it"));
        }
        self.last = Some(picture.order);
        Ok(picture.image)
    }
}

/// The command that converts films does not read bags.
fn without_conversion(error: SourceError) -> SourceError {
    if error.convertible {
        return SourceError::unsuitable(error.found, "H.264, 8 bit, 4:2:0, progressive, of one size");
    }
    error
}

/// An error unless this is the format of H.264.
pub(crate) fn check_format(format: &str) -> Result<()> {
    if format.eq_ignore_ascii_case("h264") {
        return Ok(());
    }
    Err(SourceError::unsuitable(format!("compressed video of format `{}`", format.escape_debug()), "`h264`"))
}

/// Whether decoding can start with this message: it holds a sequence parameter set, as key frames do.
pub(crate) fn is_start(data: &[u8]) -> bool {
    data.windows(4).any(|bytes| bytes[..3] == [0, 0, 1] && bytes[3] & 0x1f == SEQUENCE)
}
