//! Which samples can be trusted, and what did motion blur do to the angles?
//!
//! Once the whole clip has been seen, every marker's usual look is known; frames in which it looks different are
//! marked, and the smear along the motion while the shutter was open is taken out of the angles.

use super::derivatives;
use super::marker::blob::Aim;
use super::marker::target::Target;
use super::track_state::{Follower, Seen};
use super::tracks::{Sample, Track};
use crate::capture::Camera;
use crate::geometry::Pixel;
use crate::moments::principal_axes;
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, upper_median};
use std::f64::consts::PI;

/// A marker whose half axes differ from the usual ones by more than this (px) has something across it: compression
/// in motion leaves about a tenth of a pixel.
const USUAL_LOOK_PX: f64 = 0.35;
/// Or by this many times their own scatter, where that is larger.
const USUAL_SCATTERS: f64 = 5.0;

/// The track of one follower, in the order of time.
pub(super) fn track(camera: &Camera, follower: &Follower, exposure_s: f64) -> Track {
    let target = &follower.target;
    let smears_px: Vec<[f64; 2]> =
        (0..follower.seen.len()).map(|k| speed_px_s(&follower.seen, k).map(|v| v * exposure_s)).collect();
    let looks: Vec<Look> =
        follower.seen.iter().zip(&smears_px).map(|(s, smear)| look(camera, target, s, *smear)).collect();
    let strange = strangeness(&looks);
    let mut yaw_near_rad = follower.seen.first().map_or(0.0, |s| s.pose.yaw_rad);
    let samples = follower.seen.iter().zip(&looks).zip(strange).map(|((s, look), strange_px)| {
        let aim = Aim { centroid: s.blob.centroid, axis_rad: look.axis_rad };
        let pose = if target.markerless() || target.feature.dot.is_some() {
            s.pose
        } else {
            target.pose(camera, aim, yaw_near_rad)
        };
        yaw_near_rad = pose.yaw_rad;
        let scale_m_per_px = camera.scale_m_per_px(s.blob.centroid, target.height_m());
        let doubtful = strange_px.is_some()
            || s.blob.cut
            || target.markerless() && !s.whole
            || target.off_centre() && !s.turn_known;
        Sample {
            // A rolling shutter takes lower rows later.
            time_s: s.time_s + camera.readout_s * s.blob.centroid.y / camera.size_px[1] as f64,
            x_m: pose.position.x,
            y_m: pose.position.y,
            yaw_rad: (target.tells_yaw() && s.turn_known).then_some(pose.yaw_rad),
            vx_m_s: None,
            vy_m_s: None,
            yaw_rate_rad_s: None,
            ax_m_s2: None,
            ay_m_s2: None,
            // What takes a strip from a marker's side moves its centroid by about as much.
            std_m: scale_m_per_px * (s.blob.std_px + strange_px.unwrap_or(0.0)),
            doubtful,
        }
    });
    Track { object: target.name.to_string(), samples: samples.collect() }
}

/// How long the shutter seems to have been open: markers in motion are longer along it than markers at rest, by the
/// twelfth part of the way squared.  Nothing where nothing moved fast enough to tell.
pub(super) fn exposure_s(camera: &Camera, followers: &[Follower]) -> Option<f64> {
    let mut squares_s2 = Vec::new();
    for follower in followers.iter().filter(|f| !f.target.markerless()) {
        let smears: Vec<(f64, f64)> = (0..follower.seen.len()).map(|k| smear(camera, follower, k)).collect();
        let at_rest: Vec<f64> = smears.iter().filter(|s| s.0 < SLOW_PX_S).map(|s| s.1).collect();
        let Some(usual_px2) = upper_median(at_rest) else { continue };
        let fast = smears.iter().filter(|s| s.0 > FAST_PX_S);
        squares_s2.extend(fast.map(|(speed, px2)| 12.0 * (px2 - usual_px2) / (speed * speed)));
    }
    if squares_s2.len() < LEAST_FAST {
        return None;
    }
    upper_median(squares_s2).map(|square_s2| square_s2.max(0.0).sqrt())
}

/// Below this (px/s) a marker counts as at rest: it smears by less than a pixel in any exposure.
const SLOW_PX_S: f64 = 30.0;
/// Above this (px/s) smear can be measured: 2 px at 1/200 s.
const FAST_PX_S: f64 = 400.0;
/// Fewer samples than this in fast motion tell no exposure.
const LEAST_FAST: usize = 4;

/// Speed (px/s), and by how much both second moments together are beyond the expected ones (px2): smear adds as much
/// to them whichever way it runs, though it turns the axes of a bar across which it runs askew.
fn smear(camera: &Camera, follower: &Follower, k: usize) -> (f64, f64) {
    let seen = &follower.seen[k];
    let [vx, vy] = speed_px_s(&follower.seen, k);
    let [xx, _, yy] = seen.blob.linear_covariance_px2;
    let [due_xx, _, due_yy] = follower.target.picture(camera, seen.pose).covariance;
    (vx.hypot(vy), xx + yy - due_xx - due_yy)
}

