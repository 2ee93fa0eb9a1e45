//! What is known of one object while it is followed: where it was, where it is due, how its marker looks.

use super::association::Start;
use super::marker::blob::Blob;
use super::marker::target::Target;
use crate::capture::Camera;
use crate::geometry::{Pixel, Pose, Vec2};

/// A marker in one frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub frame: usize,
    pub time_s: f64,
    pub pose: Pose,
    pub blob: Blob,
    /// Whether all of the marker showed.
    pub whole: bool,
    /// Whether it told how the object was turned.
    pub turn_known: bool,
}

/// One object through the clip.
#[derive(Clone, Debug)]
pub(super) struct Follower<'a> {
    pub target: Target<'a>,
    pub seen: Vec<Seen>,
    start: Pose,
    /// Usual ratio of the marker's area to the expected one.
    area_ratio: f64,
    /// Usual contrast as a part of the grey level around.
    relative_contrast: f64,
    /// Grey level around it, and how uneven it is, when it was last seen whole.
    background: f64,
    unevenness: f64,
}

/// While unseen an object is taken to slow down like this (m/s2): friction 0.25.
const SLOWING_M_S2: f64 = 2.5;
/// A marker counts as whole within this part of its usual area.
pub(super) const WHOLE: f64 = 0.1;
/// Weight of the newest frame in running means.
const NEWEST: f64 = 0.2;
/// Shares of the contrast, from the marker's grey, between which a level cuts the marker out cleanly.
const CLEAN_SHARES: [f64; 2] = [0.35, 0.65];
/// Surroundings this many grey levels more uneven than usual have something else in them.
const MORE_UNEVEN: f64 = 3.0;
/// Smeared by more than this (px), a marker shows less than its contrast.
const SHARP_PX: f64 = 2.0;

impl<'a> Follower<'a> {
    pub(super) fn new(target: Target<'a>, start: &Start, camera: &Camera) -> Self {
        let blob = start.candidate.blob;
        let target = target.with_marker(&blob);
        let area_ratio = blob.area_px2 / target.picture(camera, start.pose).area;
        Self {
            target,
            seen: Vec::new(),
            start: start.pose,
            area_ratio,
            relative_contrast: blob.relative_contrast(),
            background: blob.background,
            unevenness: blob.unevenness,
        }
    }

    /// Where it will be if it slides on.
    pub(super) fn predicted(&self, time_s: f64) -> Pose {
        let Some(last) = self.seen.last() else { return self.start };
        let velocity = self.velocity();
        let speed_m_s = velocity.length();
        let sliding_s = (time_s - last.time_s).min(speed_m_s / SLOWING_M_S2);
        let lost_m_s = SLOWING_M_S2 * sliding_s / 2.0;
        let way = velocity.direction().map_or(Vec2::ZERO, |d| d * ((speed_m_s - lost_m_s) * sliding_s));
        Pose { position: last.pose.position + way, yaw_rad: self.predicted_yaw_rad(time_s) }
    }

    /// Part of a marker tells no angle: the last two sights of the whole marker do.
    fn predicted_yaw_rad(&self, time_s: f64) -> f64 {
        let mut whole = self.seen.iter().rev().filter(|s| s.whole && s.turn_known);
        let Some(last) = whole.next() else { return self.start.yaw_rad };
        let Some(before) = whole.next() else { return last.pose.yaw_rad };
        let interval_s = last.time_s - before.time_s;
        // Turning stops when sliding does, and nobody knows when: one interval on is as far as it is worth guessing.
        let turning_s = (time_s - last.time_s).min(interval_s);
        last.pose.yaw_rad + (last.pose.yaw_rad - before.pose.yaw_rad) * turning_s / interval_s
    }

    /// Velocity between the last two sights.
    pub(super) fn velocity(&self) -> Vec2 {
        let [.., before, last] = self.seen.as_slice() else { return Vec2::ZERO };
        (last.pose.position - before.pose.position) / (last.time_s - before.time_s)
    }

    /// The mean velocity since the last sight, were it here now.
    pub(super) fn came(&self, here: Pose, time_s: f64) -> Option<Vec2> {
        let last = self.seen.last()?;
        Some((here.position - last.pose.position) / (time_s - last.time_s))
    }

