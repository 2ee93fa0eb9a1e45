//! How much has changed along the striker's outline, if the striker were at a given point?
//!
//! The outline of the striker's foot on the table is a known curve, and so is that of its top in the plane above. Where the striker is, the
//! grey level steps across both curves, and it did not in the first frame. Steps along both distinguish the striker from shadows, the arm and
//! the grain of the table, and tell its foot from its top.

use super::grid::{Greys, Grid, Inner};
use crate::capture::Camera;
use crate::detect::markerless::edge_visibility::outline_points;
use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;

/// Distances from the outline at which both sides are read, in widths of the filter.
const READ_AT: [f64; 2] = [0.35, 0.85];
/// The one distance at which a search reads them.
const SEARCH_AT: f64 = 0.6;
/// Width of the filter: at least so many nodes, and so long (m).
const LEAST_WIDTH_NODES: f64 = 2.5;
const LEAST_WIDTH_M: f64 = 1.5e-3;
/// Points of the outline in a search and in a measurement.
const SEARCH_POINTS: usize = 18;
const MOST_POINTS: usize = 48;
/// Parts of the outline within which changes of one sign add up.
const PARTS: usize = 6;
/// A change of this many grey levels has the strength 1/2; that of large changes approaches 1.
const HALF_LEVELS: f32 = 8.0;
/// The foot is used if the camera sees at least this part of its outline.
const LEAST_VISIBLE: f64 = 0.25;

/// A point of an outline from the striker's centre, in the strike frame (m), and the unit vector outward.
#[derive(Clone, Copy)]
struct EdgePoint {
    at: Vec2,
    outward: Vec2,
}

/// An outline of the striker, or a part of it.
pub(super) struct Outline {
    /// The height of its plane above the table (m).
    pub height_m: f64,
    points: Vec<EdgePoint>,
}

/// Which outlines of the striker the camera sees along the path: a part of its foot, and its top.
pub(super) struct SeenOutlines {
    /// The lowest one first, each in a plane of its own.
    pub outlines: Vec<Outline>,
    /// Standard deviation of the height of the lowest one (m).
    pub height_std_m: f64,
}

/// See the [module](self).
pub(super) struct Edge {
    width_m: f64,
    outlines: Vec<Outline>,
}

/// The steps across the outline, point by point (grey levels).
pub(super) type Steps = Vec<f64>;

impl SeenOutlines {
    /// The part of a striker's foot that the camera sees along the whole path from start over middle to end, or in its first half if
    /// the path passes below the camera, and its top; where the part is too little, the top alone. A camera without a pose sees one
    /// outline, at no height.
    pub(super) fn new(camera: &Camera, shape: &Shape, top_m: f64, path: &[Pose; 3]) -> Self {
        /// A striker moves a few millimetres above the table.
        const FOOT_STD_M: f64 = 0.004;
        let spacing_m = std::f64::consts::TAU * shape.outer_radius_m() / MOST_POINTS as f64;
        let all = outline_points(shape, spacing_m);
        let point = |(at, outward): &(Point, Vec2)| EdgePoint { at: at.to_vec(), outward: *outward };
        let whole = |height_m: f64| Outline { height_m, points: all.iter().map(point).collect() };
        let Some([x, y, _]) = camera.position_m() else {
            return Self { outlines: vec![whole(0.0)], height_std_m: FOOT_STD_M };
        };
        for part in [&path[..], &path[..2]] {
            // A side is seen from the camera's side.
            let faces = |(at, outward): &(Point, Vec2), pose: &Pose| {
                (pose.body_from_table(Point::new(x, y)) - *at).dot(*outward) > 0.0
            };
            let points: Vec<EdgePoint> =
                all.iter().filter(|at| part.iter().all(|pose| faces(at, pose))).map(point).collect();
            if points.len() as f64 >= LEAST_VISIBLE * all.len() as f64 {
                let foot = Outline { height_m: 0.0, points };
                return Self { outlines: vec![foot, whole(top_m)], height_std_m: FOOT_STD_M };
            }
        }
        // The arm above the top is of unknown width.
        Self { outlines: vec![whole(top_m)], height_std_m: top_m / 4.0 }
    }
}

impl Edge {
    /// The outlines on a grid, for a motion of up to `blur_m` during the exposure.
    pub(super) fn new(outlines: Vec<Outline>, step_m: f64, blur_m: f64) -> Self {
        let width_m = (LEAST_WIDTH_NODES * step_m).max(LEAST_WIDTH_M).max(0.8 * blur_m);
        Self { width_m, outlines }
    }

    /// The outlines, the lowest one first.
    pub(super) fn outlines(&self) -> &[Outline] {
        &self.outlines
    }

    /// Width of the filter across the outline (m).
    pub(super) fn width_m(&self) -> f64 {
        self.width_m
    }

    /// Largest distance from the striker's centre at which the image is read (m).
    pub(super) fn reach_m(&self) -> f64 {
        let points = self.outlines.iter().flat_map(|outline| &outline.points);
        points.map(|point| point.at.length()).fold(0.0, f64::max) + self.width_m
    }

    /// The strength of the change along outlines at each inner node, that of the weakest one: 0 for none, towards 1 for a strong one
    /// all along.
    pub(super) fn strengths(
        &self,
        outlines: &[Outline],
        grid: &Grid,
        greys: &Greys,
        inner: &Inner,
    ) -> Vec<f32> {
        let mut weakest = vec![1.0_f32; inner.along * inner.across];
        for (outline, greys) in outlines.iter().zip(greys) {
            let strengths = self.strengths_of(outline, grid, greys, inner);
            weakest
                .iter_mut()
                .zip(strengths)
                .for_each(|(weakest, strength)| *weakest = weakest.min(strength));
        }
        weakest
    }

    fn strengths_of(&self, outline: &Outline, grid: &Grid, greys: &[f32], inner: &Inner) -> Vec<f32> {
        let every = outline.points.len().div_ceil(SEARCH_POINTS).max(1);
        let points: Vec<&EdgePoint> = outline.points.iter().step_by(every).collect();
        let mut strengths = vec![0.0; inner.along * inner.across];
        let mut sums = strengths.clone();
        for part in points.chunks(points.len().div_ceil(PARTS)) {
            sums.fill(0.0);
            for point in part {
                for side in [1.0, -1.0] {
                    let shift = point.at + point.outward * (side * SEARCH_AT * self.width_m);
                    let weight = side as f32 / part.len() as f32;
                    grid.add_shifted(inner, (greys, [shift.x, shift.y]), weight, &mut sums);
                }
            }
            let weight = part.len() as f32 / points.len() as f32;
            for (strength, sum) in strengths.iter_mut().zip(&sums) {
                *strength += weight * sum.abs() / (sum.abs() + HALF_LEVELS);
            }
        }
        strengths
    }

    /// The steps across outlines of a striker at a point of the strike frame.
    pub(super) fn steps(&self, outlines: &[Outline], grid: &Grid, greys: &Greys, centre: Point) -> Steps {
        let step = |(greys, point): (&Vec<f32>, &EdgePoint)| {
            let read = |distance: f64| {
                grid.value(greys, centre + point.at + point.outward * (distance * self.width_m))
            };
            READ_AT.iter().map(|&at| read(at) - read(-at)).sum::<f64>() / READ_AT.len() as f64
        };
        let planes = outlines.iter().zip(greys);
        planes.flat_map(|(outline, greys)| outline.points.iter().map(move |p| (greys, p))).map(step).collect()
    }
}
