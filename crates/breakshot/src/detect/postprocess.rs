//! Which samples are reliable, and what are the angles without motion blur?
//!
//! After the whole clip the usual appearance of every marker is known: samples that deviate from it are marked as
//! doubtful, and the motion blur is removed from the second moments that determine the yaw.

use super::derivatives;
use super::marker::blob::ImagePose;
use super::marker::outline::OUTLINE_REACH_PX;
use super::marker::target::Target;
use super::motion_blur::{LEAST_FAST, velocity_px_s, without_blur};
use super::track::{FASTEST_M_S, LEAST_VISIBLE};
use super::track_state::{DISTURBED_LEVELS, Source, TrackPoint, TrackState};
use super::tracks::{Sample, Track};
use super::why::reason::Doubt;
use crate::capture::Camera;
use crate::geometry::moments::principal_axes;
use crate::geometry::{Pixel, Pose, Vec2, half_turn_wrapped_rad, wrapped_rad};
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, upper_median};
use std::f64::consts::PI;

/// A deviation of the half axes from the usual ones by more than this (px) is an occlusion: compression of moving
/// markers causes about a tenth of a pixel.
const USUAL_DEVIATION_PX: f64 = 0.35;
/// The same as a multiple of their scatter, where that is larger.
const USUAL_SCATTERS: f64 = 5.0;
/// The usual half axes of a marker differ from the specified ones by at most this fraction of them and this distance (px).
const MOST_EXCESS: f64 = 0.12;
const MOST_EXCESS_PX: f64 = 1.0;
/// From this blur on (px) the dead band rotates the principal axes by more than noise does without it.
const LONG_BLUR_PX: f64 = 5.0;
/// Relative uncertainty of the blur: the opening and closing of the shutter are unknown.
const BLUR_UNCERTAINTY: f64 = 0.1;
/// The yaw of a whole marker is doubtful if the standard deviation by its outline is larger than this (rad), ...
const DOUBTFUL_YAW_STD_RAD: f64 = 0.04;
/// ... or if the yaws by its second moments and by its outline are further apart than this (rad).
const YAWS_APART_RAD: f64 = 0.05;
/// A marker further from its outline than this (standard deviations) is disturbed by something beside it: the outline counts if it is
/// sharp, with a standard deviation below this (px).
const APART_STDS: f64 = 3.0;
const SHARP_STD_PX: f64 = 0.15;
/// If it is further off than this, and the outline is not sharp, the position is doubtful.
const FAR_APART_STDS: f64 = 5.0;
/// A sample is off the path if the speeds to it and from it are this many times those around it.
const DETOUR: f64 = 3.0;
/// Cosine of the angle between two vectors of the same direction.
const SAME_DIRECTION: f64 = 0.9;
/// A displacement by light that changes across a marker is reported from this on (px).
const UNEVEN_PX: f64 = 0.3;
/// A marker is blurred by at most this multiple of the distance that it moves from frame to frame, and of this distance (px) where it is
/// less: more is a shadow across it, or something beside it.
const MOST_BLUR: f64 = 1.5;
const LEAST_STEP_PX: f64 = 2.0;
/// A standard deviation above this (px) is that of something else than a marker or an outline.
const NOISY_PX: f64 = 1.5;
/// A displacement by a part of a marker that is not seen is reported from this on (px).
const LOST_PX: f64 = 0.5;
/// Standard deviation of the distance of a marker's centre from where the object's outline has it (m): markers are placed by hand.
const OUTLINE_STD_M: f64 = 0.5e-3;
/// An object that reaches the border within this time (s) at its velocity has left the image when it is lost.
const LEAVING_S: f64 = 0.1;

/// The track of one object, and what each of its samples is doubtful for.
pub(super) struct DoubtedTrack {
    pub track: Track,
    /// Beside each sample; empty for one that is not doubtful.
    pub doubts: Vec<Vec<Doubt>>,
}

