//! Where is an object expected in this frame, and is a component of the image its marker?

use crate::capture::Camera;
use crate::detect::label::{Component, Labeller, Window};
use crate::detect::marker::blob::ComponentPatch;
use crate::detect::marker::dot::DotPrediction;
use crate::detect::marker::target::BLUR_VARIANCE_PX2;
use crate::detect::markerless;
use crate::detect::motion_blur::FrameView;
use crate::detect::threshold::{Level, search_thresholds};
use crate::detect::track_state::{COMPLETE, Observation, Source, TrackState};
use crate::detect::why::reason::Rejection;
use crate::geometry::moments::{compactness, principal_axes};
use crate::geometry::{Pixel, Pose, wrapped_rad};
use std::ops::RangeInclusive;

/// Upper bound of an object's speed (m/s): strikers reach 1 or 2 m/s, and a struck object leaves at less than twice
/// that.
pub(in crate::detect) const FASTEST_M_S: f64 = 4.0;
/// Standard deviation of the change of velocity between frames (m/s).
const VELOCITY_CHANGE_STD_M_S: f64 = 0.5;
/// Standard deviation of the prediction without a change of velocity (m).
pub(super) const PREDICTION_STD_M: f64 = 0.002;
/// Standard deviations of the logarithms of a marker's area in whole pixels, ...
const AREA_STD: f64 = 0.2;
/// ... of its contrast and its compactness, ...
const APPEARANCE_STD: f64 = 0.1;
/// ... and of its elongation, which motion blur changes.
const ELONGATION_STD: f64 = 0.2;
/// Distance from the prediction (standard deviations) within which a partly visible marker is accepted.
const NEAR_STDS: f64 = 3.0;
/// Range of a component's area over the expected one, with or without an occlusion.
pub(in crate::detect) const AREA_RATIOS: RangeInclusive<f64> = 0.2..=1.6;
/// Largest ratio of the contrasts of a partly and a completely visible marker.
const SAME_CONTRAST: f64 = 1.5;

/// A component that may be a tracked marker.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct Detection {
    pub component: Component,
    pub level: Level,
}

/// One region of the image, at each level at which it was detected.
pub(super) type Region = Vec<Detection>;

/// An object and its predicted pose.
#[derive(Clone, Copy)]
pub(in crate::detect) struct Prediction<'s, 'a> {
    pub state: &'s TrackState<'a>,
    pub pose: Pose,
}

impl Prediction<'_, '_> {
    /// Largest distance of the object from its prediction (m).
    pub(in crate::detect) fn search_radius_m(&self, view: &FrameView) -> f64 {
        let radius_m = self.state.target.feature.shape.outer_radius_m();
        // An object that left the image over its border does not reappear far inside it.
        if self.state.is_at_border() {
            return NEAR_STDS * PREDICTION_STD_M + radius_m;
        }
        let incomplete_s = self.state.incomplete_s(view.frame.time_s).unwrap_or(view.interval_s);
        FASTEST_M_S * incomplete_s + radius_m
    }

    /// How far around its prediction a marker or an outline is searched (m).
    pub(in crate::detect) fn reach_m(&self, view: &FrameView) -> f64 {
        if self.state.target.is_markerless() {
            markerless::search_range(view, self.state).radius_m
        } else {
            self.search_radius_m(view)
        }
    }

    /// Standard deviation of the predicted position (m).
    fn std_m(&self, view: &FrameView) -> f64 {
        let unobserved_s = self.state.unobserved_s(view.frame.time_s).unwrap_or(view.interval_s);
        PREDICTION_STD_M + VELOCITY_CHANGE_STD_M_S * unobserved_s
    }

