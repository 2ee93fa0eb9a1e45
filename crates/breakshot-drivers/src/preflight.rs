//! What is looked at before the arm moves.

use serde::Serialize;

/// One thing that was looked at before the arm moved.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What was looked at.
    pub what: String,
    /// What was found.
    pub found: String,
    /// What is needed; empty if it is only good to know.
    pub needed: String,
    /// Whether it is as needed.
    pub holds: bool,
}

impl Finding {
    pub(crate) fn new(
        what: impl Into<String>,
        found: impl std::fmt::Display,
        needed: impl Into<String>,
        holds: bool,
    ) -> Self {
        Self { what: what.into(), found: found.to_string(), needed: needed.into(), holds }
    }

    /// Good to know, nothing is asked of it.
    pub(crate) fn note(what: impl Into<String>, found: impl std::fmt::Display) -> Self {
        Self::new(what, found, "", true)
    }
}
