//! The luma of a mosaic of colours (Bayer, 1976).
//!
//! A mosaic is the luma, a quarter of red and of blue and half of green, plus carriers of colour of the highest spatial frequencies (Alleysson, Süsstrunk
//! and Hérault, 2005): along rows, along columns and along both. Where colours change slowly, narrow filters along one direction find all of these
//! carriers. An edge has such frequencies as well, but only across itself: the carriers are taken from the direction along the edge (Dubois, 2005), weighted
//! with the squares of the differences across it. What is left is the luma with all its detail.
//!
//! The filters are symmetric and differ between green pixels and others alone, so that edges are not displaced: an interpolation of the
//! colours displaces them by some hundredths of a pixel, depending on where they lie between the pixels.

use crate::capture::image::GreyImage;
use crate::capture::source::error::SourceError;

/// The names of the encodings: the colours of the first two rows.
const PATTERNS: [&str; 4] = ["bayer_rggb", "bayer_grbg", "bayer_gbrg", "bayer_bggr"];
/// The filters reach over so many pixels on each side.
const REACH: usize = 2;
/// Added to the sums of squared differences (grey levels squared): where nothing changes, both directions count alike.
const LEAST_DIFFERENCE: i32 = 1;

/// Where the green pixels of a mosaic are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mosaic {
    /// At the first pixel of the first row.
    GreenFirst,
    /// At the second one.
    GreenSecond,
}

impl Mosaic {
    /// The mosaic of an encoding without its number of bits; `None` for any other encoding.
    pub(super) fn of(encoding: &str) -> Option<Self> {
        let is_first = encoding.starts_with("bayer_g");
        PATTERNS.contains(&encoding).then_some(if is_first { Self::GreenFirst } else { Self::GreenSecond })
    }

    /// The luma of an image; the image is mirrored at its border.
    ///
    /// # Errors
    /// An image of fewer than two rows or columns.
    pub(super) fn luma(self, image: &GreyImage) -> Result<GreyImage, SourceError> {
        let (width, height) = (image.width, image.height);
        if width < 2 || height < 2 {
            let found = format!("a mosaic of colours of {width} x {height} px");
            return Err(SourceError::unsuitable(found, "at least 2 px a side"));
        }
        let columns: Vec<usize> = (0..width + 2 * REACH).map(|x| mirrored(x, width)).collect();
        let row = |y: usize| -> Vec<i32> {
            let row = &image.pixels[mirrored(y, height) * width..][..width];
            columns.iter().map(|&x| i32::from(row[x])).collect()
        };
        let mut rows: [Vec<i32>; 2 * REACH + 1] = std::array::from_fn(row);
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            let is_green_first = (self == Self::GreenFirst) == y.is_multiple_of(2);
            Rows(rows.each_ref().map(Vec::as_slice)).luma(is_green_first, &mut pixels);
            rows.rotate_left(1);
            rows[2 * REACH] = row(y + 2 * REACH + 1);
        }
        Ok(GreyImage { width, height, pixels })
    }
}

/// The row or column of an image of `size` with this number in one that is larger by [`REACH`] on each side: mirrored, with the same colours.
fn mirrored(at: usize, size: usize) -> usize {
    let period = 2 * (size - 1);
    let at = (at + REACH * (period - 1)) % period;
    at.min(period - at)
}

/// A row between the two before it and the two behind it, each with [`REACH`] mirrored pixels on both sides.
struct Rows<'a>([&'a [i32]; 2 * REACH + 1]);

impl Rows<'_> {
    /// Appends the luma of the middle row.
    fn luma(&self, is_green_first: bool, pixels: &mut Vec<u8>) {
        let Self([a, b, middle, d, e]) = *self;
        let size = middle.len();
        let fourth: Vec<i32> = (0..size).map(|x| fourth([a[x], b[x], middle[x], d[x], e[x]])).collect();
        let squares_down: Vec<i32> = (0..size)
            .map(|x| square(middle[x] - a[x]) + square(d[x] - b[x]) + square(e[x] - middle[x]))
            .collect();
        let squares_along: Vec<i32> =
            (2..size).map(|x| [b, middle, d].iter().map(|row| square(row[x] - row[x - 2])).sum()).collect();
        pixels.extend((REACH..size - REACH).map(|x| {
            let is_green = (x % 2 == 0) == is_green_first;
            let three = |values: &[i32], from: usize| values[from] + values[from + 1] + values[from + 2];
            // A change down the columns is an edge along the row, whose carriers are taken from the row.
            let along = three(&squares_down, x - 1) + LEAST_DIFFERENCE;
            let down = three(&squares_along, x - 2) + LEAST_DIFFERENCE;
            let from_rows = |row: &[i32]| fourth5(&row[x - REACH..]);
            let carrier_along = carriers([from_rows(b), from_rows(middle), from_rows(d)], is_green) as f32;
            let carrier_down = carriers([fourth[x - 1], fourth[x], fourth[x + 1]], is_green) as f32;
            let weight = along as f32 / (along + down) as f32;
            let carrier = carrier_down + weight * (carrier_along - carrier_down);
            (middle[x] as f32 - carrier / CARRIER_UNIT + 0.5) as u8
        }));
    }
}

/// By this factor [`carriers`] are larger than grey levels.
const CARRIER_UNIT: f32 = 64.0;

/// The carriers of colour at a pixel from the fourth differences in one direction, beside each other in the other: at green pixels the carriers of rows
/// and of columns cancel, at others they are equal.
fn carriers([before, here, behind]: [i32; 3], is_green: bool) -> i32 {
    if is_green { 2 * here - before - behind } else { before + 6 * here + behind }
}

/// Binomial coefficients of alternating signs: the highest frequency alone.
fn fourth([a, b, c, d, e]: [i32; 5]) -> i32 {
    a - 4 * b + 6 * c - 4 * d + e
}

