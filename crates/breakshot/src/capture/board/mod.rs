//! Which lens took this film of a calibration board?
//!
//! The board's tags are detected frame by frame ([`views`]), varied frames are selected, the focal length starts from Zhang's
//! closed form ([`start`]), and intrinsics, distortion and the board's poses are fitted together ([`bundle`]). With the lens
//! that was found the tags of the selected frames are measured again, their sides no longer curved, and fitted again.

mod assessment;
mod bundle;
mod covariance;
mod drawing;
mod start;
mod views;

use super::footage::Footage;
use super::lens::Lens;
use crate::cell::{Board, DistortionModel};
use crate::error::{Error, Result};
use crate::geometry::{Pixel, Point};
use serde::Serialize;

/// A calibrated lens with the errors of its parameters, and how well the film determines it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LensCalibration {
    /// The file format's version.
    pub version: u32,
    /// The film.
    pub film: String,
    /// Width and height of the picture (px).
    pub image_size_px: [usize; 2],
    /// The distortion model.
    pub model: DistortionModel,
    /// Focal lengths fx and fy and principal point cx and cy (px), then the coefficients of the distortion.
    pub parameters: Vec<LensParameter>,
    /// Root mean square of the distances between measured and predicted corners over the square root of two: the error of
    /// one coordinate (px).
    pub reprojection_rms_px: f64,
    /// Number of frames in which the board was measured.
    pub frames_with_board: usize,
    /// Number of frames that were fitted.
    pub frames: usize,
    /// Number of corners that were fitted.
    pub corners: usize,
    /// Number of corners that disagree with all others and do not count.
    pub outliers: usize,
    /// The fraction of the picture in which corners were measured.
    pub coverage: f64,
    /// The largest angle between the optical axis and the board's normal (rad).
    pub largest_tilt_rad: f64,
    /// One standard deviation of a position on a table (m) for each metre between camera and table that the lens's error causes,
    /// after the camera's pose has been fitted to the table: root mean square over the picture.
    pub table_std_m_per_m: f64,
    /// What the film lacks.
    pub warnings: Vec<String>,
    #[serde(skip)]
    lens: Lens,
    #[serde(skip)]
    residuals: Vec<Residual>,
}

/// A parameter of a lens.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LensParameter {
    /// fx fy cx cy, or the coefficient.
    pub name: &'static str,
    /// Its value (px, or without unit).
    pub value: f64,
    /// One standard deviation of its error.
    pub standard_error: f64,
    /// The interval that contains the true value with a probability of 95 %.
    pub interval_95: [f64; 2],
}

/// A corner of a tag in a fitted frame.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Residual {
    view: usize,
    point: Point,
    measured: Pixel,
    predicted: Pixel,
    is_outlier: bool,
}

/// The lens that took a film of a board that is moved about, or a set of pictures of it.
///
/// `open` opens the film: it is read twice, so that no frame has to be kept.
///
/// # Errors
/// A film that cannot be read, in which the board is not seen in five varied frames, or which does not determine the model.
pub fn lens_calibration(
    open: &dyn Fn() -> Result<Footage>,
    board: &Board,
    model: DistortionModel,
) -> Result<LensCalibration> {
    let footage = open()?;
    let (film, size_px) = (footage.name().to_owned(), footage.size_px());
    let (seen, frames_with_board) = views::varied(footage, board)?;
    let failure =
        |found: String, needed: &str| Error::Camera { name: film.clone(), found, needed: needed.into() };
    if seen.len() < views::LEAST_VIEWS {
        let found = format!("the board in {frames_with_board} frames, {} of them different", seen.len());
        let needed = "five or more different views of the board, better thirty: move and tilt it slowly, near and far, into \
                      all corners of the picture (is it the board of board.toml, sharp and well lit?)";
        return Err(failure(found, needed));
    }
    let count = seen.len();
    let unsolved = || {
        let needed =
            "views from near, tilted to all sides by 20 to 40 degrees; or a model with fewer coefficients";
        failure(format!("{count} views that do not determine a `{}` lens", model.name()), needed)
    };
    let first = start::lens(size_px, &seen, board, model)
        .and_then(|lens| bundle::fitted(&lens, views::observations(&seen, board)))
        .ok_or_else(unsolved)?;
    // The sides of a tag are straight only without distortion: measured again, now that it is known.
    let seen = views::measured_again(open()?, seen, &first.lens)?;
    let fit = bundle::fitted(&first.lens, views::observations(&seen, board))
        .filter(|fit| fit.views.len() >= views::LEAST_VIEWS)
        .ok_or_else(unsolved)?;
    let covariance = covariance::of_the_lens(&fit).ok_or_else(unsolved)?;
    assessment::calibration(film.clone(), size_px, frames_with_board, fit, &covariance)
}

impl LensCalibration {
    /// The lens.
    pub fn lens(&self) -> &Lens {
        &self.lens
    }

    /// The corners that were fitted, frame by frame: on the board (m) and in the picture.
    pub fn corners_by_view(&self) -> Vec<Vec<(Point, Pixel)>> {
        let mut views = vec![Vec::new(); self.frames];
        for residual in self.residuals.iter().filter(|residual| !residual.is_outlier) {
            views[residual.view].push((residual.point, residual.measured));
        }
        views
    }
}

#[cfg(test)]
mod tests;
