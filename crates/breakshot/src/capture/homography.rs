//! The map of one plane onto another that keeps straight lines.

use crate::geometry::{Pixel, Point};
use crate::statistics::argsort;
use nalgebra::{Matrix3, SMatrix, SymmetricEigen, Vector3};

/// A map of one plane onto another that keeps straight lines.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Homography(pub(crate) Matrix3<f64>);

impl Homography {
    /// The map of least algebraic error, exact for four pairs (Hartley and Zisserman, algorithm 4.2); `None` for
    /// fewer pairs or points on a line.
    pub(crate) fn fitted(pairs: &[(Point, Pixel)]) -> Option<Self> {
        if pairs.len() < 4 {
            return None;
        }
        let from = normalizing(pairs.iter().map(|(p, _)| (p.x, p.y)))?;
        let to = normalizing(pairs.iter().map(|(_, p)| (p.x, p.y)))?;
        let mut normal = SMatrix::<f64, 9, 9>::zeros();
        for (point, pixel) in pairs {
            let p = from * Vector3::new(point.x, point.y, 1.0);
            let q = to * Vector3::new(pixel.x, pixel.y, 1.0);
            for (axis, value) in [(0, q.x), (1, q.y)] {
                let mut row = SMatrix::<f64, 9, 1>::zeros();
                for k in 0..3 {
                    row[3 * axis + k] = p[k];
                    row[6 + k] = -value * p[k];
                }
                normal += row * row.transpose();
            }
        }
        let eigen = SymmetricEigen::new(normal);
        let order = argsort(eigen.eigenvalues.as_slice());
        if eigen.eigenvalues[order[1]] < DEGENERATE {
            return None;
        }
        let h = Matrix3::from_row_iterator(eigen.eigenvectors.column(order[0]).iter().copied());
        let h = to.try_inverse()? * h * from;
        // Visible points are in front of the camera: the last coordinate of the first one is made positive.
        let last = h.row(2).dot(&Vector3::new(pairs[0].0.x, pairs[0].0.y, 1.0).transpose());
        Some(Self(h / last.signum()))
    }

    /// The inverse map, from pixels to points.
    pub(crate) fn inverse(&self) -> Option<Self> {
        self.0.try_inverse().map(Self)
    }

    /// The pixel of a point; `None` beyond the horizon.
    pub(crate) fn pixel(&self, point: Point) -> Option<Pixel> {
        let p = self.0 * Vector3::new(point.x, point.y, 1.0);
        (p.z > 0.0).then(|| Pixel::new(p.x / p.z, p.y / p.z))
    }
}

/// Second smallest eigenvalue below which points count as collinear: it is of order one in general position.
const DEGENERATE: f64 = 1e-9;

/// The similarity that moves points to their mean and scales them to a mean distance of the square root of two.
fn normalizing(points: impl Iterator<Item = (f64, f64)> + Clone) -> Option<Matrix3<f64>> {
    let n = points.clone().count() as f64;
    let (x, y) = points.clone().fold((0.0, 0.0), |(sx, sy), (x, y)| (sx + x / n, sy + y / n));
    let spread = points.map(|(px, py)| (px - x).hypot(py - y)).sum::<f64>() / n;
    let s = std::f64::consts::SQRT_2 / spread;
    s.is_finite().then(|| Matrix3::new(s, 0.0, -s * x, 0.0, s, -s * y, 0.0, 0.0, 1.0))
}
