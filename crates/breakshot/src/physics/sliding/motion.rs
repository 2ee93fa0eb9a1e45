//! What is the motion of a body from one impact to rest?
//!
//! Without spin it is a parabola in time (Eq. 26 and 30), with spin a part of the shape's
//! [`SlideCurve`](super::slide_curve::SlideCurve).  The path is straight in both cases, because the friction on a round patch
//! is opposite to the velocity.  On any other support, and on a tilted table, the path is curved: it is followed in pieces, each straight and
//! uniformly braked.  Friction stops a body and never reverses its motion.

use crate::geometry::{Point, Pose, Vec2};
use crate::physics::rotation::length;
use crate::physics::sliding::body::Body;
use crate::physics::sliding::patch_friction::Spin;
use crate::physics::sliding::slide_curve::CurvePosition;

/// Pose and velocities of a body at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct State {
    /// Position of the centroid.
    pub(crate) position: Point,
    /// Velocity of the centroid.
    pub(crate) velocity: Vec2,
    /// Yaw (rad).
    pub(crate) yaw_rad: f64,
    /// Yaw rate (rad/s).
    pub(crate) yaw_rate_rad_s: f64,
}

/// A body in a state of motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyState<'a> {
    pub(crate) body: &'a Body,
    pub(crate) state: &'a State,
}

/// The motion of a body from one impact to rest, or one piece of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Motion {
    /// Start time (s).
    pub(crate) start_s: f64,
    /// Time at which the body rests or the piece ends (s).
    pub(crate) stop_s: f64,
    /// Pose at the start.
    pub(crate) start: Pose,
    /// Pose at the end.
    pub(crate) end: Pose,
    /// Half the length of the straight path (m).
    pub(crate) half_distance_m: f64,
    /// Unit vector along the path; zero for a path without length.
    pub(crate) direction: Vec2,
    /// Speed at the start (m/s).
    pub(crate) speed_m_s: f64,
    /// Yaw rate at the start (rad/s).
    pub(crate) yaw_rate_rad_s: f64,
    /// Least and greatest deceleration along the path (m/s2).
    pub(crate) deceleration_m_s2: [f64; 2],
    /// Greatest angular deceleration (rad/s2).
    pub(crate) yaw_deceleration_rad_s2: f64,
    /// How speed and yaw rate decrease.
    pub(crate) law: SpeedLaw,
}

/// How the speeds of a motion decrease.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SpeedLaw {
    /// The body rests.
    Rest,
    /// Constant decelerations, sliding and spinning independent of each other.
    Uniform,
    /// Coupled sliding and spinning on the shape's slide curve.
    Curved {
        /// Branch of the curve.
        branch: u8,
        /// Time unit of the slide over that of the curve (s).
        scale_s: f64,
    },
    /// Constant decelerations over one piece of a curved path; the motion continues at its end.
    Piece {
        /// Velocity at the start of the next piece.
        next_velocity: Vec2,
    },
}

impl Motion {
    /// A body at rest.
    pub(crate) fn rest(pose: Pose, time_s: f64) -> Self {
        Self {
            start_s: time_s,
            stop_s: time_s,
            start: pose,
            end: pose,
            half_distance_m: 0.0,
            direction: Vec2::ZERO,
            speed_m_s: 0.0,
            yaw_rate_rad_s: 0.0,
            deceleration_m_s2: [0.0; 2],
            yaw_deceleration_rad_s2: 0.0,
            law: SpeedLaw::Rest,
        }
    }

    /// A prescribed motion at constant velocity, without rotation, until `stop_s`.
    pub(crate) fn prescribed(pose: Pose, velocity: Vec2, start_s: f64, stop_s: f64) -> Self {
        let speed_m_s = length(velocity);
        let end = Pose { position: pose.position + velocity * (stop_s - start_s), ..pose };
        let rest = Self::rest(pose, start_s);
        let (direction, half_distance_m) = (velocity / speed_m_s, 0.5 * speed_m_s * (stop_s - start_s));
        Self { stop_s, end, half_distance_m, direction, speed_m_s, law: SpeedLaw::Uniform, ..rest }
    }

