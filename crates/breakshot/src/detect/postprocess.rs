//! Which samples are reliable, and what are the angles without motion blur?
//!
//! After the whole clip the usual appearance of every marker is known: samples that deviate from it are marked as
//! doubtful, and the motion blur is removed from the second moments that determine the yaw.

use super::derivatives;
use super::marker::blob::ImagePose;
use super::marker::target::Target;
use super::motion_blur::{LEAST_FAST, velocity_px_s, without_blur};
use super::track_state::{TrackPoint, TrackState};
use super::tracks::{Sample, Track};
use super::why::reason::Doubt;
use crate::capture::Camera;
use crate::geometry::Pixel;
use crate::geometry::moments::principal_axes;
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, upper_median};
use std::f64::consts::PI;

/// A deviation of the half axes from the usual ones by more than this (px) is an occlusion: compression of moving
/// markers causes about a tenth of a pixel.
const USUAL_DEVIATION_PX: f64 = 0.35;
/// The same as a multiple of their scatter, where that is larger.
const USUAL_SCATTERS: f64 = 5.0;
/// From this blur on (px) the dead band rotates the principal axes by more than noise does without it.
const LONG_BLUR_PX: f64 = 5.0;
/// Relative uncertainty of the blur: the opening and closing of the shutter are unknown.
const BLUR_UNCERTAINTY: f64 = 0.1;
/// An object that reaches the border within this time (s) at its velocity has left the image when it is lost.
const LEAVING_S: f64 = 0.1;

/// The track of one object, and what each of its samples is doubtful for.
pub(super) struct DoubtedTrack {
    pub track: Track,
    /// Beside each sample; empty for one that is not doubtful.
    pub doubts: Vec<Vec<Doubt>>,
}

/// The track of one object, in the order of time.
pub(super) fn track(camera: &Camera, state: &TrackState, exposure_s: f64) -> DoubtedTrack {
    // Appearance of the marker in every frame
    let target = &state.target;
    let blurs_px: Vec<[f64; 2]> =
        (0..state.points.len()).map(|k| velocity_px_s(&state.points, k).map(|v| v * exposure_s)).collect();
    let appearances: Vec<Appearance> =
        state.points.iter().zip(&blurs_px).map(|(p, blur)| appearance(camera, target, p, *blur)).collect();
    let deviations_px = size_deviations_px(&appearances);
    let mut yaw_near_rad = state.points.first().map_or(0.0, |p| p.pose.yaw_rad);

    // Samples
    let points = state.points.iter().zip(&appearances).zip(deviations_px);
    let samples = points.map(|((point, appearance), deviation_px)| {
        let observed = ImagePose { centroid: point.blob.centroid, axis_rad: appearance.axis_rad };
        let pose = if target.is_markerless() || target.feature.dot.is_some() {
            point.pose
        } else {
            target.pose(camera, observed, yaw_near_rad)
        };
        yaw_near_rad = pose.yaw_rad;
        let scale_m_per_px = camera.scale_m_per_px(point.blob.centroid, target.height_m());
        let doubts = doubts(target, point, deviation_px);
        // A rolling shutter exposes lower rows later.
        let time_s = point.time_s + camera.readout_s * point.blob.centroid.y / camera.size_px[1] as f64;
        let yaw_rad = (target.has_observable_yaw() && point.yaw_known).then_some(pose.yaw_rad);
        // An occlusion that shortens a marker displaces its centroid by about as much.
        let std_m = scale_m_per_px * (point.blob.std_px + deviation_px.unwrap_or(0.0));
        let sample = Sample::new(time_s, pose.position, yaw_rad, std_m);
        (Sample { doubtful: !doubts.is_empty(), ..sample }, doubts)
    });
    let (samples, doubts) = samples.unzip();
    DoubtedTrack { track: Track { object: target.name.to_string(), samples }, doubts }
}

/// Why a position may be biased; `deviation_px` is that of the marker's size, where it is more than noise.
fn doubts(target: &Target, point: &TrackPoint, deviation_px: Option<f64>) -> Vec<Doubt> {
    let size = deviation_px.map(|deviation_px| Doubt::Size { deviation_px });
    let border = point.blob.at_border.then_some(Doubt::AtBorder);
    let is_partial = target.is_markerless() && !point.complete;
    let outline = is_partial.then_some(Doubt::Outline { visible: point.blob.contrast });
    let yaw = (target.is_off_centre() && !point.yaw_known).then_some(Doubt::Yaw);
    [size, border, outline, yaw].into_iter().flatten().collect()
}

