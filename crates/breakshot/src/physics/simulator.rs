//! The event loop: predict, take the earliest contact, resolve, let go.

use super::body::Body;
use super::contact::{Mover, Outlook, first_contact, nearest};
use super::evolve::{Motion, State};
use super::resolve::{Impact, RestitutionLaw, Touch, struck};
use super::striker::{Phase, Program};
use super::trajectory::Log;
use super::world::{STRIKER, World};
use crate::error::Result;
use crate::geometry::Pose;
use crate::scene::Strike;

/// What a strike leads to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Where each object comes to rest, in the order of [`World::names`].
    pub poses: Vec<Pose>,
    /// When everything is at rest (s after the striker starts).
    pub duration_s: f64,
    /// How many impacts there were.
    pub impacts: usize,
}

/// A prediction about two bodies, valid as long as neither has been struck since.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Prediction {
    time_s: f64,
    bodies: [u32; 2],
    /// Whether they touch at `time_s`, or must only be looked at again.
    touch: bool,
}

/// Memory that is used again from rollout to rollout.
#[derive(Clone, Debug, Default)]
pub struct Simulator {
    motions: Vec<Motion>,
    predictions: Vec<Prediction>,
}

/// One rollout under way.
struct Run<'a> {
    world: &'a World,
    motions: &'a mut Vec<Motion>,
    predictions: &'a mut Vec<Prediction>,
    program: Program,
    phase: Phase,
    phase_end_s: f64,
    impacts: usize,
    log: Option<&'a mut Log>,
}

impl Simulator {
    /// A simulator with no memory yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Simulates one strike.
    ///
    /// # Errors
    /// A strike that cannot be, a striker that starts inside something.
    pub fn run(&mut self, world: &World, strike: &Strike) -> Result<Outcome> {
        self.logged(world, strike, None)
    }

    pub(crate) fn logged(
        &mut self,
        world: &World,
        strike: &Strike,
        log: Option<&mut Log>,
    ) -> Result<Outcome> {
        world.check_strike(strike)?;
        let program = Program::new(strike, world.retract_speed_m_s, world.options.after_strike);
        let (motion, phase_end_s) = program.forward();
        self.motions.clear();
        self.motions.extend(world.bodies.iter().map(|b| Motion::rest(b.pose, 0.0)));
        self.motions[STRIKER] = motion;
        self.predictions.clear();
        let mut run = Run {
            world,
            motions: &mut self.motions,
            predictions: &mut self.predictions,
            program,
            phase: Phase::Forward,
            phase_end_s,
            impacts: 0,
            log,
        };
        if let Some(log) = &mut run.log {
            log.start(run.motions);
        }
        run.predict(STRIKER, 0.0, None);
        run.follow();
        let impacts = run.impacts;
        let duration_s =
            self.motions[1..].iter().map(|m| m.stop_s).fold(self.motions[STRIKER].start_s, f64::max);
        let poses = world.body_of.iter().map(|&b| self.motions[b].end).collect();
        Ok(Outcome { poses, duration_s, impacts })
    }
}