    /// Time since it was last seen at all (s).
    pub(super) fn unseen_s(&self, time_s: f64) -> Option<f64> {
        self.seen.last().map(|s| time_s - s.time_s)
    }

    /// Time since it was last seen whole (s).
    pub(super) fn not_whole_s(&self, time_s: f64) -> Option<f64> {
        self.seen.iter().rev().find(|s| s.whole).map(|s| time_s - s.time_s)
    }

    /// Whether the picture's edge cut it when it was last seen.
    pub(super) fn at_the_edge(&self) -> bool {
        self.seen.last().is_some_and(|s| s.blob.cut)
    }

    pub(super) fn darker(&self) -> bool {
        self.relative_contrast > 0.0
    }

    /// The grey levels between which the marker is cut out cleanly.
    pub(super) fn clean_levels(&self) -> [f64; 2] {
        let contrast = self.relative_contrast * self.background;
        let [one, other] = CLEAN_SHARES.map(|share| self.background - contrast * (1.0 - share));
        [one.min(other), one.max(other)]
    }

    /// The area expected of this very marker at a pose (px2).
    pub(super) fn area_due_px2(&self, camera: &Camera, pose: Pose) -> f64 {
        self.target.picture(camera, pose).area * self.area_ratio
    }

    /// The logarithm of how much the blob shows over how much it should: 0 for all of the marker, smeared or not.
    pub(super) fn change(&self, camera: &Camera, pose: Pose, blob: &Blob) -> f64 {
        let ink_px2 = blob.area_px2 * self.contrast_ratio(blob);
        (ink_px2 / self.area_due_px2(camera, pose)).ln()
    }

    /// The blob's contrast over the usual one.
    pub(super) fn contrast_ratio(&self, blob: &Blob) -> f64 {
        blob.relative_contrast() / self.relative_contrast
    }

    /// Whether something lies across the blob's surroundings that did not before.
    pub(super) fn uneven(&self, blob: &Blob) -> bool {
        blob.unevenness > self.unevenness + MORE_UNEVEN
    }

    pub(super) fn add(&mut self, camera: &Camera, (frame, time_s): (usize, f64), sight: &Sight) {
        let Sight { pose, blob, blur_px, turn_known, .. } = *sight;
        let change = self.change(camera, pose, &blob);
        let whole = !blob.cut && change.abs() < WHOLE;
        if whole {
            self.background = blob.background;
            self.unevenness += NEWEST * (blob.unevenness - self.unevenness);
            if blur_px < SHARP_PX {
                self.relative_contrast += NEWEST * (blob.relative_contrast() - self.relative_contrast);
            }
        }
        // Nothing but being uncovered makes a marker grow.
        if change > 0.0 && self.target.mismatch(camera, &blob).tolerable() {
            self.area_ratio *= (NEWEST * change).exp();
        }
        self.seen.push(Seen { frame, time_s, pose, blob, whole, turn_known });
    }
}

/// A blob as a follower's marker.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    pub pose: Pose,
    pub blob: Blob,
    /// Where the dot beside it is, if it shows.
    pub dot: Option<Pixel>,
    /// How far it was taken to smear (px).
    pub blur_px: f64,
    /// Whether it tells how the object is turned; else the pose has the angle that was due.
    pub turn_known: bool,
    /// How unlike the follower's marker it looks: a sum of squares of standard deviations.
    pub strangeness: f64,
}

impl Sight {
    /// Whether something seen here is part of this marker.
    pub(super) fn shows(&self, at: Pixel, reach_px: f64) -> bool {
        self.marks().any(|mark| mark.distance_px(at) < reach_px)
    }

    /// Whether both are the same marker.
    pub(super) fn shares(&self, other: &Self) -> bool {
        let reach_px = self.blob.area_px2.sqrt() / 2.0;
        other.marks().any(|mark| self.shows(mark, reach_px))
    }

    fn marks(&self) -> impl Iterator<Item = Pixel> {
        std::iter::once(self.blob.centroid).chain(self.dot)
    }
}
