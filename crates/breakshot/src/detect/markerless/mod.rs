//! Where is an object without a marker in this frame?
//!
//! Its outline is laid onto the picture where sliding on would have brought it; where it does not show there, it was
//! struck, and is looked for as far around as it can have come.

pub(super) mod background;
pub(super) mod edge_fit;
pub(super) mod edge_visibility;
mod side_band;

use super::marker::blob::Blob;
use super::marker::target::Target;
use super::track::Tracker;
use super::track_state::Sight;
use crate::capture::{Camera, Frame};
use crate::geometry::{Pixel, Pose};
use crate::moments::principal_axes;
use edge_fit::Fit;
use edge_visibility::Scene;

/// An outline is where it is due if it shows there this well, over its usual look.
const AS_USUAL: f64 = 0.8;
/// Less of it tells no place.
const LEAST_SHOWN: f64 = 0.5;
/// No struck object outruns this (m/s) in the frame in which it is struck.
const FASTEST_M_S: f64 = 2.0;
/// Nor spins faster (rad/s).
const FASTEST_SPIN_RAD_S: f64 = 15.0;
/// A search goes no further (m), however long an object was out of sight.
const FURTHEST_M: f64 = 0.06;

impl Tracker<'_> {
    /// The outline where it is due, if it shows there.
    pub(super) fn laid(&self, frame: &Frame, k: usize, due: Pose) -> Option<Sight> {
        let follower = &self.followers[k];
        let blur_px = self.blur_px(follower, due, follower.velocity());
        let fit = self.outline(frame, k).laid(due, blur_px)?;
        let sight = self.seen(k, fit, blur_px);
        (follower.contrast_ratio(&sight.blob) > AS_USUAL).then_some(sight)
    }

    /// The outline wherever it may be, clear of what was found already.
    pub(super) fn laid_anywhere(
        &self,
        frame: &Frame,
        k: usize,
        due: Pose,
        sights: &[Option<Sight>],
    ) -> Option<Sight> {
        let follower = &self.followers[k];
        let unseen_s = follower.unseen_s(frame.time_s).unwrap_or(self.interval_s);
        let reach_m = (FASTEST_M_S * unseen_s).min(FURTHEST_M);
        let turn_rad = (FASTEST_SPIN_RAD_S * unseen_s).min(1.0);
        let taken: Vec<Pose> = sights.iter().flatten().map(|s| s.pose).collect();
        let apart_m = follower.target.object.shape.area_m2().sqrt() / 2.0;
        let free = |pose: Pose| taken.iter().all(|t| t.position.distance(pose.position) > apart_m);
        let scene = self.outline(frame, k);
        let around = scene.searched(due, (reach_m, turn_rad), free);
        let here = scene.laid(due, [0.0, 0.0]).filter(|fit| free(fit.pose));
        let best = around.into_iter().chain(here).max_by(|a, b| a.shown.total_cmp(&b.shown))?;
        // What moved there smeared on its way.
        let came = follower.came(best.pose, frame.time_s).unwrap_or_default();
        let blur_px = self.blur_px(follower, best.pose, came);
        let again = scene.laid(best.pose, blur_px).filter(|fit| fit.shown > best.shown);
        let sight = self.seen(k, again.unwrap_or(best), blur_px);
        (follower.contrast_ratio(&sight.blob) > LEAST_SHOWN).then_some(sight)
    }

    fn outline<'f>(&'f self, frame: &'f Frame, k: usize) -> Scene<'f> {
        let object = self.followers[k].target.object;
        Scene { image: &frame.image, camera: self.camera, shape: &object.shape, height_m: object.height_m }
    }

    fn seen(&self, k: usize, fit: Fit, blur_px: [f64; 2]) -> Sight {
        let blob = self.followers[k].target.blob(self.camera, &fit);
        let blur_px = blur_px[0].hypot(blur_px[1]);
        Sight { pose: fit.pose, blob, dot: None, blur_px, turn_known: true, strangeness: 0.0 }
    }
}

impl Target<'_> {
    /// What an outline laid onto the picture would measure as, were it a marker: its contrast is the part that shows.
    pub(super) fn blob(&self, camera: &Camera, fit: &Fit) -> Blob {
        let picture = self.picture(camera, fit.pose);
        let reach_px = principal_axes(picture.covariance).0.sqrt() * 2.0;
        let [width, height] = camera.size_px.map(|size| size as f64 - 1.0);
        let inside = |at: f64, size: f64| at > reach_px && at < size - reach_px;
        let [x, y] = picture.centroid;
        Blob {
            centroid: Pixel::new(x, y),
            std_px: fit.std_px,
            area_px2: picture.area,
            covariance_px2: picture.covariance,
            linear_covariance_px2: picture.covariance,
            background: 1.0,
            contrast: fit.shown,
            unevenness: 0.0,
            cut: !(inside(x, width) && inside(y, height)),
        }
    }
}
