//! The model of one clip: bodies that rest, slide and hit each other, and the residuals of their observations.

use super::least_squares::{Problem, Residual};
use super::result::Measured;
use super::sliding::{MotionState, Rates, Slide, SlideParameters};
use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;
use crate::physics::GRAVITY_M_S2;

/// One body of a clip with its observations.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub(crate) object: String,
    pub(crate) shape: Shape,
    /// The radius of the disc of uniform pressure with the frictional torque of its whole area (m).
    pub(crate) patch_radius_m: f64,
    /// The radius of gyration (m).
    pub(crate) gyration_m: f64,
    pub(crate) height_m: f64,
    pub(crate) observations: Vec<Observation>,
    /// Whether its yaw is observed; the marker of a disc may be symmetric.
    pub(crate) yaw_observed: bool,
    /// Whether it moves before anything hits it.
    pub(crate) moves_at_start: bool,
    /// The friction that other clips let expect, a prior of the fit; `None` if they measure none.
    pub(crate) expected_friction: Option<Measured>,
}

/// One observation of a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    pub(crate) time_s: f64,
    pub(crate) position: Point,
    pub(crate) yaw_rad: Option<f64>,
    /// The standard deviation of the position's noise along each axis (m).
    pub(crate) std_m: f64,
    /// Whether the detector marks it as doubtful: the marker may be partly covered.
    pub(crate) doubtful: bool,
    /// Whether the fit leaves it out.
    pub(crate) excluded: bool,
}

/// The cause of a velocity jump.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// The striker hits the only member.
    Striker,
    /// The members, usually two, hit each other.
    Contact,
    /// The members are hit by something that is neither filmed nor specified.
    Unknown,
}

/// An impact: an instant at which the velocities of its members jump.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Event {
    pub(crate) cause: Cause,
    /// Indices of bodies.
    pub(crate) members: Vec<usize>,
}

/// Bodies, impacts, and the properties of the camera.
#[derive(Clone, Debug)]
pub(crate) struct MotionModel {
    pub(crate) law: MotionLaw,
    pub(crate) bodies: Vec<Body>,
    pub(crate) events: Vec<Event>,
    pub(crate) exposure: Exposure,
    /// The standard deviation of the yaw's noise (rad).
    pub(crate) yaw_std_rad: f64,
    /// For every body and observation the standard deviation with which it is weighted (m).
    pub(crate) stds_m: Vec<Vec<f64>>,
    /// The velocity of a striker whose successive impacts on a body are expected to have one restitution and to be as far apart as it moves
    /// between them; `None` where the positions show each impact by itself.
    pub(crate) repeated_striker: Option<Vec2>,
}

/// The law of motion between impacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MotionLaw {
    /// Deceleration by Coulomb friction, down to rest.
    Coulomb,
    /// Each leg has its own constant acceleration: an approximation for a short time around an impact, whatever decelerates
    /// the bodies.
    ConstantRates,
}

/// The exposure time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Exposure {
    /// An observation is the mean over this time (s).
    Known(f64),
    /// Unknown up to this time (s): observations within it of an impact get less weight.
    UpTo(f64),
}

/// The index of each quantity in the list of parameters.
#[derive(Clone, Debug)]
pub(crate) struct ParameterLayout {
    pub(crate) bodies: Vec<BodyIndices>,
    pub(crate) events: Vec<EventIndices>,
    /// The step of every parameter for numerical derivatives.
    pub(crate) steps: Vec<f64>,
    /// The bodies that every parameter affects.
    affects: Vec<Affects>,
}

/// The bodies that a parameter affects.
#[derive(Clone, Copy, Debug)]
enum Affects {
    /// This body, at all times.
    Body(usize),
    /// From this event on all its members, or only this body.
    Since(usize, Option<usize>),
}

/// The least-squares problem of a model.
pub(crate) struct MotionProblem<'a> {
    model: &'a MotionModel,
    layout: &'a ParameterLayout,
    /// The index of the first residual of each body; last, that of the priors.
    starts: Vec<usize>,
}

