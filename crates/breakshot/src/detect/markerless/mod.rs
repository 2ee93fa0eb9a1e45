//! Where is an object without a marker in this frame?
//!
//! Its outline is fitted to the edges at the predicted pose. If it is not visible there, the object was struck, and
//! the outline is searched as far around as the object can have moved.

pub(super) mod background;
pub(super) mod edge_fit;
pub(super) mod edge_visibility;
pub(super) mod outline_size;
pub(super) mod side_band;

use super::marker::blob::Blob;
use super::marker::target::Target;
use super::motion_blur::FrameView;
use super::track_state::{Observation, Source, TrackState};
use crate::capture::Camera;
use crate::geometry::moments::principal_axes;
use crate::geometry::{Pixel, Pose, Vec2};
use edge_fit::{OutlineFit, SearchRange};
use edge_visibility::OutlineView;

/// Least visibility over the usual one for an outline at its predicted pose.
const USUAL_VISIBILITY: f64 = 0.8;
/// Least visibility over the usual one for an outline found by a search.
pub(super) const LEAST_VISIBILITY: f64 = 0.5;
/// Least visibility of the outline of an object whose marker is covered.
const CLEARLY_VISIBLE: f64 = 0.7;
/// Least part of the outline of an object with a marker that is measured: with less the position is biased by what covers the rest. At rest the marker
/// excludes the outline of a shadow; of an outline that moves by more than [`BLURRED_PX`] during the exposure, blurred edges beside it are taken for its own more easily.
const LEAST_MEASURED_SHARP: f64 = 0.5;
const LEAST_MEASURED_BLURRED: f64 = 0.8;
pub(super) const BLURRED_PX: f64 = 1.0;
/// Upper bound of an object's speed (m/s) in the frame in which it is struck.
const FASTEST_M_S: f64 = 2.0;
/// Upper bound of its angular velocity (rad/s).
const FASTEST_SPIN_RAD_S: f64 = 15.0;
/// Largest radius of a search (m), however long an object was not observed.
const LARGEST_RADIUS_M: f64 = 0.06;
/// Largest rotation of a search (rad).
const LARGEST_ROTATION_RAD: f64 = 1.0;

/// The outline at the predicted pose, if it is visible there.
pub(super) fn observed_at(view: &FrameView, state: &TrackState, predicted: Pose) -> Option<Observation> {
    let blur_px = view.blur_px(&state.target, predicted, state.velocity());
    let outline = OutlineView::of_target(&view.frame.image, view.camera, &state.target);
    let fit = outline.fitted(predicted, blur_px)?;
    let observation = observation(view, state, &fit, blur_px);
    (state.contrast_ratio(&observation.blob) > USUAL_VISIBILITY).then_some(observation)
}

/// How far around its predicted pose an outline is searched.
pub(super) fn search_range(view: &FrameView, state: &TrackState) -> SearchRange {
    range_after(state.unobserved_s(view.frame.time_s).unwrap_or(view.interval_s))
}

/// How far an object may have moved in this time (s).
fn range_after(unobserved_s: f64) -> SearchRange {
    SearchRange {
        radius_m: (FASTEST_M_S * unobserved_s).min(LARGEST_RADIUS_M),
        angle_rad: (FASTEST_SPIN_RAD_S * unobserved_s).min(LARGEST_ROTATION_RAD),
    }
}

/// An object whose marker is covered, by its own outline at the predicted pose.
pub(super) fn observed_without_marker(
    view: &FrameView,
    state: &TrackState,
    predicted: Pose,
) -> Option<Observation> {
    let blur_px = view.blur_px(&state.target, predicted, state.velocity());
    let outline = OutlineView::of_target(&view.frame.image, view.camera, &state.target);
    let fit = outline.fitted(predicted, blur_px).filter(|fit| fit.visible_fraction > CLEARLY_VISIBLE)?;
    let blob = state.expected_blob(view.camera, fit.pose, fit.std_px);
    Some(Observation {
        blur_px: blur_px[0].hypot(blur_px[1]),
        measured_fraction: fit.measured_fraction,
        yaw_known: state.target.object.shape.rotation_symmetry_rad() != Some(0.0),
        ..Observation::new(fit.pose, Source::ObjectOutline, blob)
    })
}

