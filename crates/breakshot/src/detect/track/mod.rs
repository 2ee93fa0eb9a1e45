//! Which blob of this frame is which object of the previous frame?
//!
//! The pose of every object is predicted by constant deceleration. The blobs near the predictions are assigned to the
//! objects at least total cost of distance and appearance. Each marker is searched at a threshold about halfway
//! between its own grey level and its background's, which adapts to the illumination.

mod blurred_pair;
mod exposed;
mod outlined;
mod prediction;

pub(super) use outlined::LEAST_VISIBLE;
pub(super) use prediction::{AREA_RATIOS, Detection, FASTEST_M_S, Prediction};

use super::assignment::assignment;
use super::association::Start;
use super::candidates::component_areas_px;
use super::label::{Labeller, Window};
use super::marker::target::Target;
use super::markerless;
use super::motion_blur::FrameView;
use super::threshold::Level;
use super::track_state::{Observation, TrackPoint, TrackState};
use crate::capture::{Camera, Frame, GreyImage};
use prediction::Region;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;

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
            let Start { candidate, pose, half_turn_known } = start;
            TrackState::new(target, &candidate.blob, (pose, half_turn_known), camera)
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
        let number = self.times_s.len() - 1;
        for (k, prediction) in predictions.iter().enumerate() {
            if !prediction.state.target.is_markerless() {
                let outlined = prediction.outlined(&view, &observations, k);
                observations[k] = outlined.map(|found| Observation {
                    object_outline: prediction.object_outline(&view, &found, number),
                    ..found
                });
            }
        }

        // Outlines elsewhere, clear of all other objects
        for (k, Prediction { state, pose }) in predictions.iter().enumerate() {
            if observations[k].is_none() && state.target.is_markerless() {
                observations[k] = markerless::observed_near(&view, state, *pose, &observations);
            }
        }
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
            let middle = || Level::nearest(dark, f64::midpoint(low, high));
            self.threshold.map_or_else(middle, |threshold| Level::new(dark, threshold))
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
    let cost = |prediction: &Prediction, region: &Region| {
        let (cost, detection) = prediction.best(view, region);
        let is_expected = |other: &Prediction| other.expects(view, detection);
        // Also without another region: it is better left out than taken from the object that is expected there.
        let is_of_other = cost.is_finite()
            && !prediction.is_near(view, detection.component.centroid())
            && predictions.iter().any(is_expected);
        if is_of_other { f64::INFINITY } else { cost }
    };
    let mut costs: Vec<Vec<f64>> = predictions
        .iter()
        .map(|prediction| regions.iter().map(|region| cost(prediction, region)).collect())
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