/// Indices of a body's parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyIndices {
    /// x; y follows.
    pub(crate) position: usize,
    pub(crate) yaw: Option<usize>,
    /// vx of the initial velocity; vy and, where the yaw is observed, the spin follow; then, under
    /// [`MotionLaw::ConstantRates`], the accelerations in the same order.
    pub(crate) velocity: Option<usize>,
    pub(crate) friction: Option<usize>,
    /// The logarithm of the contact patch's radius over that of the whole area; where the yaw is observed.
    pub(crate) patch: Option<usize>,
}

impl BodyIndices {
    /// The number of parameters of this body that are no event's.
    pub(crate) fn len(&self) -> usize {
        let last = self.patch.or(self.friction).or(self.velocity).or(self.yaw).unwrap_or(self.position + 1);
        last + 1 - self.position
    }
}

/// Indices of an event's parameters.
#[derive(Clone, Debug)]
pub(crate) struct EventIndices {
    pub(crate) time: usize,
    /// For each member the velocity just after the event, as [`BodyIndices::velocity`].
    pub(crate) velocities: Vec<usize>,
}

/// The motion of a body over time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BodyPath {
    first: MotionState,
    slides: Vec<(f64, Slide)>,
}

/// A slide from one impact to the next or to rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leg {
    pub(crate) start_s: f64,
    pub(crate) end_s: f64,
    /// The velocity at its start.
    pub(crate) velocity: Vec2,
}

/// A period of rest has the weight of at most this many independent observations: a codec repeats the same picture with
/// its noise.
const OBSERVATIONS_OF_A_REST: f64 = 4.0;
/// Standard deviations of the weak priors on speeds, spins, frictions that no other clip measures, and angular accelerations, whose mean is zero.
const SPEED_STD_M_S: f64 = 10.0;
const SPIN_STD_RAD_S: f64 = 300.0;
const FRICTION_STD: f64 = 3.0;
const ANGULAR_ACCELERATION_STD_RAD_S2: f64 = 1e4;
/// The standard deviation of the prior on the logarithm of the patch radius over that of the whole area: a body on its
/// corners or its rim decelerates its spin up to 1.9 times as strongly, one on feet near its middle far less.
pub(crate) const LOG_PATCH_STD: f64 = 0.5;
/// Standard deviations of the distance between a body and the striker when it is hit again (m), which the error of the given speed makes, and of the
/// difference of the restitutions of successive strikes of one body.
const REPEATED_GAP_STD_M: f64 = 3e-4;
const REPEATED_RESTITUTION_STD: f64 = 0.05;
/// Bodies that do not slide on Coulomb friction often have soft bumpers, whose impacts last up to this long (s).
const SOFT_CONTACT_S: f64 = 0.008;

impl BodyPath {
    /// The state at a time (s); at the instant of an impact, the one after it.
    pub(crate) fn motion(&self, time_s: f64) -> MotionState {
        let next = self.slides.partition_point(|(start_s, _)| *start_s <= time_s);
        self.motion_in(next, time_s)
    }

    /// As [`BodyPath::motion`], but at the instant of an impact the state before it.
    pub(crate) fn motion_before(&self, time_s: f64) -> MotionState {
        let next = self.slides.partition_point(|(start_s, _)| *start_s < time_s);
        self.motion_in(next, time_s)
    }

    fn motion_in(&self, next: usize, time_s: f64) -> MotionState {
        if next == 0 { self.first } else { self.slides[next - 1].1.motion(time_s) }
    }

    /// When the last slide ends (s).
    pub(crate) fn stop_s(&self) -> f64 {
        self.slides.last().map_or(f64::NEG_INFINITY, |(_, slide)| slide.stop_s())
    }

    /// When the body is first set in motion (s).
    pub(crate) fn onset_s(&self) -> f64 {
        self.slides.first().map_or(f64::INFINITY, |(start_s, _)| *start_s)
    }

    /// The slides, each from its start to the next impact or to rest.
    pub(crate) fn legs(&self) -> Vec<Leg> {
        (0..self.slides.len())
            .map(|k| {
                let (start_s, slide) = &self.slides[k];
                let next_s = self.slides.get(k + 1).map_or(f64::INFINITY, |(next_s, _)| *next_s);
                let velocity = slide.motion(*start_s).velocity;
                Leg { start_s: *start_s, end_s: next_s.min(slide.stop_s()), velocity }
            })
            .collect()
    }

