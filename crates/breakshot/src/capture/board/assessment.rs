//! What the fit is worth: errors of the parameters, coverage of the picture, the effect on a table, and what the film lacks.

use super::bundle::{Fit, FittedView, neighbours, parameters, pixel};
use super::covariance::LensCovariance;
use super::{LensCalibration, LensParameter, Residual};
use crate::capture::lens::Lens;
use crate::error::{Error, Result};
use crate::geometry::Pixel;
use crate::uncertain::student_t_95;
use nalgebra::{DMatrix, Matrix6, Vector6};
use std::fmt::Write;

/// Number of fields of the picture, in which corners are counted.
const FIELDS: [usize; 2] = [8, 6];
/// Number of pixels per axis at which the error on a table is evaluated.
const EVALUATED: [usize; 2] = [9, 7];
/// Error of the focal length (of itself) above which there is a warning: as 1 mm in 300 mm of an object's height.
const INACCURATE_FOCAL: f64 = 0.003;
/// ... and above which the film does not determine it: the pose from tags alone gives a focal length as good.
const UNKNOWN_FOCAL: f64 = 0.03;
/// Coverage below which there is a warning.
const LEAST_COVERAGE: f64 = 0.6;
/// Largest tilt below which there is a warning (rad): focal length and distance change a board parallel to the picture alike.
const LEAST_TILT_RAD: f64 = 0.3;
/// Number of views below which there is a warning: their spread, from which the errors come, is itself uncertain by a fifth.
const FEW_VIEWS: usize = 15;
/// Fraction of outliers above which there is a warning.
const MANY_OUTLIERS: f64 = 0.1;

/// The result of the fit.
pub(super) fn calibration(
    film: String,
    size_px: [usize; 2],
    frames_with_board: usize,
    fit: Fit,
    covariance: &LensCovariance,
) -> Result<LensCalibration> {
    fit.lens.check(&film, size_px)?;
    let residuals: Vec<Residual> =
        fit.views.iter().enumerate().flat_map(|(k, view)| residuals(&fit.lens, k, view)).collect();
    let used: Vec<&Residual> = residuals.iter().filter(|residual| !residual.is_outlier).collect();
    let squares: f64 = used.iter().map(|r| r.measured.distance_px(r.predicted).powi(2)).sum();
    let cosines = fit.views.iter().map(|view| view.pose.rotation()[(2, 2)].abs().min(1.0));
    let mut calibration = LensCalibration {
        version: 1,
        film,
        image_size_px: size_px,
        model: fit.lens.distortion().model(),
        parameters: lens_parameters(&fit, covariance),
        reprojection_rms_px: (squares / (2.0 * used.len().max(1) as f64)).sqrt(),
        frames_with_board,
        frames: fit.views.len(),
        corners: used.len(),
        outliers: residuals.len() - used.len(),
        coverage: fields(size_px, &residuals).iter().filter(|count| **count > 0).count() as f64
            / (FIELDS[0] * FIELDS[1]) as f64,
        largest_tilt_rad: cosines.fold(1.0, f64::min).acos(),
        table_std_m_per_m: table_std(&fit.lens, size_px, &covariance.matrix).unwrap_or(f64::INFINITY),
        warnings: Vec::new(),
        lens: fit.lens,
        residuals,
    };
    calibration.refuse_unknown_focal_length()?;
    calibration.warnings = calibration.lacking();
    Ok(calibration)
}

fn residuals<'a>(lens: &'a Lens, index: usize, view: &'a FittedView) -> impl Iterator<Item = Residual> + 'a {
    view.corners.iter().zip(&view.weights).filter_map(move |(corner, weight)| {
        let predicted = pixel(lens, &view.pose, corner.point)?;
        Some(Residual {
            view: index,
            point: corner.point,
            measured: corner.pixel,
            predicted,
            is_outlier: *weight == 0.0,
        })
    })
}