/// Direction and size of a marker in one frame, without motion blur.
struct Appearance {
    /// Direction of the principal axis in the image (rad).
    axis_rad: f64,
    /// Mean radius, long and short half axis, less the expected ones (px).
    excess_px: [f64; 3],
    /// Length of the motion blur (px).
    blur_px: f64,
}

fn appearance(camera: &Camera, target: &Target, point: &TrackPoint, blur_px: [f64; 2]) -> Appearance {
    let expected = target.projection(camera, point.pose);
    let covariance_px2 = if blur_px[0].hypot(blur_px[1]) < LONG_BLUR_PX {
        point.blob.covariance_px2
    } else {
        point.blob.linear_covariance_px2
    };
    let (long, short, axis_rad) = principal_axes(without_blur(covariance_px2, blur_px));
    let (expected_long, expected_short, _) = principal_axes(expected.covariance);
    let half_axis_px = |observed: f64, expected: f64| 2.0 * observed.sqrt() - 2.0 * expected.sqrt();
    let radius_px = (point.blob.area_px2 / PI).sqrt() - (expected.area / PI).sqrt();
    Appearance {
        axis_rad,
        excess_px: [radius_px, half_axis_px(long, expected_long), half_axis_px(short, expected_short)],
        blur_px: blur_px[0].hypot(blur_px[1]),
    }
}

/// Largest deviation of a marker's size from its median over the clip (px), per frame; `None` where it is within
/// noise.
fn size_deviations_px(appearances: &[Appearance]) -> Vec<Option<f64>> {
    let mut deviations_px: Vec<Option<f64>> = vec![None; appearances.len()];
    for i in 0..3 {
        let Some(usual) = upper_median(appearances.iter().map(|a| a.excess_px[i])) else { continue };
        let middle_px = upper_median(appearances.iter().map(|a| (a.excess_px[i] - usual).abs()));
        let scatter = STD_OVER_MEDIAN_ABSOLUTE * middle_px.unwrap_or(0.0);
        for (largest, appearance) in deviations_px.iter_mut().zip(appearances) {
            let deviation_px = (appearance.excess_px[i] - usual).abs();
            let noise_px = (USUAL_SCATTERS * scatter).max(USUAL_DEVIATION_PX);
            if deviation_px > noise_px + BLUR_UNCERTAINTY * appearance.blur_px {
                *largest = Some(largest.map_or(deviation_px, |d| d.max(deviation_px)));
            }
        }
    }
    deviations_px
}

/// Multiplies the standard deviations by the scatter of the samples about smooth motion, if that is larger:
/// compression moves edges by more than the noise of the grey levels.
pub(super) fn scale_noise(tracks: &mut [Track]) {
    let residuals: Vec<f64> =
        tracks.iter().flat_map(|track| derivatives::residual_stds(&track.samples)).collect();
    if residuals.len() < LEAST_FAST {
        return;
    }
    let factor = upper_median(residuals).unwrap_or(1.0).max(1.0);
    for sample in tracks.iter_mut().flat_map(|track| &mut track.samples) {
        sample.std_m *= factor;
    }
}

/// Warnings of the frames in which an object was not found.
pub(super) fn gap_warnings(camera: &Camera, state: &TrackState, times_s: &[f64]) -> Vec<String> {
    let name = state.target.name;
    let mut warnings = Vec::new();
    let Some(last) = state.points.last() else { return vec![format!("`{name}` was not found in any frame")] };
    for pair in state.points.windows(2) {
        let missed = pair[1].frame - pair[0].frame - 1;
        if missed > 0 {
            let (from_s, to_s) = (pair[0].time_s, pair[1].time_s);
            warnings.push(format!(
                "`{name}` was not found in {missed} frames between {from_s:.3} and {to_s:.3} s"
            ));
        }
    }
    let missed = times_s.len() - 1 - last.frame;
    if missed > 0 {
        let reason = if left_image(camera, state, last) { "left the image" } else { "was not found again" };
        warnings.push(format!(
            "`{name}` {reason} after {:.3} s; its last {missed} frames are missing",
            last.time_s
        ));
    }
    warnings
}

/// Whether an object was at the border of the image, or about to reach it, when it was last found.
fn left_image(camera: &Camera, state: &TrackState, last: &TrackPoint) -> bool {
    let [vx, vy] = velocity_px_s(&state.points, state.points.len() - 1);
    let Pixel { x, y } = last.blob.centroid;
    let size_px = last.blob.area_px2.sqrt();
    let margin_px = |v: f64| LEAVING_S * v.abs() + size_px;
    let near = |at: f64, v: f64, size: usize| at < margin_px(v) || at > size as f64 - margin_px(v);
    last.blob.at_border || near(x, vx, camera.size_px[0]) || near(y, vy, camera.size_px[1])
}
