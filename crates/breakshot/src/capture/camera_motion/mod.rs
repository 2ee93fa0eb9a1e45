//! Did the camera move during the clip, and where was it in each frame?
//!
//! The tags' patches are compared with earlier ones in every frame ([`patch`]), which costs microseconds. Where they have moved,
//! the tags are detected again and the camera's pose is fitted to them; the landmarks are the tags' corners as the calibrated
//! camera saw them, so that a camera that comes back has its first pose again.

mod patch;

use super::camera::Camera;
use super::extrinsics::CORNER_NOISE_PX;
use super::image::{Frame, GreyImage};
use super::pose::{self, Correspondence, FreeParameters};
use super::tags::{self, DetectedTag};
use crate::geometry::{Pixel, Point};
use patch::Patch;

/// How the warning of a moved camera begins.
pub(crate) const CAMERA_MOVED: &str = "the camera moved";
/// Shift of a tag's patch from which the tags are detected again (px): compression and noise shift it by some hundredths.
const PATCH_MOVED_PX: f64 = 0.08;
/// Root mean square displacement of a tag's corners from which it has moved (px): compression and shadows displace them by up to
/// a tenth.
const MOVED_PX: f64 = 0.2;
/// Largest root mean square error of a tag's corners (px): a partly covered tag has larger ones.
const CONSISTENT_PX: f64 = 0.4;
/// Tags that determine a pose: the pose of one tag is inaccurate far from it.
const FEWEST_TAGS: usize = 2;

/// A tag by its corners on the table as the calibrated camera saw them (m).
struct Landmark {
    id: u32,
    corners_m: [Point; 4],
}

/// A tag in a frame.
#[derive(Clone)]
struct SeenTag {
    corners_m: [Point; 4],
    corners_px: [Pixel; 4],
}

impl SeenTag {
    /// Root mean square distance of its corners from where a camera sees them (px).
    fn error_px(&self, camera: &Camera) -> f64 {
        let square = |k: usize| camera.tag_pixel(self.corners_m[k]).distance_px(self.corners_px[k]).powi(2);
        ((0..4).map(square).sum::<f64>() / 4.0).sqrt()
    }

    fn correspondences(&self) -> [Correspondence; 4] {
        [0, 1, 2, 3].map(|k| Correspondence {
            point: self.corners_m[k],
            pixel: self.corners_px[k],
            std_px: CORNER_NOISE_PX,
        })
    }
}

/// The camera's pose through a clip, from frame to frame.
pub(crate) struct CameraMotion<'a> {
    calibrated: &'a Camera,
    /// The camera after it has moved; `None` while it is where it was calibrated.
    moved: Option<Camera>,
    landmarks: Vec<Landmark>,
    /// The tags' patches since the camera last moved; none before the first frame.
    patches: Vec<Patch>,
    /// When it first moved (s), and the largest displacement of the tags from then on (px).
    since_s: Option<f64>,
    largest_px: f64,
    /// Frames whose tags have moved but do not determine the camera's pose.
    unmeasured: usize,
}

impl<'a> CameraMotion<'a> {
    /// The motion of a camera from its calibration on. A camera without tags is taken as fixed.
    pub(crate) fn new(calibrated: &'a Camera) -> Self {
        let landmark = |fit: &super::TagFit| Landmark {
            id: fit.id,
            corners_m: fit
                .corners_px
                .map(|corner| calibrated.table_from_pixel(corner, calibrated.tag_thickness_m)),
        };
        let landmarks: Vec<Landmark> = calibrated.tags.iter().map(landmark).collect();
        let landmarks =
            landmarks.into_iter().filter(|landmark| landmark.corners_m.iter().all(|p| p.is_finite()));
        Self {
            calibrated,
            moved: None,
            landmarks: landmarks.collect(),
            patches: Vec::new(),
            since_s: None,
            largest_px: 0.0,
            unmeasured: 0,
        }
    }

    /// The camera of the next frame.
    pub(crate) fn follow(&mut self, frame: &Frame) -> &Camera {
        let shifted = self.patches.iter().filter(|patch| patch.shift_px(&frame.image) > PATCH_MOVED_PX);
        // An arm or a shadow over some of the tags is no motion of the camera.
        if 2 * shifted.count() >= self.patches.len() {
            self.measure(frame);
        }
        self.camera()
    }

    fn camera(&self) -> &Camera {
        self.moved.as_ref().unwrap_or(self.calibrated)
    }

    /// A warning if the camera has moved: by how much, from when on, and whether the motion could be removed.
    pub(crate) fn warning(&self) -> Option<String> {
        let moved = self.since_s.map(|since_s| {
            let largest_px = self.largest_px;
            format!(
                "{CAMERA_MOVED} by up to {largest_px:.1} px from {since_s:.3} s on: its motion is measured from the tags and removed"
            )
        });
        let unmeasured = (self.unmeasured > 0).then(|| {
            let n = self.unmeasured;
            format!("the tags moved or were covered in {n} frames, which do not determine where the camera was; needed: a fixed camera with its tags in view")
        });
        match (moved, unmeasured) {
            (Some(moved), Some(unmeasured)) => Some(format!("{moved}; {unmeasured}")),
            (moved, _) => moved,
        }
    }

