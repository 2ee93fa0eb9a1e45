//! Pixel coordinates without the lens's distortion, in which straight lines are straight.

use crate::capture::lens::Lens;
use crate::geometry::Pixel;

/// The map from the picture to the picture of a pinhole camera and back; the identity without a lens.
pub(super) struct Undistortion<'a> {
    pub(super) lens: Option<&'a Lens>,
}

impl Undistortion<'_> {
    pub(super) fn undistorted(&self, pixel: Pixel) -> Option<Pixel> {
        self.lens.map_or(Some(pixel), |lens| lens.undistorted_pixel(pixel))
    }

    pub(super) fn distorted(&self, ideal: Pixel) -> Option<Pixel> {
        self.lens.map_or(Some(ideal), |lens| lens.distorted_pixel(ideal))
    }
}
