//! How does the colour of the objects differ from that of the table?
//!
//! A shadow, and the grain of wood, change how bright a surface is and hardly its colour. In a linear combination of two colours that is zero for the
//! table's own colour, all shadows on the table vanish, and grain is weaker by as much as its surface is like the table. Being linear, it leaves
//! edges where they are, unlike a ratio of colours.

use crate::capture::{Camera, GreyImage};
use crate::cell::Cell;
use crate::geometry::Pixel;

/// The level of the table in the planes of contrast.
pub(super) const TABLE_LEVEL: f64 = 128.0;
/// A colour of the table counts as at least this fraction of its mean level: the weaker one is, the more its noise is amplified.
const LEAST_FRACTION: f64 = 0.5;
/// Every so many rows and columns a pixel is read for the colour of the table.
const STRIDE_PX: usize = 4;

/// Red beside green and blue beside green, each scaled to the table's levels; none without three colours.
pub(super) fn contrasts(colours: &[GreyImage], camera: &Camera, cell: &Cell) -> Vec<GreyImage> {
    let [red, green, blue] = colours else { return Vec::new() };
    let is_on_table = |x: usize, y: usize| {
        cell.workspace.contains(camera.table_from_pixel(Pixel::new(x as f64, y as f64), 0.0))
    };
    let grid = (0..green.height)
        .step_by(STRIDE_PX)
        .flat_map(|y| (0..green.width).step_by(STRIDE_PX).map(move |x| (x, y)));
    let table: Vec<usize> =
        grid.filter(|&(x, y)| is_on_table(x, y)).map(|(x, y)| y * green.width + x).collect();
    let levels = [red, green, blue].map(|plane| median_level(plane, &table));
    let mean = levels.iter().sum::<f64>() / 3.0;
    let [by_red, by_green, by_blue] = levels.map(|level| mean / level.max(LEAST_FRACTION * mean).max(1.0));
    [(red, by_red), (blue, by_blue)].map(|(plane, by)| difference((plane, by), (green, by_green))).to_vec()
}

/// The median of the levels at some pixels; 0 without any.
fn median_level(plane: &GreyImage, pixels: &[usize]) -> f64 {
    let mut levels: Vec<u8> = pixels.iter().map(|&at| plane.pixels[at]).collect();
    let middle = levels.len() / 2;
    if levels.is_empty() { 0.0 } else { f64::from(*levels.select_nth_unstable(middle).1) }
}

/// The difference of two planes that are scaled, above the level of the table.
fn difference((a, by_a): (&GreyImage, f64), (b, by_b): (&GreyImage, f64)) -> GreyImage {
    let level = |(&a, &b): (&u8, &u8)| {
        (TABLE_LEVEL + by_a * f64::from(a) - by_b * f64::from(b)).round().clamp(0.0, 255.0) as u8
    };
    GreyImage { pixels: a.pixels.iter().zip(&b.pixels).map(level).collect(), ..*a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::Lens;
    use crate::cell::{Striker, Transform, Workspace};

    const SIDE: usize = 64;
    const TABLE: [f64; 3] = [150.0, 120.0, 70.0];

    fn seen_from_above() -> (Camera, Cell) {
        let at = Transform { position_m: [0.0, 0.0, 1.0], rpy_rad: [0.0; 3] };
        let camera = Camera::new([SIDE; 2], Lens::pinhole([SIDE; 2], 100.0), at);
        (camera, Cell::from_above(100.0, Workspace::centred([0.5, 0.5]), Striker::none()))
    }

    /// The planes of contrast of a table of one colour with a patch of another.
    fn of_patch(patch: [f64; 3]) -> Vec<GreyImage> {
        let colour = |k: usize, channel: usize| {
            let is_patch = (20..30).contains(&(k % SIDE)) && (20..30).contains(&(k / SIDE));
            (if is_patch { patch } else { TABLE })[channel].round() as u8
        };
        let plane = |channel: usize| GreyImage {
            width: SIDE,
            height: SIDE,
            pixels: (0..SIDE * SIDE).map(|k| colour(k, channel)).collect(),
        };
        let (camera, cell) = seen_from_above();
        contrasts(&[0, 1, 2].map(plane), &camera, &cell)
    }

    fn levels_of_patch(patch: [f64; 3]) -> Vec<f64> {
        of_patch(patch).iter().map(|plane| f64::from(plane.pixels[25 * SIDE + 25])).collect()
    }

    #[test]
    fn a_table_and_its_shadows_have_one_level_and_another_colour_has_another() {
        for brightness in [1.0, 0.7, 0.4] {
            let shadow = TABLE.map(|level| brightness * level);
            let levels = levels_of_patch(shadow);
            let off = levels.iter().map(|level| (level - TABLE_LEVEL).abs()).fold(0.0, f64::max);
            // Levels are whole numbers.
            assert!(levels.len() == 2 && off <= 1.5, "{levels:?}, {brightness} as bright");
        }
        // Wood that is as bright as the table
        let levels = levels_of_patch([160.0, 113.0, 80.0]);
        assert!(levels.iter().all(|level| level - TABLE_LEVEL > 12.0), "{levels:?}");
        let (camera, cell) = seen_from_above();
        assert!(contrasts(&[], &camera, &cell).is_empty());
    }
}
