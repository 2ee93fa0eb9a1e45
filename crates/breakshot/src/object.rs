//! What is measured on the objects with a ruler: outline, height and marker.

use crate::error::bounds::{length, position, positive, zero_or_more};
use crate::error::{Error, Result};
use crate::geometry::{Point, Vec2};
use serde::{Deserialize, Serialize};

/// The outline of an object from above, in the object's frame, whose origin is the centroid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A disc.
    Disc {
        /// Radius (m).
        radius_m: f64,
    },
    /// A rectangle with sides parallel to x and y.
    Rectangle {
        /// Full side lengths along x and y (m).
        size_m: [f64; 2],
    },
    /// A simple polygon with counter-clockwise corners, convex or concave.
    Polygon {
        /// Corner points (m).
        points_m: Vec<Point>,
    },
}

impl Shape {
    /// The corner points in counter-clockwise order; empty for a disc.
    pub fn corners(&self) -> Vec<Point> {
        match self {
            Self::Disc { .. } => Vec::new(),
            Self::Rectangle { size_m: [x, y] } => [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(sx, sy)| Point::new(sx * x / 2.0, sy * y / 2.0))
                .to_vec(),
            Self::Polygon { points_m } => points_m.clone(),
        }
    }

    /// The shape with all lengths multiplied by a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::Disc { radius_m } => Self::Disc { radius_m: factor * radius_m },
            Self::Rectangle { size_m } => Self::Rectangle { size_m: size_m.map(|side_m| factor * side_m) },
            Self::Polygon { points_m } => {
                let points_m = points_m.iter().map(|point| Point::ORIGIN + point.to_vec() * factor);
                Self::Polygon { points_m: points_m.collect() }
            }
        }
    }

    /// Points along the outline in the object's frame, counter-clockwise: so many that a lens bends the lines between them little.
    pub fn outline_points(&self) -> Vec<Point> {
        const DISC_POINTS: usize = 72;
        const SIDE_POINTS: usize = 8;
        if let Self::Disc { radius_m } = self {
            let step_rad = std::f64::consts::TAU / DISC_POINTS as f64;
            let point = |k: usize| Point::ORIGIN + Vec2::from_heading(k as f64 * step_rad) * *radius_m;
            return (0..DISC_POINTS).map(point).collect();
        }
        let corners = self.corners();
        let side = |k: usize| {
            let (from, to) = (corners[k], corners[(k + 1) % corners.len()]);
            (0..SIDE_POINTS).map(move |i| from + (to - from) * (i as f64 / SIDE_POINTS as f64))
        };
        (0..corners.len()).flat_map(side).collect()
    }

    /// Area (m2).
    pub fn area_m2(&self) -> f64 {
        match self {
            Self::Disc { radius_m } => std::f64::consts::PI * radius_m * radius_m,
            Self::Rectangle { size_m } => size_m[0] * size_m[1],
            Self::Polygon { points_m } => polygon_area_m2(points_m),
        }
    }

    /// Radius of the smallest circle about the centroid that contains the outline (m).
    pub fn outer_radius_m(&self) -> f64 {
        match self {
            Self::Disc { radius_m } => *radius_m,
            _ => self.corners().iter().map(|p| p.to_vec().length()).fold(0.0, f64::max),
        }
    }

    /// Radius of gyration of a uniform plate about its centroid (m): the moment of inertia is the mass times its
    /// square.
    pub fn radius_of_gyration_m(&self) -> f64 {
        match self {
            Self::Disc { radius_m } => radius_m / std::f64::consts::SQRT_2,
            Self::Rectangle { size_m: [x, y] } => ((x * x + y * y) / 12.0).sqrt(),
            Self::Polygon { points_m } => polygon_radius_of_gyration_m(points_m),
        }
    }

    /// The mean distance of the outline's points from its centroid (m): the mean lever arm of a weight spread uniformly under it.
    pub(crate) fn mean_arm_m(&self) -> f64 {
        if let Self::Disc { radius_m } = self {
            return radius_m * 2.0 / 3.0;
        }
        let corners = self.corners();
        let n = corners.len();
        let moment: f64 =
            (0..n).map(|k| arm_moment_m3(corners[k].to_vec(), corners[(k + 1) % n].to_vec())).sum();
        moment / self.area_m2()
    }

    /// Support function: largest projection of the outline onto a unit vector in the object's frame (m).
    pub fn reach_m(&self, direction: Vec2) -> f64 {
        match self {
            Self::Disc { radius_m } => *radius_m,
            _ => self.corners().iter().map(|p| p.to_vec().dot(direction)).fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// The smallest rotation about the centroid that maps the outline onto itself (rad).
    ///
    /// 0 for a disc, which any rotation maps onto itself; `None` if only a full rotation does.
    pub fn rotation_symmetry_rad(&self) -> Option<f64> {
        let corners = self.corners();
        if corners.is_empty() {
            return Some(0.0);
        }
        let tolerance = SYMMETRY_TOLERANCE * self.outer_radius_m();
        let n = corners.len();
        (1..n).find_map(|step| {
            let angle = (corners[step].to_vec().heading_rad() - corners[0].to_vec().heading_rad())
                .rem_euclid(std::f64::consts::TAU);
            let same = (0..n).all(|k| {
                let rotated = corners[k].to_vec().rotated(angle);
                (rotated - corners[(k + step) % n].to_vec()).length() < tolerance
            });
            same.then_some(angle)
        })
    }

    /// Checks the shape and moves a polygon so that its centroid is the origin.
    ///
    /// Returns the displacement of the origin (m), zero if it was at the centroid. Errors name `owner`.
    ///
    /// # Errors
    /// A length that is not a positive number; a polygon that is clockwise, self-crossing or without area.
    pub fn check_and_centre(&mut self, owner: &str) -> Result<Vec2> {
        match self {
            Self::Disc { radius_m } => length(owner, "radius_m", *radius_m)?,
            Self::Rectangle { size_m } => {
                length(owner, "size_m[0]", size_m[0])?;
                length(owner, "size_m[1]", size_m[1])?;
            }
            Self::Polygon { points_m } => {
                check_polygon(owner, points_m)?;
                let shift = polygon_centroid(points_m).to_vec();
                if shift.length() > CENTROID_TOLERANCE_M {
                    for p in points_m {
                        *p = *p - shift;
                    }
                    return Ok(shift);
                }
            }
        }
        Ok(Vec2::ZERO)
    }
}

/// Largest distance of corresponding corners under a symmetry, as a fraction of the outer radius: a regular polygon
/// specified in whole millimetres is regular within about 1 %.
const SYMMETRY_TOLERANCE: f64 = 0.01;
/// Largest distance of a polygon's origin from its centroid that is left as it is (m): the resolution of a ruler.
const CENTROID_TOLERANCE_M: f64 = 1e-4;

/// A marker on top of an object, darker or lighter than the surface around it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// Outline of the marker.
    pub shape: Shape,
    /// Position of its centre in the object's frame (m).
    #[serde(default)]
    pub at_m: Point,
    /// A dot beside a disc, of smaller or equal radius, which determines the yaw.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dot: Option<Dot>,
    /// Thickness above the object's top (m): from an oblique direction the marker's side is visible too.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub thickness_m: f64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// A round dot of the same colour as its marker.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dot {
    /// Radius (m).
    pub radius_m: f64,
    /// Position of its centre in the object's frame (m).
    pub at_m: Point,
}

