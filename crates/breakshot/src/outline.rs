//! Outlines lying on the table: what they cover, and how far apart they are.
//!
//! An [`Outline`] is a core (a point, a segment, a polygon) thickened by a radius.  A disc, a wall, a polygon and the
//! area that a moving disc sweeps are all of this form, so one distance serves them all.

use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;

/// A shape placed on the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// The core: one point, the two ends of a segment, or the corners of a simple polygon.
    core: Vec<Point>,
    /// By how much the core is thickened (m).
    radius_m: f64,
}

impl Outline {
    /// The outline of a shape at a pose.
    pub fn new(shape: &Shape, pose: Pose) -> Self {
        match shape {
            Shape::Disc { radius_m } => Self { core: vec![pose.position], radius_m: *radius_m },
            _ => Self { core: placed(shape, pose), radius_m: 0.0 },
        }
    }

    /// A wall between two points.
    pub fn segment(from: Point, to: Point) -> Self {
        Self { core: vec![from, to], radius_m: 0.0 }
    }

    /// All points within a distance of a segment.
    pub fn capsule(from: Point, to: Point, radius_m: f64) -> Self {
        Self { core: vec![from, to], radius_m }
    }

    /// The area inside a simple polygon.
    pub fn polygon(points: &[Point]) -> Self {
        Self { core: points.to_vec(), radius_m: 0.0 }
    }

    /// The area that a convex shape covers while it moves from a pose by `way` without turning.
    pub fn swept(shape: &Shape, from: Pose, way: Vec2) -> Self {
        if let Shape::Disc { radius_m } = shape {
            return Self { core: vec![from.position, from.position + way], radius_m: *radius_m };
        }
        let mut points = placed(shape, from);
        points.extend_from_within(..);
        let half = points.len() / 2;
        for point in &mut points[half..] {
            *point += way;
        }
        Self { core: convex_hull(points), radius_m: 0.0 }
    }

    /// Whether a point lies inside.
    pub fn contains(&self, point: Point) -> bool {
        let inside = self.core.len() > 2 && winds_around(&self.core, point);
        inside || self.edges().any(|edge| point_to_segment_m(point, edge) < self.radius_m)
    }

    /// The free space between two outlines (m); negative if they overlap, then not a measure of how far.
    pub fn gap_m(&self, other: &Self) -> f64 {
        self.core_distance_m(other) - self.radius_m - other.radius_m
    }

    /// How far a point is from the border, inside or outside (m).
    pub fn border_distance_m(&self, point: Point) -> f64 {
        let from_core_m =
            self.edges().map(|edge| point_to_segment_m(point, edge)).fold(f64::INFINITY, f64::min);
        (from_core_m - self.radius_m).abs()
    }

    fn core_distance_m(&self, other: &Self) -> f64 {
        let covers =
            |outer: &Self, inner: &Self| outer.core.len() > 2 && winds_around(&outer.core, inner.core[0]);
        if covers(self, other) || covers(other, self) {
            // A polygon of zero radius would else only touch what it holds.
            return -f64::MIN_POSITIVE;
        }
        self.edges()
            .flat_map(|mine| other.edges().map(move |yours| segments_apart_m(mine, yours)))
            .fold(f64::INFINITY, f64::min)
    }

    /// The core's edges; a point is an edge of no length.
    fn edges(&self) -> impl Iterator<Item = (Point, Point)> + '_ {
        let n = self.core.len();
        let count = if n > 2 { n } else { 1 };
        (0..count).map(move |k| (self.core[k], self.core[(k + 1) % n]))
    }
}

fn placed(shape: &Shape, pose: Pose) -> Vec<Point> {
    shape.corners().into_iter().map(|corner| pose.table_from_body(corner)).collect()
}

