//! Does an object's outline show in the picture where it should be?
//!
//! Objects often wear the same marker; their own outlines tell them apart, and tell which way round they lie where
//! the marker cannot.  An outline is there if the grey level steps from inside to outside along it.

use crate::capture::{Camera, GreyImage};
use crate::geometry::{Pixel, Point, Pose, Vec2, wrapped_rad};
use crate::object::Shape;
use std::f64::consts::{PI, TAU};

/// A place on an outline as the camera sees it, and the outward direction there.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct EdgePoint {
    pub at: Pixel,
    pub outward: [f64; 2],
    /// In the object's frame.
    pub body: Point,
    /// Where the table's height is reached straight below this point.
    pub foot: Pixel,
}

/// Places on an outline lie about this far apart (px): nearer ones would show the same pixels.
pub(in crate::detect) const SPACING_PX: f64 = 2.0;
/// A search looks at points this far apart (px).
const ROUGH_SPACING_PX: f64 = 8.0;
/// Inside and outside are read this far from the outline (px): past the lens' own smear.
const READ_AT_PX: [f64; 2] = [1.5, 2.5];
/// Steps of this many neighbours are averaged with their signs: an edge that runs along the outline adds up, one that
/// crosses it and noise do not.
const NEIGHBOURS: usize = 2;
/// The measured outline may be this much too large or too small (px); the best fit counts.
const OFFSETS_PX: [f64; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];
/// A step of this many grey levels counts half; one of many more counts as one.
const HALF_STEP: f64 = 8.0;

/// A picture, its camera, and an object's outline at the height of its top.
#[derive(Clone, Copy)]
pub(in crate::detect) struct Scene<'a> {
    pub image: &'a GreyImage,
    pub camera: &'a Camera,
    pub shape: &'a Shape,
    pub height_m: f64,
}

impl Scene<'_> {
    /// How well the picture shows the outline at this pose: 0 not at all, 1 a strong edge all the way round.
    pub(in crate::detect) fn visibility(&self, pose: Pose) -> f64 {
        let points = self.edge_points(pose);
        OFFSETS_PX.iter().map(|&offset_px| strength(self.image, &points, offset_px)).fold(0.0, f64::max)
    }

    /// The same from a few points of the outline, in the picture made this many times smaller.
    pub(in crate::detect) fn rough_visibility(
        &self,
        (small, factor): (&GreyImage, usize),
        pose: Pose,
    ) -> f64 {
        let factor = factor as f64;
        let mut points = self.edge_points_apart(pose, ROUGH_SPACING_PX * factor);
        let shrunk = |at: f64| (at + 0.5) / factor - 0.5;
        for point in &mut points {
            point.at = Pixel::new(shrunk(point.at.x), shrunk(point.at.y));
        }
        strength(small, &points, 0.0)
    }

    /// The yaw at which the outline shows best, and how well, where `pose` gives the pose for a yaw.
    ///
    /// `yaws_rad` are the directions the marker leaves open; none for a marker that tells nothing: then the whole turn
    /// is searched.
    pub(in crate::detect) fn best_yaw(&self, pose: impl Fn(f64) -> Pose, yaws_rad: &[f64]) -> (f64, f64) {
        let best_of = |yaws_rad: &mut dyn Iterator<Item = f64>| {
            let scored = yaws_rad.map(|yaw_rad| (yaw_rad, self.visibility(pose(yaw_rad))));
            scored.fold((0.0, f64::NEG_INFINITY), |best, this| if this.1 > best.1 { this } else { best })
        };
        if !yaws_rad.is_empty() {
            return best_of(&mut yaws_rad.iter().copied());
        }
        let turn_rad = match self.shape.rotation_symmetry_rad() {
            Some(0.0) => return best_of(&mut std::iter::once(0.0)),
            Some(turn_rad) => turn_rad,
            None => TAU,
        };
        // From steps of about a pixel at the outermost corner to a fraction of it.
        let at = self.camera.pixel_from_table(pose(0.0).position, self.height_m);
        let step_m = SPACING_PX * self.camera.scale_m_per_px(at, self.height_m);
        let mut step_rad = (step_m / self.shape.outer_radius_m()).clamp(FINEST_STEP_RAD, COARSEST_STEP_RAD);
        let n = (turn_rad / step_rad).ceil() as usize;
        let mut best = best_of(&mut (0..n).map(|k| k as f64 * turn_rad / n as f64));
        for _ in 0..HALVINGS {
            step_rad /= 2.0;
            let (middle, _) = best;
            best = best_of(&mut (-2..=2).map(|k| middle + f64::from(k) * step_rad));
        }
        (wrapped_rad(best.0), best.1)
    }

    pub(in crate::detect) fn edge_points(&self, pose: Pose) -> Vec<EdgePoint> {
        self.edge_points_apart(pose, SPACING_PX)
    }

    fn edge_points_apart(&self, pose: Pose, spacing_px: f64) -> Vec<EdgePoint> {
        let pixel = |body: Point| self.camera.pixel_from_table(pose.table_from_body(body), self.height_m);
        let spacing_m = spacing_px * self.camera.scale_m_per_px(pixel(Point::ORIGIN), self.height_m);
        if !spacing_m.is_finite() {
            return Vec::new();
        }
        let seen = |(body, outward): (Point, Vec2)| {
            let (at, ahead) = (pixel(body), pixel(body + outward * spacing_m));
            let (dx, dy) = (ahead.x - at.x, ahead.y - at.y);
            let length = dx.hypot(dy);
            let foot = self.camera.pixel_from_table(pose.table_from_body(body), 0.0);
            (length > 0.0).then(|| EdgePoint { at, outward: [dx / length, dy / length], body, foot })
        };
        rim(self.shape, spacing_m).into_iter().filter_map(seen).collect()
    }
}

