//! The simplest outline that fits points of its border within their noise.

use crate::geometry::{Point, Pose, Vec2, half_turn_wrapped_rad};
use crate::object::Shape;
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, median};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{FRAC_PI_2, PI};

/// An outline at its pose.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    pub shape: Shape,
    pub pose: Pose,
    /// Root mean square distance of the points from the outline (m), that of outliers bounded.
    pub rms_m: f64,
    /// Whether the outline fits within the noise.
    pub fits: bool,
    /// The fraction of the outline on which an edge was measured.
    pub visible_fraction: f64,
}

/// Largest number of corners.
const MOST_CORNERS: usize = 12;
/// Rounds of the robust fits, and the distance of an outlier in standard deviations (Tukey's biweight).
const ROUNDS: usize = 8;
const OUTLIER_STDS: f64 = 4.0;
/// Least scatter of the points, and largest rms distance of an outline that fits (px).
const LEAST_SCATTER_PX: f64 = 0.05;
const FITS_PX: f64 = 0.6;
/// So much of an outline must fit.
const LEAST_FITTING: f64 = 0.85;
/// Distance of a corner from the chord of its neighbours (px), and distance from the corners within which points are rounded (px).
const CORNER_PX: f64 = 1.5;
const ROUNDED_PX: f64 = 2.5;
/// Shorter sides are rounded corners (px).
const SHORT_PX: f64 = 8.0;
/// Sides whose directions differ by less are one (rad).
const ONE_SIDE_RAD: f64 = 0.14;
/// A rectangle's points are at most this factor as far off as those of a free quadrilateral.
const RECTANGLE_FACTOR: f64 = 1.2;

/// A measured point of a border.
#[derive(Clone, Copy, Debug)]
pub(super) struct BorderPoint {
    pub at: Point,
    /// Weight in a fit, 0 to 1.
    pub weight: f64,
}

/// Disc and polygon (or rectangle) nearest to a border in counter-clockwise order; `pixel_m` is the side of a pixel.
pub(super) fn fitted(border: &[BorderPoint], pixel_m: f64) -> Vec<Fitted> {
    const LEAST_POINTS: usize = 12;
    if border.len() < LEAST_POINTS {
        return Vec::new();
    }
    let points: Vec<Point> = border.iter().map(|point| point.at).collect();
    let corners = joined(without_short_sides(joined(reduced(&points, CORNER_PX * pixel_m)), pixel_m));
    let polygon = polygon(border, corners, pixel_m).and_then(|first| refitted(&first, border, pixel_m));
    disc(border, pixel_m).into_iter().chain(polygon).collect()
}

/// An outline of the same kind and number of corners nearest to other points of its border.
pub(super) fn refitted(fit: &Fitted, border: &[BorderPoint], pixel_m: f64) -> Option<Fitted> {
    if matches!(fit.shape, Shape::Disc { .. }) {
        disc(border, pixel_m)
    } else {
        polygon(border, fit.placed_corners(), pixel_m)
    }
}

impl Fitted {
    /// Number of numbers that the form needs, about: a disc before a rectangle before polygons.
    pub(super) fn complexity(&self) -> usize {
        match &self.shape {
            Shape::Disc { .. } => 1,
            Shape::Rectangle { .. } => 2,
            Shape::Polygon { points_m } => points_m.len(),
        }
    }

    /// The corners on the table's plane; none of a disc.
    fn placed_corners(&self) -> Vec<Point> {
        self.shape.corners().into_iter().map(|corner| self.pose.table_from_body(corner)).collect()
    }

    /// The polygon without one of its sides: its neighbours meet in a corner that is at most `most_m` off the side; `None` if they do not, or for a shape without sides to spare.
    pub(super) fn without_side(&self, k: usize, most_m: f64) -> Option<Self> {
        let mut corners = self.placed_corners();
        let n = corners.len();
        if n <= 3 || k >= n {
            return None;
        }
        let at = |i: usize| corners[(k + n + i) % n];
        let (before, from, to, after) = (at(n - 1), at(0), at(1), at(2));
        let (u, v) = (from - before, to - after);
        let crossing = crossing((before, u), (after, v));
        let near = crossing.is_finite() && segment_distance_m(crossing, from, to) <= most_m;
        let ahead = (crossing - from).dot(u) > 0.0 && (crossing - to).dot(v) > 0.0;
        if !near || !ahead {
            return None;
        }
        corners[k] = crossing;
        corners.remove((k + 1) % n);
        self.with_corners(corners)
    }