/// The track of one object, in the order of time.
pub(super) fn track(camera: &Camera, state: &TrackState, exposure_s: f64) -> DoubtedTrack {
    // Appearance of the marker in every frame
    let target = &state.target;
    let blurs_px: Vec<[f64; 2]> =
        (0..state.points.len()).map(|k| blur_px(&state.points, k, exposure_s)).collect();
    let appearances: Vec<Option<Appearance>> = state
        .points
        .iter()
        .zip(&blurs_px)
        .map(|(p, blur)| (p.source == Source::Marker).then(|| appearance(camera, target, p, *blur)))
        .collect();
    let deviations_px = size_deviations_px(&appearances);
    let mut yaw_near_rad = state.points.first().map_or(0.0, |p| p.pose.yaw_rad);
    let always_by_outline = is_disturbed(camera, state);
    let markers = state.points.iter().filter(|p| p.source == Source::Marker);
    let usual_rms = upper_median(markers.map(|p| p.blob.background_rms)).unwrap_or(0.0);

    // Samples
    let points = state.points.iter().zip(&appearances).zip(deviations_px).enumerate();
    let samples = points.map(|(k, ((point, appearance), deviation_px))| {
        let accelerated_m = accelerated_m(&state.points, k);
        let scale_m_per_px = camera.scale_m_per_px(point.blob.centroid, target.height_m());
        let uneven_px = uneven_light_px(point, usual_rms);
        let lost_px = lost_px(camera, state, point);
        let appearance = appearance.as_ref();
        let seen = Seen {
            camera,
            target,
            point,
            appearance,
            deviation_px,
            uneven_px,
            lost_px,
            accelerated_m,
            step_px: step_px(&state.points, k),
            scale_m_per_px,
        };
        let mut measured = seen.measured(always_by_outline, yaw_near_rad);
        yaw_near_rad = measured.pose.yaw_rad;
        if !state.half_turn_known {
            measured = measured.at_marker(target);
        }
        // A rolling shutter exposes lower rows later.
        let time_s = point.time_s + camera.readout_s * point.blob.centroid.y / camera.size_px[1] as f64;
        let yaw_rad = (target.has_observable_yaw() && measured.yaw_known).then_some(measured.pose.yaw_rad);
        if target.is_off_centre() && !measured.yaw_known {
            measured.doubts.push(Doubt::Yaw);
        }
        let sample = Sample::new(time_s, measured.pose.position, yaw_rad, measured.std_m);
        (Sample { doubtful: !measured.doubts.is_empty(), ..sample }, measured.doubts)
    });
    let (samples, doubts) = samples.unzip();
    DoubtedTrack { track: Track { object: target.name.to_string(), samples }, doubts }
}

/// Motion of a marker during the exposure (px): as it shows itself, or else as its velocity implies.
fn blur_px(points: &[TrackPoint], k: usize, exposure_s: f64) -> [f64; 2] {
    points[k].measured_blur_px.unwrap_or_else(|| velocity_px_s(points, k).map(|v| v * exposure_s))
}

/// How much further an object moves in the interval after a frame than in the one before (m); zero if it moves about as far.
fn accelerated_m(points: &[TrackPoint], k: usize) -> Vec2 {
    let (Some(before), Some(after)) = (k.checked_sub(1).and_then(|k| points.get(k)), points.get(k + 1))
    else {
        return Vec2::ZERO;
    };
    let here = points[k].pose.position;
    let (came_m, goes_m) = (here - before.pose.position, after.pose.position - here);
    let change_m = goes_m - came_m;
    if change_m.length() > came_m.length().max(goes_m.length()) / 2.0 { change_m } else { Vec2::ZERO }
}

/// How far a marker moves in the image to the next frame or from the one before, whichever is more (px); infinite where it is not seen in both.
fn step_px(points: &[TrackPoint], k: usize) -> f64 {
    let point = &points[k];
    let distance_px = |other: Option<&TrackPoint>| {
        let other = other.filter(|other| other.frame.abs_diff(point.frame) == 1)?;
        Some(other.blob.centroid.distance_px(point.blob.centroid))
    };
    let before = k.checked_sub(1).and_then(|k| points.get(k));
    match (distance_px(before), distance_px(points.get(k + 1))) {
        (Some(before), Some(after)) => before.max(after),
        _ => f64::INFINITY,
    }
}

