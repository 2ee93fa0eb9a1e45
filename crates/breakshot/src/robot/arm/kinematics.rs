//! Forward kinematics: the links' frames, the tip's velocity and acceleration.

use super::joint_state::JointState;
use super::model::frame::Frame;
use super::model::serial_arm::Arm;
use nalgebra::{Matrix3, Matrix6xX, Rotation3, Vector3, Vector6};

/// The tip's velocity per unit joint velocity, one column per joint: three rows of linear velocity, three of angular velocity,
/// base axes.
pub type Jacobian = Matrix6xX<f64>;

impl Arm {
    /// The frames of the moving links in the base frame at joint angles `angles_rad`.
    ///
    /// # Panics
    /// If there are fewer angles than joints. This holds for all functions of joint angles.
    pub fn link_frames(&self, angles_rad: &[f64]) -> Vec<Frame> {
        let mut base_from_link = Frame::identity();
        let frames = self.links.iter().enumerate().map(|(k, link)| {
            let rotation = Rotation3::from_axis_angle(&link.joint.axis, angles_rad[k]);
            base_from_link *= link.joint.parent_from_joint * rotation;
            base_from_link
        });
        frames.collect()
    }

    /// The tip frame in the base frame.
    pub fn tip(&self, angles_rad: &[f64]) -> Frame {
        self.tip_of(&self.link_frames(angles_rad))
    }

    /// The flange frame in the base frame.
    pub fn flange_frame(&self, angles_rad: &[f64]) -> Frame {
        last(&self.link_frames(angles_rad)) * self.last_from_flange
    }

    /// The tip frame, given the links' frames.
    pub(crate) fn tip_of(&self, frames: &[Frame]) -> Frame {
        last(frames) * self.last_from_tip()
    }

    /// The Jacobian of the tool's tip.
    pub fn jacobian(&self, angles_rad: &[f64]) -> Jacobian {
        let frames = self.link_frames(angles_rad);
        let tip = self.tip_of(&frames).translation.vector;
        self.jacobian_at(&frames, &tip, frames.len())
    }

    /// The Jacobian of a point (m, base frame) that moves with the first `joints` joints.
    pub(crate) fn jacobian_at(&self, frames: &[Frame], point: &Vector3<f64>, joints: usize) -> Jacobian {
        let mut jacobian = Jacobian::zeros(frames.len());
        for (k, frame) in frames.iter().enumerate().take(joints) {
            jacobian.set_column(k, &self.column(frame, point, k));
        }
        jacobian
    }

    /// The Jacobian's column for joint `k` with the given frame, for a point (m, base frame).
    pub(crate) fn column(&self, frame: &Frame, point: &Vector3<f64>, k: usize) -> Vector6<f64> {
        let axis = frame.rotation * self.links[k].joint.axis.into_inner();
        let moved = axis.cross(&(point - frame.translation.vector));
        Vector6::new(moved.x, moved.y, moved.z, axis.x, axis.y, axis.z)
    }

    /// The velocity of the tip's point (m/s, base axes).
    pub fn tip_velocity(&self, state: &JointState) -> Vector3<f64> {
        let jacobian = self.jacobian(&state.q_rad);
        let speeds = nalgebra::DVector::from_column_slice(&state.qd_rad_s);
        let velocity = jacobian * speeds;
        Vector3::new(velocity[0], velocity[1], velocity[2])
    }

