//! The model of one clip: bodies that rest, slide and hit each other, and what the camera sees of them.

use super::least_squares::{Problem, Residual};
use super::sliding::{Grip, Motion, Rates, Slide};
use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;
use crate::physics::GRAVITY_M_S2;

/// One body of a clip as it was seen.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub(crate) object: String,
    pub(crate) shape: Shape,
    pub(crate) patch_radius_m: f64,
    pub(crate) gyration_m: f64,
    pub(crate) height_m: f64,
    pub(crate) sights: Vec<Sight>,
    /// Whether its marker tells how it is turned.
    pub(crate) sees_yaw: bool,
    /// Whether it moves before anything hits it.
    pub(crate) moves_at_start: bool,
}

/// One sight of a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    pub(crate) time_s: f64,
    pub(crate) position: Point,
    pub(crate) yaw_rad: Option<f64>,
    pub(crate) std_m: f64,
    /// Left out of the fit.
    pub(crate) ignored: bool,
}

/// What changes a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// The striker hits the one member.
    Striker,
    /// The two members hit each other.
    Contact,
    /// Nothing that was filmed or told is near the one member.
    Unknown,
}

/// An instant at which the members' velocities jump.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Event {
    pub(crate) cause: Cause,
    pub(crate) members: Vec<usize>,
}

/// Bodies, events, and how the camera looks.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) law: Law,
    pub(crate) bodies: Vec<Body>,
    pub(crate) events: Vec<Event>,
    pub(crate) exposure: Exposure,
    /// Deviation of the yaw's noise (rad).
    pub(crate) yaw_std_rad: f64,
    /// For every body and sight: the deviation that it enters the fit with (m).
    pub(crate) stds_m: Vec<Vec<f64>>,
}

/// How bodies slow down between impacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Law {
    /// By Coulomb friction, down to rest.
    Coulomb,
    /// Each leg at rates of its own: good for a short while around an impact, whatever slows them.
    Free,
}

/// How long the shutter is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Exposure {
    /// A sight is the mean over this time (s).
    Known(f64),
    /// It may be up to this long (s): sights that near to an impact are worth less.
    UpTo(f64),
}

/// Where each number stands in the list of parameters.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pub(crate) bodies: Vec<BodySlots>,
    pub(crate) events: Vec<EventSlots>,
    /// The step of every parameter for numeric derivatives.
    pub(crate) steps: Vec<f64>,
    /// What every parameter moves.
    moves: Vec<Moves>,
}

/// What a parameter moves.
#[derive(Clone, Copy, Debug)]
enum Moves {
    /// This body, all the time.
    Body(usize),
    /// All members of this event, or only this one, from the event on.
    Since(usize, Option<usize>),
}

/// A model with the places of its parameters and residuals.
pub(crate) struct ModelFit<'a> {
    model: &'a Model,
    layout: &'a Layout,
    /// Where the residuals of each body begin; at the end, those of the priors.
    starts: Vec<usize>,
}

/// Slots of a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodySlots {
    /// x; y follows.
    pub(crate) position: usize,
    pub(crate) yaw: Option<usize>,
    /// vx; vy and, where the yaw is seen, the spin follow; then, under [`Law::Free`], their rates of change.
    pub(crate) velocity: Option<usize>,
    pub(crate) friction: Option<usize>,
    /// Logarithm of the patch's radius over that of an outline that rests on its whole area; where the yaw is seen.
    pub(crate) support: Option<usize>,
}

impl BodySlots {
    /// How many parameters are this body's own.
    pub(crate) fn len(&self) -> usize {
        let last = self.support.or(self.friction).or(self.velocity).or(self.yaw).unwrap_or(self.position + 1);
        last + 1 - self.position
    }
}

/// Slots of an event.
#[derive(Clone, Debug)]
pub(crate) struct EventSlots {
    pub(crate) time: usize,
    /// For each member, as [`BodySlots::velocity`].
    pub(crate) velocities: Vec<usize>,
}

/// Where a body is at any time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Path {
    first: Motion,
    slides: Vec<(f64, Slide)>,
}

/// A slide between two impacts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leg {
    pub(crate) start_s: f64,
    pub(crate) end_s: f64,
    /// At its start.
    pub(crate) velocity: Vec2,
}

/// Rest counts as no more than this many independent sights: a codec repeats the same picture, noise and all.
const SIGHTS_OF_A_REST: f64 = 4.0;
/// Speeds, spins and frictions are within a few of these; times within a few of it of their first guess.
const SPEED_SPAN_M_S: f64 = 10.0;
const SPIN_SPAN_RAD_S: f64 = 300.0;
const FRICTION_SPAN: f64 = 3.0;
const SPIN_RATE_SPAN_RAD_S2: f64 = 1e4;
/// Nobody knows where a body touches the table: on its corners or its rim, a spin is braked up to 1.9 times as hard as on its whole
/// area, on feet near the middle far less (standard deviation of the logarithm).
const SUPPORT_STD: f64 = 0.5;
/// What slows bodies otherwise than Coulomb friction is often soft: their impacts may last this long (s).
const SOFT_CONTACT_S: f64 = 0.008;

