//! The luma of a `sensor_msgs/msg/CompressedImage`: JPEG or PNG.

use super::bayer::Mosaic;
use super::pixels;
use crate::capture::image::GreyImage;
use crate::capture::source::catch_panic::catch_panic;
use crate::capture::source::error::SourceError;
use crate::capture::source::limits::{MAX_SIDE_PX, check_size};
use crate::capture::source::picture::{luma, png_picture};
use crate::capture::source::sniff::is_png;
use std::io::Cursor;
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

type Result<T> = std::result::Result<T, SourceError>;

/// The original encodings that hold depths and other quantities instead of grey levels.
const NO_LIGHT: [&str; 7] = ["8S", "16U", "16S", "32F", "32S", "64F", "depth"];
/// The offset of the colour type in a PNG, and the one of grey levels.
const PNG_COLOUR_TYPE: (usize, u8) = (25, 0);

/// The luma of a compressed image.
///
/// `format` is as `image_transport` writes it, `ENCODING; jpeg compressed bgr8`, or a plain `jpeg` or `png`.
///
/// # Errors
/// A depth image, another coding, a damaged image.
pub(crate) fn picture(format: &str, data: &[u8]) -> Result<GreyImage> {
    let (original, coding) = format.split_once(';').map_or(("", format), |(a, b)| (a.trim(), b.trim()));
    if coding.contains("compressedDepth") {
        let found = format!("compressed depth images (`{}`)", format.escape_debug());
        return Err(SourceError::unsuitable(found, "images of grey levels or colours"));
    }
    if NO_LIGHT.iter().any(|start| original.starts_with(start)) {
        return Err(pixels::unsupported(original));
    }
    let (image, is_grey) = if data.starts_with(b"\xff\xd8\xff") {
        jpeg_picture(data)?
    } else if is_png(data) {
        (png_picture(Cursor::new(data))?, data.get(PNG_COLOUR_TYPE.0) == Some(&PNG_COLOUR_TYPE.1))
    } else {
        let found = format!("compressed images of format `{}`", format.escape_debug());
        return Err(SourceError::unsuitable(found, "JPEG or PNG"));
    };
    // A mosaic that was compressed as it is.
    let name = original.strip_suffix("16").or(original.strip_suffix('8'));
    match name.and_then(Mosaic::of).filter(|_| is_grey) {
        Some(mosaic) => mosaic.luma(&image),
        None => Ok(image),
    }
}

/// The luma of a JPEG and whether it has no colours. That of one coded in luma and chroma is its luma as it is coded, as for films.
fn jpeg_picture(data: &[u8]) -> Result<(GreyImage, bool)> {
    let decoded = catch_panic(|| decoded_jpeg(data));
    decoded.unwrap_or_else(|| Err(SourceError::damaged("a JPEG that the decoder panics on")))
}

fn decoded_jpeg(data: &[u8]) -> Result<(GreyImage, bool)> {
    let undecodable = |e: zune_jpeg::errors::DecodeErrors| {
        SourceError::damaged(format!("a JPEG that cannot be decoded ({e:?})"))
    };
    // Strict: a JPEG that breaks off is an error.
    let options = DecoderOptions::default().set_strict_mode(true);
    let options = options.set_max_width(MAX_SIDE_PX as usize).set_max_height(MAX_SIDE_PX as usize);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(data), options);
    decoder.decode_headers().map_err(undecodable)?;
    let info = decoder.info().ok_or_else(|| SourceError::damaged("a JPEG without a header"))?;
    check_size(u64::from(info.width), u64::from(info.height))?;
    let colours = decoder.input_colorspace();
    let output = match colours {
        Some(ColorSpace::Luma | ColorSpace::YCbCr) => ColorSpace::Luma,
        Some(ColorSpace::RGB) => ColorSpace::RGB,
        other => {
            let found = other.map_or("no".into(), |other| format!("{other:?}"));
            return Err(SourceError::unsuitable(
                format!("a JPEG of {found} colours"),
                "YCbCr, RGB or grey levels",
            ));
        }
    };
    decoder.set_options(options.jpeg_set_out_colorspace(output));
    let samples = decoder.decode().map_err(undecodable)?;
    let pixels =
        if output == ColorSpace::RGB { samples.chunks_exact(3).map(luma).collect() } else { samples };
    let (width, height) = (usize::from(info.width), usize::from(info.height));
    if pixels.len() != width * height {
        return Err(SourceError::damaged(format!(
            "a JPEG with {} of {} pixels",
            pixels.len(),
            width * height
        )));
    }
    Ok((GreyImage { width, height, pixels }, colours == Some(ColorSpace::Luma)))
}
