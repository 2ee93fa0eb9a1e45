//! Which projection takes these places of the table to these pixels?
//!
//! A homography by the direct linear transform starts it, Levenberg and Marquardt's method ends it: least squares of
//! the distances in the picture, with the covariance of what was found.

use super::camera::{Extrinsics, Projection};
use super::lens::Lens;
use crate::geometry::{Pixel, Point};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, SMatrix, SymmetricEigen, Vector3};

/// A place on the table and the pixel that shows it.
pub(super) type Sighting = (Point, Pixel);

/// A map of one plane onto another that keeps straight lines.
#[derive(Clone, Copy, Debug)]
pub(super) struct Homography(Matrix3<f64>);

impl Homography {
    /// The map of least algebraic error, exact for four pairs (Hartley and Zisserman, algorithm 4.2); `None` for
    /// fewer or for points that do not span a plane.
    pub(super) fn fitted(pairs: &[Sighting]) -> Option<Self> {
        if pairs.len() < 4 {
            return None;
        }
        let from = normalizing(pairs.iter().map(|(p, _)| (p.x, p.y)))?;
        let to = normalizing(pairs.iter().map(|(_, p)| (p.x, p.y)))?;
        let mut normal = SMatrix::<f64, 9, 9>::zeros();
        for (place, pixel) in pairs {
            let p = from * Vector3::new(place.x, place.y, 1.0);
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
        let mut order: Vec<usize> = (0..9).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        if eigen.eigenvalues[order[1]] < DEGENERATE {
            return None;
        }
        let h = Matrix3::from_row_iterator(eigen.eigenvectors.column(order[0]).iter().copied());
        let h = to.try_inverse()? * h * from;
        // Seen places lie before the camera: the last coordinate is made positive for the first of them.
        let last = h.row(2).dot(&Vector3::new(pairs[0].0.x, pairs[0].0.y, 1.0).transpose());
        Some(Self(h / last.signum()))
    }

    /// `None` past the horizon.
    pub(super) fn pixel(&self, place: Point) -> Option<Pixel> {
        let p = self.0 * Vector3::new(place.x, place.y, 1.0);
        (p.z > 0.0).then(|| Pixel::new(p.x / p.z, p.y / p.z))
    }
}

/// The second smallest eigenvalue, of order one for points in general position, is rounding for collinear ones.
const DEGENERATE: f64 = 1e-9;

/// Moves points to their mean and scales them to a mean distance of the square root of two.
fn normalizing(points: impl Iterator<Item = (f64, f64)> + Clone) -> Option<Matrix3<f64>> {
    let n = points.clone().count() as f64;
    let (x, y) = points.clone().fold((0.0, 0.0), |(sx, sy), (x, y)| (sx + x / n, sy + y / n));
    let spread = points.map(|(px, py)| (px - x).hypot(py - y)).sum::<f64>() / n;
    let s = std::f64::consts::SQRT_2 / spread;
    s.is_finite().then(|| Matrix3::new(s, 0.0, -s * x, 0.0, s, -s * y, 0.0, 0.0, 1.0))
}

/// A projection fitted to sightings.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) projection: Projection,
    /// Root mean square distance in the picture (px).
    pub(super) rms_px: f64,
    /// Of the parameters of [`changed`].
    pub(super) covariance: DMatrix<f64>,
}

/// What is unknown about a lens besides where it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unknown {
    /// Nothing.
    Pose,
    /// One focal length.
    Focal,
    /// One focal length and k1.
    FocalAndK1,
}

impl Unknown {
    fn parameters(self) -> usize {
        match self {
            Self::Pose => 6,
            Self::Focal => 7,
            Self::FocalAndK1 => 8,
        }
    }
}

