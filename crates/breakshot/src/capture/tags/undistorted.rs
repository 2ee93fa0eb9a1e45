//! Pictures in which straight lines are straight.

use crate::capture::lens::Lens;
use crate::geometry::Pixel;

/// The way from the picture to one in which straight lines are straight, and back.
pub(super) struct Straight<'a> {
    pub(super) lens: Option<&'a Lens>,
}

impl Straight<'_> {
    pub(super) fn straightened(&self, pixel: Pixel) -> Option<Pixel> {
        self.lens.map_or(Some(pixel), |lens| lens.straightened(pixel))
    }

    pub(super) fn bent(&self, ideal: Pixel) -> Option<Pixel> {
        self.lens.map_or(Some(ideal), |lens| lens.bent(ideal))
    }
}