/// What one frame shows of an object.
struct Seen<'a> {
    camera: &'a Camera,
    target: &'a Target<'a>,
    point: &'a TrackPoint,
    /// That of its marker, if this was seen.
    appearance: Option<&'a Appearance>,
    /// Deviation of the marker's size (px), if it is unusual.
    deviation_px: Option<f64>,
    /// Possible displacement of its marker by light that changes across it (px).
    uneven_px: f64,
    /// Possible displacement of its marker because a part of it is not seen (px).
    lost_px: f64,
    /// See [`accelerated_m`].
    accelerated_m: Vec2,
    /// See [`step_px`].
    step_px: f64,
    scale_m_per_px: f64,
}

impl Seen<'_> {
    /// The pose by what determines it best: the grey levels of a whole marker, or the visible part of its outline.
    fn measured(&self, always_by_outline: bool, yaw_near_rad: f64) -> Measured {
        let by_marker = self.by_marker(yaw_near_rad);
        let Some(by_outline) = self.by_outline(yaw_near_rad) else { return by_marker };
        let is_deviating =
            self.deviation_px.is_some() || self.point.blob.at_border || self.uneven_px > UNEVEN_PX;
        match self.point.source {
            Source::MarkerOutline => by_outline,
            Source::Marker if is_deviating && by_outline.std_m < by_marker.std_m => by_outline,
            Source::Marker if always_by_outline => by_outline,
            Source::Marker
                if by_outline.std_m < SHARP_STD_PX * self.scale_m_per_px
                    && by_marker.is_apart(&by_outline, APART_STDS)
                    && !self.is_struck(&by_marker, &by_outline) =>
            {
                by_outline
            }
            Source::Marker => by_marker.beside(&by_outline),
            Source::ObjectOutline => by_marker,
        }
    }

    /// Whether the marker is where its outline is not because it was accelerated during the exposure: its outline is the sharp one of the
    /// time when it was at rest, and its centroid the mean position.
    fn is_struck(&self, by_marker: &Measured, by_outline: &Measured) -> bool {
        let ahead_m = by_marker.pose.position - by_outline.pose.position;
        ahead_m.dot(self.accelerated_m) > SAME_DIRECTION * ahead_m.length() * self.accelerated_m.length()
    }

    /// Whether the marker's outline is visible, and blurred by no more than the object moves from frame to frame.
    fn has_outline(&self) -> bool {
        let is_visible = self.point.outline.is_some_and(|fit| fit.visible_fraction > LEAST_VISIBLE);
        let blur_px = self.point.measured_blur_px.map_or(0.0, |[x, y]| x.hypot(y));
        is_visible && blur_px < self.step_px.max(LEAST_STEP_PX) * MOST_BLUR
    }

    /// The pose by the visible part of the marker's outline, if enough is visible.
    fn by_outline(&self, yaw_near_rad: f64) -> Option<Measured> {
        let fit = self.point.outline.filter(|fit| fit.visible_fraction > LEAST_VISIBLE)?;
        let yaw_rad = yaw_near_rad + wrapped_rad(fit.pose.yaw_rad - yaw_near_rad);
        let std_px = fit.std_m / self.scale_m_per_px;
        let is_yaw_rough = fit.has_rough_yaw();
        // A disc and its dot that shade or blur leave the position of an object known where they hardly show its yaw.
        let is_position_alone =
            is_yaw_rough && self.target.feature.dot.is_some() && !self.target.is_off_centre();
        let is_rough = !fit.has_known_position(self.scale_m_per_px) || is_yaw_rough && !is_position_alone;
        Some(Measured {
            pose: Pose { yaw_rad, ..fit.pose },
            std_m: fit.std_m,
            yaw_known: fit.knows_yaw() && !is_position_alone,
            doubts: is_rough.then_some(Doubt::PartOfMarker { std_px }).into_iter().collect(),
        })
    }

    /// A pose by the marker's centroid and second moments, with the mean of their yaw and that of the marker's outline, if this has one, and
    /// how far the two are apart (rad). Uneven light rotates the moments, and noise of few edges the outline: their errors are not the same.
    fn with_outline_yaw(&self, pose: Pose) -> (Pose, f64) {
        let has_outline = self.has_outline() && self.target.has_axis();
        let Some(fit) = self.point.outline.filter(|fit| has_outline && fit.knows_yaw()) else {
            return (pose, 0.0);
        };
        let apart_rad = half_turn_wrapped_rad(fit.pose.yaw_rad - pose.yaw_rad);
        let at_m = self.target.feature.at_m;
        let yaw_rad = pose.yaw_rad + apart_rad / 2.0;
        let position = pose.table_from_body(at_m) - at_m.to_vec().rotated(yaw_rad);
        (Pose { position, yaw_rad }, apart_rad.abs())
    }

    /// The pose by the grey levels of the marker; by the object's own outline if it has none, or its marker is covered.
    fn by_marker(&self, yaw_near_rad: f64) -> Measured {
        let Self { target, point, .. } = *self;
        let (pose, yaws_apart_rad) = match self.appearance {
            Some(appearance) if !target.is_markerless() && target.feature.dot.is_none() => {
                let observed = ImagePose { centroid: point.blob.centroid, axis_rad: appearance.axis_rad };
                self.with_outline_yaw(target.pose(self.camera, observed, yaw_near_rad))
            }
            _ => (point.pose, 0.0),
        };
        let outline_std_rad =
            point.outline.filter(|_| target.has_observable_yaw()).map_or(0.0, |fit| fit.yaw_std_rad);
        let yaw_std_rad = if yaws_apart_rad > YAWS_APART_RAD {
            yaws_apart_rad.max(outline_std_rad)
        } else {
            outline_std_rad
        };
        let is_partial = target.is_markerless() && !point.complete;
        let is_rough = !is_partial && !point.is_well_measured();
        let is_covered = point.source == Source::ObjectOutline;
        let has_no_outline = point.source == Source::Marker && !target.is_markerless() && !self.has_outline();
        let unseen_px = if has_no_outline { OUTLINE_REACH_PX } else { 0.0 };
        let doubts = [
            self.deviation_px.map(|deviation_px| Doubt::Size { deviation_px }),
            point.blob.at_border.then_some(Doubt::AtBorder),
            is_partial.then_some(Doubt::Outline { visible: point.blob.contrast }),
            is_rough.then_some(Doubt::Outline { visible: point.measured_fraction }),
            is_covered.then_some(Doubt::MarkerCovered),
            (yaw_std_rad > DOUBTFUL_YAW_STD_RAD).then_some(Doubt::UncertainYaw { std_rad: yaw_std_rad }),
            (self.uneven_px > UNEVEN_PX).then_some(Doubt::UnevenLight { shift_px: self.uneven_px }),
            (self.lost_px > LOST_PX).then_some(Doubt::PartOfMarker { std_px: self.lost_px }),
            has_no_outline.then_some(Doubt::OutlineNotSeen),
        ];
        // An occlusion that shortens a marker displaces its centroid by about as much. An object whose marker is off its centroid is
        // displaced by an error of the yaw.
        let size_px = point.blob.std_px + self.deviation_px.unwrap_or(0.0);
        let by_size_m =
            self.scale_m_per_px * size_px.hypot(self.uneven_px).hypot(self.lost_px).hypot(unseen_px);
        let by_yaw_m = yaw_std_rad * target.feature.at_m.to_vec().length();
        let by_outline_m = if is_covered { OUTLINE_STD_M } else { 0.0 };
        let std_m = by_size_m.hypot(by_yaw_m).hypot(by_outline_m);
        Measured { pose, std_m, yaw_known: point.yaw_known, doubts: doubts.into_iter().flatten().collect() }
    }
}

