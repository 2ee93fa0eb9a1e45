//! The intrinsics in calibration files: ROS's `CameraInfo`, OpenCV's storage files (YAML, XML, JSON), Kalibr's camchain.

mod kalibr;
mod matrix_file;
mod sensor_calibration;
mod text;

use crate::cell::Intrinsics;
use crate::error::{Error, Result};
use serde_json::{Map, Value};
use std::path::Path;

pub(crate) use sensor_calibration::SensorCalibration;

/// What is read.
const NEEDED: &str =
    "a ROS CameraInfo file, a calibration that OpenCV stored (YAML, XML or JSON), or a Kalibr camchain";

/// The intrinsics in the text of the file at `path`, which error messages name.
///
/// `camera` is one of the cameras of a Kalibr file; `given_size_px` is the size of the image where the file has none.
///
/// # Errors
/// None of the known files, an impossible camera matrix, a distortion model that is not supported.
pub(crate) fn parsed(
    path: &Path,
    text: impl AsRef<str>,
    camera: Option<&str>,
    given_size_px: Option<[u32; 2]>,
) -> Result<Intrinsics> {
    let name = path.display().to_string();
    let map = text::content(path, text.as_ref())?;
    if kalibr::is_camchain(&map) {
        return kalibr::intrinsics(&name, &map, camera);
    }
    if let Some(camera) = camera {
        let found = format!("`#{camera}` after the name of a file of one camera");
        return Err(Error::invalid(name, "camera", found, "the name alone, or a Kalibr camchain"));
    }
    matrix_file::calibration(path, &map, given_size_px)?.intrinsics(&name)
}

/// The first of these keys that the map has.
fn find<'m>(map: &'m Map<String, Value>, keys: &[&str]) -> Option<&'m Value> {
    keys.iter().find_map(|key| map.get(*key)).filter(|value| !value.is_null())
}

/// The numbers of a matrix (`data`), a list, or a list of rows; an error that names the key.
fn numbers(name: &str, key: &str, value: &Value) -> Result<Vec<f64>> {
    fn add(value: &Value, into: &mut Vec<f64>) -> Option<()> {
        match value {
            Value::Array(items) => items.iter().try_for_each(|item| add(item, into)),
            other => {
                into.push(other.as_f64()?);
                Some(())
            }
        }
    }
    let list = value.get("data").unwrap_or(value);
    let mut found = Vec::new();
    // An empty matrix has no data in OpenCV's XML.
    if list.as_str() == Some("") || add(list, &mut found).is_some() {
        return Ok(found);
    }
    let shown: String = list.to_string().chars().take(80).collect();
    Err(Error::invalid(name, key, shown, "numbers"))
}

/// A size (px) of positive whole numbers.
fn size_px(name: &str, what: &str, found: &[f64]) -> Result<[u32; 2]> {
    let whole = |v: f64| (v.fract() == 0.0 && (1.0..=f64::from(1 << 20)).contains(&v)).then_some(v as u32);
    match found {
        &[width, height] => whole(width).zip(whole(height)).map(|(width, height)| [width, height]),
        _ => None,
    }
    .ok_or_else(|| Error::invalid(name, what, format!("{found:?}"), "width and height, whole numbers of px"))
}

#[cfg(test)]
mod tests;
