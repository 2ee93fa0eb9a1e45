//! The joints' angles, speeds and accelerations at one instant.

/// The joint state at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct JointState {
    /// Joint angles (rad).
    pub q_rad: Vec<f64>,
    /// Joint velocities (rad/s).
    pub qd_rad_s: Vec<f64>,
    /// Joint accelerations (rad/s2).
    pub qdd_rad_s2: Vec<f64>,
}
