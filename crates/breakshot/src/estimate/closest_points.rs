//! The closest points of two outlines, the normal between them, and whether flat sides face each other.

use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;

/// An outline at a pose on the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedShape<'a> {
    pub(crate) shape: &'a Shape,
    pub(crate) pose: Pose,
}

/// The closest points of two outlines that do not overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClosestPoints {
    /// The distance between the outlines (m); negative: the depth of penetration.
    pub(crate) gap_m: f64,
    /// The unit normal from a to b.
    pub(crate) normal_ab: Vec2,
    /// The point midway between the closest points.
    pub(crate) point: Point,
    /// The far end of two nearly parallel sides, if such sides face each other.
    pub(crate) facing_sides: Option<FacingSides>,
}

/// The far end of two flat sides that face each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FacingSides {
    /// The point midway between the sides at the end at which they are farther apart.
    pub(crate) far_point: Point,
    /// The gap there minus that at the closest points (m).
    pub(crate) wedge_m: f64,
    /// The normals of contacts at the near end alone and at the far end alone: a corner of one side meets the other side there.
    pub(crate) end_normals_ab: [Vec2; 2],
}

/// Sides face each other up to this angle (rad): beyond it the far ends do not meet within an impact.
const FACING_RAD: f64 = 0.15;
/// Sides that overlap by less than this fraction of the shorter one touch at a corner.
const MIN_OVERLAP: f64 = 0.05;

/// The closest points of two outlines; `None` if they overlap.
pub(crate) fn closest_points(a: PlacedShape, b: PlacedShape) -> Option<ClosestPoints> {
    match (a.shape, b.shape) {
        (Shape::Disc { radius_m: ra }, Shape::Disc { radius_m: rb }) => {
            between_points(a.pose.position, b.pose.position, *ra, *rb)
        }
        (Shape::Disc { radius_m }, _) => disc_polygon(a.pose.position, *radius_m, &placed(b)),
        (_, Shape::Disc { radius_m }) => {
            disc_polygon(b.pose.position, *radius_m, &placed(a)).map(ClosestPoints::swapped)
        }
        _ => polygon_polygon(&placed(a), &placed(b)),
    }
}

/// The closest points of two outlines, after moving b along the unit vector `away` until they do not overlap.
///
/// The gap is negative by the part of that distance along the normal.  `None` if 10 mm do not suffice.
pub(crate) fn separated_closest_points(a: PlacedShape, b: PlacedShape, away: Vec2) -> Option<ClosestPoints> {
    // Measured outlines overlap by tenths of a millimetre at an impact.
    const STEP_M: f64 = 2.5e-4;
    const STEPS: usize = 40;
    (0..STEPS).find_map(|k| {
        let moved_m = STEP_M * k as f64;
        let moved = Pose { position: b.pose.position + away * moved_m, ..b.pose };
        let mut closest = closest_points(a, PlacedShape { pose: moved, ..b })?;
        closest.gap_m -= moved_m * away.dot(closest.normal_ab).max(0.0);
        closest.point = closest.point - away * (moved_m / 2.0);
        Some(closest)
    })
}

impl ClosestPoints {
    fn swapped(self) -> Self {
        Self { normal_ab: -self.normal_ab, ..self }
    }
}

fn placed(outline: PlacedShape) -> Vec<Point> {
    outline.shape.corners().iter().map(|&p| outline.pose.table_from_body(p)).collect()
}

/// The closest points of two discs, or of points as discs without a radius.
fn between_points(p: Point, q: Point, radius_p: f64, radius_q: f64) -> Option<ClosestPoints> {
    let normal_ab = (q - p).direction()?;
    let gap_m = p.distance(q) - radius_p - radius_q;
    let point = p + normal_ab * (radius_p + gap_m / 2.0);
    (gap_m >= 0.0).then_some(ClosestPoints { gap_m, normal_ab, point, facing_sides: None })
}

