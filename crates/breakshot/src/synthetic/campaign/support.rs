//! Where the table carries the objects of a drawn campaign.

use crate::geometry::Vec2;
use crate::object::Shape;
use std::f64::consts::TAU;

/// Radius of a disc, half the width of a square (m).
pub(super) fn half_width_m(shape: &Shape) -> f64 {
    match shape {
        Shape::Disc { radius_m } => *radius_m,
        other => other.reach_m(Vec2::new(1.0, 0.0)),
    }
}

/// Support points that carry equal fractions of the weight: rings of a disc, a grid of a square.
///
/// `towards_rim` is 0 for an even weight and 1 for one that acts on the rim alone.
pub(super) fn support_m(shape: &Shape, towards_rim: f64) -> Vec<Vec2> {
    const RINGS: usize = 6;
    const SPOKES: usize = 12;
    const ROWS: usize = 9;
    let moved = |even: f64| even + (1.0 - even) * towards_rim;
    match shape {
        Shape::Disc { radius_m } => (0..RINGS * SPOKES)
            .map(|k| {
                let (ring, spoke) = (k / SPOKES, k % SPOKES);
                // Rings of equal area.
                let fraction = moved(((ring as f64 + 0.5) / RINGS as f64).sqrt());
                Vec2::from_heading(TAU * (spoke as f64 + 0.5 * (ring % 2) as f64) / SPOKES as f64)
                    * (radius_m * fraction)
            })
            .collect(),
        other => {
            let half = half_width_m(other);
            let at = |k: usize| (2 * k + 1) as f64 / ROWS as f64 - 1.0;
            let point = |k: usize| {
                let even = Vec2::new(at(k % ROWS), at(k / ROWS));
                // The middle of the grid stays where it is.
                let part = even.x.abs().max(even.y.abs()).max(f64::MIN_POSITIVE);
                even * (half * moved(part) / part)
            };
            (0..ROWS * ROWS).map(point).collect()
        }
    }
}
