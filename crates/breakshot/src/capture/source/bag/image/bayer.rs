//! The luma of a mosaic of colours (Bayer, 1976).

use crate::capture::image::GreyImage;
use crate::capture::source::error::SourceError;
use crate::capture::source::picture::luma;

/// Whether red is in the odd columns and in the odd rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pattern {
    is_red_right: bool,
    is_red_below: bool,
}

impl Pattern {
    /// The pattern in the name of an encoding, as `bayer_rggb`: the colours of the first two rows.
    pub(super) fn of(encoding: &str) -> Option<Self> {
        let [is_red_right, is_red_below] = match encoding.strip_prefix("bayer_")? {
            "rggb" => [false, false],
            "grbg" => [true, false],
            "gbrg" => [false, true],
            "bggr" => [true, true],
            _ => return None,
        };
        Some(Self { is_red_right, is_red_below })
    }

    /// The luma: the two colours that a pixel lacks are interpolated linearly from 5 x 5 pixels (Malvar, He and Cutler, 2004), which
    /// keeps edges sharp where colours are alike; the image is mirrored at its border.
    ///
    /// # Errors
    /// An image of fewer than three rows or columns.
    pub(super) fn luma(self, mosaic: &GreyImage) -> Result<GreyImage, SourceError> {
        let (width, height) = (mosaic.width, mosaic.height);
        if width < 3 || height < 3 {
            let found = format!("a mosaic of colours of {width} x {height} px");
            return Err(SourceError::unsuitable(found, "at least 3 px a side"));
        }
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            let rows = mirrored(y, height).map(|row| &mosaic.pixels[row * width..(row + 1) * width]);
            let is_red_row = (y % 2 == 1) == self.is_red_below;
            // Red columns of red rows, blue columns of blue rows.
            let coloured = usize::from(self.is_red_right == is_red_row);
            for x in 0..width {
                let around = Neighbours::of(rows, mirrored(x, width));
                // Green, the colour of this row, the other one.
                let [green, own, other] =
                    if x % 2 == coloured { around.at_colour() } else { around.at_green() };
                let (red, blue) = if is_red_row { (own, other) } else { (other, own) };
                pixels.push(luma(&[red, green, blue]));
            }
        }
        Ok(GreyImage { width, height, pixels })
    }
}

/// The rows or columns from two before to two behind number `at` of `size`.
fn mirrored(at: usize, size: usize) -> [usize; 5] {
    let before = |k: usize| at.abs_diff(k);
    let behind = |k: usize| if at + k < size { at + k } else { 2 * (size - 1) - at - k };
    [before(2), before(1), at, behind(1), behind(2)]
}

/// The level of a pixel, and sums of levels around it.
struct Neighbours {
    center: i32,
    /// Left and right, at one and two pixels.
    beside: [i32; 2],
    /// Above and below, at one and two pixels.
    stacked: [i32; 2],
    diagonal: i32,
}

impl Neighbours {
    fn of(
        [top, upper, middle, lower, bottom]: [&[u8]; 5],
        [first, left, x, right, last]: [usize; 5],
    ) -> Self {
        let sum = |a: u8, b: u8| i32::from(a) + i32::from(b);
        Self {
            center: middle[x].into(),
            beside: [sum(middle[left], middle[right]), sum(middle[first], middle[last])],
            stacked: [sum(upper[x], lower[x]), sum(top[x], bottom[x])],
            diagonal: sum(upper[left], upper[right]) + sum(lower[left], lower[right]),
        }
    }

    /// Green, red and blue at red, or green, blue and red at blue.
    fn at_colour(&self) -> [u8; 3] {
        let far = self.beside[1] + self.stacked[1];
        let green = 8 * self.center + 4 * (self.beside[0] + self.stacked[0]) - 2 * far;
        let other = 12 * self.center + 4 * self.diagonal - 3 * far;
        [level(green), self.center as u8, level(other)]
    }

    /// Green, the colour of the pixels beside it and that of the pixels above it, at green.
    fn at_green(&self) -> [u8; 3] {
        let colour = |near: [i32; 2], across: [i32; 2]| {
            level(10 * self.center + 8 * near[0] - 2 * (near[1] + self.diagonal) + across[1])
        };
        [self.center as u8, colour(self.beside, self.stacked), colour(self.stacked, self.beside)]
    }
}

/// A sixteenth, rounded, in the range of levels.
fn level(sum: i32) -> u8 {
    ((sum + 8) >> 4).clamp(0, 255) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_colour_gives_its_luma_in_every_pattern() {
        let (width, height, colour) = (6, 5, [200, 90, 30]);
        for (name, colours) in [
            ("bayer_rggb", [[0, 1], [1, 2]]),
            ("bayer_grbg", [[1, 0], [2, 1]]),
            ("bayer_gbrg", [[1, 2], [0, 1]]),
            ("bayer_bggr", [[2, 1], [1, 0]]),
        ] {
            let level = |at: usize| colour[colours[at / width % 2][at % width % 2]];
            let mosaic = GreyImage { width, height, pixels: (0..width * height).map(level).collect() };
            let image = Pattern::of(name).unwrap().luma(&mosaic).unwrap();
            assert_eq!(image.pixels, vec![luma(&colour); width * height], "{name}");
        }
        assert_eq!(mirrored(0, 3), [2, 1, 0, 1, 2]);
        assert_eq!(mirrored(3, 4), [1, 2, 3, 2, 1]);
        assert_eq!(Pattern::of("bayer_abcd"), None);
        let row = GreyImage { width: 9, height: 2, pixels: vec![0; 18] };
        assert!(Pattern::of("bayer_rggb").unwrap().luma(&row).is_err());
    }

    #[test]
    fn an_edge_of_grey_levels_stays_where_it_is() {
        let (width, height) = (24, 24);
        let grey = |at: usize| {
            // A step of 160 levels that is one pixel wide, at an angle.
            let distance = (at % width) as f64 - 11.3 + 0.37 * ((at / width) as f64 - 12.0);
            (40.0 + 160.0 * (0.5 + distance / 2.0).clamp(0.0, 1.0)).round() as u8
        };
        let mosaic = GreyImage { width, height, pixels: (0..width * height).map(grey).collect() };
        let image = Pattern::of("bayer_grbg").unwrap().luma(&mosaic).unwrap();
        for (row, wanted) in image.pixels.chunks(width).zip(mosaic.pixels.chunks(width)) {
            let position = |row: &[u8]| row.iter().map(|&level| f64::from(level) - 40.0).sum::<f64>() / 160.0;
            let shift_px = position(row) - position(wanted);
            assert!(shift_px.abs() < 0.08, "the edge moved by {shift_px:.3} px");
        }
    }
}
