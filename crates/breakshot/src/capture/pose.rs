//! Which projection maps these points of the table to these pixels?
//!
//! Non-linear least squares of the reprojection errors (Levenberg-Marquardt), started from a homography (direct linear
//! transform), with the covariance of the parameters.

use super::camera::{Camera, Extrinsics, Projection};
use super::homography::Homography;
use super::lens::Lens;
use crate::geometry::{Pixel, Point};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};

/// A point of the table and its measured pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Correspondence {
    pub(super) point: Point,
    pub(super) pixel: Pixel,
    /// One standard deviation of each of the pixel's coordinates (px).
    pub(super) std_px: f64,
}

/// A projection fitted to correspondences.
#[derive(Clone, Debug)]
pub(super) struct PoseFit {
    pub(super) projection: Projection,
    /// The sum of the squared residuals, each in standard deviations of its pixel.
    pub(super) chi2: f64,
    /// The covariance of the parameters of [`perturbed`].
    pub(super) covariance: DMatrix<f64>,
}

/// The parameters that are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FreeParameters {
    /// The pose alone.
    Pose,
    /// The pose and one focal length.
    PoseAndFocal,
    /// The pose, one focal length and k1.
    PoseFocalAndK1,
}

impl FreeParameters {
    fn count(self) -> usize {
        match self {
            Self::Pose => 6,
            Self::PoseAndFocal => 7,
            Self::PoseFocalAndK1 => 8,
        }
    }
}

/// The pose of the lens, with the free parameters fitted; of the two poses in which a small planar target looks nearly
/// the same (Schweighofer and Pinz 2006), the one that fits better.  `None` if the points do not span the table.
pub(super) fn pose(lens: &Lens, correspondences: &[Correspondence], free: FreeParameters) -> Option<PoseFit> {
    let rays = correspondences
        .iter()
        .map(|s| lens.ray_from_pixel(s.pixel).map(|[x, y]| (s.point, Pixel::new(x, y))));
    let rays: Vec<_> = rays.collect::<Option<_>>()?;
    let first = extrinsics(&Homography::fitted(&rays)?)?;
    let starts = [Some(first), Some(mirrored_pose(&first, correspondences))];
    let fits = starts.into_iter().flatten().filter_map(|pose| {
        levenberg_marquardt(Projection::Space { lens: lens.clone(), pose }, correspondences, free.count())
    });
    fits.min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// The homography with the least squared distances in the picture.
pub(super) fn plane(correspondences: &[Correspondence]) -> Option<PoseFit> {
    let pairs: Vec<_> = correspondences.iter().map(|s| (s.point, s.pixel)).collect();
    let Homography(h) = Homography::fitted(&pairs)?;
    // The mean of the points is in view: scaling the last coordinate to one there leaves eight free numbers.
    let middle = middle(correspondences);
    let h = h / h.row(2).dot(&Vector3::new(middle.x, middle.y, 1.0).transpose());
    levenberg_marquardt(Projection::Plane { pixel_from_table: h.transpose().into() }, correspondences, 8)
}

/// The rigid motion that a homography from the table to rays contains.
fn extrinsics(Homography(h): &Homography) -> Option<Extrinsics> {
    let (h1, h2, h3) = (h.column(0), h.column(1), h.column(2));
    let scale = 2.0 / (h1.norm() + h2.norm());
    let (r1, r2) = (h1 * scale, h2 * scale);
    let near = Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]);
    let svd = near.svd(true, true);
    let rotation = svd.u? * svd.v_t?;
    (rotation.determinant() > 0.0 && scale.is_finite()).then(|| Extrinsics::new(&rotation, &(h3 * scale)))
}

/// The pose with the tilt mirrored in the view ray through the points' mean: from far away it looks the same.
fn mirrored_pose(pose: &Extrinsics, correspondences: &[Correspondence]) -> Extrinsics {
    let middle = middle(correspondences);
    let rotation = pose.rotation();
    let middle_in_camera = rotation * middle + pose.translation_m();
    let ray = middle_in_camera.normalize();
    let mirrored = |axis: usize| {
        let v = rotation.column(axis).into_owned();
        v - ray * (2.0 * ray.dot(&v))
    };
    let (r1, r2) = (mirrored(0), mirrored(1));
    let rotation = Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]);
    Extrinsics::new(&rotation, &(middle_in_camera - rotation * middle))
}

