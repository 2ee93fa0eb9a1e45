//! What would the empty table look like?
//!
//! Objects without markers stand out from the table, which light falls on unevenly.  A picture of the empty table tells it
//! pixel by pixel; without one a smooth surface through most of the picture does: tables are plain, and most of one is
//! empty.

use crate::capture::GreyImage;
use nalgebra::{SMatrix, SVector};

/// The grey level that stands for the table in a levelled picture.
const TABLE_GREY: f64 = 128.0;
/// Blocks of this side (px) are averaged.
const BLOCK_PX: usize = 16;
/// A cubic surface in two directions.
const TERMS: usize = 10;
/// Fits and weights by turns: least absolute differences, so that objects and tags do not pull.
const ROUNDS: usize = 15;
/// Differences below this (grey levels) count alike.
const ALIKE: f64 = 1.0;

/// The picture less the empty table, of the same size: even where the table is, darker and lighter where something lies on it.
pub(in crate::detect) fn levelled(image: &GreyImage, table: Option<&GreyImage>) -> GreyImage {
    let level = |grey: u8, table: f64| (f64::from(grey) - table + TABLE_GREY).round().clamp(0.0, 255.0) as u8;
    let pixels = if let Some(table) = table {
        image.pixels.iter().zip(&table.pixels).map(|(&p, &t)| level(p, f64::from(t))).collect()
    } else {
        let surface = surface(image);
        let at = |k: usize| surface.dot(&powers(image, (k % image.width) as f64, (k / image.width) as f64));
        image.pixels.iter().enumerate().map(|(k, &p)| level(p, at(k))).collect()
    };
    GreyImage { pixels, ..*image }
}

/// Products of the powers of a place, from -1 to 1 across the picture.
fn powers(image: &GreyImage, x: f64, y: f64) -> SVector<f64, TERMS> {
    let (u, v) = (2.0 * x / image.width as f64 - 1.0, 2.0 * y / image.height as f64 - 1.0);
    SVector::from([1.0, u, v, u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v])
}

/// The cubic surface with the least absolute differences from the blocks' means.
fn surface(image: &GreyImage) -> SVector<f64, TERMS> {
    let blocks: Vec<(SVector<f64, TERMS>, f64)> = blocks(image).collect();
    let mut surface = SVector::<f64, TERMS>::zeros();
    for round in 0..ROUNDS {
        let (mut matrix, mut side) = (SMatrix::<f64, TERMS, TERMS>::zeros(), SVector::<f64, TERMS>::zeros());
        for (powers, grey) in &blocks {
            let off = grey - surface.dot(powers);
            let weight = if round == 0 { 1.0 } else { 1.0 / off.abs().max(ALIKE) };
            matrix += powers * powers.transpose() * weight;
            side += powers * (grey * weight);
        }
        // Too small a picture tells no surface; its mean will do.
        let Some(inverse) = matrix.try_inverse() else {
            surface[0] = blocks.iter().map(|b| b.1).sum::<f64>() / blocks.len().max(1) as f64;
            return surface;
        };
        surface = inverse * side;
    }
    surface
}

/// Every block's middle and mean.
fn blocks(image: &GreyImage) -> impl Iterator<Item = (SVector<f64, TERMS>, f64)> {
    let small = image.shrunk(BLOCK_PX);
    (0..small.pixels.len()).map(move |k| {
        let middle = |at: usize| (at as f64 + 0.5) * BLOCK_PX as f64;
        (powers(image, middle(k % small.width), middle(k / small.width)), f64::from(small.pixels[k]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_that_falls_off_is_levelled_and_what_lies_on_the_table_stands_out() {
        let (width, height) = (320, 240);
        let table = |x: usize, y: usize| 190.0 - 0.1 * x as f64 + 3e-4 * (x * y) as f64;
        let on_it = |x: usize, y: usize| (60..140).contains(&x) && (50..120).contains(&y);
        let grey = |x: usize, y: usize| (table(x, y) + if on_it(x, y) { 15.0 } else { 0.0 }).round() as u8;
        let pixels = (0..width * height).map(|k| grey(k % width, k / width)).collect();
        let image = GreyImage { width, height, pixels };
        let empty = (0..width * height).map(|k| table(k % width, k / width).round() as u8).collect();
        let empty = GreyImage { width, height, pixels: empty };
        for (given, most) in [(None, 3.0), (Some(&empty), 1.0)] {
            let levelled = levelled(&image, given);
            for k in 0..width * height {
                let due = TABLE_GREY + if on_it(k % width, k / width) { 15.0 } else { 0.0 };
                let off = (f64::from(levelled.pixels[k]) - due).abs();
                assert!(off <= most, "pixel {k}: {} instead of {due}", levelled.pixels[k]);
            }
        }
    }
}