/// Largest radius of a smaller dot over that of its disc: with more similar radii the two could be exchanged.
const LARGEST_DOT: f64 = 0.7;
/// Radii that differ by less are equal (m).
const EQUAL_M: f64 = 1e-9;

impl Marker {
    /// A marker of zero thickness at the object's centroid, without a dot.
    pub fn centred(shape: Shape) -> Self {
        Self { shape, at_m: Point::ORIGIN, dot: None, thickness_m: 0.0 }
    }

    /// Whether dot and disc have the same radius, so that the marker has a symmetry of half a turn.
    pub fn has_equal_dots(&self) -> bool {
        match (&self.shape, self.dot) {
            (Shape::Disc { radius_m }, Some(dot)) => (dot.radius_m - radius_m).abs() < EQUAL_M,
            _ => false,
        }
    }

    /// Checks the marker; `shift` is the displacement of the object's origin.
    fn check(&mut self, owner: &str, shift: Vec2) -> Result<()> {
        let equal = self.has_equal_dots();
        self.at_m = self.at_m - shift;
        self.at_m += self.shape.check_and_centre(&format!("{owner}, marker"))?;
        position(owner, "marker.at_m", &[self.at_m.x, self.at_m.y])?;
        zero_or_more(owner, "marker.thickness_m", self.thickness_m, "metres")?;
        let Some(dot) = &mut self.dot else { return Ok(()) };
        dot.at_m = dot.at_m - shift;
        positive(owner, "marker.dot.radius_m", dot.radius_m)?;
        position(owner, "marker.dot.at_m", &[dot.at_m.x, dot.at_m.y])?;
        let Shape::Disc { radius_m } = self.shape else {
            return Err(Error::invalid(
                owner,
                "marker.dot",
                "a dot beside a marker that is no disc",
                "a disc",
            ));
        };
        if dot.radius_m > LARGEST_DOT * radius_m && !equal {
            let most_m = LARGEST_DOT * radius_m;
            let needed =
                format!("at most {most_m:.4} m, so that it cannot be taken for the disc, or {radius_m} m");
            return Err(Error::invalid(owner, "marker.dot.radius_m", dot.radius_m, needed));
        }
        let apart_m = dot.at_m.distance(self.at_m);
        if apart_m <= radius_m + dot.radius_m {
            let found = format!("a dot {apart_m:.4} m from the disc's centre");
            let needed = format!("more than {:.4} m, so that they do not touch", radius_m + dot.radius_m);
            return Err(Error::invalid(owner, "marker.dot.at_m", found, needed));
        }
        Ok(())
    }
}

