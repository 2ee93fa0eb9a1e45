//! Where is a marker that was not found whole: which part of its outline is visible?

use super::prediction::{PREDICTION_STD_M, Prediction};
use crate::detect::marker::outline::{MarkerFit, MarkerView, Range};
use crate::detect::markerless::edge_fit::OutlineFit;
use crate::detect::markerless::{self, BLURRED_PX};
use crate::detect::motion_blur::FrameView;
use crate::detect::track_state::{COMPLETE, Observation, Source};
use crate::geometry::Pose;

/// Least visible fraction of the outline of a marker near its predicted pose, ...
pub(in crate::detect) const LEAST_VISIBLE: f64 = 0.35;
/// ... the largest standard deviation of a position by it (px): with a larger one the edges are those of something else, ...
pub(super) const MOST_STD_PX: f64 = 1.0;
/// ... and the least fraction of one that was found by a search around it.
const CLEARLY_VISIBLE: f64 = 0.5;
/// A part of a marker of which no edge is seen is within its radius of the predicted position, and so many standard deviations.
const PART_STDS: f64 = 2.0;
/// Of the frames that show the marker whole, one in so many is compared with the object's own outline.
const COMPARED_FRAMES: usize = 4;
/// Upper bounds of the speed (m/s) and of the angular velocity (rad/s) of an object in the frame in which it is struck, and of the search
/// around its predicted pose (m, rad), however long it was not observed.
const STRUCK_M_S: f64 = 1.0;
const STRUCK_RAD_S: f64 = 15.0;
const LARGEST_RADIUS_M: f64 = 0.04;
const LARGEST_ROTATION_RAD: f64 = 0.5;

impl Prediction<'_, '_> {
    /// The observation with the fit of the marker's outline. Where the marker was not found whole, its visible outline counts, and where it
    /// is covered the object's own outline.
    pub(super) fn outlined(
        &self,
        view: &FrameView,
        observations: &[Option<Observation>],
        number: usize,
    ) -> Option<Observation> {
        let Self { state, pose: predicted } = *self;
        let free = |pose: Pose| {
            let height_m = state.target.height_m();
            let at = view.camera.pixel_from_table(pose.table_from_body(state.target.feature.at_m), height_m);
            let reach_px = state.expected_area_px2(view.camera, pose).sqrt() / 2.0;
            let mut others = observations.iter().enumerate().filter(|(k, _)| *k != number);
            !others.any(|(_, other)| other.is_some_and(|other| other.covers(at, reach_px)))
        };
        if let Some(found) = self.blurred_pair(view, observations[number].as_ref()).filter(|o| free(o.pose)) {
            return Some(found);
        }
        let mut observed = observations[number].map(|observation| self.beside_outline(view, &observation));
        let outline = observed.and_then(|o| o.outline).filter(|fit| self.is_visible(view, fit));
        match (&observed, outline) {
            (Some(observation), Some(_)) if state.is_complete(view.camera, observation) => return observed,
            (Some(_), Some(outline)) => return Some(self.by_outline(view, outline)),
            (Some(observation), None) if self.is_alone(view, observation) => {
                if let Some(blur_px) = self.measured_blur_px(view, &observation.blob) {
                    // The marker is whole, and its outline is blurred by more than was assumed.
                    let measured = Observation { measured_blur_px: Some(blur_px), ..*observation };
                    let measured = self.beside_outline(view, &measured);
                    if measured.outline.is_some() {
                        return Some(measured);
                    }
                    observed = Some(measured);
                }
            }
            _ => {}
        }

        // Where it is predicted, or near there, clear of all other markers
        if let Some(fit) = self.fit_at_prediction(view).filter(|fit| free(fit.pose)) {
            return Some(self.by_outline(view, fit));
        }
        // A small part of a marker is where the marker is expected.
        let part_m = state.target.feature.shape.outer_radius_m() + PART_STDS * PREDICTION_STD_M;
        let is_possible = |o: &Observation| {
            let is_mostly_seen = state.signal_change(view.camera, o.pose, &o.blob).abs() < 2.0 * COMPLETE;
            is_mostly_seen || o.dot.is_some() || o.pose.position.distance(predicted.position) < part_m
        };
        if observed.as_ref().is_some_and(is_possible) || state.is_at_border() {
            return observed;
        }
        let unobserved_s = state.unobserved_s(view.frame.time_s).unwrap_or(view.interval_s);
        let range = Range {
            radius_m: (PREDICTION_STD_M + STRUCK_M_S * unobserved_s).min(LARGEST_RADIUS_M),
            angle_rad: (STRUCK_RAD_S * unobserved_s).min(LARGEST_ROTATION_RAD),
        };
        let blur_px = |pose: Pose| {
            let velocity = state.velocity_to(pose, view.frame.time_s).unwrap_or_default();
            free(pose).then(|| view.blur_px(&state.target, pose, velocity))
        };
        self.predicted_marker(view)
            .searched(predicted, range, blur_px)
            .filter(|fit| self.is_visible(view, fit) && fit.visible_fraction > CLEARLY_VISIBLE)
            .map(|fit| self.by_outline(view, fit))
            .or(observed)
            .or_else(|| markerless::observed_without_marker(view, state, predicted))
    }

