//! Why the arm cannot carry out a strike, found out attempt by attempt.

use super::limits::Check;

/// What would have to change for an attempt to work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Blame {
    /// The run-up: a harder one is shorter.
    RunUp,
    /// The stop: a softer one asks less of the joints.
    Stop,
    /// The posture, whatever the run-up and the stop.
    Posture,
}

/// Why an attempt failed, how far it got and how much is missing.
#[derive(Clone, Debug)]
pub(crate) struct Failure {
    pub(crate) stage: Stage,
    pub(crate) excess: f64,
    pub(crate) reason: String,
    pub(crate) part: Option<String>,
    /// When, since the phase's or the command's start (s).
    pub(crate) time_s: f64,
    pub(crate) blame: Blame,
}

/// How far an attempt got.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Stage {
    /// Out of reach, or at the end of a joint's range.
    Reach,
    /// Something stands in the way.
    Room,
    /// The strike itself breaks a limit.
    Strike,
    /// The way to it or back does.
    Way,
    /// All together do.
    Whole,
}

impl Failure {
    pub(crate) fn new(stage: Stage, reason: impl Into<String>) -> Self {
        Self {
            stage,
            excess: f64::MAX,
            reason: reason.into(),
            part: None,
            time_s: 0.0,
            blame: Blame::Posture,
        }
    }

    pub(crate) fn of_check(stage: Stage, check: &Check) -> Self {
        let part = Some(check.part.clone());
        Self {
            stage,
            excess: check.excess(),
            reason: check.sentence(),
            part,
            time_s: check.time_s,
            blame: Blame::Posture,
        }
    }

    /// The one that came nearer to working.
    pub(crate) fn better(self, other: Self) -> Self {
        let is_other = (other.stage, -other.excess) > (self.stage, -self.excess);
        if is_other { other } else { self }
    }
}

/// What came of an attempt.
pub(crate) type Attempted<T> = std::result::Result<T, Failure>;