/// One kind of object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Name of the kind, without `/`, `,` and `#`.
    pub name: String,
    /// Outline from above; the origin is the centroid.
    pub shape: Shape,
    /// Height of the top above the table (m), where marker and outline are.
    pub height_m: f64,
    /// Marker on top; an object without a marker is detected by its own outline.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marker: Option<Marker>,
    /// Weighed mass (kg); estimation does not use it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<f64>,
    /// Where it presses on the table; none: uniformly under its outline.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub support: Option<Support>,
}

/// The integral of the distance from the origin over the triangle origin, `from`, `to` (m3); negative if clockwise.
///
/// `h^3/6 [sec tan + ln(sec + tan)]` between the angles of the corners from the foot of the height h.
fn arm_moment_m3(from: Vec2, to: Vec2) -> f64 {
    let side = to - from;
    let length = side.length();
    let height = from.cross(to) / length;
    if height == 0.0 {
        return 0.0;
    }
    let antiderivative = |corner: Vec2| {
        let tan = corner.dot(side) / (length * height.abs());
        let sec = corner.length() / height.abs();
        sec * tan + tan.asinh()
    };
    height.abs().powi(3) / 6.0 * (antiderivative(to) - antiderivative(from)) * height.signum()
}

/// Where an object presses on the table, in its own frame, if not uniformly under its outline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Support {
    /// On three or more feet that carry equal fractions of the weight, at these positions (m).
    #[serde(rename = "feet_m")]
    Feet(Vec<Point>),
    /// Under its whole outline with the pressure `1 + gradient . x`, which is never negative; the gradient (1/m).
    #[serde(rename = "pressure_gradient_per_m")]
    Gradient(Vec2),
}

impl Support {
    /// An error that names the object unless it can be supported so; `shift` is the displacement of the object's origin.
    pub(crate) fn check(&mut self, owner: &str, shift: Vec2) -> Result<()> {
        match self {
            Self::Feet(feet) => {
                for foot in feet.iter_mut() {
                    *foot = *foot - shift;
                }
                if !(3..=MOST_CORNERS).contains(&feet.len()) {
                    let found = format!("{} feet", feet.len());
                    let needed = format!("three or more positions (at most {MOST_CORNERS})");
                    return Err(Error::invalid(owner, "support.feet_m", found, needed));
                }
                for foot in feet {
                    position(owner, "support.feet_m", &[foot.x, foot.y])?;
                }
            }
            Self::Gradient(gradient_per_m) if !gradient_per_m.is_finite() => {
                let what = "support.pressure_gradient_per_m";
                return Err(Error::invalid(owner, what, "not a number", "two numbers in 1/m"));
            }
            Self::Gradient(_) => {}
        }
        Ok(())
    }
}

