//! What does the lens do to a ray?
//!
//! The pinhole with Brown's distortion, in OpenCV's and ROS's conventions: a *ray* is the pair (x / z, y / z) of a
//! direction in the camera's frame (x right, y down, z forward), a pixel counts from the centre of the top left one.

use crate::cell::CameraSpec;
use crate::error::{Error, Result};
use crate::files;
use crate::geometry::Pixel;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Focal lengths, principal point and distortion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "LensNumbers", into = "LensNumbers")]
pub struct Lens {
    focal_px: [f64; 2],
    center_px: [f64; 2],
    distortion: [f64; 5],
    /// The square of the longest ray up to which the radial distortion is one to one.
    reach: f64,
}

/// The lens as it is written.
#[derive(Clone, Serialize, Deserialize)]
struct LensNumbers {
    focal_px: [f64; 2],
    center_px: [f64; 2],
    distortion: [f64; 5],
}

/// No ray of a lens this model can hold is longer: 84 degrees off the axis.
const LONGEST_RAY: f64 = 10.0;
/// Newton's steps from the distorted ray; four are enough for every lens that does not fold.
const MOST_STEPS: usize = 30;
/// A step this short is below the rounding of a pixel coordinate.
const CONVERGED: f64 = 1e-13;
/// Pixels between two places of the border at which the lens is tried.
const BORDER_STEP_PX: usize = 16;

impl Lens {
    /// The lens with focal lengths fx and fy, principal point (cx, cy) and distortion k1 k2 p1 p2 k3.
    pub fn new(focal_px: [f64; 2], center_px: [f64; 2], distortion: [f64; 5]) -> Self {
        let reach = reach(distortion);
        Self { focal_px, center_px, distortion, reach }
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

    /// Where a ray meets the picture; `None` past the ray at which the model folds back.
    pub fn pixel_from_ray(&self, ray: [f64; 2]) -> Option<Pixel> {
        let [x, y] = ray;
        let r2 = x * x + y * y;
        (r2 <= self.reach).then(|| {
            let [xd, yd] = self.distorted(ray);
            self.ideal_pixel([xd, yd])
        })
    }

    /// The ray that a pixel shows (Newton's method); `None` where no ray leads to.
    pub fn ray_from_pixel(&self, pixel: Pixel) -> Option<[f64; 2]> {
        let [xd, yd] = self.ray_from_ideal(pixel);
        if self.distortion == [0.0; 5] {
            return (xd * xd + yd * yd <= self.reach).then_some([xd, yd]);
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
                return (x * x + y * y <= self.reach).then_some([x, y]);
            }
        }
        None
    }

    /// Where the same pinhole without distortion would show what this pixel shows.
    pub(super) fn straightened(&self, pixel: Pixel) -> Option<Pixel> {
        self.ray_from_pixel(pixel).map(|ray| self.ideal_pixel(ray))
    }

