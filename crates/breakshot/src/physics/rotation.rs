//! Rotations and lengths of vectors whose bits are the same on every machine.

use crate::geometry::Vec2;
use std::f64::consts::FRAC_2_PI;

/// A rotation in the plane, such as `table_from_body` for directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rotation {
    cos: f64,
    sin: f64,
}

/// Pi/2 as a sum of two numbers, the first with so few digits that its small multiples are exact (Cody and Waite 1980).
const HALF_PI_HIGH: f64 = 1.570_796_326_734_125_6;
const HALF_PI_LOW: f64 = 6.077_100_506_506_192e-11;
/// Adding and subtracting 1.5 * 2^52 rounds to the nearest integer.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

impl Rotation {
    /// The rotation by an angle (rad); error below 5e-16 up to a hundred thousand revolutions.
    ///
    /// Polynomials of fdlibm's `k_sin.c` and `k_cos.c` on [-pi/4, pi/4].
    pub(crate) fn new(angle_rad: f64) -> Self {
        let quarters = (angle_rad * FRAC_2_PI + ROUNDING) - ROUNDING;
        let x = (angle_rad - quarters * HALF_PI_HIGH) - quarters * HALF_PI_LOW;
        let z = x * x;
        let sin_series = -1.666_666_666_666_663_2e-1
            + z * (8.333_333_333_322_49e-3
                + z * (-1.984_126_982_985_795e-4
                    + z * (2.755_731_370_707_007e-6
                        + z * (-2.505_076_025_340_686_3e-8 + z * 1.589_690_995_211_55e-10))));
        let cos_series = 4.166_666_666_666_66e-2
            + z * (-1.388_888_888_887_411e-3
                + z * (2.480_158_728_947_673e-5
                    + z * (-2.755_731_435_139_066_3e-7
                        + z * (2.087_572_321_298_175e-9 + z * -1.135_964_755_778_819_5e-11))));
        let (sin, cos) = (x + x * z * sin_series, 1.0 - 0.5 * z + z * z * cos_series);
        match quarters as i64 & 3 {
            0 => Self { cos, sin },
            1 => Self { cos: -sin, sin: cos },
            2 => Self { cos: -cos, sin: -sin },
            _ => Self { cos: sin, sin: -cos },
        }
    }

    /// The rotation from this frame to another: `other.apply_inverse(self.apply(v))` in one step.
    pub(crate) fn relative_to(self, other: Self) -> Self {
        Self {
            cos: self.cos * other.cos + self.sin * other.sin,
            sin: self.sin * other.cos - self.cos * other.sin,
        }
    }

    /// The vector rotated counter-clockwise by the angle.
    pub(crate) fn apply(self, v: Vec2) -> Vec2 {
        Vec2::new(self.cos * v.x - self.sin * v.y, self.sin * v.x + self.cos * v.y)
    }

    /// The vector rotated clockwise by the angle.
    pub(crate) fn apply_inverse(self, v: Vec2) -> Vec2 {
        Vec2::new(self.cos * v.x + self.sin * v.y, self.cos * v.y - self.sin * v.x)
    }
}

/// The length of a vector; faster than `hypot` because it does not guard against overflow.
pub(crate) fn length(v: Vec2) -> f64 {
    v.length_squared().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_equal_those_of_the_platform() {
        for k in -200_000..200_000 {
            let angle_rad = f64::from(k) * 0.001_37;
            let rotation = Rotation::new(angle_rad);
            let error = (rotation.cos - angle_rad.cos()).abs().max((rotation.sin - angle_rad.sin()).abs());
            assert!(error < 5e-16, "{angle_rad} rad: off by {error}");
        }
    }
}
