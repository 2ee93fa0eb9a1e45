//! Which friction force and torque act on a body with a round support that slides and spins?
//!
//! A uniform circular patch of radius R feels `F = mu m g f(eps)` against its velocity and `T = mu m g R t(eps)`
//! against its spin, `eps = v / (R |w|)`: Farkas, Bartels, Unger and Wolf, Phys. Rev. Lett. 90, 248302 (2003).  Any
//! compact support is replaced by the patch whose radius is 1.5 times its mean lever arm (exact for the disc; final positions
//! agree within 0.7 mm for squares, triangles and hexagons).

use std::f64::consts::{FRAC_PI_2, PI};

/// Standard gravity, as the estimates use it (m/s2).
pub const GRAVITY_M_S2: f64 = 9.81;

/// Radius of the uniform disc of equal greatest friction torque, `mu m g (2/3) R`, over the mean lever arm.
pub(crate) const PATCH_RADIUS_PER_ARM: f64 = 1.5;

/// How sliding and spinning affect each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spin {
    /// Coupled by friction on the support: a spinning body slides farther.
    #[default]
    Coupled,
    /// Independent of each other.
    Decoupled,
}

/// `f(eps)` and `t(eps)`: friction force over mu m g, and torque over mu m g R, of a uniform circular patch.
pub(crate) fn patch_force_and_torque(eps: f64) -> [f64; 2] {
    let e2 = eps * eps;
    if eps < SMALL_RATIO {
        return [eps * (1.0 - e2 / 8.0 - e2 * e2 / 64.0), 2.0 / 3.0 - e2 / 2.0 + e2 * e2 * 3.0 / 32.0];
    }
    if eps > 1.0 / SMALL_RATIO {
        let m = 1.0 / e2;
        return [1.0 - m / 8.0 - m * m / 64.0, 0.25 / eps * (1.0 + m / 12.0 + m * m * 3.0 / 128.0)];
    }
    if eps <= 1.0 {
        let (k, e) = elliptic_integrals(e2);
        let force = 4.0 * ((e2 + 1.0) * e - (1.0 - e2) * k) / (3.0 * PI * eps);
        let torque = 4.0 * ((4.0 - 2.0 * e2) * e + (e2 - 1.0) * k) / (9.0 * PI);
        [force, torque]
    } else {
        let (k, e) = elliptic_integrals(1.0 / e2);
        let force = 4.0 * ((e2 + 1.0) * e - (e2 - 1.0) * k) / (3.0 * PI);
        let torque = 4.0 * eps * ((4.0 - 2.0 * e2) * e + (2.0 * e2 - 5.0 + 3.0 / e2) * k) / (9.0 * PI);
        [force, torque]
    }
}

/// Below it (and above its inverse) the series, of error 1e-10, is more precise than the closed form, whose terms cancel.
const SMALL_RATIO: f64 = 1.0 / 30.0;

/// Complete elliptic integrals K and E of the parameter m = k^2, by the arithmetic-geometric mean.
fn elliptic_integrals(m: f64) -> (f64, f64) {
    if m >= 1.0 {
        // K is infinite, but its factor is zero.
        return (0.0, 1.0);
    }
    let (mut a, mut b, mut c) = (1.0, (1.0 - m).sqrt(), m.sqrt());
    let (mut sum, mut power) = (0.5 * c * c, 0.5);
    while c.abs() > f64::EPSILON {
        (a, b, c) = (0.5 * (a + b), (a * b).sqrt(), 0.5 * (a - b));
        power *= 2.0;
        sum += power * c * c;
    }
    let k = FRAC_PI_2 / a;
    (k, k * (1.0 - sum))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Friction of a uniform disc by quadrature over the midpoints of rings and sectors.
    fn by_quadrature(eps: f64) -> [f64; 2] {
        let (rings, sectors) = (400, 720);
        let (mut force, mut torque) = (0.0, 0.0);
        for i in 0..rings {
            let r = (f64::from(i) + 0.5) / f64::from(rings);
            for k in 0..sectors {
                let angle = (f64::from(k) + 0.5) / f64::from(sectors) * 2.0 * PI;
                let (x, y) = (r * angle.cos(), r * angle.sin());
                let (u, v) = (eps - y, x);
                let weight = 2.0 * r / f64::from(rings) / f64::from(sectors) / u.hypot(v);
                force += weight * u;
                torque += weight * (x * v - y * u);
            }
        }
        [force, torque]
    }

    #[test]
    fn the_closed_forms_equal_the_integrals_over_the_patch() {
        for eps in [0.0005, 0.01, 0.3, 0.653, 0.99, 1.01, 2.0, 30.0, 3000.0] {
            let (closed, summed) = (patch_force_and_torque(eps), by_quadrature(eps));
            for k in 0..2 {
                assert!((closed[k] - summed[k]).abs() < 2e-5, "eps {eps}: {closed:?} against {summed:?}");
            }
        }
        assert_eq!(patch_force_and_torque(0.0), [0.0, 2.0 / 3.0]);
        let [f, t] = patch_force_and_torque(1.0);
        assert!((f - 8.0 / (3.0 * PI)).abs() < 1e-12 && (t - 8.0 / (9.0 * PI)).abs() < 1e-12, "{f} {t}");
    }

    #[test]
    fn the_series_continue_the_closed_forms() {
        for eps in [SMALL_RATIO, 1.0 / SMALL_RATIO] {
            let (below, above) =
                (patch_force_and_torque(eps * (1.0 - 1e-9)), patch_force_and_torque(eps * (1.0 + 1e-9)));
            for k in 0..2 {
                let step = (below[k] - above[k]).abs() / above[k];
                assert!(step < 1e-8, "eps {eps}: {below:?} against {above:?}");
            }
        }
    }
}
