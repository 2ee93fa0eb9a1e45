//! Which blob of this frame is which object of the last one?
//!
//! Every object is expected where sliding on would have brought it; the blobs near enough are given out so that all
//! objects together are nearest to where they were expected.  Each marker is looked for at a level about halfway
//! between its own grey and its surroundings', which follows it through shade and light.

use super::assignment::assignment;
use super::blob::{self, Blob};
use super::identity::Start;
use super::label::{Component, Labeller, Level, Window};
use super::marker::Target;
use super::threshold::component_areas_px;
use crate::capture::{Camera, Frame, GreyImage};
use crate::geometry::{Pixel, Pose};
use std::ops::RangeInclusive;

/// A marker in one frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub frame: usize,
    pub time_s: f64,
    pub pose: Pose,
    pub blob: Blob,
    /// Whether it looked as whole as before.
    pub whole: bool,
}

/// No struck object outruns this (m/s): strikes end at 1 or 2 m/s, and what is struck leaves at less than twice that.
const FASTEST_M_S: f64 = 4.0;
/// A change of speed from frame to frame that is nothing unusual (m/s): it weighs as much as ...
const USUAL_CHANGE_M_S: f64 = 0.5;
/// ... an area that differs from the usual one by this part.
const USUAL_AREA_CHANGE: f64 = 0.2;
/// How far off a prediction is anyway (m).
const PREDICTION_STD_M: f64 = 0.002;
/// While unseen an object is taken to slow down like this (m/s2): friction 0.25.
const SLOWING_M_S2: f64 = 2.5;
/// Parts of the expected area between which a component may be the marker, partly covered or not.
const AREA_RATIOS: RangeInclusive<f64> = 0.2..=1.6;
/// A marker counts as whole within this part of its usual area.
const WHOLE: f64 = 0.1;
/// A part of a marker is as dark as the whole, within this part of the contrast.
const SAME_CONTRAST: f64 = 0.35;
/// Weight of the newest frame in running means.
const NEWEST: f64 = 0.2;
/// Shares of the contrast, from the marker's grey, between which a level cuts the marker out cleanly.
const CLEAN_SHARES: [f64; 2] = [0.35, 0.65];
/// A film's shutter is usually open for at most half the time from frame to frame.
const USUAL_SHUTTER: f64 = 0.5;

/// One object through the clip.
#[derive(Clone, Debug)]
pub(super) struct Follower<'a> {
    pub target: Target<'a>,
    pub seen: Vec<Seen>,
    start: Pose,
    /// Usual ratio of the marker's area to the expected one.
    area_ratio: f64,
    /// Usual contrast, and usual grey level around it.
    contrast: f64,
    background: f64,
}

impl<'a> Follower<'a> {
    pub(super) fn new(target: Target<'a>, start: &Start, camera: &Camera) -> Self {
        let Blob { area_px2, contrast, background, .. } = start.candidate.blob;
        let area_ratio = area_px2 / target.picture(camera, start.pose).area;
        Self { target, seen: Vec::new(), start: start.pose, area_ratio, contrast, background }
    }

    /// Where it will be if it slides on.
    fn predicted(&self, time_s: f64) -> Pose {
        let mut whole = self.seen.iter().rev().filter(|s| s.whole);
        let Some(last) = whole.next() else { return self.start };
        let Some(before) = whole.next() else { return last.pose };
        let (velocity, yaw_rate_rad_s) = rates(before, last);
        let speed_m_s = velocity.length();
        let sliding_s = (time_s - last.time_s).min(speed_m_s / SLOWING_M_S2);
        let lost_m_s = SLOWING_M_S2 * sliding_s / 2.0;
        let way = velocity.direction().map_or(velocity, |d| d * ((speed_m_s - lost_m_s) * sliding_s));
        Pose { position: last.pose.position + way, yaw_rad: last.pose.yaw_rad + yaw_rate_rad_s * sliding_s }
    }

    /// Time since it was last seen whole (s).
    fn unseen_s(&self, time_s: f64) -> Option<f64> {
        self.seen.iter().rev().find(|s| s.whole).map(|s| time_s - s.time_s)
    }

    /// The grey levels between which the marker is cut out cleanly.
    fn clean_levels(&self) -> [f64; 2] {
        let marker = self.background - self.contrast;
        let [one, other] = CLEAN_SHARES.map(|share| marker + share * self.contrast);
        [one.min(other), one.max(other)]
    }

    /// The area expected of this very marker at a pose (px2).
    fn area_due_px2(&self, camera: &Camera, pose: Pose) -> f64 {
        self.target.picture(camera, pose).area * self.area_ratio
    }