/// The kind of an object on the table: that of `a#2`, the second copy, is `a`.
pub fn kind(name: &str) -> &str {
    name.split('#').next().unwrap_or(name)
}

/// The key of a pair of objects in the properties: the kinds in alphabetical order, `a/b`.
pub fn pair_key(one: &str, other: &str) -> String {
    let (one, other) = (kind(one), kind(other));
    if one <= other { format!("{one}/{other}") } else { format!("{other}/{one}") }
}

/// The object of the given name's kind; `asked_by` names the caller in the error.
///
/// # Errors
/// An unknown kind; the error lists the known ones.
pub fn find<'a>(objects: &'a [Object], name: &str, asked_by: &str) -> Result<&'a Object> {
    objects.iter().find(|o| o.name == kind(name)).ok_or_else(|| {
        let known: Vec<_> = objects.iter().map(|o| o.name.as_str()).collect();
        Error::invalid(asked_by, "object", format!("`{name}`"), format!("one of {}", known.join(", ")))
    })
}

impl Object {
    /// The feature that is detected in images: the marker, or the outline of an object without one.
    pub fn feature(&self) -> Marker {
        let outline = || Marker::centred(self.shape.clone());
        self.marker.clone().unwrap_or_else(outline)
    }

    /// Checks the object and moves its origin to the centroid; returns a note if it was moved.
    ///
    /// # Errors
    /// See [`Shape::check_and_centre`]; also a name with reserved characters, and a height or mass that is not positive.
    pub fn check(&mut self) -> Result<Option<String>> {
        let owner = format!("object `{}`", self.name);
        check_name(&self.name)?;
        length(&owner, "height_m", self.height_m)?;
        if let Some(mass_kg) = self.mass_kg {
            positive(&owner, "mass_kg", mass_kg)?;
        }
        let shift = self.shape.check_and_centre(&owner)?;
        if let Some(marker) = &mut self.marker {
            marker.check(&owner, shift)?;
        }
        if let Some(support) = &mut self.support {
            support.check(&owner, shift)?;
        }
        let moved = shift.length() > 0.0;
        Ok(moved.then(|| {
            format!(
                "{owner}: the polygon's origin was moved by ({:.2}, {:.2}) mm to its centroid",
                shift.x * 1e3,
                shift.y * 1e3
            )
        }))
    }
}

fn check_name(name: &str) -> Result<()> {
    if name.is_empty() || name.contains(['/', ',', '#']) || name.contains(char::is_control) {
        let found = format!("`{}`", name.escape_debug());
        let needed = "a name without `/`, `,`, `#` and control characters";
        return Err(Error::invalid("objects", "name", found, needed));
    }
    Ok(())
}

/// Largest number of corners or feet of an outline: all pairs of its sides are compared.
const MOST_CORNERS: usize = 1000;

fn check_polygon(owner: &str, points: &[Point]) -> Result<()> {
    let n = points.len();
    if !(3..=MOST_CORNERS).contains(&n) {
        let needed = format!("at least 3 corner points (at most {MOST_CORNERS})");
        return Err(Error::invalid(owner, "points_m", format!("{n} points"), needed));
    }
    for (k, point) in points.iter().enumerate() {
        position(owner, &format!("points_m[{k}]"), &[point.x, point.y])?;
    }
    let area_m2 = polygon_area_m2(points);
    if let Some((i, k)) = crossing_edges(points) {
        return Err(Error::invalid(
            owner,
            "points_m",
            format!("a self-crossing polygon with an area of {area_m2} m2 (edges {i} and {k} meet)"),
            "a simple polygon",
        ));
    }
    if area_m2.abs() < SMALLEST_AREA_M2 {
        return Err(Error::invalid(
            owner,
            "points_m",
            format!("an area of {area_m2} m2"),
            "a polygon with area",
        ));
    }
    if area_m2 < 0.0 {
        return Err(Error::invalid(owner, "points_m", "clockwise", "corner points counter-clockwise"));
    }
    Ok(())
}

