//! A goal of `FollowJointTrajectory` and what is known of it.

use crate::motion::Motion;
use breakshot::robot::{RosDuration, TrajectoryPoint};
use serde_json::Value;

/// The latest goal.
#[derive(Clone, Debug)]
pub(super) struct Goal {
    /// Its id: messages with another one are about another goal.
    pub(super) id: String,
    pub(super) motion: Motion,
    /// Whether the controller has begun it: feedback or a result has arrived.
    pub(super) accepted: bool,
    /// Its end, or the controller's reason against it.
    pub(super) result: Option<Result<(), String>>,
}

/// The number of a goal that has succeeded (`action_msgs/GoalStatus`).
const SUCCEEDED: i64 = 4;

impl Goal {
    pub(super) fn new(id: String, motion: &Motion) -> Self {
        Self { id, motion: motion.clone(), accepted: false, result: None }
    }

    /// Takes a message that concerns a goal; one of another goal is ignored.
    pub(super) fn receive(&mut self, message: &Value) {
        let is_ours = message["id"] == *self.id;
        match message["op"].as_str() {
            Some("action_feedback") if is_ours => self.accepted = true,
            Some("action_result") if is_ours => {
                self.accepted = true;
                let values = &message["values"];
                let code = values["error_code"].as_i64().or(values["result"]["error_code"].as_i64());
                let status = message["status"].as_i64().unwrap_or(SUCCEEDED);
                let succeeded = message["result"] == true && code == Some(0) && status == SUCCEEDED;
                let reason =
                    || format!("{values}, status {}, result {}", message["status"], message["result"]);
                self.result = Some(if succeeded { Ok(()) } else { Err(reason()) });
            }
            // An error of the rosbridge itself names the message that it is about, if it knows it.
            Some("status") if message["level"] == "error" && (is_ours || message["id"].is_null()) => {
                self.result = Some(Err(message["msg"].to_string()));
            }
            _ => {}
        }
    }
}

/// The samples of a motion; times count from its start.
pub(super) fn points(motion: &Motion) -> Vec<TrajectoryPoint> {
    let phase = &motion.phase;
    let start_s = phase.span_s()[0];
    let point = |k: usize| TrajectoryPoint {
        positions: phase.q_rad[k].clone(),
        velocities: phase.qd_rad_s[k].clone(),
        accelerations: phase.qdd_rad_s2[k].clone(),
        time_from_start: RosDuration::from_seconds(phase.time_s[k] - start_s),
    };
    (0..phase.time_s.len()).map(point).collect()
}