    /// The instants at which the velocity jumps (s).
    pub(crate) fn impacts_s(&self) -> impl Iterator<Item = f64> + '_ {
        self.slides.iter().map(|(start_s, _)| *start_s)
    }

    /// The mean pose over an exposure of `exposure_s` around a time.
    pub(crate) fn mean_pose(&self, time_s: f64, exposure_s: f64) -> Pose {
        if exposure_s <= 0.0 {
            return self.motion(time_s).pose;
        }
        let (open, shut) = (time_s - exposure_s / 2.0, time_s + exposure_s / 2.0);
        if shut <= self.onset_s() && self.first.velocity == Vec2::ZERO || open >= self.stop_s() {
            return self.motion(time_s).pose;
        }
        let impacts = self.slides.iter().map(|(start_s, _)| *start_s).filter(|s| (open..shut).contains(s));
        let mut mean = [0.0; 3];
        let mut from = open;
        for to in impacts.chain(std::iter::once(shut)) {
            // Simpson's rule is exact for the parabola of a slide without spin.
            let weight = (to - from) / exposure_s / 6.0;
            let nodes = [
                (self.motion(from), 1.0),
                (self.motion(f64::midpoint(from, to)), 4.0),
                (self.motion_before(to), 1.0),
            ];
            for (motion, node) in nodes {
                let pose: [f64; 3] = motion.pose.into();
                for (sum, value) in mean.iter_mut().zip(pose) {
                    *sum += weight * node * value;
                }
            }
            from = to;
        }
        mean.into()
    }
}

impl Body {
    /// The number of components of its velocity: two, or three with the spin.
    fn velocity_len(&self) -> usize {
        if self.yaw_observed { 3 } else { 2 }
    }
}

impl MotionModel {
    pub(crate) fn new(bodies: Vec<Body>, exposure: Exposure) -> Self {
        let stds_m = bodies.iter().map(|b| b.observations.iter().map(|s| s.std_m).collect()).collect();
        let law = MotionLaw::Coulomb;
        let repeated_striker = None;
        Self { law, bodies, events: Vec::new(), exposure, yaw_std_rad: YAW_STD_RAD, stds_m, repeated_striker }
    }

    /// The indices of all parameters.
    pub(crate) fn layout(&self) -> ParameterLayout {
        let (mut steps, mut affects) = (Vec::new(), Vec::new());
        let mut add = |sizes: &[f64], what: Affects| {
            steps.extend_from_slice(sizes);
            affects.resize(steps.len(), what);
            steps.len() - sizes.len()
        };
        let constant_rates = self.law == MotionLaw::ConstantRates;
        let velocity_steps = |body: &Body| {
            let len = body.velocity_len();
            let rates = if constant_rates { &[1e-3, 1e-3, 1e-1][..len] } else { &[] };
            [&[1e-5, 1e-5, 1e-3][..len], rates].concat()
        };
        let bodies = (0..self.bodies.len())
            .map(|k| {
                let (body, own) = (&self.bodies[k], Affects::Body(k));
                let moves = body.moves_at_start || self.events.iter().any(|e| e.members.contains(&k));
                BodyIndices {
                    position: add(&[1e-6, 1e-6], own),
                    yaw: body.yaw_observed.then(|| add(&[1e-5], own)),
                    velocity: body.moves_at_start.then(|| add(&velocity_steps(body), own)),
                    friction: (moves && !constant_rates).then(|| add(&[1e-5], own)),
                    patch: (moves && !constant_rates && body.yaw_observed).then(|| add(&[1e-4], own)),
                }
            })
            .collect();
        let events = (self.events.iter().enumerate())
            .map(|(n, event)| EventIndices {
                time: add(&[1e-6], Affects::Since(n, None)),
                velocities: (event.members.iter())
                    .map(|&m| add(&velocity_steps(&self.bodies[m]), Affects::Since(n, Some(m))))
                    .collect(),
            })
            .collect();
        ParameterLayout { bodies, events, steps, affects }
    }

