//! Where two outlines touch: the normal, the point, and whether flat faces meet.

use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;

/// An outline lying on the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outline<'a> {
    pub(crate) shape: &'a Shape,
    pub(crate) pose: Pose,
}

/// The nearest points of two outlines that do not overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Touch {
    /// How far apart the outlines are (m); below zero, how deep they were pressed into each other.
    pub(crate) gap_m: f64,
    /// From a to b.
    pub(crate) normal_ab: Vec2,
    /// The point in the middle of the gap.
    pub(crate) point: Point,
    /// Where the other end of two nearly parallel faces would touch, and how much wider the gap is there (m).
    pub(crate) face: Option<Face>,
}

/// Two flat sides that face each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Face {
    /// The end that is farther apart.
    pub(crate) far_point: Point,
    /// How much wider the gap is there (m).
    pub(crate) wedge_m: f64,
}

/// Sides count as facing each other up to this angle: beyond it the far ends do not meet within an impact.
const FACING_RAD: f64 = 0.15;
/// Faces that overlap by less than this part of the shorter one touch at a corner.
const FACING_OVERLAP: f64 = 0.05;

/// The nearest points of two outlines; `None` if they overlap.
pub(crate) fn touch(a: Outline, b: Outline) -> Option<Touch> {
    match (a.shape, b.shape) {
        (Shape::Disc { radius_m: ra }, Shape::Disc { radius_m: rb }) => {
            between_points(a.pose.position, b.pose.position, *ra, *rb)
        }
        (Shape::Disc { radius_m }, _) => disc_polygon(a.pose.position, *radius_m, &placed(b)),
        (_, Shape::Disc { radius_m }) => {
            disc_polygon(b.pose.position, *radius_m, &placed(a)).map(Touch::swapped)
        }
        _ => polygon_polygon(&placed(a), &placed(b)),
    }
}

/// As [`touch`]; outlines that overlap are first moved apart: b along `away` (a unit vector), as far as needed.
pub(crate) fn touch_apart(a: Outline, b: Outline, away: Vec2) -> Option<Touch> {
    // Measured outlines overlap by tenths of a millimetre at an impact, not by centimetres.
    const STEP_M: f64 = 2.5e-4;
    const STEPS: usize = 40;
    (0..STEPS).find_map(|k| {
        let back_m = STEP_M * k as f64;
        let moved = Pose { position: b.pose.position + away * back_m, ..b.pose };
        let mut touch = touch(a, Outline { pose: moved, ..b })?;
        touch.gap_m -= back_m * away.dot(touch.normal_ab).max(0.0);
        touch.point = touch.point - away * (back_m / 2.0);
        Some(touch)
    })
}

impl Touch {
    fn swapped(self) -> Self {
        Self { normal_ab: -self.normal_ab, ..self }
    }
}

fn placed(outline: Outline) -> Vec<Point> {
    outline.shape.corners().iter().map(|&p| outline.pose.table_from_body(p)).collect()
}

/// The touch of two points with thickness.
fn between_points(p: Point, q: Point, thick_p: f64, thick_q: f64) -> Option<Touch> {
    let normal_ab = (q - p).direction()?;
    let gap_m = p.distance(q) - thick_p - thick_q;
    let point = p + normal_ab * (thick_p + gap_m / 2.0);
    (gap_m >= 0.0).then_some(Touch { gap_m, normal_ab, point, face: None })
}

fn disc_polygon(centre: Point, radius_m: f64, polygon: &[Point]) -> Option<Touch> {
    if inside(centre, polygon) {
        return None;
    }
    let nearest = edges(polygon)
        .map(|(from, to)| nearest_on(from, to, centre))
        .min_by(|p, q| p.distance(centre).total_cmp(&q.distance(centre)))?;
    between_points(centre, nearest, radius_m, 0.0)
}

fn polygon_polygon(a: &[Point], b: &[Point]) -> Option<Touch> {
    if crossing(a, b) || inside(a[0], b) || inside(b[0], a) {
        return None;
    }
    let from_a = edges(b).flat_map(|(from, to)| a.iter().map(move |&p| (p, nearest_on(from, to, p))));
    let from_b = edges(a).flat_map(|(from, to)| b.iter().map(move |&q| (nearest_on(from, to, q), q)));
    let (p, q) = from_a
        .chain(from_b)
        .min_by(|one, other| one.0.distance(one.1).total_cmp(&other.0.distance(other.1)))?;
    let mut touch = between_points(p, q, 0.0, 0.0)?;
    if let Some((normal, face)) = facing(a, b, &touch) {
        touch.normal_ab = normal;
        touch.face = Some(face);
    }
    Some(touch)
}

