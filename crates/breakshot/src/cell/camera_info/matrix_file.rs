//! Files of one camera with a camera matrix: ROS's `CameraInfo`, as a calibration file and as a printed message, and what
//! OpenCV stores.

use super::{NEEDED, find, numbers, size_px};
use crate::cell::{Distortion, DistortionModel, Intrinsics};
use crate::error::{Error, Result};
use serde_json::{Map, Value};
use std::path::Path;

const MATRIX: [&str; 4] = ["camera_matrix", "cameraMatrix", "K", "k"];
const COEFFICIENTS: [&str; 6] =
    ["distortion_coefficients", "distCoeffs", "dist_coeffs", "distortion_coeffs", "D", "d"];
const MODEL: [&str; 2] = ["distortion_model", "distortionModel"];
const WIDTH: [&str; 3] = ["image_width", "imageWidth", "width"];
const HEIGHT: [&str; 3] = ["image_height", "imageHeight", "height"];
const SIZE: [&str; 4] = ["image_size", "imageSize", "img_size", "size"];
/// Largest number of pixels that a camera adds up along an axis.
const MOST_BINNED: f64 = 64.0;

/// The intrinsics of the delivered image: of the whole sensor, then cropped to the region of interest, then binned.
///
/// # Errors
/// A key that is missing, an impossible camera matrix, a model that is not supported, a region outside the sensor.
pub(super) fn intrinsics(
    path: &Path,
    map: &Map<String, Value>,
    given_size_px: Option<[u32; 2]>,
) -> Result<Intrinsics> {
    let name = path.display().to_string();
    let missing = |what: &str| Error::Syntax {
        path: path.into(),
        problem: format!("missing {what}; needed: {NEEDED}"),
    };
    if find(map, &["xi"]).is_some() {
        let needed =
            "`plumb_bob`, `rational_polynomial` or `equidistant` (OpenCV's calibrateCamera or fisheye)";
        return Err(Error::invalid(name, "xi", "the omnidirectional model's", needed));
    }
    let matrix = find(map, &MATRIX).ok_or_else(|| missing("field `camera_matrix` (or cameraMatrix, K)"))?;
    let ([fx, fy], [cx, cy]) = focal_and_center(&name, &numbers(&name, "camera_matrix", matrix)?)?;
    let size_px = match (find(map, &WIDTH), find(map, &HEIGHT), find(map, &SIZE)) {
        (Some(width), Some(height), _) => {
            let found =
                [numbers(&name, "image_width", width)?, numbers(&name, "image_height", height)?].concat();
            size_px(&name, "image size", &found)?
        }
        (_, _, Some(size)) => size_px(&name, "image size", &numbers(&name, "image size", size)?)?,
        _ => given_size_px.ok_or_else(|| {
            missing("fields `image_width` and `image_height` (or image_size_px in the cell)")
        })?,
    };
    let distortion = distortion(&name, map)?;
    let [x, y] = [0, 1].map(|axis| delivered(&name, map, axis, size_px[axis]));
    let (x, y) = (x?, y?);
    Ok(Intrinsics {
        image_size_px: [x.length_px, y.length_px],
        focal_px: [fx / x.binning, fy / y.binning],
        center_px: [x.coordinate_px(cx), y.coordinate_px(cy)],
        distortion,
    })
}

fn focal_and_center(name: &str, found: &[f64]) -> Result<([f64; 2], [f64; 2])> {
    let matrix: [f64; 9] = found.try_into().map_err(|_| {
        Error::invalid(name, "camera_matrix.data", format!("{} numbers", found.len()), "9 numbers")
    })?;
    let [fx, skew, cx, a, fy, cy, b, c, one] = matrix;
    let finite = matrix.iter().all(|v| v.is_finite());
    if finite && fx > 0.0 && fy > 0.0 && skew == 0.0 && [a, b, c, one] == [0.0, 0.0, 0.0, 1.0] {
        return Ok(([fx, fy], [cx, cy]));
    }
    let found = if finite && skew != 0.0 { format!("skew {skew}, in ") } else { String::new() };
    let needed = "[fx, 0, cx, 0, fy, cy, 0, 0, 1] with positive focal lengths (a calibrated camera)";
    Err(Error::invalid(name, "camera_matrix.data", format!("{found}{matrix:?}"), needed))
}

/// One axis of the image that the camera delivers.
struct Axis {
    offset_px: f64,
    binning: f64,
    length_px: u32,
}

