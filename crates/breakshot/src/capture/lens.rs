//! The lens: the map between rays and pixels.
//!
//! A pinhole camera with Brown's distortion, in OpenCV's and ROS's conventions: a *ray* is the pair (x / z, y / z) of a
//! direction in the camera's frame (x right, y down, z forward), a pixel counts from the centre of the top left one.

use crate::error::{Error, Result};
use crate::geometry::Pixel;
use serde::{Deserialize, Serialize};

/// Focal lengths, principal point and distortion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "LensNumbers", into = "LensNumbers")]
pub struct Lens {
    focal_px: [f64; 2],
    center_px: [f64; 2],
    distortion: [f64; 5],
    /// The square of the longest ray up to which the radial distortion is one to one.
    max_ray_squared: f64,
}

/// The serialized form of a lens.
#[derive(Clone, Serialize, Deserialize)]
struct LensNumbers {
    focal_px: [f64; 2],
    center_px: [f64; 2],
    distortion: [f64; 5],
}

/// The longest ray that the model represents: 84 degrees off the axis.
const LONGEST_RAY: f64 = 10.0;
/// Largest number of Newton steps from the distorted ray; four are enough where the distortion is one to one.
const MOST_STEPS: usize = 30;
/// Length of a Newton step that is below the rounding of a pixel coordinate.
const CONVERGED: f64 = 1e-13;
/// Distance between tested pixels of the border (px).
const BORDER_STEP_PX: usize = 16;