    /// The tip's acceleration at constant joint velocities: the term `dJ/dt qd` of `a = J qdd + dJ/dt qd`.
    pub fn velocity_product(&self, angles_rad: &[f64], speeds_rad_s: &[f64]) -> Vector6<f64> {
        let frames = self.link_frames(angles_rad);
        let tip = self.tip_of(&frames).translation.vector;
        let (mut angular_velocity, mut angular_acceleration) = (Vector3::zeros(), Vector3::zeros());
        let (mut acceleration, mut origin) = (Vector3::zeros(), Vector3::zeros());
        // From the base outwards: the acceleration of each joint's origin, finally that of the tip.
        for (k, frame) in frames.iter().enumerate() {
            let offset = frame.translation.vector - origin;
            acceleration += point_acceleration(&angular_velocity, &angular_acceleration, &offset);
            origin = frame.translation.vector;
            let joint_velocity = frame.rotation * self.links[k].joint.axis.into_inner() * speeds_rad_s[k];
            angular_acceleration += angular_velocity.cross(&joint_velocity);
            angular_velocity += joint_velocity;
        }
        acceleration += point_acceleration(&angular_velocity, &angular_acceleration, &(tip - origin));
        Vector6::new(
            acceleration.x,
            acceleration.y,
            acceleration.z,
            angular_acceleration.x,
            angular_acceleration.y,
            angular_acceleration.z,
        )
    }

    /// The condition number of the Jacobian: its largest over its smallest singular value, infinite at a singular
    /// configuration.
    pub fn condition_number(&self, angles_rad: &[f64]) -> f64 {
        condition_number(&self.jacobian(angles_rad))
    }

    /// The origins of base, joints, flange and tip (m, base frame).
    pub fn skeleton(&self, angles_rad: &[f64]) -> Vec<[f64; 3]> {
        let frames = self.link_frames(angles_rad);
        let mut points = vec![Vector3::zeros()];
        points.extend(frames.iter().map(|frame| frame.translation.vector));
        points.push((last(&frames) * self.last_from_flange).translation.vector);
        points.push(self.tip_of(&frames).translation.vector);
        points.into_iter().map(Into::into).collect()
    }
}

fn last(frames: &[Frame]) -> Frame {
    frames.last().copied().unwrap_or_else(Frame::identity)
}

/// See [`Arm::condition_number`].
pub(crate) fn condition_number(jacobian: &Jacobian) -> f64 {
    // J J' is six by six for any number of joints; its eigenvalues are the squares of the singular values.
    let squares = (jacobian * jacobian.transpose()).symmetric_eigenvalues();
    let (most, least) = (squares.max(), squares.min());
    if least <= 0.0 { f64::INFINITY } else { (most / least).sqrt() }
}

/// The acceleration of a point of a rotating body relative to the body's origin (tangential and centripetal).
pub(crate) fn point_acceleration(
    angular_velocity: &Vector3<f64>,
    angular_acceleration: &Vector3<f64>,
    offset: &Vector3<f64>,
) -> Vector3<f64> {
    angular_acceleration.cross(offset) + angular_velocity.cross(&angular_velocity.cross(offset))
}

/// The difference of two frames as a twist: the displacement (m) and the rotation vector (rad), base axes.
pub(crate) fn twist(from: &Frame, to: &Frame) -> Vector6<f64> {
    let displacement = to.translation.vector - from.translation.vector;
    let rotation = rotation_vector(&(to.rotation * from.rotation.inverse()));
    Vector6::new(displacement.x, displacement.y, displacement.z, rotation.x, rotation.y, rotation.z)
}

