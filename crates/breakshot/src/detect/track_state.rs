//! What is known about one object while it is tracked: where it was, where it will be, and how its marker appears.

use super::marker::blob::Blob;
use super::marker::outline::{Appearance, MarkerFit};
use super::marker::target::Target;
use super::markerless::edge_fit::{LEAST_MEASURED, OutlineFit};
use super::threshold::Level;
use crate::capture::Camera;
use crate::geometry::moments::Moments;
use crate::geometry::{Pixel, Pose, Vec2, nearest_equivalent_rad};

/// What an object's pose was measured from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    /// The grey levels of its marker, or the outline of an object without one.
    Marker,
    /// The visible part of its marker's outline.
    MarkerOutline,
    /// Its own outline, because its marker is covered.
    ObjectOutline,
}

/// A tracked object in the current frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observation {
    pub pose: Pose,
    pub source: Source,
    /// Its marker; the expected one where only an outline is visible.
    pub blob: Blob,
    /// Its marker's outline near the pose, if there are edges.
    pub outline: Option<MarkerFit>,
    /// The fit of the object's own outline, where it was compared with the marker.
    pub object_outline: Option<OutlineFit>,
    /// The fraction of an object's own outline that was measured; 1 for a marker.
    pub measured_fraction: f64,
    /// Centroid of the dot beside the marker, if it is visible.
    pub dot: Option<Pixel>,
    /// Assumed motion blur (px).
    pub blur_px: f64,
    /// The motion blur that the marker itself shows (px), where the assumed one does not explain its appearance.
    pub measured_blur_px: Option<[f64; 2]>,
    /// Whether the yaw was measured; otherwise the pose has the predicted one.
    pub yaw_known: bool,
    /// Difference from the object's marker in appearance: a sum of squares (standard deviations).
    pub appearance_cost: f64,
}

impl Observation {
    /// An object whose yaw was measured, without outline, dot and motion blur.
    pub(super) fn new(pose: Pose, source: Source, blob: Blob) -> Self {
        Self {
            pose,
            source,
            blob,
            outline: None,
            object_outline: None,
            measured_fraction: 1.0,
            dot: None,
            blur_px: 0.0,
            measured_blur_px: None,
            yaw_known: true,
            appearance_cost: 0.0,
        }
    }

    /// Whether something at this position is part of the observed marker.
    pub(super) fn covers(&self, at: Pixel, reach_px: f64) -> bool {
        self.centroids().any(|centroid| centroid.distance_px(at) < reach_px)
    }

    /// Whether both observe the same marker.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        let reach_px = self.blob.area_px2.sqrt() / 2.0;
        other.centroids().any(|centroid| self.covers(centroid, reach_px))
    }

    fn centroids(&self) -> impl Iterator<Item = Pixel> {
        std::iter::once(self.blob.centroid).chain(self.dot)
    }
}

/// An object in one of the frames so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrackPoint {
    /// Number of the frame.
    pub frame: usize,
    pub time_s: f64,
    pub pose: Pose,
    pub source: Source,
    pub blob: Blob,
    /// The fit of the marker's outline.
    pub outline: Option<MarkerFit>,
    /// The fit of the object's own outline, where it was compared with the marker.
    pub object_outline: Option<OutlineFit>,
    /// The fraction of an object's own outline that was measured; 1 for a marker.
    pub measured_fraction: f64,
    /// The motion blur that the marker itself shows (px), where it was measured.
    pub measured_blur_px: Option<[f64; 2]>,
    /// Whether the whole marker was visible.
    pub complete: bool,
    /// Whether the yaw was measured.
    pub yaw_known: bool,
}

impl TrackPoint {
    /// Whether enough of an object's own outline was measured to trust it; a marker always is.
    pub(super) fn is_well_measured(&self) -> bool {
        self.measured_fraction >= LEAST_MEASURED
    }
}

