//! What would the image of the empty table look like?
//!
//! Objects without markers are found by their difference from the table, whose brightness varies with the
//! illumination. An image of the empty table gives its grey level pixel by pixel. Without one a smooth surface is
//! fitted to the image by least absolute differences: tables have a uniform colour, and most of a table is empty.

use crate::capture::GreyImage;
use nalgebra::{SMatrix, SVector};

/// Grey level of the table after the subtraction.
const TABLE_GREY: f64 = 128.0;
/// Side of the blocks whose means the surface is fitted to (px).
const BLOCK_PX: usize = 16;
/// Number of terms of a cubic polynomial in two variables.
const TERMS: usize = 10;
/// Rounds of iteratively reweighted least squares, which minimise absolute differences: objects and tags are
/// outliers.
const ROUNDS: usize = 15;
/// Residuals below this (grey levels) have the same weight.
const LEAST_RESIDUAL: f64 = 1.0;

/// The image minus the empty table plus 128, of the same size: uniform on the table, darker or lighter on objects.
pub(in crate::detect) fn subtracted(image: &GreyImage, table: Option<&GreyImage>) -> GreyImage {
    let level = |grey: u8, table: f64| (f64::from(grey) - table + TABLE_GREY).round().clamp(0.0, 255.0) as u8;
    let pixels = if let Some(table) = table {
        image.pixels.iter().zip(&table.pixels).map(|(&p, &t)| level(p, f64::from(t))).collect()
    } else {
        let surface = surface(image);
        let at =
            |k: usize| surface.dot(&monomials(image, (k % image.width) as f64, (k / image.width) as f64));
        image.pixels.iter().enumerate().map(|(k, &p)| level(p, at(k))).collect()
    };
    GreyImage { pixels, ..*image }
}

/// The monomials up to the third degree of a position, scaled to -1 to 1 across the image.
fn monomials(image: &GreyImage, x: f64, y: f64) -> SVector<f64, TERMS> {
    let (u, v) = (2.0 * x / image.width as f64 - 1.0, 2.0 * y / image.height as f64 - 1.0);
    SVector::from([1.0, u, v, u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v])
}

/// Coefficients of the cubic surface with the least absolute differences from the blocks' means.
fn surface(image: &GreyImage) -> SVector<f64, TERMS> {
    let blocks: Vec<(SVector<f64, TERMS>, f64)> = blocks(image).collect();
    let mut surface = SVector::<f64, TERMS>::zeros();
    for round in 0..ROUNDS {
        let (mut matrix, mut side) = (SMatrix::<f64, TERMS, TERMS>::zeros(), SVector::<f64, TERMS>::zeros());
        for (monomials, grey) in &blocks {
            let residual = grey - surface.dot(monomials);
            let weight = if round == 0 { 1.0 } else { 1.0 / residual.abs().max(LEAST_RESIDUAL) };
            matrix += monomials * monomials.transpose() * weight;
            side += monomials * (grey * weight);
        }
        // An image with too few blocks for a cubic surface: the mean.
        let Some(inverse) = matrix.try_inverse() else {
            surface[0] = blocks.iter().map(|b| b.1).sum::<f64>() / blocks.len().max(1) as f64;
            return surface;
        };
        surface = inverse * side;
    }
    surface
}

/// The monomials at the centre of each block, and its mean grey level.
fn blocks(image: &GreyImage) -> impl Iterator<Item = (SVector<f64, TERMS>, f64)> {
    let small = image.shrunk(BLOCK_PX);
    (0..small.pixels.len()).map(move |k| {
        let centre = |at: usize| (at as f64 + 0.5) * BLOCK_PX as f64;
        (monomials(image, centre(k % small.width), centre(k / small.width)), f64::from(small.pixels[k]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_brightness_gradient_is_subtracted_and_objects_keep_their_difference() {
        let (width, height) = (320, 240);
        let table = |x: usize, y: usize| 190.0 - 0.1 * x as f64 + 3e-4 * (x * y) as f64;
        let on_object = |x: usize, y: usize| (60..140).contains(&x) && (50..120).contains(&y);
        let grey =
            |x: usize, y: usize| (table(x, y) + if on_object(x, y) { 15.0 } else { 0.0 }).round() as u8;
        let pixels = (0..width * height).map(|k| grey(k % width, k / width)).collect();
        let image = GreyImage { width, height, pixels };
        let empty = (0..width * height).map(|k| table(k % width, k / width).round() as u8).collect();
        let empty = GreyImage { width, height, pixels: empty };
        for (given, most) in [(None, 3.0), (Some(&empty), 1.0)] {
            let subtracted = subtracted(&image, given);
            for k in 0..width * height {
                let expected = TABLE_GREY + if on_object(k % width, k / width) { 15.0 } else { 0.0 };
                let off = (f64::from(subtracted.pixels[k]) - expected).abs();
                assert!(off <= most, "pixel {k}: {} instead of {expected}", subtracted.pixels[k]);
            }
        }
    }
}