/// The pose of an object in one frame.
struct Measured {
    pose: Pose,
    std_m: f64,
    yaw_known: bool,
    /// Why it may be biased; empty if it is trusted.
    doubts: Vec<Doubt>,
}

impl Measured {
    /// Whether two measurements are further apart than this many standard deviations.
    fn is_apart(&self, other: &Self, stds: f64) -> bool {
        self.pose.position.distance(other.pose.position) > stds * self.std_m.hypot(other.std_m)
    }

    /// The mean of this position and the one with the object turned by half a turn about its marker, which is the marker's own.
    fn at_marker(mut self, target: &Target) -> Self {
        let (at_m, off_m) = (target.feature.at_m, target.feature.at_m.to_vec().length());
        self.pose.position = self.pose.table_from_body(at_m);
        self.std_m = self.std_m.hypot(off_m);
        if off_m > OUTLINE_STD_M {
            self.doubts.push(Doubt::HalfTurn { off_m });
        }
        self
    }

    /// The pose by the marker; doubtful if the marker's outline is elsewhere.
    fn beside(mut self, outline: &Self) -> Self {
        if outline.doubts.is_empty() && self.is_apart(outline, FAR_APART_STDS) {
            self.doubts.push(Doubt::OutlineElsewhere);
        }
        self
    }
}