/// Bounds of the first steps through a whole turn (rad), and how often they are halved.
const FINEST_STEP_RAD: f64 = 1e-3;
const COARSEST_STEP_RAD: f64 = PI / 32.0;
const HALVINGS: usize = 3;

fn strength(image: &GreyImage, points: &[EdgePoint], offset_px: f64) -> f64 {
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
    /// Outside minus inside (grey levels); 0 past the picture's edge.
    fn step(&self, image: &GreyImage, offset_px: f64) -> f64 {
        let read = |way_px: f64| {
            let [nx, ny] = self.outward;
            image.grey_at(Pixel::new(self.at.x + nx * way_px, self.at.y + ny * way_px))
        };
        let pairs = READ_AT_PX.map(|way_px| Some(read(offset_px + way_px)? - read(offset_px - way_px)?));
        let [Some(near), Some(far)] = pairs else { return 0.0 };
        f64::midpoint(near, far)
    }
}

/// Places on the outline in the body's frame, evenly spaced and clear of corners, with their outward normals.
fn rim(shape: &Shape, spacing_m: f64) -> Vec<(Point, Vec2)> {
    if let Shape::Disc { radius_m } = shape {
        let n = (TAU * radius_m / spacing_m).ceil().max(8.0);
        let normals = (0..n as usize).map(|k| Vec2::from_heading(k as f64 * TAU / n));
        return normals.map(|normal| (Point::ORIGIN + normal * *radius_m, normal)).collect();
    }
    let corners = shape.corners();
    let mut rim = Vec::new();
    for (k, &from) in corners.iter().enumerate() {
        let side = corners[(k + 1) % corners.len()] - from;
        let length_m = side.length();
        let n = (length_m / spacing_m).floor().max(1.0);
        let normal = -side.perpendicular() / length_m;
        rim.extend((0..n as usize).map(|j| (from + side * ((j as f64 + 0.5) / n), normal)));
    }
    rim
}