impl Run<'_> {
    fn mover(&self, body: usize) -> Mover<'_> {
        Mover { body: &self.world.bodies[body], motion: &self.motions[body] }
    }

    /// Event after event until everything rests.
    fn follow(&mut self) {
        loop {
            let next = self.earliest();
            let time_s = next.map_or(f64::INFINITY, |k| self.predictions[k].time_s);
            if self.phase_end_s <= time_s {
                if self.phase_end_s == f64::INFINITY {
                    return;
                }
                self.end_phase();
                continue;
            }
            let Some(k) = next else { return };
            let prediction = self.predictions.swap_remove(k);
            let [a, b] = prediction.bodies.map(|i| i as usize);
            if prediction.touch {
                self.touch(a, b, time_s);
            } else {
                self.look(a, b, time_s);
            }
        }
    }

    /// The prediction that comes first; ties go to the bodies that come first.
    fn earliest(&self) -> Option<usize> {
        let key = |p: &Prediction| (p.time_s, p.bodies);
        (0..self.predictions.len()).min_by(|&i, &k| {
            let (p, q) = (key(&self.predictions[i]), key(&self.predictions[k]));
            p.0.total_cmp(&q.0).then(p.1.cmp(&q.1))
        })
    }

    fn end_phase(&mut self) {
        let time_s = self.phase_end_s;
        let state = self.motions[STRIKER].state(time_s, &self.world.bodies[STRIKER]);
        let pose = Pose { position: state.position, yaw_rad: state.yaw_rad };
        let (phase, motion, end_s) = self.program.next(self.phase, pose, time_s);
        (self.phase, self.phase_end_s) = (phase, end_s);
        self.set(STRIKER, motion);
        self.forget(STRIKER);
        self.predict(STRIKER, time_s, None);
    }

    fn set(&mut self, body: usize, motion: Motion) {
        self.motions[body] = motion;
        if let Some(log) = &mut self.log {
            log.motion(body, &motion);
        }
    }

    fn forget(&mut self, body: usize) {
        let body = body as u32;
        self.predictions.retain(|p| p.bodies[0] != body && p.bodies[1] != body);
    }

    /// Looks for the next contact of a body with every other but one.
    fn predict(&mut self, body: usize, time_s: f64, but: Option<usize>) {
        if self.phase == Phase::Gone && body == STRIKER {
            return;
        }
        for other in 0..self.motions.len() {
            let skipped =
                other == body || Some(other) == but || (other == STRIKER && self.phase == Phase::Gone);
            if !skipped {
                self.look(body.min(other), body.max(other), time_s);
            }
        }
    }

    fn look(&mut self, a: usize, b: usize, from_s: f64) {
        if !self.is_object(a) && !self.is_object(b) {
            return;
        }
        let (time_s, touch) = match first_contact(self.mover(a), self.mover(b), from_s) {
            Outlook::Never => return,
            Outlook::Touch(time_s) => (time_s, true),
            Outlook::NotBefore(time_s) => (time_s, false),
        };
        self.predictions.push(Prediction { time_s, bodies: [a as u32, b as u32], touch });
    }

    fn touch(&mut self, a: usize, b: usize, time_s: f64) {
        let bodies = [&self.world.bodies[a], &self.world.bodies[b]];
        let states = [a, b].map(|i| self.motions[i].state(time_s, &self.world.bodies[i]));
        let touch = touch((bodies[0], &states[0]), (bodies[1], &states[1]));
        let impact = Impact::new((bodies[0], &states[0]), (bodies[1], &states[1]), &touch);
        if impact.approach <= 0.0 {
            // Bodies that do not approach do not collide; look again a little later.
            self.look(a, b, time_s + HOLD_S);
            return;
        }
        let options = &self.world.options;
        let pair = self.world.coefficients(a, b);
        let restitution = effective_restitution(options.restitution, pair.restitution, impact.approach);
        let impulse = impact.impulse(restitution, pair.friction, options.impact);
        let on_b = touch.normal_ab * impulse.normal + touch.normal_ab.perpendicular() * impulse.tangent;
        let after = [
            struck(bodies[0], &states[0], touch.point, -on_b),
            struck(bodies[1], &states[1], touch.point, on_b),
        ];
        self.impacts += 1;
        if let Some(log) = &mut self.log {
            log.impact(self.world, (time_s, [a, b]), (&touch, on_b), (&states, &after));
        }
        for (i, state) in [a, b].into_iter().zip(after) {
            if self.is_object(i) {
                let motion = Motion::slide(&state, time_s, &self.world.bodies[i], self.world.options.spin);
                self.set(i, motion);
                self.forget(i);
            }
        }
        for (i, other) in [(a, b), (b, a)] {
            if self.is_object(i) {
                self.predict(i, time_s, Some(other));
            }
        }
        let hold_s = if impact.approach < SLOW_M_S { HOLD_S } else { 0.0 };
        self.look(a, b, time_s + hold_s);
    }

    /// Whether a body moves freely: neither striker nor wall.
    fn is_object(&self, body: usize) -> bool {
        body != STRIKER && body <= self.world.objects
    }
}

/// Where and in which direction two bodies touch.
fn touch(a: (&Body, &State), b: (&Body, &State)) -> Touch {
    let seen = nearest(a, b);
    Touch { point: seen.point, normal_ab: seen.normal }
}

/// Restitution of an impact: bodies that press on each other at a creeping speed hop elastically, so that a push is a
/// bounded number of tiny impacts and no impact makes energy.
fn effective_restitution(law: RestitutionLaw, measured: f64, approach_m_s: f64) -> f64 {
    law.restitution(measured, approach_m_s).max(SLOW_M_S / approach_m_s).min(1.0)
}

/// Below this approach speed a contact presses rather than hits (m/s): a hop at it stays below a micrometre.
const SLOW_M_S: f64 = 2e-3;
/// Bodies that press on each other are looked at again after this time (s): in it a decelerating body falls back by
/// less than a micrometre.
pub(crate) const HOLD_S: f64 = 5e-4;