    /// The polygon without one of its corners, that is at most `most_m` off the line between its neighbours.
    pub(super) fn without_corner(&self, k: usize, most_m: f64) -> Option<Self> {
        let mut corners = self.placed_corners();
        let n = corners.len();
        if n <= 3 || k >= n {
            return None;
        }
        if segment_distance_m(corners[k], corners[(k + n - 1) % n], corners[(k + 1) % n]) > most_m {
            return None;
        }
        corners.remove(k);
        self.with_corners(corners)
    }

    /// The outline with every point moved; a disc stays one.
    pub(super) fn mapped(&self, map: impl Fn(Point) -> Point) -> Option<Self> {
        let Shape::Disc { radius_m } = self.shape else {
            return self.with_corners(self.placed_corners().into_iter().map(map).collect());
        };
        let center = map(self.pose.position);
        let radius_m = map(self.pose.position + Vec2::new(radius_m, 0.0)).distance(center);
        let pose = Pose { position: center, yaw_rad: 0.0 };
        (center.is_finite() && radius_m.is_finite()).then(|| Self {
            shape: Shape::Disc { radius_m },
            pose,
            ..self.clone()
        })
    }

    fn with_corners(&self, corners: Vec<Point>) -> Option<Self> {
        let mut shape = Shape::Polygon { points_m: corners };
        let position = Point::ORIGIN + shape.check_and_centre("an outline").ok()?;
        Some(Self { shape, pose: Pose { position, yaw_rad: 0.0 }, ..self.clone() })
    }
}

/// The outline that is nearest to its points for its number of corners: a polygon of many corners fits every disc. Within the scatter
/// of the points (`pixel_m` is the side of a pixel) outlines are equally near.
pub(super) fn simplest(fits: Vec<Fitted>, pixel_m: f64) -> Option<Fitted> {
    const PER_CORNER: f64 = 0.1;
    let least_m = LEAST_SCATTER_PX * pixel_m;
    let cost = |fit: &Fitted| fit.rms_m.max(least_m) * (1.0 + PER_CORNER * fit.complexity() as f64);
    fits.into_iter().min_by(|a, b| b.fits.cmp(&a.fits).then(cost(a).total_cmp(&cost(b))))
}

/// The weighted rms of residuals, those of outliers bounded, and whether they are those of an outline that fits.
fn judged(residuals_m: &[f64], border: &[BorderPoint], pixel_m: f64) -> (f64, bool) {
    let limit_m = FITS_PX * pixel_m;
    let far_m = OUTLIER_STDS * limit_m;
    let mean_square = |most_m: f64| {
        let near = residuals_m.iter().zip(border).filter(|(r, _)| r.abs() < most_m);
        let (sum, total) = near.fold((0.0, 0.0), |(sum, total), (r, point)| {
            (sum + point.weight * r.abs().min(far_m).powi(2), total + point.weight)
        });
        sum / total
    };
    let near = residuals_m.iter().filter(|r| r.abs() < far_m).count();
    let fits =
        near as f64 >= LEAST_FITTING * residuals_m.len() as f64 && mean_square(far_m).sqrt() <= limit_m;
    (mean_square(f64::INFINITY).sqrt(), fits)
}

/// Tukey's weights of residuals.
fn weights(residuals_m: &[f64], pixel_m: f64) -> Vec<f64> {
    let middle_m = median(residuals_m.iter().map(|r| r.abs())).unwrap_or(0.0);
    let limit_m = OUTLIER_STDS * (STD_OVER_MEDIAN_ABSOLUTE * middle_m).max(LEAST_SCATTER_PX * pixel_m);
    residuals_m.iter().map(|r| (1.0 - (r / limit_m).powi(2)).max(0.0).powi(2)).collect()
}

