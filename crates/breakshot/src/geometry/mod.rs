//! Points, vectors and poses on the table, pixels in the image.
//!
//! A [`Point`] is a position and a [`Vec2`] a difference of positions: `Point - Point` is a `Vec2`, and `Point +
//! Point` does not compile. The table frame is right-handed: x right, y up, z out of the table. All lengths are in
//! metres.

pub(crate) mod conservative_advancement;
pub(crate) mod moments;
pub mod outline;

use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A position in the table frame (m).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct Point {
    /// x, to the right (m).
    pub x: f64,
    /// y, up in the camera's image (m).
    pub y: f64,
}

/// A vector in the plane of the table, such as a displacement, a velocity or an impulse (SI units).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct Vec2 {
    /// x component, to the right.
    pub x: f64,
    /// y component, up.
    pub y: f64,
}

/// Position and orientation of a body in the table frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 3]", into = "[f64; 3]")]
pub struct Pose {
    /// Position of the centroid.
    pub position: Point,
    /// Rotation of the body's x axis from the table's, counter-clockwise (rad).
    pub yaw_rad: f64,
}

/// A position in the image (px): x right, y down; (0, 0) is the centre of the top left pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct Pixel {
    /// x, to the right (px).
    pub x: f64,
    /// y, down (px).
    pub y: f64,
}

impl Point {
    /// The origin of the table frame.
    pub const ORIGIN: Self = Self { x: 0.0, y: 0.0 };

    /// The point (x, y).
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// The vector from the origin to this point.
    pub const fn to_vec(self) -> Vec2 {
        Vec2 { x: self.x, y: self.y }
    }

    /// Distance between two points (m).
    pub fn distance(self, other: Self) -> f64 {
        (self - other).length()
    }

    /// Whether both coordinates are finite.
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }
}

impl Vec2 {
    /// The zero vector.
    pub const ZERO: Self = Self { x: 0.0, y: 0.0 };

    /// The vector (x, y).
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// The unit vector in the direction `heading_rad`.
    pub fn from_heading(heading_rad: f64) -> Self {
        Self { x: heading_rad.cos(), y: heading_rad.sin() }
    }

    /// Direction of the vector, counter-clockwise from the x axis (rad, in (-pi, pi]).
    pub fn heading_rad(self) -> f64 {
        self.y.atan2(self.x)
    }

    /// The scalar product.
    pub fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    /// The z component of the vector product: positive if `other` points to the left of this vector.
    pub fn cross(self, other: Self) -> f64 {
        self.x * other.y - self.y * other.x
    }

    /// Length of the vector.
    pub fn length(self) -> f64 {
        self.x.hypot(self.y)
    }

    /// Squared length of the vector.
    pub fn length_squared(self) -> f64 {
        self.dot(self)
    }

    /// The vector rotated by +90 degrees.
    pub const fn perpendicular(self) -> Self {
        Self { x: -self.y, y: self.x }
    }

    /// The unit vector in the same direction; `None` for the zero vector.
    pub fn direction(self) -> Option<Self> {
        let length = self.length();
        (length > 0.0).then(|| self / length)
    }

    /// The vector rotated counter-clockwise by `angle_rad`.
    pub fn rotated(self, angle_rad: f64) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        Self { x: cos * self.x - sin * self.y, y: sin * self.x + cos * self.y }
    }

    /// Whether both components are finite.
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }
}

impl Pose {
    /// The pose at (x, y) with the orientation `yaw_rad`.
    pub const fn new(x: f64, y: f64, yaw_rad: f64) -> Self {
        Self { position: Point::new(x, y), yaw_rad }
    }

    /// A point of the body frame in the table frame.
    pub fn table_from_body(self, body: Point) -> Point {
        self.position + body.to_vec().rotated(self.yaw_rad)
    }

    /// A point of the table frame in the body frame.
    pub fn body_from_table(self, table: Point) -> Point {
        Point::ORIGIN + (table - self.position).rotated(-self.yaw_rad)
    }
}