impl Axis {
    /// A coordinate on the whole sensor in the delivered image: a binned pixel is centred on those that it adds up.
    fn coordinate_px(&self, sensor_px: f64) -> f64 {
        if self.binning == 1.0 {
            return sensor_px - self.offset_px;
        }
        (sensor_px - self.offset_px + 0.5) / self.binning - 0.5
    }
}

/// What `roi` and `binning` of a `CameraInfo` deliver of a sensor so many pixels long; zeros stand for all of it.
fn delivered(name: &str, map: &Map<String, Value>, axis: usize, sensor_px: u32) -> Result<Axis> {
    let [binning, offset, length] =
        [["binning_x", "x_offset", "width"], ["binning_y", "y_offset", "height"]][axis];
    let whole = |what: &str, value: Option<&Value>, most: f64| match value.map_or(Some(0.0), Value::as_f64) {
        Some(v) if v.fract() == 0.0 && (0.0..=most).contains(&v) => Ok(v),
        _ => {
            let found = value.map(|v| v.to_string().chars().take(40).collect::<String>()).unwrap_or_default();
            Err(Error::invalid(name, what, found, format!("a whole number from 0 to {most}")))
        }
    };
    let of_roi = |key: &str| map.get("roi").and_then(|roi| roi.get(key));
    let sensor = f64::from(sensor_px);
    let binning = whole(binning, map.get(binning), MOST_BINNED)?.max(1.0);
    let offset_px = whole(&format!("roi.{offset}"), of_roi(offset), sensor)?;
    let mut length_px = whole(&format!("roi.{length}"), of_roi(length), sensor)?;
    if length_px == 0.0 && offset_px == 0.0 {
        length_px = sensor;
    }
    let binned_px = (length_px / binning).floor();
    if binned_px < 1.0 || offset_px + length_px > sensor {
        let found = format!("{length_px} from {offset_px} on, binned by {binning}");
        let needed = format!("a part of the sensor's {sensor_px} px");
        return Err(Error::invalid(name, format!("roi.{length}"), found, needed));
    }
    Ok(Axis { offset_px, binning, length_px: binned_px as u32 })
}

/// The distortion; an error that names the file's model where it is not supported.
fn distortion(name: &str, map: &Map<String, Value>) -> Result<Distortion> {
    let coefficients = match find(map, &COEFFICIENTS) {
        Some(value) => numbers(name, "distortion_coefficients", value)?,
        None if find(map, &MODEL).is_none() => {
            let needed = "distortion_coefficients (zeros, or an empty list, for a lens without distortion)";
            return Err(Error::invalid(name, "distortion_coefficients", "missing", needed));
        }
        None => Vec::new(),
    };
    let given = find(map, &MODEL).map(|model| model.as_str().unwrap_or("?").to_owned()).unwrap_or_default();
    let fisheye = find(map, &["fisheye_model"]).and_then(Value::as_f64).is_some_and(|flag| flag != 0.0);
    // OpenCV's own names; `K` and `D` are the names of the arguments of both of its calibrations.
    let named_by_letter = find(map, &COEFFICIENTS[..4]).is_none();
    let model = match (given.as_str(), coefficients.len()) {
        (given, _)
            if matches!(given, "equidistant" | "fisheye" | "kannala_brandt")
                || (given.is_empty() && fisheye) =>
        {
            DistortionModel::Equidistant
        }
        ("", 4) if named_by_letter && coefficients.iter().any(|&k| k != 0.0) => {
            let found = format!("not given beside {coefficients:?}");
            let needed =
                "distortion_model: plumb_bob (k1 k2 p1 p2) or equidistant (k1 k2 k3 k4, OpenCV's fisheye)";
            return Err(Error::invalid(name, "distortion_model", found, needed));
        }
        ("plumb_bob", _) | ("", 0 | 4 | 5) => DistortionModel::PlumbBob,
        ("rational_polynomial", _) | ("", 8 | 12 | 14) => DistortionModel::RationalPolynomial,
        _ => {
            let found = format!("`{given}` with {} coefficients", coefficients.len());
            let needed = "`plumb_bob`, `rational_polynomial` or `equidistant`: calibrate with one of them";
            return Err(Error::invalid(name, "distortion_model", found, needed));
        }
    };
    let distortion = Distortion::new(model, &coefficients).map_err(|needed| {
        let found = format!("`{}` with {coefficients:?}", model.name());
        Error::invalid(name, "distortion_model", found, needed)
    })?;
    Ok(match distortion {
        Distortion::RationalPolynomial([k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]) => {
            Distortion::PlumbBob([k1, k2, p1, p2, k3])
        }
        other => other,
    })
}
