//! One camera as a calibration has it, and the intrinsics of the image that it delivers: the one conversion for files and messages.

use crate::cell::{Distortion, DistortionModel, Intrinsics};
use crate::error::{Error, Result};

/// Largest number of pixels that a camera adds up along an axis.
const MOST_BINNED: u32 = 64;

/// A camera matrix with its distortion, both of the whole sensor, and the part of the sensor that is delivered; unchecked.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SensorCalibration {
    /// Width and height of the sensor's image (px).
    pub size_px: [u32; 2],
    /// The camera matrix, row by row (px).
    pub matrix: Vec<f64>,
    /// The distortion model by the name that ROS gives it; empty if it has none.
    pub model: String,
    /// The coefficients of the model, in OpenCV's order.
    pub coefficients: Vec<f64>,
    /// Whether four coefficients without the name of their model belong to one of two models: `D` is their name in both of
    /// OpenCV's calibrations.
    pub is_ambiguous: bool,
    /// Number of pixels that are added up along each axis; 0 stands for 1.
    pub binning: [u32; 2],
    /// Left column and top row of the region of interest on the sensor (px)...
    pub roi_offset_px: [u32; 2],
    /// ... and its size (px); zeros for the whole sensor.
    pub roi_size_px: [u32; 2],
}

impl SensorCalibration {
    /// Whether the camera matrix is anything but zeros, with which a driver without a calibration fills it.
    pub(crate) fn is_calibrated(&self) -> bool {
        self.matrix.iter().any(|&v| v != 0.0)
    }

    /// The intrinsics of the delivered image: of the whole sensor, then cropped to the region of interest, then binned. `name` is the
    /// owner in messages.
    ///
    /// # Errors
    /// An impossible camera matrix, a model that is not supported, a region outside the sensor.
    pub(crate) fn intrinsics(&self, name: &str) -> Result<Intrinsics> {
        let ([fx, fy], [cx, cy]) = self.focal_and_center(name)?;
        let distortion = self.distortion(name)?;
        let (x, y) = (self.delivered(name, 0)?, self.delivered(name, 1)?);
        Ok(Intrinsics {
            image_size_px: [x.length_px, y.length_px],
            focal_px: [fx / x.binning, fy / y.binning],
            center_px: [x.coordinate_px(cx), y.coordinate_px(cy)],
            distortion,
        })
    }

    fn focal_and_center(&self, name: &str) -> Result<([f64; 2], [f64; 2])> {
        let matrix: [f64; 9] = self.matrix.as_slice().try_into().map_err(|_| {
            let found = format!("{} numbers", self.matrix.len());
            Error::invalid(name, "camera_matrix.data", found, "9 numbers")
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

    /// The distortion; an error that names the given model where it is not supported.
    fn distortion(&self, name: &str) -> Result<Distortion> {
        let coefficients = &self.coefficients;
        let model = match (self.model.as_str(), coefficients.len()) {
            ("equidistant" | "fisheye" | "kannala_brandt", _) => DistortionModel::Equidistant,
            ("", 4) if self.is_ambiguous && coefficients.iter().any(|&k| k != 0.0) => {
                let found = format!("not given beside {coefficients:?}");
                let needed = "distortion_model: plumb_bob (k1 k2 p1 p2) or equidistant (k1 k2 k3 k4, OpenCV's fisheye)";
                return Err(Error::invalid(name, "distortion_model", found, needed));
            }
            ("plumb_bob", _) | ("", 0 | 4 | 5) => DistortionModel::PlumbBob,
            ("rational_polynomial", _) | ("", 8 | 12 | 14) => DistortionModel::RationalPolynomial,
            (given, count) => {
                let given: String = given.chars().take(LONGEST_NAME).collect();
                let found = format!("`{}` with {count} coefficients", given.escape_debug());
                let needed =
                    "`plumb_bob`, `rational_polynomial` or `equidistant`: calibrate with one of them";
                return Err(Error::invalid(name, "distortion_model", found, needed));
            }
        };
        let distortion = Distortion::new(model, coefficients).map_err(|needed| {
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

    /// What the region of interest and the binning deliver of the sensor along an axis.
    fn delivered(&self, name: &str, axis: usize) -> Result<Axis> {
        let [binning_key, offset_key, length_key] =
            [["binning_x", "roi.x_offset", "roi.width"], ["binning_y", "roi.y_offset", "roi.height"]][axis];
        let bounded = |what: &str, value: u32, most: u32| {
            let needed = || format!("a whole number from 0 to {most}");
            if value <= most {
                Ok(value)
            } else {
                Err(Error::invalid(name, what, value.to_string(), needed()))
            }
        };
        let sensor_px = self.size_px[axis];
        let binning = bounded(binning_key, self.binning[axis], MOST_BINNED)?.max(1);
        let offset_px = bounded(offset_key, self.roi_offset_px[axis], sensor_px)?;
        let mut length_px = bounded(length_key, self.roi_size_px[axis], sensor_px)?;
        if length_px == 0 && offset_px == 0 {
            length_px = sensor_px;
        }
        // Neither summand is larger than the sensor.
        let is_inside = u64::from(offset_px) + u64::from(length_px) <= u64::from(sensor_px);
        if length_px / binning < 1 || !is_inside {
            let found = format!("{length_px} from {offset_px} on, binned by {binning}");
            return Err(Error::invalid(
                name,
                length_key,
                found,
                format!("a part of the sensor's {sensor_px} px"),
            ));
        }
        Ok(Axis {
            offset_px: f64::from(offset_px),
            binning: f64::from(binning),
            length_px: length_px / binning,
        })
    }
}

/// Longest name of a model in a message (characters).
const LONGEST_NAME: usize = 60;

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