/// One object through the clip.
#[derive(Clone, Debug)]
pub(super) struct TrackState<'a> {
    pub target: Target<'a>,
    pub points: Vec<TrackPoint>,
    /// Whether the outline distinguishes the yaw from the one that is half a turn off, or half a turn changes nothing.
    pub half_turn_known: bool,
    start: Pose,
    /// Running mean of the marker's area over the expected one.
    area_ratio: f64,
    /// Running mean of the trace of the marker's second moments over the expected one, without motion blur.
    moment_ratio: f64,
    /// Running mean of contrast over background.
    relative_contrast: f64,
    /// Whether the object's own outline was found beside its marker so far.
    pub has_object_outline: bool,
    /// Background and its residual when the marker was last complete (grey levels).
    background: f64,
    background_rms: f64,
}

/// Assumed deceleration of an object that is not observed (m/s2): a friction coefficient of 0.25.
const DECELERATION_M_S2: f64 = 2.5;
/// Largest change of a complete marker's area (logarithm of a ratio).
pub(super) const COMPLETE: f64 = 0.1;
/// Weight of the newest frame in running means.
const NEWEST_WEIGHT: f64 = 0.2;
/// Range of thresholds that separate a marker cleanly, as fractions of the contrast above the marker's grey level.
const SEPARATING_FRACTIONS: [f64; 2] = [0.35, 0.65];
/// An increase of the background's residual by this much (grey levels) is an object beside the marker, or a change of the light.
pub(super) const DISTURBED_LEVELS: f64 = 3.0;
/// More motion blur than this (px) reduces a marker's contrast.
pub(super) const SHARP_PX: f64 = 2.0;

impl<'a> TrackState<'a> {
    /// The state before the first frame, of a target whose marker is the given blob: with its pose, and whether its half turn is known.
    pub(super) fn new(
        target: Target<'a>,
        blob: &Blob,
        (start, half_turn_known): (Pose, bool),
        camera: &Camera,
    ) -> Self {
        let target = target.with_polarity_of(blob);
        let projection = target.projection(camera, start);
        let area_ratio = blob.area_px2 / projection.area;
        let moment_ratio = trace(blob.linear_covariance_px2) / trace(projection.covariance);
        Self {
            target,
            points: Vec::new(),
            half_turn_known,
            start,
            area_ratio,
            moment_ratio,
            relative_contrast: blob.relative_contrast(),
            has_object_outline: false,
            background: blob.background,
            background_rms: blob.background_rms,
        }
    }

    /// The pose at a later time if the object slides on with constant deceleration.
    pub(super) fn predicted(&self, time_s: f64) -> Pose {
        let Some(last) = self.points.last() else { return self.start };
        let velocity = self.velocity();
        let speed_m_s = velocity.length();
        let sliding_s = (time_s - last.time_s).min(speed_m_s / DECELERATION_M_S2);
        let lost_m_s = DECELERATION_M_S2 * sliding_s / 2.0;
        let path = velocity.direction().map_or(Vec2::ZERO, |d| d * ((speed_m_s - lost_m_s) * sliding_s));
        Pose { position: last.pose.position + path, yaw_rad: self.predicted_yaw_rad(time_s) }
    }

    /// The yaw extrapolated from the last two points with a measured yaw, by a complete marker or by the outline of one.
    fn predicted_yaw_rad(&self, time_s: f64) -> f64 {
        let is_measured = |p: &&TrackPoint| p.yaw_known && (p.complete || p.source == Source::MarkerOutline);
        let mut measured = self.points.iter().rev().filter(is_measured);
        let Some(last) = measured.next() else { return self.start.yaw_rad };
        let Some(before) = measured.next() else { return last.pose.yaw_rad };
        let interval_s = last.time_s - before.time_s;
        // Rotation stops with sliding at an unknown time, so the extrapolation ends after one interval.
        let rotating_s = (time_s - last.time_s).min(interval_s);
        last.pose.yaw_rad + (last.pose.yaw_rad - before.pose.yaw_rad) * rotating_s / interval_s
    }