    fn add(&mut self, camera: &Camera, frame: usize, time_s: f64, sight: (Pose, Blob)) {
        let (pose, blob) = sight;
        let area_ratio = blob.area_px2 / self.target.picture(camera, pose).area;
        let change = (area_ratio / self.area_ratio).ln();
        let whole = !blob.cut && change.abs() < WHOLE;
        if whole {
            self.contrast += NEWEST * (blob.contrast - self.contrast);
            self.background += NEWEST * (blob.background - self.background);
        }
        // Nothing but being uncovered makes a marker grow.
        if change > 0.0 && self.target.mismatch(camera, &blob).tolerable() {
            self.area_ratio += NEWEST * (area_ratio - self.area_ratio);
        }
        self.seen.push(Seen { frame, time_s, pose, blob, whole });
    }
}

/// Velocity and yaw rate from one sight to the next.
fn rates(before: &Seen, after: &Seen) -> (crate::geometry::Vec2, f64) {
    let dt_s = after.time_s - before.time_s;
    ((after.pose.position - before.pose.position) / dt_s, (after.pose.yaw_rad - before.pose.yaw_rad) / dt_s)
}

/// All objects through the clip, frame by frame.
pub(super) struct Tracker<'a> {
    camera: &'a Camera,
    pub followers: Vec<Follower<'a>>,
    areas_px: RangeInclusive<u64>,
    labeller: Labeller,
    threshold: Option<u8>,
    times_s: Vec<f64>,
    interval_s: f64,
}

/// A component that may be a follower's marker.
#[derive(Clone, Copy)]
struct Part {
    component: Component,
    level: Level,
}

