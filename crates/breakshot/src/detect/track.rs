//! Which blob of this frame is which object of the last one?
//!
//! Every object is expected where sliding on would have brought it; the blobs near enough are given out so that all
//! objects together are nearest to where they were expected, and look most like their own markers.  Each marker is
//! looked for at a level about halfway between its own grey and its surroundings', which follows it through shade and
//! light.

use super::assignment::assignment;
use super::association::Start;
use super::candidates::component_areas_px;
use super::label::{Component, Labeller, Window};
use super::marker::blob::{self, Blob};
use super::marker::target::{SPREAD_PX2, Target};
use super::threshold::Level;
use super::track_state::{Follower, Sight, WHOLE};
use crate::capture::{Camera, Frame, GreyImage};
use crate::geometry::{Pixel, Pose, Vec2, wrapped_rad};
use crate::moments::{compactness, principal_axes};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// No struck object outruns this (m/s): strikes end at 1 or 2 m/s, and what is struck leaves at less than twice that.
const FASTEST_M_S: f64 = 4.0;
/// A change of speed from frame to frame that is nothing unusual (m/s).
const USUAL_CHANGE_M_S: f64 = 0.5;
/// How far off a prediction is anyway (m).
const PREDICTION_STD_M: f64 = 0.002;
/// A marker's area in whole pixels differs by about this part (its logarithm's standard deviation), ...
const AREA_STD: f64 = 0.2;
/// ... its contrast and its fullness by this, ...
const LOOK_STD: f64 = 0.1;
/// ... and how much longer than wide it is by this: motion smears.
const ELONGATION_STD: f64 = 0.2;
/// Within this many standard deviations a marker may show in part; further off only the whole of it is believed.
const NEAR_STDS: f64 = 3.0;
/// Parts of the expected area between which a component may be the marker, partly covered or not.
const AREA_RATIOS: RangeInclusive<f64> = 0.2..=1.6;
/// A part of a marker is as dark as the whole, within this ratio.
const SAME_CONTRAST: f64 = 1.5;
/// A film's shutter is usually open for at most half the time from frame to frame.
const USUAL_SHUTTER: f64 = 0.5;
/// Levels this far apart are tried in a second look.
const SEARCH_STEP: usize = 8;
/// Components at two levels are the same thing if their centroids are nearer than this part of their size.
const SAME_PLACE: f64 = 0.3;

/// All objects through the clip, frame by frame.
pub(super) struct Tracker<'a> {
    pub camera: &'a Camera,
    pub followers: Vec<Follower<'a>>,
    areas_px: RangeInclusive<u64>,
    labeller: Labeller,
    threshold: Option<u8>,
    times_s: Vec<f64>,
    pub interval_s: f64,
}

/// A component that may be a follower's marker.
#[derive(Clone, Copy, Debug)]
struct Part {
    component: Component,
    level: Level,
}

