//! How does the striker move?
//!
//! It is a body of prescribed motion: from its start it moves `travel_m` at constant speed, stops, and draws back along the
//! same line to 20 mm behind its start.  Impacts do not change its path, which the servos of the arm maintain; a finite
//! effective mass (Eq. 8) only reduces the impulse.  Whether an object is scattered or pushed (Eq. 27 and 28) follows from the
//! impacts: with e > 0 the object always leaves at `(1 + e) v`, and the striker reaches it again after `2 e v / (mu g)`.

use crate::geometry::{Pose, Vec2};
use crate::physics::rotation::length;
use crate::physics::sliding::motion::Motion;
use crate::scene::{RETRACT_PAST_START_M, Strike};

/// What the striker does after it stops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AfterStrike {
    /// It draws back along the line of the strike.
    #[default]
    Retract,
    /// It is lifted off the table.
    Lift,
}

/// The prescribed motions of the striker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StrikerSchedule {
    start: Pose,
    velocity: Vec2,
    forward_s: f64,
    back: Option<(Vec2, f64)>,
}

/// The present phase of the striker's motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Moving towards the objects.
    Forward,
    /// Drawing back.
    Retract,
    /// Stopped, after drawing back or where it was blocked.
    Stopped,
    /// Lifted off the table.
    Lifted,
}

impl StrikerSchedule {
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

    /// The motion towards the objects.
    pub(crate) fn forward(&self) -> Motion {
        Motion::prescribed(self.start, self.velocity, 0.0, self.forward_s)
    }

    /// The phase and motion that follow a phase which ends at a pose.
    pub(crate) fn next(&self, phase: Phase, pose: Pose, time_s: f64) -> (Phase, Motion) {
        match (phase, self.back) {
            (Phase::Forward, Some((velocity, back_s))) => {
                // A striker that was blocked has a shorter distance to draw back.
                let saved_s = (self.forward_s - time_s) * length(self.velocity) / length(velocity);
                (Phase::Retract, Motion::prescribed(pose, velocity, time_s, time_s + back_s - saved_s))
            }
            (Phase::Forward, None) => (Phase::Lifted, Motion::rest(pose, time_s)),
            _ => (Phase::Stopped, Motion::rest(pose, time_s)),
        }
    }
}