impl Pixel {
    /// The pixel (x, y).
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Distance between two pixels (px).
    pub fn distance_px(self, other: Self) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }
}

/// The angle plus the multiple of the period with which it is nearest to another one (rad).
pub(crate) fn nearest_equivalent_rad(angle_rad: f64, near_rad: f64, period_rad: f64) -> f64 {
    let periods = ((angle_rad - near_rad) / period_rad).round();
    angle_rad - periods * period_rad
}

/// The angle modulo a full turn, in [-pi, pi] (rad).
pub fn wrapped_rad(angle_rad: f64) -> f64 {
    nearest_equivalent_rad(angle_rad, 0.0, std::f64::consts::TAU)
}

/// The angle of an axis, modulo half a turn, in (-pi/2, pi/2] (rad).
pub(crate) fn half_turn_wrapped_rad(angle_rad: f64) -> f64 {
    let wrapped = nearest_equivalent_rad(angle_rad, 0.0, std::f64::consts::PI);
    if wrapped <= -std::f64::consts::FRAC_PI_2 { wrapped + std::f64::consts::PI } else { wrapped }
}

macro_rules! from_array {
    ($type:ident) => {
        impl From<[f64; 2]> for $type {
            fn from([x, y]: [f64; 2]) -> Self {
                Self { x, y }
            }
        }
        impl From<$type> for [f64; 2] {
            fn from(value: $type) -> Self {
                [value.x, value.y]
            }
        }
    };
}
from_array!(Point);
from_array!(Vec2);
from_array!(Pixel);

impl From<[f64; 3]> for Pose {
    fn from([x, y, yaw_rad]: [f64; 3]) -> Self {
        Self::new(x, y, yaw_rad)
    }
}

impl From<Pose> for [f64; 3] {
    fn from(pose: Pose) -> Self {
        [pose.position.x, pose.position.y, pose.yaw_rad]
    }
}

impl Sub for Point {
    type Output = Vec2;
    fn sub(self, other: Self) -> Vec2 {
        Vec2::new(self.x - other.x, self.y - other.y)
    }
}

impl Add<Vec2> for Point {
    type Output = Self;
    fn add(self, displacement: Vec2) -> Self {
        Self::new(self.x + displacement.x, self.y + displacement.y)
    }
}

impl Sub<Vec2> for Point {
    type Output = Self;
    fn sub(self, displacement: Vec2) -> Self {
        Self::new(self.x - displacement.x, self.y - displacement.y)
    }
}

impl AddAssign<Vec2> for Point {
    fn add_assign(&mut self, displacement: Vec2) {
        *self = *self + displacement;
    }
}

impl Add for Vec2 {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }
}

impl Sub for Vec2 {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }
}

impl AddAssign for Vec2 {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Vec2 {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Mul<f64> for Vec2 {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self::new(self.x * factor, self.y * factor)
    }
}

impl Mul<Vec2> for f64 {
    type Output = Vec2;
    fn mul(self, vector: Vec2) -> Vec2 {
        vector * self
    }
}

impl Div<f64> for Vec2 {
    type Output = Self;
    fn div(self, divisor: f64) -> Self {
        Self::new(self.x / divisor, self.y / divisor)
    }
}

impl Neg for Vec2 {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn transforming_a_point_to_the_table_frame_and_back_gives_the_same_point() {
        let pose = Pose::new(0.3, -0.2, 2.1);
        let body = Point::new(0.04, -0.01);
        assert!(pose.body_from_table(pose.table_from_body(body)).distance(body) < 1e-15);
    }

    #[test]
    fn a_wrapped_angle_has_the_same_direction() {
        for k in -20..20 {
            let angle_rad = f64::from(k) * 0.7;
            let wrapped = wrapped_rad(angle_rad);
            assert!(wrapped.abs() <= PI + 1e-12, "{wrapped} rad");
            assert!((Vec2::from_heading(wrapped) - Vec2::from_heading(angle_rad)).length() < 1e-12);
        }
    }
}
