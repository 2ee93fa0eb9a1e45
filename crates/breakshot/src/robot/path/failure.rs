//! Why does an attempt at a path fail, and what would have to change?

use super::limits::LimitCheck;

/// The change that could make a failed attempt succeed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Remedy {
    /// A shorter run-up, with a higher acceleration.
    ShorterRunUp,
    /// A softer stop, with a lower joint load.
    SofterStop,
    /// Another IK solution.
    OtherSolution,
}

/// A failed attempt: its reason, how far the attempt got, and by how much it exceeds a limit.
#[derive(Clone, Debug)]
pub(crate) struct Failure {
    pub(crate) stage: SearchStage,
    /// The excess over the limit as a fraction of the limit.
    pub(crate) excess: f64,
    pub(crate) reason: String,
    pub(crate) part: Option<String>,
    /// Time since the start of the phase or of the command (s).
    pub(crate) time_s: f64,
    pub(crate) remedy: Remedy,
}

/// The stage of the search in which an attempt failed, the earliest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum SearchStage {
    /// A point is out of reach, or a joint is at the end of its range.
    Reach,
    /// An obstacle is in the striker's path.
    Obstacle,
    /// The strike itself exceeds a limit.
    Strike,
    /// The motion to the strike or back exceeds a limit.
    Transfer,
    /// The assembled path exceeds a limit.
    Whole,
}

impl Failure {
    pub(crate) fn new(stage: SearchStage, reason: impl Into<String>) -> Self {
        Self {
            stage,
            excess: f64::MAX,
            reason: reason.into(),
            part: None,
            time_s: 0.0,
            remedy: Remedy::OtherSolution,
        }
    }

    pub(crate) fn of_check(stage: SearchStage, check: &LimitCheck) -> Self {
        Self {
            stage,
            excess: check.excess(),
            reason: check.sentence(),
            part: Some(check.part.clone()),
            time_s: check.time_s,
            remedy: Remedy::OtherSolution,
        }
    }

    /// The failure of the more advanced attempt; in the same stage, the one with the smaller excess.
    pub(crate) fn better(self, other: Self) -> Self {
        let is_other = (other.stage, -other.excess) > (self.stage, -self.excess);
        if is_other { other } else { self }
    }
}

/// The result of an attempt.
pub(crate) type Attempted<T> = std::result::Result<T, Failure>;
