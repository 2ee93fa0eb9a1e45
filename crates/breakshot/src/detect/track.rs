//! Which blob of this frame is which object of the previous frame?
//!
//! The pose of every object is predicted by constant deceleration. The blobs near the predictions are assigned to the
//! objects at least total cost of distance and appearance. Each marker is searched at a threshold about halfway
//! between its own grey level and its background's, which adapts to the illumination.

use super::assignment::assignment;
use super::association::Start;
use super::candidates::component_areas_px;
use super::label::{Component, Labeller, Window};
use super::marker::blob::{self, Blob};
use super::marker::dot::DotPrediction;
use super::marker::outline::{MarkerFit, MarkerView, Range};
use super::marker::target::{BLUR_VARIANCE_PX2, Target};
use super::markerless;
use super::motion_blur::FrameView;
use super::threshold::{Level, search_thresholds};
use super::track_state::{COMPLETE, Observation, Source, TrackPoint, TrackState};
use super::why::reason::Rejection;
use crate::capture::{Camera, Frame, GreyImage};
use crate::geometry::moments::{compactness, principal_axes};
use crate::geometry::{Pixel, Pose, wrapped_rad};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// Upper bound of an object's speed (m/s): strikers reach 1 or 2 m/s, and a struck object leaves at less than twice
/// that.
const FASTEST_M_S: f64 = 4.0;
/// Standard deviation of the change of velocity between frames (m/s).
const VELOCITY_CHANGE_STD_M_S: f64 = 0.5;
/// Standard deviation of the prediction without a change of velocity (m).
const PREDICTION_STD_M: f64 = 0.002;
/// Standard deviations of the logarithms of a marker's area in whole pixels, ...
const AREA_STD: f64 = 0.2;
/// ... of its contrast and its compactness, ...
const APPEARANCE_STD: f64 = 0.1;
/// ... and of its elongation, which motion blur changes.
const ELONGATION_STD: f64 = 0.2;
/// Distance from the prediction (standard deviations) within which a partly visible marker is accepted.
const NEAR_STDS: f64 = 3.0;
/// Range of a component's area over the expected one, with or without an occlusion.
pub(super) const AREA_RATIOS: RangeInclusive<f64> = 0.2..=1.6;
/// Largest ratio of the contrasts of a partly and a completely visible marker.
const SAME_CONTRAST: f64 = 1.5;
/// Least visible fraction of the outline of a marker near its predicted pose, ...
pub(super) const LEAST_VISIBLE: f64 = 0.35;
/// ... the largest standard deviation of a position by it (px): with a larger one the edges are those of something else, ...
const MOST_STD_PX: f64 = 1.0;
/// ... and the least fraction of one that was found by a search around it.
const CLEARLY_VISIBLE: f64 = 0.5;
/// A part of a marker of which no edge is seen is within its radius of the predicted position, and so many standard deviations.
const PART_STDS: f64 = 2.0;
/// Upper bounds of the speed (m/s) and of the angular velocity (rad/s) of an object in the frame in which it is struck, and of the search
/// around its predicted pose (m, rad), however long it was not observed.
const STRUCK_M_S: f64 = 1.0;
const STRUCK_RAD_S: f64 = 15.0;
const LARGEST_RADIUS_M: f64 = 0.04;
const LARGEST_ROTATION_RAD: f64 = 0.5;
/// Components of two levels are the same region if the distance of their centroids over their size is below this.
const SAME_REGION: f64 = 0.3;

/// All objects through the clip, frame by frame.
pub(super) struct Tracker<'a> {
    camera: &'a Camera,
    pub states: Vec<TrackState<'a>>,
    areas_px: RangeInclusive<u64>,
    labeller: Labeller,
    threshold: Option<u8>,
    times_s: Vec<f64>,
    interval_s: f64,
}

/// A component that may be a tracked marker.
#[derive(Clone, Copy, Debug)]
pub(super) struct Detection {
    pub component: Component,
    pub level: Level,
}

/// One region of the image, at each level at which it was detected.
type Region = Vec<Detection>;

/// Thresholds that separate some of the markers.
#[derive(Clone, Copy)]
struct LevelRange {
    dark: bool,
    low: f64,
    high: f64,
}