/// One thing in the picture, at each level at which it was found.
type Thing = Vec<Part>;

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

    /// The times of the frames so far.
    pub(super) fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Finds every follower in the next frame, or not.
    pub(super) fn follow(&mut self, frame: &Frame) {
        if let Some(last_s) = self.times_s.last() {
            self.interval_s = frame.time_s - last_s;
        }
        self.times_s.push(frame.time_s);
        let due: Vec<Pose> = self.followers.iter().map(|f| f.predicted(frame.time_s)).collect();
        let things = self.things(&frame.image);
        let mut sights = self.sights(frame, &due, &things);
        for k in 0..sights.len() {
            if sights[k].is_none() {
                sights[k] = if self.followers[k].target.markerless() {
                    self.laid(frame, k, due[k])
                } else {
                    self.searched(frame, k, due[k], &sights)
                };
            }
        }
        // Outlines that are not where they are due are looked for once it is known where the others are.
        for k in 0..sights.len() {
            if sights[k].is_none() && self.followers[k].target.markerless() {
                sights[k] = self.laid_anywhere(frame, k, due[k], &sights);
            }
        }
        let at = (self.times_s.len() - 1, frame.time_s);
        for (follower, sight) in self.followers.iter_mut().zip(sights) {
            if let Some(sight) = sight {
                follower.add(self.camera, at, &sight);
            }
        }
    }

    /// What has about a marker's size, at each level that some marker needs.
    fn things(&mut self, image: &GreyImage) -> Vec<Thing> {
        let mut things: Vec<Thing> = Vec::new();
        for level in self.levels() {
            let same_side =
                |part: &Part| matches!(part.level, Level::Below(_)) == matches!(level, Level::Below(_));
            for &component in self.labeller.components(image, Window::whole(image), level, &self.areas_px) {
                let reach_px = SAME_PLACE * (component.area_px as f64).sqrt();
                let same = |thing: &&mut Thing| {
                    let off_px = thing[0].component.centroid().distance_px(component.centroid());
                    same_side(&thing[0]) && off_px < reach_px
                };
                let part = Part { component, level };
                match things.iter_mut().find(same) {
                    Some(thing) => thing.push(part),
                    None => things.push(vec![part]),
                }
            }
        }
        things
    }

    /// As few levels as cut out every marker cleanly.
    fn levels(&self) -> Vec<Level> {
        let mut shared: Vec<(bool, [f64; 2])> = Vec::new();
        for follower in self.followers.iter().filter(|f| !f.target.markerless()) {
            let (darker, [low, high]) = (follower.darker(), follower.clean_levels());
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

    /// What each follower is given.
    ///
    /// A component's place and area give the least its cost can be; how it looks adds to that, and is measured only
    /// for what would be given out: until nothing changes any more, which makes the answer the best of all.
    fn sights(&self, frame: &Frame, due: &[Pose], things: &[Thing]) -> Vec<Option<Sight>> {
        let mut costs: Vec<Vec<f64>> = (0..due.len())
            .map(|k| things.iter().map(|thing| self.nearest(k, due[k], thing, frame.time_s).0).collect())
            .collect();
        let mut measured: BTreeMap<(usize, usize), Option<Sight>> = BTreeMap::new();
        loop {
            let given = assignment(&costs);
            let mut news = false;
            for (k, thing) in given.iter().enumerate().filter_map(|(k, thing)| Some((k, (*thing)?))) {
                measured.entry((k, thing)).or_insert_with(|| {
                    news = true;
                    let (_, part) = self.nearest(k, due[k], &things[thing], frame.time_s);
                    let sight = self.sight(frame, k, due[k], part);
                    costs[k][thing] += sight.map_or(f64::INFINITY, |s| s.strangeness);
                    sight
                });
            }
            if !news {
                let sight = |(k, thing): (usize, &Option<usize>)| *measured.get(&(k, (*thing)?))?;
                return told_apart(given.iter().enumerate().map(sight).collect(), due);
            }
        }
    }

    /// How far from its prediction an object may be (m).
    fn reach_m(&self, k: usize, time_s: f64) -> f64 {
        let follower = &self.followers[k];
        let radius_m = follower.target.feature.shape.outer_radius_m();
        // What slid out over the picture's edge is not somewhere in its middle a second later.
        if follower.at_the_edge() {
            return NEAR_STDS * PREDICTION_STD_M + radius_m;
        }
        let not_whole_s = follower.not_whole_s(time_s).unwrap_or(self.interval_s);
        FASTEST_M_S * not_whole_s + radius_m
    }

    /// One standard deviation of where it will be around where it is due (m).
    fn prediction_std_m(&self, k: usize, time_s: f64) -> f64 {
        PREDICTION_STD_M + USUAL_CHANGE_M_S * self.followers[k].unseen_s(time_s).unwrap_or(self.interval_s)
    }

    /// The part of a thing that is most likely a follower's marker, by place and area, and its cost.
    fn nearest<'t>(&self, k: usize, due: Pose, thing: &'t Thing, time_s: f64) -> (f64, &'t Part) {
        let costs = thing.iter().map(|part| (self.cost(k, due, part, time_s), part));
        costs.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::INFINITY, &thing[0]))
    }

    fn cost(&self, k: usize, due: Pose, part: &Part, time_s: f64) -> f64 {
        let follower = &self.followers[k];
        if follower.target.markerless() {
            return f64::INFINITY;
        }
        if matches!(part.level, Level::Below(_)) != follower.darker() {
            return f64::INFINITY;
        }
        let off_m = self.off_m(follower, due, part.component.centroid());
        let ratio = part.component.area_px as f64 / follower.area_due_px2(self.camera, due);
        if off_m.is_nan() || off_m > self.reach_m(k, time_s) || !AREA_RATIOS.contains(&ratio) {
            return f64::INFINITY;
        }
        (off_m / self.prediction_std_m(k, time_s)).powi(2) + (ratio.ln() / AREA_STD).powi(2)
    }

    /// How far the object would be from where it is due, if its marker were here (m).
    fn off_m(&self, follower: &Follower, due: Pose, marker: Pixel) -> f64 {
        let height_m = follower.target.height_m();
        let place = self.camera.table_from_pixel(marker, height_m);
        place.distance(due.table_from_body(follower.target.feature.at_m))
    }

    /// The part as the follower's marker or a part of it, if it can be that.
    fn sight(&self, frame: &Frame, k: usize, due: Pose, part: &Part) -> Option<Sight> {
        let follower = &self.followers[k];
        let expected = self.blur_px(follower, due, follower.velocity());
        let look = |blur_px| self.measured(&frame.image, (k, due), part, blur_px);
        let mut best = look(expected)?;
        if follower.uneven(&best.blob)
            && let Some(came) = follower.came(best.pose, frame.time_s)
        {
            // Struck since the last frame, perhaps halfway: its speed now is up to twice the mean.
            for share in [1.0, 2.0] {
                let blur_px = self.blur_px(follower, due, came * share);
                let again = look(blur_px);
                best = again.filter(|s| s.blob.unevenness < best.blob.unevenness).unwrap_or(best);
            }
        }
        let change = follower.change(self.camera, best.pose, &best.blob);
        // However long it was out of sight: what lies further off is its marker only if it looks like all of it.
        let near_m = NEAR_STDS * (PREDICTION_STD_M + USUAL_CHANGE_M_S * self.interval_s);
        let near = self.off_m(follower, due, best.blob.centroid) < near_m;
        let alike = follower.target.mismatch(self.camera, &best.blob).tolerable();
        let as_dark = follower.contrast_ratio(&best.blob).ln().abs() < SAME_CONTRAST.ln();
        // A part is not larger than the whole.
        let part = change.abs() < WHOLE || change < 2.0 * WHOLE && as_dark;
        let possible = if near { part || alike && as_dark } else { change.abs() < 2.0 * WHOLE && alike };
        possible.then_some(best)
    }

    fn measured(
        &self,
        image: &GreyImage,
        (k, due): (usize, Pose),
        part: &Part,
        blur_px: [f64; 2],
    ) -> Option<Sight> {
        let follower = &self.followers[k];
        let blob: Blob = blob::measured(image, &part.component, part.level, blur_px)?;
        let pair = follower.target.pair(image, self.camera, &blob, (Some(due.yaw_rad), blur_px));
        if pair.is_none() && follower.target.may_be_dot(self.camera, &blob, due) {
            return None;
        }
        let blob = pair.map_or(blob, |pair| pair.disc);
        let yaw_near_rad = pair.map_or(due.yaw_rad, |p| due.yaw_rad + wrapped_rad(p.yaw_rad - due.yaw_rad));
        let pose = follower.target.pose(self.camera, blob.aim(), yaw_near_rad);
        let look = [
            follower.contrast_ratio(&blob),
            compactness(blob.area_px2, blob.covariance_px2) / follower.target.fullness(),
        ];
        let due_px2 = follower.target.picture(self.camera, pose).covariance;
        let stretched = elongation(blob.covariance_px2) - elongation(due_px2);
        let strangeness = look.iter().map(|ratio| (ratio.ln() / LOOK_STD).powi(2)).sum::<f64>()
            + (stretched / ELONGATION_STD).powi(2);
        let turn_known = pair.is_some() || follower.target.feature.dot.is_none();
        let dot = pair.map(|pair| pair.dot.centroid);
        Some(Sight { pose, blob, dot, blur_px: blur_px[0].hypot(blur_px[1]), turn_known, strangeness })
    }

    /// How far the marker moves in the picture while the shutter is open, as far as one can say.
    pub(super) fn blur_px(&self, follower: &Follower, due: Pose, velocity: Vec2) -> [f64; 2] {
        let exposure_s = self.camera.exposure_s.unwrap_or(USUAL_SHUTTER * self.interval_s);
        let height_m = follower.target.height_m();
        let from = self.camera.pixel_from_table(due.position, height_m);
        let to = self.camera.pixel_from_table(due.position + velocity * exposure_s, height_m);
        let blur_px = [to.x - from.x, to.y - from.y];
        if blur_px.iter().all(|b| b.is_finite()) { blur_px } else { [0.0, 0.0] }
    }

    /// A second look at every level near where a follower is due: shade may have moved its own, motion may have
    /// faded it, or something dark may touch it.
    fn searched(&mut self, frame: &Frame, k: usize, due: Pose, sights: &[Option<Sight>]) -> Option<Sight> {
        let follower = &self.followers[k];
        let marker = due.table_from_body(follower.target.feature.at_m);
        let height_m = follower.target.height_m();
        let at = self.camera.pixel_from_table(marker, height_m);
        let reach_px = self.reach_m(k, frame.time_s) / self.camera.scale_m_per_px(at, height_m);
        if !reach_px.is_finite() {
            return None;
        }
        let window = Window::around(at, reach_px, &frame.image);
        let area_px2 = follower.area_due_px2(self.camera, due);
        let [bx, by] = self.blur_px(follower, due, follower.velocity());
        let smeared_px2 = area_px2 + area_px2.sqrt() * bx.hypot(by);
        let areas_px = (area_px2 * (1.0 - 2.0 * WHOLE)) as u64..=(smeared_px2 * (1.0 + 2.0 * WHOLE)) as u64;
        let taken = |component: &Component| {
            sights.iter().flatten().any(|s| s.shows(component.centroid(), area_px2.sqrt() / 2.0))
        };
        let mut best: Option<(f64, Part)> = None;
        for level in (SEARCH_STEP..256).step_by(SEARCH_STEP).map(|l| l as u8) {
            let level = if follower.darker() { Level::Below(level) } else { Level::Above(level) };
            for component in self.labeller.components(&frame.image, window, level, &areas_px) {
                let full = follower.target.full_enough(component.area_px as f64, component.covariance_px2());
                let off_px = component.centroid().distance_px(at);
                if full && !taken(component) && best.is_none_or(|(least_px, _)| off_px < least_px) {
                    best = Some((off_px, Part { component: *component, level }));
                }
            }
        }
        best.and_then(|(_, part)| self.sight(frame, k, due, &part))
    }
}

/// The logarithm of long over short axis.
fn elongation(covariance_px2: [f64; 3]) -> f64 {
    let (long, short, _) = principal_axes(covariance_px2);
    ((long + SPREAD_PX2) / (short + SPREAD_PX2)).ln() / 2.0
}

/// Of two objects that were given the two equal dots of one marker, the one that was due further away goes without.
fn told_apart(mut sights: Vec<Option<Sight>>, due: &[Pose]) -> Vec<Option<Sight>> {
    let off_m = |k: usize, sight: &Sight| sight.pose.position.distance(due[k].position);
    for k in 0..sights.len() {
        for l in 0..k {
            if let (Some(one), Some(other)) = (sights[k], sights[l])
                && one.shares(&other)
            {
                let further = if off_m(k, &one) > off_m(l, &other) { k } else { l };
                sights[further] = None;
            }
        }
    }
    sights
}
