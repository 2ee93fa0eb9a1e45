//! How far does a marker move in the image during the exposure?
//!
//! While a clip is tracked the blur of each marker is predicted from its velocity; afterwards the exposure time is
//! measured from the second moments of markers in motion.

use super::marker::target::Target;
use super::track_state::{Source, TrackPoint, TrackState};
use crate::capture::{Camera, Frame};
use crate::geometry::moments::principal_axes;
use crate::geometry::{Pose, Vec2};
use crate::statistics::upper_median;

/// Exposure over the interval between frames where the camera's exposure is unknown.
const USUAL_SHUTTER: f64 = 0.5;
/// Below this speed (px/s) a marker counts as at rest: it blurs by less than a pixel in any exposure.
const SLOW_PX_S: f64 = 30.0;
/// Above this speed (px/s) blur can be measured: 2 px at 1/200 s.
const FAST_PX_S: f64 = 400.0;
/// Second moments of the same shape differ by less than this (ratio's logarithm): a tenth in its lengths.
const SAME_MOMENT: f64 = 0.2;
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
    /// Whether the camera's exposure is known; the assumed one may be several times too long.
    pub(super) fn is_exposure_known(&self) -> bool {
        self.camera.exposure_s.is_some()
    }

    /// Exposure time (s): the camera's, or a usual one where it is unknown.
    pub(super) fn exposure_s(&self) -> f64 {
        self.camera.exposure_s.unwrap_or(USUAL_SHUTTER * self.interval_s)
    }

    /// Predicted motion of a target's marker in the image during the exposure (px); zero where the camera does not
    /// see it.
    pub(super) fn blur_px(&self, target: &Target, pose: Pose, velocity: Vec2) -> [f64; 2] {
        let exposure_s = self.exposure_s();
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
        squares_s2.extend((0..state.points.len()).filter_map(|k| fitted_exposure_s2(state, k)));
    }
    if squares_s2.len() < LEAST_FAST {
        return None;
    }
    upper_median(squares_s2).map(|square_s2| square_s2.max(0.0).sqrt())
}

/// Square of the exposure time by a blurred marker whose motion was fitted (s2).
fn fitted_exposure_s2(state: &TrackState, k: usize) -> Option<f64> {
    let point = &state.points[k];
    let [bx, by] = point.measured_blur_px.filter(|_| point.source == Source::MarkerOutline)?;
    let [vx, vy] = velocity_px_s(&state.points, k);
    let speed_px_s = vx.hypot(vy);
    (speed_px_s > FAST_PX_S).then(|| (bx * bx + by * by) / (speed_px_s * speed_px_s))
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

/// The motion during the exposure (px), along a given direction, that spreads the second moments of a marker at rest to those of a blob;
/// `None` if the blob without that motion has not the marker's shape.
pub(super) fn measured_px(
    at_rest_px2: [f64; 3],
    blurred_px2: [f64; 3],
    direction: [f64; 2],
) -> Option<[f64; 2]> {
    let added_px2 = blurred_px2[0] + blurred_px2[2] - at_rest_px2[0] - at_rest_px2[2];
    let scale = (12.0 * added_px2.max(0.0)).sqrt() / direction[0].hypot(direction[1]).max(f64::MIN_POSITIVE);
    let blur_px = direction.map(|d| d * scale);
    let (long, short, _) = principal_axes(without_blur(blurred_px2, blur_px));
    let (long_at_rest, short_at_rest, _) = principal_axes(at_rest_px2);
    let is_same = |one: f64, other: f64| (one / other).ln().abs() < SAME_MOMENT;
    (is_same(long, long_at_rest) && is_same(short, short_at_rest)).then_some(blur_px)
}

/// Second moments less those of uniform motion over this displacement (px).
pub(super) fn without_blur([xx, xy, yy]: [f64; 3], [sx, sy]: [f64; 2]) -> [f64; 3] {
    [xx - sx * sx / 12.0, xy - sx * sy / 12.0, yy - sy * sy / 12.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Second moments of a bar (px2).
    const BAR: [f64; 3] = [100.0, 12.0, 30.0];

    #[test]
    fn the_blur_of_a_bar_is_measured_from_its_moments_and_the_direction_of_its_motion() {
        for [sx, sy] in [[12.0, 0.0], [-3.0, 25.0], [0.0, 0.0]] {
            let blurred = [BAR[0] + sx * sx / 12.0, BAR[1] + sx * sy / 12.0, BAR[2] + sy * sy / 12.0];
            let [x, y] = measured_px(BAR, blurred, [0.1 * sx, 0.1 * sy]).expect("a motion");
            assert!((x - sx).hypot(y - sy) < 1e-9, "{x}, {y} px instead of {sx}, {sy} px");
        }
    }

    #[test]
    fn moments_of_another_shape_are_no_motion() {
        let across = measured_px(BAR, [100.0, 12.0, 60.0], [1.0, 0.0]);
        assert_eq!(across, None, "the bar is wider across the motion");
        assert_eq!(measured_px(BAR, [60.0, 12.0, 30.0], [1.0, 0.0]), None, "the bar is shorter");
    }
}