impl<'a> Tracker<'a> {
    /// Tracks targets from their starts; `interval_s` is the approximate interval between frames.
    pub(super) fn new(
        camera: &'a Camera,
        starts: Vec<(Target<'a>, Start)>,
        threshold: Option<u8>,
        interval_s: f64,
    ) -> Self {
        let targets: Vec<Target> = starts.iter().map(|(target, _)| target.clone()).collect();
        let all = component_areas_px(camera, &targets);
        // Partly covered markers are smaller.
        let areas_px = (*all.start() as f64 * 2.0 * AREA_RATIOS.start()) as u64..=*all.end();
        let state = |(target, start): (Target<'a>, Start)| {
            TrackState::new(target, &start.candidate.blob, start.pose, camera)
        };
        let states = starts.into_iter().map(state).collect();
        let labeller = Labeller::default();
        Self { camera, states, areas_px, labeller, threshold, times_s: Vec::new(), interval_s }
    }

    /// Times of the frames so far (s).
    pub(super) fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Puts the frames of another tracker before these: it was given them in reverse order, with negative times.
    pub(super) fn precede(&mut self, mirrored: Self) {
        let earlier = mirrored.times_s.len();
        self.times_s.splice(0..0, mirrored.times_s.iter().rev().map(|time_s| -time_s));
        for (state, before) in self.states.iter_mut().zip(mirrored.states) {
            let mirrored = |point: TrackPoint| TrackPoint {
                frame: earlier - 1 - point.frame,
                time_s: -point.time_s,
                ..point
            };
            let shifted = |point: &TrackPoint| TrackPoint { frame: earlier + point.frame, ..*point };
            let before = before.points.into_iter().rev().map(mirrored);
            state.points = before.chain(state.points.iter().map(shifted)).collect();
        }
    }

    /// A frame after those so far, or the last one of them.
    pub(super) fn view<'v>(&self, frame: &'v Frame, camera: &'v Camera) -> FrameView<'v> {
        let last_s = self.times_s.last().copied().filter(|&last_s| last_s < frame.time_s);
        FrameView {
            frame,
            camera,
            interval_s: last_s.map_or(self.interval_s, |last_s| frame.time_s - last_s),
        }
    }

    /// Where an object is expected at a time after its last observation.
    pub(super) fn prediction(&self, object: usize, time_s: f64) -> Prediction<'_, 'a> {
        let state = &self.states[object];
        Prediction { state, pose: state.predicted(time_s) }
    }

    /// Adds the next frame: every object is observed in it, or not. `camera` is the frame's: it differs from the calibrated one
    /// after the camera has moved.
    pub(super) fn track(&mut self, frame: &Frame, camera: &Camera) {
        let view = self.view(frame, camera);
        self.interval_s = view.interval_s;
        self.times_s.push(frame.time_s);

        // Markers at their own levels
        let regions = self.regions(&frame.image);
        let predictions: Vec<Prediction> = self
            .states
            .iter()
            .map(|state| Prediction { state, pose: state.predicted(frame.time_s) })
            .collect();
        let mut observations = observations(&view, &predictions, &regions);

        // Markers at other levels, and outlines at their predicted poses
        for (k, prediction) in predictions.iter().enumerate() {
            if observations[k].is_none() {
                let Prediction { state, pose } = *prediction;
                observations[k] = if state.target.is_markerless() {
                    markerless::observed_at(&view, state, pose)
                } else {
                    prediction.searched(&view, &mut self.labeller, &observations)
                };
            }
        }

        // Markers by their outlines, where they were not found whole
        for (k, prediction) in predictions.iter().enumerate() {
            if !prediction.state.target.is_markerless() {
                observations[k] = prediction.outlined(&view, &observations, k);
            }
        }

        // Outlines elsewhere, clear of all other objects
        for (k, Prediction { state, pose }) in predictions.iter().enumerate() {
            if observations[k].is_none() && state.target.is_markerless() {
                observations[k] = markerless::observed_near(&view, state, *pose, &observations);
            }
        }
        let number = self.times_s.len() - 1;
        for (state, observation) in self.states.iter_mut().zip(observations) {
            if let Some(mut observation) = observation {
                if !std::ptr::eq(camera, self.camera) {
                    // The rest of the program sees the picture as the camera would have taken it from its first pose.
                    let height_m = state.target.height_m();
                    let position = camera.table_from_pixel(observation.blob.centroid, height_m);
                    observation.blob.centroid = self.camera.pixel_from_table(position, height_m);
                }
                state.add(self.camera, number, frame.time_s, &observation);
            }
        }
    }

    /// The components of about a marker's size at the levels of all markers, grouped into regions.
    fn regions(&mut self, image: &GreyImage) -> Vec<Region> {
        let mut regions: Vec<Region> = Vec::new();
        for level in self.levels() {
            for &component in self.labeller.components(image, Window::whole(image), level, &self.areas_px) {
                let reach_px = SAME_REGION * (component.area_px as f64).sqrt();
                let same = |region: &&mut Region| {
                    let distance_px = region[0].component.centroid().distance_px(component.centroid());
                    region[0].level.is_dark() == level.is_dark() && distance_px < reach_px
                };
                let detection = Detection { component, level };
                match regions.iter_mut().find(same) {
                    Some(region) => region.push(detection),
                    None => regions.push(vec![detection]),
                }
            }
        }
        regions
    }

    /// A small number of levels that separate every marker cleanly.
    fn levels(&self) -> Vec<Level> {
        let mut shared: Vec<LevelRange> = Vec::new();
        for state in self.states.iter().filter(|s| !s.target.is_markerless()) {
            let (dark, [low, high]) = (state.is_dark(), state.separating_levels());
            let common =
                |range: &&mut LevelRange| range.dark == dark && range.low.max(low) < high.min(range.high);
            match shared.iter_mut().find(common) {
                Some(range) => (range.low, range.high) = (range.low.max(low), range.high.min(high)),
                None => shared.push(LevelRange { dark, low, high }),
            }
        }
        let level = |LevelRange { dark, low, high }| {
            let middle = self.threshold.unwrap_or(f64::midpoint(low, high).round().clamp(1.0, 254.0) as u8);
            Level::new(dark, middle)
        };
        let mut levels: Vec<Level> = shared.into_iter().map(level).collect();
        levels.dedup();
        levels
    }
}

/// The observation of each object.
///
/// Position and area of a component give a lower bound of the cost. Appearance adds to it and is measured only for
/// the pairs of an assignment, until the assignment does not change any more; so the result is the optimal one.
fn observations(
    view: &FrameView,
    predictions: &[Prediction],
    regions: &[Region],
) -> Vec<Option<Observation>> {
    let mut costs: Vec<Vec<f64>> = predictions
        .iter()
        .map(|prediction| regions.iter().map(|region| prediction.best(view, region).0).collect())
        .collect();
    let mut measured: BTreeMap<(usize, usize), Option<Observation>> = BTreeMap::new();
    loop {
        let assigned = assignment(&costs);
        let mut changed = false;
        for (k, region) in assigned.iter().enumerate().filter_map(|(k, region)| Some((k, (*region)?))) {
            measured.entry((k, region)).or_insert_with(|| {
                changed = true;
                let (_, detection) = predictions[k].best(view, &regions[region]);
                let observation = predictions[k].observation(view, detection);
                costs[k][region] += observation.map_or(f64::INFINITY, |o| o.appearance_cost);
                observation
            });
        }
        if !changed {
            let observation = |(k, region): (usize, &Option<usize>)| *measured.get(&(k, (*region)?))?;
            return without_shared_markers(
                assigned.iter().enumerate().map(observation).collect(),
                predictions,
            );
        }
    }
}

/// Two objects may be assigned the two equal dots of one marker: the object that is further from its prediction loses
/// its observation.
fn without_shared_markers(
    mut observations: Vec<Option<Observation>>,
    predictions: &[Prediction],
) -> Vec<Option<Observation>> {
    let distance_m = |k: usize, o: &Observation| o.pose.position.distance(predictions[k].pose.position);
    for k in 0..observations.len() {
        for l in 0..k {
            if let (Some(one), Some(other)) = (observations[k], observations[l])
                && one.overlaps(&other)
            {
                let further = if distance_m(k, &one) > distance_m(l, &other) { k } else { l };
                observations[further] = None;
            }
        }
    }
    observations
}

/// An object and its predicted pose.
#[derive(Clone, Copy)]
pub(super) struct Prediction<'s, 'a> {
    pub state: &'s TrackState<'a>,
    pub pose: Pose,
}

impl Prediction<'_, '_> {
    /// Largest distance of the object from its prediction (m).
    pub(super) fn search_radius_m(&self, view: &FrameView) -> f64 {
        let radius_m = self.state.target.feature.shape.outer_radius_m();
        // An object that left the image over its border does not reappear far inside it.
        if self.state.is_at_border() {
            return NEAR_STDS * PREDICTION_STD_M + radius_m;
        }
        let incomplete_s = self.state.incomplete_s(view.frame.time_s).unwrap_or(view.interval_s);
        FASTEST_M_S * incomplete_s + radius_m
    }

