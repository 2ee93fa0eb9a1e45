//! Kalibr's `camchain.yaml`: one or several cameras.

use super::{find, numbers, size_px};
use crate::cell::{Distortion, DistortionModel, Intrinsics};
use crate::error::{Error, Result};
use serde_json::{Map, Value};

/// Whether a file is one: its keys are cameras that have a `camera_model`.
pub(super) fn is_camchain(map: &Map<String, Value>) -> bool {
    map.values().any(|camera| camera.get("camera_model").is_some())
}

/// The intrinsics of the file's only camera, or of the chosen one.
///
/// # Errors
/// Several cameras and none is chosen, a model other than a pinhole with radtan or equidistant distortion, impossible numbers.
pub(super) fn intrinsics(name: &str, map: &Map<String, Value>, chosen: Option<&str>) -> Result<Intrinsics> {
    let cameras: Vec<_> = map.iter().filter(|(_, camera)| camera.get("camera_model").is_some()).collect();
    let names: Vec<_> = cameras.iter().map(|(camera, _)| camera.as_str()).collect();
    let camera = match (chosen, cameras.as_slice()) {
        (Some(chosen), all) => all.iter().find(|(camera, _)| camera.as_str() == chosen),
        (None, [only]) => Some(only),
        (None, _) => None,
    };
    let Some((id, Value::Object(camera))) = camera else {
        let found = match chosen {
            Some(chosen) => format!("`{chosen}`, which is not in the file"),
            None => format!("{} cameras, none of them chosen", names.len()),
        };
        let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
        let needed = format!("one of {}, as in camera_info = \"{file}#{}\"", names.join(", "), names[0]);
        return Err(Error::invalid(name, "camera", found, needed));
    };
    let owner = format!("{name}: {id}");
    let required = |key: &str| {
        find(camera, &[key])
            .ok_or_else(|| Error::invalid(&owner, key, "missing", "a key of Kalibr's camchain"))
    };
    let text = |key: &str| required(key).map(|value| value.as_str().unwrap_or_default().to_owned());
    let projection = text("camera_model")?;
    if projection != "pinhole" {
        let needed = "`pinhole` (calibrate with --models pinhole-radtan or pinhole-equi)";
        return Err(Error::invalid(owner, "camera_model", format!("`{projection}`"), needed));
    }
    let found = numbers(&owner, "intrinsics", required("intrinsics")?)?;
    let [fx, fy, cx, cy] = match found.as_slice() {
        &[fx, fy, cx, cy] if fx > 0.0 && fy > 0.0 && found.iter().all(|v| v.is_finite()) => [fx, fy, cx, cy],
        _ => {
            let needed = "[fx, fy, cx, cy] with positive focal lengths";
            return Err(Error::invalid(owner, "intrinsics", format!("{found:?}"), needed));
        }
    };
    let resolution = numbers(&owner, "resolution", required("resolution")?)?;
    Ok(Intrinsics {
        image_size_px: size_px(&owner, "resolution", &resolution)?,
        focal_px: [fx, fy],
        center_px: [cx, cy],
        distortion: distortion(&owner, &text("distortion_model")?, camera)?,
    })
}

fn distortion(owner: &str, kalibr_model: &str, camera: &Map<String, Value>) -> Result<Distortion> {
    let coefficients = match find(camera, &["distortion_coeffs"]) {
        Some(value) => numbers(owner, "distortion_coeffs", value)?,
        None => Vec::new(),
    };
    let model = match (kalibr_model, coefficients.len()) {
        ("none", _) => return Ok(Distortion::default()),
        ("radtan", 4) => DistortionModel::PlumbBob,
        ("equidistant", 4) => DistortionModel::Equidistant,
        ("radtan" | "equidistant", _) => {
            return Err(Error::invalid(
                owner,
                "distortion_coeffs",
                format!("{coefficients:?}"),
                "four numbers",
            ));
        }
        (other, _) => {
            let needed = "`radtan` or `equidistant` (calibrate with --models pinhole-radtan or pinhole-equi)";
            return Err(Error::invalid(owner, "distortion_model", format!("`{other}`"), needed));
        }
    };
    Distortion::new(model, &coefficients)
        .map_err(|needed| Error::invalid(owner, "distortion_coeffs", format!("{coefficients:?}"), needed))
}
