//! The distortion models and their inverses.
//!
//! With r² = x² + y² Brown's models map a ray (x, y) to (x R + 2 p1 x y + p2 (r² + 2 x²), y R + p1 (r² + 2 y²) + 2 p2 x y), where
//! R = 1 + k1 r² + k2 r⁴ + k3 r⁶, in the rational model divided by 1 + k4 r² + k5 r⁴ + k6 r⁶ (Brown, 1966; OpenCV's `calib3d`).
//! The equidistant model maps the angle θ = atan r to θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸), the length of the distorted ray
//! (Kannala and Brandt, 2006).

use crate::cell::Distortion;

/// The longest ray that a model represents: 84 degrees off the axis.
const LONGEST_RAY: f64 = 10.0;
/// Largest number of Newton steps from the distorted ray; four are enough where the distortion is weak.
const MOST_STEPS: usize = 30;
/// Length of a Newton step that is below the rounding of a pixel coordinate.
const CONVERGED: f64 = 1e-13;
/// Largest difference of the distorted ray of a solution: rounding, where the distortion is steep.
const SAME_RAY: f64 = 1e-14;
/// Number of tested lengths of rays up to the longest.
const TESTED_LENGTHS: u32 = 4096;
/// Number of halvings after which an interval of lengths is below the rounding.
const HALVINGS: usize = 60;

/// The ray as a pinhole camera would need it to show the same pixel.
pub(super) fn distorted(distortion: &Distortion, [x, y]: [f64; 2]) -> [f64; 2] {
    let r2 = x * x + y * y;
    let [p1, p2] = match distortion {
        Distortion::PlumbBob([_, _, p1, p2, ..]) | Distortion::RationalPolynomial([_, _, p1, p2, ..]) => {
            [*p1, *p2]
        }
        Distortion::Equidistant(k) => {
            let r = r2.sqrt();
            let factor = if r > 0.0 { distorted_angle(k, r.atan()).0 / r } else { 1.0 };
            return [x * factor, y * factor];
        }
    };
    let (radial, _) = radial(distortion, r2);
    [
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    ]
}

/// The ray that a model distorts to the given one, no longer than the square root of `max_ray_squared`.
pub(super) fn undistorted(
    distortion: &Distortion,
    [xd, yd]: [f64; 2],
    max_ray_squared: f64,
) -> Option<[f64; 2]> {
    let inside = |[x, y]: [f64; 2]| x * x + y * y <= max_ray_squared;
    match distortion {
        Distortion::Equidistant(k) => undistorted_angle(k, [xd, yd], max_ray_squared),
        Distortion::PlumbBob(k) if *k == [0.0; 5] => Some([xd, yd]).filter(|ray| inside(*ray)),
        _ => newton(distortion, [xd, yd], [xd, yd]).filter(|ray| inside(*ray)).or_else(|| {
            let start = radial_start(distortion, [xd, yd], max_ray_squared);
            newton(distortion, [xd, yd], start).filter(|ray| inside(*ray))
        }),
    }
}

/// R of Brown's models at r², and twice its derivative by r²: its derivative by x is x times that.
fn radial(distortion: &Distortion, r2: f64) -> (f64, f64) {
    let polynomial = |[k1, k2, k3]: [f64; 3]| {
        (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3)), 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3)))
    };
    match *distortion {
        Distortion::PlumbBob([k1, k2, _, _, k3]) => polynomial([k1, k2, k3]),
        Distortion::RationalPolynomial([k1, k2, _, _, k3, k4, k5, k6]) => {
            let (above, slope_above) = polynomial([k1, k2, k3]);
            let (below, slope_below) = polynomial([k4, k5, k6]);
            let radial = above / below;
            (radial, (slope_above - radial * slope_below) / below)
        }
        Distortion::Equidistant(_) => (1.0, 0.0),
    }
}

/// Newton's method for Brown's models.
fn newton(distortion: &Distortion, [xd, yd]: [f64; 2], start: [f64; 2]) -> Option<[f64; 2]> {
    let (Distortion::PlumbBob([_, _, p1, p2, ..]) | Distortion::RationalPolynomial([_, _, p1, p2, ..])) =
        *distortion
    else {
        return None;
    };
    let [mut x, mut y] = start;
    for _ in 0..MOST_STEPS {
        let [fx, fy] = distorted(distortion, [x, y]);
        let (radial, slope) = radial(distortion, x * x + y * y);
        let xx = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x;
        let yy = radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x;
        let xy = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y;
        let determinant = xx * yy - xy * xy;
        let (ex, ey) = (fx - xd, fy - yd);
        let (dx, dy) = ((yy * ex - xy * ey) / determinant, (xx * ey - xy * ex) / determinant);
        (x, y) = (x - dx, y - dy);
        if dx.abs() + dy.abs() < CONVERGED {
            return Some([x, y]);
        }
    }
    let [fx, fy] = distorted(distortion, [x, y]);
    ((fx - xd).abs() + (fy - yd).abs() < SAME_RAY).then_some([x, y])
}