    /// How far around its prediction a marker or an outline is searched (m).
    pub(super) fn reach_m(&self, view: &FrameView) -> f64 {
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
    fn best<'r>(&self, view: &FrameView, region: &'r Region) -> (f64, &'r Detection) {
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
    pub(super) fn distance_m(&self, camera: &Camera, centroid: Pixel) -> f64 {
        let target = &self.state.target;
        let position = camera.table_from_pixel(centroid, target.height_m());
        position.distance(self.pose.table_from_body(target.feature.at_m))
    }

    /// The detection as the object's marker, complete or partly covered; `None` if it cannot be that.
    fn observation(&self, view: &FrameView, detection: &Detection) -> Option<Observation> {
        self.judged(view, detection).ok()
    }

    /// The detection as the object's marker, or why it cannot be that.
    pub(super) fn judged(
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
        let change = state.signal_change(view.camera, best.pose, &best.blob);
        // Far from the prediction only a complete marker is accepted, however long the object was not observed.
        let near_m = NEAR_STDS * (PREDICTION_STD_M + VELOCITY_CHANGE_STD_M_S * view.interval_s);
        let near = self.distance_m(view.camera, best.blob.centroid) < near_m;
        let mismatch = state.target.mismatch(view.camera, &best.blob);
        let similar = mismatch.is_tolerable();
        let same_contrast = state.contrast_ratio(&best.blob).ln().abs() < SAME_CONTRAST.ln();
        // A part of a marker is not larger than the whole.
        let part = change.abs() < COMPLETE || change < 2.0 * COMPLETE && same_contrast;
        let possible =
            if near { part || similar && same_contrast } else { change.abs() < 2.0 * COMPLETE && similar };
        if possible {
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
        let blob: Blob = blob::measured(image, &detection.component, detection.level, blur_px)?;
        let prediction = DotPrediction { level: blob.level(), yaw_rad: Some(predicted.yaw_rad), blur_px };
        let pair = target.disc_and_dot(image, camera, &blob, prediction);
        if pair.is_none() && target.may_be_dot(camera, &blob, predicted) {
            return None;
        }
        let blob = pair.map_or(blob, |pair| pair.disc);
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
        Some(Observation {
            pose,
            source: Source::Marker,
            blob,
            outline: None,
            dot,
            blur_px: blur_px[0].hypot(blur_px[1]),
            yaw_known,
            appearance_cost,
        })
    }

    /// The observation with the fit of the marker's outline. Where the marker was not found whole, its visible outline counts, and where it
    /// is covered the object's own outline.
    fn outlined(
        &self,
        view: &FrameView,
        observations: &[Option<Observation>],
        number: usize,
    ) -> Option<Observation> {
        let Self { state, pose: predicted } = *self;
        let observed = observations[number].map(|observation| {
            let velocity = state.velocity_to(observation.pose, view.frame.time_s);
            let blur_px = view.blur_px(&state.target, observation.pose, velocity.unwrap_or_default());
            let marker = self.marker(view, blur_px);
            let outline = if state.is_complete(view.camera, &observation) {
                marker.fitted_near(observation.pose)
            } else {
                marker.fitted(observation.pose)
            };
            Observation { outline, ..observation }
        });
        let pixel = view.camera.pixel_from_table(predicted.position, state.target.height_m());
        let most_std_m = MOST_STD_PX * view.camera.scale_m_per_px(pixel, state.target.height_m());
        let is_visible = |fit: &MarkerFit| fit.visible_fraction > LEAST_VISIBLE && fit.std_m < most_std_m;
        let outline = observed.and_then(|o| o.outline).filter(is_visible);
        match (&observed, outline) {
            (Some(observation), Some(_)) if state.is_complete(view.camera, observation) => return observed,
            (Some(_), Some(outline)) => return Some(self.by_outline(view, outline)),
            _ => {}
        }

        // Where it is predicted, or near there, clear of all other markers
        let velocity = state.velocity_at(view.frame.time_s);
        let marker = self.marker(view, view.blur_px(&state.target, predicted, velocity));
        let free = |pose: Pose| {
            let height_m = state.target.height_m();
            let at = view.camera.pixel_from_table(pose.table_from_body(state.target.feature.at_m), height_m);
            let reach_px = state.expected_area_px2(view.camera, pose).sqrt() / 2.0;
            let mut others = observations.iter().enumerate().filter(|(k, _)| *k != number);
            !others.any(|(_, other)| other.is_some_and(|other| other.covers(at, reach_px)))
        };
        let here = marker.fitted(predicted).filter(|fit| is_visible(fit) && free(fit.pose));
        if let Some(fit) = here {
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
        marker
            .searched(predicted, range, blur_px)
            .filter(|fit| is_visible(fit) && fit.visible_fraction > CLEARLY_VISIBLE)
            .map(|fit| self.by_outline(view, fit))
            .or(observed)
            .or_else(|| markerless::observed_without_marker(view, state, predicted))
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
    fn by_outline(&self, view: &FrameView, fit: MarkerFit) -> Observation {
        let Self { state, .. } = *self;
        let at = view.camera.pixel_from_table(fit.pose.position, state.target.height_m());
        let std_px = fit.std_m / view.camera.scale_m_per_px(at, state.target.height_m());
        Observation {
            pose: fit.pose,
            source: Source::MarkerOutline,
            blob: state.expected_blob(view.camera, fit.pose, std_px),
            outline: Some(fit),
            dot: None,
            blur_px: 0.0,
            yaw_known: fit.knows_yaw(),
            appearance_cost: 0.0,
        }
    }

    /// The observation at any level near the prediction: the illumination may have changed the marker's own level,
    /// motion may have reduced its contrast, or a dark region may touch it.
    fn searched(
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