/// The rotation vector (axis times angle, rad), accurate from the smallest to the largest angle.
pub(crate) fn rotation_vector(rotation: &Rotation3<f64>) -> Vector3<f64> {
    let m = rotation.matrix();
    // Twice the sine times the axis, and twice the cosine.
    let sine = Vector3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)]);
    let cosine = m.trace() - 1.0;
    let angle = sine.norm().atan2(cosine);
    if cosine > 0.0 {
        let factor = if angle > 0.0 && sine.norm() > 0.0 { angle / sine.norm() } else { 0.5 };
        return sine * factor;
    }
    // Beyond a right angle the sine decreases to zero: the axis is the longest column of (R + R') - (trace - 1) E, up to its sign.
    let outer = m + m.transpose() - Matrix3::identity() * cosine;
    let longest = outer.column(outer.diagonal().imax()).normalize();
    if longest.dot(&sine) < 0.0 { longest * -angle } else { longest * angle }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::arm::model::serial_arm::Tool;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// Reported by an Indy 7's controller in the example notebook of neuromeka-package: joint angles (deg), then
    /// position (mm) and roll, pitch, yaw (deg) of the flange.
    const REPORTED_DEG: [f64; 6] =
        [0.001_997_514_2, -0.002_678_485, -90.03037, 0.019_307_656, -89.99859, 0.000_543_877_66];
    const REPORTED_MM: [f64; 3] = [349.90155, -186.41096, 521.7365];
    const REPORTED_RPY_DEG: [f64; 3] = [-0.019_307_354, -179.96837, 0.001_453_16];

    #[test]
    fn the_forward_kinematics_agrees_with_the_controllers_up_to_its_base_offset() {
        let arm = Arm::built_in("indy7").expect("built in");
        let flange = arm.flange_frame(&REPORTED_DEG.map(f64::to_radians));
        let off_mm = flange.translation.vector * 1e3 - Vector3::from(REPORTED_MM);
        assert!(off_mm.x.abs() < 1e-3 && off_mm.y.abs() < 1e-3, "x, y off by {off_mm} mm");
        assert!((off_mm.z + 0.5).abs() < 1e-3, "z off by {} mm", off_mm.z);
        let [roll, pitch, yaw] = REPORTED_RPY_DEG.map(f64::to_radians);
        let reported = Rotation3::from_euler_angles(roll, pitch, yaw);
        let rotation_deg = rotation_vector(&(flange.rotation * reported.inverse())).norm().to_degrees();
        assert!(rotation_deg < 1e-3, "rotated by {rotation_deg} degrees");
    }

    /// Step of central differences (rad), with an error of about 1e-9.
    const STEP_RAD: f64 = 1e-5;

    #[test]
    fn the_jacobian_is_the_derivative_of_the_tips_frame() {
        let tool = Tool { offset_m: Vector3::new(0.01, -0.02, 0.15), mass_kg: 0.4 };
        let arm = Arm::built_in("indy7_v2").and_then(|arm| arm.with_tool(tool)).expect("built in");
        let angles = [0.4, -0.7, -1.1, 0.3, 0.9, -1.4];
        let jacobian = arm.jacobian(&angles);
        for k in 0..6 {
            let mut ahead = angles;
            let mut behind = angles;
            ahead[k] += STEP_RAD;
            behind[k] -= STEP_RAD;
            let slope = twist(&arm.tip(&behind), &arm.tip(&ahead)) / (2.0 * STEP_RAD);
            let error = (slope - jacobian.column(k)).amax();
            assert!(error < 1e-8, "joint {k}: off by {error}");
        }
    }

    #[test]
    fn the_velocity_product_is_the_derivative_of_the_jacobian_times_the_joint_velocities() {
        let arm = Arm::built_in("indy7").expect("built in");
        let angles = [0.4, -0.7, -1.1, 0.3, 0.9, -1.4];
        let speeds = [1.0, -0.5, 0.8, 2.0, -1.5, 0.7];
        let at = |time_s: f64| -> Vec<f64> { (0..6).map(|k| angles[k] + time_s * speeds[k]).collect() };
        let qd = nalgebra::DVector::from_row_slice(&speeds);
        let change = (arm.jacobian(&at(STEP_RAD)) - arm.jacobian(&at(-STEP_RAD))) * qd / (2.0 * STEP_RAD);
        let error = (change - arm.velocity_product(&angles, &speeds)).amax();
        assert!(error < 1e-8, "off by {error}");
    }

    #[test]
    fn a_rotation_vector_is_recovered_from_its_rotation() {
        let axis = Vector3::new(0.36, -0.48, 0.8);
        for angle in [0.0, 1e-12, 1e-7, 0.3, FRAC_PI_2 - 1e-4, FRAC_PI_2 + 1e-4, 3.0, PI - 1e-6, PI] {
            let error = (rotation_vector(&Rotation3::new(axis * angle)) - axis * angle).amax();
            assert!(error < 1e-12, "{angle} rad: off by {error} rad");
        }
    }
}