/// The start of a second attempt where Newton's method leaves the range: the ray that the radial part alone maps there.
fn radial_start(distortion: &Distortion, [xd, yd]: [f64; 2], max_ray_squared: f64) -> [f64; 2] {
    let wanted = xd.hypot(yd);
    let (mut low, mut high) = (0.0, max_ray_squared.sqrt());
    for _ in 0..HALVINGS {
        let middle: f64 = 0.5 * (low + high);
        if middle * radial(distortion, middle * middle).0 < wanted { low = middle } else { high = middle }
    }
    let factor = if wanted > 0.0 { low / wanted } else { 1.0 };
    [xd * factor, yd * factor]
}

/// The distorted angle and its derivative by the angle.
fn distorted_angle([k1, k2, k3, k4]: &[f64; 4], angle: f64) -> (f64, f64) {
    let u = angle * angle;
    let value = angle * (1.0 + u * (k1 + u * (k2 + u * (k3 + u * k4))));
    (value, 1.0 + u * (3.0 * k1 + u * (5.0 * k2 + u * (7.0 * k3 + u * 9.0 * k4))))
}

/// The inverse of the equidistant model: Newton's method within an interval that always holds the angle.
fn undistorted_angle(k: &[f64; 4], [xd, yd]: [f64; 2], max_ray_squared: f64) -> Option<[f64; 2]> {
    let wanted = xd.hypot(yd);
    if wanted == 0.0 {
        return Some([xd, yd]);
    }
    let (mut low, mut high) = (0.0, max_ray_squared.sqrt().atan());
    if distorted_angle(k, high).0 < wanted || !wanted.is_finite() {
        return None;
    }
    let mut angle: f64 = wanted.min(high);
    for _ in 0..MOST_STEPS + HALVINGS {
        let (value, slope) = distorted_angle(k, angle);
        if value < wanted {
            low = angle;
        } else {
            high = angle;
        }
        let step = (value - wanted) / slope;
        let next = angle - step;
        // Written so that a step that is no number halves the interval.
        let next = if next >= low && next <= high { next } else { 0.5 * (low + high) };
        let done = (next - angle).abs() < 1e-16 * (1.0 + angle);
        angle = next;
        if done {
            break;
        }
    }
    let factor = angle.tan() / wanted;
    Some([xd * factor, yd * factor])
}

/// The square of the greatest ray length up to which the length of the distorted ray grows with that of the ray, in
/// steps of a [`TESTED_LENGTHS`]-th of the longest.
pub(super) fn max_ray_squared(distortion: &Distortion) -> f64 {
    let grows = |length: f64| {
        let u = length * length;
        match *distortion {
            Distortion::PlumbBob([k1, k2, _, _, k3]) => {
                1.0 + u * (3.0 * k1 + u * (5.0 * k2 + u * 7.0 * k3)) > 0.0
            }
            Distortion::RationalPolynomial([.., k4, k5, k6]) => {
                // The derivative of r R(r²) is R + 2 r² R'; the denominator has no root before.
                let (radial, slope) = radial(distortion, u);
                1.0 + u * (k4 + u * (k5 + u * k6)) > 0.0 && radial > 0.0 && radial + u * slope > 0.0
            }
            Distortion::Equidistant(k) => distorted_angle(&k, length.atan()).1 > 0.0,
        }
    };
    let length = |k: u32| LONGEST_RAY * f64::from(k) / f64::from(TESTED_LENGTHS);
    // Polynomials of a low degree have few roots: fine steps of the ray's length find the first one.
    let fold = (1..=TESTED_LENGTHS).find(|&k| !grows(length(k)));
    let longest = fold.map_or(LONGEST_RAY, |k| length(k - 1));
    longest * longest
}

/// Whether a distortion is one to one for all rays that are represented.
pub(super) fn holds_to_the_longest_ray(max_ray_squared: f64) -> bool {
    max_ray_squared >= LONGEST_RAY * LONGEST_RAY
}