/// Where the lens stands; of the two poses in which a small flat thing looks nearly the same, the one that fits
/// better.  `noise_px` is the least standard deviation that a pixel's coordinates can have.
pub(super) fn pose(lens: &Lens, pairs: &[Sighting], unknown: Unknown, noise_px: f64) -> Option<Fit> {
    let rays = pairs
        .iter()
        .map(|&(place, pixel)| lens.ray_from_pixel(pixel).map(|[x, y]| (place, Pixel::new(x, y))));
    let rays: Vec<Sighting> = rays.collect::<Option<_>>()?;
    let first = extrinsics(&Homography::fitted(&rays)?)?;
    let starts = [Some(first), Some(flipped(&first, pairs))];
    let fits = starts.into_iter().flatten().filter_map(|pose| {
        refined(Projection::Space { lens: lens.clone(), pose }, pairs, unknown.parameters(), noise_px)
    });
    fits.min_by(|a, b| a.rms_px.total_cmp(&b.rms_px))
}

/// The homography of least distances in the picture.
pub(super) fn plane(pairs: &[Sighting], noise_px: f64) -> Option<Fit> {
    let Homography(h) = Homography::fitted(pairs)?;
    let h = h / h.norm();
    refined(Projection::Plane { pixel_from_table: h.transpose().into() }, pairs, 9, noise_px)
}

/// The rigid motion in a homography from the table to rays.
fn extrinsics(Homography(h): &Homography) -> Option<Extrinsics> {
    let (h1, h2, h3) = (h.column(0), h.column(1), h.column(2));
    let scale = 2.0 / (h1.norm() + h2.norm());
    let (r1, r2) = (h1 * scale, h2 * scale);
    let near = Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]);
    let svd = near.svd(true, true);
    let rotation = svd.u? * svd.v_t?;
    (rotation.determinant() > 0.0 && scale.is_finite()).then(|| Extrinsics::new(&rotation, &(h3 * scale)))
}

/// The pose whose tilt is mirrored in the view ray through the points' middle: from afar it looks the same.
fn flipped(pose: &Extrinsics, pairs: &[Sighting]) -> Extrinsics {
    let n = pairs.len() as f64;
    let middle = pairs.iter().fold(Vector3::zeros(), |sum, (p, _)| sum + Vector3::new(p.x, p.y, 0.0) / n);
    let rotation = pose.rotation();
    let seen = rotation * middle + pose.translation_m();
    let ray = seen.normalize();
    let mirrored = |axis: usize| {
        let v = rotation.column(axis).into_owned();
        v - ray * (2.0 * ray.dot(&v))
    };
    let (r1, r2) = (mirrored(0), mirrored(1));
    let rotation = Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]);
    Extrinsics::new(&rotation, &(seen - rotation * middle))
}

/// A projection a little away: turned by the first three (rad, about the camera's axes), moved by the next three (m),
/// then the logarithm of its focal length and its k1; a homography by its nine numbers.
pub(super) fn changed(projection: &Projection, by: &[f64]) -> Projection {
    match projection {
        Projection::Space { lens, pose } => {
            let turn = Rotation3::new(Vector3::new(by[0], by[1], by[2]));
            let rotation = turn.matrix() * pose.rotation();
            let translation = pose.translation_m() + Vector3::new(by[3], by[4], by[5]);
            let lens = match by[6..] {
                [] => lens.clone(),
                [focal] => lens.changed(focal.exp(), 0.0),
                [focal, k1, ..] => lens.changed(focal.exp(), k1),
            };
            Projection::Space { lens, pose: Extrinsics::new(&rotation, &translation) }
        }
        Projection::Plane { pixel_from_table } => {
            let mut h = *pixel_from_table;
            for (value, by) in h.iter_mut().flatten().zip(by) {
                *value += by;
            }
            Projection::Plane { pixel_from_table: h }
        }
    }
}

/// The step of numerical derivatives: its square is lost against the pixels it moves, its rounding too.
const SMALL: f64 = 1e-6;
/// Steps until the least squares settle.
const MOST_STEPS: usize = 100;
/// A sum of squares that falls by less than this part has settled.
const SETTLED: f64 = 1e-13;
/// Damping beyond which no step goes down any more.
const MOST_DAMPING: f64 = 1e12;