/// Speed in the picture (px/s) over the two intervals before, around or after a sample, whichever are the most alike:
/// no impact lies between them.
fn speed_px_s(seen: &[Seen], k: usize) -> [f64; 2] {
    let rate = |i: usize| {
        let (before, after) = (&seen[i], &seen[i + 1]);
        let dt_s = after.time_s - before.time_s;
        let (from, to) = (before.blob.centroid, after.blob.centroid);
        [(to.x - from.x) / dt_s, (to.y - from.y) / dt_s]
    };
    let mut best = ([0.0, 0.0], f64::INFINITY);
    for first in k.saturating_sub(2)..=k {
        if first + 2 < seen.len() {
            let ([ux, uy], [vx, vy]) = (rate(first), rate(first + 1));
            let change = (vx - ux).hypot(vy - uy);
            if change < best.1 {
                // At the middle sample the mean, at the outer ones the nearer interval's rate.
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

/// Second moments without those of a smear of this length (px).
fn unsmeared([xx, xy, yy]: [f64; 3], [sx, sy]: [f64; 2]) -> [f64; 3] {
    [xx - sx * sx / 12.0, xy - sx * sy / 12.0, yy - sy * sy / 12.0]
}

/// What a marker looked like, the smear of its motion taken out.
struct Look {
    /// Direction of its long axis in the picture (rad).
    axis_rad: f64,
    /// Mean radius and half axes, less the expected ones (px).
    excess_px: [f64; 3],
    /// Length of the smear (px).
    smear_px: f64,
}

fn look(camera: &Camera, target: &Target, seen: &Seen, smear_px: [f64; 2]) -> Look {
    let due = target.picture(camera, seen.pose);
    let seen_px2 = if smear_px[0].hypot(smear_px[1]) < LONG_SMEAR_PX {
        seen.blob.covariance_px2
    } else {
        seen.blob.linear_covariance_px2
    };
    let (long, short, axis_rad) = principal_axes(unsmeared(seen_px2, smear_px));
    let (due_long, due_short, _) = principal_axes(due.covariance);
    let half_axis_px = |of: f64, due: f64| 2.0 * of.sqrt() - 2.0 * due.sqrt();
    let radius_px = (seen.blob.area_px2 / PI).sqrt() - (due.area / PI).sqrt();
    Look {
        axis_rad,
        excess_px: [radius_px, half_axis_px(long, due_long), half_axis_px(short, due_short)],
        smear_px: smear_px[0].hypot(smear_px[1]),
    }
}

/// By how much (px) the size of each sight differs from this marker's usual one, where that is more than noise.
fn strangeness(looks: &[Look]) -> Vec<Option<f64>> {
    let mut strangeness: Vec<Option<f64>> = vec![None; looks.len()];
    for i in 0..3 {
        let Some(usual) = upper_median(looks.iter().map(|look| look.excess_px[i])) else { continue };
        let middle_px = upper_median(looks.iter().map(|look| (look.excess_px[i] - usual).abs()));
        let scatter = STD_OVER_MEDIAN_ABSOLUTE * middle_px.unwrap_or(0.0);
        for (strange, look) in strangeness.iter_mut().zip(looks) {
            let off_px = (look.excess_px[i] - usual).abs();
            let limit_px = (USUAL_SCATTERS * scatter).max(USUAL_LOOK_PX) + SMEAR_KNOWN * look.smear_px;
            if off_px > limit_px {
                *strange = Some(strange.map_or(off_px, |s| s.max(off_px)));
            }
        }
    }
    strangeness
}

/// From a smear of this length (px) on the dead band turns axes by more than noise does without it.
const LONG_SMEAR_PX: f64 = 5.0;
/// How well the length of a smear is known: the shutter's opening and closing is anyone's guess.
const SMEAR_KNOWN: f64 = 0.1;

/// Makes the standard deviations at least as large as the samples' scatter about smooth motion shows: compression
/// moves edges by more than the grey levels' noise.
pub(super) fn scale_noise(tracks: &mut [Track]) {
    let unsteadiness: Vec<f64> =
        tracks.iter().flat_map(|track| derivatives::unsteadiness(&track.samples)).collect();
    if unsteadiness.len() < LEAST_FAST {
        return;
    }
    let factor = upper_median(unsteadiness).unwrap_or(1.0).max(1.0);
    for sample in tracks.iter_mut().flat_map(|track| &mut track.samples) {
        sample.std_m *= factor;
    }
}

/// When a follower was out of sight, and whether it left the picture.
pub(super) fn gaps(camera: &Camera, follower: &Follower, times_s: &[f64]) -> Vec<String> {
    let name = follower.target.name;
    let mut gaps = Vec::new();
    let Some(last) = follower.seen.last() else { return vec![format!("`{name}` was never seen again")] };
    for pair in follower.seen.windows(2) {
        let missed = pair[1].frame - pair[0].frame - 1;
        if missed > 0 {
            let (from_s, to_s) = (pair[0].time_s, pair[1].time_s);
            gaps.push(format!(
                "`{name}` was not seen in {missed} frames between {from_s:.3} and {to_s:.3} s"
            ));
        }
    }
    let missed = times_s.len() - 1 - last.frame;
    if missed > 0 {
        let reason =
            if near_edge(camera, follower, last) { "left the picture" } else { "was not found again" };
        gaps.push(format!(
            "`{name}` {reason} after {:.3} s; its last {missed} frames are missing",
            last.time_s
        ));
    }
    gaps
}

fn near_edge(camera: &Camera, follower: &Follower, last: &Seen) -> bool {
    let [vx, vy] = speed_px_s(&follower.seen, follower.seen.len() - 1);
    let Pixel { x, y } = last.blob.centroid;
    let size_px = last.blob.area_px2.sqrt();
    let frames_on = |v: f64| NEAR_EDGE_S * v.abs() + size_px;
    let near = |at: f64, v: f64, size: usize| at < frames_on(v) || at > size as f64 - frames_on(v);
    last.blob.cut || near(x, vx, camera.size_px[0]) || near(y, vy, camera.size_px[1])
}

/// An object this far (s) from the picture's edge at its speed has left when it is gone.
const NEAR_EDGE_S: f64 = 0.1;
