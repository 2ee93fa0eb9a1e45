//! Which projection takes these places of the table to these pixels?
//!
//! A homography by the direct linear transform starts it, Levenberg and Marquardt's method ends it: least squares of
//! the distances in the picture, with the covariance of what was found.

use super::camera::{Extrinsics, Projection};
use super::homography::Homography;
use super::lens::Lens;
use crate::geometry::{Pixel, Point};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};

/// A place on the table and the pixel that shows it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sighting {
    pub(super) place: Point,
    pub(super) pixel: Pixel,
    /// One standard deviation of each of the pixel's coordinates (px).
    pub(super) std_px: f64,
}

/// A projection fitted to sightings.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) projection: Projection,
    /// The sum of the squares of what remains, each in standard deviations of its pixel.
    pub(super) misfit: f64,
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
/// better.
pub(super) fn pose(lens: &Lens, sightings: &[Sighting], unknown: Unknown) -> Option<Fit> {
    let rays =
        sightings.iter().map(|s| lens.ray_from_pixel(s.pixel).map(|[x, y]| (s.place, Pixel::new(x, y))));
    let rays: Vec<_> = rays.collect::<Option<_>>()?;
    let first = extrinsics(&Homography::fitted(&rays)?)?;
    let starts = [Some(first), Some(flipped(&first, sightings))];
    let fits = starts.into_iter().flatten().filter_map(|pose| {
        refined(Projection::Space { lens: lens.clone(), pose }, sightings, unknown.parameters())
    });
    fits.min_by(|a, b| a.misfit.total_cmp(&b.misfit))
}

/// The homography of least distances in the picture.
pub(super) fn plane(sightings: &[Sighting]) -> Option<Fit> {
    let pairs: Vec<_> = sightings.iter().map(|s| (s.place, s.pixel)).collect();
    let Homography(h) = Homography::fitted(&pairs)?;
    // The middle of the places is in view: there the last coordinate is one, and only eight numbers are free.
    let middle = middle(sightings);
    let h = h / h.row(2).dot(&Vector3::new(middle.x, middle.y, 1.0).transpose());
    refined(Projection::Plane { pixel_from_table: h.transpose().into() }, sightings, 8)
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
fn flipped(pose: &Extrinsics, sightings: &[Sighting]) -> Extrinsics {
    let middle = middle(sightings);
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

/// The mean of the places, on the table.
fn middle(sightings: &[Sighting]) -> Vector3<f64> {
    let n = sightings.len() as f64;
    sightings.iter().fold(Vector3::zeros(), |sum, s| sum + Vector3::new(s.place.x, s.place.y, 0.0) / n)
}

/// A projection a little away: turned by the first three (rad, about the camera's axes), moved by the next three (m),
/// then the logarithm of its focal length and its k1; a homography by its first eight numbers.
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

/// How far each pixel lies from where the projection has it, in its standard deviations.
fn residuals(projection: &Projection, sightings: &[Sighting]) -> Option<DVector<f64>> {
    let mut out = DVector::zeros(2 * sightings.len());
    for (k, s) in sightings.iter().enumerate() {
        let pixel = projection.pixel(s.place, 0.0)?;
        out[2 * k] = (s.pixel.x - pixel.x) / s.std_px;
        out[2 * k + 1] = (s.pixel.y - pixel.y) / s.std_px;
    }
    Some(out)
}

/// How the pixels change with the parameters, one column each.
fn jacobian(projection: &Projection, sightings: &[Sighting], parameters: usize) -> Option<DMatrix<f64>> {
    let mut out = DMatrix::zeros(2 * sightings.len(), parameters);
    for k in 0..parameters {
        let mut by = vec![0.0; parameters];
        by[k] = SMALL;
        let up = residuals(&changed(projection, &by), sightings)?;
        by[k] = -SMALL;
        let down = residuals(&changed(projection, &by), sightings)?;
        out.set_column(k, &((down - up) / (2.0 * SMALL)));
    }
    Some(out)
}

/// Levenberg's and Marquardt's method from `start` on.
fn refined(start: Projection, sightings: &[Sighting], parameters: usize) -> Option<Fit> {
    let mut best = start;
    let mut residual = residuals(&best, sightings)?;
    let mut damping = 1e-3;
    for _ in 0..MOST_STEPS {
        let slope = jacobian(&best, sightings, parameters)?;
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
                residuals(&next, sightings).map(|r| (next, r))
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
    let freedom = (2 * sightings.len()).saturating_sub(parameters).max(1) as f64;
    let misfit = residual.norm_squared();
    // What the pixels' own uncertainty does not explain makes the answer less certain.
    let variance = (misfit / freedom).max(1.0);
    let covariance = inverse(jacobian(&best, sightings, parameters)?) * variance;
    Some(Fit { projection: best, misfit, covariance })
}

/// The inverse of the normal matrix of these slopes; what the pixels do not tell is infinitely uncertain.
fn inverse(slope: DMatrix<f64>) -> DMatrix<f64> {
    let n = slope.ncols();
    let sizes: Vec<f64> = slope.column_iter().map(|column| column.norm()).collect();
    let mut scaled = slope;
    for (mut column, size) in scaled.column_iter_mut().zip(&sizes) {
        column /= *size;
    }
    let cholesky = scaled.tr_mul(&scaled).cholesky();
    let told = cholesky.map(|c| c.inverse()).filter(|inverse| inverse.iter().all(|v| v.is_finite()));
    let inverse = told.unwrap_or_else(|| DMatrix::from_diagonal_element(n, n, f64::INFINITY));
    DMatrix::from_fn(n, n, |i, k| inverse[(i, k)] / (sizes[i] * sizes[k]))
}

impl Fit {
    /// One standard deviation of the place on the table that a pixel shows, per axis (m); not finite where the
    /// sightings do not tell.
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
        let seen = |place| Sighting { place, pixel: camera.pixel_from_table(place, 0.0), std_px: 0.02 };
        grid().map(seen).collect()
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
            let fit = pose(&lens, &sightings(&truth), Unknown::Pose).expect("20 points");
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
            pose(&guess, &sightings(truth), Unknown::Focal).expect("20 points")
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
        let clicks: Vec<_> = sightings(&truth).into_iter().map(|s| Sighting { std_px: 0.5, ..s }).collect();
        let fit = plane(&clicks).expect("20 points");
        assert!(fit.misfit < 1e-12, "{}", fit.misfit);
        let std_m = fit.place_std_m(Point::new(0.1, 0.1));
        assert!(std_m > 1e-5 && std_m < 1e-3, "{std_m} m for clicks of half a pixel");
    }

    #[test]
    fn points_on_a_line_give_no_homography() {
        let line: Vec<_> =
            (0..6).map(f64::from).map(|t| (Point::new(t, 2.0 * t), Pixel::new(3.0 * t, t))).collect();
        assert!(Homography::fitted(&line).is_none());
    }
}
