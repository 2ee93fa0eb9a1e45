//! How large is a plane area, where is its centroid, and how far does it extend along its principal axes?

use std::f64::consts::PI;

/// Area, centroid and central second moments (xx, xy, yy) over the area, in the units of the coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments {
    pub area: f64,
    pub centroid: [f64; 2],
    pub covariance: [f64; 3],
}

impl Moments {
    /// Moments of the area inside a simple polygon (Green's theorem), clockwise or counter-clockwise.
    pub(crate) fn of_polygon(corners: &[[f64; 2]]) -> Self {
        let [ox, oy] = corners[0];
        let (mut twice, mut first, mut second) = (0.0, [0.0; 2], [0.0; 3]);
        for (k, p) in corners.iter().enumerate() {
            let q = corners[(k + 1) % corners.len()];
            // Relative to the first corner: far from the origin the sums would lose digits.
            let (px, py, qx, qy) = (p[0] - ox, p[1] - oy, q[0] - ox, q[1] - oy);
            let cross = px * qy - qx * py;
            twice += cross;
            first[0] += cross * (px + qx) / 6.0;
            first[1] += cross * (py + qy) / 6.0;
            second[0] += cross * (px * px + px * qx + qx * qx) / 12.0;
            second[1] += cross * (px * qy + 2.0 * px * py + 2.0 * qx * qy + qx * py) / 24.0;
            second[2] += cross * (py * py + py * qy + qy * qy) / 12.0;
        }
        let area = twice / 2.0;
        let [mx, my] = first.map(|sum| sum / area);
        let [xx, xy, yy] = second.map(|sum| sum / area);
        Self {
            area: area.abs(),
            centroid: [mx + ox, my + oy],
            covariance: [xx - mx * mx, xy - mx * my, yy - my * my],
        }
    }
}

/// The larger and the smaller principal second moment, and the direction of the larger one (rad, in (-pi/2, pi/2]).
pub(crate) fn principal_axes([xx, xy, yy]: [f64; 3]) -> (f64, f64, f64) {
    let (mean, half) = (f64::midpoint(xx, yy), (xx - yy) / 2.0);
    let radius = half.hypot(xy);
    (mean + radius, (mean - radius).max(0.0), xy.atan2(half) / 2.0)
}

/// Area over the area of the ellipse with the same second moments: 1 for an ellipse, 0.95 for a rectangle, less for a
/// ragged, hollow or curved shape.  Invariant under affine maps, so it is the same from any direction of view.
pub(crate) fn compactness(area: f64, [xx, xy, yy]: [f64; 3]) -> f64 {
    area / (4.0 * PI * (xx * yy - xy * xy).max(f64::MIN_POSITIVE).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_rectangle_has_the_moments_and_axes_of_its_sides() {
        let (angle_rad, [length, width], [x, y]) = (0.4_f64, [3.0, 1.0], [50.0, -20.0]);
        let (sin, cos) = angle_rad.sin_cos();
        let corner = |(u, v): (f64, f64)| {
            let (u, v) = (u * length / 2.0, v * width / 2.0);
            [x + cos * u - sin * v, y + sin * u + cos * v]
        };
        let mut corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner);
        for _ in 0..2 {
            let Moments { area, centroid, covariance } = Moments::of_polygon(&corners);
            let (long, short, axis_rad) = principal_axes(covariance);
            assert!((area - length * width).abs() < 1e-12, "area {area}");
            assert!((centroid[0] - x).abs() + (centroid[1] - y).abs() < 1e-12, "centroid {centroid:?}");
            assert!((long - 0.75).abs() < 1e-12 && (short - 1.0 / 12.0).abs() < 1e-12, "{long} {short}");
            assert!((axis_rad - angle_rad).abs() < 1e-12, "{axis_rad} rad");
            assert!((compactness(area, covariance) - 3.0 / PI).abs() < 1e-12, "a rectangle fills 95.5 %");
            // The same area with its corners clockwise.
            corners.reverse();
        }
    }
}