/// Least area of an outline: a hundredth of a square millimetre.
const SMALLEST_AREA_M2: f64 = 1e-8;

/// The first two edges that touch or cross other than at a shared corner.
fn crossing_edges(points: &[Point]) -> Option<(usize, usize)> {
    let n = points.len();
    let edge = |i: usize| (points[i], points[(i + 1) % n]);
    for i in 0..n {
        for k in i + 1..n {
            let neighbours = k == i + 1 || (i == 0 && k == n - 1);
            let (p, q) = (edge(i), edge(k));
            if neighbours {
                // Neighbours share a corner: they overlap only if one folds back onto the other.
                let (one, other) = if k == i + 1 { (p.0 - p.1, q.1 - q.0) } else { (q.0 - q.1, p.1 - p.0) };
                if one.cross(other) == 0.0 && one.dot(other) > 0.0 {
                    return Some((i, k));
                }
            } else if segments_meet(p, q) {
                return Some((i, k));
            }
        }
    }
    None
}

fn segments_meet((a, b): (Point, Point), (c, d): (Point, Point)) -> bool {
    let side = |p: Point, q: Point, r: Point| (q - p).cross(r - p);
    let within = |p: Point, q: Point, r: Point| (r - p).dot(r - q) <= 0.0;
    let (s1, s2, s3, s4) = (side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b));
    (s1 * s2 < 0.0 && s3 * s4 < 0.0)
        || (s1 == 0.0 && within(a, b, c))
        || (s2 == 0.0 && within(a, b, d))
        || (s3 == 0.0 && within(c, d, a))
        || (s4 == 0.0 && within(c, d, b))
}

fn edges(points: &[Point]) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
    (0..points.len()).map(|i| (points[i].to_vec(), points[(i + 1) % points.len()].to_vec()))
}

/// Signed area of a simple polygon (m2), negative if its corners are clockwise.
pub fn polygon_area_m2(points: &[Point]) -> f64 {
    edges(points).map(|(p, q)| p.cross(q)).sum::<f64>() / 2.0
}

/// Centroid of the area of a simple polygon.
pub fn polygon_centroid(points: &[Point]) -> Point {
    let sum = edges(points).fold(Vec2::ZERO, |sum, (p, q)| sum + (p + q) * p.cross(q));
    Point::ORIGIN + sum / (6.0 * polygon_area_m2(points))
}