fn fourth5(values: &[i32]) -> i32 {
    fourth([values[0], values[1], values[2], values[3], values[4]])
}

fn square(value: i32) -> i32 {
    value * value
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For each pattern the colours (red, green, blue) of its first two rows.
    const COLOURS: [[[usize; 2]; 2]; 4] =
        [[[0, 1], [1, 2]], [[1, 0], [2, 1]], [[1, 2], [0, 1]], [[2, 1], [1, 0]]];
    const SIDE: usize = 48;

    /// The luma of a picture seen through each of the patterns, beside that of its colours.
    fn seen(colour: impl Fn(usize, usize) -> [f64; 3]) -> [(Vec<f64>, Vec<f64>); 4] {
        let places: Vec<[usize; 2]> = (0..SIDE * SIDE).map(|k| [k % SIDE, k / SIDE]).collect();
        std::array::from_fn(|pattern| {
            let level = |&[x, y]: &[usize; 2]| {
                colour(x, y)[COLOURS[pattern][y % 2][x % 2]].round().clamp(0.0, 255.0) as u8
            };
            let image = GreyImage { width: SIDE, height: SIDE, pixels: places.iter().map(level).collect() };
            let luma = Mosaic::of(PATTERNS[pattern]).unwrap().luma(&image).unwrap();
            let wanted = places.iter().map(|&[x, y]| {
                let [red, green, blue] = colour(x, y);
                0.25 * red + 0.5 * green + 0.25 * blue
            });
            (luma.pixels.into_iter().map(f64::from).collect(), wanted.collect())
        })
    }

    /// A disc as a lens draws it whose blur has a standard deviation of about 0.7 px; the share of it in a pixel.
    fn disc([x0, y0, radius]: [f64; 3]) -> impl Fn(usize, usize) -> f64 {
        move |x, y| 0.5 + 0.5 * ((radius - (x as f64 - x0).hypot(y as f64 - y0)) / 0.9).tanh()
    }

    fn mixed(inside: [f64; 3], outside: [f64; 3], share: f64) -> [f64; 3] {
        std::array::from_fn(|k| outside[k] + share * (inside[k] - outside[k]))
    }

    /// The centre of gravity of what differs from a level (px).
    fn centre(image: &[f64], level: f64) -> [f64; 2] {
        let sum = |weight: &dyn Fn(usize) -> f64| {
            (0..image.len()).map(|k| weight(k) * (image[k] - level)).sum::<f64>()
        };
        let total = sum(&|_| 1.0);
        [sum(&|k| (k % SIDE) as f64) / total, sum(&|k| (k / SIDE) as f64) / total]
    }

    #[test]
    fn a_uniform_colour_gives_its_luma_in_every_pattern() {
        for (found, wanted) in seen(|_, _| [200.0, 90.0, 30.0]) {
            // (200 + 2 x 90 + 30) / 4, rounded up.
            assert_eq!(wanted[0], 102.5);
            assert!(found.iter().all(|&level| level == 103.0), "{found:?}");
        }
        let numbers = |size: usize| (0..size + 4).map(|at| mirrored(at, size)).collect::<Vec<_>>();
        assert_eq!((numbers(2), numbers(4)), (vec![0, 1, 0, 1, 0, 1], vec![2, 1, 0, 1, 2, 3, 2, 1]));
        assert!(Mosaic::of("bayer_abcd").is_none() && Mosaic::of("mono8").is_none());
        let row = GreyImage { width: 9, height: 1, pixels: vec![0; 9] };
        assert!(Mosaic::GreenFirst.luma(&row).is_err());
    }

    #[test]
    fn a_grey_disc_keeps_its_levels_and_its_place_in_every_pattern() {
        // A filter of three by three pixels, 1 2 1 in both directions, is off by 8 levels (rms) at the edges of these discs.
        const EDGE_RMS: f64 = 2.0;
        for shift in 0..9 {
            let place = [22.6 + 0.13 * f64::from(shift), 24.1 - 0.09 * f64::from(shift), 13.2];
            let share = disc(place);
            for (found, wanted) in seen(|x, y| mixed([40.0; 3], [190.0; 3], share(x, y))) {
                let edge = |k: &usize| (1.0..149.0).contains(&(wanted[*k] - 40.0));
                let squares: Vec<f64> =
                    (0..wanted.len()).filter(edge).map(|k| (found[k] - wanted[k]).powi(2)).collect();
                let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
                assert!(rms < EDGE_RMS, "{rms} levels at {place:?}");
                let [[x, y], [u, v]] = [centre(&found, 190.0), centre(&wanted, 190.0)];
                let off_px = (x - u).hypot(y - v);
                assert!(off_px < 0.004, "{off_px} px at {place:?}");
            }
        }
    }

    #[test]
    fn a_coloured_disc_stays_where_it_is_in_every_pattern() {
        for (inside, outside) in [
            ([60.0, 40.0, 30.0], [150.0, 170.0, 200.0]),
            ([210.0, 60.0, 40.0], [120.0, 125.0, 130.0]),
            ([20.0, 30.0, 160.0], [220.0, 200.0, 140.0]),
        ] {
            for shift in 0..9 {
                let share = disc([22.6 + 0.13 * f64::from(shift), 24.1 - 0.09 * f64::from(shift), 13.2]);
                for (found, wanted) in seen(|x, y| mixed(inside, outside, share(x, y))) {
                    let [level, other] = [wanted[0], found[0]];
                    let [[x, y], [u, v]] = [centre(&found, other), centre(&wanted, level)];
                    let off_px = (x - u).hypot(y - v);
                    assert!(off_px < 0.05, "{off_px} px, {inside:?} on {outside:?}");
                }
            }
        }
    }
}
