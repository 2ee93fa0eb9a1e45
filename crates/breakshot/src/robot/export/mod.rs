//! A command in the words of other programs: ROS 2, URScript.

mod ros;
mod urscript;

pub use ros::{FollowJointTrajectory, JointTrajectory, RosDuration, TrajectoryPoint};