/// How far the centre of a marker may be displaced because the light changes across it (px), from a background that is less even than
/// usual: pixels in the shade have less weight than others, and the centre moves by a quarter of the marker's length times their part.
fn uneven_light_px(point: &TrackPoint, usual_rms: f64) -> f64 {
    let blob = &point.blob;
    if point.source != Source::Marker || blob.background_rms < usual_rms + DISTURBED_LEVELS {
        return 0.0;
    }
    let uneven = (blob.background_rms.powi(2) - usual_rms.powi(2)).sqrt();
    let (long_px2, ..) = principal_axes(blob.covariance_px2);
    long_px2.sqrt() * uneven / blob.contrast.abs()
}

/// How far the centre of a marker may be displaced because a part of it is not seen (px): by that part of half of its length.
fn lost_px(camera: &Camera, state: &TrackState, point: &TrackPoint) -> f64 {
    if point.source != Source::Marker || point.complete || state.target.is_markerless() {
        return 0.0;
    }
    let seen = state.signal_change(camera, point.pose, &point.blob).exp().min(1.0);
    let (long_px2, ..) = principal_axes(state.target.projection(camera, point.pose).covariance);
    (1.0 - seen) * 2.0 * long_px2.sqrt()
}

/// Whether a marker usually seems to be elsewhere than its outline, because something beside it is as dark: its own dot, the shade of an edge.
fn is_disturbed(camera: &Camera, state: &TrackState) -> bool {
    let apart_stds = state.points.iter().filter_map(|point| {
        let fit = point.outline.filter(|_| point.source == Source::Marker && point.complete)?;
        let scale_m_per_px = camera.scale_m_per_px(point.blob.centroid, state.target.height_m());
        let std_m = fit.std_m.hypot(scale_m_per_px * point.blob.std_px);
        (fit.std_m < SHARP_STD_PX * scale_m_per_px)
            .then(|| fit.pose.position.distance(point.pose.position) / std_m)
    });
    upper_median(apart_stds).is_some_and(|stds| stds > APART_STDS)
}

/// Direction and size of a marker in one frame, without motion blur.
struct Appearance {
    /// Direction of the principal axis in the image (rad).
    axis_rad: f64,
    /// Mean radius, long and short half axis, less the expected ones (px), and the expected ones.
    excess_px: [f64; 3],
    expected_px: [f64; 3],
    /// Length of the motion blur (px).
    blur_px: f64,
}