    /// A free body that slides and spins until friction has stopped it.
    pub(crate) fn slide(state: &State, time_s: f64, body: &Body, spin: Spin) -> Self {
        let (v, w) = (length(state.velocity), state.yaw_rate_rad_s.abs() * body.patch_radius_m);
        let pose = Pose { position: state.position, yaw_rad: state.yaw_rad };
        let is_curved = body.limit_surface.is_some() && spin == Spin::Coupled || body.tilt_m_s2 != Vec2::ZERO;
        if is_curved
            && v.max(w) >= SPEED_AT_REST_M_S
            && let Some(motion) = Self::piece(state, time_s, body, spin)
        {
            return motion;
        }
        let mut motion = Self::rest(pose, time_s);
        if v >= SPEED_AT_REST_M_S {
            motion.direction = state.velocity / v;
            motion.speed_m_s = v;
            motion.law = SpeedLaw::Uniform;
            motion.deceleration_m_s2 = [body.friction_deceleration_m_s2; 2];
            motion.stop_s = time_s + v / body.friction_deceleration_m_s2;
        }
        if w >= SPEED_AT_REST_M_S {
            motion.yaw_rate_rad_s = state.yaw_rate_rad_s;
            motion.law = SpeedLaw::Uniform;
            motion.yaw_deceleration_rad_s2 = body.spin_deceleration_rad_s2();
            motion.stop_s =
                motion.stop_s.max(time_s + state.yaw_rate_rad_s.abs() / motion.yaw_deceleration_rad_s2);
        }
        if spin == Spin::Coupled && motion.speed_m_s > 0.0 && motion.yaw_rate_rad_s != 0.0 {
            motion.couple_spin(body);
        }
        motion.set_end(body);
        motion
    }

    /// Replaces independent sliding and spinning by the body's slide curve.
    fn couple_spin(&mut self, body: &Body) {
        let (friction_deceleration, radius_m) = (body.friction_deceleration_m_s2, body.patch_radius_m);
        // Speeds in units of mu g times 1 s.
        let (v, w) = (
            self.speed_m_s / friction_deceleration,
            self.yaw_rate_rad_s.abs() * radius_m / friction_deceleration,
        );
        match body.curve.position(v, w) {
            CurvePosition::Uniform { remaining } => {
                self.stop_s = self.start_s + remaining;
                self.deceleration_m_s2 = [self.speed_m_s / remaining; 2];
                self.yaw_deceleration_rad_s2 = self.yaw_rate_rad_s.abs() / remaining;
            }
            CurvePosition::Curved { branch, remaining, scale } => {
                self.stop_s = self.start_s + remaining * scale;
                self.law = SpeedLaw::Curved { branch, scale_s: scale };
                let bounds = body.curve.bounds(branch, remaining);
                self.deceleration_m_s2 = bounds.distance.map(|f| f * friction_deceleration);
                self.yaw_deceleration_rad_s2 = bounds.rotation * friction_deceleration / radius_m;
            }
        }
    }

    fn set_end(&mut self, body: &Body) {
        let (distance_m, rotation_rad) = match self.law {
            SpeedLaw::Rest | SpeedLaw::Piece { .. } => return,
            SpeedLaw::Uniform => (
                stopping_distance(self.speed_m_s, self.deceleration_m_s2[0]),
                stopping_distance(self.yaw_rate_rad_s.abs(), self.yaw_deceleration_rad_s2)
                    .copysign(self.yaw_rate_rad_s),
            ),
            SpeedLaw::Curved { branch, scale_s } => {
                let remaining_slide = self.remaining_slide(branch, scale_s, self.start_s, body);
                (remaining_slide.distance_m, remaining_slide.rotation_rad)
            }
        };
        self.half_distance_m = 0.5 * distance_m;
        self.end = Pose {
            position: self.start.position + self.direction * distance_m,
            yaw_rad: self.start.yaw_rad + rotation_rad,
        };
    }

    /// The rest of a slide on the curve, from a time on.
    fn remaining_slide(&self, branch: u8, scale_s: f64, time_s: f64, body: &Body) -> RemainingSlide {
        let rest = body.curve.remainder(branch, (self.stop_s - time_s) / scale_s);
        let speed_unit = body.friction_deceleration_m_s2 * scale_s;
        let distance_unit = speed_unit * scale_s;
        let per_radius = 1.0f64.copysign(self.yaw_rate_rad_s) / body.patch_radius_m;
        RemainingSlide {
            distance_m: rest.distance * distance_unit,
            speed_m_s: rest.speed * speed_unit,
            rotation_rad: rest.rotation * distance_unit * per_radius,
            yaw_rate_rad_s: rest.rim_speed * speed_unit * per_radius,
        }
    }