impl<'a> Tracker<'a> {
    /// Follows targets from where they start; `interval_s` is about the time from frame to frame.
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
        let followers =
            starts.into_iter().map(|(target, start)| Follower::new(target, &start, camera)).collect();
        let labeller = Labeller::default();
        Self { camera, followers, areas_px, labeller, threshold, times_s: Vec::new(), interval_s }
    }

    /// Finds every follower in the next frame, or not.
    pub(super) fn follow(&mut self, frame: &Frame) {
        if let Some(last_s) = self.times_s.last() {
            self.interval_s = frame.time_s - last_s;
        }
        self.times_s.push(frame.time_s);
        let due: Vec<Pose> = self.followers.iter().map(|f| f.predicted(frame.time_s)).collect();
        let parts = self.parts(&frame.image);
        let costs: Vec<Vec<f64>> = (0..due.len())
            .map(|k| parts.iter().map(|part| self.cost(k, due[k], part, frame.time_s)).collect())
            .collect();
        let given = assignment(&costs);
        let mut sights: Vec<Option<(Pose, Blob)>> = given
            .iter()
            .enumerate()
            .map(|(k, part)| self.sight(&frame.image, k, due[k], &parts[(*part)?]))
            .collect();
        for k in 0..sights.len() {
            if sights[k].is_none() {
                sights[k] = self.searched(frame, k, due[k], &sights);
            }
        }
        for (follower, sight) in self.followers.iter_mut().zip(sights) {
            if let Some(sight) = sight {
                follower.add(self.camera, self.times_s.len() - 1, frame.time_s, sight);
            }
        }
    }

    /// The times of the frames so far.
    pub(super) fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// All components of about a marker's size, at each level that some marker needs.
    fn parts(&mut self, image: &GreyImage) -> Vec<Part> {
        let mut parts = Vec::new();
        for level in self.levels() {
            let found = self.labeller.components(image, Window::whole(image), level, &self.areas_px);
            parts.extend(found.iter().map(|&component| Part { component, level }));
        }
        parts
    }

    /// As few levels as cut out every marker cleanly.
    fn levels(&self) -> Vec<Level> {
        let mut shared: Vec<(bool, [f64; 2])> = Vec::new();
        for follower in &self.followers {
            let (darker, [low, high]) = (follower.contrast > 0.0, follower.clean_levels());
            let common =
                |&&mut (side, [l, h]): &&mut (bool, [f64; 2])| side == darker && l.max(low) < h.min(high);
            match shared.iter_mut().find(common) {
                Some((_, range)) => *range = [range[0].max(low), range[1].min(high)],
                None => shared.push((darker, [low, high])),
            }
        }
        let level = |(darker, [low, high]): (bool, [f64; 2])| {
            let middle = self.threshold.unwrap_or(f64::midpoint(low, high).round().clamp(1.0, 254.0) as u8);
            if darker { Level::Below(middle) } else { Level::Above(middle) }
        };
        let mut levels: Vec<Level> = shared.into_iter().map(level).collect();
        levels.dedup();
        levels
    }

    /// How far from its prediction an object may be (m).
    fn reach_m(&self, k: usize, time_s: f64) -> f64 {
        let follower = &self.followers[k];
        let unseen_s = follower.unseen_s(time_s).unwrap_or(self.interval_s);
        FASTEST_M_S * unseen_s + follower.target.object.marker.shape.outer_radius_m()
    }

    fn cost(&self, k: usize, due: Pose, part: &Part, time_s: f64) -> f64 {
        let follower = &self.followers[k];
        let darker = matches!(part.level, Level::Below(_));
        if darker != (follower.contrast > 0.0) {
            return f64::INFINITY;
        }
        let off_m = self.off_m(follower, due, part.component.centroid());
        let ratio = part.component.area_px as f64 / follower.area_due_px2(self.camera, due);
        if off_m.is_nan() || off_m > self.reach_m(k, time_s) || !AREA_RATIOS.contains(&ratio) {
            return f64::INFINITY;
        }
        let unseen_s = follower.unseen_s(time_s).unwrap_or(self.interval_s);
        let std_m = PREDICTION_STD_M + USUAL_CHANGE_M_S * unseen_s;
        (off_m / std_m).powi(2) + (ratio.ln() / USUAL_AREA_CHANGE).powi(2)
    }

    /// How far the object would be from where it is due, if its marker were here (m).
    fn off_m(&self, follower: &Follower, due: Pose, marker: Pixel) -> f64 {
        let height_m = follower.target.object.height_m;
        let place = self.camera.table_from_pixel(marker, height_m);
        place.distance(due.table_from_body(follower.target.object.marker.at_m))
    }

    /// The pose and the blob of a follower, if the part is its marker or a part of it.
    fn sight(&self, image: &GreyImage, k: usize, due: Pose, part: &Part) -> Option<(Pose, Blob)> {
        let follower = &self.followers[k];
        let blob = blob::measured(image, &part.component, part.level, self.blur_px(k, due))?;
        let pose = follower.target.pose(self.camera, blob.sight(), due.yaw_rad);
        let area_change = (blob.area_px2 / follower.area_due_px2(self.camera, pose)).ln().abs();
        let contrast_change = (blob.contrast / follower.contrast - 1.0).abs();
        (area_change < WHOLE || contrast_change < SAME_CONTRAST).then_some((pose, blob))
    }

    /// How far the marker moves in the picture while the shutter is open, as far as one can say.
    fn blur_px(&self, k: usize, due: Pose) -> [f64; 2] {
        let follower = &self.followers[k];
        let mut whole = follower.seen.iter().rev().filter(|s| s.whole);
        let (Some(last), Some(before)) = (whole.next(), whole.next()) else { return [0.0, 0.0] };
        let (velocity, _) = rates(before, last);
        let exposure_s = self.camera.exposure_s.unwrap_or(USUAL_SHUTTER * self.interval_s);
        let height_m = follower.target.object.height_m;
        let from = self.camera.pixel_from_table(due.position, height_m);
        let to = self.camera.pixel_from_table(due.position + velocity * exposure_s, height_m);
        let blur_px = [to.x - from.x, to.y - from.y];
        if blur_px.iter().all(|b| b.is_finite()) { blur_px } else { [0.0, 0.0] }
    }

    /// A second look at every level near where a follower is due: shade may have moved its own, or something dark
    /// may touch it.
    fn searched(
        &mut self,
        frame: &Frame,
        k: usize,
        due: Pose,
        sights: &[Option<(Pose, Blob)>],
    ) -> Option<(Pose, Blob)> {
        let image = &frame.image;
        let follower = &self.followers[k];
        let height_m = follower.target.object.height_m;
        let marker = due.table_from_body(follower.target.object.marker.at_m);
        let at = self.camera.pixel_from_table(marker, height_m);
        let reach_px = self.reach_m(k, frame.time_s) / self.camera.scale_m_per_px(at, height_m);
        if !reach_px.is_finite() {
            return None;
        }
        let window = Window::around(at, reach_px, image);
        let area_px2 = follower.area_due_px2(self.camera, due);
        let areas_px = (area_px2 * (1.0 - 2.0 * WHOLE)) as u64..=(area_px2 * (1.0 + 2.0 * WHOLE)) as u64;
        let darker = follower.contrast > 0.0;
        let mut best: Option<(f64, Part)> = None;
        for level in (SEARCH_STEP..256).step_by(SEARCH_STEP).map(|l| l as u8) {
            let level = if darker { Level::Below(level) } else { Level::Above(level) };
            for component in self.labeller.components(image, window, level, &areas_px) {
                let part = Part { component: *component, level };
                let taken = sights
                    .iter()
                    .flatten()
                    .any(|(_, blob)| blob.centroid.distance_px(component.centroid()) < area_px2.sqrt() / 2.0);
                let fits = self.followers[k]
                    .target
                    .full_enough(component.area_px as f64, component.covariance_px2());
                let off_px = component.centroid().distance_px(at);
                if !taken && fits && best.is_none_or(|(least, _)| off_px < least) {
                    best = Some((off_px, part));
                }
            }
        }
        best.and_then(|(_, part)| self.sight(image, k, due, &part))
    }
}

/// Levels this far apart are tried in a second look.
const SEARCH_STEP: usize = 8;
