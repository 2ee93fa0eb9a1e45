//! A focal length to start from.

use super::bundle;
use super::views::{View, observations};
use crate::capture::homography::Homography;
use crate::capture::lens::{Lens, middle_px};
use crate::cell::{Board, Distortion, DistortionModel};
use nalgebra::Matrix3;

/// Focal lengths that are tried beside the closed form, in widths of the picture: wide angle to telephoto.
const GUESSES: [f64; 7] = [0.3, 0.45, 0.65, 0.9, 1.3, 2.0, 3.5];
/// Number of views on which the focal lengths are compared.
const COMPARED: usize = 12;

/// A lens without distortion: Zhang's focal length (2000), or a guess that fits the views better.
pub(super) fn lens(
    size_px: [usize; 2],
    views: &[View],
    board: &Board,
    model: DistortionModel,
) -> Option<Lens> {
    let center_px = middle_px(size_px);
    let distortion = Distortion::new(model, &[]).ok()?;
    let all = observations(views, board);
    let step = all.len().div_ceil(COMPARED).max(1);
    let compared: Vec<_> = all.iter().step_by(step).cloned().collect();
    let width = size_px[0] as f64;
    let guesses = GUESSES.iter().map(|widths| widths * width).chain(zhang(&all, center_px));
    let lenses = guesses.map(|focal_px| Lens::new([focal_px; 2], center_px, distortion));
    let costs = lenses.filter_map(|lens| bundle::pose_cost(&lens, &compared).map(|cost| (cost, lens)));
    costs.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, lens)| lens)
}

/// The focal length of square pixels with a known principal point: two linear equations for 1 / f² of each view's homography
/// (Zhang, 2000, Eq. 3 and 4); `None` where the views are parallel to the picture.
fn zhang(all: &bundle::Observations, [cx, cy]: [f64; 2]) -> Option<f64> {
    let to_center = Matrix3::new(1.0, 0.0, -cx, 0.0, 1.0, -cy, 0.0, 0.0, 1.0);
    let (mut product, mut square) = (0.0, 0.0);
    for corners in all {
        let pairs: Vec<_> = corners.iter().map(|corner| (corner.point, corner.pixel)).collect();
        let Some(Homography(h)) = Homography::fitted(&pairs) else { continue };
        let h = to_center * h;
        // A scale for which views count alike.
        let h = h / (h.column(0).norm() * h.column(1).norm()).sqrt();
        let (a, b) = (h.column(0), h.column(1));
        for (slope, constant) in [
            (a[0] * b[0] + a[1] * b[1], a[2] * b[2]),
            (a[0] * a[0] + a[1] * a[1] - b[0] * b[0] - b[1] * b[1], a[2] * a[2] - b[2] * b[2]),
        ] {
            product -= slope * constant;
            square += slope * slope;
        }
    }
    let focal_px = (square / product).sqrt();
    (focal_px.is_finite() && focal_px > 0.0).then_some(focal_px)
}
