//! Points, vectors and poses on the table, pixels in the image.
//!
//! A [`Point`] is a place, a [`Vec2`] a difference: `Point - Point` is a `Vec2`, and `Point + Point` does not
//! compile.  The table frame is right-handed: x right, y up, z out of the table; all lengths in metres.

use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A place on the table (m).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct Point {
    /// To the right (m).
    pub x: f64,
    /// Up, as the camera's user sees it (m).
    pub y: f64,
}

/// A difference of places, a velocity, an impulse: anything that has a direction on the table (SI).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct Vec2 {
    /// To the right.
    pub x: f64,
    /// Up.
    pub y: f64,
}

/// Where a body is, and how it is turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 3]", into = "[f64; 3]")]
pub struct Pose {
    /// The centroid.
    pub position: Point,
    /// Counter-clockwise from the x axis (rad).
    pub yaw_rad: f64,
}

/// A place in the image (px): x right, y down, (0, 0) is the centre of the top left pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct Pixel {
    /// To the right (px).
    pub x: f64,
    /// Down (px).
    pub y: f64,
}

impl Point {
    /// The table's origin.
    pub const ORIGIN: Self = Self { x: 0.0, y: 0.0 };

    /// The place (x, y).
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// The way to this place from the origin.
    pub const fn to_vec(self) -> Vec2 {
        Vec2 { x: self.x, y: self.y }
    }

    /// How far apart two places are (m).
    pub fn distance(self, other: Self) -> f64 {
        (self - other).length()
    }

    /// Whether both coordinates are numbers.
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }
}

impl Vec2 {
    /// No difference.
    pub const ZERO: Self = Self { x: 0.0, y: 0.0 };

    /// The vector (x, y).
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// The unit vector that points along `heading_rad`.
    pub fn from_heading(heading_rad: f64) -> Self {
        Self { x: heading_rad.cos(), y: heading_rad.sin() }
    }

    /// The direction (rad), counter-clockwise from x.
    pub fn heading_rad(self) -> f64 {
        self.y.atan2(self.x)
    }

    /// The scalar product.
    pub fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    /// The z component of the vector product: positive if `other` lies to the left.
    pub fn cross(self, other: Self) -> f64 {
        self.x * other.y - self.y * other.x
    }

    /// Its length.
    pub fn length(self) -> f64 {
        self.x.hypot(self.y)
    }

    /// Its length squared.
    pub fn length_squared(self) -> f64 {
        self.dot(self)
    }

    /// Turned by +90 degrees.
    pub const fn perpendicular(self) -> Self {
        Self { x: -self.y, y: self.x }
    }

    /// The unit vector along it, or `None` for a vector of no length.
    pub fn direction(self) -> Option<Self> {
        let length = self.length();
        (length > 0.0).then(|| self / length)
    }

    /// Turned counter-clockwise by `angle_rad`.
    pub fn rotated(self, angle_rad: f64) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        Self { x: cos * self.x - sin * self.y, y: sin * self.x + cos * self.y }
    }

    /// Whether both components are numbers.
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }
}

impl Pose {
    /// The pose at (x, y), turned by `yaw_rad`.
    pub const fn new(x: f64, y: f64, yaw_rad: f64) -> Self {
        Self { position: Point::new(x, y), yaw_rad }
    }

    /// Where a point of the body, given in the body's own frame, lies on the table.
    pub fn table_from_body(self, body: Point) -> Point {
        self.position + body.to_vec().rotated(self.yaw_rad)
    }

    /// Where a point of the table lies in the body's own frame.
    pub fn body_from_table(self, table: Point) -> Point {
        Point::ORIGIN + (table - self.position).rotated(-self.yaw_rad)
    }
}

impl Pixel {
    /// The pixel (x, y).
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// How far apart two pixels are (px).
    pub fn distance_px(self, other: Self) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }
}

/// An angle brought into (-pi, pi].
pub fn wrapped_rad(angle_rad: f64) -> f64 {
    let turns = (angle_rad / std::f64::consts::TAU).round();
    angle_rad - turns * std::f64::consts::TAU
}

/// An axis' angle brought into (-pi/2, pi/2].
pub(crate) fn half_turn_wrapped_rad(angle_rad: f64) -> f64 {
    let half_turns = (angle_rad / std::f64::consts::PI).round();
    let wrapped = angle_rad - half_turns * std::f64::consts::PI;
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
    fn add(self, way: Vec2) -> Self {
        Self::new(self.x + way.x, self.y + way.y)
    }
}

impl Sub<Vec2> for Point {
    type Output = Self;
    fn sub(self, way: Vec2) -> Self {
        Self::new(self.x - way.x, self.y - way.y)
    }
}

impl AddAssign<Vec2> for Point {
    fn add_assign(&mut self, way: Vec2) {
        *self = *self + way;
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
    fn a_body_point_taken_to_the_table_and_back_is_the_same_point() {
        let pose = Pose::new(0.3, -0.2, 2.1);
        let body = Point::new(0.04, -0.01);
        assert!(pose.body_from_table(pose.table_from_body(body)).distance(body) < 1e-15);
    }

    #[test]
    fn a_wrapped_angle_points_the_same_way() {
        for k in -20..20 {
            let angle_rad = f64::from(k) * 0.7;
            let wrapped = wrapped_rad(angle_rad);
            assert!(wrapped.abs() <= PI + 1e-12, "{wrapped} rad");
            assert!((Vec2::from_heading(wrapped) - Vec2::from_heading(angle_rad)).length() < 1e-12);
        }
    }
}