    /// The fit of the object's own outline beside its marker, where the marker is seen badly; after that also now and then where it is seen well, so that
    /// the poses by both can be compared.
    pub(super) fn object_outline(
        &self,
        view: &FrameView,
        observation: &Observation,
        frame: usize,
    ) -> Option<OutlineFit> {
        let state = self.state;
        let is_sharp = self.is_whole_and_sharp(view, observation);
        // The outline of a whole marker is rough while it moves.
        let is_seen_well = is_sharp
            || state.is_complete(view.camera, observation)
                && observation.blur_px > BLURRED_PX
                && !state.has_object_outline;
        let is_compared = match observation.source {
            Source::Marker if is_seen_well => {
                state.has_object_outline && frame.is_multiple_of(COMPARED_FRAMES)
            }
            Source::Marker | Source::MarkerOutline => true,
            Source::ObjectOutline => false,
        };
        let fit = || markerless::fitted_beside_marker(view, state, observation.pose);
        is_compared.then(fit).flatten()
    }

    fn is_whole_and_sharp(&self, view: &FrameView, observation: &Observation) -> bool {
        let height_m = self.state.target.height_m();
        let scale_m_per_px = view.camera.scale_m_per_px(observation.blob.centroid, height_m);
        let is_sharp = |fit: MarkerFit| fit.has_known_position(scale_m_per_px) && !fit.has_rough_yaw();
        self.state.is_complete(view.camera, observation) && observation.outline.is_some_and(is_sharp)
    }

    /// The fit of the marker's outline at the predicted pose; `None` if too little of it is visible there.
    pub(super) fn fit_at_prediction(&self, view: &FrameView) -> Option<MarkerFit> {
        self.predicted_marker(view).fitted(self.pose).filter(|fit| self.is_visible(view, fit))
    }

    /// Whether enough of the outline is visible for a position.
    fn is_visible(&self, view: &FrameView, fit: &MarkerFit) -> bool {
        let height_m = self.state.target.height_m();
        let at = view.camera.pixel_from_table(self.pose.position, height_m);
        let most_std_m = MOST_STD_PX * view.camera.scale_m_per_px(at, height_m);
        fit.visible_fraction > LEAST_VISIBLE && fit.std_m < most_std_m
    }

    /// The marker, blurred as it is predicted to move.
    fn predicted_marker<'v>(&'v self, view: &'v FrameView) -> MarkerView<'v> {
        let velocity = self.state.velocity_at(view.frame.time_s);
        self.marker(view, view.blur_px(&self.state.target, self.pose, velocity))
    }

    /// The observation with the fit of the marker's outline near it, blurred as the marker shows or as it moved since the last frame.
    fn beside_outline(&self, view: &FrameView, observation: &Observation) -> Observation {
        let state = self.state;
        let velocity = || state.velocity_to(observation.pose, view.frame.time_s).unwrap_or_default();
        let by_velocity = || view.blur_px(&state.target, observation.pose, velocity());
        let marker = self.marker(view, observation.measured_blur_px.unwrap_or_else(by_velocity));
        let outline = if state.is_complete(view.camera, observation) {
            marker.fitted_near(observation.pose)
        } else {
            marker.fitted(observation.pose)
        };
        Observation { outline, ..*observation }
    }

    fn marker<'v>(&'v self, view: &'v FrameView, blur_px: [f64; 2]) -> MarkerView<'v> {
        MarkerView {
            image: &view.frame.image,
            camera: view.camera,
            target: &self.state.target,
            appearance: self.state.appearance(blur_px),
        }
    }

    /// The observation that a fit of the marker's outline implies.
    pub(super) fn by_outline(&self, view: &FrameView, fit: MarkerFit) -> Observation {
        let Self { state, .. } = *self;
        let at = view.camera.pixel_from_table(fit.pose.position, state.target.height_m());
        let std_px = fit.std_m / view.camera.scale_m_per_px(at, state.target.height_m());
        let blob = state.expected_blob(view.camera, fit.pose, std_px);
        Observation {
            outline: Some(fit),
            yaw_known: fit.knows_yaw(),
            ..Observation::new(fit.pose, Source::MarkerOutline, blob)
        }
    }
}
