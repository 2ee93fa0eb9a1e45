//! What is the state of a strike that is being simulated, and how do predictions follow its changes?

use crate::geometry::Pose;
use crate::physics::contact::broadphase::{Broadphase, Circle};
use crate::physics::contact::separating_axis::Feature;
use crate::physics::contact::time_of_impact::{CONTACT_GAP_M, ContactSearch, MovingBody, TimeOfImpact};
use crate::physics::contact::{lower_bound, time_of_impact};
use crate::physics::event_loop::body_events::{ScheduledEvent, next_event};
use crate::physics::event_loop::event_queue::{EventQueue, Prediction};
use crate::physics::event_loop::striker::{Phase, StrikerSchedule};
use crate::physics::impact::compliant::Springs;
use crate::physics::impact::island::Island;
use crate::physics::impact::routh::ContactPoint;
use crate::physics::output::recorder::Recorder;
use crate::physics::sliding::body::STRIKER;
use crate::physics::sliding::motion::{Motion, State};
use crate::physics::world::World;
use crate::scene::Strike;

/// Working memory of a rollout, reused by the next one.
#[derive(Clone, Debug, Default)]
pub(crate) struct Memory {
    /// Present motion of each body.
    pub(super) motions: Vec<Motion>,
    pub(super) island: Island,
    pub(super) springs: Springs,
    /// Contact points of the pair that touches, and points that are close, with their gaps (m).
    pub(super) points: Vec<(ContactPoint, f64)>,
    /// Bodies near the one whose contacts are gathered.
    pub(super) near: Vec<usize>,
    pub(super) broadphase: Broadphase,
    /// Bodies with new states, to be released.
    pub(super) changed: Vec<(usize, State)>,
    /// The next event of each single body.
    pub(super) scheduled: Vec<Option<ScheduledEvent>>,
    /// Whether each body has fallen off the table.
    pub(super) fallen: Vec<bool>,
    /// Pairs of a body and a keep-out area that it has entered.
    pub(super) entered: Vec<[usize; 2]>,
    pub(super) queue: EventQueue,
    /// Pairs in sustained contact, and until when that contact is ignored (s).
    ignored: Vec<([usize; 2], f64)>,
}

/// A strike that is being simulated.
pub(crate) struct Rollout<'a> {
    pub(super) world: &'a World,
    pub(super) memory: &'a mut Memory,
    pub(super) recorder: Option<&'a mut Recorder>,
    /// Number of impacts so far.
    pub(super) impacts: usize,
    /// Work of the striker so far (J).
    pub(super) striker_work_j: f64,
    pub(super) phase: Phase,
    schedule: StrikerSchedule,
}

impl<'a> Rollout<'a> {
    /// Everything at rest, the striker about to start.
    pub(crate) fn new(
        world: &'a World,
        strike: &Strike,
        memory: &'a mut Memory,
        mut recorder: Option<&'a mut Recorder>,
    ) -> Self {
        let schedule = StrikerSchedule::new(strike, world.retract_speed_m_s, world.options.after_strike);
        memory.motions.clone_from(&world.start.motions);
        memory.motions[STRIKER] = schedule.forward();
        memory.broadphase.reset(&world.start.circles);
        memory.broadphase.update(STRIKER, &world.bodies[STRIKER], &memory.motions[STRIKER]);
        memory.queue.clear(world.bodies.len());
        memory.ignored.clear();
        memory.entered.clear();
        memory.fallen.clear();
        memory.fallen.resize(world.bodies.len(), false);
        memory.scheduled.clear();
        memory.scheduled.resize(world.bodies.len(), None);
        if let Some(recorder) = &mut recorder {
            recorder.start(&memory.motions);
        }
        Self { world, memory, recorder, impacts: 0, striker_work_j: 0.0, phase: Phase::Forward, schedule }
    }

