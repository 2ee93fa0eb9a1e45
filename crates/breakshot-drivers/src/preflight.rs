//! The checks of a robot before the arm moves.

use serde::Serialize;

/// A setting or state of the robot, read before the arm moves.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PreflightCheck {
    /// The setting's name.
    pub what: String,
    /// The value read from the robot.
    pub found: String,
    /// The required value; empty for a value that is reported only.
    pub needed: String,
    /// Whether the value read satisfies the requirement.
    pub holds: bool,
}

impl PreflightCheck {
    pub(crate) fn new(
        what: impl Into<String>,
        found: impl std::fmt::Display,
        needed: impl Into<String>,
        holds: bool,
    ) -> Self {
        Self { what: what.into(), found: found.to_string(), needed: needed.into(), holds }
    }

    /// A value that is reported without a requirement.
    pub(crate) fn note(what: impl Into<String>, found: impl std::fmt::Display) -> Self {
        Self::new(what, found, "", true)
    }
}