    /// The way back from [`Self::straightened`].
    pub(super) fn bent(&self, ideal: Pixel) -> Option<Pixel> {
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

    /// An error unless every pixel of the picture has one ray, and that ray leads back to it.
    pub(super) fn check(&self, name: &str, size_px: [usize; 2]) -> Result<()> {
        for pixel in border(size_px) {
            let back = self.ray_from_pixel(pixel).and_then(|ray| self.pixel_from_ray(ray));
            if !back.is_some_and(|back| back.distance_px(pixel) < ROUND_TRIP_PX) {
                let found = format!(
                    "{:?}, which folds the picture over at pixel ({}, {})",
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

/// From a pixel to its ray and back: only rounding remains.
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
fn reach([k1, k2, _, _, k3]: [f64; 5]) -> f64 {
    let growth = |u: f64| 1.0 + u * (3.0 * k1 + u * (5.0 * k2 + u * 7.0 * k3));
    // A cubic in u changes sign at most thrice: fine steps of the ray's length find the first change.
    let steps: u32 = 4096;
    let length = |k: u32| LONGEST_RAY * f64::from(k) / f64::from(steps);
    let fold = (1..=steps).find(|&k| growth(length(k).powi(2)) <= 0.0);
    let longest = fold.map_or(LONGEST_RAY, |k| length(k - 1));
    longest * longest
}

/// The part of a ROS `CameraInfo` file (also of OpenCV's) that tells the lens.
#[derive(Deserialize)]
struct CameraInfo {
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

/// The cell's lens with the numbers of its `camera_info` file filled in.
///
/// # Errors
/// An unreadable file, a distortion model other than `plumb_bob` (or one that reduces to it), own keys beside it.
pub(super) fn resolved(spec: &CameraSpec, name: &str) -> Result<CameraSpec> {
    let Some(path) = &spec.camera_info else { return Ok(spec.clone()) };
    if spec.focal_px.is_some() || spec.center_px.is_some() || spec.distortion.is_some() {
        let needed = "the lens once: camera_info, or focal_px, center_px and distortion";
        return Err(Error::invalid(name, "camera", "both camera_info and the lens's own keys", needed));
    }
    let info = camera_info(path)?;
    let owner = path.display().to_string();
    let size = [info.image_width, info.image_height];
    if let Some(given) = spec.image_size_px
        && given != size
    {
        let needed = format!("the cell's image_size_px, {} x {}", given[0], given[1]);
        return Err(Error::invalid(owner, "image size", format!("{} x {}", size[0], size[1]), needed));
    }
    let matrix: [f64; 9] = info.camera_matrix.data.try_into().map_err(|data: Vec<f64>| {
        Error::invalid(&owner, "camera_matrix.data", format!("{} numbers", data.len()), "9 numbers")
    })?;
    let [fx, skew, cx, _, fy, cy, ..] = matrix;
    let possible = matrix.iter().all(|v| v.is_finite()) && fx > 0.0 && fy > 0.0 && skew == 0.0;
    if !possible {
        let needed = "[fx, 0, cx, 0, fy, cy, 0, 0, 1] with positive focal lengths (a calibrated camera)";
        return Err(Error::invalid(owner, "camera_matrix.data", format!("{matrix:?}"), needed));
    }
    Ok(CameraSpec {
        image_size_px: Some(size),
        focal_px: Some([fx, fy]),
        center_px: Some([cx, cy]),
        distortion: Some(plumb_bob(&owner, info.distortion_model, info.distortion_coefficients.data)?),
        camera_info: None,
        ..spec.clone()
    })
}

fn camera_info(path: &Path) -> Result<CameraInfo> {
    let text = files::text(path)?;
    // OpenCV heads its files with a directive, and tags its matrices, in ways that YAML does not know.
    let yaml: String = text
        .lines()
        .filter(|line| !line.starts_with("%YAML") && *line != "---")
        .map(|line| line.replace("!!opencv-matrix", "") + "\n")
        .collect();
    serde_saphyr::from_str(&yaml).map_err(|e| Error::Syntax {
        path: path.into(),
        problem: format!("{}; needed: a ROS CameraInfo file", e.to_string().trim().replace('\n', "; ")),
    })
}

/// k1 k2 p1 p2 k3, refused by name where the file's model is another one.
fn plumb_bob(owner: &str, model: Option<String>, mut data: Vec<f64>) -> Result<Vec<f64>> {
    let model = model.unwrap_or_else(|| "plumb_bob".into());
    let higher_terms = data.iter().skip(5).any(|&k| k != 0.0);
    let reducible = matches!(model.as_str(), "plumb_bob" | "rational_polynomial" | "");
    if !reducible || higher_terms || data.iter().any(|k| !k.is_finite()) {
        let found = format!("`{model}` with {data:?}");
        return Err(Error::invalid(owner, "distortion_model", found, "`plumb_bob`: k1 k2 p1 p2 k3"));
    }
    data.resize(5, 0.0); // also cuts the zeros that a longer model ends with
    Ok(data)
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
    fn a_lens_that_folds_inside_the_picture_is_refused() {
        let lens = Lens::new([900.0; 2], [639.5, 359.5], [-0.9, 0.0, 0.0, 0.0, 0.0]);
        let message = lens.check("cell.toml", [1280, 720]).expect_err("it folds").to_string();
        assert!(message.contains("cell.toml") && message.contains("folds"), "{message}");
    }

    fn read(yaml: &str) -> Result<CameraSpec> {
        let file = tempfile::NamedTempFile::new().expect("a temporary file");
        std::fs::write(file.path(), yaml).expect("written");
        let spec = CameraSpec { camera_info: Some(file.path().into()), ..CameraSpec::default() };
        resolved(&spec, "cell.toml")
    }

    const ROS: &str = "image_width: 640\nimage_height: 480\ncamera_name: head\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
        data: [600.5, 0, 320.25, 0, 601, 240.0, 0., 0., 1.]\ndistortion_model: MODEL\n\
        distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.1, -0.2, 0.001, 0.002, 0.0MORE]\n\
        rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n";

    #[test]
    fn a_ros_camera_info_file_gives_the_lens() {
        let spec = read(&ROS.replace("MODEL", "plumb_bob").replace("MORE", "")).expect("a plumb bob");
        assert_eq!(spec.image_size_px, Some([640, 480]));
        assert_eq!(spec.focal_px, Some([600.5, 601.0]));
        assert_eq!(spec.center_px, Some([320.25, 240.0]));
        assert_eq!(spec.distortion, Some(vec![0.1, -0.2, 0.001, 0.002, 0.0]));
        let opencv = ROS.replace("MODEL", "plumb_bob").replace("MORE", "");
        let opencv = format!("%YAML:1.0\n---\n{}", opencv.replace("matrix:\n", "matrix: !!opencv-matrix\n"));
        assert_eq!(read(&opencv).expect("OpenCV's own form"), spec);
    }

    #[test]
    fn a_distortion_model_that_is_not_plumb_bob_is_refused_by_name() {
        let zero = ROS.replace("MODEL", "rational_polynomial").replace("MORE", ", 0, 0, 0");
        assert_eq!(read(&zero).expect("reduces to plumb bob").distortion.map(|d| d.len()), Some(5));
        for (model, more) in [("rational_polynomial", ", 0.3, 0, 0"), ("equidistant", "")] {
            let message =
                read(&ROS.replace("MODEL", model).replace("MORE", more)).expect_err(model).to_string();
            assert!(message.contains(model) && message.contains("plumb_bob"), "{message}");
        }
        let message = read("image_width: 640\nimage_height: [").expect_err("broken").to_string();
        assert!(message.contains("CameraInfo"), "{message}");
    }
}
