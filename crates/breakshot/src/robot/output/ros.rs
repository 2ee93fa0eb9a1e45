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
    /// How far each joint may be from the path at any time.
    pub path_tolerance: Vec<JointTolerance>,
    /// How far each joint may be from the last point.
    pub goal_tolerance: Vec<JointTolerance>,
    /// How much later than planned the goal may be reached.
    pub goal_time_tolerance: RosDuration,
}

/// The tolerance of a joint, `control_msgs/JointTolerance`; zero is the controller's own tolerance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointTolerance {
    /// The joint's name.
    pub name: String,
    /// Largest deviation of the angle (rad).
    pub position: f64,
    /// Largest deviation of the velocity (rad/s).
    pub velocity: f64,
    /// Largest deviation of the acceleration (rad/s2).
    pub acceleration: f64,
}

/// Largest deviation of a joint from the path (rad), besides the one that is due to a delay.
const PATH_RAD: f64 = 0.05;
/// Largest delay of a servo along the path (s).
const DELAY_S: f64 = 0.1;
/// Largest deviation of a joint from the last point (rad).
const GOAL_RAD: f64 = 0.01;
/// Largest delay of the end (s).
const GOAL_TIME_S: f64 = 1.0;

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

impl FollowJointTrajectory {
    /// A goal with tolerances: each joint within 0.05 rad of the path and of what it moves in 0.1 s, and within 0.01 rad of
    /// the last point at most 1 s late.
    pub fn new(joint_names: Vec<String>, points: Vec<TrajectoryPoint>) -> Self {
        let tolerances = |position: &dyn Fn(usize) -> f64| {
            let tolerance = |(k, name): (usize, &String)| JointTolerance {
                name: name.clone(),
                position: position(k),
                velocity: 0.0,
                acceleration: 0.0,
            };
            joint_names.iter().enumerate().map(tolerance).collect()
        };
        let fastest = |k: usize| {
            let speeds = points.iter().filter_map(|point| point.velocities.get(k));
            speeds.fold(0.0, |most: f64, speed| most.max(speed.abs()))
        };
        Self {
            path_tolerance: tolerances(&|k| PATH_RAD + DELAY_S * fastest(k)),
            goal_tolerance: tolerances(&|_| GOAL_RAD),
            goal_time_tolerance: RosDuration::from_seconds(GOAL_TIME_S),
            trajectory: JointTrajectory { joint_names, points },
        }
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
        FollowJointTrajectory::new(self.joints.clone(), points)
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
        for (key, tolerances) in
            [("path_tolerance", &self.path_tolerance), ("goal_tolerance", &self.goal_tolerance)]
        {
            let _ = writeln!(yaml, "{key}:");
            for JointTolerance { name, position, velocity, acceleration } in tolerances {
                let _ = writeln!(
                    yaml,
                    "- {{name: {name:?}, position: {position:?}, velocity: {velocity:?}, acceleration: {acceleration:?}}}"
                );
            }
        }
        let RosDuration { sec, nanosec } = self.goal_time_tolerance;
        let _ = writeln!(yaml, "goal_time_tolerance: {{sec: {sec}, nanosec: {nanosec}}}");
        yaml
    }
}
