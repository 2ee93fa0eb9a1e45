//! How visible is an object's outline in the image at a given pose?
//!
//! Objects often have equal markers: their own outlines distinguish them, and resolve the yaw that a symmetric marker
//! leaves open. An outline is visible if the grey level steps between inside and outside along it.

use crate::capture::{Camera, GreyImage};
use crate::detect::marker::target::Target;
use crate::geometry::{Pixel, Point, Pose, Vec2, wrapped_rad};
use crate::object::Shape;
use std::f64::consts::{PI, TAU};

/// A point of an outline in the image.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct EdgePoint {
    pub at: Pixel,
    /// Unit vector outward, in the image.
    pub outward: [f64; 2],
    /// The point in the object's frame.
    pub body: Point,
    /// The point of the table straight below it, in the image.
    pub foot: Pixel,
}

/// Distance between points of an outline (px): closer ones would share their pixels.
pub(super) const SPACING_PX: f64 = 2.0;
/// Distance between the points in a search (px).
const ROUGH_SPACING_PX: f64 = 8.0;
/// Distances from the outline at which inside and outside are read (px): beyond the blur of the lens.
const READ_AT_PX: [f64; 2] = [1.5, 2.5];
/// Neighbours on either side whose signed steps are averaged: an edge along the outline adds up; crossing edges and
/// noise cancel.
const NEIGHBOURS: usize = 2;
/// Offsets of the outline that are tried, because its measured size may be wrong (px); the most visible one counts.
const OFFSETS_PX: [f64; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];
/// A step of this many grey levels has the visibility 1/2; that of large steps approaches 1.
const HALF_STEP: f64 = 8.0;
/// Bounds of the first step of a search for the yaw (rad), and how many times the step is halved.
const FINEST_STEP_RAD: f64 = 1e-3;
const COARSEST_STEP_RAD: f64 = PI / 32.0;
const HALVINGS: usize = 3;

/// An image, its camera, and an object's outline at the height of its top.
#[derive(Clone, Copy)]
pub(in crate::detect) struct OutlineView<'a> {
    pub image: &'a GreyImage,
    pub camera: &'a Camera,
    pub shape: &'a Shape,
    pub height_m: f64,
}

/// An image and the factor by which its width and height are reduced.
#[derive(Clone, Copy)]
pub(super) struct ReducedImage<'a> {
    pub image: &'a GreyImage,
    pub factor: usize,
}

impl<'a> OutlineView<'a> {
    /// A target's own outline, whether it has a marker or not.
    pub(in crate::detect) fn of_target(
        image: &'a GreyImage,
        camera: &'a Camera,
        target: &Target<'a>,
    ) -> Self {
        Self { image, camera, shape: &target.object.shape, height_m: target.object.height_m }
    }

    /// Visibility of the outline at a pose: 0 for none, 1 for a strong edge all around.
    pub(in crate::detect) fn visibility(&self, pose: Pose) -> f64 {
        let points = self.edge_points(pose);
        OFFSETS_PX.iter().map(|&offset_px| visibility(self.image, &points, offset_px)).fold(0.0, f64::max)
    }

    /// The same from few points in a reduced image.
    pub(super) fn rough_visibility(&self, reduced: ReducedImage, pose: Pose) -> f64 {
        let factor = reduced.factor as f64;
        let mut points = self.edge_points_apart(pose, ROUGH_SPACING_PX * factor);
        let scaled = |at: f64| (at + 0.5) / factor - 0.5;
        for point in &mut points {
            point.at = Pixel::new(scaled(point.at.x), scaled(point.at.y));
        }
        visibility(reduced.image, &points, 0.0)
    }

    /// The yaw of highest visibility, and the visibility; `pose` gives the pose for a yaw.
    ///
    /// `yaws_rad` are the yaws that the marker leaves open; if it is empty, all yaws are searched.
    pub(in crate::detect) fn best_yaw(&self, pose: impl Fn(f64) -> Pose, yaws_rad: &[f64]) -> (f64, f64) {
        let best_of = |yaws_rad: &mut dyn Iterator<Item = f64>| {
            let scored = yaws_rad.map(|yaw_rad| (yaw_rad, self.visibility(pose(yaw_rad))));
            scored.fold((0.0, f64::NEG_INFINITY), |best, this| if this.1 > best.1 { this } else { best })
        };
        if !yaws_rad.is_empty() {
            return best_of(&mut yaws_rad.iter().copied());
        }
        let period_rad = match self.shape.rotation_symmetry_rad() {
            Some(0.0) => return best_of(&mut std::iter::once(0.0)),
            Some(period_rad) => period_rad,
            None => TAU,
        };
        // From steps of about a pixel at the outermost corner to a fraction of it.
        let at = self.camera.pixel_from_table(pose(0.0).position, self.height_m);
        let step_m = SPACING_PX * self.camera.scale_m_per_px(at, self.height_m);
        let mut step_rad = (step_m / self.shape.outer_radius_m()).clamp(FINEST_STEP_RAD, COARSEST_STEP_RAD);
        let n = (period_rad / step_rad).ceil() as usize;
        let mut best = best_of(&mut (0..n).map(|k| k as f64 * period_rad / n as f64));
        for _ in 0..HALVINGS {
            step_rad /= 2.0;
            let (middle, _) = best;
            best = best_of(&mut (-2..=2).map(|k| middle + f64::from(k) * step_rad));
        }
        (wrapped_rad(best.0), best.1)
    }