    /// Compares the tags of this frame with the camera; if they have moved, its pose is fitted to them.
    fn measure(&mut self, frame: &Frame) {
        if self.landmarks.is_empty() {
            return;
        }
        let mut tags = self.tags_near(&frame.image);
        let mut fit = self.fitted_if_moved(&tags);
        if fit.is_none() && !tags.iter().any(|tag| self.is_still(tag)) {
            tags = self.tags_anywhere(&frame.image);
            fit = self.fitted_if_moved(&tags);
        }
        if self.have_moved(&tags) {
            match fit {
                Some(camera) => self.take(camera, frame.time_s),
                None => self.unmeasured += 1,
            }
            self.patches.clear();
        }
        if self.patches.is_empty() {
            self.renew_patches(&frame.image);
        }
    }

    fn is_still(&self, tag: &SeenTag) -> bool {
        tag.error_px(self.camera()) < MOVED_PX
    }

    /// Whether fewer than half of these tags are where the camera last saw them.
    fn have_moved(&self, tags: &[SeenTag]) -> bool {
        2 * tags.iter().filter(|tag| self.is_still(tag)).count() < tags.len()
    }

    fn fitted_if_moved(&self, tags: &[SeenTag]) -> Option<Camera> {
        if self.have_moved(tags) { self.fitted(tags.to_vec()) } else { None }
    }

    /// The tags of a picture near where the camera last saw them.
    fn tags_near(&self, image: &GreyImage) -> Vec<SeenTag> {
        let near = self.landmarks.iter().filter_map(|landmark| {
            let corners_px = landmark.corners_m.map(|point| self.camera().tag_pixel(point));
            let earlier = DetectedTag::from_earlier(landmark.id, corners_px);
            let tag = tags::redetected(image, self.calibrated.lens(), &earlier)?;
            Some(SeenTag { corners_m: landmark.corners_m, corners_px: tag.corners_px })
        });
        near.collect()
    }

    /// The tags of a picture wherever they are.
    fn tags_anywhere(&self, image: &GreyImage) -> Vec<SeenTag> {
        let enough = |tags: &[DetectedTag]| tags.len() >= self.landmarks.len();
        let all = tags::detected(image, self.calibrated.lens(), &enough);
        let found = self.landmarks.iter().filter_map(|landmark| {
            let tag = all.iter().find(|tag| tag.id == landmark.id)?;
            Some(SeenTag { corners_m: landmark.corners_m, corners_px: tag.corners_px })
        });
        found.collect()
    }

    /// The calibrated camera at the pose that these tags agree on; `None` if they are too few.
    fn fitted(&self, mut tags: Vec<SeenTag>) -> Option<Camera> {
        let needed = self.landmarks.len().min(FEWEST_TAGS);
        while tags.len() >= needed {
            let correspondences: Vec<Correspondence> =
                tags.iter().flat_map(SeenTag::correspondences).collect();
            let fit = match self.calibrated.lens() {
                Some(lens) => pose::pose(lens, &correspondences, FreeParameters::Pose),
                None => pose::plane(&correspondences),
            };
            let camera = Camera { projection: fit?.projection, ..self.calibrated.clone() };
            let errors_px: Vec<f64> = tags.iter().map(|tag| tag.error_px(&camera)).collect();
            let worst = (0..tags.len()).max_by(|&a, &b| errors_px[a].total_cmp(&errors_px[b]))?;
            if errors_px[worst] < CONSISTENT_PX {
                return Some(camera);
            }
            tags.swap_remove(worst);
        }
        None
    }

    fn take(&mut self, camera: Camera, time_s: f64) {
        let from_first_px = self.displacement_px(&camera);
        self.moved = (from_first_px >= MOVED_PX).then_some(camera);
        self.largest_px = self.largest_px.max(from_first_px);
        self.since_s.get_or_insert(time_s);
    }

    /// Root mean square displacement of the tags' corners between the calibrated camera and this one (px).
    fn displacement_px(&self, camera: &Camera) -> f64 {
        let square =
            |point: Point| self.calibrated.tag_pixel(point).distance_px(camera.tag_pixel(point)).powi(2);
        let squares = self.landmarks.iter().flat_map(|landmark| landmark.corners_m).map(square);
        (squares.sum::<f64>() / (4 * self.landmarks.len()) as f64).sqrt()
    }

    fn renew_patches(&mut self, image: &GreyImage) {
        let camera = self.camera();
        let corners_px =
            self.landmarks.iter().map(|landmark| landmark.corners_m.map(|p| camera.tag_pixel(p)));
        self.patches = corners_px.filter_map(|corners_px| Patch::new(image, corners_px)).collect();
    }
}