impl Path {
    /// The motion at a time; at the instant of an impact, the one after it.
    pub(crate) fn motion(&self, time_s: f64) -> Motion {
        let next = self.slides.partition_point(|(start_s, _)| *start_s <= time_s);
        self.motion_in(next, time_s)
    }

    /// As [`Path::motion`], at the instant of an impact the one before it.
    pub(crate) fn motion_before(&self, time_s: f64) -> Motion {
        let next = self.slides.partition_point(|(start_s, _)| *start_s < time_s);
        self.motion_in(next, time_s)
    }

    fn motion_in(&self, next: usize, time_s: f64) -> Motion {
        if next == 0 { self.first } else { self.slides[next - 1].1.motion(time_s) }
    }

    /// When the last slide ends.
    pub(crate) fn stop_s(&self) -> f64 {
        self.slides.last().map_or(f64::NEG_INFINITY, |(_, slide)| slide.stop_s())
    }

    /// When the body is first set in motion.
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

    /// When the velocity jumps (s).
    pub(crate) fn impacts_s(&self) -> impl Iterator<Item = f64> + '_ {
        self.slides.iter().map(|(start_s, _)| *start_s)
    }

    /// The pose that a shutter open for `exposure_s` around a time sees: the mean.
    pub(crate) fn mean_pose(&self, time_s: f64, exposure_s: f64) -> Pose {
        if exposure_s <= 0.0 {
            return self.motion(time_s).pose;
        }
        let (open, shut) = (time_s - exposure_s / 2.0, time_s + exposure_s / 2.0);
        if shut <= self.onset_s() && self.first.velocity == Vec2::ZERO || open >= self.stop_s() {
            return self.motion(time_s).pose;
        }
        let breaks = self.slides.iter().map(|(start_s, _)| *start_s).filter(|s| (open..shut).contains(s));
        let mut mean = [0.0; 3];
        let mut from = open;
        for to in breaks.chain(std::iter::once(shut)) {
            // Simpson's rule is exact for a slide.
            let part = (to - from) / exposure_s / 6.0;
            let nodes = [
                (self.motion(from), 1.0),
                (self.motion(f64::midpoint(from, to)), 4.0),
                (self.motion_before(to), 1.0),
            ];
            for (motion, share) in nodes {
                let pose: [f64; 3] = motion.pose.into();
                for (sum, value) in mean.iter_mut().zip(pose) {
                    *sum += part * share * value;
                }
            }
            from = to;
        }
        mean.into()
    }
}

impl Body {
    /// How many numbers its velocity has.
    fn velocity_len(&self) -> usize {
        if self.sees_yaw { 3 } else { 2 }
    }
}

impl Model {
    pub(crate) fn new(bodies: Vec<Body>, exposure: Exposure) -> Self {
        let stds_m = bodies.iter().map(|b| b.sights.iter().map(|s| s.std_m).collect()).collect();
        let law = Law::Coulomb;
        Self { law, bodies, events: Vec::new(), exposure, yaw_std_rad: YAW_STD_RAD, stds_m }
    }

    /// Where each parameter stands.
    pub(crate) fn layout(&self) -> Layout {
        let (mut steps, mut moves) = (Vec::new(), Vec::new());
        let mut take = |sizes: &[f64], what: Moves| {
            steps.extend_from_slice(sizes);
            moves.resize(steps.len(), what);
            steps.len() - sizes.len()
        };
        let free = self.law == Law::Free;
        let velocity_steps = |body: &Body| {
            let len = body.velocity_len();
            let rates = if free { &[1e-3, 1e-3, 1e-1][..len] } else { &[] };
            [&[1e-5, 1e-5, 1e-3][..len], rates].concat()
        };
        let bodies = (0..self.bodies.len())
            .map(|k| {
                let (body, own) = (&self.bodies[k], Moves::Body(k));
                let moves = body.moves_at_start || self.events.iter().any(|e| e.members.contains(&k));
                BodySlots {
                    position: take(&[1e-6, 1e-6], own),
                    yaw: body.sees_yaw.then(|| take(&[1e-5], own)),
                    velocity: body.moves_at_start.then(|| take(&velocity_steps(body), own)),
                    friction: (moves && !free).then(|| take(&[1e-5], own)),
                    support: (moves && !free && body.sees_yaw).then(|| take(&[1e-4], own)),
                }
            })
            .collect();
        let events = (self.events.iter().enumerate())
            .map(|(n, event)| EventSlots {
                time: take(&[1e-6], Moves::Since(n, None)),
                velocities: (event.members.iter())
                    .map(|&m| take(&velocity_steps(&self.bodies[m]), Moves::Since(n, Some(m))))
                    .collect(),
            })
            .collect();
        Layout { bodies, events, steps, moves }
    }

