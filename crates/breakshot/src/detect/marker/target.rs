//! What does an object's marker look like from the camera, and which pose of the object does a blob imply?

use super::blob::{Blob, ImagePose};
use crate::capture::Camera;
use crate::geometry::moments::{Moments, compactness, principal_axes};
use crate::geometry::{Pixel, Point, Pose, Vec2, half_turn_wrapped_rad};
use crate::object::{Marker, Object, Shape};
use std::f64::consts::{PI, TAU};
use std::ops::RangeInclusive;

/// An object to be found in the images.
#[derive(Clone, Debug)]
pub(in crate::detect) struct Target<'a> {
    /// Its name; `a#2` for the second copy of `a`.
    pub name: &'a str,
    /// Its kind.
    pub object: &'a Object,
    /// Its marker, or its outline if it has none.
    pub feature: Marker,
    /// Outline of the feature in the object's frame; a disc as a polygon.
    outline: Vec<Point>,
    /// Direction of the feature's principal axis in the object's frame (rad), if it is long enough to determine one.
    axis_rad: Option<f64>,
    /// See [`compactness`].
    compactness: f64,
    /// Height at which the feature appears, as a fraction of its thickness.
    apparent_height: f64,
}

/// Corners of the polygon of equal area that approximates a disc: its moments are right within 0.1 %.
const DISC_CORNERS: usize = 48;
/// Least ratio of the principal axes at which second moments determine a direction; below it noise rotates the axes
/// by degrees.
const LEAST_ELONGATION: f64 = 1.2;
/// Variance that lens and pixels add to second moments along each axis (px2): 1/12 for the pixel, about a third with
/// a sharp lens.
pub(in crate::detect) const BLUR_VARIANCE_PX2: f64 = 0.35;
/// Largest difference of a marker's lengths, as a ratio's logarithm: cut by hand and measured with a ruler, a marker
/// of 10 mm is right within about 1 mm.
const LENGTH_TOLERANCE: f64 = 0.25;
/// Apparent height of a dark marker: half of its thickness.
const DARK_APPARENT_HEIGHT: f64 = 0.5;
/// Tolerance of the number of symmetric rotations in half a turn.
const SYMMETRY_TOLERANCE: f64 = 1e-3;
/// Rounds of the search for the pose: the first guess neglects perspective within the marker, and each round reduces
/// the error by a factor of a hundred.
const POSE_ROUNDS: usize = 2;
/// Components of a few pixels have ragged outlines: their compactness is right within this factor.
const COMPACTNESS_TOLERANCE: f64 = 0.8;

/// Differences between a blob and the expected image of a marker, as logarithms of ratios: 0 if equal.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct Mismatch {
    pub area: f64,
    pub long_axis: f64,
    pub short_axis: f64,
    pub compactness: f64,
}

impl Mismatch {
    /// Whether the blob may be this marker at all.
    pub(in crate::detect) fn is_tolerable(&self) -> bool {
        self.is_within(LENGTH_TOLERANCE)
    }

    /// Whether all lengths agree within a tolerance (logarithm of their ratio).
    pub(in crate::detect) fn is_within(&self, tolerance: f64) -> bool {
        self.area.is_finite() && self.largest() < tolerance
    }

    /// The largest of the differences; half of the area's, which makes it one of lengths.
    pub(in crate::detect) fn largest(&self) -> f64 {
        [self.area / 2.0, self.long_axis, self.short_axis, self.compactness]
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
        let compactness = compactness(area, covariance);
        Self {
            name,
            object,
            feature: marker,
            outline,
            axis_rad,
            compactness,
            apparent_height: DARK_APPARENT_HEIGHT,
        }
    }

    /// Whether the feature determines the yaw modulo half a turn.
    pub(in crate::detect) fn has_axis(&self) -> bool {
        self.axis_rad.is_some()
    }

    /// Whether the object has no marker and is found by its own outline.
    pub(in crate::detect) fn is_markerless(&self) -> bool {
        self.object.marker.is_none()
    }

    /// Whether the yaw can be measured.
    pub(in crate::detect) fn has_observable_yaw(&self) -> bool {
        self.has_axis()
            || self.feature.dot.is_some()
            || self.is_markerless() && self.object.shape.rotation_symmetry_rad() != Some(0.0)
    }

    /// See [`compactness`].
    pub(in crate::detect) fn compactness(&self) -> f64 {
        self.compactness
    }

    /// Whether the object's centroid is elsewhere than the feature's, so that it depends on the yaw.
    pub(in crate::detect) fn is_off_centre(&self) -> bool {
        self.feature.at_m.to_vec().length() > 0.0
    }