fn residuals(projection: &Projection, pairs: &[Sighting]) -> Option<DVector<f64>> {
    let mut out = DVector::zeros(2 * pairs.len());
    for (k, (place, seen)) in pairs.iter().enumerate() {
        let pixel = projection.pixel(*place, 0.0)?;
        (out[2 * k], out[2 * k + 1]) = (seen.x - pixel.x, seen.y - pixel.y);
    }
    Some(out)
}

/// How the pixels change with the parameters, one column each.
fn jacobian(projection: &Projection, pairs: &[Sighting], parameters: usize) -> Option<DMatrix<f64>> {
    let mut out = DMatrix::zeros(2 * pairs.len(), parameters);
    for k in 0..parameters {
        let mut by = vec![0.0; parameters];
        by[k] = SMALL;
        let up = residuals(&changed(projection, &by), pairs)?;
        by[k] = -SMALL;
        let down = residuals(&changed(projection, &by), pairs)?;
        out.set_column(k, &((down - up) / (2.0 * SMALL)));
    }
    Some(out)
}

/// Levenberg's and Marquardt's method from `start` on.
fn refined(start: Projection, pairs: &[Sighting], parameters: usize, noise_px: f64) -> Option<Fit> {
    let mut best = start;
    let mut residual = residuals(&best, pairs)?;
    let mut damping = 1e-3;
    for _ in 0..MOST_STEPS {
        let slope = jacobian(&best, pairs, parameters)?;
        let normal = slope.tr_mul(&slope);
        let down = slope.tr_mul(&residual);
        let before = residual.norm_squared();
        while damping < MOST_DAMPING {
            let mut damped = normal.clone();
            for k in 0..parameters {
                damped[(k, k)] += damping * normal[(k, k)] + f64::MIN_POSITIVE;
            }
            let tried = damped.cholesky().and_then(|c| {
                let next = changed(&best, c.solve(&down).as_slice());
                residuals(&next, pairs).map(|r| (next, r))
            });
            if let Some((next, r)) = tried
                && r.norm_squared() <= before
            {
                (best, residual) = (next, r);
                damping /= 10.0;
                break;
            }
            damping *= 10.0;
        }
        if damping >= MOST_DAMPING || before - residual.norm_squared() <= SETTLED * before {
            break;
        }
    }
    let rms_px = (residual.norm_squared() / pairs.len() as f64).sqrt();
    let freedom = (2 * pairs.len()).saturating_sub(parameters).max(1) as f64;
    let variance = (residual.norm_squared() / freedom).max(noise_px * noise_px);
    let slope = jacobian(&best, pairs, parameters)?;
    let covariance = slope.tr_mul(&slope).pseudo_inverse(COVARIANCE_FLOOR).ok()? * variance;
    Some(Fit { projection: best, rms_px, covariance })
}

/// Directions that move no pixel (a homography's overall scale) have no variance of their own.
const COVARIANCE_FLOOR: f64 = 1e-9;

impl Fit {
    /// One standard deviation of the place on the table that a pixel shows, per axis (m).
    pub(super) fn place_std_m(&self, place: Point) -> f64 {
        let pixel = self.projection.pixel(place, 0.0);
        let n = self.covariance.nrows();
        let mut slope = DMatrix::zeros(2, n);
        for k in 0..n {
            let mut by = vec![0.0; n];
            let mut moved = |step: f64| {
                by[k] = step;
                pixel.and_then(|pixel| changed(&self.projection, &by).place(pixel, 0.0))
            };
            let (Some(up), Some(down)) = (moved(SMALL), moved(-SMALL)) else { return f64::INFINITY };
            let change = (up - down) / (2.0 * SMALL);
            (slope[(0, k)], slope[(1, k)]) = (change.x, change.y);
        }
        let covariance = &slope * &self.covariance * slope.transpose();
        (covariance.trace() / 2.0).sqrt()
    }

    /// One standard deviation of the focal length over itself, where it was unknown.
    pub(super) fn focal_std(&self) -> Option<f64> {
        (7..=8).contains(&self.covariance.nrows()).then(|| self.covariance[(6, 6)].sqrt())
    }