    /// The path of every body.
    pub(crate) fn paths(&self, layout: &Layout, parameters: &[f64]) -> Vec<Path> {
        (0..self.bodies.len()).map(|k| self.path(k, layout, parameters)).collect()
    }

    /// The path of one body.
    fn path(&self, k: usize, layout: &Layout, parameters: &[f64]) -> Path {
        let (body, slots) = (&self.bodies[k], &layout.bodies[k]);
        let velocity = |slot: usize| {
            let spin = if body.sees_yaw { parameters[slot + 2] } else { 0.0 };
            (Vec2::new(parameters[slot], parameters[slot + 1]), spin)
        };
        let grip = Grip {
            friction: slots.friction.map_or(0.0, |f| parameters[f]),
            patch_radius_m: body.patch_radius_m * slots.support.map_or(1.0, |s| parameters[s].exp()),
            gyration_m: body.gyration_m,
        };
        let slide = |start_s: f64, start: Motion, slot: usize| match self.law {
            Law::Coulomb => Slide::new(start_s, start, &grip),
            Law::Free => {
                let (acceleration, spin_rad_s2) = velocity(slot + body.velocity_len());
                Slide::free(start_s, start, Rates { acceleration, spin_rad_s2 })
            }
        };
        let yaw_rad = slots.yaw.map_or(0.0, |y| parameters[y]);
        let pose = Pose::new(parameters[slots.position], parameters[slots.position + 1], yaw_rad);
        let mut path = Path { first: Motion { pose, ..Motion::default() }, slides: Vec::new() };
        if let Some(slot) = slots.velocity {
            let start_s = body.sights.first().map_or(0.0, |s| s.time_s);
            (path.first.velocity, path.first.spin_rad_s) = velocity(slot);
            path.slides.push((start_s, slide(start_s, path.first, slot)));
        }
        for (event, at) in self.events.iter().zip(&layout.events) {
            let Some(member) = event.members.iter().position(|&m| m == k) else { continue };
            let start_s = parameters[at.time];
            let mut start = path.slides.last().map_or(path.first, |(_, slide)| slide.motion(start_s));
            let slot = at.velocities[member];
            (start.velocity, start.spin_rad_s) = velocity(slot);
            path.slides.push((start_s, slide(start_s, start, slot)));
        }
        path
    }

    /// How many residuals the sights of each body make.
    fn row_counts(&self) -> Vec<usize> {
        let rows = |body: &Body, s: &Sight| if body.sees_yaw && s.yaw_rad.is_some() { 2 } else { 1 };
        let of = |body: &Body| body.sights.iter().filter(|s| !s.ignored).map(|s| rows(body, s)).sum();
        self.bodies.iter().map(of).collect()
    }

    /// What a body's sights since a time say against its path: calls `each` with the place among the body's residuals.
    fn sights_against(&self, k: usize, path: &Path, since_s: f64, mut each: impl FnMut(usize, Residual)) {
        let (body, mut row) = (&self.bodies[k], 0);
        let exposure_s = match self.exposure {
            Exposure::Known(exposure_s) => exposure_s,
            Exposure::UpTo(_) => 0.0,
        };
        for (sight, std_m) in body.sights.iter().zip(&self.stds_m[k]).filter(|(s, _)| !s.ignored) {
            let yaw_rad = sight.yaw_rad.filter(|_| body.sees_yaw);
            if sight.time_s + exposure_s >= since_s {
                let seen = path.mean_pose(sight.time_s, exposure_s);
                let off = (sight.position - seen.position) / *std_m;
                each(row, Residual { value: off.into(), soft: true });
                if let Some(yaw_rad) = yaw_rad {
                    let std_rad = self.yaw_std_rad * std_m / sight.std_m;
                    each(row + 1, Residual { value: [(yaw_rad - seen.yaw_rad) / std_rad, 0.0], soft: true });
                }
            }
            row += 1 + usize::from(yaw_rad.is_some());
        }
    }