fn disc_polygon(centre: Point, radius_m: f64, polygon: &[Point]) -> Option<ClosestPoints> {
    if inside(centre, polygon) {
        return None;
    }
    let nearest = edges(polygon)
        .map(|(from, to)| nearest_on(from, to, centre))
        .min_by(|p, q| p.distance(centre).total_cmp(&q.distance(centre)))?;
    between_points(centre, nearest, radius_m, 0.0)
}

fn polygon_polygon(a: &[Point], b: &[Point]) -> Option<ClosestPoints> {
    if crossing(a, b) || inside(a[0], b) || inside(b[0], a) {
        return None;
    }
    let from_a = edges(b).flat_map(|(from, to)| a.iter().map(move |&p| (p, nearest_on(from, to, p))));
    let from_b = edges(a).flat_map(|(from, to)| b.iter().map(move |&q| (nearest_on(from, to, q), q)));
    let (p, q) = from_a
        .chain(from_b)
        .min_by(|one, other| one.0.distance(one.1).total_cmp(&other.0.distance(other.1)))?;
    let mut closest = between_points(p, q, 0.0, 0.0)?;
    if let Some((normal, sides)) = facing(a, b, &closest) {
        closest.normal_ab = normal;
        closest.facing_sides = Some(sides);
    }
    Some(closest)
}

/// The mean normal and the far end of two nearly parallel sides at the closest points, if there are such sides.
fn facing(a: &[Point], b: &[Point], closest: &ClosestPoints) -> Option<(Vec2, FacingSides)> {
    let near = |(from, to): &(Point, Point)| nearest_on(*from, *to, closest.point).distance(closest.point);
    let reach_m = closest.gap_m / 2.0 + 1e-9;
    edges(a).filter(|e| near(e) <= reach_m).find_map(|side_a| {
        edges(b).filter(|e| near(e) <= reach_m).find_map(|side_b| {
            let along_a = (side_a.1 - side_a.0).direction()?;
            let along_b = (side_b.0 - side_b.1).direction()?;
            if along_a.cross(along_b).asin().abs() > FACING_RAD || along_a.dot(along_b) < 0.0 {
                return None;
            }
            let along = (along_a + along_b).direction()?;
            let span = |(from, to): (Point, Point)| {
                let (s, e) = ((from - closest.point).dot(along), (to - closest.point).dot(along));
                (s.min(e), s.max(e))
            };
            let ((low_a, high_a), (low_b, high_b)) = (span(side_a), span(side_b));
            let (low, high) = (low_a.max(low_b), high_a.min(high_b));
            if high - low < MIN_OVERLAP * (high_a - low_a).min(high_b - low_b) {
                return None;
            }
            // The side that ends has its corner there, and the other one the normal
            let of_low = if low_a > low_b { along_b } else { along_a };
            let of_high = if high_a < high_b { along_b } else { along_a };
            let (far, near_along, far_along) =
                if high.abs() > low.abs() { (high, of_low, of_high) } else { (low, of_high, of_low) };
            let sides = FacingSides {
                far_point: closest.point + along * far,
                wedge_m: along_a.cross(along_b).abs() * far.abs(),
                end_normals_ab: [near_along, far_along].map(|along| -along.perpendicular()),
            };
            Some((-along.perpendicular(), sides))
        })
    })
}

fn edges(polygon: &[Point]) -> impl Iterator<Item = (Point, Point)> + '_ {
    (0..polygon.len()).map(|k| (polygon[k], polygon[(k + 1) % polygon.len()]))
}

/// The point of a segment that is nearest to `p`.
fn nearest_on(from: Point, to: Point, p: Point) -> Point {
    let side = to - from;
    let fraction = ((p - from).dot(side) / side.length_squared()).clamp(0.0, 1.0);
    from + side * fraction
}

