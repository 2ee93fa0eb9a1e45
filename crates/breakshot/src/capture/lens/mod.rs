//! The lens: the map between rays and pixels.
//!
//! A pinhole camera with a distortion model ([`model`]), in OpenCV's and ROS's conventions: a *ray* is the pair (x / z, y / z) of a
//! direction in the camera's frame (x right, y down, z forward), a pixel counts from the centre of the top left one.

mod model;

use crate::cell::{Distortion, DistortionModel};
use crate::error::{Error, Result};
use crate::geometry::Pixel;
use serde::{Deserialize, Serialize};

/// Focal lengths, principal point and distortion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "LensNumbers", into = "LensNumbers")]
pub struct Lens {
    focal_px: [f64; 2],
    center_px: [f64; 2],
    distortion: Distortion,
    /// The square of the longest ray up to which the distortion is one to one.
    max_ray_squared: f64,
}

/// The serialized form of a lens.
#[derive(Clone, Serialize, Deserialize)]
struct LensNumbers {
    focal_px: [f64; 2],
    center_px: [f64; 2],
    distortion: Vec<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    distortion_model: Option<DistortionModel>,
}

/// Distance between tested pixels of the border (px).
const BORDER_STEP_PX: usize = 16;

impl Lens {
    /// The lens with focal lengths fx and fy, principal point (cx, cy) and a distortion, in OpenCV's order of coefficients.
    pub fn new(focal_px: [f64; 2], center_px: [f64; 2], distortion: impl Into<Distortion>) -> Self {
        let distortion = distortion.into();
        let max_ray_squared = model::max_ray_squared(&distortion);
        Self { focal_px, center_px, distortion, max_ray_squared }
    }

    /// A lens without distortion and with square pixels, its principal point in the middle of the picture.
    pub fn pinhole(size_px: [usize; 2], focal_px: f64) -> Self {
        Self::new([focal_px; 2], middle_px(size_px), [0.0; 5])
    }

    /// Focal lengths fx and fy (px).
    pub fn focal_px(&self) -> [f64; 2] {
        self.focal_px
    }

    /// The principal point (px).
    pub fn center_px(&self) -> [f64; 2] {
        self.center_px
    }

    /// The distortion model and its coefficients.
    pub fn distortion(&self) -> Distortion {
        self.distortion
    }

    /// The same lens with its focal lengths multiplied and its first radial coefficient shifted.
    pub(super) fn changed(&self, focal_factor: f64, k1_more: f64) -> Self {
        let mut distortion = self.distortion;
        match &mut distortion {
            Distortion::PlumbBob([k1, ..])
            | Distortion::RationalPolynomial([k1, ..])
            | Distortion::Equidistant([k1, ..]) => *k1 += k1_more,
        }
        Self::new(self.focal_px.map(|f| f * focal_factor), self.center_px, distortion)
    }

    /// The pixel of a ray; `None` for a ray beyond which the distortion is not one to one.
    pub fn pixel_from_ray(&self, ray: [f64; 2]) -> Option<Pixel> {
        let [x, y] = ray;
        let r2 = x * x + y * y;
        (r2 <= self.max_ray_squared).then(|| {
            let [xd, yd] = model::distorted(&self.distortion, ray);
            self.ideal_pixel([xd, yd])
        })
    }

    /// The ray of a pixel (Newton's method); `None` for a pixel that no ray maps to.
    pub fn ray_from_pixel(&self, pixel: Pixel) -> Option<[f64; 2]> {
        model::undistorted(&self.distortion, self.ray_from_ideal(pixel), self.max_ray_squared)
    }

    /// The pixel at which the same camera without distortion would show this pixel's ray.
    pub(super) fn undistorted_pixel(&self, pixel: Pixel) -> Option<Pixel> {
        self.ray_from_pixel(pixel).map(|ray| self.ideal_pixel(ray))
    }

    /// The inverse of [`Self::undistorted_pixel`].
    pub(super) fn distorted_pixel(&self, ideal: Pixel) -> Option<Pixel> {
        self.pixel_from_ray(self.ray_from_ideal(ideal))
    }

    fn ideal_pixel(&self, [x, y]: [f64; 2]) -> Pixel {
        Pixel::new(self.focal_px[0] * x + self.center_px[0], self.focal_px[1] * y + self.center_px[1])
    }

    fn ray_from_ideal(&self, pixel: Pixel) -> [f64; 2] {
        [(pixel.x - self.center_px[0]) / self.focal_px[0], (pixel.y - self.center_px[1]) / self.focal_px[1]]
    }

    /// An error unless every pixel of the picture has exactly one ray; a fisheye's picture may reach beyond the longest
    /// ray that is represented.
    pub(super) fn check(&self, name: &str, size_px: [usize; 2]) -> Result<()> {
        let holds_to_the_end = model::holds_to_the_longest_ray(self.max_ray_squared);
        if self.distortion.model() == DistortionModel::Equidistant && holds_to_the_end {
            return Ok(());
        }
        for pixel in border(size_px) {
            let back = self.ray_from_pixel(pixel).and_then(|ray| self.pixel_from_ray(ray));
            if !back.is_some_and(|back| back.distance_px(pixel) < ROUND_TRIP_PX) {
                let found = format!(
                    "{:?}, which is not one to one (it folds the picture) at pixel ({}, {})",
                    self.distortion.coefficients(),
                    pixel.x,
                    pixel.y
                );
                let names = self.distortion.model().coefficient_names().join(" ");
                let needed =
                    format!("{names} that hold up to the picture's corners (calibrate with corners covered)");
                return Err(Error::invalid(name, "camera.distortion", found, needed));
            }
        }
        Ok(())
    }
}

/// Largest rounding error of a pixel mapped to its ray and back (px).
const ROUND_TRIP_PX: f64 = 1e-6;

impl TryFrom<LensNumbers> for Lens {
    type Error = String;
    fn try_from(lens: LensNumbers) -> std::result::Result<Self, String> {
        let positive = lens.focal_px.iter().all(|f| f.is_finite() && *f > 0.0);
        let distortion = Distortion::new(lens.distortion_model.unwrap_or_default(), &lens.distortion)
            .map_err(|needed| format!("distortion is {:?}; needed: {needed}", lens.distortion))?;
        positive
            .then(|| Self::new(lens.focal_px, lens.center_px, distortion))
            .ok_or_else(|| format!("focal_px is {:?}; needed: positive numbers", lens.focal_px))
    }
}

impl From<Lens> for LensNumbers {
    fn from(lens: Lens) -> Self {
        let model = lens.distortion.model();
        Self {
            focal_px: lens.focal_px,
            center_px: lens.center_px,
            distortion: lens.distortion.coefficients().to_vec(),
            distortion_model: (model != DistortionModel::PlumbBob).then_some(model),
        }
    }
}

/// The middle of a picture (px): between the two middle pixels where the size is even.
pub(super) fn middle_px([width, height]: [usize; 2]) -> [f64; 2] {
    [(width as f64 - 1.0) / 2.0, (height as f64 - 1.0) / 2.0]
}

fn border([width, height]: [usize; 2]) -> impl Iterator<Item = Pixel> {
    let (right, bottom) = (width as f64 - 1.0, height as f64 - 1.0);
    let along =
        |length: usize| (0..length).step_by(BORDER_STEP_PX).chain(length.checked_sub(1)).map(|k| k as f64);
    let rows = along(width).flat_map(move |x| [Pixel::new(x, 0.0), Pixel::new(x, bottom)]);
    rows.chain(along(height).flat_map(move |y| [Pixel::new(0.0, y), Pixel::new(right, y)]))
}

#[cfg(test)]
mod tests;