fn lens_parameters(fit: &Fit, covariance: &LensCovariance) -> Vec<LensParameter> {
    let names = ["fx", "fy", "cx", "cy"]
        .into_iter()
        .chain(fit.lens.distortion().model().coefficient_names().iter().copied());
    let quantile = student_t_95(covariance.freedom);
    let parameter = |(k, (name, value)): (usize, (&'static str, f64))| {
        let standard_error = covariance.matrix[(k, k)].sqrt();
        let half = quantile * standard_error;
        LensParameter { name, value, standard_error, interval_95: [value - half, value + half] }
    };
    names.zip(parameters(&fit.lens)).enumerate().map(parameter).collect()
}

/// The number of corners in each field of the picture, row by row.
pub(super) fn fields(size_px: [usize; 2], residuals: &[Residual]) -> Vec<usize> {
    let mut counts = vec![0; FIELDS[0] * FIELDS[1]];
    let index = |value: f64, axis: usize| {
        let field = (value + 0.5) / size_px[axis] as f64 * FIELDS[axis] as f64;
        (field >= 0.0 && field < FIELDS[axis] as f64).then_some(field as usize)
    };
    for residual in residuals.iter().filter(|residual| !residual.is_outlier) {
        if let (Some(column), Some(row)) = (index(residual.measured.x, 0), index(residual.measured.y, 1)) {
            counts[row * FIELDS[0] + column] += 1;
        }
    }
    counts
}

/// Number of fields per axis.
pub(super) fn field_counts() -> [usize; 2] {
    FIELDS
}

/// See [`LensCalibration::table_std_m_per_m`]: of the errors of rays that the covariance allows, those that another pose of a
/// camera above a table would cause are left out.
fn table_std(lens: &Lens, size_px: [usize; 2], covariance: &DMatrix<f64>) -> Option<f64> {
    let n = covariance.nrows();
    let around: Vec<_> = (0..n).map(|k| neighbours(lens, k)).collect::<Option<_>>()?;
    let mut rows: Vec<(Vec<f64>, Vector6<f64>)> = Vec::new();
    let [columns, lines] = EVALUATED;
    for k in 0..columns * lines {
        let at = |k: usize, count: usize, size: usize| k as f64 / (count - 1) as f64 * (size as f64 - 1.0);
        let pixel = Pixel::new(at(k % columns, columns, size_px[0]), at(k / columns, lines, size_px[1]));
        let Some([x, y]) = lens.ray_from_pixel(pixel) else { continue };
        let slopes: Option<Vec<[f64; 2]>> = around
            .iter()
            .map(|([up, down], step)| {
                let (up, down) = (up.ray_from_pixel(pixel)?, down.ray_from_pixel(pixel)?);
                Some([(up[0] - down[0]) / (2.0 * step), (up[1] - down[1]) / (2.0 * step)])
            })
            .collect();
        let Some(slopes) = slopes else { continue };
        // Moves along and turns about the camera's axes, at a distance of 1.
        let by_pose = [
            Vector6::new(1.0, 0.0, x, -y, x * y, 1.0 + x * x),
            Vector6::new(0.0, 1.0, y, x, 1.0 + y * y, x * y),
        ];
        for axis in 0..2 {
            rows.push((slopes.iter().map(|slope| slope[axis]).collect(), by_pose[axis]));
        }
    }
    let by_lens = DMatrix::from_fn(rows.len(), n, |i, k| rows[i].0[k]);
    let by_pose = DMatrix::from_fn(rows.len(), 6, |i, k| rows[i].1[k]);
    let normal = Matrix6::from_iterator(by_pose.tr_mul(&by_pose).iter().copied()).try_inverse()?;
    let left = &by_lens - &by_pose * (normal * by_pose.tr_mul(&by_lens));
    let variance = (&left * covariance * left.transpose()).trace() / rows.len() as f64;
    Some(variance.max(0.0).sqrt())
}

impl LensCalibration {
    /// The larger relative error of the focal lengths.
    fn focal_error(&self) -> f64 {
        self.parameters[..2].iter().map(|focal| focal.standard_error / focal.value).fold(0.0, f64::max)
    }

    fn refuse_unknown_focal_length(&self) -> Result<()> {
        let error = self.focal_error();
        if error <= UNKNOWN_FOCAL {
            return Ok(());
        }
        let focal = &self.parameters[0];
        let found = format!(
            "a focal length of {:.0} +- {:.0} px from {} views, tilted by up to {:.0} degrees",
            focal.value,
            focal.standard_error,
            self.frames,
            self.largest_tilt_rad.to_degrees()
        );
        let needed = "views from near, in which the board is tilted to all sides by 20 to 40 degrees".into();
        Err(Error::Camera { name: self.film.clone(), found, needed })
    }

    /// What the film lacks, each with what to film.
    fn lacking(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let focal_error = self.focal_error();
        if focal_error > INACCURATE_FOCAL {
            let percent = focal_error * 100.0;
            warnings.push(format!(
                "the focal length is uncertain by {percent:.2} %: film more views from near, tilted to all sides"
            ));
        }
        if self.largest_tilt_rad < LEAST_TILT_RAD {
            let degrees = self.largest_tilt_rad.to_degrees();
            warnings.push(format!(
                "the board is tilted by {degrees:.0} degrees at most: tilt it to all sides by 20 to 40 degrees"
            ));
        }
        if self.coverage < LEAST_COVERAGE {
            let percent = self.coverage * 100.0;
            let mut text = format!("the board covers {percent:.0} % of the picture");
            let missing = self.missing_corners();
            if !missing.is_empty() {
                let _ = write!(text, " and not its {} corner", missing.join(", "));
            }
            warnings.push(
                text + ": move it into the corners and along the borders, where the lens distorts most",
            );
        }
        if self.frames < FEW_VIEWS {
            let count = self.frames;
            warnings
                .push(format!("only {count} different views: move the board about for ten seconds or more"));
        }
        if self.outliers as f64 > MANY_OUTLIERS * (self.corners + self.outliers) as f64 {
            let percent = 100.0 * self.outliers as f64 / (self.corners + self.outliers) as f64;
            warnings.push(format!(
                "{percent:.0} % of the corners do not fit: is the board flat and printed to scale, and the film sharp?"
            ));
        }
        warnings
    }

    /// The corners of the picture in whose quarter (of each axis) no corner of a tag was measured.
    fn missing_corners(&self) -> Vec<&'static str> {
        let counts = fields(self.image_size_px, &self.residuals);
        let [columns, rows] = FIELDS;
        let empty = |right: usize, low: usize| {
            (0..2).flat_map(|row| (0..2).map(move |column| (row, column))).all(|(row, column)| {
                let row = if low == 1 { rows - 1 - row } else { row };
                let column = if right == 1 { columns - 1 - column } else { column };
                counts[row * columns + column] == 0
            })
        };
        [("upper left", 0, 0), ("upper right", 1, 0), ("lower left", 0, 1), ("lower right", 1, 1)]
            .into_iter()
            .filter(|(_, right, low)| empty(*right, *low))
            .map(|(name, ..)| name)
            .collect()
    }
}
