//! Grey images as PNG, and as `data:` URLs for pages and drawings.

use super::image::GreyImage;
use crate::encoding::base64;

/// How much work a PNG is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PngEffort {
    /// For a picture that is looked at once: a few milliseconds.
    Fast,
    /// For a file that is kept.
    Small,
}

impl GreyImage {
    /// The image as a `data:` URL of a PNG; `None` for an image without pixels.
    pub fn data_url(&self) -> Option<String> {
        Some(format!("data:image/png;base64,{}", base64(&self.png(PngEffort::Small)?)))
    }

    /// The image as a PNG of the same grey levels; `None` for an image without pixels, or one too large for the format.
    pub fn png(&self, effort: PngEffort) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        let (width, height) = (u32::try_from(self.width).ok()?, u32::try_from(self.height).ok()?);
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Eight);
        if effort == PngEffort::Fast {
            encoder.set_compression(png::Compression::Fastest);
        }
        let mut writer = encoder.write_header().ok()?;
        writer.write_image_data(&self.pixels).ok()?;
        writer.finish().ok()?;
        Some(bytes)
    }

    /// The image reduced by an integer factor: every pixel is the mean of `factor` by `factor` pixels.
    #[must_use]
    pub fn shrunk(&self, factor: usize) -> Self {
        let (width, height) = (self.width / factor, self.height / factor);
        let mut pixels = Vec::with_capacity(width * height);
        let mut columns = vec![0_u32; self.width];
        for rows in self.pixels.chunks_exact((factor * self.width).max(1)) {
            columns.fill(0);
            for row in rows.chunks_exact(self.width) {
                columns.iter_mut().zip(row).for_each(|(sum, &p)| *sum += u32::from(p));
            }
            let grey = |sums: &[u32]| (sums.iter().sum::<u32>() / (factor * factor) as u32) as u8;
            pixels.extend(columns.chunks_exact(factor).map(grey));
        }
        Self { width, height, pixels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shrunk_picture_keeps_its_mean_greys() {
        let image = GreyImage { width: 5, height: 2, pixels: vec![0, 10, 100, 100, 9, 20, 30, 100, 104, 9] };
        assert_eq!(image.shrunk(2), GreyImage { width: 2, height: 1, pixels: vec![15, 101] });
    }

    #[test]
    fn a_picture_without_pixels_has_no_url() {
        let image = GreyImage { width: 0, height: 0, pixels: Vec::new() };
        assert_eq!(image.data_url(), None);
        assert_eq!(image.shrunk(2), image);
    }
}
