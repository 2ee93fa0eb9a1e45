//! `trajectory_msgs/JointTrajectory` inside a `control_msgs/action/FollowJointTrajectory` goal.

use crate::robot::command::Command;
use crate::robot::phase::PhaseName;
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// The goal, in the format of `ros2 action send_goal` and rosbridge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FollowJointTrajectory {
    /// The trajectory.
    pub trajectory: JointTrajectory,
}

/// The joint states over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointTrajectory {
    /// The joints' names.
    pub joint_names: Vec<String>,
    /// The joint states.
    pub points: Vec<TrajectoryPoint>,
}

/// A joint state at one instant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrajectoryPoint {
    /// Joint angles (rad).
    pub positions: Vec<f64>,
    /// Joint velocities (rad/s).
    pub velocities: Vec<f64>,
    /// Joint accelerations (rad/s2).
    pub accelerations: Vec<f64>,
    /// Time since the start of the trajectory.
    pub time_from_start: RosDuration,
}

/// A time in the format of ROS 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RosDuration {
    /// Whole seconds.
    pub sec: i32,
    /// Remainder (ns).
    pub nanosec: u32,
}

impl RosDuration {
    /// A time in seconds, rounded to a nanosecond.
    pub fn from_seconds(time_s: f64) -> Self {
        let ns = (time_s.max(0.0) * 1e9).round() as u64;
        Self { sec: (ns / 1_000_000_000) as i32, nanosec: (ns % 1_000_000_000) as u32 }
    }
}

impl Command {
    /// The whole command as a goal of `FollowJointTrajectory`: every sample of the strike and every tenth of the other phases.
    /// A controller that interpolates with velocities and accelerations stays within micrometres of the path.
    pub fn follow_joint_trajectory(&self) -> FollowJointTrajectory {
        const SPARSE: usize = 10;
        let mut points: Vec<TrajectoryPoint> = Vec::new();
        for phase in &self.phases {
            // A phase starts at the previous one's end: that sample is written once.
            let first = usize::from(!points.is_empty());
            let step = if phase.name == PhaseName::Strike { 1 } else { SPARSE };
            let last = phase.time_s.len() - 1;
            let kept = |k: usize| k.is_multiple_of(step) || k == last;
            for (k, &time_s) in phase.time_s.iter().enumerate().skip(first).filter(|(k, _)| kept(*k)) {
                points.push(TrajectoryPoint {
                    positions: phase.q_rad[k].clone(),
                    velocities: phase.qd_rad_s[k].clone(),
                    accelerations: phase.qdd_rad_s2[k].clone(),
                    time_from_start: RosDuration::from_seconds(time_s),
                });
            }
        }
        FollowJointTrajectory { trajectory: JointTrajectory { joint_names: self.joints.clone(), points } }
    }
}

impl FollowJointTrajectory {
    /// The goal as YAML: `ros2 action send_goal /joint_trajectory_controller/follow_joint_trajectory
    /// control_msgs/action/FollowJointTrajectory "$(cat goal.yaml)"`.
    pub fn yaml(&self) -> String {
        let names: Vec<String> = self.trajectory.joint_names.iter().map(|name| format!("{name:?}")).collect();
        let mut yaml = format!("trajectory:\n  joint_names: [{}]\n  points:\n", names.join(", "));
        for point in &self.trajectory.points {
            let RosDuration { sec, nanosec } = point.time_from_start;
            let _ = write!(
                yaml,
                "  - positions: {:?}\n    velocities: {:?}\n    accelerations: {:?}\n    time_from_start: \
                 {{sec: {sec}, nanosec: {nanosec}}}\n",
                point.positions, point.velocities, point.accelerations
            );
        }
        yaml
    }
}