/// The mean of the points, on the table.
fn middle(correspondences: &[Correspondence]) -> Vector3<f64> {
    let n = correspondences.len() as f64;
    correspondences.iter().fold(Vector3::zeros(), |sum, s| sum + Vector3::new(s.point.x, s.point.y, 0.0) / n)
}

/// A projection changed by small parameters: rotation about the camera's axes (3 values, rad), translation (3 values, m),
/// then the change of the logarithm of the focal length and of k1; for a homography its first eight numbers.
fn perturbed(projection: &Projection, by: &[f64]) -> Projection {
    match projection {
        Projection::Space { lens, pose } => {
            let small = Rotation3::new(Vector3::new(by[0], by[1], by[2]));
            let rotation = small.matrix() * pose.rotation();
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

/// The step of numerical derivatives: truncation and rounding errors are both far below a pixel.
const SMALL: f64 = 1e-6;
/// Largest number of steps.
const MOST_STEPS: usize = 100;
/// Relative decrease of the sum of squares below which the fit has converged.
const CONVERGED: f64 = 1e-13;
/// Damping at which no step decreases the sum of squares any more.
const MOST_DAMPING: f64 = 1e12;

/// The reprojection errors in standard deviations: x and y of each pixel.  `None` for a point behind the camera.
fn residuals(projection: &Projection, correspondences: &[Correspondence]) -> Option<DVector<f64>> {
    let mut out = DVector::zeros(2 * correspondences.len());
    for (k, s) in correspondences.iter().enumerate() {
        let pixel = projection.pixel(s.point, 0.0)?;
        out[2 * k] = (s.pixel.x - pixel.x) / s.std_px;
        out[2 * k + 1] = (s.pixel.y - pixel.y) / s.std_px;
    }
    Some(out)
}

/// The derivatives of the pixels by the parameters, one column per parameter.
fn jacobian(
    projection: &Projection,
    correspondences: &[Correspondence],
    parameters: usize,
) -> Option<DMatrix<f64>> {
    let mut out = DMatrix::zeros(2 * correspondences.len(), parameters);
    for k in 0..parameters {
        let mut by = vec![0.0; parameters];
        by[k] = SMALL;
        let up = residuals(&perturbed(projection, &by), correspondences)?;
        by[k] = -SMALL;
        let down = residuals(&perturbed(projection, &by), correspondences)?;
        out.set_column(k, &((down - up) / (2.0 * SMALL)));
    }
    Some(out)
}

/// Least squares from `start` on (Levenberg-Marquardt).
fn levenberg_marquardt(
    start: Projection,
    correspondences: &[Correspondence],
    parameters: usize,
) -> Option<PoseFit> {
    let mut best = start;
    let mut residual = residuals(&best, correspondences)?;
    let mut damping = 1e-3;
    for _ in 0..MOST_STEPS {
        let slope = jacobian(&best, correspondences, parameters)?;
        let normal = slope.tr_mul(&slope);
        let down = slope.tr_mul(&residual);
        let before = residual.norm_squared();
        while damping < MOST_DAMPING {
            let mut damped = normal.clone();
            for k in 0..parameters {
                damped[(k, k)] += damping * normal[(k, k)] + f64::MIN_POSITIVE;
            }
            let tried = damped.cholesky().and_then(|c| {
                let next = perturbed(&best, c.solve(&down).as_slice());
                residuals(&next, correspondences).map(|r| (next, r))
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
        if damping >= MOST_DAMPING || before - residual.norm_squared() <= CONVERGED * before {
            break;
        }
    }
    let freedom = (2 * correspondences.len()).saturating_sub(parameters).max(1) as f64;
    let chi2 = residual.norm_squared();
    // Residuals larger than the pixels' standard deviations scale the covariance.
    let variance = (chi2 / freedom).max(1.0);
    let covariance = inverse(jacobian(&best, correspondences, parameters)?) * variance;
    Some(PoseFit { projection: best, chi2, covariance })
}

/// The inverse of the normal matrix of these derivatives; infinite where the pixels do not determine the parameters.
fn inverse(slope: DMatrix<f64>) -> DMatrix<f64> {
    let n = slope.ncols();
    let sizes: Vec<f64> = slope.column_iter().map(|column| column.norm()).collect();
    let mut scaled = slope;
    for (mut column, size) in scaled.column_iter_mut().zip(&sizes) {
        column /= *size;
    }
    let cholesky = scaled.tr_mul(&scaled).cholesky();
    let regular = cholesky.map(|c| c.inverse()).filter(|inverse| inverse.iter().all(|v| v.is_finite()));
    let inverse = regular.unwrap_or_else(|| DMatrix::from_diagonal_element(n, n, f64::INFINITY));
    DMatrix::from_fn(n, n, |i, k| inverse[(i, k)] / (sizes[i] * sizes[k]))
}

/// One standard deviation per axis of the point at a height that a pixel maps to (m), by the covariance of the parameters of [`perturbed`]; not finite where
/// the correspondences do not determine it.
pub(super) fn position_std_m(
    projection: &Projection,
    covariance: &DMatrix<f64>,
    point: Point,
    height_m: f64,
) -> f64 {
    let pixel = projection.pixel(point, height_m);
    let n = covariance.nrows();
    let mut slope = DMatrix::zeros(2, n);
    for k in 0..n {
        let mut by = vec![0.0; n];
        let mut moved = |step: f64| {
            by[k] = step;
            pixel.and_then(|pixel| perturbed(projection, &by).table_point(pixel, height_m))
        };
        let (Some(up), Some(down)) = (moved(SMALL), moved(-SMALL)) else { return f64::INFINITY };
        let change = (up - down) / (2.0 * SMALL);
        (slope[(0, k)], slope[(1, k)]) = (change.x, change.y);
    }
    let covariance = &slope * covariance * slope.transpose();
    (covariance.trace() / 2.0).sqrt()
}

impl Camera {
    /// One standard deviation, along each axis, of a position `height_m` above the table by the error of the pose (m); all positions near it have this error
    /// in common.  `None` if the error is unknown.
    pub fn pose_std_m(&self, point: Point, height_m: f64) -> Option<f64> {
        let covariance = self.pose_covariance.as_ref()?;
        let std_m = position_std_m(&self.projection, covariance, point, height_m - self.tag_thickness_m);
        Some(std_m).filter(|std_m| std_m.is_finite())
    }
}

impl PoseFit {
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
    use crate::cell::Transform;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64Mcg;

    const SIZE: [usize; 2] = [1280, 720];

    fn grid() -> impl Iterator<Item = Point> {
        (0..20).map(|k| Point::new(f64::from(k % 5) * 0.15 - 0.3, f64::from(k / 5) * 0.1 - 0.15))
    }

    fn correspondences(camera: &Camera) -> Vec<Correspondence> {
        let exact =
            |point| Correspondence { point, pixel: camera.pixel_from_table(point, 0.0), std_px: 0.02 };
        grid().map(exact).collect()
    }

    fn tilted(roll_rad: f64, yaw_rad: f64, distortion: [f64; 5]) -> Camera {
        let lens = Lens::new([1400.0, 1395.0], [650.0, 350.0], distortion);
        let back_m = 1.2 * roll_rad.sin();
        let position_m = [0.02 + back_m * yaw_rad.sin(), -back_m * yaw_rad.cos(), 1.2 * roll_rad.cos()];
        Camera::new(SIZE, lens, Transform { position_m, rpy_rad: [roll_rad, 0.02, yaw_rad] })
    }

    #[test]
    fn the_pose_of_a_known_lens_is_found_for_any_tilt_and_rotation() {
        for (roll_rad, yaw_rad) in [(0.0, 0.0), (0.3, 1.0), (0.9, 3.1), (-0.7, -2.0)] {
            let truth = tilted(roll_rad, yaw_rad, [-0.1, 0.02, 0.001, -0.001, 0.0]);
            let lens = truth.lens().expect("has one").clone();
            let fit = pose(&lens, &correspondences(&truth), FreeParameters::Pose).expect("20 points");
            let found = Camera::with_projection(SIZE, fit.projection);
            for point in grid() {
                let raised = found.table_from_pixel(truth.pixel_from_table(point, 0.1), 0.1);
                assert!(raised.distance(point) < 1e-8, "{} m off at tilt {roll_rad}", raised.distance(point));
            }
        }
    }

    #[test]
    fn a_tilted_view_determines_the_focal_length_and_a_perpendicular_one_does_not() {
        let fit_of = |truth: &Camera| {
            let guess = Lens::new([1000.0; 2], [650.0, 350.0], [0.0; 5]);
            pose(&guess, &correspondences(truth), FreeParameters::PoseAndFocal).expect("20 points")
        };
        let mut truth = tilted(0.5, 0.2, [0.0; 5]);
        truth.projection = match truth.projection {
            Projection::Space { pose, .. } => {
                Projection::Space { lens: Lens::new([1400.0; 2], [650.0, 350.0], [0.0; 5]), pose }
            }
            plane @ Projection::Plane { .. } => plane,
        };
        let fit = fit_of(&truth);
        let focal_px =
            Camera::with_projection(SIZE, fit.projection.clone()).lens().expect("has one").focal_px()[0];
        assert!((focal_px - 1400.0).abs() < 1e-3, "{focal_px} px");
        assert!(fit.focal_std().expect("was unknown") < 1e-3);
        let flat = fit_of(&tilted(0.0, 0.2, [0.0; 5])).focal_std().expect("was unknown");
        assert!(flat > 0.01, "straight down the focal length is known to {flat}");
    }

    #[test]
    fn a_homography_is_fitted_without_a_lens() {
        let truth = tilted(0.4, 0.3, [0.0; 5]);
        let clicks: Vec<_> =
            correspondences(&truth).into_iter().map(|s| Correspondence { std_px: 0.5, ..s }).collect();
        let fit = plane(&clicks).expect("20 points");
        assert!(fit.chi2 < 1e-12, "{}", fit.chi2);
        let std_m = position_std_m(&fit.projection, &fit.covariance, Point::new(0.1, 0.1), 0.0);
        assert!(std_m > 1e-5 && std_m < 1e-3, "{std_m} m for clicks of half a pixel");
    }

    #[test]
    fn the_stated_error_of_a_raised_point_is_that_of_poses_from_noisy_corners() {
        const NOISE_PX: f64 = 0.1;
        const HEIGHT_M: f64 = 0.05;
        const POSES: usize = 300;
        let truth = tilted(0.2, 0.3, [0.0; 5]);
        let lens = truth.lens().expect("has one").clone();
        let point = Point::new(0.1, -0.05);
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let (mut squares_m2, mut stated_m2) = (0.0, 0.0);
        for _ in 0..POSES {
            let noisy: Vec<_> = correspondences(&truth)
                .into_iter()
                .map(|s| {
                    let [x, y] = [0, 1].map(|_| NOISE_PX * random.sample::<f64, _>(StandardNormal));
                    Correspondence { pixel: Pixel::new(s.pixel.x + x, s.pixel.y + y), ..s }
                })
                .collect();
            let fit = pose(&lens, &noisy, FreeParameters::Pose).expect("20 points");
            let std_m = position_std_m(&fit.projection, &fit.covariance, point, HEIGHT_M);
            let found = Camera::with_projection(SIZE, fit.projection);
            let off_m =
                found.table_from_pixel(truth.pixel_from_table(point, HEIGHT_M), HEIGHT_M).distance(point);
            squares_m2 += off_m * off_m / 2.0;
            stated_m2 += std_m * std_m;
        }
        let ratio = (squares_m2 / stated_m2).sqrt();
        println!("{:.1} um off, {ratio:.2} standard deviations", 1e6 * (squares_m2 / POSES as f64).sqrt());
        assert!((ratio - 1.0).abs() < 0.1, "{ratio} standard deviations");
    }

    #[test]
    fn points_on_a_line_give_no_homography() {
        let line: Vec<_> =
            (0..6).map(f64::from).map(|t| (Point::new(t, 2.0 * t), Pixel::new(3.0 * t, t))).collect();
        assert!(Homography::fitted(&line).is_none());
    }
}