    /// Points of the outline at a pose, [`SPACING_PX`] apart; none where the camera does not see it.
    pub(super) fn edge_points(&self, pose: Pose) -> Vec<EdgePoint> {
        self.edge_points_apart(pose, SPACING_PX)
    }

    fn edge_points_apart(&self, pose: Pose, spacing_px: f64) -> Vec<EdgePoint> {
        let pixel = |body: Point| self.camera.pixel_from_table(pose.table_from_body(body), self.height_m);
        let spacing_m = spacing_px * self.camera.scale_m_per_px(pixel(Point::ORIGIN), self.height_m);
        if !spacing_m.is_finite() {
            return Vec::new();
        }
        let projected = |(body, outward): (Point, Vec2)| {
            let (at, ahead) = (pixel(body), pixel(body + outward * spacing_m));
            let (dx, dy) = (ahead.x - at.x, ahead.y - at.y);
            let length = dx.hypot(dy);
            let foot = self.camera.pixel_from_table(pose.table_from_body(body), 0.0);
            (length > 0.0).then(|| EdgePoint { at, outward: [dx / length, dy / length], body, foot })
        };
        outline_points(self.shape, spacing_m).into_iter().filter_map(projected).collect()
    }
}

/// Mean over the points of a saturating function of the step across the outline.
fn visibility(image: &GreyImage, points: &[EdgePoint], offset_px: f64) -> f64 {
    if points.len() < 2 * NEIGHBOURS + 1 {
        return 0.0;
    }
    let steps: Vec<f64> = points.iter().map(|p| p.step(image, offset_px)).collect();
    let n = steps.len();
    let mean_near = |k: usize| {
        let near = (0..=2 * NEIGHBOURS).map(|j| steps[(k + n + j - NEIGHBOURS) % n]);
        near.sum::<f64>() / (2 * NEIGHBOURS + 1) as f64
    };
    (0..n).map(|k| mean_near(k).abs()).map(|step| step / (step + HALF_STEP)).sum::<f64>() / n as f64
}

impl EdgePoint {
    /// The position at a distance outward from the point (px).
    pub(super) fn outward_by(&self, distance_px: f64) -> Pixel {
        let [nx, ny] = self.outward;
        Pixel::new(self.at.x + nx * distance_px, self.at.y + ny * distance_px)
    }

    /// Grey level outside minus inside; 0 beyond the border of the image.
    fn step(&self, image: &GreyImage, offset_px: f64) -> f64 {
        let read = |distance_px: f64| image.grey_at(self.outward_by(distance_px));
        let steps = READ_AT_PX
            .map(|distance_px| Some(read(offset_px + distance_px)? - read(offset_px - distance_px)?));
        let [Some(near), Some(far)] = steps else { return 0.0 };
        f64::midpoint(near, far)
    }
}

/// Points of the outline in the object's frame, uniformly spaced and clear of corners, with their outward normals.
pub(in crate::detect) fn outline_points(shape: &Shape, spacing_m: f64) -> Vec<(Point, Vec2)> {
    if let Shape::Disc { radius_m } = shape {
        let n = (TAU * radius_m / spacing_m).ceil().max(8.0);
        let normals = (0..n as usize).map(|k| Vec2::from_heading(k as f64 * TAU / n));
        return normals.map(|normal| (Point::ORIGIN + normal * *radius_m, normal)).collect();
    }
    let corners = shape.corners();
    let mut points = Vec::new();
    for (k, &from) in corners.iter().enumerate() {
        let side = corners[(k + 1) % corners.len()] - from;
        let length_m = side.length();
        let n = (length_m / spacing_m).floor().max(1.0);
        let normal = -side.perpendicular() / length_m;
        points.extend((0..n as usize).map(|j| (from + side * ((j as f64 + 0.5) / n), normal)));
    }
    points
}
