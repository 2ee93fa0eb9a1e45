//! When does a polynomial first come down to zero?

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

/// The first place in `[0, end]` where the polynomial, positive or zero at first, crosses zero downwards.
///
/// The roots of the second derivative cut the interval where the first is monotone, its roots cut it where the
/// polynomial is monotone, and there Newton's method, held inside the bracket, finds the crossing.
pub(crate) fn first_crossing(c: &Quartic, end: f64) -> Option<f64> {
    if convex(c, end) {
        return first_crossing_convex(c, end);
    }
    let mut cuts = [0.0; 6];
    let mut count = 1;
    let mut left = 0.0;
    let bends = bends(c, end);
    for bend in bends.into_iter().flatten().chain([end]) {
        let (s0, s1) = (slope(c, left), slope(c, bend));
        if (s0 < 0.0) != (s1 < 0.0) {
            cuts[count] = bracketed(|x| (slope(c, x), curvature(c, x)), left, bend);
            count += 1;
        }
        left = bend;
    }
    cuts[count] = end;
    for k in 0..count {
        let (from, to) = (cuts[k], cuts[k + 1]);
        if value(c, to) <= 0.0 && slope(c, 0.5 * (from + to)) < 0.0 {
            return Some(bracketed(|x| (value(c, x), slope(c, x)), from, to));
        }
    }
    None
}

/// Whether the second derivative stays positive on `[0, end]`.
fn convex(c: &Quartic, end: f64) -> bool {
    let lowest = if c[4] > 0.0 { (-c[3] / (4.0 * c[4])).clamp(0.0, end) } else { 0.0 };
    curvature(c, 0.0) > 0.0 && curvature(c, end) > 0.0 && curvature(c, lowest) > 0.0
}

/// On a convex polynomial Newton's method comes from the left and never passes the root.
fn first_crossing_convex(c: &Quartic, end: f64) -> Option<f64> {
    let mut x = 0.0;
    for _ in 0..MAX_STEPS {
        let (y, dy) = (value(c, x), slope(c, x));
        if dy >= 0.0 {
            return None;
        }
        let next = x - y / dy;
        if next > end {
            return None;
        }
        if next <= x {
            return Some(x);
        }
        x = next;
    }
    Some(x)
}

/// The roots of the second derivative inside `(0, end)`, in order.
fn bends(c: &Quartic, end: f64) -> [Option<f64>; 2] {
    let (a, half_b, q) = (12.0 * c[4], 3.0 * c[3], 2.0 * c[2]);
    let discriminant = half_b * half_b - a * q;
    if discriminant < 0.0 {
        return [None, None];
    }
    let sum = -(half_b + half_b.signum() * discriminant.sqrt());
    let inside = |x: f64| (x > 0.0 && x < end).then_some(x);
    let (one, other) = (inside(sum / a), inside(q / sum));
    match (one, other) {
        (Some(p), Some(r)) if p > r => [other, one],
        (None, _) => [other, None],
        _ => [one, other],
    }
}

/// Newton's method held inside a bracket with a change of sign; bisection where it would leave.
fn bracketed(f: impl Fn(f64) -> (f64, f64), from: f64, to: f64) -> f64 {
    let falling = f(from).0 > f(to).0;
    let (mut low, mut high) = (from, to);
    let mut x = 0.5 * (low + high);
    for _ in 0..MAX_STEPS {
        let (y, dy) = f(x);
        if (y > 0.0) == falling {
            low = x;
        } else {
            high = x;
        }
        let newton = x - y / dy;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if next == x || (next - x).abs() < RELATIVE_STEP * (from.abs() + to.abs()) {
            return next;
        }
        x = next;
    }
    x
}

/// Bisection alone needs about 55 steps for all the digits of a number; with Newton's six are common.
const MAX_STEPS: usize = 100;
/// A step below the spacing of numbers cannot improve the root.
const RELATIVE_STEP: f64 = 1e-17;

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
