//! The luma of a `sensor_msgs/msg/Image` (its encodings: `sensor_msgs/image_encodings.hpp` of ROS 2).

use super::bayer::Mosaic;
use crate::capture::image::GreyImage;
use crate::capture::source::bag::messages::RawImage;
use crate::capture::source::error::SourceError;
use crate::capture::source::limits::check_size;
use crate::capture::source::picture::{eight_bits, luma};

type Result<T> = std::result::Result<T, SourceError>;

/// The encodings that are read, for messages.
const NEEDED: &str =
    "mono8, mono16, rgb8, bgr8, rgba8, bgra8, bayer_*8, yuv422 (uyvy), yuv422_yuy2 (yuyv) or nv12";

/// How a pixel is stored.
#[derive(Clone, Copy)]
enum Pixel {
    /// A grey level of 16 bits.
    Deep,
    /// Colours of this many bytes a pixel, red or blue first.
    Colour { bytes: usize, is_blue_first: bool },
    /// A mosaic of colours.
    Bayer(Mosaic),
    /// Luma, every this many bytes, from this byte of a row on.
    Luma { step: usize, first: usize },
}

impl Pixel {
    fn of(encoding: &str) -> Result<Self> {
        Ok(match encoding {
            "mono8" | "nv12" => Self::Luma { step: 1, first: 0 },
            "mono16" => Self::Deep,
            "rgb8" => Self::Colour { bytes: 3, is_blue_first: false },
            "bgr8" => Self::Colour { bytes: 3, is_blue_first: true },
            "rgba8" => Self::Colour { bytes: 4, is_blue_first: false },
            "bgra8" => Self::Colour { bytes: 4, is_blue_first: true },
            "yuv422" | "uyvy" => Self::Luma { step: 2, first: 1 },
            "yuv422_yuy2" | "yuyv" => Self::Luma { step: 2, first: 0 },
            other => match other.strip_suffix('8').and_then(Mosaic::of) {
                Some(mosaic) => Self::Bayer(mosaic),
                None => return Err(unsupported(other)),
            },
        })
    }

    /// Bytes of a pixel.
    fn bytes(self) -> usize {
        match self {
            Self::Deep => 2,
            Self::Colour { bytes, .. } => bytes,
            Self::Bayer(_) => 1,
            Self::Luma { step, .. } => step,
        }
    }
}

/// The error for images of another encoding.
pub(crate) fn unsupported(encoding: &str) -> SourceError {
    SourceError::unsuitable(format!("images of encoding `{}`", encoding.escape_debug()), NEEDED)
}

/// The luma of an image.
///
/// # Errors
/// Another encoding, too few bytes, an impossible size.
pub(crate) fn picture(image: &RawImage) -> Result<GreyImage> {
    let pixel = Pixel::of(image.encoding)?;
    check_size(u64::from(image.width), u64::from(image.height))?;
    let (width, height, step) = (image.width as usize, image.height as usize, image.step as usize);
    let row_bytes = width * pixel.bytes();
    // The last row may end without padding.
    let needed = step.checked_mul(height - 1).and_then(|bytes| bytes.checked_add(row_bytes));
    if step < row_bytes || needed.is_none_or(|needed| image.data.len() < needed) {
        return Err(SourceError::damaged(format!(
            "an image `{}` of {width} x {height} px with {} bytes and {step} bytes a row",
            image.encoding,
            image.data.len()
        )));
    }
    let rows = image.data.chunks(step).take(height).map(|row| &row[..row_bytes]);
    let mut pixels = Vec::with_capacity(width * height);
    match pixel {
        Pixel::Luma { step: 1, .. } | Pixel::Bayer(_) => rows.for_each(|row| pixels.extend_from_slice(row)),
        Pixel::Luma { step, first } => rows.for_each(|row| pixels.extend(row[first..].iter().step_by(step))),
        Pixel::Deep => {
            let level = if image.is_big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
            rows.for_each(|row| {
                pixels.extend(row.as_chunks::<2>().0.iter().map(|bytes| eight_bits(level(*bytes))));
            });
        }
        Pixel::Colour { bytes, is_blue_first } => rows.for_each(|row| {
            let pairs = row.chunks_exact(bytes);
            if is_blue_first {
                pixels.extend(pairs.map(|pixel| luma(&[pixel[2], pixel[1], pixel[0]])));
            } else {
                pixels.extend(pairs.map(luma));
            }
        }),
    }
    let stored = GreyImage { width, height, pixels };
    if let Pixel::Bayer(mosaic) = pixel { mosaic.luma(&stored) } else { Ok(stored) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(encoding: &str, step: u32, is_big_endian: bool, data: &[u8]) -> Result<Vec<u8>> {
        picture(&RawImage { width: 2, height: 2, encoding, is_big_endian, step, data })
            .map(|image| image.pixels)
    }

    #[test]
    fn every_encoding_gives_its_luma_and_rows_may_be_padded() {
        // Green, red; blue, grey: luma by Rec. ITU-R BT.709.
        let wanted = [182, 54, 18, 100];
        let rgb = [0, 255, 0, 255, 0, 0, 9, 9, 0, 0, 255, 100, 100, 100];
        assert_eq!(read("rgb8", 8, false, &rgb).unwrap(), wanted);
        let bgr = [0, 255, 0, 0, 0, 255, 255, 0, 0, 100, 100, 100];
        assert_eq!(read("bgr8", 6, false, &bgr).unwrap(), wanted);
        let rgba = [0, 255, 0, 7, 255, 0, 0, 7, 0, 0, 255, 7, 100, 100, 100, 7];
        assert_eq!(read("rgba8", 8, false, &rgba).unwrap(), wanted);
        let bgra = [0, 255, 0, 7, 0, 0, 255, 7, 255, 0, 0, 7, 100, 100, 100, 7];
        assert_eq!(read("bgra8", 8, false, &bgra).unwrap(), wanted);
        assert_eq!(read("mono8", 3, false, &[1, 2, 0, 3, 4]).unwrap(), [1, 2, 3, 4]);
        assert_eq!(read("nv12", 2, false, &[1, 2, 3, 4, 128, 128]).unwrap(), [1, 2, 3, 4]);
        let deep = [0x80, 0x00, 0xff, 0xff, 0, 0, 1, 2];
        assert_eq!(read("mono16", 4, true, &deep).unwrap(), [128, 255, 0, 1]);
        assert_eq!(read("mono16", 4, false, &deep).unwrap(), [0, 255, 0, 2]);
        for (encoding, data) in [("yuv422", [9, 1, 9, 2, 9, 3, 9, 4]), ("yuyv", [1, 9, 2, 9, 3, 9, 4, 9])] {
            assert_eq!(read(encoding, 4, false, &data).unwrap(), [1, 2, 3, 4], "{encoding}");
        }
    }

    #[test]
    fn an_image_with_too_few_bytes_or_of_another_encoding_is_refused() {
        let error = |encoding, step, data: &[u8]| read(encoding, step, false, data).unwrap_err().found;
        assert!(error("mono8", 2, &[1, 2, 3]).contains("2 x 2 px with 3 bytes"));
        assert!(error("rgb8", 4, &[0; 99]).contains("4 bytes a row"));
        assert!(error("mono8", u32::MAX, &[0; 9]).contains("bytes a row"));
        for encoding in ["16UC1", "32FC1", "8UC3", "bayer_rggb16", "bayer_xxxx8", ""] {
            assert!(error(encoding, 99, &[0; 999]).contains(&format!("`{encoding}`")), "{encoding}");
        }
    }
}
