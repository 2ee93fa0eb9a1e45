//! What ends a motion before its time.

use serde::Serialize;

/// Why the arm was stopped, or not moved at all.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Trouble {
    /// The robot cannot be reached at all; nothing was sent.
    #[error("the robot cannot be reached: {cause}")]
    Unreachable {
        /// What the network said.
        cause: String,
    },
    /// The robot does not answer.
    #[error("no answer from the robot for {silent_s:.3} s ({cause}); motion already sent may finish")]
    LostLink {
        /// How long it has been silent (s).
        silent_s: f64,
        /// What the network said.
        cause: String,
    },
    /// The controller says that a limit was broken.
    #[error("the controller reports a violation")]
    Violation,
    /// The controller says that the arm has run into something.
    #[error("the controller reports a collision")]
    Collision,
    /// The controller is in a state in which it carries nothing out, such as after an emergency stop.
    #[error("the controller is not ready to move: {state}")]
    NotReady {
        /// What it says it is.
        state: String,
    },
    /// The user asked to stop.
    #[error("stopped by the user")]
    Interrupted,
    /// The arm is somewhere else than the path.
    #[error("joint `{joint}` is {off_rad:.3} rad off the path")]
    OffPath {
        /// The joint that is farthest off.
        joint: String,
        /// How far (rad).
        off_rad: f64,
    },
    /// The motion takes too long.
    #[error("the {motion} has not ended {after_s:.1} s after it was sent; it should take {planned_s:.1} s")]
    Overdue {
        /// Which motion.
        motion: String,
        /// How long ago it was sent (s).
        after_s: f64,
        /// How long it should take (s).
        planned_s: f64,
    },
    /// The robot answered, but not with yes.
    #[error("{request} was refused: {answer}")]
    Refused {
        /// What it was asked.
        request: String,
        /// What it said.
        answer: String,
    },
}

impl Trouble {
    /// A robot that never answered.
    pub(crate) fn unreachable(cause: impl std::fmt::Display) -> Self {
        Self::Unreachable { cause: cause.to_string() }
    }

    /// A link that has just failed; how long it is silent is for the caller to say.
    pub(crate) fn link(cause: impl std::fmt::Display) -> Self {
        Self::LostLink { silent_s: 0.0, cause: cause.to_string() }
    }
}
