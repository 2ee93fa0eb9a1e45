//! The joints' angles, speeds and accelerations at one instant.

/// The arm at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct JointState {
    /// Joint angles.
    pub q_rad: Vec<f64>,
    /// Joint speeds.
    pub qd_rad_s: Vec<f64>,
    /// Joint accelerations.
    pub qdd_rad_s2: Vec<f64>,
}
