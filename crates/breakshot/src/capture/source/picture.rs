//! The luma of still pictures, and of their colours.

use super::error::SourceError;
use super::limits::check_size;
use crate::capture::image::GreyImage;
use png::{BitDepth, ColorType, Decoder, Limits, Transformations};
use std::io::{BufRead, Seek};

type Result<T> = std::result::Result<T, SourceError>;

/// Memory limit of the PNG decoder (bytes): twice the largest image.
const MAX_PNG_BYTES: usize = 512 << 20;

/// A decoder of a PNG of an accepted size.
pub(super) fn png_decoder<R: BufRead + Seek>(bytes: R) -> Result<Decoder<R>> {
    let mut decoder = Decoder::new_with_limits(bytes, Limits { bytes: MAX_PNG_BYTES });
    decoder.set_transformations(Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    let [width, height] = png_size_px(&mut decoder)?;
    check_size(width as u64, height as u64)?;
    Ok(decoder)
}

/// Width and height of a PNG (px).
pub(super) fn png_size_px<R: BufRead + Seek>(decoder: &mut Decoder<R>) -> Result<[usize; 2]> {
    let info = decoder.read_header_info().map_err(undecodable)?;
    Ok([info.width as usize, info.height as usize])
}

/// The luma of a PNG.
pub(super) fn png_picture<R: BufRead + Seek>(bytes: R) -> Result<GreyImage> {
    let Samples { width, height, colour, values } = png_samples(bytes)?;
    let pixels = match colour {
        ColorType::Grayscale | ColorType::Indexed => values,
        ColorType::GrayscaleAlpha => values.chunks_exact(2).map(|pixel| pixel[0]).collect(),
        ColorType::Rgb => values.chunks_exact(3).map(luma).collect(),
        ColorType::Rgba => values.chunks_exact(4).map(luma).collect(),
    };
    Ok(GreyImage { width, height, pixels })
}

/// Red, green and blue of a PNG; none of one without colours.
pub(super) fn png_colours<R: BufRead + Seek>(bytes: R) -> Result<Vec<GreyImage>> {
    let Samples { width, height, colour, values } = png_samples(bytes)?;
    let step = match colour {
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
        _ => return Ok(Vec::new()),
    };
    let plane = |k: usize| values.iter().skip(k).step_by(step).copied().collect();
    Ok((0..3).map(|k| GreyImage { width, height, pixels: plane(k) }).collect())
}

/// The values of a PNG in eight bits, pixel by pixel.
struct Samples {
    width: usize,
    height: usize,
    colour: ColorType,
    values: Vec<u8>,
}

fn png_samples<R: BufRead + Seek>(bytes: R) -> Result<Samples> {
    let mut reader = png_decoder(bytes)?.read_info().map_err(undecodable)?;
    let size = reader.output_buffer_size().ok_or_else(|| SourceError::damaged("a PNG without an end"))?;
    let mut values = vec![0; size];
    let info = reader.next_frame(&mut values).map_err(undecodable)?;
    if info.bit_depth == BitDepth::Sixteen {
        values =
            values.chunks_exact(2).map(|pair| eight_bits(u16::from_be_bytes([pair[0], pair[1]]))).collect();
    }
    Ok(Samples { width: info.width as usize, height: info.height as usize, colour: info.color_type, values })
}

fn undecodable(error: png::DecodingError) -> SourceError {
    SourceError::damaged(format!("a PNG that cannot be decoded ({error})"))
}

/// The nearest 8-bit level.
pub(super) fn eight_bits(level: u16) -> u8 {
    ((u32::from(level) * 255 + 32_767) / 65_535) as u8
}

/// Luma of red, green and blue (Rec. ITU-R BT.709), rounded.
pub(super) fn luma(pixel: &[u8]) -> u8 {
    let weigh = |weight: u32, level: u8| weight * u32::from(level);
    ((weigh(2126, pixel[0]) + weigh(7152, pixel[1]) + weigh(722, pixel[2]) + 5000) / 10_000) as u8
}
