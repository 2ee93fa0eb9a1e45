//! What a robot reports of its arm, and how it is stopped.

/// The arm as a robot reports it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ArmState {
    pub(crate) q_rad: Vec<f64>,
    pub(crate) moving: bool,
}

/// How hard to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stop {
    /// Along the path, motors holding.
    Smooth,
    /// With the brakes in the end.
    Brake,
}
