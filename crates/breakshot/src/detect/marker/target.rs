//! What must an object's marker look like from here, and what does a blob say about where the object is?

use super::blob::{Aim, Blob};
use crate::capture::Camera;
use crate::geometry::{Pixel, Point, Pose, Vec2, half_turn_wrapped_rad};
use crate::moments::{Moments, compactness, principal_axes};
use crate::object::{Marker, Object, Shape};
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// An object that is looked for.
#[derive(Clone, Debug)]
pub(in crate::detect) struct Target<'a> {
    /// Its name; `a#2` for the second copy.
    pub name: &'a str,
    /// Its kind.
    pub object: &'a Object,
    /// Its marker, or its outline if it wears none.
    pub feature: Marker,
    /// The marker's outline in the object's frame; a disc as many corners.
    outline: Vec<Point>,
    /// Direction of the marker's long axis in the object's frame (rad), if it is long enough to tell one.
    axis_rad: Option<f64>,
    /// See [`fullness`].
    fullness: f64,
    /// The part of the marker's thickness at which it appears to lie.
    shown_at: f64,
}

/// A disc as a polygon of this many corners and the same area has its moments within 0.1 %.
const DISC_CORNERS: usize = 48;
/// Long over short axis from which second moments tell a direction: below, noise in them turns it by degrees.
const LEAST_ELONGATION: f64 = 1.2;
/// What the lens and the pixels themselves add to second moments along each axis (px2): a pixel is 1/12, a sharp lens
/// about a third.
pub(in crate::detect) const SPREAD_PX2: f64 = 0.35;

/// A blob whose lengths or area (as a length) differ by more than this from a marker is not it.  Cut by hand and
/// measured by ruler, a marker of 10 mm is right within about one.
const LENGTH_TOLERANCE: f64 = 0.25;

/// Half of a dark marker's thickness.
const DARK_SHOWN_AT: f64 = 0.5;

/// How a blob differs from the marker it may be, as ratios' logarithms: 0 is as expected.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct Mismatch {
    pub area: f64,
    pub long_axis: f64,
    pub short_axis: f64,
    pub fullness: f64,
}

impl Mismatch {
    /// Whether the blob may be this marker at all.
    pub(in crate::detect) fn tolerable(&self) -> bool {
        self.within(LENGTH_TOLERANCE)
    }

    /// Whether all lengths are right within this part.
    pub(in crate::detect) fn within(&self, tolerance: f64) -> bool {
        self.area.is_finite() && self.worst() < tolerance
    }

    /// The worst of them, the area taken as a length.
    pub(in crate::detect) fn worst(&self) -> f64 {
        [self.area / 2.0, self.long_axis, self.short_axis, self.fullness]
            .into_iter()
            .fold(0.0, |w, m| m.abs().max(w))
    }
}

impl<'a> Target<'a> {
    pub(in crate::detect) fn new(name: &'a str, object: &'a Object) -> Self {
        let marker = object.feature();
        let outline: Vec<Point> = match &marker.shape {
            Shape::Disc { radius_m } => {
                let step_rad = TAU / DISC_CORNERS as f64;
                let radius_m = radius_m * (step_rad / step_rad.sin()).sqrt();
                (0..DISC_CORNERS)
                    .map(|k| marker.at_m + Vec2::from_heading(k as f64 * step_rad) * radius_m)
                    .collect()
            }
            shape => shape.corners().iter().map(|p| marker.at_m + p.to_vec()).collect(),
        };
        let corners: Vec<[f64; 2]> = outline.iter().map(|&p| p.into()).collect();
        let Moments { area, covariance, .. } = Moments::of_polygon(&corners);
        let (long, short, axis_rad) = principal_axes(covariance);
        let axis_rad = (long > short * LEAST_ELONGATION * LEAST_ELONGATION).then_some(axis_rad);
        let fullness = compactness(area, covariance);
        Self { name, object, feature: marker, outline, axis_rad, fullness, shown_at: DARK_SHOWN_AT }
    }

    /// Whether the marker tells how the object is turned, but for half a turn.
    pub(in crate::detect) fn tells_axis(&self) -> bool {
        self.axis_rad.is_some()
    }

    /// Whether it is seen by its own outline.
    pub(in crate::detect) fn markerless(&self) -> bool {
        self.object.marker.is_none()
    }

    /// Whether it can be seen how the object is turned.
    pub(in crate::detect) fn tells_yaw(&self) -> bool {
        self.tells_axis()
            || self.feature.dot.is_some()
            || self.markerless() && self.object.shape.rotation_symmetry_rad() != Some(0.0)
    }

    /// See [`fullness`].
    pub(in crate::detect) fn fullness(&self) -> f64 {
        self.fullness
    }

    /// Whether the centroid's place depends on the yaw.
    pub(in crate::detect) fn off_centre(&self) -> bool {
        self.feature.at_m.to_vec().length() > 0.0
    }

    /// How high above the table the marker appears to lie (m).
    pub(in crate::detect) fn height_m(&self) -> f64 {
        self.object.height_m + self.feature.thickness_m * self.shown_at
    }

