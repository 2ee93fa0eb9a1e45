//! Where does an object press on the table, and with what fraction of its weight?

use crate::geometry::outline::Outline;
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{Shape, Support};

/// Outlines whose length is more than this times their width (by their second moments) have no round patch.
const ELONGATED: f64 = 1.5;
/// Cells of the pressure grid along the longer side of an outline.
const GRID_CELLS: usize = 18;

/// Whether the second moments of the outline along its principal axes differ much.
pub(crate) fn is_elongated(shape: &Shape) -> bool {
    let points = pressure_points(shape, None);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (p, weight) in &points {
        xx += weight * p.x * p.x;
        xy += weight * p.x * p.y;
        yy += weight * p.y * p.y;
    }
    let (mean, half) = (0.5 * (xx + yy), (0.25 * (xx - yy).powi(2) + xy * xy).sqrt());
    mean + half > ELONGATED * ELONGATED * (mean - half)
}

/// The points on which an object presses, relative to its centroid (m), each with its fraction of the weight.
///
/// Without a support the pressure is uniform under the whole outline.
pub(crate) fn pressure_points(shape: &Shape, support: Option<&Support>) -> Vec<(Vec2, f64)> {
    let mut points: Vec<(Vec2, f64)> = match support {
        Some(Support::Feet(feet)) => feet.iter().map(|p| (p.to_vec(), 1.0)).collect(),
        None => grid_points(shape).into_iter().map(|p| (p, 1.0)).collect(),
        Some(Support::Gradient(gradient_per_m)) => {
            grid_points(shape).into_iter().map(|p| (p, (1.0 + gradient_per_m.dot(p)).max(0.0))).collect()
        }
    };
    let sum: f64 = points.iter().map(|p| p.1).sum();
    for point in &mut points {
        point.1 /= sum;
    }
    points
}

/// The centres of the cells of a grid that are inside an outline.
fn grid_points(shape: &Shape) -> Vec<Vec2> {
    let outline = Outline::new(shape, Pose::default());
    let corners = shape.corners();
    let extent = |coordinate: fn(&Point) -> f64| {
        let r = shape.outer_radius_m();
        let values = corners.iter().map(coordinate);
        if corners.is_empty() {
            return (-r, r);
        }
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let ((left, right), (low, high)) = (extent(|p| p.x), extent(|p| p.y));
    let cell = (right - left).max(high - low) / GRID_CELLS as f64;
    let count = |from: f64, to: f64| ((to - from) / cell).round().max(6.0) as usize;
    let (columns, rows) = (count(left, right), count(low, high));
    let mut points = Vec::new();
    for i in 0..columns {
        for k in 0..rows {
            let fraction = |n: usize, of: usize| (n as f64 + 0.5) / of as f64;
            let p = Point::new(
                left + (right - left) * fraction(i, columns),
                low + (high - low) * fraction(k, rows),
            );
            if outline.contains(p) {
                points.push(p.to_vec());
            }
        }
    }
    points
}
