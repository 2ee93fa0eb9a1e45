//! Where is a marker that moved during the exposure, if its motion is not known because it was just struck?
//!
//! The marker is separated from its background at a level so faint that its whole path during the exposure belongs to it. It counts if it
//! is whole: all pixels together have its usual area and contrast, nothing else is around it, and its second moments are those of the
//! marker at rest, spread along the line from where it was before.

use super::prediction::{Detection, Prediction};
use crate::detect::label::{Component, Labeller, Window};
use crate::detect::marker::blob::{self, Blob, ImagePose};
use crate::detect::motion_blur::{self, FrameView, without_blur};
use crate::detect::threshold::Level;
use crate::detect::track_state::{Observation, Source};
use crate::geometry::moments::principal_axes;

/// Levels between the background (0) and the marker's own grey level (1) at which a moving marker is separated. Of a path with constant speed
/// about this fraction is fainter; a faint level separates less from noise and from what is beside the marker.
pub(super) const FAINT_FRACTIONS: [f64; 3] = [0.24, 0.12, 0.06];

impl Prediction<'_, '_> {
    /// The whole marker of which a detection is the most distinct part; `None` if it is not seen whole and alone.
    pub(super) fn exposed(&self, view: &FrameView, detection: &Detection) -> Option<Observation> {
        if self.state.target.feature.dot.is_some() {
            return None;
        }
        let whole = FAINT_FRACTIONS.iter().filter_map(|fraction| self.exposed_at(view, detection, *fraction));
        whole.min_by(|a, b| a.blob.background_rms.total_cmp(&b.blob.background_rms))
    }

    /// The same, separated at this fraction of the contrast.
    fn exposed_at(&self, view: &FrameView, detection: &Detection, fraction: f64) -> Option<Observation> {
        let state = self.state;
        let level = state.level_at(fraction);
        let component = self.around(view, detection, level)?;
        let blob = blob::exposed(&view.frame.image, &component, level, state.relative_contrast())?;
        let blur_px = self.measured_blur_px(view, &blob)?;
        let axis_rad = principal_axes(without_blur(blob.linear_covariance_px2, blur_px)).2;
        let image_pose = ImagePose { centroid: blob.centroid, axis_rad };
        let pose = state.target.pose(view.camera, image_pose, self.pose.yaw_rad);
        let observation = Observation {
            blur_px: blur_px[0].hypot(blur_px[1]),
            measured_blur_px: Some(blur_px),
            ..Observation::new(pose, Source::Marker, blob)
        };
        self.is_alone(view, &observation).then_some(observation)
    }

    /// Whether an observation shows the whole marker, and nothing beside it.
    pub(super) fn is_alone(&self, view: &FrameView, observation: &Observation) -> bool {
        self.state.is_complete(view.camera, observation) && !self.state.is_disturbed(&observation.blob)
    }

    /// The motion during the exposure (px) that explains the moments of a blob, along the line from where the marker was last; `None` if
    /// there is none.
    pub(super) fn measured_blur_px(&self, view: &FrameView, blob: &Blob) -> Option<[f64; 2]> {
        let (target, last) = (&self.state.target, self.state.points.last()?);
        let before = last.pose.table_from_body(target.feature.at_m);
        let from = view.camera.pixel_from_table(before, target.height_m());
        let moved_px = [blob.centroid.x - from.x, blob.centroid.y - from.y];
        let at_rest_px2 = self.state.expected_covariance_px2(view.camera, self.pose);
        motion_blur::measured_px(at_rest_px2, blob.linear_covariance_px2, moved_px)
    }

    /// The smallest component at a fainter level that surrounds a detection, within the object's diameter.
    fn around(&self, view: &FrameView, detection: &Detection, level: Level) -> Option<Component> {
        let (target, inner) = (&self.state.target, &detection.component);
        let scale_m_per_px = view.camera.scale_m_per_px(inner.centroid(), target.height_m());
        let reach_px = 2.0 * target.object.shape.outer_radius_m() / scale_m_per_px;
        if !reach_px.is_finite() {
            return None;
        }
        let window = Window::around(inner.centroid(), reach_px, &view.frame.image);
        let mut labeller = Labeller::default();
        let found = labeller.components(&view.frame.image, window, level, &(inner.area_px..=u64::MAX));
        let contains = |outer: [u32; 2], inner: [u32; 2]| outer[0] <= inner[0] && inner[1] <= outer[1];
        let surrounding = found.iter().filter(|c| contains(c.x, inner.x) && contains(c.y, inner.y));
        surrounding.min_by_key(|c| c.area_px).copied()
    }
}