    /// The same target once it is known whether its marker is dark or light: a dark one's top and the rim below it show
    /// as one; a light one's rim lies in shade, like the object.
    pub(in crate::detect) fn with_marker(self, blob: &Blob) -> Self {
        Self { shown_at: if blob.contrast > 0.0 { DARK_SHOWN_AT } else { 1.0 }, ..self }
    }

    /// The marker's picture with the object at this pose.
    pub(in crate::detect) fn picture(&self, camera: &Camera, pose: Pose) -> Moments {
        let corners: Vec<[f64; 2]> = self
            .outline
            .iter()
            .map(|&p| camera.pixel_from_table(pose.table_from_body(p), self.height_m()).into())
            .collect();
        Moments::of_polygon(&corners)
    }

    /// How many pixels the marker covers, from far away to near the camera.
    pub(in crate::detect) fn areas_px2(&self, camera: &Camera) -> RangeInclusive<f64> {
        let [width, height] = camera.size_px.map(|size| size as f64 - 1.0);
        let marker_m2 = self.feature.shape.area_m2();
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for (x, y) in (0..9).map(|k| (f64::from(k % 3) / 2.0, f64::from(k / 3) / 2.0)) {
            let scale = camera.scale_m_per_px(Pixel::new(x * width, y * height), self.height_m());
            let area_px2 = marker_m2 / (scale * scale);
            if area_px2.is_finite() {
                (least, most) = (least.min(area_px2), most.max(area_px2));
            }
        }
        least..=most
    }

    /// The pose at which the marker's picture has its centroid and long axis where the blob has them.
    ///
    /// A picture's centroid is not the picture of the centroid: the nearer half looks larger.  `yaw_near_rad` chooses
    /// between the two directions of the axis, and stands where the marker tells none.
    pub(in crate::detect) fn pose(&self, camera: &Camera, aim: Aim, yaw_near_rad: f64) -> Pose {
        let height_m = self.height_m();
        let heading_rad = |axis_rad: f64| {
            let (dx, dy) = (axis_rad.cos(), axis_rad.sin());
            let Pixel { x, y } = aim.centroid;
            let ahead = camera.table_from_pixel(Pixel::new(x + dx, y + dy), height_m);
            (ahead - camera.table_from_pixel(Pixel::new(x - dx, y - dy), height_m)).heading_rad()
        };
        let seen = camera.table_from_pixel(aim.centroid, height_m);
        let mut yaw_rad = yaw_near_rad;
        if let Some(marker_axis_rad) = self.axis_rad {
            yaw_rad += half_turn_wrapped_rad(heading_rad(aim.axis_rad) - marker_axis_rad - yaw_rad);
        }
        let marker_at = self.feature.at_m.to_vec();
        let mut pose = Pose { position: seen - marker_at.rotated(yaw_rad), yaw_rad };
        for _ in 0..POSE_ROUNDS {
            let picture = self.picture(camera, pose);
            if self.axis_rad.is_some() {
                let (_, _, axis_rad) = principal_axes(picture.covariance);
                pose.yaw_rad += half_turn_wrapped_rad(heading_rad(aim.axis_rad) - heading_rad(axis_rad));
            }
            let turned = marker_at.rotated(yaw_rad) - marker_at.rotated(pose.yaw_rad);
            let off = seen - camera.table_from_pixel(picture.centroid.into(), height_m);
            pose.position += turned + off;
            yaw_rad = pose.yaw_rad;
        }
        pose
    }

    /// How the blob differs from this marker, were it this marker.
    pub(in crate::detect) fn mismatch(&self, camera: &Camera, blob: &Blob) -> Mismatch {
        let pose = self.pose(camera, blob.aim(), 0.0);
        let picture = self.picture(camera, pose);
        let (long, short, _) = principal_axes(picture.covariance);
        let (seen_long, seen_short, _) = principal_axes(blob.covariance_px2);
        let length_ratio = |seen: f64, due: f64| (seen / (due + SPREAD_PX2)).ln() / 2.0;
        Mismatch {
            area: (blob.area_px2 / picture.area).ln(),
            long_axis: length_ratio(seen_long, long),
            short_axis: length_ratio(seen_short, short),
            fullness: (compactness(blob.area_px2, blob.covariance_px2) / self.fullness).ln(),
        }
    }

    /// Whether area and moments of a component are anywhere near those of a marker of this shape, wherever it lies.
    pub(in crate::detect) fn full_enough(&self, area_px2: f64, covariance_px2: [f64; 3]) -> bool {
        let ratio = compactness(area_px2, covariance_px2) / self.fullness;
        (ROUGH_FULLNESS..1.0 / ROUGH_FULLNESS).contains(&ratio)
    }
}

/// Components of a few pixels have ragged outlines.
const ROUGH_FULLNESS: f64 = 0.8;

/// The first guess is right but for perspective across one marker; each round leaves a hundredth of what was left.
const POSE_ROUNDS: usize = 2;
