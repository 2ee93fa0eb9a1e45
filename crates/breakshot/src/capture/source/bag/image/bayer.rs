//! The luma of a mosaic of colours (Bayer, 1976).

use crate::capture::image::GreyImage;
use crate::capture::source::error::SourceError;

/// The names of the encodings: the colours of the first two rows.
const PATTERNS: [&str; 4] = ["bayer_rggb", "bayer_grbg", "bayer_gbrg", "bayer_bggr"];

/// Whether an encoding is a mosaic of colours of eight bits.
pub(super) fn is_mosaic(encoding: &str) -> bool {
    PATTERNS.contains(&encoding)
}

/// The luma, a quarter of red and of blue and half of green: every pixel with its eight neighbours, weighted by the binomial coefficients
/// 1, 2, 1 in both directions; the image is mirrored at its border.
///
/// These weights give the same sum to each colour around every pixel of any of the patterns. The filter is therefore the same at all
/// pixels, and edges stay where they are; an interpolation of the colours, whose filter depends on the colour of the pixel, displaces them by
/// some hundredths of a pixel, depending on where they lie between the pixels.
///
/// # Errors
/// An image of fewer than two rows or columns.
pub(super) fn luma(mosaic: &GreyImage) -> Result<GreyImage, SourceError> {
    let (width, height) = (mosaic.width, mosaic.height);
    if width < 2 || height < 2 {
        let found = format!("a mosaic of colours of {width} x {height} px");
        return Err(SourceError::unsuitable(found, "at least 2 px a side"));
    }
    let mut pixels = Vec::with_capacity(width * height);
    let mut columns = vec![0_u16; width];
    for y in 0..height {
        let [upper, middle, lower] =
            mirrored(y, height).map(|row| &mosaic.pixels[row * width..(row + 1) * width]);
        for (column, ((a, b), c)) in columns.iter_mut().zip(upper.iter().zip(middle).zip(lower)) {
            *column = u16::from(*a) + 2 * u16::from(*b) + u16::from(*c);
        }
        pixels.extend((0..width).map(|x| {
            let [left, x, right] = mirrored(x, width);
            ((columns[left] + 2 * columns[x] + columns[right] + 8) >> 4) as u8
        }));
    }
    Ok(GreyImage { width, height, pixels })
}

/// The rows or columns before, at and behind number `at` of `size`.
fn mirrored(at: usize, size: usize) -> [usize; 3] {
    [at.abs_diff(1), at, if at + 1 < size { at + 1 } else { size - 2 }]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_colour_gives_its_luma_in_every_pattern() {
        let (width, height, colour) = (6, 5, [200, 90, 30]);
        for colours in [[[0, 1], [1, 2]], [[1, 0], [2, 1]], [[1, 2], [0, 1]], [[2, 1], [1, 0]]] {
            let level = |at: usize| colour[colours[at / width % 2][at % width % 2]];
            let mosaic = GreyImage { width, height, pixels: (0..width * height).map(level).collect() };
            // (200 + 2 x 90 + 30) / 4, rounded up.
            assert_eq!(luma(&mosaic).unwrap().pixels, vec![103; width * height], "{colours:?}");
        }
        assert_eq!((mirrored(0, 3), mirrored(3, 4), mirrored(1, 2)), ([1, 0, 1], [2, 3, 2], [0, 1, 0]));
        assert!(is_mosaic("bayer_rggb") && !is_mosaic("bayer_abcd") && !is_mosaic("mono8"));
        assert!(luma(&GreyImage { width: 9, height: 1, pixels: vec![0; 9] }).is_err());
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
        let image = luma(&mosaic).unwrap();
        let rows = image.pixels.chunks(width).zip(mosaic.pixels.chunks(width));
        // The rows at the border see mirrored ones, and the edge is bent there.
        for (row, wanted) in rows.skip(1).take(height - 2) {
            let position = |row: &[u8]| row.iter().map(|&level| f64::from(level) - 40.0).sum::<f64>() / 160.0;
            let shift_px = position(row) - position(wanted);
            assert!(shift_px.abs() < 0.03, "the edge moved by {shift_px:.3} px");
        }
    }
}
