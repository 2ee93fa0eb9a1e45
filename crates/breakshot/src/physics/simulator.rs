//! The event loop: predict, take the earliest contact, resolve, let go.

use super::Touching;
use super::body::Body;
use super::cluster::{Cluster, Compliance, Contact, End, Member};
use super::contact::{Mover, Outlook, contact_points, first_contact, nearest};
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
    cluster: Cluster,
}

/// One rollout under way.
struct Run<'a> {
    world: &'a World,
    motions: &'a mut Vec<Motion>,
    predictions: &'a mut Vec<Prediction>,
    cluster: &'a mut Cluster,
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
            cluster: &mut self.cluster,
            program,
            phase: Phase::Forward,
            phase_end_s,
            impacts: 0,
            log,
        };
        if let Some(log) = &mut run.log {
            log.start(run.motions);
        }
        run.predict_striker(0.0);
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
        self.predict_striker(time_s);
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

    /// Looks for the striker's next contacts.
    fn predict_striker(&mut self, time_s: f64) {
        if self.phase != Phase::Gone {
            for other in 1..=self.world.objects {
                self.look(STRIKER, other, time_s);
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
        let states = [a, b].map(|i| self.motions[i].state(time_s, &self.world.bodies[i]));
        let bodies = [&self.world.bodies[a], &self.world.bodies[b]];
        let touch = touch((bodies[0], &states[0]), (bodies[1], &states[1]));
        let impact = Impact::new((bodies[0], &states[0]), (bodies[1], &states[1]), &touch);
        if impact.approach <= 0.0 {
            // Bodies that do not approach do not collide; look again a little later.
            self.look(a, b, time_s + HOLD_S);
            return;
        }
        self.cluster.clear();
        if let Touching::Compliant(compliance) = &self.world.options.touching
            && impact.approach > SLOW_M_S
        {
            self.gather([a, b], states, (touch, impact.approach * compliance.contact_time_s), time_s);
            if self.cluster.contacts.len() > 1 {
                self.resolve_together(compliance, time_s);
                return;
            }
        }
        self.resolve_alone([a, b], states, (touch, impact), time_s);
    }

    /// One contact: Routh's method.
    fn resolve_alone(
        &mut self,
        [a, b]: [usize; 2],
        states: [State; 2],
        (touch, impact): (Touch, Impact),
        time_s: f64,
    ) {
        let options = &self.world.options;
        let pair = self.world.coefficients(a, b);
        let restitution = effective_restitution(options.restitution, pair.restitution, impact.approach);
        let impulse = impact.impulse(restitution, pair.friction, options.impact);
        let on_b = touch.normal_ab * impulse.normal + touch.normal_ab.perpendicular() * impulse.tangent;
        let after = [(a, -on_b), (b, on_b)]
            .map(|(i, p)| (&self.world.bodies[i], p))
            .into_iter()
            .zip(&states)
            .map(|((body, p), state)| struck(body, state, touch.point, p));
        let after: Vec<State> = after.collect();
        self.impacts += 1;
        if let Some(log) = &mut self.log {
            log.impact(self.world, (time_s, [a, b]), (&touch, on_b), (&states, &[after[0], after[1]]));
        }
        self.let_go(&[(a, after[0]), (b, after[1])], time_s);
        let hold_s = if impact.approach < SLOW_M_S { HOLD_S } else { 0.0 };
        self.look(a, b, time_s + hold_s);
    }

    /// Several contacts: as springs.
    fn resolve_together(&mut self, compliance: &Compliance, time_s: f64) {
        let end = self.cluster.resolve(compliance, self.world.options.restitution);
        let acting = self.cluster.contacts.iter().filter(|c| c.impulse.normal > 0.0);
        self.impacts += acting.count();
        if let Some(log) = &mut self.log {
            log.cluster(self.world, time_s, self.cluster);
        }
        let changed: Vec<(usize, State)> =
            self.cluster.members.iter().filter(|m| m.after != m.before).map(|m| (m.body, m.after)).collect();
        self.let_go(&changed, time_s);
        for (i, (a, _)) in changed.iter().enumerate() {
            for (b, _) in &changed[i + 1..] {
                self.look(*a.min(b), *a.max(b), time_s);
            }
        }
        if end == End::Squeezed {
            self.phase_end_s = time_s;
        }
    }

    /// Finds the contacts that close together with the one between two bodies, and all bodies that take part.
    fn gather(&mut self, first: [usize; 2], states: [State; 2], (touch, reach_m): (Touch, f64), time_s: f64) {
        let world = self.world;
        let cluster = &mut *self.cluster;
        for (body, state) in first.into_iter().zip(&states) {
            cluster.members.push(Member::new(body, &world.bodies[body], state));
        }
        let mut done = 0;
        while done < cluster.members.len() {
            let (i, one) = (done, cluster.members[done].body);
            done += 1;
            if one == STRIKER || one > world.objects {
                continue;
            }
            for other in 0..self.motions.len() {
                let gone = other == STRIKER && self.phase == Phase::Gone;
                let known = cluster.members.iter().position(|m| m.body == other);
                if gone
                    || known.is_some_and(|k| k < done && other != STRIKER && other <= world.objects || k == i)
                {
                    continue;
                }
                let state = self.motions[other].state(time_s, &world.bodies[other]);
                let (before, reach) = (cluster.members[i].before, reach_m + OUTER_SLACK_M);
                let circles =
                    world.bodies[one].plate.outer_radius_m + world.bodies[other].plate.outer_radius_m + reach;
                let wall = other > world.objects;
                if !wall && (state.position - before.position).length_squared() > circles * circles {
                    continue;
                }
                let mut k = known;
                let is_first =
                    (first[0] == one && first[1] == other) || (first[1] == one && first[0] == other);
                contact_points(
                    (&world.bodies[one], &before),
                    (&world.bodies[other], &state),
                    reach_m,
                    |found, gap_m| {
                        let k = *k.get_or_insert_with(|| {
                            cluster.members.push(Member::new(other, &world.bodies[other], &state));
                            cluster.members.len() - 1
                        });
                        let pair = ((&world.bodies[one], &before), (&world.bodies[other], &state));
                        let contact =
                            Contact::new((i, k), pair, (found, gap_m), world.coefficients(one, other));
                        if is_first
                            && (found.point - touch.point).length_squared() < OUTER_SLACK_M * OUTER_SLACK_M
                        {
                            cluster.contacts.insert(0, contact);
                        } else {
                            cluster.contacts.push(contact);
                        }
                    },
                );
            }
        }
    }

    /// Bodies with new states go their ways; their contacts with all others are predicted, not those among themselves.
    fn let_go(&mut self, changed: &[(usize, State)], time_s: f64) {
        for &(body, state) in changed {
            if self.is_object(body) {
                let motion = Motion::slide(&state, time_s, &self.world.bodies[body], self.world.options.spin);
                self.set(body, motion);
                self.forget(body);
            }
        }
        for &(body, _) in changed {
            if self.is_object(body) {
                for other in 0..self.motions.len() {
                    if changed.iter().all(|c| c.0 != other)
                        && !(other == STRIKER && self.phase == Phase::Gone)
                    {
                        self.look(body.min(other), body.max(other), time_s);
                    }
                }
            }
        }
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

/// How far numbers may differ for what is the same place (m).
const OUTER_SLACK_M: f64 = 1e-7;

/// Below this approach speed a contact presses rather than hits (m/s): a hop at it stays below a micrometre.
const SLOW_M_S: f64 = 2e-3;
/// Bodies that press on each other are looked at again after this time (s): in it a decelerating body falls back by
/// less than a micrometre.
pub(crate) const HOLD_S: f64 = 5e-4;
