//! Capsules as collision shapes, and their distance.

use super::frame::Frame;
use nalgebra::Vector3;

/// All points within a radius of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// One end of the segment (m).
    pub from_m: Vector3<f64>,
    /// The other end (m).
    pub to_m: Vector3<f64>,
    /// The radius (m).
    pub radius_m: f64,
}

impl Capsule {
    /// The same capsule in another frame.
    #[must_use]
    pub fn transformed(&self, other_from_own: &Frame) -> Self {
        let to = |point: &Vector3<f64>| other_from_own.rotation * point + other_from_own.translation.vector;
        Self { from_m: to(&self.from_m), to_m: to(&self.to_m), radius_m: self.radius_m }
    }

    /// The gap to another capsule (m), negative if they overlap.
    pub fn gap_m(&self, other: &Self) -> f64 {
        self.axis_distance_m(other) - self.radius_m - other.radius_m
    }

    /// The distance of the capsules' segments (m): clamped closest points (Ericson, Real-Time Collision Detection, 5.1.9).
    fn axis_distance_m(&self, other: &Self) -> f64 {
        let (p, q) = (&self.from_m, &other.from_m);
        let (along_p, along_q, between) = (self.to_m - p, other.to_m - q, p - q);
        let (a, e, b) = (along_p.norm_squared(), along_q.norm_squared(), along_p.dot(&along_q));
        let (c, f) = (along_p.dot(&between), along_q.dot(&between));
        let fraction = |over: f64, under: f64| if under > 0.0 { (over / under).clamp(0.0, 1.0) } else { 0.0 };
        let mut s = fraction(b * f - c * e, a * e - b * b);
        let mut t = if e > 0.0 { (b * s + f) / e } else { 0.0 };
        if !(0.0..=1.0).contains(&t) || e <= 0.0 {
            t = t.clamp(0.0, 1.0);
            s = fraction(b * t - c, a);
        }
        (p + along_p * s - (q + along_q * t)).norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn segment() -> impl Strategy<Value = [f64; 6]> {
        proptest::array::uniform6(-1.0..1.0_f64)
    }

    fn capsule([a, b, c, d, e, f]: [f64; 6]) -> Capsule {
        Capsule { from_m: Vector3::new(a, b, c), to_m: Vector3::new(d, e, f), radius_m: 0.1 }
    }

    proptest! {
        #[test]
        fn no_two_points_of_two_segments_are_nearer_than_their_gap(
            one in segment(), other in segment(), s in 0.0..1.0_f64, t in 0.0..1.0_f64,
        ) {
            let (one, other) = (capsule(one), capsule(other));
            let at = |capsule: &Capsule, fraction: f64| capsule.from_m.lerp(&capsule.to_m, fraction);
            let apart = (at(&one, s) - at(&other, t)).norm() - 0.2;
            let gap = one.gap_m(&other);
            prop_assert!(gap <= apart + 1e-12, "gap {gap} m, but two points are {apart} m apart");
            prop_assert!((gap - other.gap_m(&one)).abs() < 1e-12, "the gap depends on the order");
        }
    }

    #[test]
    fn crossed_and_parallel_segments_have_the_known_distance() {
        let x = capsule([-1.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        for (other, expected_m) in [
            ([0.0, -1.0, 0.5, 0.0, 1.0, 0.5], 0.5),
            ([-1.0, 0.3, 0.0, 1.0, 0.3, 0.0], 0.3),
            ([2.0, 0.0, 0.0, 3.0, 0.0, 0.0], 1.0),
            ([0.0, 0.0, 0.7, 0.0, 0.0, 0.7], 0.7),
        ] {
            let gap = x.gap_m(&capsule(other)) + 0.2;
            assert!((gap - expected_m).abs() < 1e-12, "{gap} m, not {expected_m} m");
        }
    }
}
