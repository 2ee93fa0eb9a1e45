//! Where are a disc and its dot that fade or merge because they move during the exposure?

use super::exposed::FAINT_FRACTIONS;
use super::outlined::MOST_STD_PX;
use super::prediction::Prediction;
use crate::detect::label::{Component, Labeller, Window};
use crate::detect::marker::blurred_pair::{Guess, PairFit, PairView};
use crate::detect::motion_blur::FrameView;
use crate::detect::track_state::{COMPLETE, Observation, SHARP_PX};
use crate::geometry::{Pixel, Pose, Vec2};
use crate::object::Dot;

/// A speed during the exposure over the mean one since the previous frame: an object may have been struck halfway.
const SPEED_RATIOS: [f64; 2] = [1.0, 2.0];
/// Largest residual of a fit: noise (grey levels), ...
const MOST_RESIDUAL: f64 = 3.0;
/// ... and a part of the contrast. Edges that are a pixel off add about a tenth, ...
const MOST_MISFIT: f64 = 0.06;
/// ... and the borders of shadows on the top, where the marker is near its prediction, as much again.
const MOST_SHADED_MISFIT: f64 = 0.15;
/// A shadow that lies on the marker in one frame and not in others changes its contrast by up to this factor.
const MOST_SHADE: f64 = 2.5;
/// Largest motion during an exposure over the distance from the position before: 2 for an object at rest that was struck at the beginning of
/// the exposure or later, and less if it was struck before.
const MOST_MOTION: f64 = 1.8;
/// Motion (px) up to which the blob of a marker is measured well although the exposure was assumed: with a longer one the disc's patch contains
/// the dot.
const ASSUMED_SHARP_PX: f64 = SHARP_PX / 2.0;
/// Distance from its prediction within which a marker is searched (m), ...
const MOST_MOVED_M: f64 = 0.03;
/// ... the range of the area of its component over that of the disc at rest, and the number of components from which a fit starts.
const STREAK_AREAS: [f64; 2] = [0.5, 4.0];
const NEAREST: usize = 2;

impl Prediction<'_, '_> {
    /// The fit of the disc and its dot to the grey levels; `None` for other markers, for one that hardly moved, and where something else than
    /// motion and shadows changes the image.
    pub(super) fn blurred_pair(
        &self,
        view: &FrameView,
        observed: Option<&Observation>,
    ) -> Option<Observation> {
        let state = self.state;
        let dot = state.target.feature.dot?;
        let most_blur_px = if view.is_exposure_known() { SHARP_PX } else { ASSUMED_SHARP_PX };
        let is_sharp = |o: &Observation| {
            let velocity = state.velocity_to(o.pose, view.frame.time_s).unwrap_or_default();
            let [x, y] = view.blur_px(&state.target, o.pose, velocity);
            x.hypot(y) < most_blur_px && o.yaw_known && self.is_alone(view, o)
        };
        if observed.is_some_and(is_sharp) || state.is_at_border() {
            return None;
        }
        let height_m = state.target.height_m();
        let at = view.camera.pixel_from_table(self.pose.position, height_m);
        let scale_m_per_px = view.camera.scale_m_per_px(at, height_m);
        let sharp_m = SHARP_PX * scale_m_per_px;
        let pair = PairView {
            image: &view.frame.image,
            camera: view.camera,
            target: &state.target,
            contrast: state.relative_contrast() * state.background(),
            background: state.background(),
        };
        let is_determined = |found: &PairFit| found.fit.std_m < MOST_STD_PX * scale_m_per_px;
        let fits = |pose: Pose| {
            let guesses = self.guesses(view, pose, sharp_m).into_iter();
            guesses.filter_map(|guess| pair.fitted(guess)).filter(is_determined)
        };
        let moved = |found: &PairFit| found.motion_m.length() > sharp_m && self.moved_throughout(found);
        let mut is_near = false;
        let near = observed.map(|o| o.pose).into_iter().chain([self.pose]).flat_map(fits);
        let mut near = near.filter(|found| self.is_shaded_marker(found)).inspect(|_| is_near = true);
        // With an unknown exposure a marker may move during it by less than is noticed, although it moved between the frames.
        let is_sharp_marker = |found: &PairFit| {
            !view.is_exposure_known() && self.is_marker(found) && self.moved_throughout(found)
        };
        let found = match near.find(|found| moved(found) || is_sharp_marker(found)) {
            None if !is_near => {
                let mut elsewhere = self.component_poses(view, dot).into_iter().flat_map(fits);
                elsewhere.find(|found| self.is_marker(found) && moved(found))
            }
            near => near,
        }?;
        let blur_px = view.blur_px(&state.target, found.fit.pose, found.motion_m / view.exposure_s());
        Some(Observation { measured_blur_px: Some(blur_px), ..self.by_outline(view, found.fit) })
    }

