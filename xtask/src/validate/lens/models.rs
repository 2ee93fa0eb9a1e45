//! The distortion models and the readers of calibration files beside OpenCV: `cargo xtask validate lenses [COUNT]`.
//!
//! OpenCV draws lenses, stores each as YAML, XML and JSON and projects rays (`peers/opencv_lenses.py`); the files are read
//! as a cell's `camera_info`.

use crate::example::target;
use crate::validate::row::{Row, print_all};
use crate::venv;
use breakshot::capture::Lens;
use breakshot::files;
use breakshot::geometry::Pixel;
use serde::Deserialize;
use std::path::PathBuf;
use std::process::Command;

/// Largest difference of a pixel (1e-9 px): coordinates of a thousand pixels in double precision.
const SAME_PIXEL: f64 = 1.0;
/// Largest difference of a ray (1e-12): a pixel's over the focal length, where the distortion compresses tenfold.
const SAME_RAY: f64 = 10.0;
/// Difference beyond which `undistortPoints` has found another ray: the lens folds, and two rays meet in one pixel.
const OTHER_RAY: f64 = 1e-6;

/// A lens with its files, and what OpenCV projects.
#[derive(Deserialize)]
struct Case {
    model: String,
    files: Vec<PathBuf>,
    rays: Vec<[f64; 2]>,
    pixels: Vec<[f64; 2]>,
    inverse: Vec<Option<[f64; 2]>>,
}

/// The largest differences of one model's lenses.
#[derive(Default)]
struct Differences {
    lenses: usize,
    points: usize,
    unsolved: usize,
    without_ray: usize,
    pixel: f64,
    ray: f64,
    inverse: f64,
}

/// Whether a lens mirrors what is around a ray: it does so beyond its fold.
fn is_mirrored(lens: &Lens, [x, y]: [f64; 2]) -> bool {
    const STEP: f64 = 1e-6;
    let change = |step: [f64; 2]| {
        let [after, before] = [1.0, -1.0].map(|sign| [x + sign * step[0], y + sign * step[1]]);
        Some((lens.pixel_from_ray(after)?, lens.pixel_from_ray(before)?))
    };
    let (Some((right, left)), Some((down, up))) = (change([STEP, 0.0]), change([0.0, STEP])) else {
        return true;
    };
    (right.x - left.x) * (down.y - up.y) < (right.y - left.y) * (down.x - up.x)
}

impl Differences {
    fn add(&mut self, case: &Case) -> Result<(), String> {
        self.lenses += 1;
        for file in &case.files {
            let read = files::load_intrinsics(file, None).map_err(|e| e.to_string())?;
            let lens = Lens::new(read.focal_px, read.center_px, read.distortion);
            for ((ray, [u, v]), inverse) in case.rays.iter().zip(&case.pixels).zip(&case.inverse) {
                self.points += 1;
                let pixel = Pixel::new(*u, *v);
                let found = lens.pixel_from_ray(*ray).zip(lens.ray_from_pixel(pixel));
                let Some((projected, back)) = found.filter(|_| !is_mirrored(&lens, *ray)) else {
                    // The lens folds nearer to the axis than this ray: its pixel has no ray, or the one before the fold.
                    self.without_ray += 1;
                    continue;
                };
                let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
                self.pixel = self.pixel.max(projected.distance_px(pixel));
                self.ray = self.ray.max(apart(back, *ray));
                match inverse {
                    Some(theirs) if apart(*theirs, *ray) < OTHER_RAY => {
                        self.inverse = self.inverse.max(apart(back, *theirs));
                    }
                    _ => self.unsolved += 1,
                }
            }
        }
        Ok(())
    }

    fn rows(&self, model: &str) -> bool {
        let share = 100.0 / self.points.max(1) as f64;
        print_all(
            &format!(
                "`{model}`: {} lenses, {} points, each lens from YAML, XML and JSON",
                self.lenses, self.points
            ),
            &[
                Row::at_most("largest difference of pixels (1e-9 px)", self.pixel * 1e9, SAME_PIXEL, ""),
                Row::at_most(
                    "largest difference of rays to those projected (1e-12)",
                    self.ray * 1e12,
                    SAME_RAY,
                    "",
                ),
                Row::at_most(
                    "largest difference of rays to undistortPoints (1e-12)",
                    self.inverse * 1e12,
                    SAME_RAY,
                    "",
                ),
                Row::plain(
                    "points where undistortPoints ends nowhere or beyond the fold",
                    self.unsolved as f64 * share,
                    "%",
                ),
                Row::plain("points beyond the fold of the lens", self.without_ray as f64 * share, "%"),
            ],
        )
    }
}

/// Compares `count` drawn lenses of each model with OpenCV.
pub(crate) fn validate(count: u64, python: Option<&str>) -> Result<bool, String> {
    let python = venv::given_or(python, "opencv", &super::PACKAGES)?;
    let folder = target().join("validate/lenses");
    let peer = ["xtask/peers/opencv_lenses.py", &count.to_string()].map(str::to_owned);
    venv::succeed(Command::new(python).args(peer).arg(&folder))?;
    let text = std::fs::read_to_string(folder.join("cases.json")).map_err(|e| format!("cases.json: {e}"))?;
    let cases: Vec<Case> = serde_json::from_str(&text).map_err(|e| format!("cases.json: {e}"))?;
    let mut all_hold = true;
    for model in ["plumb_bob", "rational_polynomial", "equidistant"] {
        let mut differences = Differences::default();
        cases.iter().filter(|case| case.model == model).try_for_each(|case| differences.add(case))?;
        all_hold &= differences.rows(model);
    }
    Ok(all_hold)
}