    /// The path of every body.
    pub(crate) fn paths(&self, layout: &ParameterLayout, parameters: &[f64]) -> Vec<BodyPath> {
        (0..self.bodies.len()).map(|k| self.path(k, layout, parameters)).collect()
    }

    /// The path of one body.
    fn path(&self, k: usize, layout: &ParameterLayout, parameters: &[f64]) -> BodyPath {
        let (body, indices) = (&self.bodies[k], &layout.bodies[k]);
        let velocity = |at: usize| {
            let spin = if body.yaw_observed { parameters[at + 2] } else { 0.0 };
            (Vec2::new(parameters[at], parameters[at + 1]), spin)
        };
        let friction = SlideParameters {
            friction: indices.friction.map_or(0.0, |f| parameters[f]),
            patch_radius_m: body.patch_radius_m * indices.patch.map_or(1.0, |s| parameters[s].exp()),
            gyration_m: body.gyration_m,
        };
        let slide = |start_s: f64, start: MotionState, at: usize| match self.law {
            MotionLaw::Coulomb => Slide::new(start_s, start, &friction),
            MotionLaw::ConstantRates => {
                let (acceleration, spin_rad_s2) = velocity(at + body.velocity_len());
                Slide::with_rates(start_s, start, Rates { acceleration, spin_rad_s2 })
            }
        };
        let yaw_rad = indices.yaw.map_or(0.0, |y| parameters[y]);
        let pose = Pose::new(parameters[indices.position], parameters[indices.position + 1], yaw_rad);
        let mut path = BodyPath { first: MotionState { pose, ..MotionState::default() }, slides: Vec::new() };
        if let Some(at) = indices.velocity {
            let start_s = body.observations.first().map_or(0.0, |s| s.time_s);
            (path.first.velocity, path.first.spin_rad_s) = velocity(at);
            path.slides.push((start_s, slide(start_s, path.first, at)));
        }
        for (event, indices) in self.events.iter().zip(&layout.events) {
            let Some(member) = event.members.iter().position(|&m| m == k) else { continue };
            let start_s = parameters[indices.time];
            let mut start = path.slides.last().map_or(path.first, |(_, slide)| slide.motion(start_s));
            let at = indices.velocities[member];
            (start.velocity, start.spin_rad_s) = velocity(at);
            path.slides.push((start_s, slide(start_s, start, at)));
        }
        path
    }

    /// The number of residuals of each body's observations.
    fn row_counts(&self) -> Vec<usize> {
        let rows =
            |body: &Body, o: &Observation| if body.yaw_observed && o.yaw_rad.is_some() { 2 } else { 1 };
        let of = |body: &Body| body.observations.iter().filter(|o| !o.excluded).map(|o| rows(body, o)).sum();
        self.bodies.iter().map(of).collect()
    }

    /// The residuals of a body's observations since a time against its path: calls `each` with the index among the body's
    /// residuals.
    fn position_residuals(
        &self,
        k: usize,
        path: &BodyPath,
        since_s: f64,
        mut each: impl FnMut(usize, Residual),
    ) {
        let (body, mut row) = (&self.bodies[k], 0);
        let exposure_s = match self.exposure {
            Exposure::Known(exposure_s) => exposure_s,
            Exposure::UpTo(_) => 0.0,
        };
        for (observation, std_m) in body.observations.iter().zip(&self.stds_m[k]).filter(|(o, _)| !o.excluded)
        {
            let yaw_rad = observation.yaw_rad.filter(|_| body.yaw_observed);
            if observation.time_s + exposure_s >= since_s {
                let expected = path.mean_pose(observation.time_s, exposure_s);
                let residual = (observation.position - expected.position) / *std_m;
                each(row, Residual { value: residual.into(), robust: true });
                if let Some(yaw_rad) = yaw_rad {
                    let std_rad = self.yaw_std_rad * std_m / observation.std_m;
                    each(
                        row + 1,
                        Residual { value: [(yaw_rad - expected.yaw_rad) / std_rad, 0.0], robust: true },
                    );
                }
            }
            row += 1 + usize::from(yaw_rad.is_some());
        }
    }

