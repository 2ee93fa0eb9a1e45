//! Grey images, and frames of a film.

use crate::geometry::Pixel;

/// A grey image, row by row from the top left; 0 is black.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GreyImage {
    /// Width (px).
    pub width: usize,
    /// Height (px).
    pub height: usize,
    /// `width * height` grey levels.
    pub pixels: Vec<u8>,
}

/// One image of a film and its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Presentation time (s); the clip's first frame is at 0.
    pub time_s: f64,
    /// The luma plane.
    pub image: GreyImage,
}

impl GreyImage {
    /// The grey level of a pixel; `None` outside the image.
    pub fn grey(&self, x: i64, y: i64) -> Option<f64> {
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        (x < self.width && y < self.height).then(|| f64::from(self.pixels[y * self.width + x]))
    }

    /// The grey level between pixels (bilinear interpolation); `None` outside the image.
    pub fn grey_at(&self, pixel: Pixel) -> Option<f64> {
        let (left, top) = (pixel.x.floor(), pixel.y.floor());
        let (u, v) = (pixel.x - left, pixel.y - top);
        let (x, y) = (left as i64, top as i64);
        let at = |dx: i64, dy: i64| self.grey(x + dx, y + dy);
        // The last column and row have no next one.
        let next = |fraction: f64| i64::from(fraction > 0.0);
        let (dx, dy) = (next(u), next(v));
        let upper = at(0, 0)? * (1.0 - u) + at(dx, 0)? * u;
        let lower = at(0, dy)? * (1.0 - u) + at(dx, dy)? * u;
        Some(upper * (1.0 - v) + lower * v)
    }

    /// The image at half its size, each pixel the mean of four; an odd last row or column is dropped.
    pub(crate) fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mut pixels = Vec::with_capacity(width * height);
        for rows in self.pixels.chunks_exact(2 * self.width).take(height) {
            let (upper, lower) = rows.split_at(self.width);
            let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2));
            pixels.extend(pairs.map(|(a, b)| {
                let sum = u16::from(a[0]) + u16::from(a[1]) + u16::from(b[0]) + u16::from(b[1]);
                ((sum + 2) / 4) as u8
            }));
        }
        Self { width, height, pixels }
    }

    /// The image with left and right exchanged.
    pub(crate) fn mirrored(&self) -> Self {
        let rows = self.pixels.chunks_exact(self.width.max(1));
        Self { pixels: rows.flat_map(|row| row.iter().rev().copied()).collect(), ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_levels_between_pixels_are_interpolated() {
        let image = GreyImage { width: 2, height: 2, pixels: vec![0, 100, 100, 200] };
        assert_eq!(image.grey_at(Pixel::new(0.5, 0.25)), Some(75.0));
        assert_eq!(image.grey_at(Pixel::new(1.0, 1.0)), Some(200.0));
        assert_eq!(image.grey_at(Pixel::new(1.1, 0.0)), None);
        assert_eq!(image.halved().pixels, [100]);
    }
}
