//! How is a concave outline decomposed into convex parts?
//!
//! Hertel and Mehlhorn, "Fast triangulation of simple polygons" (1983): triangulate, then remove every diagonal that no
//! concave corner needs.  The result has at most four times as many parts as the best decomposition.

use crate::geometry::Point;

/// Convex parts, each counter-clockwise, whose union is a simple counter-clockwise polygon.
pub(crate) fn convex_parts(corners: &[Point]) -> Vec<Vec<Point>> {
    let corners = without_straight_corners(corners);
    if is_convex(&corners) {
        return vec![corners];
    }
    let mut parts = triangles(corners);
    while let Some((i, k, joined)) = first_convex_pair(&parts) {
        parts[i] = joined;
        parts.swap_remove(k);
    }
    parts
}

/// Cross product of the edges at corner `b` (m2): positive where the outline is convex (counter-clockwise).
fn corner_cross_m2(a: Point, b: Point, c: Point) -> f64 {
    (b - a).cross(c - b)
}

/// The corners without those on straight sides, which would add edges that no contact needs.
fn without_straight_corners(corners: &[Point]) -> Vec<Point> {
    let n = corners.len();
    let is_corner = |k: usize| {
        let (a, b, c) = (corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]);
        corner_cross_m2(a, b, c).abs() > STRAIGHT_SINE * (b - a).length() * (c - b).length()
    };
    (0..n).filter(|&k| is_corner(k)).map(|k| corners[k]).collect()
}

/// Sine of the smallest angle that makes a corner.
const STRAIGHT_SINE: f64 = 1e-9;

fn is_convex(corners: &[Point]) -> bool {
    let n = corners.len();
    (0..n).all(|k| corner_cross_m2(corners[k], corners[(k + 1) % n], corners[(k + 2) % n]) >= 0.0)
}

/// Triangles of a simple polygon, by ear clipping.
fn triangles(mut corners: Vec<Point>) -> Vec<Vec<Point>> {
    let mut found = Vec::new();
    while corners.len() > 3 {
        let n = corners.len();
        // A simple polygon always has an ear; the fallback ends the loop if rounding hides it.
        let ear = (0..n).find(|&k| is_ear(&corners, k)).unwrap_or(0);
        found.push(vec![corners[(ear + n - 1) % n], corners[ear], corners[(ear + 1) % n]]);
        corners.remove(ear);
    }
    found.push(corners);
    found
}

fn is_ear(corners: &[Point], k: usize) -> bool {
    let n = corners.len();
    let (a, b, c) = (corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]);
    let inside = |p: &Point| {
        corner_cross_m2(a, b, *p) >= 0.0
            && corner_cross_m2(b, c, *p) >= 0.0
            && corner_cross_m2(c, a, *p) >= 0.0
    };
    corner_cross_m2(a, b, c) > 0.0 && !corners.iter().any(|p| *p != a && *p != b && *p != c && inside(p))
}

/// The first two parts whose union is convex, and that union.
fn first_convex_pair(parts: &[Vec<Point>]) -> Option<(usize, usize, Vec<Point>)> {
    for i in 0..parts.len() {
        for k in i + 1..parts.len() {
            if let Some(joined) = joined(&parts[i], &parts[k])
                && is_convex(&joined)
            {
                return Some((i, k, joined));
            }
        }
    }
    None
}

/// The union of two polygons with a common edge; none if they have none.
fn joined(one: &[Point], other: &[Point]) -> Option<Vec<Point>> {
    let (n, m) = (one.len(), other.len());
    for i in 0..n {
        for k in 0..m {
            if one[i] == other[(k + 1) % m] && one[(i + 1) % n] == other[k] {
                let from_one = (1..=n).map(|s| one[(i + s) % n]);
                let from_other = (2..m).map(|s| other[(k + s) % m]);
                return Some(from_one.chain(from_other).collect());
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::polygon_area_m2;

    fn points(list: &[[f64; 2]]) -> Vec<Point> {
        list.iter().map(|&p| p.into()).collect()
    }

    #[test]
    fn the_parts_of_a_concave_outline_are_convex_and_cover_it() {
        for outline in [
            points(&[[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 3.], [0., 3.]]),
            points(&[[0., 0.], [1., 2.], [2., 0.], [2., 3.], [1., 2.5], [0., 3.]]),
            points(&[[0., 0.], [4., 0.], [4., 4.], [3., 4.], [3., 1.], [1., 1.], [1., 4.], [0., 4.]]),
        ] {
            let parts = convex_parts(&outline);
            assert!(parts.iter().all(|p| is_convex(p)), "{parts:?}");
            let covered: f64 = parts.iter().map(|p| polygon_area_m2(p)).sum();
            assert!((covered - polygon_area_m2(&outline)).abs() < 1e-12, "{covered} m2");
        }
    }

    #[test]
    fn a_corner_on_a_straight_side_is_removed() {
        let square = points(&[[0., 0.], [1., 0.], [2., 0.], [2., 2.], [0., 2.]]);
        assert_eq!(convex_parts(&square), vec![points(&[[0., 0.], [2., 0.], [2., 2.], [0., 2.]])]);
    }
}
