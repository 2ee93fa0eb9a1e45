//! The requests that the driver sends, as values.

use crate::wire::{
    ForwardKinematicsReq, GetMotionLReq, MoveJointTrajReq, StopCat, StopCategory, TargetP, Vector,
    VelocityModeType,
};
use breakshot::robot::{Frame, JointState};
use nalgebra::{Rotation3, Translation3};

/// The controller's period, the time between two rows of a trajectory (s).
pub const PERIOD_S: f64 = 250e-6;
/// The speed of 100 % in a straight line (m/s): the largest value in the vendor's client.
pub const FULL_SPEED_M_S: f64 = 1.0;

/// A whole motion, one row per period (`MoveJointTraj`).
pub fn joint_trajectory(states: Vec<JointState>) -> MoveJointTrajReq {
    let mut request = MoveJointTrajReq::default();
    for state in states {
        request.q_list.push(Vector { values: state.q_rad });
        request.qdot_list.push(Vector { values: state.qd_rad_s });
        request.qddot_list.push(Vector { values: state.qdd_rad_s2 });
    }
    request
}

/// A stop (`StopMotion`).
pub fn stop(category: StopCategory) -> StopCat {
    StopCat { category: category.into() }
}

/// The tool pose at joint angles (`ForwardKinematics`).
pub fn forward_kinematics(q_rad: &[f64]) -> ForwardKinematicsReq {
    ForwardKinematicsReq { jpos: q_rad.iter().map(|q| q.to_degrees() as f32).collect() }
}

/// The controller's plan of a straight line at this speed and acceleration (`GetMotionL`); nothing moves.
pub fn line_preview(from: &Frame, to: &Frame, speed_m_s: f64, acceleration_m_s2: f64) -> GetMotionLReq {
    let target = TargetP { t_start: pose_mm_deg(from), t_target: pose_mm_deg(to), base_type: 0 };
    GetMotionLReq {
        target_list: vec![target],
        vel_ratio: (100.0 * speed_m_s / FULL_SPEED_M_S) as f32,
        // In percent of the speed per second.
        acc_ratio: (100.0 * acceleration_m_s2 / speed_m_s) as f32,
        vel_type: VelocityModeType::DispOriented.into(),
        time_step: 0.001,
    }
}

/// A frame in the controller's format: position (mm), then rotations about the fixed axes x, y, z (degrees).
pub fn pose_mm_deg(frame: &Frame) -> Vec<f32> {
    let (roll, pitch, yaw) = frame.rotation.euler_angles();
    let position = frame.translation.vector.iter().map(|x| (x * 1e3) as f32);
    position.chain([roll, pitch, yaw].map(|angle| angle.to_degrees() as f32)).collect()
}

/// The frame of a pose in the format of [`pose_mm_deg`]; `None` unless there are six numbers.
pub fn frame_from(pose_mm_deg: &[f32]) -> Option<Frame> {
    let &[x, y, z, u, v, w] = pose_mm_deg else { return None };
    let [x, y, z] = [x, y, z].map(|mm| f64::from(mm) * 1e-3);
    let [u, v, w] = [u, v, w].map(|deg| f64::from(deg).to_radians());
    Some(Frame::from_parts(Translation3::new(x, y, z), Rotation3::from_euler_angles(u, v, w)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_goes_to_the_controller_and_back() {
        let frame = Frame::from_parts(
            Translation3::new(0.35, -0.186, 0.52),
            Rotation3::from_euler_angles(3.0, -0.4, 1.2),
        );
        let back = frame_from(&pose_mm_deg(&frame)).expect("six numbers");
        let apart = (back.to_homogeneous() - frame.to_homogeneous()).amax();
        assert!(apart < 1e-6, "{apart} m or rad off");
        assert_eq!(frame_from(&[0.0; 5]), None);
    }
}
