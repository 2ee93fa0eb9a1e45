//! How far does a marker move in the image during the exposure?
//!
//! While a clip is tracked the blur of each marker is predicted from its velocity; afterwards the exposure time is
//! measured from the second moments of markers in motion.

use super::marker::target::Target;
use super::track_state::{Source, TrackPoint, TrackState};
use crate::capture::{Camera, Frame};
use crate::geometry::{Pose, Vec2};
use crate::statistics::upper_median;

/// Exposure over the interval between frames where the camera's exposure is unknown.
const USUAL_SHUTTER: f64 = 0.5;
/// Below this speed (px/s) a marker counts as at rest: it blurs by less than a pixel in any exposure.
const SLOW_PX_S: f64 = 30.0;
/// Above this speed (px/s) blur can be measured: 2 px at 1/200 s.
const FAST_PX_S: f64 = 400.0;
/// Least number of samples in fast motion for a measurement.
pub(super) const LEAST_FAST: usize = 4;

/// A frame, its camera and the interval to the frame before.
#[derive(Clone, Copy)]
pub(super) struct FrameView<'a> {
    pub frame: &'a Frame,
    pub camera: &'a Camera,
    pub interval_s: f64,
}

impl FrameView<'_> {
    /// Predicted motion of a target's marker in the image during the exposure (px); zero where the camera does not
    /// see it.
    pub(super) fn blur_px(&self, target: &Target, pose: Pose, velocity: Vec2) -> [f64; 2] {
        let exposure_s = self.camera.exposure_s.unwrap_or(USUAL_SHUTTER * self.interval_s);
        let height_m = target.height_m();
        let from = self.camera.pixel_from_table(pose.position, height_m);
        let to = self.camera.pixel_from_table(pose.position + velocity * exposure_s, height_m);
        let blur_px = [to.x - from.x, to.y - from.y];
        if blur_px.iter().all(|b| b.is_finite()) { blur_px } else { [0.0, 0.0] }
    }
}

/// Exposure time (s) measured from the markers: uniform motion over a length adds a twelfth of its square to the
/// second moments of a marker at rest. `None` where too few samples are fast enough.
pub(super) fn exposure_s(camera: &Camera, states: &[TrackState]) -> Option<f64> {
    let mut squares_s2 = Vec::new();
    for state in states.iter().filter(|s| !s.target.is_markerless()) {
        let seen = (0..state.points.len()).filter(|&k| state.points[k].source == Source::Marker);
        let spreads: Vec<Spread> = seen.map(|k| spread(camera, state, k)).collect();
        let at_rest = spreads.iter().filter(|s| s.speed_px_s < SLOW_PX_S).map(|s| s.excess_px2);
        let Some(usual_px2) = upper_median(at_rest) else { continue };
        let fast = spreads.iter().filter(|s| s.speed_px_s > FAST_PX_S);
        squares_s2.extend(fast.map(|s| 12.0 * (s.excess_px2 - usual_px2) / (s.speed_px_s * s.speed_px_s)));
    }
    if squares_s2.len() < LEAST_FAST {
        return None;
    }
    upper_median(squares_s2).map(|square_s2| square_s2.max(0.0).sqrt())
}

/// Speed of a marker and the trace of its second moments beyond the expected one. Blur adds the same to the trace in
/// every direction of motion, although it rotates the principal axes of an elongated marker.
struct Spread {
    speed_px_s: f64,
    excess_px2: f64,
}

fn spread(camera: &Camera, state: &TrackState, k: usize) -> Spread {
    let point = &state.points[k];
    let [vx, vy] = velocity_px_s(&state.points, k);
    let [xx, _, yy] = point.blob.linear_covariance_px2;
    let [expected_xx, _, expected_yy] = state.target.projection(camera, point.pose).covariance;
    Spread { speed_px_s: vx.hypot(vy), excess_px2: xx + yy - expected_xx - expected_yy }
}

/// Velocity in the image (px/s) at a point, from two successive intervals before, around or after it: of those pairs
/// the one that differs the least, because no impact is between them.
pub(super) fn velocity_px_s(points: &[TrackPoint], k: usize) -> [f64; 2] {
    let rate = |i: usize| {
        let (before, after) = (&points[i], &points[i + 1]);
        let dt_s = after.time_s - before.time_s;
        let (from, to) = (before.blob.centroid, after.blob.centroid);
        [(to.x - from.x) / dt_s, (to.y - from.y) / dt_s]
    };
    let mut best = ([0.0, 0.0], f64::INFINITY);
    for first in k.saturating_sub(2)..=k {
        if first + 2 < points.len() {
            let ([ux, uy], [vx, vy]) = (rate(first), rate(first + 1));
            let change = (vx - ux).hypot(vy - uy);
            if change < best.1 {
                // The mean rate at the middle point, the rate of the nearer interval at the outer ones.
                let at = match k - first {
                    0 => [ux, uy],
                    1 => [f64::midpoint(ux, vx), f64::midpoint(uy, vy)],
                    _ => [vx, vy],
                };
                best = (at, change);
            }
        }
    }
    best.0
}

/// Second moments less those of uniform motion over this displacement (px).
pub(super) fn without_blur([xx, xy, yy]: [f64; 3], [sx, sy]: [f64; 2]) -> [f64; 3] {
    [xx - sx * sx / 12.0, xy - sx * sy / 12.0, yy - sy * sy / 12.0]
}
