//! The intrinsics in a ROS `CameraInfo` YAML file, which is also what OpenCV's calibration writes.

use crate::cell::Intrinsics;
use crate::error::{Error, Result};
use serde::Deserialize;
use std::path::Path;

/// The keys that hold the intrinsics; the file has more.
#[derive(Deserialize)]
struct CameraInfoFile {
    image_width: u32,
    image_height: u32,
    camera_matrix: Numbers,
    #[serde(default)]
    distortion_model: Option<String>,
    distortion_coefficients: Numbers,
}

#[derive(Deserialize)]
struct Numbers {
    data: Vec<f64>,
}

/// The intrinsics in the text of the file at `path`, which error messages name.
///
/// # Errors
/// Not a `CameraInfo` file, an impossible camera matrix, a distortion model other than `plumb_bob` (or one that
/// reduces to it).
pub(crate) fn parsed(path: &Path, text: impl AsRef<str>) -> Result<Intrinsics> {
    let file = yaml(path, text)?;
    let name = path.display().to_string();
    let matrix: [f64; 9] = file.camera_matrix.data.try_into().map_err(|data: Vec<f64>| {
        Error::invalid(&name, "camera_matrix.data", format!("{} numbers", data.len()), "9 numbers")
    })?;
    let [fx, skew, cx, _, fy, cy, ..] = matrix;
    let possible = matrix.iter().all(|v| v.is_finite()) && fx > 0.0 && fy > 0.0 && skew == 0.0;
    if !possible {
        let needed = "[fx, 0, cx, 0, fy, cy, 0, 0, 1] with positive focal lengths (a calibrated camera)";
        return Err(Error::invalid(name, "camera_matrix.data", format!("{matrix:?}"), needed));
    }
    Ok(Intrinsics {
        image_size_px: [file.image_width, file.image_height],
        focal_px: [fx, fy],
        center_px: [cx, cy],
        distortion: plumb_bob(&name, file.distortion_model, &file.distortion_coefficients.data)?,
    })
}

fn yaml(path: &Path, text: impl AsRef<str>) -> Result<CameraInfoFile> {
    let text = text.as_ref();
    // OpenCV starts its files with `%YAML:1.0`, which is no YAML directive.
    let yaml = if text.starts_with("%YAML:") { text.replacen('%', "#", 1) } else { text.into() };
    super::yaml::value(&yaml)
        .and_then(|value| serde_json::from_value(value).map_err(|e| e.to_string()))
        .map_err(|e| Error::Syntax {
            path: path.into(),
            problem: format!("{e}; needed: a ROS CameraInfo file"),
        })
}

/// k1 k2 p1 p2 k3; an error that names the file's model where it is another one.
fn plumb_bob(name: &str, model: Option<String>, data: &[f64]) -> Result<[f64; 5]> {
    let model = model.unwrap_or_else(|| "plumb_bob".into());
    let higher_terms = data.iter().skip(5).any(|&k| k != 0.0);
    let reducible = matches!(model.as_str(), "plumb_bob" | "rational_polynomial" | "");
    if !reducible || higher_terms || data.iter().any(|k| !k.is_finite()) {
        let found = format!("`{model}` with {data:?}");
        return Err(Error::invalid(name, "distortion_model", found, "`plumb_bob`: k1 k2 p1 p2 k3"));
    }
    // Missing coefficients are zero; a longer model that reduces to this one ends in zeros.
    let mut distortion = [0.0; 5];
    for (coefficient, value) in distortion.iter_mut().zip(data) {
        *coefficient = *value;
    }
    Ok(distortion)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{CameraInfo, CameraSpec};
    use std::path::PathBuf;

    fn read(yaml: &str) -> Result<Intrinsics> {
        parsed(Path::new("camera_info.yaml"), yaml)
    }

    const ROS: &str = "image_width: 640\nimage_height: 480\ncamera_name: head\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
        data: [600.5, 0, 320.25, 0, 601, 240.0, 0., 0., 1.]\ndistortion_model: MODEL\n\
        distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.1, -0.2, 0.001, 0.002, 0.0MORE]\n\
        rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n";

    #[test]
    fn a_ros_camera_info_file_gives_the_lens() {
        let intrinsics = read(&ROS.replace("MODEL", "plumb_bob").replace("MORE", "")).expect("a plumb bob");
        assert_eq!(intrinsics.image_size_px, [640, 480]);
        assert_eq!(intrinsics.focal_px, [600.5, 601.0]);
        assert_eq!(intrinsics.center_px, [320.25, 240.0]);
        assert_eq!(intrinsics.distortion, [0.1, -0.2, 0.001, 0.002, 0.0]);
        let opencv = ROS.replace("MODEL", "plumb_bob").replace("MORE", "");
        let opencv = format!("%YAML:1.0\n---\n{}", opencv.replace("matrix:\n", "matrix: !!opencv-matrix\n"));
        assert_eq!(read(&opencv).expect("OpenCV's own form"), intrinsics);
    }

    #[test]
    fn a_distortion_model_other_than_plumb_bob_is_an_error_that_names_it() {
        let zero = ROS.replace("MODEL", "rational_polynomial").replace("MORE", ", 0, 0, 0");
        assert_eq!(read(&zero).expect("reduces to plumb bob").distortion[4], 0.0);
        for (model, more) in [("rational_polynomial", ", 0.3, 0, 0"), ("equidistant", "")] {
            let message =
                read(&ROS.replace("MODEL", model).replace("MORE", more)).expect_err(model).to_string();
            assert!(message.contains(model) && message.contains("plumb_bob"), "{message}");
        }
        let message = read("image_width: 640\nimage_height: [").expect_err("broken").to_string();
        assert!(message.contains("CameraInfo"), "{message}");
    }

    #[test]
    fn a_cell_writes_its_camera_info_as_a_path_with_and_without_its_intrinsics() {
        let mut info = CameraInfo::from(PathBuf::from("lens/camera_info.yaml"));
        let text = serde_json::to_string(&info).expect("writes");
        assert_eq!(text, "\"lens/camera_info.yaml\"");
        info.intrinsics =
            Some(read(&ROS.replace("MODEL", "plumb_bob").replace("MORE", "")).expect("a plumb bob"));
        assert_eq!(serde_json::to_string(&info).expect("writes"), text);
        let spec = CameraSpec { camera_info: Some(info), ..CameraSpec::default() };
        let resolved = spec.resolved("cell.toml").expect("its intrinsics were read");
        assert_eq!((resolved.focal_px, resolved.camera_info), (Some([600.5, 601.0]), None), "fx and fy (px)");
        let unread: CameraInfo = serde_json::from_str(&text).expect("reads");
        let spec = CameraSpec { camera_info: Some(unread), ..CameraSpec::default() };
        let message = spec.resolved("cell.toml").expect_err("no intrinsics").to_string();
        assert!(message.contains("cell.toml") && message.contains("camera_info.yaml"), "{message}");
    }
}