    /// The residuals of the priors: calls `each` with one after the other.
    fn priors(&self, layout: &ParameterLayout, parameters: &[f64], mut each: impl FnMut(Residual)) {
        let mut expect = |value: [f64; 2]| each(Residual { value, robust: false });
        let mut expect_velocity = |body: &Body, at: usize| {
            expect([parameters[at] / SPEED_STD_M_S, parameters[at + 1] / SPEED_STD_M_S]);
            if body.yaw_observed {
                expect([parameters[at + 2] / SPIN_STD_RAD_S, 0.0]);
            }
            if self.law == MotionLaw::ConstantRates {
                const STD_M_S2: f64 = FRICTION_STD * GRAVITY_M_S2;
                let at = at + body.velocity_len();
                expect([parameters[at] / STD_M_S2, parameters[at + 1] / STD_M_S2]);
                if body.yaw_observed {
                    expect([parameters[at + 2] / ANGULAR_ACCELERATION_STD_RAD_S2, 0.0]);
                }
            }
        };
        for (body, indices) in self.bodies.iter().zip(&layout.bodies) {
            if let Some(at) = indices.velocity {
                expect_velocity(body, at);
            }
        }
        for (event, indices) in self.events.iter().zip(&layout.events) {
            for (&member, &at) in event.members.iter().zip(&indices.velocities) {
                expect_velocity(&self.bodies[member], at);
            }
        }
        for (body, indices) in self.bodies.iter().zip(&layout.bodies) {
            if let Some(at) = indices.friction {
                let weak = Measured { value: 0.0, std: FRICTION_STD };
                let prior = body.expected_friction.unwrap_or(weak);
                expect([(parameters[at] - prior.value) / prior.std, 0.0]);
            }
            if let Some(at) = indices.patch {
                expect([parameters[at] / LOG_PATCH_STD, 0.0]);
            }
        }
        if let Some(velocity) = self.repeated_striker {
            for (k, times) in self.repeated_strikes(layout) {
                expect(repeated_strike(
                    &self.path(k, layout, parameters),
                    velocity,
                    times.map(|t| parameters[t]),
                ));
            }
        }
    }

    /// Each two successive impacts of the striker on one body: the body, and the indices of their times among the parameters.
    pub(crate) fn repeated_strikes(&self, layout: &ParameterLayout) -> Vec<(usize, [usize; 2])> {
        let events = self.events.iter().zip(&layout.events);
        let strikes: Vec<(usize, usize)> = events
            .filter(|(event, _)| event.cause == Cause::Striker)
            .flat_map(|(event, indices)| event.members.iter().map(|&k| (k, indices.time)))
            .collect();
        let pairs = strikes.windows(2).filter(|pair| pair[0].0 == pair[1].0);
        pairs.map(|pair| (pair[0].0, [pair[0].1, pair[1].1])).collect()
    }

    /// Sets the weights of the observations for the motion of these parameters: long periods of rest and frames around
    /// impacts get less.
    pub(crate) fn set_weights(&mut self, layout: &ParameterLayout, parameters: &[f64]) {
        let paths = self.paths(layout, parameters);
        for ((body, path), stds) in self.bodies.iter().zip(&paths).zip(&mut self.stds_m) {
            let (onset_s, stop_s) = (path.onset_s(), path.stop_s());
            let before = body.observations.iter().filter(|o| o.time_s < onset_s).count() as f64;
            let after = body.observations.iter().filter(|o| o.time_s > stop_s).count() as f64;
            let rest = |count: f64| (count / OBSERVATIONS_OF_A_REST).max(1.0).sqrt();
            for (observation, std_m) in body.observations.iter().zip(stds) {
                let repeated = match observation.time_s {
                    t if t < onset_s => rest(before),
                    t if t > stop_s => rest(after),
                    _ => 1.0,
                };
                let blur_m = match self.exposure {
                    Exposure::Known(_) => 0.0,
                    Exposure::UpTo(exposure_s) => impact_blur_m(path, observation.time_s, exposure_s),
                };
                let duration_m = match self.law {
                    MotionLaw::Coulomb => 0.0,
                    MotionLaw::ConstantRates => impact_blur_m(path, observation.time_s, SOFT_CONTACT_S),
                };
                *std_m = (observation.std_m * repeated).hypot(blur_m).hypot(duration_m);
            }
        }
    }
}

