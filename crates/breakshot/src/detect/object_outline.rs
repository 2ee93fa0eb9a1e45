//! Where is an object whose marker is seen badly: what does its own outline show?
//!
//! A small marker in a shadow is known to some tenths of a pixel, if at all, where the outline of the object around it is known to some hundredths.
//! Markers are placed and outlines are measured by hand, so that the poses by both differ by some tenths of a millimetre, always alike in the object's
//! frame. Where most frames show the outline, it gives all positions; otherwise it replaces the marker in single frames, at that difference.

use super::markerless::edge_fit::OutlineFit;
use super::postprocess::DoubtedTrack;
use super::track_state::TrackState;
use super::tracks::Sample;
use super::why::reason::Doubt;
use crate::capture::Camera;
use crate::geometry::{Point, Pose, nearest_equivalent_rad, wrapped_rad};
use crate::object::Shape;
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, median};
use std::f64::consts::{PI, TAU};

/// The outline gives all positions if it is measured in this part of the frames, ...
const MOST: f64 = 0.8;
/// ... and if it is this many times as accurate as the marker, or the marker is doubtful in this part of the frames.
const MORE_ACCURATE: f64 = 2.0;
const OFTEN_DOUBTFUL: f64 = 0.2;
/// Fewest frames that show marker and outline well, from which their difference is known.
const FEWEST_COMPARED: usize = 3;
/// No more frames than these have errors that are independent.
const MOST_INDEPENDENT: f64 = 9.0;
/// Marker and outline are further apart than they can be placed and measured (m), or than this many standard deviations.
const MOST_APART_M: f64 = 1.5e-3;
const MOST_APART_STDS: f64 = 4.0;
/// An outline shows the yaw if it covers less than this part of the circle around it.
const SHOWS_YAW: f64 = 0.75;

/// The pose of an object in one frame, by its own outline.
#[derive(Clone, Copy)]
struct ByOutline {
    pose: Pose,
    /// Standard deviation of the position (m).
    std_m: f64,
}

/// By how much the pose by the marker differs from that by the outline, in the object's frame.
#[derive(Clone, Copy)]
struct Difference {
    offset: Point,
    yaw_rad: f64,
    /// Standard deviation of the offset (m).
    std_m: f64,
}

/// Replaces positions by a marker that is seen badly by those of the object's outline.
pub(super) fn refine(camera: &Camera, state: &TrackState, doubted: &mut DoubtedTrack) {
    if state.target.is_markerless() || !state.half_turn_known {
        return;
    }
    let shape = &state.target.object.shape;
    let DoubtedTrack { track, doubts } = doubted;
    let scale_m_per_px =
        |k: usize| camera.scale_m_per_px(state.points[k].blob.centroid, state.target.height_m());
    let outlines: Vec<Option<ByOutline>> = (state.points.iter().zip(&track.samples).enumerate())
        .map(|(k, (point, sample))| {
            let near_rad = sample.yaw_rad.unwrap_or(point.pose.yaw_rad);
            Some(ByOutline::new(&point.object_outline?, shape, near_rad, scale_m_per_px(k)))
        })
        .collect();
    let samples = &mut track.samples;
    let compared: Vec<(&Sample, ByOutline)> = (samples.iter().zip(&outlines))
        .filter(|(sample, _)| !sample.doubtful)
        .filter_map(|(sample, outline)| Some((sample, (*outline)?)))
        .collect();
    let difference = difference(&compared);
    if difference.is_some_and(|d| d.is_implausible()) {
        return;
    }
    let gives_all = gives_all_positions(samples, &outlines);
    let Some(difference) = gives_all.then_some(Difference::NONE).or(difference) else { return };
    let shows_yaw = shape.area_m2() < SHOWS_YAW * PI * shape.outer_radius_m().powi(2);
    for ((sample, outline), doubts) in samples.iter_mut().zip(outlines).zip(doubts) {
        let Some(ByOutline { pose, std_m }) = outline else { continue };
        let std_m = std_m.hypot(difference.std_m);
        let position = pose.table_from_body(difference.offset);
        let apart_m = sample.position().distance(position);
        let is_elsewhere = apart_m > MOST_APART_M.max(MOST_APART_STDS * sample.std_m.hypot(std_m));
        let is_better = gives_all || sample.doubtful || MORE_ACCURATE * std_m < sample.std_m;
        if !is_better || is_elsewhere || !doubts.iter().all(is_of_marker) {
            continue;
        }
        let yaw_rad = if shows_yaw {
            Some(pose.yaw_rad + difference.yaw_rad)
        } else {
            sample.yaw_rad.filter(|_| !sample.doubtful)
        };
        *sample = Sample::new(sample.time_s, position, yaw_rad, std_m);
        doubts.clear();
    }
}

