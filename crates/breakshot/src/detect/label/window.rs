//! Which part of a picture is labelled?

use crate::capture::GreyImage;
use crate::geometry::Pixel;

/// A part of a picture, its last column and row excluded (px).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Columns.
    pub x: [usize; 2],
    /// Rows.
    pub y: [usize; 2],
}

impl Window {
    /// The whole picture.
    pub fn whole(image: &GreyImage) -> Self {
        Self { x: [0, image.width], y: [0, image.height] }
    }

    /// All pixels whose centres are at most `reach_px` to the left, right, above or below of `centre`.
    pub fn around(centre: Pixel, reach_px: f64, image: &GreyImage) -> Self {
        let span = |at: f64, size: usize| {
            let clamp = |v: f64| v.clamp(0.0, size as f64) as usize;
            let first = clamp((at - reach_px).ceil());
            [first, clamp((at + reach_px).floor() + 1.0).max(first)]
        };
        Self { x: span(centre.x, image.width), y: span(centre.y, image.height) }
    }
}