/// Radius of gyration of the area of a simple polygon about the origin (m, Green's theorem).
fn polygon_radius_of_gyration_m(points: &[Point]) -> f64 {
    let polar = edges(points).map(|(p, q)| p.cross(q) * (p.dot(p) + p.dot(q) + q.dot(q))).sum::<f64>() / 12.0;
    (polar / polygon_area_m2(points)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(points: &[[f64; 2]]) -> Shape {
        Shape::Polygon { points_m: points.iter().map(|&p| p.into()).collect() }
    }

    #[test]
    fn the_mean_arm_of_a_square_is_0_3826_of_its_side() {
        let arm = Shape::Rectangle { size_m: [1.0, 1.0] }.mean_arm_m();
        let exact = (2f64.sqrt() + 1f64.asinh()) / 6.0;
        assert!((arm - exact).abs() < 1e-12, "{arm}, not {exact}");
    }

    #[test]
    fn a_rectangle_written_as_a_polygon_has_the_same_inertia() {
        let rectangle = Shape::Rectangle { size_m: [0.06, 0.02] };
        let same = polygon(&[[-0.03, -0.01], [0.03, -0.01], [0.03, 0.01], [-0.03, 0.01]]);
        assert!((rectangle.radius_of_gyration_m() - same.radius_of_gyration_m()).abs() < 1e-15);
        assert!((rectangle.area_m2() - same.area_m2()).abs() < 1e-15);
    }

    #[test]
    fn the_origin_of_a_polygon_moves_to_its_centroid() {
        let mut shape = polygon(&[[0.0, 0.0], [0.06, 0.0], [0.0, 0.03]]);
        let shift = shape.check_and_centre("object `t`").expect("a triangle");
        assert!((shift - Vec2::new(0.02, 0.01)).length() < 1e-12, "{shift:?}");
        assert!(polygon_centroid(&shape.corners()).to_vec().length() < 1e-12);
    }

    #[test]
    fn invalid_outlines_are_rejected_by_name() {
        for (mut shape, word) in [
            (polygon(&[[0.0, 0.0], [0.1, 0.1], [0.1, 0.0], [0.0, 0.1]]), "self-crossing"),
            (polygon(&[[0.0, 0.0], [0.0, 0.1], [0.1, 0.0]]), "clockwise"),
            (polygon(&[[0.0, 0.0], [0.1, 0.0], [0.2, 0.0]]), "self-crossing"),
            (polygon(&[[0.0, 0.0], [f64::NAN, 0.0], [0.2, 0.1]]), "not a number"),
            (Shape::Disc { radius_m: -0.01 }, "-0.01"),
            (Shape::Rectangle { size_m: [0.1, f64::NAN] }, "NaN"),
        ] {
            let message = shape.check_and_centre("object `x`").expect_err("must be rejected").to_string();
            assert!(message.contains("object `x`") && message.contains(word), "{message}");
        }
    }

    #[test]
    fn invalid_markers_are_rejected_by_name() {
        let marker = |text: &str| {
            let shape = Shape::Disc { radius_m: 0.04 };
            let marker = toml::from_str(text).expect("a marker");
            let mut object = Object {
                name: "a".into(),
                shape,
                height_m: 0.03,
                marker: Some(marker),
                mass_kg: None,
                support: None,
            };
            object.check().map_err(|e| e.to_string())
        };
        let disc = "shape = { disc = { radius_m = 0.01 } }\n";
        for radius_m in [0.005, 0.01] {
            let dot = format!("{disc}dot = {{ radius_m = {radius_m}, at_m = [0.021, 0.0] }}");
            assert_eq!(marker(&dot), Ok(None), "{dot}");
        }
        for (text, word) in [
            (format!("{disc}dot = {{ radius_m = 0.009, at_m = [0.02, 0.0] }}"), "taken for the disc"),
            (format!("{disc}dot = {{ radius_m = 0.005, at_m = [0.012, 0.0] }}"), "do not touch"),
            (format!("{disc}thickness_m = -0.001"), "zero or more"),
            (format!("{disc}dot = {{ radius_m = -0.005, at_m = [0.02, 0.0] }}"), "-0.005"),
            (format!("{disc}dot = {{ radius_m = 0.005, at_m = [nan, 0.0] }}"), "not a number"),
            (
                "shape = { rectangle = { size_m = [0.02, 0.01] } }\ndot = { radius_m = 0.003, at_m = [0.02, 0.0] }".into(),
                "no disc",
            ),
        ] {
            let message = marker(&text).expect_err("must be rejected");
            assert!(message.contains("object `a`") && message.contains(word), "{message}");
        }
    }

    #[test]
    fn the_symmetry_of_a_square_is_a_quarter_turn_and_of_a_triangle_a_third() {
        let square = Shape::Rectangle { size_m: [0.04, 0.04] };
        assert!(
            (square.rotation_symmetry_rad().expect("a square") - std::f64::consts::FRAC_PI_2).abs() < 1e-9
        );
        let triangle = polygon(&[[-0.0275, -0.015877], [0.0275, -0.015877], [0.0, 0.031754]]);
        let third = std::f64::consts::TAU / 3.0;
        assert!((triangle.rotation_symmetry_rad().expect("equilateral") - third).abs() < 1e-3);
        assert_eq!(polygon(&[[0.0, 0.0], [0.06, 0.0], [0.0, 0.03]]).rotation_symmetry_rad(), None);
    }
}
