//! Which outline of a body do others collide with?
//!
//! A [`CompoundShape`] is one or more convex parts.  Each part is a core of corners (one for a disc, two for a wall) enlarged
//! by a radius: every distance is a distance between cores minus the radii.

use crate::geometry::{Point, Vec2};
use crate::object::Shape;
use crate::physics::contact::convex_decomposition::convex_parts;
use crate::physics::rotation::Rotation;

/// A rigid outline in the frame of its body: the union of convex parts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CompoundShape {
    /// The convex parts.
    pub(crate) parts: Vec<ConvexPart>,
    /// Radius of the circle about the origin that contains it (m).
    pub(crate) outer_radius_m: f64,
    /// Whether it is that circle.
    pub(crate) is_disc: bool,
}

/// A convex core enlarged by a radius, in the body's frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ConvexPart {
    /// The core's corners, counter-clockwise.
    pub(crate) corners: Vec<Vec2>,
    /// Edge k leads from corner k to the next; none for a single point, two for a segment.
    pub(crate) edges: Vec<Edge>,
    /// Radius by which the core is enlarged (m).
    pub(crate) radius_m: f64,
    /// Greatest distance of the core from the body's origin (m).
    pub(crate) reach_m: f64,
    /// Least extent of the core from the body's origin over all directions (m); negative if the origin is outside.
    pub(crate) least_reach_m: f64,
}

/// The straight line of an edge: `normal . x = offset_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    /// Unit normal, outwards.
    pub(crate) normal: Vec2,
    /// Distance of the line from the body's origin along the normal (m).
    pub(crate) offset_m: f64,
}

impl CompoundShape {
    /// The compound shape of an object's outline.
    pub(crate) fn new(shape: &Shape) -> Self {
        match shape {
            Shape::Disc { radius_m } => Self::from_parts(vec![ConvexPart::new(vec![Vec2::ZERO], *radius_m)]),
            _ => Self::polygon(&shape.corners()),
        }
    }

    /// A simple polygon, decomposed into convex parts where it is concave.
    pub(crate) fn polygon(corners: &[Point]) -> Self {
        let parts = convex_parts(corners);
        Self::from_parts(
            parts
                .into_iter()
                .map(|part| ConvexPart::new(part.into_iter().map(Point::to_vec).collect(), 0.0))
                .collect(),
        )
    }

    /// A wall between two points.
    pub(crate) fn segment(from: Point, to: Point) -> Self {
        Self::from_parts(vec![ConvexPart::new(vec![from.to_vec(), to.to_vec()], 0.0)])
    }

    fn from_parts(parts: Vec<ConvexPart>) -> Self {
        let outer_radius_m = parts.iter().map(|p| p.reach_m + p.radius_m).fold(0.0, f64::max);
        let is_disc = matches!(parts.as_slice(), [only] if only.corners.len() == 1 && only.reach_m == 0.0);
        Self { parts, outer_radius_m, is_disc }
    }
}

impl ConvexPart {
    fn new(corners: Vec<Vec2>, radius_m: f64) -> Self {
        let n = corners.len();
        let edges = if n > 1 {
            (0..n).map(|k| Edge::new(corners[k], corners[(k + 1) % n])).collect()
        } else {
            Vec::new()
        };
        let reach_m = corners.iter().map(|c| c.length()).fold(0.0, f64::max);
        let inner_m = edges.iter().map(|e: &Edge| e.offset_m).fold(f64::INFINITY, f64::min);
        let least_reach_m = if edges.is_empty() || inner_m < 0.0 { -reach_m } else { inner_m };
        Self { corners, edges, radius_m, reach_m, least_reach_m }
    }
}

impl Edge {
    fn new(from: Vec2, to: Vec2) -> Self {
        let along = to - from;
        let normal = -along.perpendicular() / along.length();
        Self { normal, offset_m: normal.dot(from) }
    }
}

/// A convex part at the pose of its body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedPart<'a> {
    /// The part.
    pub(crate) part: &'a ConvexPart,
    /// The body's origin.
    pub(crate) origin: Point,
    /// The body's rotation.
    pub(crate) rotation: Rotation,
}

impl PlacedPart<'_> {
    /// The position of a corner in the table frame.
    pub(crate) fn corner(&self, k: usize) -> Point {
        self.origin + self.rotation.apply(self.part.corners[k])
    }
}
