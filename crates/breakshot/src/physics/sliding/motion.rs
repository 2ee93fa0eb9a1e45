//! Where is a body between two impacts?
//!
//! A [`Motion`] is everything from one impact to rest.  Without spin it is a parabola in time (Eq. 26 and 30), with
//! spin a piece of the shape's [`SlideCurve`](crate::physics::sliding::slide_curve::SlideCurve); the path is straight in both cases, for the friction of a round patch points
//! against the velocity.  Friction stops a body, it never turns it back.

use crate::geometry::{Point, Pose, Vec2};
use crate::physics::sliding::body::Body;
use crate::physics::sliding::slide_curve::Place;

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
    /// Half the length of the path (m); it is straight.
    pub(crate) half_way_m: f64,
    /// Unit vector along the path; zero if it has none.
    pub(crate) direction: Vec2,
    /// Speed at the start (m/s).
    pub(crate) speed_m_s: f64,
    /// Rate of turn at the start (rad/s).
    pub(crate) yaw_rate_rad_s: f64,
    /// Least and greatest deceleration on the way (m/s2).
    pub(crate) deceleration_m_s2: [f64; 2],
    /// Greatest deceleration of the turn (rad/s2).
    pub(crate) yaw_deceleration_rad_s2: f64,
    /// How both speeds fall.
    pub(crate) law: Law,
}