    /// Whether half a turn about the feature's centroid changes where the object is: its marker is off its centroid, or its
    /// outline has no such symmetry.
    pub(in crate::detect) fn changes_by_half_turn(&self) -> bool {
        let symmetric = self.object.shape.rotation_symmetry_rad().is_some_and(|period_rad| {
            period_rad == 0.0 || (PI / period_rad - (PI / period_rad).round()).abs() < SYMMETRY_TOLERANCE
        });
        self.is_off_centre() || !symmetric
    }

    /// Height above the table at which the feature appears (m).
    pub(in crate::detect) fn height_m(&self) -> f64 {
        self.object.height_m + self.feature.thickness_m * self.apparent_height
    }

    /// The target with the apparent height of a dark or a light marker, as the blob is: the top of a dark marker and
    /// its side appear as one region; the side of a light marker is in shade, like the object.
    pub(in crate::detect) fn with_polarity_of(self, blob: &Blob) -> Self {
        Self { apparent_height: if blob.contrast > 0.0 { DARK_APPARENT_HEIGHT } else { 1.0 }, ..self }
    }

    /// Moments of the feature's projection into the image with the object at this pose (px).
    pub(in crate::detect) fn projection(&self, camera: &Camera, pose: Pose) -> Moments {
        let corners: Vec<[f64; 2]> = self
            .outline
            .iter()
            .map(|&p| camera.pixel_from_table(pose.table_from_body(p), self.height_m()).into())
            .collect();
        Moments::of_polygon(&corners)
    }

    /// Smallest and largest area of the projected feature over the image (px2).
    pub(in crate::detect) fn projected_areas_px2(&self, camera: &Camera) -> RangeInclusive<f64> {
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

    /// The pose at which the projected feature has the given centroid and axis.
    ///
    /// The centroid of the projection is not the projection of the centroid: the nearer half appears larger. Of the
    /// two directions of the axis the one nearest to `yaw_near_rad` counts, which is also the result if the feature
    /// has no axis.
    pub(in crate::detect) fn pose(&self, camera: &Camera, observed: ImagePose, yaw_near_rad: f64) -> Pose {
        let height_m = self.height_m();
        let heading_rad = |axis_rad: f64| {
            let (dx, dy) = (axis_rad.cos(), axis_rad.sin());
            let Pixel { x, y } = observed.centroid;
            let ahead = camera.table_from_pixel(Pixel::new(x + dx, y + dy), height_m);
            (ahead - camera.table_from_pixel(Pixel::new(x - dx, y - dy), height_m)).heading_rad()
        };
        // First guess, without perspective
        let centroid = camera.table_from_pixel(observed.centroid, height_m);
        let mut yaw_rad = yaw_near_rad;
        if let Some(marker_axis_rad) = self.axis_rad {
            yaw_rad += half_turn_wrapped_rad(heading_rad(observed.axis_rad) - marker_axis_rad - yaw_rad);
        }
        let marker_at = self.feature.at_m.to_vec();
        let mut pose = Pose { position: centroid - marker_at.rotated(yaw_rad), yaw_rad };
        // Corrected by the difference between projection and observation
        for _ in 0..POSE_ROUNDS {
            let projection = self.projection(camera, pose);
            if self.axis_rad.is_some() {
                let (_, _, axis_rad) = principal_axes(projection.covariance);
                pose.yaw_rad += half_turn_wrapped_rad(heading_rad(observed.axis_rad) - heading_rad(axis_rad));
            }
            let rotation_shift = marker_at.rotated(yaw_rad) - marker_at.rotated(pose.yaw_rad);
            let offset = centroid - camera.table_from_pixel(projection.centroid.into(), height_m);
            pose.position += rotation_shift + offset;
            yaw_rad = pose.yaw_rad;
        }
        pose
    }

    /// How the blob differs from this marker at the same position.
    pub(in crate::detect) fn mismatch(&self, camera: &Camera, blob: &Blob) -> Mismatch {
        let pose = self.pose(camera, blob.image_pose(), 0.0);
        let projection = self.projection(camera, pose);
        let (expected_long, expected_short, _) = principal_axes(projection.covariance);
        let (long, short, _) = principal_axes(blob.covariance_px2);
        let length_ratio =
            |observed: f64, expected: f64| (observed / (expected + BLUR_VARIANCE_PX2)).ln() / 2.0;
        Mismatch {
            area: (blob.area_px2 / projection.area).ln(),
            long_axis: length_ratio(long, expected_long),
            short_axis: length_ratio(short, expected_short),
            compactness: (compactness(blob.area_px2, blob.covariance_px2) / self.compactness).ln(),
        }
    }

    /// Whether the compactness of a component is similar to that of this feature, at any position.
    pub(in crate::detect) fn has_similar_compactness(&self, area_px2: f64, covariance_px2: [f64; 3]) -> bool {
        let ratio = compactness(area_px2, covariance_px2) / self.compactness;
        (COMPACTNESS_TOLERANCE..1.0 / COMPACTNESS_TOLERANCE).contains(&ratio)
    }
}