    /// The state at a time not before the start.
    pub(crate) fn state(&self, time_s: f64, body: &Body) -> State {
        if time_s >= self.stop_s && (time_s > self.stop_s || !self.is_piece()) {
            let Pose { position, yaw_rad } = self.end;
            return State { position, yaw_rad, ..State::default() };
        }
        if time_s == self.start_s {
            let Pose { position, yaw_rad } = self.start;
            let velocity = self.direction * self.speed_m_s;
            return State { position, velocity, yaw_rad, yaw_rate_rad_s: self.yaw_rate_rad_s };
        }
        match self.law {
            SpeedLaw::Rest => {
                State { position: self.end.position, yaw_rad: self.end.yaw_rad, ..State::default() }
            }
            SpeedLaw::Uniform | SpeedLaw::Piece { .. } => {
                let time = time_s - self.start_s;
                let (distance_m, speed_m_s) = braked(self.speed_m_s, self.deceleration_m_s2[0], time);
                let mut state = State {
                    position: self.start.position + self.direction * distance_m,
                    velocity: self.direction * speed_m_s,
                    yaw_rad: self.start.yaw_rad,
                    yaw_rate_rad_s: 0.0,
                };
                if self.yaw_rate_rad_s != 0.0 {
                    let (rotation_rad, rate) =
                        braked(self.yaw_rate_rad_s.abs(), self.yaw_deceleration_rad_s2, time);
                    state.yaw_rad += rotation_rad.copysign(self.yaw_rate_rad_s);
                    state.yaw_rate_rad_s = rate.copysign(self.yaw_rate_rad_s);
                }
                state
            }
            SpeedLaw::Curved { branch, scale_s } => {
                let remaining_slide = self.remaining_slide(branch, scale_s, time_s, body);
                State {
                    position: self.end.position - self.direction * remaining_slide.distance_m,
                    velocity: self.direction * remaining_slide.speed_m_s,
                    yaw_rad: self.end.yaw_rad - remaining_slide.rotation_rad,
                    yaw_rate_rad_s: remaining_slide.yaw_rate_rad_s,
                }
            }
        }
    }

    /// The middle of the path.
    pub(crate) fn middle(&self) -> Point {
        self.start.position + self.direction * self.half_distance_m
    }

    /// Whether another piece follows at its end.
    pub(crate) fn is_piece(&self) -> bool {
        matches!(self.law, SpeedLaw::Piece { .. })
    }

    /// Greatest speed (m/s) and yaw rate (rad/s) from a state on; they can increase only along a curved path.
    pub(crate) fn greatest_speeds(&self, state: &State) -> (f64, f64) {
        let (speed, rate) = (length(state.velocity), state.yaw_rate_rad_s.abs());
        if !self.is_piece() {
            return (speed, rate);
        }
        let time = self.stop_s - self.start_s;
        let last = |first: f64, lost: f64| first - lost * time;
        (
            speed.max(last(self.speed_m_s, self.deceleration_m_s2[0])),
            rate.max(last(self.yaw_rate_rad_s.abs(), self.yaw_deceleration_rad_s2)),
        )
    }

    /// The time (s) at which the body has moved a distance from its position at `from_s`; none if it stops before.
    pub(crate) fn time_at_distance_s(&self, distance_m: f64, from_s: f64, body: &Body) -> Option<f64> {
        let SpeedLaw::Curved { branch, scale_s } = self.law else {
            let deceleration = self.deceleration_m_s2[0];
            let speed_m_s = self.speed_m_s - deceleration * (from_s - self.start_s);
            let square = speed_m_s * speed_m_s - 2.0 * deceleration * distance_m;
            let time_s = from_s + 2.0 * distance_m / (speed_m_s + square.max(0.0).sqrt());
            return (square >= 0.0 && time_s < self.stop_s).then_some(time_s);
        };
        let remaining = (self.stop_s - from_s) / scale_s;
        let rest = body.curve.remainder(branch, remaining);
        let remaining_slide =
            rest.distance - distance_m / (body.friction_deceleration_m_s2 * scale_s * scale_s);
        if remaining_slide <= 0.0 {
            return None;
        }
        Some(self.stop_s - scale_s * body.curve.remaining_at_distance(branch, remaining_slide, remaining))
    }
}

/// Relative change of the speeds within one piece of a curved path.
const PIECE_RELATIVE_CHANGE: f64 = 0.1;
/// Speed (m/s) below which the rest of a curved path is one straight piece, shorter than ten micrometres.
const LAST_PIECE_M_S: f64 = 5e-3;