impl<'a> MotionProblem<'a> {
    pub(crate) fn new(model: &'a MotionModel, layout: &'a ParameterLayout) -> Self {
        let mut starts = vec![0];
        for count in model.row_counts() {
            starts.push(starts[starts.len() - 1] + count);
        }
        Self { model, layout, starts }
    }
}

impl Problem for MotionProblem<'_> {
    fn residuals(&self, parameters: &[f64]) -> Vec<Residual> {
        let mut all = Vec::new();
        for k in 0..self.model.bodies.len() {
            let path = self.model.path(k, self.layout, parameters);
            self.model.position_residuals(k, &path, f64::NEG_INFINITY, |_, r| all.push(r));
        }
        self.model.priors(self.layout, parameters, |r| all.push(r));
        all
    }

    fn residuals_of(&self, parameters: &[f64], column: usize, mut changed: impl FnMut(usize, Residual)) {
        /// Varying the instant of an impact also affects observations just before it.
        const JUST_BEFORE_S: f64 = 1e-5;
        let (bodies, since_s): (&[usize], f64) = match &self.layout.affects[column] {
            Affects::Body(k) => (std::slice::from_ref(k), f64::NEG_INFINITY),
            Affects::Since(n, member) => {
                let since_s = parameters[self.layout.events[*n].time] - JUST_BEFORE_S;
                (member.as_ref().map_or(&self.model.events[*n].members, std::slice::from_ref), since_s)
            }
        };
        for &k in bodies {
            let path = self.model.path(k, self.layout, parameters);
            self.model.position_residuals(k, &path, since_s, |row, r| changed(self.starts[k] + row, r));
        }
        let mut row = self.starts[self.starts.len() - 1];
        self.model.priors(self.layout, parameters, |r| {
            changed(row, r);
            row += 1;
        });
    }
}

/// The residuals of two impacts of a striker at constant velocity on one body, along the direction in which the first one sets it in motion: the
/// distance of the body from the striker at the second one, and the difference of both restitutions.
fn repeated_strike(path: &BodyPath, striker: Vec2, [first_s, second_s]: [f64; 2]) -> [f64; 2] {
    let [before, after] = [path.motion_before(first_s), path.motion(first_s)];
    let normal = (after.velocity - before.velocity).direction().unwrap_or(Vec2::new(1.0, 0.0));
    let [again_before, again_after] = [path.motion_before(second_s), path.motion(second_s)];
    let moved = again_before.pose.position - after.pose.position;
    let gap_m = (moved - striker * (second_s - first_s)).dot(normal);
    let approach_m_s = |motion: MotionState| (striker - motion.velocity).dot(normal);
    let first_m_s = approach_m_s(before);
    let restitution = -approach_m_s(after) / first_m_s;
    let excess_m_s = -approach_m_s(again_after) - restitution * approach_m_s(again_before);
    [gap_m / REPEATED_GAP_STD_M, excess_m_s / (REPEATED_RESTITUTION_STD * first_m_s)]
}

/// The standard deviation of the yaw's noise for the first fit (rad).
const YAW_STD_RAD: f64 = 0.01;

/// The distance between the mean position over an exposure and that at its middle, if it contains an impact (m).
fn impact_blur_m(path: &BodyPath, time_s: f64, exposure_s: f64) -> f64 {
    (path.slides.iter())
        .map(|(start_s, _)| {
            let overlap_s = exposure_s / 2.0 - (time_s - start_s).abs();
            if overlap_s <= 0.0 {
                return 0.0;
            }
            let jump = path.motion(*start_s).velocity - path.motion_before(*start_s).velocity;
            jump.length() * overlap_s * overlap_s / (2.0 * exposure_s)
        })
        .fold(0.0, f64::max)
}

/// The coefficient of friction of a slide that covers `distance_m` and stops after `duration_s` (Eq. 30).
pub(crate) fn friction_of_a_stop(distance_m: f64, duration_s: f64) -> f64 {
    2.0 * distance_m / (duration_s * duration_s * GRAVITY_M_S2)
}