/// How far a point is from a segment (m).
pub fn point_to_segment_m(point: Point, (from, to): (Point, Point)) -> f64 {
    let along = to - from;
    let length_squared = along.length_squared();
    let t =
        if length_squared > 0.0 { ((point - from).dot(along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    point.distance(from + along * t)
}

fn segments_apart_m(one: (Point, Point), other: (Point, Point)) -> f64 {
    let side = |(from, to): (Point, Point), p: Point| (to - from).cross(p - from);
    let crossing =
        side(one, other.0) * side(one, other.1) < 0.0 && side(other, one.0) * side(other, one.1) < 0.0;
    if crossing {
        // Outlines without a radius overlap then; they do not just touch.
        return -f64::MIN_POSITIVE;
    }
    [
        point_to_segment_m(one.0, other),
        point_to_segment_m(one.1, other),
        point_to_segment_m(other.0, one),
        point_to_segment_m(other.1, one),
    ]
    .into_iter()
    .fold(f64::INFINITY, f64::min)
}

/// Whether a closed polygon winds around a point (crossings of the ray to the right).
fn winds_around(corners: &[Point], point: Point) -> bool {
    let n = corners.len();
    let crossings = (0..n).filter(|&k| {
        let (p, q) = (corners[k], corners[(k + 1) % n]);
        let spans = (p.y > point.y) != (q.y > point.y);
        spans && point.x < p.x + (point.y - p.y) / (q.y - p.y) * (q.x - p.x)
    });
    crossings.count() % 2 == 1
}

/// The convex hull, counter-clockwise (monotone chain).
fn convex_hull(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|p, q| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)));
    let half = |points: &mut dyn Iterator<Item = Point>| {
        let mut chain: Vec<Point> = Vec::new();
        for point in points {
            while let [.., before, last] = chain[..] {
                if (last - before).cross(point - last) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_4;

    fn disc(radius_m: f64, x: f64, y: f64) -> Outline {
        Outline::new(&Shape::Disc { radius_m }, Pose::new(x, y, 0.0))
    }

    #[test]
    fn the_gap_of_two_discs_is_the_distance_less_both_radii() {
        let gap_m = disc(0.04, 0.0, 0.0).gap_m(&disc(0.03, 0.06, 0.08));
        assert!((gap_m - 0.03).abs() < 1e-15, "{gap_m} m");
    }

    #[test]
    fn a_square_on_its_corner_is_nearer_by_half_a_diagonal() {
        let square = Shape::Rectangle { size_m: [0.04, 0.04] };
        let turned = Outline::new(&square, Pose::new(0.0, 0.0, FRAC_PI_4));
        let gap_m = turned.gap_m(&disc(0.01, 0.1, 0.0));
        assert!((gap_m - (0.09 - 0.02 * 2f64.sqrt())).abs() < 1e-15, "{gap_m} m");
    }

    #[test]
    fn a_corner_that_pokes_into_a_side_is_an_overlap_and_one_that_touches_it_is_none() {
        let square = Shape::Rectangle { size_m: [0.04, 0.04] };
        let lying = Outline::new(&square, Pose::new(0.0, 0.0, 0.0));
        let touching_m = 0.02 + 0.02 * 2f64.sqrt();
        for k in 0..8 {
            let turn_rad = FRAC_PI_4 * f64::from(k);
            let poking = Outline::new(&square, Pose::new(touching_m - 1e-4, 0.0, turn_rad));
            let is_on_corner = k % 2 == 1;
            assert_eq!(lying.gap_m(&poking) < 0.0, is_on_corner, "turned by {turn_rad} rad");
            assert_eq!(poking.gap_m(&lying) < 0.0, is_on_corner, "turned by {turn_rad} rad");
        }
        let beside = Outline::new(&square, Pose::new(touching_m + 1e-9, 0.0, FRAC_PI_4));
        assert!(lying.gap_m(&beside) > 0.0);
    }

    #[test]
    fn overlapping_outlines_have_a_negative_gap_even_when_one_holds_the_other() {
        let square = |size_m: f64| {
            Outline::new(&Shape::Rectangle { size_m: [size_m, size_m] }, Pose::new(0.0, 0.0, 0.0))
        };
        for (one, other) in [
            (square(0.1), square(0.02)),
            (square(0.1), disc(0.01, 0.0, 0.0)),
            (disc(0.05, 0.0, 0.0), square(0.01)),
            (disc(0.05, 0.0, 0.0), disc(0.01, 0.01, 0.0)),
        ] {
            assert!(one.gap_m(&other) < 0.0 && other.gap_m(&one) < 0.0, "{} m", one.gap_m(&other));
        }
    }

    #[test]
    fn the_swept_area_touches_what_stands_beside_the_way_and_ends_with_it() {
        for shape in [Shape::Disc { radius_m: 0.02 }, Shape::Rectangle { size_m: [0.04, 0.04] }] {
            let swept = Outline::swept(&shape, Pose::new(0.0, 0.0, 0.0), Vec2::new(0.2, 0.0));
            let beside_m = swept.gap_m(&disc(0.01, 0.1, 0.05));
            let ahead_m = swept.gap_m(&disc(0.01, 0.25, 0.0));
            assert!(
                (beside_m - 0.02).abs() < 1e-15 && (ahead_m - 0.02).abs() < 1e-15,
                "{beside_m} {ahead_m} m"
            );
            assert!(swept.contains(Point::new(0.1, 0.0)) && !swept.contains(Point::new(0.1, 0.03)));
        }
    }

    #[test]
    fn a_hull_drops_the_points_inside() {
        let points =
            [[0.0, 0.0], [1.0, 0.0], [0.5, 0.5], [1.0, 1.0], [0.0, 1.0], [0.5, 0.0]].map(Point::from);
        assert_eq!(convex_hull(points.to_vec()).len(), 4);
    }
}