/// The object's own outline near the pose by its marker, if enough of it is measured: blurred as the marker has moved since the last frame, or else as
/// the outline has.
pub(super) fn fitted_beside_marker(view: &FrameView, state: &TrackState, pose: Pose) -> Option<OutlineFit> {
    let outline = OutlineView::of_target(&view.frame.image, view.camera, &state.target);
    let blurred = |pose: Pose, velocity: Vec2| {
        let blur_px = view.blur_px(&state.target, pose, velocity);
        let is_blurred = blur_px[0].hypot(blur_px[1]) > BLURRED_PX;
        let least = if is_blurred { LEAST_MEASURED_BLURRED } else { LEAST_MEASURED_SHARP };
        let fit = outline.fitted(pose, blur_px)?;
        Some((fit, fit.measured_fraction >= least))
    };
    let time_s = view.frame.time_s;
    let (by_marker, is_measured) = blurred(pose, state.velocity_to(pose, time_s).unwrap_or_default())?;
    if is_measured {
        return Some(by_marker);
    }
    let last = state.points.last()?;
    let moved = by_marker.pose.position - last.object_outline?.pose.position;
    let (fit, is_measured) = blurred(by_marker.pose, moved / (time_s - last.time_s))?;
    is_measured.then_some(fit)
}

/// The outline near the predicted pose, clear of all objects observed so far. Where the last positions are doubtful, so is the motion that
/// they imply: the outline is searched around the last position that was well measured, too.
pub(super) fn observed_near(
    view: &FrameView,
    state: &TrackState,
    predicted: Pose,
    observations: &[Option<Observation>],
) -> Option<Observation> {
    let around_predicted = observed_around(view, state, (predicted, search_range(view, state)), observations);
    around_predicted.or_else(|| {
        let last = state.before_doubtful()?;
        let around = (last.pose, range_after(view.frame.time_s - last.time_s));
        observed_around(view, state, around, observations)
    })
}

/// The outline within a range around a pose, clear of all objects observed so far.
fn observed_around(
    view: &FrameView,
    state: &TrackState,
    (centre, range): (Pose, SearchRange),
    observations: &[Option<Observation>],
) -> Option<Observation> {
    let time_s = view.frame.time_s;
    let others: Vec<Pose> = observations.iter().flatten().map(|o| o.pose).collect();
    let clearance_m = state.target.object.shape.area_m2().sqrt() / 2.0;
    let free = |pose: Pose| others.iter().all(|other| other.position.distance(pose.position) > clearance_m);
    let outline = OutlineView::of_target(&view.frame.image, view.camera, &state.target);
    let around = outline.searched(centre, range, free);
    let here = outline.fitted(centre, [0.0, 0.0]).filter(|fit| free(fit.pose));
    let more_visible = |a: &OutlineFit, b: &OutlineFit| a.visible_fraction.total_cmp(&b.visible_fraction);
    let best = around.into_iter().chain(here).max_by(more_visible)?;
    // An object that moved to this pose is blurred by its motion.
    let velocity = state.velocity_to(best.pose, time_s).unwrap_or_default();
    let blur_px = view.blur_px(&state.target, best.pose, velocity);
    let blurred =
        outline.fitted(best.pose, blur_px).filter(|fit| fit.visible_fraction > best.visible_fraction);
    let observation = observation(view, state, &blurred.unwrap_or(best), blur_px);
    (state.contrast_ratio(&observation.blob) > LEAST_VISIBILITY).then_some(observation)
}

fn observation(view: &FrameView, state: &TrackState, fit: &OutlineFit, blur_px: [f64; 2]) -> Observation {
    let blob = silhouette(&state.target, view.camera, fit);
    let blur_px = blur_px[0].hypot(blur_px[1]);
    let measured_fraction = fit.measured_fraction;
    Observation { measured_fraction, blur_px, ..Observation::new(fit.pose, Source::Marker, blob) }
}

/// A fitted outline in the form of a blob: its projection, with the visible fraction as contrast.
pub(super) fn silhouette(target: &Target, camera: &Camera, fit: &OutlineFit) -> Blob {
    let projection = target.projection(camera, fit.pose);
    let reach_px = principal_axes(projection.covariance).0.sqrt() * 2.0;
    let [width, height] = camera.size_px.map(|size| size as f64 - 1.0);
    let inside = |at: f64, size: f64| at > reach_px && at < size - reach_px;
    let [x, y] = projection.centroid;
    Blob {
        centroid: Pixel::new(x, y),
        std_px: fit.std_px,
        area_px2: projection.area,
        covariance_px2: projection.covariance,
        linear_covariance_px2: projection.covariance,
        background: 1.0,
        contrast: fit.visible_fraction,
        background_rms: 0.0,
        at_border: !(inside(x, width) && inside(y, height)),
    }
}