fn disc(border: &[BorderPoint], pixel_m: f64) -> Option<Fitted> {
    let points: Vec<Point> = border.iter().map(|point| point.at).collect();
    let sum = points.iter().fold(Vec2::ZERO, |sum, point| sum + point.to_vec());
    let mut center = Point::ORIGIN + sum * (1.0 / points.len() as f64);
    let mut radius_m = median(points.iter().map(|point| point.distance(center)))?;
    let residuals = |center: Point, radius_m: f64| -> Vec<f64> {
        points.iter().map(|point| point.distance(center) - radius_m).collect()
    };
    for _ in 0..ROUNDS {
        let off_m = residuals(center, radius_m);
        let (mut matrix, mut side) = (Matrix3::zeros(), Vector3::zeros());
        for ((point, off_m), robust) in border.iter().zip(&off_m).zip(weights(&off_m, pixel_m)) {
            let Some(out) = (point.at - center).direction() else { continue };
            let weight = point.weight * robust;
            let row = Vector3::new(out.x, out.y, 1.0);
            matrix += row * row.transpose() * weight;
            side += row * (weight * off_m);
        }
        let change = matrix.try_inverse()? * side;
        center += Vec2::new(change.x, change.y);
        radius_m += change.z;
    }
    let (rms_m, fits) = judged(&residuals(center, radius_m), border, pixel_m);
    let sane = center.is_finite() && radius_m.is_finite() && radius_m > pixel_m;
    let pose = Pose { position: center, yaw_rad: 0.0 };
    sane.then_some(Fitted { shape: Shape::Disc { radius_m }, pose, rms_m, fits, visible_fraction: 1.0 })
}

/// A straight line: a point on it and its direction, a unit vector.
type Line = (Point, Vec2);

/// The polygon with sides near those between given corners, or a rectangle if that fits as well.
fn polygon(border: &[BorderPoint], corners: Vec<Point>, pixel_m: f64) -> Option<Fitted> {
    if !(3..=MOST_CORNERS).contains(&corners.len()) {
        return None;
    }
    let corners = crossings(&lines(&sides(border, &corners, pixel_m), &corners, pixel_m)?)?;
    let (rms_m, fits) = judged(&border_distances_m(border, &corners), border, pixel_m);
    if corners.len() == 4
        && let Some(rectangle) = rectangle(border, &corners, pixel_m)
        && rectangle.rms_m <= (RECTANGLE_FACTOR * rms_m).max(LEAST_SCATTER_PX * pixel_m)
    {
        return Some(rectangle);
    }
    let mut shape = Shape::Polygon { points_m: corners };
    let position = Point::ORIGIN + shape.check_and_centre("an outline").ok()?;
    Some(Fitted { shape, pose: Pose { position, yaw_rad: 0.0 }, rms_m, fits, visible_fraction: 1.0 })
}

/// The rectangle near a quadrilateral; its longer side is along its x.
fn rectangle(border: &[BorderPoint], corners: &[Point], pixel_m: f64) -> Option<Fitted> {
    const RIGHT_ANGLE_RAD: f64 = 0.05;
    let sides = sides(border, corners, pixel_m);
    let lines = lines(&sides, corners, pixel_m)?;
    let first_rad = lines[0].1.heading_rad();
    // The directions modulo a right angle, the longer sides with more weight
    let (mut sum, mut total) = (0.0, 0.0);
    for (k, (_, direction)) in lines.iter().enumerate() {
        let turned = half_turn_wrapped_rad(direction.heading_rad() - first_rad - k as f64 * FRAC_PI_2);
        if turned.abs() > RIGHT_ANGLE_RAD {
            return None;
        }
        let weight = (sides[k].len() as f64).powi(3);
        (sum, total) = (sum + weight * turned, total + weight);
    }
    let heading_rad = first_rad + sum / total;
    // The sides' distances along both axes
    let axes = [Vec2::from_heading(heading_rad), Vec2::from_heading(heading_rad + FRAC_PI_2)];
    let offset = |k: usize, axis: Vec2| offset_m(&sides[k], axis);
    let (low, high) = (offset(0, axes[1])?, offset(2, axes[1])?);
    let (right, left) = (offset(1, axes[0])?, offset(3, axes[0])?);
    let center = Point::ORIGIN + axes[0] * (0.5 * (left + right)) + axes[1] * (0.5 * (low + high));
    let (x_m, y_m) = (right - left, high - low);
    let (size_m, yaw_rad) =
        if x_m >= y_m { ([x_m, y_m], heading_rad) } else { ([y_m, x_m], heading_rad + FRAC_PI_2) };
    let shape = Shape::Rectangle { size_m };
    let pose = Pose { position: center, yaw_rad: half_turn_wrapped_rad(yaw_rad) };
    let placed: Vec<Point> = shape.corners().into_iter().map(|corner| pose.table_from_body(corner)).collect();
    let (rms_m, fits) = judged(&border_distances_m(border, &placed), border, pixel_m);
    (x_m > 0.0 && y_m > 0.0).then_some(Fitted { shape, pose, rms_m, fits, visible_fraction: 1.0 })
}