/// The two sides that meet nearly parallel at the touch, if any: their mean normal and their far end.
fn facing(a: &[Point], b: &[Point], touch: &Touch) -> Option<(Vec2, Face)> {
    let near = |(from, to): &(Point, Point)| nearest_on(*from, *to, touch.point).distance(touch.point);
    let reach_m = touch.gap_m / 2.0 + 1e-9;
    edges(a).filter(|e| near(e) <= reach_m).find_map(|side_a| {
        edges(b).filter(|e| near(e) <= reach_m).find_map(|side_b| {
            let along_a = (side_a.1 - side_a.0).direction()?;
            let along_b = (side_b.0 - side_b.1).direction()?;
            if along_a.cross(along_b).asin().abs() > FACING_RAD || along_a.dot(along_b) < 0.0 {
                return None;
            }
            let along = (along_a + along_b).direction()?;
            let span = |(from, to): (Point, Point)| {
                let (s, e) = ((from - touch.point).dot(along), (to - touch.point).dot(along));
                (s.min(e), s.max(e))
            };
            let ((low_a, high_a), (low_b, high_b)) = (span(side_a), span(side_b));
            let (low, high) = (low_a.max(low_b), high_a.min(high_b));
            if high - low < FACING_OVERLAP * (high_a - low_a).min(high_b - low_b) {
                return None;
            }
            let far = if high.abs() > low.abs() { high } else { low };
            let far_point = touch.point + along * far;
            let wedge_m = along_a.cross(along_b).abs() * far.abs();
            Some((-along.perpendicular(), Face { far_point, wedge_m }))
        })
    })
}

fn edges(polygon: &[Point]) -> impl Iterator<Item = (Point, Point)> + '_ {
    (0..polygon.len()).map(|k| (polygon[k], polygon[(k + 1) % polygon.len()]))
}

/// The point of a segment that is nearest to `p`.
fn nearest_on(from: Point, to: Point, p: Point) -> Point {
    let way = to - from;
    let part = ((p - from).dot(way) / way.length_squared()).clamp(0.0, 1.0);
    from + way * part
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

    fn at(shape: &Shape, x: f64, y: f64, yaw: f64) -> Outline<'_> {
        Outline { shape, pose: Pose::new(x, y, yaw) }
    }

    #[test]
    fn discs_touch_on_the_line_of_centres() {
        let touch = touch(at(&DISC, 0.0, 0.0, 0.0), at(&DISC, 0.061, 0.0, 0.0)).expect("apart");
        assert!(
            (touch.gap_m - 0.001).abs() < 1e-12 && (touch.normal_ab - Vec2::new(1.0, 0.0)).length() < 1e-12
        );
        assert!(touch.point.distance(Point::new(0.0305, 0.0)) < 1e-12);
    }

    #[test]
    fn swapping_the_outlines_turns_the_normal() {
        let turned = at(&SQUARE, 0.06, 0.01, 0.6);
        let one = touch(at(&DISC, 0.0, 0.0, 0.0), turned).expect("apart");
        let other = touch(turned, at(&DISC, 0.0, 0.0, 0.0)).expect("apart");
        assert!(
            (one.normal_ab + other.normal_ab).length() < 1e-12 && one.point.distance(other.point) < 1e-12
        );
    }

    #[test]
    fn a_corner_meets_a_flat_side_along_the_sides_normal() {
        let touch = touch(at(&SQUARE, 0.0, 0.0, 0.0), at(&SQUARE, 0.05, 0.0, FRAC_PI_4)).expect("apart");
        assert!((touch.normal_ab - Vec2::new(1.0, 0.0)).length() < 1e-9 && touch.face.is_none());
    }

    #[test]
    fn flat_sides_that_face_each_other_tell_both_ends() {
        let touch = touch(at(&SQUARE, 0.0, 0.0, 0.0), at(&SQUARE, 0.041, 0.005, 0.02)).expect("apart");
        let face = touch.face.expect("faces");
        // Of the 40 mm sides, 35 mm face each other.
        let length_m = face.far_point.distance(touch.point);
        assert!((length_m - 0.035).abs() < 5e-4, "{length_m} m");
        assert!((face.wedge_m - 0.02 * length_m).abs() < 1e-5, "{} m", face.wedge_m);
    }

    #[test]
    fn overlapping_outlines_are_moved_apart_before_the_normal_is_taken() {
        let away = Vec2::new(1.0, 0.0);
        let touch =
            touch_apart(at(&SQUARE, 0.0, 0.0, 0.0), at(&DISC, 0.0495, 0.004, 0.0), away).expect("apart");
        assert!((touch.gap_m + 0.0005).abs() < 1e-9, "{} m", touch.gap_m);
        assert!((touch.normal_ab - away).length() < 1e-12);
    }
}