impl Lens {
    /// The lens with focal lengths fx and fy, principal point (cx, cy) and distortion k1 k2 p1 p2 k3.
    pub fn new(focal_px: [f64; 2], center_px: [f64; 2], distortion: [f64; 5]) -> Self {
        let max_ray_squared = max_ray_squared(distortion);
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

    /// k1 k2 p1 p2 k3, in OpenCV's order.
    pub fn distortion(&self) -> [f64; 5] {
        self.distortion
    }

    /// The same lens with its focal lengths multiplied and its first radial coefficient shifted.
    pub(super) fn changed(&self, focal_factor: f64, k1_more: f64) -> Self {
        let [k1, k2, p1, p2, k3] = self.distortion;
        Self::new(self.focal_px.map(|f| f * focal_factor), self.center_px, [k1 + k1_more, k2, p1, p2, k3])
    }

    /// The pixel of a ray; `None` for a ray beyond which the distortion is not one to one.
    pub fn pixel_from_ray(&self, ray: [f64; 2]) -> Option<Pixel> {
        let [x, y] = ray;
        let r2 = x * x + y * y;
        (r2 <= self.max_ray_squared).then(|| {
            let [xd, yd] = self.distorted(ray);
            self.ideal_pixel([xd, yd])
        })
    }

    /// The ray of a pixel (Newton's method); `None` for a pixel that no ray maps to.
    pub fn ray_from_pixel(&self, pixel: Pixel) -> Option<[f64; 2]> {
        let [xd, yd] = self.ray_from_ideal(pixel);
        if self.distortion == [0.0; 5] {
            return (xd * xd + yd * yd <= self.max_ray_squared).then_some([xd, yd]);
        }
        let [k1, k2, p1, p2, k3] = self.distortion;
        let (mut x, mut y) = (xd, yd);
        for _ in 0..MOST_STEPS {
            let [fx, fy] = self.distorted([x, y]);
            let r2 = x * x + y * y;
            let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            // Twice the derivative of the radial factor by r2: its derivative by x is `slope * x`.
            let slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3));
            let xx = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x;
            let yy = radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x;
            let xy = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y;
            let determinant = xx * yy - xy * xy;
            let (ex, ey) = (fx - xd, fy - yd);
            let (dx, dy) = ((yy * ex - xy * ey) / determinant, (xx * ey - xy * ex) / determinant);
            (x, y) = (x - dx, y - dy);
            if dx.abs() + dy.abs() < CONVERGED {
                return (x * x + y * y <= self.max_ray_squared).then_some([x, y]);
            }
        }
        None
    }

    /// The pixel at which the same camera without distortion would show this pixel's ray.
    pub(super) fn undistorted_pixel(&self, pixel: Pixel) -> Option<Pixel> {
        self.ray_from_pixel(pixel).map(|ray| self.ideal_pixel(ray))
    }

    /// The inverse of [`Self::undistorted_pixel`].
    pub(super) fn distorted_pixel(&self, ideal: Pixel) -> Option<Pixel> {
        self.pixel_from_ray(self.ray_from_ideal(ideal))
    }

    fn distorted(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    }

    fn ideal_pixel(&self, [x, y]: [f64; 2]) -> Pixel {
        Pixel::new(self.focal_px[0] * x + self.center_px[0], self.focal_px[1] * y + self.center_px[1])
    }

    fn ray_from_ideal(&self, pixel: Pixel) -> [f64; 2] {
        [(pixel.x - self.center_px[0]) / self.focal_px[0], (pixel.y - self.center_px[1]) / self.focal_px[1]]
    }

    /// An error unless every pixel of the picture has exactly one ray.
    pub(super) fn check(&self, name: &str, size_px: [usize; 2]) -> Result<()> {
        for pixel in border(size_px) {
            let back = self.ray_from_pixel(pixel).and_then(|ray| self.pixel_from_ray(ray));
            if !back.is_some_and(|back| back.distance_px(pixel) < ROUND_TRIP_PX) {
                let found = format!(
                    "{:?}, which is not one to one (it folds the picture) at pixel ({}, {})",
                    self.distortion, pixel.x, pixel.y
                );
                let needed =
                    "k1 k2 p1 p2 k3 that hold up to the picture's corners (calibrate with corners covered)";
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
        positive
            .then(|| Self::new(lens.focal_px, lens.center_px, lens.distortion))
            .ok_or_else(|| format!("focal_px is {:?}; needed: positive numbers", lens.focal_px))
    }
}

impl From<Lens> for LensNumbers {
    fn from(lens: Lens) -> Self {
        Self { focal_px: lens.focal_px, center_px: lens.center_px, distortion: lens.distortion }
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

/// The square of the first ray length at which r (1 + k1 r2 + k2 r4 + k3 r6) stops growing.
fn max_ray_squared([k1, k2, _, _, k3]: [f64; 5]) -> f64 {
    let growth = |u: f64| 1.0 + u * (3.0 * k1 + u * (5.0 * k2 + u * 7.0 * k3));
    // A cubic in u has at most three roots: fine steps of the ray's length find the first one.
    let steps: u32 = 4096;
    let length = |k: u32| LONGEST_RAY * f64::from(k) / f64::from(steps);
    let fold = (1..=steps).find(|&k| growth(length(k).powi(2)) <= 0.0);
    let longest = fold.map_or(LONGEST_RAY, |k| length(k - 1));
    longest * longest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_taken_to_its_ray_and_back_is_the_same_pixel() {
        for distortion in [
            [0.0; 5],
            [-0.045, 0.012, 0.0, 0.0, 0.0],
            [-0.32, 0.11, 0.002, -0.003, -0.01],
            [0.25, -0.1, -0.004, 0.001, 0.05],
        ] {
            let lens = Lens::new([900.0, 905.0], [631.2, 358.7], distortion);
            lens.check("lens", [1280, 720]).expect("a lens that holds to the corners");
            for k in 0..200 {
                let pixel = Pixel::new(f64::from(k * 37 % 1280), f64::from(k * 53 % 720));
                let ray = lens.ray_from_pixel(pixel).expect("inside the picture");
                let back = lens.pixel_from_ray(ray).expect("its own ray");
                assert!(back.distance_px(pixel) < 1e-9, "{pixel:?} came back as {back:?}");
            }
        }
    }

    #[test]
    fn a_lens_that_folds_the_picture_is_an_error() {
        let lens = Lens::new([900.0; 2], [639.5, 359.5], [-0.9, 0.0, 0.0, 0.0, 0.0]);
        let message = lens.check("cell.toml", [1280, 720]).expect_err("not one to one").to_string();
        assert!(message.contains("cell.toml") && message.contains("folds"), "{message}");
    }
}
