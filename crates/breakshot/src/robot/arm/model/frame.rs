//! Rigid transforms in space.

use nalgebra::{Rotation3, Translation3};

/// A rigid transform: `parent_from_joint * point_in_joint` is the point in the parent's frame.
pub type Frame = nalgebra::IsometryMatrix3<f64>;

/// The frame of a position (m) and roll, pitch, yaw about the fixed axes x, y, z (rad), as in URDF and the cell file.
pub(crate) fn frame(position_m: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Frame {
    Frame::from_parts(
        Translation3::new(position_m[0], position_m[1], position_m[2]),
        Rotation3::from_euler_angles(roll, pitch, yaw),
    )
}

/// Roll, pitch, yaw of a rotation (rad), the inverse of [`frame`], also at the singularity of roll and yaw.
pub(crate) fn rpy_rad(rotation: &Rotation3<f64>) -> [f64; 3] {
    let m = rotation.matrix();
    let pitch = (-m[(2, 0)]).atan2(m[(0, 0)].hypot(m[(1, 0)]));
    let yaw = m[(1, 0)].atan2(m[(0, 0)]);
    // The roll is the rest after the yaw is undone, also where the yaw is ill defined.
    let (sin, cos) = yaw.sin_cos();
    let roll = (sin * m[(0, 2)] - cos * m[(1, 2)]).atan2(cos * m[(1, 1)] - sin * m[(0, 1)]);
    [roll, pitch, yaw]
}
