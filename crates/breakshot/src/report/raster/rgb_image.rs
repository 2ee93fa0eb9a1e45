//! Colour images.

/// A colour image, row by row, red, green and blue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RgbImage {
    /// Width (px).
    pub width: usize,
    /// Height (px).
    pub height: usize,
    /// `3 * width * height` levels.
    pub rgb: Vec<u8>,
}

impl RgbImage {
    /// The image as a PNG file; none for an image without pixels.
    pub fn png(&self) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().ok()?;
        writer.write_image_data(&self.rgb).ok()?;
        writer.finish().ok()?;
        Some(bytes)
    }
}
