//! Where is a body between two impacts?
//!
//! A [`Motion`] is everything from one impact to rest.  Without spin it is a parabola in time (Eq. 26 and 30), with
//! spin a piece of the shape's [`SlideCurve`](super::curve::SlideCurve); the path is straight in both cases, for the friction of a round patch points
//! against the velocity.  Friction stops a body, it never turns it back.

use super::body::Body;
use super::curve::Place;
use crate::geometry::{Point, Pose, Vec2};

/// Place and speeds of a body at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct State {
    /// The centroid.
    pub(crate) position: Point,
    /// Its velocity.
    pub(crate) velocity: Vec2,
    /// How it is turned (rad).
    pub(crate) yaw_rad: f64,
    /// How fast it turns (rad/s).
    pub(crate) yaw_rate_rad_s: f64,
}

/// From one impact to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Motion {
    /// When it starts.
    pub(crate) start_s: f64,
    /// When the body rests; infinite for a prescribed motion.
    pub(crate) stop_s: f64,
    /// Where it starts.
    pub(crate) start: Pose,
    /// Where it ends; the start again for a prescribed motion.
    pub(crate) end: Pose,
    /// Unit vector along the path; zero if it has none.
    pub(crate) direction: Vec2,
    /// Speed at the start (m/s).
    pub(crate) speed_m_s: f64,
    /// Rate of turn at the start (rad/s).
    pub(crate) yaw_rate_rad_s: f64,
    /// How both speeds fall.
    pub(crate) law: Law,
}

/// How the speeds of a motion fall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Law {
    /// The body rests.
    Rest,
    /// Evenly, sliding and spinning apart from each other.
    Even {
        /// Deceleration (m/s2).
        deceleration_m_s2: f64,
        /// Deceleration of the turn (rad/s2), not negative.
        yaw_deceleration_rad_s2: f64,
    },
    /// Along the shape's slide curve.
    Curved {
        /// The curve's branch.
        branch: u8,
        /// The slide's time unit over the curve's (s).
        scale_s: f64,
    },
}

/// How sliding and spinning act on each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spin {
    /// Through the support's pressure: spin makes a body slide farther.
    #[default]
    Coupled,
    /// Not at all: each as if the other were not there.
    Decoupled,
}

impl Motion {
    /// A body that rests.
    pub(crate) fn rest(pose: Pose, time_s: f64) -> Self {
        Self {
            start_s: time_s,
            stop_s: time_s,
            start: pose,
            end: pose,
            direction: Vec2::ZERO,
            speed_m_s: 0.0,
            yaw_rate_rad_s: 0.0,
            law: Law::Rest,
        }
    }

    /// A body that something else moves at a constant velocity.
    pub(crate) fn prescribed(pose: Pose, velocity: Vec2, time_s: f64) -> Self {
        let speed_m_s = length(velocity);
        let law = Law::Even { deceleration_m_s2: 0.0, yaw_deceleration_rad_s2: 0.0 };
        let rest = Self::rest(pose, time_s);
        Self { stop_s: f64::INFINITY, direction: velocity / speed_m_s, speed_m_s, law, ..rest }
    }

    /// A body let go: it slides and spins until friction has stopped it.
    pub(crate) fn slide(state: &State, time_s: f64, body: &Body, spin: Spin) -> Self {
        let (v, w) = (length(state.velocity), state.yaw_rate_rad_s.abs());
        let grip = body.grip_m_s2;
        let (at_rest_v, at_rest_w) = (v < SPEED_AT_REST_M_S, w * body.patch_radius_m < SPEED_AT_REST_M_S);
        let pose = Pose { position: state.position, yaw_rad: state.yaw_rad };
        let mut motion = Self::rest(pose, time_s);
        if at_rest_v && at_rest_w {
            return motion;
        }
        let yaw_deceleration_rad_s2 = body.spin_deceleration_rad_s2();
        let even = Law::Even { deceleration_m_s2: grip, yaw_deceleration_rad_s2 };
        motion.law = even;
        if !at_rest_v {
            motion.direction = state.velocity / v;
            motion.speed_m_s = v;
        }
        if !at_rest_w {
            motion.yaw_rate_rad_s = state.yaw_rate_rad_s;
        }
        if spin == Spin::Coupled && !at_rest_v && !at_rest_w {
            motion.couple(body);
        } else {
            motion.stop_s =
                time_s + (motion.speed_m_s / grip).max(motion.yaw_rate_rad_s.abs() / yaw_deceleration_rad_s2);
        }
        motion.find_end(body);
        motion
    }

