//! Files of one camera with a camera matrix: ROS's `CameraInfo`, as a calibration file and as a printed message, and what
//! OpenCV stores.

use super::sensor_calibration::SensorCalibration;
use super::{NEEDED, find, numbers, size_px};
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

/// The calibration in a file's keys.
///
/// # Errors
/// A key that is missing or holds something else than numbers, an omnidirectional camera.
pub(super) fn calibration(
    path: &Path,
    map: &Map<String, Value>,
    given_size_px: Option<[u32; 2]>,
) -> Result<SensorCalibration> {
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
    let matrix = numbers(&name, "camera_matrix", matrix)?;
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
    let of_roi = |key: &str| map.get("roi").and_then(|roi| roi.get(key));
    Ok(SensorCalibration {
        size_px,
        matrix,
        model: model(map),
        coefficients: coefficients(&name, map)?,
        // `K` and `D` are the names of the arguments of both of OpenCV's calibrations.
        is_ambiguous: find(map, &COEFFICIENTS[..4]).is_none(),
        binning: [
            whole(&name, "binning_x", map.get("binning_x"))?,
            whole(&name, "binning_y", map.get("binning_y"))?,
        ],
        roi_offset_px: [
            whole(&name, "roi.x_offset", of_roi("x_offset"))?,
            whole(&name, "roi.y_offset", of_roi("y_offset"))?,
        ],
        roi_size_px: [
            whole(&name, "roi.width", of_roi("width"))?,
            whole(&name, "roi.height", of_roi("height"))?,
        ],
    })
}

/// A number of pixels; 0 for a key that is missing.
fn whole(name: &str, what: &str, value: Option<&Value>) -> Result<u32> {
    match value.map_or(Some(0.0), Value::as_f64) {
        Some(v) if v.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&v) => Ok(v as u32),
        _ => {
            let found = value.map(|v| v.to_string().chars().take(40).collect::<String>()).unwrap_or_default();
            Err(Error::invalid(name, what, found, "a whole number of px, not negative"))
        }
    }
}

/// The name of the distortion model; empty if the file has none.
fn model(map: &Map<String, Value>) -> String {
    let given = find(map, &MODEL).map(|model| model.as_str().unwrap_or("?")).unwrap_or_default();
    let fisheye = find(map, &["fisheye_model"]).and_then(Value::as_f64).is_some_and(|flag| flag != 0.0);
    if given.is_empty() && fisheye { "fisheye".into() } else { given.into() }
}

fn coefficients(name: &str, map: &Map<String, Value>) -> Result<Vec<f64>> {
    match find(map, &COEFFICIENTS) {
        Some(value) => numbers(name, "distortion_coefficients", value),
        None if find(map, &MODEL).is_none() => {
            let needed = "distortion_coefficients (zeros, or an empty list, for a lens without distortion)";
            Err(Error::invalid(name, "distortion_coefficients", "missing", needed))
        }
        None => Ok(Vec::new()),
    }
}