fn appearance(camera: &Camera, target: &Target, point: &TrackPoint, blur_px: [f64; 2]) -> Appearance {
    let expected = target.projection(camera, point.pose);
    let is_short = blur_px[0].hypot(blur_px[1]) < LONG_BLUR_PX && point.measured_blur_px.is_none();
    let covariance_px2 = if is_short { point.blob.covariance_px2 } else { point.blob.linear_covariance_px2 };
    let (long, short, axis_rad) = principal_axes(without_blur(covariance_px2, blur_px));
    let (expected_long, expected_short, _) = principal_axes(expected.covariance);
    let sizes_px =
        |area: f64, long: f64, short: f64| [(area / PI).sqrt(), 2.0 * long.sqrt(), 2.0 * short.sqrt()];
    let observed_px = sizes_px(point.blob.area_px2, long, short);
    let expected_px = sizes_px(expected.area, expected_long, expected_short);
    Appearance {
        axis_rad,
        excess_px: std::array::from_fn(|i| observed_px[i] - expected_px[i]),
        expected_px,
        blur_px: blur_px[0].hypot(blur_px[1]),
    }
}

/// Largest deviation of a marker's size from its median over the clip (px), per frame; `None` where it is within noise.  If the median itself
/// is not the specified size, a part of the marker is in a shadow or covered in most frames, and the deviation is that from the specified one.
fn size_deviations_px(appearances: &[Option<Appearance>]) -> Vec<Option<f64>> {
    let mut deviations_px: Vec<Option<f64>> = vec![None; appearances.len()];
    for i in 0..3 {
        let seen = || appearances.iter().flatten();
        let Some(usual) = upper_median(seen().map(|a| a.excess_px[i])) else { continue };
        let specified_px = upper_median(seen().map(|a| a.expected_px[i])).unwrap_or(0.0);
        let is_specified = usual.abs() < MOST_EXCESS * specified_px + MOST_EXCESS_PX;
        let usual = if is_specified { usual } else { 0.0 };
        let middle_px = upper_median(seen().map(|a| (a.excess_px[i] - usual).abs()));
        let scatter = STD_OVER_MEDIAN_ABSOLUTE * middle_px.unwrap_or(0.0);
        for (largest, appearance) in deviations_px.iter_mut().zip(appearances) {
            let Some(appearance) = appearance else { continue };
            let deviation_px = (appearance.excess_px[i] - usual).abs();
            let noise_px = (USUAL_SCATTERS * scatter).max(USUAL_DEVIATION_PX);
            if deviation_px > noise_px + BLUR_UNCERTAINTY * appearance.blur_px {
                *largest = Some(largest.map_or(deviation_px, |d| d.max(deviation_px)));
            }
        }
    }
    deviations_px
}

/// Multiplies the standard deviations by the scatter of the samples about smooth motion, if that is larger: compression moves edges by more
/// than the noise of the grey levels.  The scatter is that of all tracks, or that of a track itself where this is larger.  Gives by how much
/// more the samples of all tracks scatter about uniformly decelerated motion than about straight lines.
pub(super) fn scale_noise(tracks: &mut [Track]) -> f64 {
    let residuals: Vec<Vec<[f64; 2]>> =
        tracks.iter().map(|track| derivatives::residual_stds(&track.samples)).collect();
    let [decelerated, straight] = scatters_stds(&residuals.concat());
    let of_all = decelerated.min(straight);
    for (track, residuals) in tracks.iter_mut().zip(residuals) {
        let [decelerated, straight] = scatters_stds(&residuals);
        let factor = of_all.max(decelerated.min(straight));
        for sample in &mut track.samples {
            sample.std_m *= factor;
        }
    }
    decelerated / of_all
}

/// The usual scatter of samples about uniformly decelerated motion and about straight lines (standard deviations), at least 1; 1 where too few
/// samples move.
fn scatters_stds(residuals: &[[f64; 2]]) -> [f64; 2] {
    if residuals.len() < LEAST_FAST {
        return [1.0; 2];
    }
    [0, 1].map(|i| upper_median(residuals.iter().map(|pair| pair[i])).unwrap_or(1.0).max(1.0))
}

