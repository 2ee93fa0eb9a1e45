//! Which part of an image is labelled?

use crate::capture::GreyImage;
use crate::geometry::Pixel;

/// A rectangle of pixels; its last column and row are excluded (px).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column, and the column after the last one.
    pub x: [usize; 2],
    /// First row, and the row after the last one.
    pub y: [usize; 2],
}

impl Window {
    /// The whole image.
    pub fn whole(image: &GreyImage) -> Self {
        Self { x: [0, image.width], y: [0, image.height] }
    }

    /// All pixels whose centres are within `reach_px` of `centre` in x and in y; a square, clipped to the image.
    pub fn around(centre: Pixel, reach_px: f64, image: &GreyImage) -> Self {
        let span = |at: f64, size: usize| {
            let clamp = |v: f64| v.clamp(0.0, size as f64) as usize;
            let first = clamp((at - reach_px).ceil());
            [first, clamp((at + reach_px).floor() + 1.0).max(first)]
        };
        Self { x: span(centre.x, image.width), y: span(centre.y, image.height) }
    }
}
