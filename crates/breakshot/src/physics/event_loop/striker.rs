//! How does the striker move?
//!
//! It is a body of prescribed motion: from rest at its start it runs `travel_m` at constant speed, stops, and draws back
//! the way it came, 20 mm past its start.  What it touches cannot change its path (an arm's servo holds it); a finite
//! effective mass (Eq. 8) only softens the blow.  Whether an object is scattered or pushed (Eq. 27 and 28) follows
//! from the impacts: with e > 0 it always leaves at `(1 + e) v`, and the striker catches up after `2 e v / (mu g)`.

use crate::geometry::{Pose, Vec2};
use crate::physics::sliding::motion::{Motion, length};
use crate::scene::Strike;

/// How far past its start the striker draws back (m).
pub const RETRACT_PAST_START_M: f64 = 0.02;

/// What the striker does after it stops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AfterStrike {
    /// It draws back the way it came.
    #[default]
    Retract,
    /// It is lifted off the table.
    Lift,
}

/// The striker's plan: when its motion changes, and to what.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Program {
    start: Pose,
    velocity: Vec2,
    forward_s: f64,
    back: Option<(Vec2, f64)>,
}

/// The striker's phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Towards the objects.
    Forward,
    /// The way back.
    Back,
    /// It stands where it drew back to, or where something blocked it.
    Standing,
    /// Off the table.
    Gone,
}

impl Program {
    pub(crate) fn new(strike: &Strike, retract_speed_m_s: f64, after: AfterStrike) -> Self {
        let along = Vec2::from_heading(strike.heading_rad);
        let back_s = (strike.travel_m + RETRACT_PAST_START_M) / retract_speed_m_s;
        Self {
            start: Pose { position: strike.start_m, yaw_rad: strike.heading_rad },
            velocity: along * strike.speed_m_s,
            forward_s: strike.travel_m / strike.speed_m_s,
            back: (after == AfterStrike::Retract).then_some((-along * retract_speed_m_s, back_s)),
        }
    }

    /// The striker's first motion.
    pub(crate) fn forward(&self) -> Motion {
        Motion::prescribed(self.start, self.velocity, 0.0, self.forward_s)
    }

    /// The phase and the motion after another phase has ended at a place.
    pub(crate) fn next(&self, phase: Phase, pose: Pose, time_s: f64) -> (Phase, Motion) {
        match (phase, self.back) {
            (Phase::Forward, Some((velocity, back_s))) => {
                // A striker that was blocked has less way back.
                let spared_s = (self.forward_s - time_s) * length(self.velocity) / length(velocity);
                (Phase::Back, Motion::prescribed(pose, velocity, time_s, time_s + back_s - spared_s))
            }
            (Phase::Forward, None) => (Phase::Gone, Motion::rest(pose, time_s)),
            _ => (Phase::Standing, Motion::rest(pose, time_s)),
        }
    }
}