    /// One standard deviation of k1, where it was unknown.
    pub(super) fn k1_std(&self) -> Option<f64> {
        (self.covariance.nrows() == 8).then(|| self.covariance[(7, 7)].sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::Camera;
    use crate::cell::Transform;

    const SIZE: [usize; 2] = [1280, 720];

    fn grid() -> impl Iterator<Item = Point> {
        (0..20).map(|k| Point::new(f64::from(k % 5) * 0.15 - 0.3, f64::from(k / 5) * 0.1 - 0.15))
    }

    fn sightings(camera: &Camera) -> Vec<Sighting> {
        grid().map(|p| (p, camera.pixel_from_table(p, 0.0))).collect()
    }

    fn tilted(roll_rad: f64, yaw_rad: f64, distortion: [f64; 5]) -> Camera {
        let lens = Lens::new([1400.0, 1395.0], [650.0, 350.0], distortion);
        let back_m = 1.2 * roll_rad.sin();
        let position_m = [0.02 + back_m * yaw_rad.sin(), -back_m * yaw_rad.cos(), 1.2 * roll_rad.cos()];
        Camera::new(SIZE, lens, Transform { position_m, rpy_rad: [roll_rad, 0.02, yaw_rad] })
    }

    #[test]
    fn a_known_lens_finds_its_pose_under_any_tilt_and_turn() {
        for (roll_rad, yaw_rad) in [(0.0, 0.0), (0.3, 1.0), (0.9, 3.1), (-0.7, -2.0)] {
            let truth = tilted(roll_rad, yaw_rad, [-0.1, 0.02, 0.001, -0.001, 0.0]);
            let lens = truth.lens().expect("has one").clone();
            let fit = pose(&lens, &sightings(&truth), Unknown::Pose, 0.01).expect("20 points");
            let found = Camera::seeing(SIZE, fit.projection);
            for place in grid() {
                let raised = found.table_from_pixel(truth.pixel_from_table(place, 0.1), 0.1);
                assert!(raised.distance(place) < 1e-8, "{} m off at tilt {roll_rad}", raised.distance(place));
            }
        }
    }

    #[test]
    fn an_unknown_focal_length_shows_under_tilt_and_hides_without() {
        let size_up = |truth: &Camera| {
            let guess = Lens::new([1000.0; 2], [650.0, 350.0], [0.0; 5]);
            pose(&guess, &sightings(truth), Unknown::Focal, 0.02).expect("20 points")
        };
        let mut truth = tilted(0.5, 0.2, [0.0; 5]);
        truth.projection = match truth.projection {
            Projection::Space { pose, .. } => {
                Projection::Space { lens: Lens::new([1400.0; 2], [650.0, 350.0], [0.0; 5]), pose }
            }
            plane @ Projection::Plane { .. } => plane,
        };
        let fit = size_up(&truth);
        let focal_px = Camera::seeing(SIZE, fit.projection.clone()).lens().expect("has one").focal_px()[0];
        assert!((focal_px - 1400.0).abs() < 1e-3, "{focal_px} px");
        assert!(fit.focal_std().expect("was unknown") < 1e-3);
        let flat = size_up(&tilted(0.0, 0.2, [0.0; 5])).focal_std().expect("was unknown");
        assert!(flat > 0.01, "straight down the focal length is known to {flat}");
    }

    #[test]
    fn a_homography_maps_the_table_without_any_lens() {
        let truth = tilted(0.4, 0.3, [0.0; 5]);
        let fit = plane(&sightings(&truth), 0.5).expect("20 points");
        assert!(fit.rms_px < 1e-6, "{} px", fit.rms_px);
        let std_m = fit.place_std_m(Point::new(0.1, 0.1));
        assert!(std_m > 1e-5 && std_m < 1e-3, "{std_m} m for clicks of half a pixel");
    }

    #[test]
    fn points_on_a_line_give_no_homography() {
        let line: Vec<Sighting> =
            (0..6).map(f64::from).map(|t| (Point::new(t, 2.0 * t), Pixel::new(3.0 * t, t))).collect();
        assert!(Homography::fitted(&line).is_none());
    }
}
