//! How is a contact resolved: the pair alone, or together with the contacts that close at the same time?

use crate::physics::contact::broadphase::Circle;
use crate::physics::contact::manifold::contact_points;
use crate::physics::contact::time_of_impact::{CONTACT_GAP_M, SUSTAINED_CONTACT_M_S, SUSTAINED_CONTACT_S};
use crate::physics::event_loop::rollout::{Memory, Rollout};
use crate::physics::event_loop::striker::Phase;
use crate::physics::impact::compliant::{self, Compliance, Ending};
use crate::physics::impact::island::{Contact, Island, Member};
use crate::physics::impact::routh::{ContactPoint, Impact, state_after_impulse};
use crate::physics::options::MultipleImpact;
use crate::physics::output::recorder::{ImpactRecord, striker_work_j};
use crate::physics::pair_coefficients::Coefficients;
use crate::physics::rotation::length;
use crate::physics::sliding::body::{Body, STRIKER};
use crate::physics::sliding::motion::{BodyState, State};

/// Approach speed (m/s) below which a contact does not close: rounding; sustained contacts exceed it while they are ignored.
const LEAST_APPROACH_M_S: f64 = 1e-6;
/// Approach speed below which contacts are resolved by Moreau's law, over the least rebound speed.
const SLOW_IMPACT_PER_REBOUND: f64 = 10.0 / 3.0;
/// Gap (m) at which points touch: the gap at which the search ends, and rounding.
const TOUCHING_M: f64 = 2.0 * CONTACT_GAP_M;
/// Penetration of sustained contacts (m) above which bodies are separated.
const PENETRATION_TOLERANCE_M: f64 = 3e-7;
/// Penetration that remains after separation (m) above which bodies are jammed.
const JAMMED_PENETRATION_M: f64 = 1e-6;
/// Gap (m) below which contacts are resolved together.
const NEAR_CONTACT_M: f64 = 2e-6;

/// Two touching bodies and the impact at their fastest contact point.
struct PairContact {
    pair: [usize; 2],
    states: [State; 2],
    contact_point: ContactPoint,
    gap_m: f64,
    impact: Impact,
}