    /// The most likely detection of a region by position and area, and its cost.
    pub(super) fn best<'r>(&self, view: &FrameView, region: &'r Region) -> (f64, &'r Detection) {
        let costs = region.iter().map(|detection| (self.cost(view, detection), detection));
        costs.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::INFINITY, &region[0]))
    }

    /// Squared deviations of position and area (standard deviations); infinite where the object cannot be.
    fn cost(&self, view: &FrameView, detection: &Detection) -> f64 {
        if self.state.target.is_markerless() || detection.level.is_dark() != self.state.is_dark() {
            return f64::INFINITY;
        }
        let distance_m = self.distance_m(view.camera, detection.component.centroid());
        let expected_px2 = self.state.expected_area_px2(view.camera, self.pose);
        let ratio = detection.component.area_px as f64 / expected_px2;
        if distance_m.is_nan() || distance_m > self.search_radius_m(view) || !AREA_RATIOS.contains(&ratio) {
            return f64::INFINITY;
        }
        (distance_m / self.std_m(view)).powi(2) + (ratio.ln() / AREA_STD).powi(2)
    }

    /// Distance of a marker's centroid from the predicted one (m).
    pub(in crate::detect) fn distance_m(&self, camera: &Camera, centroid: Pixel) -> f64 {
        let target = &self.state.target;
        let position = camera.table_from_pixel(centroid, target.height_m());
        position.distance(self.pose.table_from_body(target.feature.at_m))
    }

    /// Whether a marker's centroid is where the object may be one frame after it was observed.
    pub(super) fn is_near(&self, view: &FrameView, centroid: Pixel) -> bool {
        let near_m = NEAR_STDS * (PREDICTION_STD_M + VELOCITY_CHANGE_STD_M_S * view.interval_s);
        self.distance_m(view.camera, centroid) < near_m
    }

    /// Whether a detection lies where the object's marker is without a change of velocity.
    pub(super) fn expects(&self, view: &FrameView, detection: &Detection) -> bool {
        self.cost(view, detection).is_finite()
            && self.distance_m(view.camera, detection.component.centroid()) < NEAR_STDS * PREDICTION_STD_M
    }

    /// The detection as the object's marker, complete or partly covered; `None` if it cannot be that.
    pub(super) fn observation(&self, view: &FrameView, detection: &Detection) -> Option<Observation> {
        self.judged(view, detection).ok()
    }

    /// The detection as the object's marker, or why it cannot be that.
    pub(in crate::detect) fn judged(
        &self,
        view: &FrameView,
        detection: &Detection,
    ) -> std::result::Result<Observation, Rejection> {
        let state = self.state;
        let velocity = state.velocity_at(view.frame.time_s);
        let expected_blur_px = view.blur_px(&state.target, self.pose, velocity);
        let mut best = self.measured(view, detection, expected_blur_px).ok_or(Rejection::Unmeasurable)?;
        if state.is_disturbed(&best.blob)
            && let Some(velocity) = state.velocity_to(best.pose, view.frame.time_s)
        {
            // Struck since the previous frame, perhaps halfway: the speed now is up to twice the mean one.
            for factor in [1.0, 2.0] {
                let blur_px = view.blur_px(&state.target, self.pose, velocity * factor);
                let again = self.measured(view, detection, blur_px);
                best = again.filter(|o| o.blob.background_rms < best.blob.background_rms).unwrap_or(best);
            }
        }
        // By none of these motions: the exposure is longer than was assumed, or the marker moved for a part of it only.
        if state.is_disturbed(&best.blob)
            && let Some(whole) = self.exposed(view, detection)
        {
            return Ok(whole);
        }
        let change = state.signal_change(view.camera, best.pose, &best.blob);
        // Far from the prediction only a complete marker is accepted, however long the object was not observed, and only if the marker's
        // outline is not visible at the prediction.
        let near = self.is_near(view, best.blob.centroid);
        let mismatch = state.target.mismatch(view.camera, &best.blob);
        let similar = mismatch.is_tolerable();
        let same_contrast = state.contrast_ratio(&best.blob).ln().abs() < SAME_CONTRAST.ln();
        // A part of a marker is not larger than the whole.
        let part = change.abs() < COMPLETE || change < 2.0 * COMPLETE && same_contrast;
        let possible =
            if near { part || similar && same_contrast } else { change.abs() < 2.0 * COMPLETE && similar };
        if possible && !near && self.fit_at_prediction(view).is_some() {
            Err(Rejection::VisibleElsewhere)
        } else if possible {
            Ok(best)
        } else if !similar {
            Err(Rejection::Shape { ratio: mismatch.largest().exp() })
        } else if near {
            Err(Rejection::Contrast { ratio: state.contrast_ratio(&best.blob) })
        } else {
            Err(Rejection::FarPart { ratio: change.exp() })
        }
    }

    /// The detection measured with the given motion blur, and the pose and the difference in appearance it implies.
    fn measured(&self, view: &FrameView, detection: &Detection, blur_px: [f64; 2]) -> Option<Observation> {
        let (image, camera, target) = (&view.frame.image, view.camera, &self.state.target);
        let predicted = self.pose;
        let patch = ComponentPatch::new(image, &detection.component, detection.level, blur_px)?;
        let blob = patch.measured()?;
        let prediction = DotPrediction { level: blob.level(), yaw_rad: Some(predicted.yaw_rad), blur_px };
        let pair = target.disc_and_dot(image, camera, &blob, prediction);
        if pair.is_none() && target.may_be_dot(camera, &blob, predicted) {
            return None;
        }
        let blob = match pair {
            Some(pair) if !target.feature.has_equal_dots() => patch.beside(&pair.dot, image)?.measured()?,
            Some(pair) => pair.disc,
            None => blob,
        };
        let yaw_near_rad = pair.map_or(predicted.yaw_rad, |pair| {
            predicted.yaw_rad + wrapped_rad(pair.yaw_rad - predicted.yaw_rad)
        });
        let pose = target.pose(camera, blob.image_pose(), yaw_near_rad);
        let ratios = [
            self.state.contrast_ratio(&blob),
            compactness(blob.area_px2, blob.covariance_px2) / target.compactness(),
        ];
        let expected_px2 = target.projection(camera, pose).covariance;
        let stretched = elongation(blob.covariance_px2) - elongation(expected_px2);
        let appearance_cost = ratios.iter().map(|ratio| (ratio.ln() / APPEARANCE_STD).powi(2)).sum::<f64>()
            + (stretched / ELONGATION_STD).powi(2);
        let yaw_known = pair.is_some() || target.feature.dot.is_none();
        let dot = pair.map(|pair| pair.dot.centroid);
        let blur_px = blur_px[0].hypot(blur_px[1]);
        Some(Observation {
            dot,
            blur_px,
            yaw_known,
            appearance_cost,
            ..Observation::new(pose, Source::Marker, blob)
        })
    }

    /// The observation at any level near the prediction: the illumination may have changed the marker's own level,
    /// motion may have reduced its contrast, or a dark region may touch it.
    pub(super) fn searched(
        &self,
        view: &FrameView,
        labeller: &mut Labeller,
        observations: &[Option<Observation>],
    ) -> Option<Observation> {
        let Self { state, pose } = *self;
        let target = &state.target;
        let (image, camera) = (&view.frame.image, view.camera);
        let height_m = target.height_m();
        let at = camera.pixel_from_table(pose.table_from_body(target.feature.at_m), height_m);
        let reach_px = self.search_radius_m(view) / camera.scale_m_per_px(at, height_m);
        if !reach_px.is_finite() {
            return None;
        }
        let window = Window::around(at, reach_px, image);
        let area_px2 = state.expected_area_px2(camera, pose);
        let [bx, by] = view.blur_px(target, pose, state.velocity());
        let blurred_px2 = area_px2 + area_px2.sqrt() * bx.hypot(by);
        let areas_px =
            (area_px2 * (1.0 - 2.0 * COMPLETE)) as u64..=(blurred_px2 * (1.0 + 2.0 * COMPLETE)) as u64;
        let taken = |component: &Component| {
            observations.iter().flatten().any(|o| o.covers(component.centroid(), area_px2.sqrt() / 2.0))
        };
        let mut best: Option<(f64, Detection)> = None;
        for level in search_thresholds().map(|threshold| Level::new(state.is_dark(), threshold)) {
            for component in labeller.components(image, window, level, &areas_px) {
                let similar =
                    target.has_similar_compactness(component.area_px as f64, component.covariance_px2());
                let distance_px = component.centroid().distance_px(at);
                let nearest = best.is_none_or(|(least_px, _)| distance_px < least_px);
                if similar && !taken(component) && nearest {
                    best = Some((distance_px, Detection { component: *component, level }));
                }
            }
        }
        best.and_then(|(_, detection)| self.observation(view, &detection))
    }
}

/// Logarithm of the long over the short axis.
fn elongation(covariance_px2: [f64; 3]) -> f64 {
    let (long, short, _) = principal_axes(covariance_px2);
    ((long + BLUR_VARIANCE_PX2) / (short + BLUR_VARIANCE_PX2)).ln() / 2.0
}
