//! Outlines of shapes on the table: which points they contain, and how large the gap between two of them is.
//!
//! An [`Outline`] is the Minkowski sum of a core (a point, a segment or a polygon) and a disc. A disc, a wall, a
//! polygon and the area swept by a moving disc have this form, so one distance function is enough.

use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;

/// The area of a shape on the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// The core: one point, the two ends of a segment, or the corners of a simple polygon.
    core: Vec<Point>,
    /// Radius of the disc that is added to the core (m).
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

    /// The area of a simple polygon.
    pub fn polygon(points: &[Point]) -> Self {
        Self { core: points.to_vec(), radius_m: 0.0 }
    }

    /// The area that a convex shape sweeps in a translation by `path` from a pose.
    pub fn swept(shape: &Shape, from: Pose, path: Vec2) -> Self {
        if let Shape::Disc { radius_m } = shape {
            return Self { core: vec![from.position, from.position + path], radius_m: *radius_m };
        }
        let mut points = placed(shape, from);
        points.extend_from_within(..);
        let half = points.len() / 2;
        for point in &mut points[half..] {
            *point += path;
        }
        Self { core: convex_hull(points), radius_m: 0.0 }
    }

    /// Whether a point is inside.
    pub fn contains(&self, point: Point) -> bool {
        let inside = self.core.len() > 2 && winds_around(&self.core, point);
        inside || self.edges().any(|edge| edge.distance_m(point) < self.radius_m)
    }

    /// Smallest distance between two outlines (m); negative if they overlap, but then not the depth of penetration.
    pub fn gap_m(&self, other: &Self) -> f64 {
        self.core_distance_m(other) - self.radius_m - other.radius_m
    }

    /// Distance of a point from the border, inside or outside (m).
    pub fn border_distance_m(&self, point: Point) -> f64 {
        let from_core_m = self.edges().map(|edge| edge.distance_m(point)).fold(f64::INFINITY, f64::min);
        (from_core_m - self.radius_m).abs()
    }

    fn core_distance_m(&self, other: &Self) -> f64 {
        let covers =
            |outer: &Self, inner: &Self| outer.core.len() > 2 && winds_around(&outer.core, inner.core[0]);
        if covers(self, other) || covers(other, self) {
            // Negative also for polygons of zero radius.
            return -f64::MIN_POSITIVE;
        }
        self.edges()
            .flat_map(|mine| other.edges().map(move |yours| mine.gap_m(yours)))
            .fold(f64::INFINITY, f64::min)
    }

    /// The edges of the core; a point is an edge of zero length.
    fn edges(&self) -> impl Iterator<Item = Segment> + '_ {
        let n = self.core.len();
        let count = if n > 2 { n } else { 1 };
        (0..count).map(move |k| Segment { from: self.core[k], to: self.core[(k + 1) % n] })
    }
}

fn placed(shape: &Shape, pose: Pose) -> Vec<Point> {
    shape.corners().into_iter().map(|corner| pose.table_from_body(corner)).collect()
}

/// A straight segment between two points.
#[derive(Clone, Copy)]
struct Segment {
    from: Point,
    to: Point,
}

impl Segment {
    /// Distance of a point (m).
    fn distance_m(self, point: Point) -> f64 {
        let along = self.to - self.from;
        let length_squared = along.length_squared();
        let t = if length_squared > 0.0 {
            ((point - self.from).dot(along) / length_squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        point.distance(self.from + along * t)
    }

    /// Positive for a point on the left.
    fn side(self, point: Point) -> f64 {
        (self.to - self.from).cross(point - self.from)
    }

    /// Distance of two segments (m); negative if they cross.
    fn gap_m(self, other: Self) -> f64 {
        let crossing = self.side(other.from) * self.side(other.to) < 0.0
            && other.side(self.from) * other.side(self.to) < 0.0;
        if crossing {
            // Negative, so that outlines without a radius overlap.
            return -f64::MIN_POSITIVE;
        }
        [
            other.distance_m(self.from),
            other.distance_m(self.to),
            self.distance_m(other.from),
            self.distance_m(other.to),
        ]
        .into_iter()
        .fold(f64::INFINITY, f64::min)
    }
}

/// Whether a point is inside a closed polygon (even-odd rule on the ray to the right).
fn winds_around(corners: &[Point], point: Point) -> bool {
    let n = corners.len();
    let crossings = (0..n).filter(|&k| {
        let (p, q) = (corners[k], corners[(k + 1) % n]);
        let spans = (p.y > point.y) != (q.y > point.y);
        spans && point.x < p.x + (point.y - p.y) / (q.y - p.y) * (q.x - p.x)
    });
    crossings.count() % 2 == 1
}

/// The convex hull, counter-clockwise (monotone chain, Andrew 1979).
fn convex_hull(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_unstable_by(|p, q| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)));
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
    fn the_gap_of_a_rotated_square_is_measured_from_its_corner() {
        let square = Shape::Rectangle { size_m: [0.04, 0.04] };
        let rotated = Outline::new(&square, Pose::new(0.0, 0.0, FRAC_PI_4));
        let gap_m = rotated.gap_m(&disc(0.01, 0.1, 0.0));
        assert!((gap_m - (0.09 - 0.02 * 2f64.sqrt())).abs() < 1e-15, "{gap_m} m");
    }

    #[test]
    fn a_corner_that_penetrates_a_side_overlaps_and_a_side_in_front_of_it_does_not() {
        let square = Shape::Rectangle { size_m: [0.04, 0.04] };
        let square_at_rest = Outline::new(&square, Pose::new(0.0, 0.0, 0.0));
        let touching_m = 0.02 + 0.02 * 2f64.sqrt();
        for k in 0..8 {
            let yaw_rad = FRAC_PI_4 * f64::from(k);
            let penetrating = Outline::new(&square, Pose::new(touching_m - 1e-4, 0.0, yaw_rad));
            let is_on_corner = k % 2 == 1;
            assert_eq!(square_at_rest.gap_m(&penetrating) < 0.0, is_on_corner, "at a yaw of {yaw_rad} rad");
            assert_eq!(penetrating.gap_m(&square_at_rest) < 0.0, is_on_corner, "at a yaw of {yaw_rad} rad");
        }
        let beside = Outline::new(&square, Pose::new(touching_m + 1e-9, 0.0, FRAC_PI_4));
        assert!(square_at_rest.gap_m(&beside) > 0.0);
    }

    #[test]
    fn overlapping_outlines_have_a_negative_gap_even_if_one_contains_the_other() {
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
    fn the_swept_area_has_the_width_of_the_shape_and_ends_with_the_path() {
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
    fn a_convex_hull_omits_interior_points() {
        let points =
            [[0.0, 0.0], [1.0, 0.0], [0.5, 0.5], [1.0, 1.0], [0.0, 1.0], [0.5, 0.0]].map(Point::from);
        assert_eq!(convex_hull(points.to_vec()).len(), 4);
    }
}
