//! How is a concave outline cut into convex parts?
//!
//! Hertel and Mehlhorn, "Fast triangulation of simple polygons" (1983): triangulate, then take away every diagonal
//! that no concave corner needs; at most four times as many parts as the best cut has.

use crate::geometry::Point;

/// Convex parts that together cover a simple counter-clockwise polygon, each counter-clockwise.
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

/// How far the way turns left at `b` (m2).
fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b - a).cross(c - b)
}

/// Corners that do not turn add edges that no contact needs.
fn without_straight_corners(corners: &[Point]) -> Vec<Point> {
    let n = corners.len();
    let bends = |k: usize| {
        let (a, b, c) = (corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]);
        turn(a, b, c).abs() > STRAIGHT * (b - a).length() * (c - b).length()
    };
    (0..n).filter(|&k| bends(k)).map(|k| corners[k]).collect()
}

/// The sine of the smallest turn that counts as a corner.
const STRAIGHT: f64 = 1e-9;

fn is_convex(corners: &[Point]) -> bool {
    let n = corners.len();
    (0..n).all(|k| turn(corners[k], corners[(k + 1) % n], corners[(k + 2) % n]) >= 0.0)
}

/// Ear clipping.
fn triangles(mut corners: Vec<Point>) -> Vec<Vec<Point>> {
    let mut found = Vec::new();
    while corners.len() > 3 {
        let n = corners.len();
        // A simple polygon always has an ear; the fallback only keeps rounding from looping for ever.
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
    let inside = |p: &Point| turn(a, b, *p) >= 0.0 && turn(b, c, *p) >= 0.0 && turn(c, a, *p) >= 0.0;
    turn(a, b, c) > 0.0 && !corners.iter().any(|p| *p != a && *p != b && *p != c && inside(p))
}

/// Two parts that share an edge and stay convex without it.
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

/// Two polygons as one, if they share an edge.
fn joined(one: &[Point], other: &[Point]) -> Option<Vec<Point>> {
    let (n, m) = (one.len(), other.len());
    for i in 0..n {
        for k in 0..m {
            if one[i] == other[(k + 1) % m] && one[(i + 1) % n] == other[k] {
                let mine = (1..=n).map(|s| one[(i + s) % n]);
                let yours = (2..m).map(|s| other[(k + s) % m]);
                return Some(mine.chain(yours).collect());
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
    fn a_corner_on_a_straight_side_is_left_out() {
        let square = points(&[[0., 0.], [1., 0.], [2., 0.], [2., 2.], [0., 2.]]);
        assert_eq!(convex_parts(&square), vec![points(&[[0., 0.], [2., 0.], [2., 2.], [0., 2.]])]);
    }
}
