//! The state that a robot reports of its arm, and the kinds of stop.

/// The arm's state as reported by the robot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ArmState {
    /// Joint angles (rad).
    pub(crate) q_rad: Vec<f64>,
    /// Whether a motion is under way.
    pub(crate) moving: bool,
    /// Largest possible age of the angles (s).
    pub(crate) age_s: f64,
}

/// The stop category.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stop {
    /// Decelerates along the path; the motors hold the arm afterwards.
    Smooth,
    /// Decelerates along the path, then applies the brakes.
    Brake,
}

/// What a robot answers to a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StopAnswer {
    /// The controller has confirmed it.
    Confirmed,
    /// It was sent, and is never answered: only the arm's rest confirms it.
    Asked,
}