/// Marks the samples as doubtful whose standard deviation is that of no marker or outline, where no other reason says so.  An outline without
/// a marker may jump along straight lines of the table, so it has to move smoothly as well: `unsmooth` is what [`scale_noise`] gives.
pub(super) fn doubt_noise(
    camera: &Camera,
    state: &TrackState,
    unsmooth: f64,
    track: &mut Track,
    doubts: &mut [Vec<Doubt>],
) {
    let factor = if state.target.is_markerless() { unsmooth } else { 1.0 };
    for ((sample, point), doubts) in track.samples.iter_mut().zip(&state.points).zip(doubts) {
        let scale_m_per_px = camera.scale_m_per_px(point.blob.centroid, state.target.height_m());
        let std_px = factor * sample.std_m / scale_m_per_px;
        if std_px > NOISY_PX && doubts.is_empty() {
            sample.doubtful = true;
            doubts.push(Doubt::Noise { std_px });
        }
    }
}

/// Marks the samples as doubtful that are elsewhere than the trusted ones before and after them, between which the object did not move, or far less
/// than to the sample and back; and a last one that no object reaches so fast.
pub(super) fn doubt_jumps(track: &mut Track, doubts: &mut [Vec<Doubt>]) {
    let trusted: Vec<usize> = (0..track.samples.len()).filter(|&k| !track.samples[k].doubtful).collect();
    let speeds_m_s: Vec<f64> =
        trusted.windows(2).map(|pair| speed_m_s(&track.samples[pair[0]], &track.samples[pair[1]])).collect();
    for n in 1..trusted.len() {
        let [before, here] = [n - 1, n].map(|i| &track.samples[trusted[i]]);
        let after = trusted.get(n + 1).map(|&k| &track.samples[k]);
        let around = [Some(before), after].into_iter().flatten();
        let std_m = around.clone().map(|sample| sample.std_m).fold(0.0, f64::max);
        let off_m = around.map(|s| here.position().distance(s.position())).fold(f64::INFINITY, f64::min);
        let is_jump = after.map_or(speeds_m_s[n - 1] > FASTEST_M_S, |after| {
            let is_at_rest = before.position().distance(after.position()) < APART_STDS * std_m;
            is_at_rest || is_detour(&speeds_m_s, n, speed_m_s(before, after))
        });
        if is_jump && off_m > FAR_APART_STDS * std_m.hypot(here.std_m) {
            let sample = &mut track.samples[trusted[n]];
            sample.doubtful = true;
            sample.std_m = sample.std_m.hypot(off_m);
            doubts[trusted[n]].push(Doubt::Jump { off_m });
        }
    }
}

/// The mean speed from one sample to a later one (m/s).
fn speed_m_s(from: &Sample, to: &Sample) -> f64 {
    from.position().distance(to.position()) / (to.time_s - from.time_s)
}

/// Whether the speeds to the n-th sample and from there to the next one are both far above those around it: of the steps before and after, and
/// `across_m_s` without it. A body that is struck and stops, or that hits another one and returns, is fast on one of the two ways only, or afterwards too.
fn is_detour(speeds_m_s: &[f64], n: usize, across_m_s: f64) -> bool {
    let around = [n.checked_sub(2), Some(n + 1)].into_iter().filter_map(|step| speeds_m_s.get(step?));
    speeds_m_s[n - 1].min(speeds_m_s[n]) > DETOUR * around.copied().fold(across_m_s, f64::max)
}

/// Warnings of the frames in which an object was not found.
pub(super) fn gap_warnings(camera: &Camera, state: &TrackState, times_s: &[f64]) -> Vec<String> {
    let name = state.target.name;
    let mut warnings = Vec::new();
    let Some(last) = state.points.last() else { return vec![format!("`{name}` was not found in any frame")] };
    if let Some(first) = state.points.first().filter(|first| first.frame > 0) {
        warnings.push(format!(
            "`{name}` was not found before {:.3} s; its first {} frames are missing",
            first.time_s, first.frame
        ));
    }
    for pair in state.points.windows(2) {
        let missed = pair[1].frame - pair[0].frame - 1;
        if missed > 0 {
            let (from_s, to_s) = (pair[0].time_s, pair[1].time_s);
            warnings.push(format!(
                "`{name}` was not found in {missed} frames between {from_s:.3} and {to_s:.3} s"
            ));
        }
    }
    let missed = times_s.len() - 1 - last.frame;
    if missed > 0 {
        let reason = if left_image(camera, state, last) { "left the image" } else { "was not found again" };
        warnings.push(format!(
            "`{name}` {reason} after {:.3} s; its last {missed} frames are missing",
            last.time_s
        ));
    }
    warnings
}

