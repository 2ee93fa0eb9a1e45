//! The event loop: predict, take the earliest contact, resolve, let go.

pub(crate) mod body_events;
pub(crate) mod impact_events;
pub(crate) mod queue;
#[cfg(test)]
mod reversal_tests;
pub(crate) mod striker;

use crate::geometry::Pose;
use crate::physics::contact::broadphase::{Circle, Neighbours};
use crate::physics::contact::{CONTACT_GAP_M, Mover, Outlook, closer_look, first_look};
use crate::physics::event_loop::body_events::Appointment;
use crate::physics::event_loop::queue::{Agenda, Prediction};
use crate::physics::event_loop::striker::{Phase, Program};
use crate::physics::impact::island::Cluster;
use crate::physics::impact::routh::Touch;
use crate::physics::output::outcome::Outcome;
use crate::physics::output::trajectory::Log;
use crate::physics::sliding::motion::{Motion, State};
use crate::physics::world::{STRIKER, World};
use crate::scene::Strike;

/// What a rollout needs to remember; used again by the next one.
#[derive(Clone, Debug, Default)]
pub(crate) struct Memory {
    pub(super) motions: Vec<Motion>,
    pub(super) cluster: Cluster,
    /// Where the two bodies that meet touch or nearly touch, and the gaps (m).
    pub(super) points: Vec<(Touch, f64)>,
    /// The bodies near one.
    pub(super) near: Vec<usize>,
    pub(super) neighbours: Neighbours,
    /// Bodies with new states, to be let go.
    pub(super) changed: Vec<(usize, State)>,
    /// What will happen to each body by itself.
    pub(super) appointments: Vec<Option<Appointment>>,
    /// Which bodies have fallen off the table.
    pub(super) fallen: Vec<bool>,
    /// Who has entered which area.
    pub(super) entered: Vec<[usize; 2]>,
    agenda: Agenda,
    /// Pairs that press on each other, and until when that is overlooked.
    pressing: Vec<([usize; 2], f64)>,
}

/// One strike under way.
pub(crate) struct Rollout<'a> {
    pub(super) world: &'a World,
    pub(super) memory: &'a mut Memory,
    pub(super) log: Option<&'a mut Log>,
    pub(super) impacts: usize,
    pub(super) phase: Phase,
    program: Program,
    steps: usize,
}

impl<'a> Rollout<'a> {
    /// Everything at rest, the striker about to start.
    pub(crate) fn new(
        world: &'a World,
        strike: &Strike,
        memory: &'a mut Memory,
        mut log: Option<&'a mut Log>,
    ) -> Self {
        let program = Program::new(strike, world.retract_speed_m_s, world.options.after_strike);
        memory.motions.clone_from(&world.start.motions);
        memory.motions[STRIKER] = program.forward();
        memory.neighbours.start(&world.start.circles);
        memory.neighbours.change(STRIKER, &world.bodies[STRIKER], &memory.motions[STRIKER]);
        memory.agenda.clear(world.bodies.len());
        memory.pressing.clear();
        memory.entered.clear();
        memory.fallen.clear();
        memory.fallen.resize(world.bodies.len(), false);
        memory.appointments.clear();
        memory.appointments.resize(world.bodies.len(), None);
        if let Some(log) = &mut log {
            log.start(&memory.motions);
        }
        Self { world, memory, log, impacts: 0, phase: Phase::Forward, program, steps: 0 }
    }

    /// Follows the strike until everything rests.
    pub(crate) fn outcome(mut self) -> Outcome {
        self.predict(STRIKER, 0.0);
        loop {
            let phase_end_s = match self.phase {
                Phase::Forward | Phase::Back => self.memory.motions[STRIKER].stop_s,
                Phase::Standing | Phase::Gone => f64::INFINITY,
            };
            let appointment = self.next_appointment();
            let sure_s = phase_end_s.min(appointment.map_or(f64::INFINITY, |a| a.time_s));
            // What comes at the same instant as the end of a phase comes after it.
            let Some((prediction, after_s)) = self.memory.agenda.take(sure_s.next_down()) else {
                match appointment {
                    Some(appointment) if appointment.time_s <= phase_end_s => self.keep(&appointment),
                    _ if phase_end_s < f64::INFINITY => self.end_phase(phase_end_s),
                    _ => break,
                }
                continue;
            };
            let time_s = prediction.time_s;
            self.steps += 1;
            if self.steps > MOST_STEPS {
                self.freeze(time_s);
                break;
            }
            let [a, b] = prediction.bodies.map(|i| i as usize);
            if prediction.touch {
                self.touch(a, b, time_s);
            } else {
                self.look_closer([a, b], &prediction, after_s.min(sure_s));
            }
        }
        let motions = &self.memory.motions;
        Outcome {
            poses: self.world.body_of.iter().map(|&b| motions[b].end).collect(),
            duration_s: motions.iter().map(|m| m.stop_s).fold(0.0, f64::max),
            impacts: self.impacts,
            fallen: self.world.body_of.iter().map(|&b| self.memory.fallen[b]).collect(),
            complete: self.steps <= MOST_STEPS,
        }
    }

    /// Stops everything where it is.
    fn freeze(&mut self, time_s: f64) {
        for body in 0..self.memory.motions.len() {
            let state = self.memory.motions[body].state(time_s, &self.world.bodies[body]);
            self.set(body, Motion::rest(Pose { position: state.position, yaw_rad: state.yaw_rad }, time_s));
        }
    }