    /// Mean velocity to the last point from the one before, or from the last well measured one before if the last point is well measured
    /// itself; zero before there are two points.
    pub(super) fn velocity(&self) -> Vec2 {
        let [earlier @ .., last] = self.points.as_slice() else { return Vec2::ZERO };
        let measured = || earlier.iter().rfind(|p| p.is_well_measured());
        let before = last.is_well_measured().then(measured).flatten().or(earlier.last());
        let Some(before) = before else { return Vec2::ZERO };
        (last.pose.position - before.pose.position) / (last.time_s - before.time_s)
    }

    /// The last point that is well measured, if there are later ones: those may be another outline, such as that of the object's shadow.
    pub(super) fn before_doubtful(&self) -> Option<&TrackPoint> {
        let last = self.points.iter().rposition(TrackPoint::is_well_measured)?;
        (last + 1 < self.points.len()).then(|| &self.points[last])
    }

    /// The velocity at a later time if the object slides on with constant deceleration.
    pub(super) fn velocity_at(&self, time_s: f64) -> Vec2 {
        let velocity = self.velocity();
        let lost_m_s = DECELERATION_M_S2 * self.unobserved_s(time_s).unwrap_or(0.0);
        velocity.direction().map_or(Vec2::ZERO, |d| d * (velocity.length() - lost_m_s).max(0.0))
    }

    /// Mean velocity from the last point to a pose at this time.
    pub(super) fn velocity_to(&self, here: Pose, time_s: f64) -> Option<Vec2> {
        let last = self.points.last()?;
        Some((here.position - last.pose.position) / (time_s - last.time_s))
    }

    /// Time since the last point (s).
    pub(super) fn unobserved_s(&self, time_s: f64) -> Option<f64> {
        self.points.last().map(|p| time_s - p.time_s)
    }

    /// Time since the last point with a complete marker (s).
    pub(super) fn incomplete_s(&self, time_s: f64) -> Option<f64> {
        self.points.iter().rev().find(|p| p.complete).map(|p| time_s - p.time_s)
    }

    /// Whether the border of the image cut the marker off at the last point.
    pub(super) fn is_at_border(&self) -> bool {
        self.points.last().is_some_and(|p| p.blob.at_border)
    }

    /// Whether the marker is darker than its background.
    pub(super) fn is_dark(&self) -> bool {
        self.relative_contrast > 0.0
    }

    /// Lowest and highest threshold that separate the marker cleanly from its background.
    pub(super) fn separating_levels(&self) -> [f64; 2] {
        let contrast = self.relative_contrast * self.background;
        let [one, other] = SEPARATING_FRACTIONS.map(|fraction| self.background - contrast * (1.0 - fraction));
        [one.min(other), one.max(other)]
    }

    /// Contrast over background of the marker: positive if it is dark.
    pub(super) fn relative_contrast(&self) -> f64 {
        self.relative_contrast
    }

    /// The usual grey level of the background.
    pub(super) fn background(&self) -> f64 {
        self.background
    }

    /// The level between the background (0) and the marker's own grey level (1).
    pub(super) fn level_at(&self, fraction: f64) -> Level {
        Level::nearest(self.is_dark(), self.background * (1.0 - fraction * self.relative_contrast))
    }

    /// Expected second moments of the marker at a pose, with the blur of the lens and without motion blur (px2).
    pub(super) fn expected_covariance_px2(&self, camera: &Camera, pose: Pose) -> [f64; 3] {
        self.target.projection(camera, pose).covariance.map(|moment| moment * self.moment_ratio)
    }

    /// Expected area of the marker at a pose (px2).
    pub(super) fn expected_area_px2(&self, camera: &Camera, pose: Pose) -> f64 {
        self.target.projection(camera, pose).area * self.area_ratio
    }

    /// Logarithm of area times contrast over the expected product: 0 for a complete marker, with or without motion
    /// blur.
    pub(super) fn signal_change(&self, camera: &Camera, pose: Pose, blob: &Blob) -> f64 {
        let signal_px2 = blob.area_px2 * self.contrast_ratio(blob);
        (signal_px2 / self.expected_area_px2(camera, pose)).ln()
    }

