//! The faults that end a motion before its time.

use serde::Serialize;

/// Why the arm was stopped, or not moved at all.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Fault {
    /// No connection to the robot; nothing was sent.
    #[error("the robot cannot be reached: {cause}")]
    Unreachable {
        /// The network's message.
        cause: String,
    },
    /// The robot does not answer.
    #[error("no answer from the robot for {silent_s:.3} s ({cause}); motion already sent may finish")]
    LostLink {
        /// Time since the last answer (s).
        silent_s: f64,
        /// The network's message.
        cause: String,
    },
    /// The controller reports a broken limit.
    #[error("the controller reports a violation")]
    Violation,
    /// The controller reports a collision of the arm.
    #[error("the controller reports a collision")]
    Collision,
    /// The controller is in a state in which it executes nothing, such as after an emergency stop.
    #[error("the controller is not ready to move: {state}")]
    NotReady {
        /// The state that it reports.
        state: String,
    },
    /// The user requested a stop.
    #[error("stopped by the user")]
    Interrupted,
    /// The measured joint angles deviate from the path.
    #[error("joint `{joint}` is {off_rad:.3} rad off the path")]
    OffPath {
        /// The joint with the largest deviation.
        joint: String,
        /// The deviation (rad).
        off_rad: f64,
    },
    /// The arm is ahead of its path.
    #[error("the arm is {ahead_s:.2} s ahead of the {motion}: the controller moves it faster than planned")]
    Ahead {
        /// The motion.
        motion: String,
        /// Time by which it is ahead (s).
        ahead_s: f64,
    },
    /// The arm is behind its path: it is held up, or its joint angles are not measured any more.
    #[error(
        "the arm is {behind_s:.2} s behind the {motion}: it is held up, or the reported joint angles are old"
    )]
    Behind {
        /// The motion.
        motion: String,
        /// Time by which it is behind (s).
        behind_s: f64,
    },
    /// A joint is faster than planned.
    #[error("joint `{joint}` moves at {speed_rad_s:.2} rad/s; planned are at most {planned_rad_s:.2} rad/s")]
    TooFast {
        /// The joint.
        joint: String,
        /// Its mean speed over the last readings (rad/s).
        speed_rad_s: f64,
        /// Its largest planned speed meanwhile (rad/s).
        planned_rad_s: f64,
    },
    /// The robot reports something that is no pose of this arm.
    #[error("the robot reports the joint angles {found}; needed: {needed} finite numbers")]
    NoPose {
        /// The angles that it reports.
        found: String,
        /// The number of joints.
        needed: usize,
    },
    /// The motion takes too long.
    #[error("the {motion} has not ended {after_s:.1} s after it was sent; planned are {planned_s:.1} s")]
    Overdue {
        /// The motion.
        motion: String,
        /// Time since it was sent (s).
        after_s: f64,
        /// Its planned duration (s).
        planned_s: f64,
    },
    /// The robot refused a request.
    #[error("{request} was refused: {answer}")]
    Refused {
        /// The request.
        request: String,
        /// The robot's answer.
        answer: String,
    },
}

impl Fault {
    /// A connection that could not be made.
    pub(crate) fn unreachable(cause: impl std::fmt::Display) -> Self {
        Self::Unreachable { cause: cause.to_string() }
    }

    /// A link that has just failed; the caller adds the time since the last answer.
    pub(crate) fn link(cause: impl std::fmt::Display) -> Self {
        Self::LostLink { silent_s: 0.0, cause: cause.to_string() }
    }
}
