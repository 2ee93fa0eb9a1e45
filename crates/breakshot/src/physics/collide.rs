//! Two bodies touch: alone by Routh's method, or together with the contacts that close at the same time.

use super::Touching;
use super::cluster::{Cluster, Compliance, Contact, End, Member};
use super::contact::{PRESSING_M_S, contact_points, nearest};
use super::evolve::State;
use super::resolve::{Impact, RestitutionLaw, Touch, struck};
use super::rollout::Rollout;
use super::striker::Phase;
use super::world::STRIKER;

/// Approach speeds below it are rounding (m/s); what presses gains more in the time for which it is overlooked.
const CREEPING_M_S: f64 = 1e-6;
/// How far numbers may differ for what is the same place (m).
const SAME_PLACE_M: f64 = 1e-7;

/// Two bodies as they touch.
struct Meeting {
    pair: [usize; 2],
    states: [State; 2],
    touch: Touch,
    impact: Impact,
}

impl Rollout<'_> {
    /// Resolves a contact.
    pub(super) fn touch(&mut self, a: usize, b: usize, time_s: f64) {
        let pair = [a, b];
        let bodies = pair.map(|i| &self.world.bodies[i]);
        let states = pair.map(|i| self.memory.motions[i].state(time_s, &self.world.bodies[i]));
        let (one, other) = ((bodies[0], &states[0]), (bodies[1], &states[1]));
        let seen = nearest(one, other);
        let touch = Touch { point: seen.point, normal_ab: seen.normal };
        let impact = Impact::new(one, other, &touch);
        if impact.approach < CREEPING_M_S {
            self.look_again(pair, time_s);
            return;
        }
        let meeting = Meeting { pair, states, touch, impact };
        if let Touching::Compliant(compliance) = self.world.options.touching {
            self.gather(&meeting, impact.approach * compliance.contact_time_s, time_s);
            if self.memory.cluster.contacts.len() > 1 {
                self.resolve_together(&compliance, time_s);
                return;
            }
        }
        self.resolve_alone(&meeting, time_s);
    }

    /// One contact: Routh's method.
    fn resolve_alone(&mut self, meeting: &Meeting, time_s: f64) {
        let Meeting { pair, states, touch, impact } = meeting;
        let options = &self.world.options;
        let coefficients = self.world.coefficients(pair[0], pair[1]);
        let restitution = hopping(options.restitution, coefficients.restitution, impact.approach);
        let impulse = impact.impulse(restitution, coefficients.friction, options.impact);
        let on_b = touch.normal_ab * impulse.normal + touch.normal_ab.perpendicular() * impulse.tangent;
        let bodies = pair.map(|i| &self.world.bodies[i]);
        let after = [
            struck(bodies[0], &states[0], touch.point, -on_b),
            struck(bodies[1], &states[1], touch.point, on_b),
        ];
        self.impacts += 1;
        if let Some(log) = &mut self.log {
            log.impact(self.world, (time_s, *pair), (touch, on_b), (states, &after));
        }
        if impact.approach < PRESSING_M_S {
            self.overlook(*pair, time_s);
        }
        self.memory.changed.clear();
        for (&body, state) in pair.iter().zip(after) {
            if self.is_object(body) {
                self.memory.changed.push((body, state));
            }
        }
        self.let_go(time_s);
    }

    /// Several contacts: as springs.
    fn resolve_together(&mut self, compliance: &Compliance, time_s: f64) {
        let end = self.memory.cluster.resolve(compliance, self.world.options.restitution);
        self.impacts += self.memory.cluster.contacts.iter().filter(|c| c.impulse.normal > 0.0).count();
        if let Some(log) = &mut self.log {
            log.cluster(self.world, time_s, &self.memory.cluster);
        }
        self.memory.changed.clear();
        for k in 0..self.memory.cluster.members.len() {
            let Member { body, before, after, .. } = self.memory.cluster.members[k];
            if self.is_object(body) && after != before {
                self.memory.changed.push((body, after));
            }
        }
        self.let_go(time_s);
        if end == End::Squeezed && self.phase == Phase::Forward {
            self.end_phase(time_s);
        }
    }

    /// Finds the contacts that close together with a meeting's, and all bodies that take part.
    fn gather(&mut self, meeting: &Meeting, reach_m: f64, time_s: f64) {
        self.memory.cluster.clear();
        for (&body, state) in meeting.pair.iter().zip(&meeting.states) {
            self.memory.cluster.members.push(Member::new(body, &self.world.bodies[body], state));
        }
        let mut done = 0;
        while done < self.memory.cluster.members.len() {
            let Member { body, before, .. } = self.memory.cluster.members[done];
            if self.is_object(body) {
                self.gather_around((done, body, before), reach_m, time_s);
            }
            done += 1;
        }
        // The contact where it began comes first.
        let began = |c: &Contact| {
            (c.touch.point - meeting.touch.point).length_squared() < SAME_PLACE_M * SAME_PLACE_M
        };
        if let Some(first) = self.memory.cluster.contacts.iter().position(began) {
            self.memory.cluster.contacts.swap(0, first);
        }
    }

    /// The contacts of one member with bodies that are no members yet, or that come later among them.
    fn gather_around(&mut self, (index, one, state): (usize, usize, State), reach_m: f64, time_s: f64) {
        let world = self.world;
        let body = &world.bodies[one];
        let count = self.memory.neighbours.around(body, state.position, state.position).len();
        for k in 0..count {
            let other = self.memory.neighbours.found(k);
            if other == one || other == STRIKER && self.phase == Phase::Gone {
                continue;
            }
            let Cluster { members, contacts } = &mut self.memory.cluster;
            let mut known = members.iter().position(|m| m.body == other);
            let fixed = other == STRIKER || other > world.objects;
            if known.is_some_and(|k| k < index && !fixed) {
                continue;
            }
            let motion = &self.memory.motions[other];
            let circles_m = body.plate.outer_radius_m + world.bodies[other].plate.outer_radius_m + reach_m;
            // Where the rest of its path is out of reach the other need not be looked at.
            let half = (motion.end.position - motion.start.position) * 0.5;
            let middle = motion.start.position + half;
            let room = circles_m + half.length_squared().sqrt();
            if (middle - state.position).length_squared() > room * room {
                continue;
            }
            let there =
                known.map_or_else(|| motion.state(time_s, &world.bodies[other]), |k| members[k].before);
            if (there.position - state.position).length_squared() > circles_m * circles_m {
                continue;
            }
            contact_points((body, &state), (&world.bodies[other], &there), reach_m, |touch, gap_m| {
                let place = *known.get_or_insert_with(|| {
                    members.push(Member::new(other, &world.bodies[other], &there));
                    members.len() - 1
                });
                let bodies = ((body, &state), (&world.bodies[other], &there));
                contacts.push(Contact::new(
                    (index, place),
                    bodies,
                    (touch, gap_m),
                    world.coefficients(one, other),
                ));
            });
        }
    }
}

/// Restitution of an impact alone: bodies that press on each other at a creeping speed hop elastically, so that a push
/// is a bounded number of tiny impacts and no impact makes energy.
fn hopping(law: RestitutionLaw, measured: f64, approach_m_s: f64) -> f64 {
    law.restitution(measured, approach_m_s).max(PRESSING_M_S / approach_m_s).min(1.0)
}
