//! How does a striker look in a drawn film?

use super::film::Thing;
use crate::cell::Striker;
use crate::geometry::Pose;

/// Grey levels of its top and its sides.
const TOP_GREY: f64 = 70.0;
const SIDE_GREY: f64 = 95.0;

impl Thing {
    /// The striker, an upright rod or block on the table.
    pub fn striker(striker: &Striker, pose: Pose) -> Self {
        let top = Self::flat(striker.shape.clone(), pose, striker.height_m, TOP_GREY);
        Self { thickness_m: striker.height_m, side_grey: SIDE_GREY, ..top }
    }
}