    fn priors(&self, layout: &Layout, parameters: &[f64], mut each: impl FnMut(Residual)) {
        let mut expect = |value: [f64; 2]| each(Residual { value, soft: false });
        let mut expect_velocity = |body: &Body, slot: usize| {
            expect([parameters[slot] / SPEED_SPAN_M_S, parameters[slot + 1] / SPEED_SPAN_M_S]);
            if body.sees_yaw {
                expect([parameters[slot + 2] / SPIN_SPAN_RAD_S, 0.0]);
            }
            if self.law == Law::Free {
                const SPAN_M_S2: f64 = FRICTION_SPAN * GRAVITY_M_S2;
                let slot = slot + body.velocity_len();
                expect([parameters[slot] / SPAN_M_S2, parameters[slot + 1] / SPAN_M_S2]);
                if body.sees_yaw {
                    expect([parameters[slot + 2] / SPIN_RATE_SPAN_RAD_S2, 0.0]);
                }
            }
        };
        for (body, slots) in self.bodies.iter().zip(&layout.bodies) {
            if let Some(slot) = slots.velocity {
                expect_velocity(body, slot);
            }
        }
        for (event, at) in self.events.iter().zip(&layout.events) {
            for (&member, &slot) in event.members.iter().zip(&at.velocities) {
                expect_velocity(&self.bodies[member], slot);
            }
        }
        for slots in &layout.bodies {
            if let Some(slot) = slots.friction {
                expect([parameters[slot] / FRICTION_SPAN, 0.0]);
            }
            if let Some(slot) = slots.support {
                expect([parameters[slot] / SUPPORT_STD, 0.0]);
            }
        }
    }

    /// Weighs the sights for the motion that these parameters tell: long rests and frames around impacts less.
    pub(crate) fn weigh(&mut self, layout: &Layout, parameters: &[f64]) {
        let paths = self.paths(layout, parameters);
        for ((body, path), stds) in self.bodies.iter().zip(&paths).zip(&mut self.stds_m) {
            let (onset_s, stop_s) = (path.onset_s(), path.stop_s());
            let before = body.sights.iter().filter(|s| s.time_s < onset_s).count() as f64;
            let after = body.sights.iter().filter(|s| s.time_s > stop_s).count() as f64;
            let rest = |count: f64| (count / SIGHTS_OF_A_REST).max(1.0).sqrt();
            for (sight, std_m) in body.sights.iter().zip(stds) {
                let repeated = match sight.time_s {
                    t if t < onset_s => rest(before),
                    t if t > stop_s => rest(after),
                    _ => 1.0,
                };
                let blur_m = match self.exposure {
                    Exposure::Known(_) => 0.0,
                    Exposure::UpTo(exposure_s) => possible_blur_m(path, sight.time_s, exposure_s),
                };
                let soft_m = match self.law {
                    Law::Coulomb => 0.0,
                    Law::Free => possible_blur_m(path, sight.time_s, SOFT_CONTACT_S),
                };
                *std_m = (sight.std_m * repeated).hypot(blur_m).hypot(soft_m);
            }
        }
    }
}

impl<'a> ModelFit<'a> {
    pub(crate) fn new(model: &'a Model, layout: &'a Layout) -> Self {
        let mut starts = vec![0];
        for count in model.row_counts() {
            starts.push(starts[starts.len() - 1] + count);
        }
        Self { model, layout, starts }
    }
}

impl Problem for ModelFit<'_> {
    fn residuals(&self, parameters: &[f64]) -> Vec<Residual> {
        let mut all = Vec::new();
        for k in 0..self.model.bodies.len() {
            let path = self.model.path(k, self.layout, parameters);
            self.model.sights_against(k, &path, f64::NEG_INFINITY, |_, r| all.push(r));
        }
        self.model.priors(self.layout, parameters, |r| all.push(r));
        all
    }

    fn residuals_of(&self, parameters: &[f64], column: usize, mut changed: impl FnMut(usize, Residual)) {
        /// An instant that is varied moves sights a little before it too.
        const JUST_BEFORE_S: f64 = 1e-5;
        let (bodies, since_s): (&[usize], f64) = match &self.layout.moves[column] {
            Moves::Body(k) => (std::slice::from_ref(k), f64::NEG_INFINITY),
            Moves::Since(n, member) => {
                let since_s = parameters[self.layout.events[*n].time] - JUST_BEFORE_S;
                (member.as_ref().map_or(&self.model.events[*n].members, std::slice::from_ref), since_s)
            }
        };
        for &k in bodies {
            let path = self.model.path(k, self.layout, parameters);
            self.model.sights_against(k, &path, since_s, |row, r| changed(self.starts[k] + row, r));
        }
        let mut row = self.starts[self.starts.len() - 1];
        self.model.priors(self.layout, parameters, |r| {
            changed(row, r);
            row += 1;
        });
    }
}

/// Before the yaw's own noise is known.
const YAW_STD_RAD: f64 = 0.01;

/// By how much the mean position over an exposure differs from the one at its middle, if an impact falls into it (m).
fn possible_blur_m(path: &Path, time_s: f64, exposure_s: f64) -> f64 {
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

/// The friction of a slide that covers `distance_m` and stops after `duration_s`.
pub(crate) fn friction_of_a_stop(distance_m: f64, duration_s: f64) -> f64 {
    2.0 * distance_m / (duration_s * duration_s * GRAVITY_M_S2)
}