    /// The motions of the object at a pose from which fits start: for one that hardly moved since the previous frame, one that is just noticed.
    fn guesses(&self, view: &FrameView, pose: Pose, sharp_m: f64) -> Vec<Guess> {
        let velocity = self.state.velocity_to(pose, view.frame.time_s).unwrap_or_default();
        let motions_m = SPEED_RATIOS.map(|ratio| velocity * (ratio * view.exposure_s()));
        let moving = motions_m.into_iter().filter(|motion_m| motion_m.length() > sharp_m / 2.0);
        let mut guesses: Vec<Guess> = moving.map(|motion_m| Guess { pose, motion_m }).collect();
        if guesses.is_empty() {
            guesses.push(Guess { pose, motion_m: Vec2::new(sharp_m / 2.0, 0.0) });
        } else if !view.is_exposure_known()
            && let Some(direction) = velocity.direction()
        {
            // An exposure that is much shorter than the assumed one.
            guesses.push(Guess { pose, motion_m: direction * (sharp_m / 2.0) });
        }
        guesses
    }

    /// Whether a fit explains the grey levels, with the contrast over background of the marker.
    fn is_marker(&self, found: &PairFit) -> bool {
        let contrast_ratio = found.contrast / found.background / self.state.relative_contrast();
        is_explained(found, MOST_MISFIT) && contrast_ratio.ln().abs() < COMPLETE
    }

    /// Whether a fit explains the grey levels of the marker with a shadow over it or over a part of it.
    fn is_shaded_marker(&self, found: &PairFit) -> bool {
        let shade = found.contrast / (self.state.relative_contrast() * self.state.background());
        is_explained(found, MOST_SHADED_MISFIT) && shade.ln().abs() < MOST_SHADE.ln()
    }

    /// Whether an object moved during the whole exposure. The path of one that is struck meanwhile begins where it was at rest, and its mean
    /// position is not the middle of that path.
    fn moved_throughout(&self, found: &PairFit) -> bool {
        let Some(last) = self.state.points.last() else { return false };
        let moved_m = found.fit.pose.position.distance(last.pose.position);
        found.motion_m.length() < MOST_MOTION * moved_m
    }

    /// The poses, with the predicted yaw, at which the common centroid of disc and dot is that of a component near its prediction.
    fn component_poses(&self, view: &FrameView, dot: Dot) -> Vec<Pose> {
        let (state, predicted) = (self.state, self.pose);
        let feature = &state.target.feature;
        let [disc_m2, dot_m2] =
            [feature.shape.outer_radius_m(), dot.radius_m].map(|radius_m| radius_m.powi(2));
        let centre = feature.at_m + (dot.at_m - feature.at_m) * (dot_m2 / (disc_m2 + dot_m2));
        let height_m = state.target.height_m();
        let at = view.camera.pixel_from_table(predicted.table_from_body(centre), height_m);
        let reach_px = MOST_MOVED_M / view.camera.scale_m_per_px(at, height_m);
        if !reach_px.is_finite() {
            return Vec::new();
        }
        let window = Window::around(at, reach_px, &view.frame.image);
        let level = state.level_at(FAINT_FRACTIONS[0]);
        let area_px2 = state.expected_area_px2(view.camera, predicted);
        let [least_px, most_px] = STREAK_AREAS.map(|ratio| (ratio * area_px2) as u64);
        let mut labeller = Labeller::default();
        let found = labeller.components(&view.frame.image, window, level, &(least_px..=most_px));
        let mut centroids: Vec<Pixel> = found.iter().map(Component::centroid).collect();
        centroids.sort_by(|a, b| a.distance_px(at).total_cmp(&b.distance_px(at)));
        let pose = |pixel: &Pixel| {
            let position = view.camera.table_from_pixel(*pixel, height_m);
            Pose { position: position - centre.to_vec().rotated(predicted.yaw_rad), ..predicted }
        };
        centroids.iter().take(NEAREST).map(pose).collect()
    }
}

/// Whether the residuals of a fit are noise and at most this part of its contrast.
fn is_explained(found: &PairFit, misfit: f64) -> bool {
    found.residual_rms < MOST_RESIDUAL.hypot(misfit * found.contrast)
}