/// How the speeds of a motion fall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Law {
    /// The body rests.
    Rest,
    /// Evenly, sliding and spinning apart from each other.
    Even,
    /// Along the shape's slide curve.
    Curved {
        /// The curve's branch.
        branch: u8,
        /// The slide's time unit over the curve's (s).
        scale_s: f64,
    },
    /// Evenly, for a stretch of a bent way, at whose end the motion goes on.
    Bent {
        /// With this velocity.
        onward: Vec2,
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
            half_way_m: 0.0,
            direction: Vec2::ZERO,
            speed_m_s: 0.0,
            yaw_rate_rad_s: 0.0,
            deceleration_m_s2: [0.0; 2],
            yaw_deceleration_rad_s2: 0.0,
            law: Law::Rest,
        }
    }

    /// A body that something else moves at a constant velocity until a time.
    pub(crate) fn prescribed(pose: Pose, velocity: Vec2, start_s: f64, stop_s: f64) -> Self {
        let speed_m_s = length(velocity);
        let end = Pose { position: pose.position + velocity * (stop_s - start_s), ..pose };
        let rest = Self::rest(pose, start_s);
        let (direction, half_way_m) = (velocity / speed_m_s, 0.5 * speed_m_s * (stop_s - start_s));
        Self { stop_s, end, half_way_m, direction, speed_m_s, law: Law::Even, ..rest }
    }

    /// A body let go: it slides and spins until friction has stopped it.
    pub(crate) fn slide(state: &State, time_s: f64, body: &Body, spin: Spin) -> Self {
        let (v, w) = (length(state.velocity), state.yaw_rate_rad_s.abs() * body.patch_radius_m);
        let pose = Pose { position: state.position, yaw_rad: state.yaw_rad };
        if spin == Spin::Coupled
            && v.max(w) >= SPEED_AT_REST_M_S
            && let Some(hold) = &body.hold
            && let Some(motion) = Self::bent(state, time_s, body, hold)
        {
            return motion;
        }
        let mut motion = Self::rest(pose, time_s);
        if v >= SPEED_AT_REST_M_S {
            motion.direction = state.velocity / v;
            motion.speed_m_s = v;
            motion.law = Law::Even;
            motion.deceleration_m_s2 = [body.grip_m_s2; 2];
            motion.stop_s = time_s + v / body.grip_m_s2;
        }
        if w >= SPEED_AT_REST_M_S {
            motion.yaw_rate_rad_s = state.yaw_rate_rad_s;
            motion.law = Law::Even;
            motion.yaw_deceleration_rad_s2 = body.spin_deceleration_rad_s2();
            motion.stop_s =
                motion.stop_s.max(time_s + state.yaw_rate_rad_s.abs() / motion.yaw_deceleration_rad_s2);
        }
        if spin == Spin::Coupled && motion.speed_m_s > 0.0 && motion.yaw_rate_rad_s != 0.0 {
            motion.couple(body);
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
                self.deceleration_m_s2 = [self.speed_m_s / remaining; 2];
                self.yaw_deceleration_rad_s2 = self.yaw_rate_rad_s.abs() / remaining;
            }
            Place::Curved { branch, remaining, scale } => {
                self.stop_s = self.start_s + remaining * scale;
                self.law = Law::Curved { branch, scale_s: scale };
                let bounds = body.curve.bounds(branch, remaining);
                self.deceleration_m_s2 = bounds.way.map(|f| f * grip);
                self.yaw_deceleration_rad_s2 = bounds.turn * grip / radius_m;
            }
        }
    }

    fn find_end(&mut self, body: &Body) {
        let (way_m, turn_rad) = match self.law {
            Law::Rest | Law::Bent { .. } => return,
            Law::Even => (
                stopping_way(self.speed_m_s, self.deceleration_m_s2[0]),
                stopping_way(self.yaw_rate_rad_s.abs(), self.yaw_deceleration_rad_s2)
                    .copysign(self.yaw_rate_rad_s),
            ),
            Law::Curved { branch, scale_s } => {
                let left = self.left(branch, scale_s, self.start_s, body);
                (left.way_m, left.turn_rad)
            }
        };
        self.half_way_m = 0.5 * way_m;
        self.end = Pose {
            position: self.start.position + self.direction * way_m,
            yaw_rad: self.start.yaw_rad + turn_rad,
        };
    }

    /// What is left of a curved slide at a time.
    fn left(&self, branch: u8, scale_s: f64, time_s: f64, body: &Body) -> Left {
        let rest = body.curve.remainder(branch, (self.stop_s - time_s) / scale_s);
        let speed_unit = body.grip_m_s2 * scale_s;
        let way_unit = speed_unit * scale_s;
        let per_radius = 1.0f64.copysign(self.yaw_rate_rad_s) / body.patch_radius_m;
        Left {
            way_m: rest.way * way_unit,
            speed_m_s: rest.speed * speed_unit,
            turn_rad: rest.turn * way_unit * per_radius,
            rate_rad_s: rest.rim_speed * speed_unit * per_radius,
        }
    }

    /// Where the body is at a time not before the start.
    pub(crate) fn state(&self, time_s: f64, body: &Body) -> State {
        if time_s >= self.stop_s && (time_s > self.stop_s || !self.is_bent()) {
            let Pose { position, yaw_rad } = self.end;
            return State { position, yaw_rad, ..State::default() };
        }
        if time_s == self.start_s {
            let Pose { position, yaw_rad } = self.start;
            let velocity = self.direction * self.speed_m_s;
            return State { position, velocity, yaw_rad, yaw_rate_rad_s: self.yaw_rate_rad_s };
        }
        match self.law {
            Law::Rest => State { position: self.end.position, yaw_rad: self.end.yaw_rad, ..State::default() },
            Law::Even | Law::Bent { .. } => {
                let time = time_s - self.start_s;
                let (way_m, speed_m_s) = fallen(self.speed_m_s, self.deceleration_m_s2[0], time);
                let mut state = State {
                    position: self.start.position + self.direction * way_m,
                    velocity: self.direction * speed_m_s,
                    yaw_rad: self.start.yaw_rad,
                    yaw_rate_rad_s: 0.0,
                };
                if self.yaw_rate_rad_s != 0.0 {
                    let (turn_rad, rate) =
                        fallen(self.yaw_rate_rad_s.abs(), self.yaw_deceleration_rad_s2, time);
                    state.yaw_rad += turn_rad.copysign(self.yaw_rate_rad_s);
                    state.yaw_rate_rad_s = rate.copysign(self.yaw_rate_rad_s);
                }
                state
            }
            Law::Curved { branch, scale_s } => {
                let left = self.left(branch, scale_s, time_s, body);
                State {
                    position: self.end.position - self.direction * left.way_m,
                    velocity: self.direction * left.speed_m_s,
                    yaw_rad: self.end.yaw_rad - left.turn_rad,
                    yaw_rate_rad_s: left.rate_rad_s,
                }
            }
        }
    }

    /// The middle of the path.
    pub(crate) fn middle(&self) -> Point {
        self.start.position + self.direction * self.half_way_m
    }

    /// Whether it goes on where it ends.
    pub(crate) fn is_bent(&self) -> bool {
        matches!(self.law, Law::Bent { .. })
    }

    /// The greatest speed and rate of turn from now on; only on a bent way can they grow.
    pub(crate) fn greatest_speeds(&self, state: &State) -> (f64, f64) {
        let (speed, rate) = (length(state.velocity), state.yaw_rate_rad_s.abs());
        if !self.is_bent() {
            return (speed, rate);
        }
        let time = self.stop_s - self.start_s;
        let last = |first: f64, lost: f64| first - lost * time;
        (
            speed.max(last(self.speed_m_s, self.deceleration_m_s2[0])),
            rate.max(last(self.yaw_rate_rad_s.abs(), self.yaw_deceleration_rad_s2)),
        )
    }

    /// When the body has gone a way from where it is at `from_s`; none if it stops before.
    pub(crate) fn time_of_way_s(&self, way_m: f64, from_s: f64, body: &Body) -> Option<f64> {
        let Law::Curved { branch, scale_s } = self.law else {
            let deceleration = self.deceleration_m_s2[0];
            let speed_m_s = self.speed_m_s - deceleration * (from_s - self.start_s);
            let square = speed_m_s * speed_m_s - 2.0 * deceleration * way_m;
            let time_s = from_s + 2.0 * way_m / (speed_m_s + square.max(0.0).sqrt());
            return (square >= 0.0 && time_s < self.stop_s).then_some(time_s);
        };
        let remaining = (self.stop_s - from_s) / scale_s;
        let rest = body.curve.remainder(branch, remaining);
        let left = rest.way - way_m / (body.grip_m_s2 * scale_s * scale_s);
        if left <= 0.0 {
            return None;
        }
        Some(self.stop_s - scale_s * body.curve.remaining_of_way(branch, left, remaining))
    }
}

/// What is left of a slide.
struct Left {
    way_m: f64,
    speed_m_s: f64,
    turn_rad: f64,
    rate_rad_s: f64,
}

/// The way (or turn) in which even deceleration stops a speed; zero for nothing that moves.
fn stopping_way(speed: f64, deceleration: f64) -> f64 {
    if speed == 0.0 { 0.0 } else { 0.5 * speed * speed / deceleration }
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