impl Rollout<'_> {
    /// Resolves a contact of two bodies.
    pub(super) fn resolve_contact(&mut self, pair: [usize; 2], time_s: f64) {
        let states = pair.map(|i| self.memory.motions[i].state(time_s, &self.world.bodies[i]));
        self.find_contact_points(pair, &states);
        let Some(contact) = self.fastest_contact(pair, states) else {
            self.retry_pair(
                pair,
                time_s,
                sustained_contact_time_s(pair.map(|i| &self.world.bodies[i]), &states),
            );
            return;
        };
        let approach = contact.impact.approach;
        match self.world.options.multiple_impact {
            _ if approach < SLOW_IMPACT_PER_REBOUND * self.world.options.pressing.least_rebound_m_s() => {
                self.gather(&contact, NEAR_CONTACT_M, time_s);
                if self.memory.island.contacts.len() > 1 && self.resolve_slow(pair, time_s) {
                    return;
                }
            }
            MultipleImpact::Compliant(compliance) => {
                self.gather(&contact, NEAR_CONTACT_M.max(approach * compliance.contact_time_s), time_s);
                if self.memory.island.contacts.len() > 1
                    && self.resolve_compliant(&compliance, &contact, time_s)
                {
                    return;
                }
            }
            MultipleImpact::Pairwise => {}
        }
        self.resolve_pair(&contact, time_s);
    }

    /// Finds all points at which two bodies touch or could touch during the contact time.
    fn find_contact_points(&mut self, pair: [usize; 2], states: &[State; 2]) {
        let contact_time_s = match self.world.options.multiple_impact {
            MultipleImpact::Compliant(compliance) => compliance.contact_time_s,
            MultipleImpact::Pairwise => 0.0,
        };
        let [a, b] = [0, 1].map(|k| BodyState { body: &self.world.bodies[pair[k]], state: &states[k] });
        let speeds = [a, b].map(|BodyState { body, state }| {
            length(state.velocity) + state.yaw_rate_rad_s.abs() * body.shape.outer_radius_m
        });
        let reach_m = NEAR_CONTACT_M.max(contact_time_s * (speeds[0] + speeds[1]));
        let points = &mut self.memory.points;
        points.clear();
        contact_points(a, b, reach_m, |contact_point, gap_m| points.push((contact_point, gap_m)));
    }

    /// The contact point of greatest approach speed; none if no point approaches.
    fn fastest_contact(&self, pair: [usize; 2], states: [State; 2]) -> Option<PairContact> {
        let [a, b] = [0, 1].map(|k| BodyState { body: &self.world.bodies[pair[k]], state: &states[k] });
        let mut fastest: Option<PairContact> = None;
        for &(contact_point, gap_m) in self.memory.points.iter().filter(|p| p.1 <= TOUCHING_M) {
            let impact = Impact::new(a, b, &contact_point);
            if impact.approach > fastest.as_ref().map_or(LEAST_APPROACH_M_S, |f| f.impact.approach) {
                fastest = Some(PairContact { pair, states, contact_point, gap_m, impact });
            }
        }
        fastest
    }

    /// Resolves one contact by Routh's method.
    fn resolve_pair(&mut self, contact: &PairContact, time_s: f64) {
        let PairContact { pair, states, contact_point, gap_m, impact } = contact;
        let options = &self.world.options;
        let coefficients = self.world.coefficients(pair[0], pair[1]);
        let measured = options.restitution.restitution(coefficients.restitution, impact.approach);
        let restitution = options.pressing.restitution(measured, impact.approach);
        let impulse = impact.impulse(&Coefficients { restitution, ..coefficients }, options.impact);
        let on_b = contact_point.normal_ab * impulse.normal
            + contact_point.normal_ab.perpendicular() * impulse.tangent;
        let bodies = pair.map(|i| &self.world.bodies[i]);
        let mut after = [
            state_after_impulse(bodies[0], &states[0], contact_point.point, -on_b),
            state_after_impulse(bodies[1], &states[1], contact_point.point, on_b),
        ];
        if *gap_m < -PENETRATION_TOLERANCE_M {
            // Separates bodies that penetrated each other during a sustained contact.
            let shift = -gap_m / (bodies[0].inverse_mass + bodies[1].inverse_mass);
            after[0].position =
                after[0].position - contact_point.normal_ab * (shift * bodies[0].inverse_mass);
            after[1].position += contact_point.normal_ab * (shift * bodies[1].inverse_mass);
        }
        self.impacts += 1;
        let (before, impulse) = (states, on_b);
        let record = ImpactRecord { time_s, bodies: *pair, contact_point, impulse, before, after: &after };
        self.striker_work_j += record.striker_work_j();
        if let Some(recorder) = &mut self.recorder {
            recorder.impact(self.world, &record);
        }
        if impact.approach < SUSTAINED_CONTACT_M_S {
            self.ignore_contact(*pair, time_s, sustained_contact_time_s(bodies, &after));
        }
        self.memory.changed.clear();
        for (&body, state) in pair.iter().zip(after) {
            if self.is_object(body) {
                self.memory.changed.push((body, state));
            }
        }
        self.release(time_s);
    }

    /// Resolves several fast contacts as springs; returns whether that changed a body of the pair that touched first.
    fn resolve_compliant(&mut self, compliance: &Compliance, contact: &PairContact, time_s: f64) -> bool {
        let Memory { island, springs, .. } = &mut *self.memory;
        let law = self.world.options.restitution;
        if compliant::resolve(island, springs, &contact.impact, compliance, law) == Ending::Jammed {
            // The arm stops; the same contact is predicted again without its push.
            let is_stopped = self.stop_striker(time_s);
            if is_stopped {
                self.predict_pair(contact.pair, time_s);
            }
            return is_stopped;
        }
        self.release_island(contact.pair, time_s)
    }

    /// Resolves several slow contacts by Moreau's law and ignores them for a while; returns whether that changed a body of the
    /// pair that touched first.
    fn resolve_slow(&mut self, pair: [usize; 2], time_s: f64) -> bool {
        let options = &self.world.options;
        self.memory.island.resolve_moreau(options.restitution, options.pressing);
        let members = &self.memory.island.members;
        let acceleration: f64 = members
            .iter()
            .map(|m| greatest_rim_acceleration_m_s2(&self.world.bodies[m.body], &m.after))
            .fold(0.0, f64::max);
        let while_s = SUSTAINED_CONTACT_S.min((PENETRATION_TOLERANCE_M / acceleration).sqrt());
        for k in 0..self.memory.island.contacts.len() {
            let [a, b] = self.memory.island.contacts[k].members.map(|i| self.memory.island.members[i].body);
            self.ignore_contact([a.min(b), a.max(b)], time_s, while_s);
        }
        self.release_island(pair, time_s)
    }

    /// Separates and releases the members of the island; returns whether a body of the pair changed.
    fn release_island(&mut self, pair: [usize; 2], time_s: f64) -> bool {
        let is_jammed = self.memory.island.separate(PENETRATION_TOLERANCE_M) > JAMMED_PENETRATION_M;
        for contact in self.memory.island.contacts.iter().filter(|c| c.impulse.normal > 0.0) {
            let members = contact.members.map(|i| &self.memory.island.members[i]);
            let (bodies, before) = (members.map(|m| m.body), members.map(|m| m.before.velocity));
            self.striker_work_j += striker_work_j(bodies, before, contact.impulse_on_b());
            self.impacts += 1;
        }
        if let Some(recorder) = &mut self.recorder {
            recorder.island(self.world, time_s, &self.memory.island);
        }
        self.memory.changed.clear();
        for k in 0..self.memory.island.members.len() {
            let Member { body, before, after, .. } = self.memory.island.members[k];
            if self.is_object(body) && after != before {
                self.memory.changed.push((body, after));
            }
        }
        let moved = self.memory.changed.iter().any(|c| pair.contains(&c.0));
        if moved {
            self.release(time_s);
        }
        if is_jammed {
            self.stop_striker(time_s);
        }
        moved
    }

    /// Stops a striker that jams objects against something fixed; returns whether it stopped.
    fn stop_striker(&mut self, time_s: f64) -> bool {
        let striker = self.memory.island.members.iter().any(|m| m.body == STRIKER);
        let is_stopped = striker && matches!(self.phase, Phase::Forward | Phase::Retract);
        if is_stopped {
            self.end_phase(time_s);
        }
        is_stopped
    }

    /// Gathers the island of a contact: all contacts within `reach_m` that are connected to it, the given one first.
    fn gather(&mut self, contact: &PairContact, reach_m: f64, time_s: f64) {
        self.memory.island.clear();
        for (&body, state) in contact.pair.iter().zip(&contact.states) {
            self.memory.island.members.push(Member::new(body, &self.world.bodies[body], state));
        }
        self.gather_pair(contact, reach_m);
        let mut index = 0;
        while index < self.memory.island.members.len() {
            let member = self.memory.island.members[index];
            if self.is_object(member.body) {
                self.gather_around(index, &member, reach_m, time_s);
            }
            index += 1;
        }
    }

    /// Adds the contacts of the touching pair, the fastest first.
    fn gather_pair(&mut self, contact: &PairContact, reach_m: f64) {
        let PairContact { pair, states, contact_point, .. } = contact;
        let bodies = pair.map(|i| &self.world.bodies[i]);
        let coefficients = self.world.coefficients(pair[0], pair[1]);
        let contacts = &mut self.memory.island.contacts;
        for &(point, gap_m) in self.memory.points.iter().filter(|p| p.1 <= reach_m) {
            let body_states = [0, 1].map(|k| BodyState { body: bodies[k], state: &states[k] });
            contacts.push(Contact::new([0, 1], body_states, point, gap_m, coefficients));
            if point == *contact_point {
                let last = contacts.len() - 1;
                contacts.swap(0, last);
            }
        }
    }

    /// Adds the contacts of one member with bodies that are not yet members, or that are later in the list of members.
    fn gather_around(&mut self, index: usize, member: &Member, reach_m: f64, time_s: f64) {
        let (one, state) = (member.body, member.before);
        self.find_near(one, &state, reach_m);
        let world = self.world;
        let body = &world.bodies[one];
        let Memory { island, near, motions, .. } = &mut *self.memory;
        let Island { members, contacts, .. } = island;
        for &other in near.iter() {
            let mut known = members.iter().position(|m| m.body == other);
            let fixed = other == STRIKER || other > world.objects;
            // Each pair once; the touching pair has been added before.
            if known.is_some_and(|k| k < index && !fixed || k + index == 1) {
                continue;
            }
            let other_state = known
                .map_or_else(|| motions[other].state(time_s, &world.bodies[other]), |k| members[k].before);
            let circles_m = body.shape.outer_radius_m + world.bodies[other].shape.outer_radius_m + reach_m;
            if (other_state.position - state.position).length_squared() > circles_m * circles_m {
                continue;
            }
            let a = BodyState { body, state: &state };
            let b = BodyState { body: &world.bodies[other], state: &other_state };
            contact_points(a, b, reach_m, |point, gap_m| {
                let other_index = *known.get_or_insert_with(|| {
                    members.push(Member::new(other, b.body, b.state));
                    members.len() - 1
                });
                let coefficients = world.coefficients(one, other);
                contacts.push(Contact::new([index, other_index], [a, b], point, gap_m, coefficients));
            });
        }
    }

    /// Finds all bodies whose paths come within reach of the present position of one, in increasing order.
    fn find_near(&mut self, one: usize, state: &State, reach_m: f64) {
        let radius_m = self.world.bodies[one].shape.outer_radius_m + reach_m;
        self.memory.near.clear();
        for k in 0..self.memory.broadphase.query(Circle { centre: state.position, radius_m }) {
            let other = self.memory.broadphase.result(k);
            if other != one && other < self.world.areas && !self.is_gone(other) {
                self.memory.near.push(other);
            }
        }
    }
}

/// For how long a sustained contact can be ignored (s): in this time friction and spin change the gap by less than
/// [`PENETRATION_TOLERANCE_M`].
fn sustained_contact_time_s(bodies: [&Body; 2], states: &[State; 2]) -> f64 {
    let acceleration: f64 =
        bodies.iter().zip(states).map(|(body, state)| greatest_rim_acceleration_m_s2(body, state)).sum();
    SUSTAINED_CONTACT_S.min((2.0 * PENETRATION_TOLERANCE_M / acceleration).sqrt())
}

/// Bound of the acceleration of a point on the rim of a body by friction, tilt and spin (m/s2).
fn greatest_rim_acceleration_m_s2(body: &Body, state: &State) -> f64 {
    if body.is_fixed() {
        return 0.0;
    }
    let rate = state.yaw_rate_rad_s;
    body.friction_deceleration_m_s2
        + body.tilt_m_s2.length()
        + (body.spin_deceleration_rad_s2() + rate * rate) * body.shape.outer_radius_m
}