/// Whether an object was at the border of the image, or about to reach it, when it was last found.
fn left_image(camera: &Camera, state: &TrackState, last: &TrackPoint) -> bool {
    let [vx, vy] = velocity_px_s(&state.points, state.points.len() - 1);
    let Pixel { x, y } = last.blob.centroid;
    let size_px = last.blob.area_px2.sqrt();
    let margin_px = |v: f64| LEAVING_S * v.abs() + size_px;
    let near = |at: f64, v: f64, size: usize| at < margin_px(v) || at > size as f64 - margin_px(v);
    last.blob.at_border || near(x, vx, camera.size_px[0]) || near(y, vy, camera.size_px[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    /// The track of samples at these places, 60 a second, with what is doubtful about each.
    fn with_jumps_doubted(places_m: &[[f64; 2]]) -> (Track, Vec<Vec<Doubt>>) {
        let sample =
            |(k, [x, y]): (usize, &[f64; 2])| Sample::new(k as f64 / 60.0, Point::new(*x, *y), None, 3e-5);
        let samples: Vec<Sample> = places_m.iter().enumerate().map(sample).collect();
        let mut doubts = vec![Vec::new(); samples.len()];
        let mut track = Track { object: "a".into(), samples };
        doubt_jumps(&mut track, &mut doubts);
        (track, doubts)
    }

    fn doubtful(track: &Track) -> Vec<usize> {
        (0..track.samples.len()).filter(|&k| track.samples[k].doubtful).collect()
    }

    #[test]
    fn a_sample_that_leaves_a_place_at_rest_and_returns_is_doubtful() {
        // At rest, then sliding, then at rest again; the fourth and the last but one are elsewhere.
        let places_m = [0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.01, 0.018, 0.024, 0.028, 0.03, 0.03, 0.0295, 0.03];
        let noisy = |(k, x): (usize, f64)| [x + if k % 2 == 0 { 1e-5 } else { -1e-5 }, 0.0];
        let (track, doubts) =
            with_jumps_doubted(&places_m.into_iter().enumerate().map(noisy).collect::<Vec<_>>());
        assert_eq!(doubtful(&track), [3, 12]);
        assert!((0..places_m.len()).all(|k| doubts[k].is_empty() != track.samples[k].doubtful));
    }

    #[test]
    fn a_sample_far_off_the_path_of_a_moving_body_is_doubtful() {
        // A marker of another object in the fifth frame, 64 mm off
        let (track, _) = with_jumps_doubted(&[
            [0.0, 0.0],
            [0.0, 0.0],
            [0.0, 0.0],
            [0.011, -0.001],
            [0.079, 0.026],
            [0.031, -0.001],
            [0.037, -0.004],
        ]);
        assert_eq!(doubtful(&track), [4]);
        let std_m = track.samples[4].std_m;
        assert!(std_m > 1e-3, "the standard deviation is the distance, and no {std_m} m");
        // The last sample before the object is lost
        let (track, _) = with_jumps_doubted(&[[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.072, 0.03]]);
        assert_eq!(doubtful(&track), [3]);
        // Struck and soon at rest, and a bounce off a heavy body
        let stopped =
            [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.012, 0.0], [0.014, 0.0], [0.014, 0.0], [0.014, 0.0]];
        let bounced =
            [[0.0, 0.0], [0.0, 0.0], [0.016, 0.0], [0.032, 0.0], [0.022, 0.0], [0.012, 0.0], [0.004, 0.0]];
        for places_m in [stopped, bounced] {
            let (track, _) = with_jumps_doubted(&places_m);
            assert!(doubtful(&track).is_empty(), "{track:?}");
        }
    }
}