/// The distance of a side along an axis: the weighted median of its points (m).
fn offset_m(side: &[BorderPoint], axis: Vec2) -> Option<f64> {
    let mut offsets: Vec<(f64, f64)> =
        side.iter().map(|point| (point.at.to_vec().dot(axis), point.weight)).collect();
    offsets.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * offsets.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut sum = 0.0;
    offsets
        .into_iter()
        .find(|(_, weight)| {
            sum += weight;
            sum >= half
        })
        .map(|(offset_m, _)| offset_m)
}

/// The corners of a closed line after Ramer (1972), Douglas and Peucker (1973).
fn reduced(points: &[Point], tolerance_m: f64) -> Vec<Point> {
    let far = |from: Point| {
        (0..points.len()).max_by(|&a, &b| points[a].distance(from).total_cmp(&points[b].distance(from)))
    };
    let Some((a, b)) = far(points[0]).and_then(|a| Some((a, far(points[a])?))) else { return Vec::new() };
    let n = points.len();
    let (mut kept, mut open) = (vec![a, b], vec![(a, b), (b, a)]);
    while let Some((from, to)) = open.pop() {
        let length = (to + n - from) % n;
        let off_m = |k: usize| segment_distance_m(points[k % n], points[from], points[to]);
        let worst = (from + 1..from + length).max_by(|&i, &k| off_m(i).total_cmp(&off_m(k)));
        if let Some(worst) = worst.filter(|&worst| off_m(worst) > tolerance_m) {
            kept.push(worst % n);
            open.extend([(from, worst % n), (worst % n, to)]);
        }
    }
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().map(|k| points[k]).collect()
}

/// The corners without those at which the line hardly turns, and without very short sides.
fn joined(mut corners: Vec<Point>) -> Vec<Point> {
    loop {
        let n = corners.len();
        if n <= 3 {
            return corners;
        }
        let turn = |k: usize| {
            let (into, out) = (corners[k] - corners[(k + n - 1) % n], corners[(k + 1) % n] - corners[k]);
            into.cross(out).atan2(into.dot(out)).abs()
        };
        let least = (0..n).min_by(|&a, &b| turn(a).total_cmp(&turn(b)));
        match least.filter(|&k| turn(k) < ONE_SIDE_RAD) {
            Some(k) => corners.remove(k),
            None => return corners,
        };
    }
}

/// The points of each side of a polygon, without those near corners.
fn sides(border: &[BorderPoint], corners: &[Point], pixel_m: f64) -> Vec<Vec<BorderPoint>> {
    let n = corners.len();
    let mut sides = vec![Vec::new(); n];
    for &point in border {
        let off_m = |k: usize| segment_distance_m(point.at, corners[k], corners[(k + 1) % n]);
        let nearest = (0..n).min_by(|&a, &b| off_m(a).total_cmp(&off_m(b)));
        let at_corner = corners.iter().any(|corner| corner.distance(point.at) < ROUNDED_PX * pixel_m);
        if let Some(side) = nearest.filter(|_| !at_corner) {
            sides[side].push(point);
        }
    }
    sides
}

/// The corners with each very short side, the rounding of a corner, replaced by the corner of its neighbours.
fn without_short_sides(mut corners: Vec<Point>, pixel_m: f64) -> Vec<Point> {
    loop {
        let n = corners.len();
        let length_m = |k: usize| corners[k].distance(corners[(k + 1) % n]);
        let shortest = (0..n).min_by(|&a, &b| length_m(a).total_cmp(&length_m(b)));
        let Some(k) = shortest.filter(|&k| n > 3 && length_m(k) < SHORT_PX * pixel_m) else { return corners };
        let at = |i: usize| corners[(k + n + i) % n];
        let (before, from, to, after) = (at(n - 1), at(0), at(1), at(2));
        let crossing = crossing((before, from - before), (after, to - after));
        let near = crossing.is_finite() && crossing.distance(from) < 2.0 * SHORT_PX * pixel_m;
        let corner = if near { crossing } else { from + (to - from) * 0.5 };
        corners[k] = corner;
        corners.remove((k + 1) % n);
    }
}

/// The line through each side, in the direction of the corners.
fn lines(sides: &[Vec<BorderPoint>], corners: &[Point], pixel_m: f64) -> Option<Vec<Line>> {
    let n = corners.len();
    let line = |k: usize| {
        let along = corners[(k + 1) % n] - corners[k];
        // A side without edges stays where it is.
        line(&sides[k], along, pixel_m).or_else(|| Some((corners[k], along.direction()?)))
    };
    (0..n).map(line).collect()
}