    /// Finds the place on the body's slide curve.
    fn couple(&mut self, body: &Body) {
        let (grip, radius_m) = (body.grip_m_s2, body.patch_radius_m);
        // Speeds in units of mu g times one second.
        let (v, w) = (self.speed_m_s / grip, self.yaw_rate_rad_s.abs() * radius_m / grip);
        match body.curve.place(v, w) {
            Place::Even { remaining } => {
                self.stop_s = self.start_s + remaining;
                self.law = Law::Even {
                    deceleration_m_s2: self.speed_m_s / remaining,
                    yaw_deceleration_rad_s2: self.yaw_rate_rad_s.abs() / remaining,
                };
            }
            Place::Curved { branch, remaining, scale } => {
                self.stop_s = self.start_s + remaining * scale;
                self.law = Law::Curved { branch, scale_s: scale };
            }
        }
    }

    fn find_end(&mut self, body: &Body) {
        let (way_m, turn_rad) = match self.law {
            Law::Rest => (0.0, 0.0),
            Law::Even { deceleration_m_s2, yaw_deceleration_rad_s2 } => (
                0.5 * self.speed_m_s * self.speed_m_s / deceleration_m_s2,
                0.5 * self.yaw_rate_rad_s * self.yaw_rate_rad_s.abs() / yaw_deceleration_rad_s2,
            ),
            Law::Curved { branch, scale_s } => {
                let (way_m, _, turn_rad, _) = self.remainder(branch, scale_s, self.start_s, body);
                (way_m, turn_rad)
            }
        };
        self.end = Pose {
            position: self.start.position + self.direction * way_m,
            yaw_rad: self.start.yaw_rad + turn_rad,
        };
    }

    /// Way (m), speed (m/s), turn (rad) and rate (rad/s) that remain at a time.
    fn remainder(&self, branch: u8, scale_s: f64, time_s: f64, body: &Body) -> (f64, f64, f64, f64) {
        let rest = body.curve.remainder(branch, (self.stop_s - time_s) / scale_s);
        let speed_unit = body.grip_m_s2 * scale_s;
        let way_unit = speed_unit * scale_s;
        let per_radius = 1.0f64.copysign(self.yaw_rate_rad_s) / body.patch_radius_m;
        (
            rest.way * way_unit,
            rest.speed * speed_unit,
            rest.turn * way_unit * per_radius,
            rest.rim_speed * speed_unit * per_radius,
        )
    }

    /// Where the body is at a time not before the start.
    pub(crate) fn state(&self, time_s: f64, body: &Body) -> State {
        if time_s >= self.stop_s {
            let Pose { position, yaw_rad } = self.end;
            return State { position, yaw_rad, ..State::default() };
        }
        let time = time_s - self.start_s;
        match self.law {
            Law::Rest => State { position: self.end.position, yaw_rad: self.end.yaw_rad, ..State::default() },
            Law::Even { deceleration_m_s2, yaw_deceleration_rad_s2 } => {
                let (way_m, speed_m_s) = fallen(self.speed_m_s, deceleration_m_s2, time);
                let (turn_rad, rate) = fallen(self.yaw_rate_rad_s.abs(), yaw_deceleration_rad_s2, time);
                let sign = 1.0f64.copysign(self.yaw_rate_rad_s);
                State {
                    position: self.start.position + self.direction * way_m,
                    velocity: self.direction * speed_m_s,
                    yaw_rad: self.start.yaw_rad + sign * turn_rad,
                    yaw_rate_rad_s: sign * rate,
                }
            }
            Law::Curved { branch, scale_s } => {
                let (way_m, speed_m_s, turn_rad, yaw_rate_rad_s) =
                    self.remainder(branch, scale_s, time_s, body);
                State {
                    position: self.end.position - self.direction * way_m,
                    velocity: self.direction * speed_m_s,
                    yaw_rad: self.end.yaw_rad - turn_rad,
                    yaw_rate_rad_s,
                }
            }
        }
    }
}

/// Below a nanometre a second a body rests: friction stops it within an atom's width.
const SPEED_AT_REST_M_S: f64 = 1e-9;

/// Way (or turn) and speed after a time of even deceleration, which stops but never turns back.
fn fallen(speed: f64, deceleration: f64, time_s: f64) -> (f64, f64) {
    let lost = deceleration * time_s;
    if lost >= speed && deceleration > 0.0 {
        return (0.5 * speed * speed / deceleration, 0.0);
    }
    (time_s * (speed - 0.5 * lost), speed - lost)
}

/// The length of a vector of ordinary size, quicker than one that guards against overflow.
pub(crate) fn length(v: Vec2) -> f64 {
    v.length_squared().sqrt()
}