impl Motion {
    /// One piece of a curved path by the midpoint rule; the last one ends at rest.  None if the slide is straight anyway.
    fn piece(state: &State, time_s: f64, body: &Body, spin: Spin) -> Option<Self> {
        let (velocity, rate) = (state.velocity, state.yaw_rate_rad_s);
        let radius_m = body.patch_radius_m;
        let (speed, rim) = (length(velocity), rate.abs() * radius_m);
        let both = speed.hypot(rim);
        let is_straight = body.limit_surface.as_ref().is_none_or(|surface| surface.is_straight_without_spin);
        if is_straight && body.tilt_m_s2 == Vec2::ZERO && rim <= 1e-6 * speed {
            return None;
        }
        let (acceleration, yaw_acceleration) = body.accelerations(spin, velocity, state.yaw_rad, rate);
        let mut motion = Self::rest(Pose { position: state.position, yaw_rad: state.yaw_rad }, time_s);
        motion.direction = velocity.direction().unwrap_or(Vec2::ZERO);
        (motion.speed_m_s, motion.yaw_rate_rad_s) = (speed, rate);
        if both < LAST_PIECE_M_S {
            let lost = -(velocity.dot(acceleration) + rate * yaw_acceleration * radius_m * radius_m) / both;
            let time = both / lost.max(0.1 * body.friction_deceleration_m_s2);
            motion.law = SpeedLaw::Uniform;
            motion.stop_s = time_s + time;
            motion.deceleration_m_s2 = [speed / time; 2];
            motion.yaw_deceleration_rad_s2 = rate.abs() / time;
            let distance = motion.direction * (0.5 * speed * time);
            motion.half_distance_m = 0.25 * speed * time;
            motion.end =
                Pose { position: state.position + distance, yaw_rad: state.yaw_rad + 0.5 * rate * time };
            return Some(motion);
        }
        let time = PIECE_RELATIVE_CHANGE * both / length(acceleration).hypot(yaw_acceleration * radius_m);
        let half = 0.5 * time;
        let middle_yaw_rad = state.yaw_rad + half * (rate + 0.5 * half * yaw_acceleration);
        let (acceleration, yaw_acceleration) = body.accelerations(
            spin,
            velocity + acceleration * half,
            middle_yaw_rad,
            rate + yaw_acceleration * half,
        );
        let (next_velocity, next_rate) = (velocity + acceleration * time, rate + yaw_acceleration * time);
        // A rotation that would reverse ends with the piece.
        let next_rate = if next_rate * rate < 0.0 { 0.0 } else { next_rate };
        let sign = 1.0f64.copysign(if rate == 0.0 { next_rate } else { rate });
        motion.direction = (velocity + next_velocity).direction().unwrap_or(Vec2::ZERO);
        motion.law = SpeedLaw::Piece { next_velocity };
        motion.stop_s = time_s + time;
        motion.deceleration_m_s2 = [(speed - length(next_velocity)) / time; 2];
        motion.yaw_rate_rad_s = rate.abs().max(f64::MIN_POSITIVE).copysign(sign);
        motion.yaw_deceleration_rad_s2 = (rate.abs() - next_rate.abs()) / time;
        motion.half_distance_m = 0.5 * half * (speed + length(next_velocity));
        motion.end = Pose {
            position: state.position + motion.direction * (2.0 * motion.half_distance_m),
            yaw_rad: state.yaw_rad + half * (rate + next_rate),
        };
        Some(motion)
    }
}

/// Remaining distance and rotation of a slide, and its present speeds.
struct RemainingSlide {
    distance_m: f64,
    speed_m_s: f64,
    rotation_rad: f64,
    yaw_rate_rad_s: f64,
}

/// The distance (or angle) in which a constant deceleration stops a speed; zero for no speed.
fn stopping_distance(speed: f64, deceleration: f64) -> f64 {
    if speed == 0.0 { 0.0 } else { 0.5 * speed * speed / deceleration }
}

/// Speed below which a body is at rest (m/s): friction stops it within 1e-18 m.
const SPEED_AT_REST_M_S: f64 = 1e-9;

/// Distance (or angle) and speed after a time of constant deceleration, which stops a speed and never reverses it.
fn braked(speed: f64, deceleration: f64, time_s: f64) -> (f64, f64) {
    let lost = deceleration * time_s;
    if lost >= speed && deceleration > 0.0 {
        return (0.5 * speed * speed / deceleration, 0.0);
    }
    (time_s * (speed - 0.5 * lost), speed - lost)
}