/// The line through points by robust total least squares.
fn line(points: &[BorderPoint], along: Vec2, pixel_m: f64) -> Option<Line> {
    let mut weight: Vec<f64> = points.iter().map(|point| point.weight).collect();
    let mut found = None;
    for _ in 0..ROUNDS {
        let total: f64 = weight.iter().sum();
        if points.len() < 3 || total <= 0.0 {
            return None;
        }
        let sum = points.iter().zip(&weight).fold(Vec2::ZERO, |sum, (point, w)| sum + point.at.to_vec() * *w);
        let middle = Point::ORIGIN + sum * (1.0 / total);
        let [mut xx, mut xy, mut yy] = [0.0; 3];
        for (point, w) in points.iter().zip(&weight) {
            let d = point.at - middle;
            (xx, xy, yy) = (xx + w * d.x * d.x, xy + w * d.x * d.y, yy + w * d.y * d.y);
        }
        let mut direction = Vec2::from_heading(0.5 * (2.0 * xy).atan2(xx - yy));
        if direction.dot(along) < 0.0 {
            direction = direction * -1.0;
        }
        let off_m: Vec<f64> = points.iter().map(|point| direction.cross(point.at - middle)).collect();
        let robust = weights(&off_m, pixel_m);
        weight = points.iter().zip(robust).map(|(point, robust)| point.weight * robust).collect();
        found = Some((middle, direction));
    }
    found
}

/// The corner between each line and the one before it.
fn crossings(lines: &[Line]) -> Option<Vec<Point>> {
    let n = lines.len();
    let corner =
        |k: usize| Some(crossing(lines[(k + n - 1) % n], lines[k])).filter(|point| point.is_finite());
    (0..n).map(corner).collect()
}

/// The point where two lines cross; not finite if they are parallel.
fn crossing((p, u): Line, (q, v): Line) -> Point {
    p + u * ((q - p).cross(v) / u.cross(v))
}

/// The distance of each point from the border of a polygon (m).
fn border_distances_m(border: &[BorderPoint], corners: &[Point]) -> Vec<f64> {
    let n = corners.len();
    let off_m = |point: Point, k: usize| segment_distance_m(point, corners[k], corners[(k + 1) % n]);
    border.iter().map(|point| (0..n).map(|k| off_m(point.at, k)).fold(f64::INFINITY, f64::min)).collect()
}

fn segment_distance_m(point: Point, from: Point, to: Point) -> f64 {
    let along = to - from;
    let length2 = along.length_squared();
    let t = if length2 > 0.0 { ((point - from).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
    point.distance(from + along * t)
}

/// An outline with its frame turned by an angle (rad): the border stays where it is.
pub(super) fn turned(fitted: &Fitted, yaw_rad: f64) -> Fitted {
    let by_rad = yaw_rad - fitted.pose.yaw_rad;
    let shape = match &fitted.shape {
        Shape::Disc { .. } => fitted.shape.clone(),
        shape => {
            let points =
                shape.corners().into_iter().map(|corner| Point::ORIGIN + corner.to_vec().rotated(-by_rad));
            Shape::Polygon { points_m: points.collect() }
        }
    };
    let shape = match (&fitted.shape, shape) {
        // By right angles a rectangle stays one.
        (Shape::Rectangle { size_m: [x, y] }, turned) => {
            let quarters = by_rad / FRAC_PI_2;
            let right = (quarters - quarters.round()).abs() * FRAC_PI_2 < RIGHT_RAD;
            let odd = (quarters.round() as i64).rem_euclid(2) == 1;
            if right { Shape::Rectangle { size_m: if odd { [*y, *x] } else { [*x, *y] } } } else { turned }
        }
        (_, turned) => turned,
    };
    let quarter = matches!(shape, Shape::Rectangle { .. });
    let yaw_rad =
        if quarter { fitted.pose.yaw_rad + (by_rad / FRAC_PI_2).round() * FRAC_PI_2 } else { yaw_rad };
    Fitted {
        shape,
        pose: Pose { yaw_rad: (yaw_rad + PI).rem_euclid(2.0 * PI) - PI, ..fitted.pose },
        ..fitted.clone()
    }
}

/// Rotations by less than this from a right angle are errors of a measured marker (rad).
const RIGHT_RAD: f64 = 0.03;