    /// Whether an observation shows the whole marker, and nothing more.
    pub(super) fn is_complete(&self, camera: &Camera, observation: &Observation) -> bool {
        let Observation { pose, blob, .. } = observation;
        !blob.at_border && self.signal_change(camera, *pose, blob).abs() < COMPLETE
    }

    /// How the marker appears while it moves by this much during the exposure (px).
    pub(super) fn appearance(&self, blur_px: [f64; 2]) -> Appearance {
        let contrast = (self.relative_contrast * self.background).abs();
        Appearance { dark: self.is_dark(), contrast, blur_px }
    }

    /// The blob that the marker would be with the object at a pose, known within a standard deviation (px).
    pub(super) fn expected_blob(&self, camera: &Camera, pose: Pose, std_px: f64) -> Blob {
        let Moments { centroid: [x, y], covariance, .. } = self.target.projection(camera, pose);
        Blob {
            centroid: Pixel::new(x, y),
            std_px,
            area_px2: self.expected_area_px2(camera, pose),
            covariance_px2: covariance,
            linear_covariance_px2: covariance,
            background: self.background,
            contrast: self.relative_contrast * self.background,
            background_rms: self.background_rms,
            at_border: false,
        }
    }

    /// Relative contrast of a blob over that of the marker.
    pub(super) fn contrast_ratio(&self, blob: &Blob) -> f64 {
        blob.relative_contrast() / self.relative_contrast
    }

    /// Whether the background of a blob contains structure that the marker's background did not.
    pub(super) fn is_disturbed(&self, blob: &Blob) -> bool {
        blob.background_rms > self.background_rms + DISTURBED_LEVELS
    }

    /// The observed pose; of the yaws at which a symmetric outline looks the same, the one nearest to that of the last point. With the one
    /// nearest to the predicted yaw, an outline that was once found one period further would rotate by that period in every later frame.
    fn least_rotated(&self, observation: &Observation) -> Pose {
        let Observation { pose, source, .. } = *observation;
        let is_by_object = source == Source::ObjectOutline || self.target.is_markerless();
        let period_rad = self.target.object.shape.rotation_symmetry_rad().filter(|_| is_by_object);
        let Some(period_rad) = period_rad.filter(|&period_rad| period_rad > 0.0) else { return pose };
        let near_rad = self.points.last().map_or(self.start, |p| p.pose).yaw_rad;
        Pose { yaw_rad: nearest_equivalent_rad(pose.yaw_rad, near_rad, period_rad), ..pose }
    }

    /// Adds the observation of a frame.
    pub(super) fn add(&mut self, camera: &Camera, frame: usize, time_s: f64, observation: &Observation) {
        let Observation { source, blob, outline, object_outline, measured_fraction, .. } = *observation;
        let pose = self.least_rotated(observation);
        let Observation { blur_px, measured_blur_px, yaw_known, .. } = *observation;
        let change = self.signal_change(camera, pose, &blob);
        let complete = source == Source::Marker && self.is_complete(camera, observation);
        if complete {
            self.background = blob.background;
            self.background_rms += NEWEST_WEIGHT * (blob.background_rms - self.background_rms);
            if blur_px < SHARP_PX {
                self.relative_contrast += NEWEST_WEIGHT * (blob.relative_contrast() - self.relative_contrast);
                let expected_px2 = trace(self.target.projection(camera, pose).covariance);
                let ratio = trace(blob.linear_covariance_px2) / expected_px2;
                self.moment_ratio += NEWEST_WEIGHT * (ratio - self.moment_ratio);
            }
        }
        // A marker can only grow because it was partly covered before.
        if source == Source::Marker && change > 0.0 && self.target.mismatch(camera, &blob).is_tolerable() {
            self.area_ratio *= (NEWEST_WEIGHT * change).exp();
        }
        self.has_object_outline |= object_outline.is_some();
        self.points.push(TrackPoint {
            frame,
            time_s,
            pose,
            source,
            blob,
            outline,
            object_outline,
            measured_fraction,
            measured_blur_px,
            complete,
            yaw_known,
        });
    }
}

fn trace([xx, _, yy]: [f64; 3]) -> f64 {
    xx + yy
}