/// Whether a position is doubtful because the marker is seen badly, which the outline of the object makes good.
fn is_of_marker(doubt: &Doubt) -> bool {
    matches!(
        doubt,
        Doubt::Size { .. }
            | Doubt::PartOfMarker { .. }
            | Doubt::UncertainYaw { .. }
            | Doubt::OutlineElsewhere
            | Doubt::OutlineNotSeen
            | Doubt::UnevenLight { .. }
    )
}

/// Whether the outlines give all positions: most frames show them, and the marker badly.
fn gives_all_positions(samples: &[Sample], outlines: &[Option<ByOutline>]) -> bool {
    let found = outlines.iter().flatten().count();
    let doubtful = samples.iter().filter(|sample| sample.doubtful).count();
    let n = samples.len() as f64;
    let of_outline = median(outlines.iter().flatten().map(|outline| outline.std_m));
    let of_marker = median(samples.iter().map(|sample| sample.std_m));
    let is_more_accurate = of_outline.zip(of_marker).is_some_and(|(o, m)| MORE_ACCURATE * o < m);
    found as f64 >= MOST * n && (is_more_accurate || doubtful as f64 > OFTEN_DOUBTFUL * n)
}

/// The difference of the poses by marker and outline, from the frames that show both well; `None` if they are too few.
fn difference(compared: &[(&Sample, ByOutline)]) -> Option<Difference> {
    if compared.len() < FEWEST_COMPARED {
        return None;
    }
    let offsets: Vec<Point> = compared.iter().map(|(s, o)| o.pose.body_from_table(s.position())).collect();
    let offset = Point::new(median(offsets.iter().map(|p| p.x))?, median(offsets.iter().map(|p| p.y))?);
    let scatter_m = STD_OVER_MEDIAN_ABSOLUTE * median(offsets.iter().map(|p| p.distance(offset)))?;
    let turned_rad = |(s, o): &(&Sample, ByOutline)| Some(wrapped_rad(s.yaw_rad? - o.pose.yaw_rad));
    let yaw_rad = median(compared.iter().filter_map(turned_rad)).unwrap_or(0.0);
    let marker_std_m = median(compared.iter().map(|(s, _)| s.std_m))?;
    // At rest the errors of many frames are alike.
    let n = (compared.len() as f64).min(MOST_INDEPENDENT);
    Some(Difference { offset, yaw_rad, std_m: marker_std_m.hypot(scatter_m) / n.sqrt() })
}

impl Difference {
    const NONE: Self = Self { offset: Point::ORIGIN, yaw_rad: 0.0, std_m: 0.0 };

    /// Whether the outline that was found is none of the object.
    fn is_implausible(&self) -> bool {
        self.offset.to_vec().length() > MOST_APART_M.max(MOST_APART_STDS * self.std_m)
    }
}

impl ByOutline {
    /// The pose of a fit; of the yaws at which the outline looks the same, the one nearest to `near_rad`.
    fn new(fit: &OutlineFit, shape: &Shape, near_rad: f64, scale_m_per_px: f64) -> Self {
        let period_rad = shape.rotation_symmetry_rad().filter(|&period_rad| period_rad > 0.0).unwrap_or(TAU);
        let yaw_rad = nearest_equivalent_rad(fit.pose.yaw_rad, near_rad, period_rad);
        Self { pose: Pose { yaw_rad, ..fit.pose }, std_m: fit.std_px * scale_m_per_px }
    }
}
