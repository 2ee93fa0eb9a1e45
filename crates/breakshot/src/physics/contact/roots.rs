//! At which time does a polynomial first decrease to zero?

/// A polynomial of degree at most four, the constant first.
pub(crate) type Quartic = [f64; 5];

fn value(c: &Quartic, x: f64) -> f64 {
    c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * c[4])))
}

fn slope(c: &Quartic, x: f64) -> f64 {
    c[1] + x * (2.0 * c[2] + x * (3.0 * c[3] + x * (4.0 * c[4])))
}

fn curvature(c: &Quartic, x: f64) -> f64 {
    2.0 * c[2] + x * (6.0 * c[3] + x * (12.0 * c[4]))
}

/// The first x in `[0, end]` at which a polynomial that is positive or zero at 0 crosses zero downwards.
///
/// With m the least second derivative from x to the end, `f + f' t + m t^2 / 2` is a lower bound of the polynomial: its
/// first root is a step that passes no crossing.  Most searches end with the first step; near a crossing the steps converge
/// quadratically.
pub(crate) fn first_crossing(c: &Quartic, end: f64) -> Option<f64> {
    let flattest = if c[4] > 0.0 { -0.25 * c[3] / c[4] } else { end };
    let at_end = curvature(c, end);
    let mut x = 0.0;
    for _ in 0..MAX_STEPS {
        let (y, dy) = (value(c, x).max(0.0), slope(c, x));
        let inside = if flattest > x && flattest < end { curvature(c, flattest) } else { at_end };
        let curvature_bound = curvature(c, x).min(inside).min(at_end);
        let step = if dy < 0.0 {
            let square = dy * dy - 2.0 * curvature_bound * y;
            if square < 0.0 {
                return None;
            }
            2.0 * y / (square.sqrt() - dy)
        } else if curvature_bound < 0.0 {
            (dy + (dy * dy - 2.0 * curvature_bound * y).sqrt()) / -curvature_bound
        } else {
            return None;
        };
        if step > end - x {
            return None;
        }
        if x + step <= x {
            return Some(x);
        }
        x += step;
    }
    Some(x)
}

/// Near a double root (a grazing contact) each step at least halves the distance: full precision takes about fifty.
const MAX_STEPS: usize = 100;

#[cfg(test)]
mod tests {
    use super::*;

    fn expanded(roots: [f64; 4], scale: f64) -> Quartic {
        let mut c = [scale, 0.0, 0.0, 0.0, 0.0];
        for root in roots {
            for k in (0..5).rev() {
                c[k] = if k > 0 { c[k - 1] } else { 0.0 } - root * c[k];
            }
        }
        c
    }

    #[test]
    fn the_first_crossing_is_the_smallest_root_from_above() {
        for (roots, scale, expected) in [
            ([0.1, 0.2, 0.5, 0.9], 1.0, 0.1),
            ([-0.4, 0.2, 0.5, 0.9], -1.0, 0.2),
            ([-0.4, -0.3, 0.5, 0.6], 1.0, 0.5),
            ([-0.4, -0.3, -0.2, 0.6], -1.0, 0.6),
        ] {
            let c = expanded(roots, scale);
            let found = first_crossing(&c, 1.0).expect("a crossing");
            assert!((found - expected).abs() < 1e-12, "{roots:?}: {found}, not {expected}");
        }
    }

    #[test]
    fn a_polynomial_that_stays_positive_never_crosses() {
        assert_eq!(first_crossing(&[1.0, -1.0, 1.0, 0.0, 0.0], 10.0), None);
        assert_eq!(first_crossing(&expanded([2.0, 3.0, 4.0, 5.0], 1.0), 1.0), None);
    }
}