    pub(super) fn mover(&self, body: usize) -> Mover<'_> {
        Mover { body: &self.world.bodies[body], motion: &self.memory.motions[body] }
    }

    /// Whether a body is no longer there.
    pub(super) fn is_gone(&self, body: usize) -> bool {
        self.memory.fallen[body] || body == STRIKER && self.phase == Phase::Gone
    }

    /// Whether two bodies can have anything to do with each other.
    fn can_meet(&self, pair: [usize; 2]) -> bool {
        let [a, b] = pair;
        let meet = if b >= self.world.areas {
            a < self.world.objects + 1 && !self.memory.entered.contains(&pair)
        } else {
            self.is_object(a) || self.is_object(b)
        };
        meet && !self.is_gone(a) && !self.is_gone(b)
    }

    /// Whether a body moves freely: neither striker nor wall.
    pub(super) fn is_object(&self, body: usize) -> bool {
        body != STRIKER && body <= self.world.objects
    }

    /// The striker stops, turns back or is gone.
    pub(super) fn end_phase(&mut self, time_s: f64) {
        let state = self.memory.motions[STRIKER].state(time_s, &self.world.bodies[STRIKER]);
        let pose = Pose { position: state.position, yaw_rad: state.yaw_rad };
        let (phase, motion) = self.program.next(self.phase, pose, time_s);
        self.phase = phase;
        self.set(STRIKER, motion);
        self.predict(STRIKER, time_s);
    }

    /// Gives a body a new motion; all predictions about it are void.
    pub(super) fn set(&mut self, body: usize, motion: Motion) {
        self.memory.motions[body] = motion;
        self.memory.agenda.void(body);
        self.memory.neighbours.change(body, &self.world.bodies[body], &motion);
        self.appoint(body, &motion);
        if let Some(log) = &mut self.log {
            log.motion(body, &motion);
        }
    }

    /// Bodies with new states go their ways, and their next contacts are looked for.
    pub(super) fn let_go(&mut self, time_s: f64) {
        for k in 0..self.memory.changed.len() {
            let (body, state) = self.memory.changed[k];
            let motion = Motion::slide(&state, time_s, &self.world.bodies[body], self.world.options.spin);
            self.set(body, motion);
        }
        for k in 0..self.memory.changed.len() {
            self.predict(self.memory.changed[k].0, time_s);
        }
    }

    /// Looks for a body's next contacts.
    fn predict(&mut self, body: usize, time_s: f64) {
        if self.is_gone(body) {
            return;
        }
        let Circle { centre, radius_m } =
            Circle::around(&self.world.bodies[body], &self.memory.motions[body]);
        let circle = Circle { centre, radius_m: radius_m + CONTACT_GAP_M };
        for k in 0..self.memory.neighbours.around(circle) {
            let other = self.memory.neighbours.found(k);
            if other == body {
                continue;
            }
            // Two bodies that both go new ways are looked at once.
            let later = other < body && self.memory.changed.iter().any(|c| c.0 == other) && body != STRIKER;
            let pair = [body.min(other), body.max(other)];
            if !later && self.can_meet(pair) {
                self.look(pair, time_s);
            }
        }
    }

    pub(super) fn look(&mut self, pair: [usize; 2], from_s: f64) {
        let pressing_s = self.pressing_s(pair);
        let outlook = first_look(self.mover(pair[0]), self.mover(pair[1]), from_s, pressing_s);
        self.note(pair, outlook, None);
    }

    fn look_closer(&mut self, pair: [usize; 2], prediction: &Prediction, until_s: f64) {
        let pressing_s = self.pressing_s(pair);
        let mut hint = prediction.hint;
        let movers = (self.mover(pair[0]), self.mover(pair[1]));
        let outlook = closer_look(movers, (prediction.time_s, until_s), pressing_s, &mut hint);
        self.note(pair, outlook, hint);
    }

    fn note(&mut self, pair: [usize; 2], outlook: Outlook, hint: Option<crate::physics::contact::Feature>) {
        match outlook {
            Outlook::Never => {}
            Outlook::Touch(time_s) => self.memory.agenda.add(time_s, pair, true, hint),
            Outlook::NotBefore(time_s) => self.memory.agenda.add(time_s, pair, false, hint),
        }
    }

    /// Until when a pair's pressing is overlooked (s).
    fn pressing_s(&self, pair: [usize; 2]) -> f64 {
        self.memory.pressing.iter().find(|p| p.0 == pair).map_or(0.0, |p| p.1)
    }

    /// From now on a pair's pressing is overlooked for a while.
    pub(super) fn overlook(&mut self, pair: [usize; 2], time_s: f64, while_s: f64) {
        self.memory.pressing.retain(|p| p.0 != pair && p.1 > time_s);
        self.memory.pressing.push((pair, time_s + while_s));
    }

    /// Looks again at a pair whose contact came to nothing: it creeps, so it may press for a while; if it is overlooked
    /// already, a moment later.
    pub(super) fn look_again(&mut self, pair: [usize; 2], time_s: f64, while_s: f64) {
        if self.pressing_s(pair) > time_s {
            self.look(pair, time_s + MOMENT_S);
        } else {
            self.overlook(pair, time_s, while_s);
            self.look(pair, time_s);
        }
    }
}

/// A rollout takes a few hundred steps, a pile pushed across the table some ten thousand; this many mean that it is stuck.
const MOST_STEPS: usize = 2_000_000;
/// In it (s) nothing moves by more than a fifth of a micrometre.
const MOMENT_S: f64 = 2e-7;