fn inside(p: Point, polygon: &[Point]) -> bool {
    edges(polygon)
        .filter(|(from, to)| {
            (from.y > p.y) != (to.y > p.y)
                && p.x < from.x + (p.y - from.y) / (to.y - from.y) * (to.x - from.x)
        })
        .count()
        % 2
        == 1
}

fn crossing(a: &[Point], b: &[Point]) -> bool {
    let side = |p: Point, q: Point, r: Point| (q - p).cross(r - p);
    edges(a).any(|(p, q)| {
        edges(b).any(|(r, s)| side(p, q, r) * side(p, q, s) < 0.0 && side(r, s, p) * side(r, s, q) < 0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_4;

    const DISC: Shape = Shape::Disc { radius_m: 0.03 };
    const SQUARE: Shape = Shape::Rectangle { size_m: [0.04, 0.04] };

    fn at(shape: &Shape, x: f64, y: f64, yaw: f64) -> PlacedShape<'_> {
        PlacedShape { shape, pose: Pose::new(x, y, yaw) }
    }

    #[test]
    fn the_contact_of_two_discs_is_on_the_line_of_centres() {
        let found = closest_points(at(&DISC, 0.0, 0.0, 0.0), at(&DISC, 0.061, 0.0, 0.0)).expect("apart");
        assert!(
            (found.gap_m - 0.001).abs() < 1e-12 && (found.normal_ab - Vec2::new(1.0, 0.0)).length() < 1e-12
        );
        assert!(found.point.distance(Point::new(0.0305, 0.0)) < 1e-12);
    }

    #[test]
    fn swapping_the_outlines_reverses_the_normal() {
        let rotated = at(&SQUARE, 0.06, 0.01, 0.6);
        let one = closest_points(at(&DISC, 0.0, 0.0, 0.0), rotated).expect("apart");
        let other = closest_points(rotated, at(&DISC, 0.0, 0.0, 0.0)).expect("apart");
        assert!(
            (one.normal_ab + other.normal_ab).length() < 1e-12 && one.point.distance(other.point) < 1e-12
        );
    }

    #[test]
    fn the_normal_between_a_corner_and_a_flat_side_is_that_of_the_side() {
        let found =
            closest_points(at(&SQUARE, 0.0, 0.0, 0.0), at(&SQUARE, 0.05, 0.0, FRAC_PI_4)).expect("apart");
        assert!((found.normal_ab - Vec2::new(1.0, 0.0)).length() < 1e-9 && found.facing_sides.is_none());
    }

    #[test]
    fn flat_sides_that_face_each_other_have_a_far_end() {
        let found =
            closest_points(at(&SQUARE, 0.0, 0.0, 0.0), at(&SQUARE, 0.041, 0.005, 0.02)).expect("apart");
        let sides = found.facing_sides.expect("facing sides");
        // Of the 40 mm sides, 35 mm face each other.
        let length_m = sides.far_point.distance(found.point);
        assert!((length_m - 0.035).abs() < 5e-4, "{length_m} m");
        assert!((sides.wedge_m - 0.02 * length_m).abs() < 1e-5, "{} m", sides.wedge_m);
        // A corner of the first square is at the near end, one of the second at the far end.
        let [near, far] = sides.end_normals_ab;
        assert!((near - Vec2::from_heading(0.02)).length() < 1e-9, "{near:?}");
        assert!((far - Vec2::new(1.0, 0.0)).length() < 1e-9, "{far:?}");
    }

    #[test]
    fn overlapping_outlines_are_moved_apart_before_the_normal_is_taken() {
        let away = Vec2::new(1.0, 0.0);
        let found = separated_closest_points(at(&SQUARE, 0.0, 0.0, 0.0), at(&DISC, 0.0495, 0.004, 0.0), away)
            .expect("apart");
        assert!((found.gap_m + 0.0005).abs() < 1e-9, "{} m", found.gap_m);
        assert!((found.normal_ab - away).length() < 1e-12);
    }
}