    fn moving(&self, body: usize) -> MovingBody<'_> {
        MovingBody { body: &self.world.bodies[body], motion: &self.memory.motions[body] }
    }

    /// Whether a body is no longer on the table.
    pub(super) fn is_gone(&self, body: usize) -> bool {
        self.memory.fallen[body] || body == STRIKER && self.phase == Phase::Lifted
    }

    /// Whether a body moves freely: neither striker nor wall.
    pub(super) fn is_object(&self, body: usize) -> bool {
        body != STRIKER && body <= self.world.objects
    }

    /// Whether contacts of two bodies are of interest.
    fn can_collide(&self, pair: [usize; 2]) -> bool {
        let [a, b] = pair;
        let is_relevant = if b >= self.world.areas {
            a < self.world.objects + 1 && !self.memory.entered.contains(&pair)
        } else {
            self.is_object(a) || self.is_object(b)
        };
        is_relevant && !self.is_gone(a) && !self.is_gone(b)
    }

    /// Ends the present phase of the striker: it stops, draws back or is lifted.
    pub(super) fn end_phase(&mut self, time_s: f64) {
        let state = self.memory.motions[STRIKER].state(time_s, &self.world.bodies[STRIKER]);
        let pose = Pose { position: state.position, yaw_rad: state.yaw_rad };
        let (phase, motion) = self.schedule.next(self.phase, pose, time_s);
        self.phase = phase;
        self.set_motion(STRIKER, motion);
        self.predict_contacts(STRIKER, time_s);
    }

    /// Gives a body a new motion, which invalidates all predictions about it.
    pub(super) fn set_motion(&mut self, body: usize, motion: Motion) {
        self.memory.motions[body] = motion;
        self.memory.queue.invalidate(body);
        self.memory.broadphase.update(body, &self.world.bodies[body], &motion);
        let has_body_events = !self.world.edge.is_empty() || self.world.has_curved_paths;
        if has_body_events && self.is_object(body) && !self.memory.fallen[body] {
            self.memory.scheduled[body] =
                next_event(&self.world.edge, body, &self.world.bodies[body], &motion);
        }
        if let Some(recorder) = &mut self.recorder {
            recorder.motion(body, &motion);
        }
    }

    /// Starts new motions from the changed states and predicts the next contacts of these bodies.
    pub(super) fn release(&mut self, time_s: f64) {
        for k in 0..self.memory.changed.len() {
            let (body, state) = self.memory.changed[k];
            let motion = Motion::slide(&state, time_s, &self.world.bodies[body], self.world.options.spin);
            self.set_motion(body, motion);
        }
        for k in 0..self.memory.changed.len() {
            self.predict_contacts(self.memory.changed[k].0, time_s);
        }
    }

    /// Predicts the next contacts of a body.
    pub(super) fn predict_contacts(&mut self, body: usize, time_s: f64) {
        if self.is_gone(body) {
            return;
        }
        let Circle { centre, radius_m } =
            Circle::around(&self.world.bodies[body], &self.memory.motions[body]);
        let circle = Circle { centre, radius_m: radius_m + CONTACT_GAP_M };
        for k in 0..self.memory.broadphase.query(circle) {
            let other = self.memory.broadphase.result(k);
            if other == body {
                continue;
            }
            // A pair whose bodies both have new motions is predicted once.
            let is_done = other < body && self.memory.changed.iter().any(|c| c.0 == other) && body != STRIKER;
            let pair = [body.min(other), body.max(other)];
            if !is_done && self.can_collide(pair) {
                self.predict_pair(pair, time_s);
            }
        }
    }

    /// Predicts the next contact of a pair from a time on.
    pub(super) fn predict_pair(&mut self, pair: [usize; 2], from_s: f64) {
        let ignored_until_s = self.ignored_until_s(pair);
        let bound = lower_bound(self.moving(pair[0]), self.moving(pair[1]), from_s, ignored_until_s);
        self.enqueue(pair, bound, None);
    }

    /// Continues the search for a contact from the lower bound of a prediction.
    pub(super) fn refine(&mut self, pair: [usize; 2], prediction: &Prediction, until_s: f64) {
        let ignored_until_s = self.ignored_until_s(pair);
        let mut hint = prediction.hint;
        let bodies = [self.moving(pair[0]), self.moving(pair[1])];
        let search = ContactSearch { bodies, from_s: prediction.time_s, until_s, ignored_until_s };
        let found = time_of_impact(search, &mut hint);
        self.enqueue(pair, found, hint);
    }

    fn enqueue(&mut self, pair: [usize; 2], found: TimeOfImpact, hint: Option<Feature>) {
        match found {
            TimeOfImpact::Never => {}
            TimeOfImpact::At(time_s) => self.memory.queue.push(time_s, pair, true, hint),
            TimeOfImpact::NotBefore(time_s) => self.memory.queue.push(time_s, pair, false, hint),
        }
    }

    /// Until when the sustained contact of a pair is ignored (s); zero if there is none.
    fn ignored_until_s(&self, pair: [usize; 2]) -> f64 {
        self.memory.ignored.iter().find(|p| p.0 == pair).map_or(0.0, |p| p.1)
    }

    /// Ignores the sustained contact of a pair for a while (s).
    pub(super) fn ignore_contact(&mut self, pair: [usize; 2], time_s: f64, while_s: f64) {
        self.memory.ignored.retain(|p| p.0 != pair && p.1 > time_s);
        self.memory.ignored.push((pair, time_s + while_s));
    }

    /// Predicts a pair again whose contact had no approach speed: the contact is ignored for a while (s), or, if it is ignored
    /// already, the search starts [`MOMENT_S`] later.
    pub(super) fn retry_pair(&mut self, pair: [usize; 2], time_s: f64, while_s: f64) {
        if self.ignored_until_s(pair) > time_s {
            self.predict_pair(pair, time_s + MOMENT_S);
        } else {
            self.ignore_contact(pair, time_s, while_s);
            self.predict_pair(pair, time_s);
        }
    }
}

/// Time (s) in which no body moves by more than a fifth of a micrometre.
const MOMENT_S: f64 = 2e-7;
