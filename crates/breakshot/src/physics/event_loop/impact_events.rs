//! Two bodies touch: alone by Routh's method, or together with the contacts that close at the same time.

use crate::physics::Touching;
use crate::physics::contact::broadphase::Circle;
use crate::physics::contact::{CONTACT_GAP_M, PRESSING_M_S, PRESSING_S, contact_points};
use crate::physics::event_loop::striker::Phase;
use crate::physics::event_loop::{Memory, Rollout};
use crate::physics::impact::compliant::End;
use crate::physics::impact::island::{Cluster, Compliance, Contact, Member};
use crate::physics::impact::moreau::hopping;
use crate::physics::impact::routh::{Impact, Touch, struck};
use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::{State, length};
use crate::physics::world::STRIKER;

/// Approach speeds below it are rounding (m/s); what presses gains more in the time for which it is overlooked.
const CREEPING_M_S: f64 = 1e-6;
/// Slower impacts (m/s) are those of bodies that lean on each other.
const TOGETHER_M_S: f64 = 1e-2;
/// Points this close touch (m): what the search stops at, and rounding.
const TOUCHING_M: f64 = 2.0 * CONTACT_GAP_M;
/// Bodies that press on each other may sink in this much before they are set apart again (m).
const SUNK_M: f64 = 3e-7;
/// Bodies that stay sunk in by this much (m) have no room left.
const NO_ROOM_M: f64 = 1e-6;
/// Bodies this close lean on each other (m).
const LEANING_M: f64 = 2e-6;

/// Two bodies as they touch.
struct Meeting {
    pair: [usize; 2],
    states: [State; 2],
    touch: Touch,
    gap_m: f64,
    impact: Impact,
}

impl Rollout<'_> {
    /// Resolves a contact.
    pub(super) fn touch(&mut self, a: usize, b: usize, time_s: f64) {
        let pair = [a, b];
        if b >= self.world.areas {
            self.enter(pair, time_s);
            return;
        }
        let states = pair.map(|i| self.memory.motions[i].state(time_s, &self.world.bodies[i]));
        self.find_points(pair, &states);
        let Some(meeting) = self.fastest_contact(pair, states) else {
            self.look_again(pair, time_s, pressing_time_s(pair.map(|i| &self.world.bodies[i]), &states));
            return;
        };
        let approach = meeting.impact.approach;
        match self.world.options.touching {
            _ if approach < TOGETHER_M_S => {
                self.gather(&meeting, LEANING_M, time_s);
                if self.memory.cluster.contacts.len() > 1 && self.press_together(pair, time_s) {
                    return;
                }
            }
            Touching::Compliant(compliance) => {
                self.gather(&meeting, LEANING_M.max(approach * compliance.contact_time_s), time_s);
                if self.memory.cluster.contacts.len() > 1
                    && self.spring_together(&compliance, &meeting, time_s)
                {
                    return;
                }
            }
            Touching::Pairwise => {}
        }
        self.resolve_alone(&meeting, time_s);
    }

    /// Notes all points at which two bodies touch or could touch during a contact.
    fn find_points(&mut self, pair: [usize; 2], states: &[State; 2]) {
        let contact_time_s = match self.world.options.touching {
            Touching::Compliant(compliance) => compliance.contact_time_s,
            Touching::Pairwise => 0.0,
        };
        let [a, b] = [0, 1].map(|k| (&self.world.bodies[pair[k]], &states[k]));
        let closing = [a, b].map(|(body, state)| {
            length(state.velocity) + state.yaw_rate_rad_s.abs() * body.plate.outer_radius_m
        });
        let reach_m = LEANING_M.max(contact_time_s * (closing[0] + closing[1]));
        let points = &mut self.memory.points;
        points.clear();
        contact_points(a, b, reach_m, |touch, gap_m| points.push((touch, gap_m)));
    }

    /// Of all points at which two bodies touch, the one that closes fastest; none if all part.
    fn fastest_contact(&self, pair: [usize; 2], states: [State; 2]) -> Option<Meeting> {
        let [a, b] = [0, 1].map(|k| (&self.world.bodies[pair[k]], &states[k]));
        let mut fastest: Option<Meeting> = None;
        for &(touch, gap_m) in self.memory.points.iter().filter(|p| p.1 <= TOUCHING_M) {
            let impact = Impact::new(a, b, &touch);
            if impact.approach > fastest.as_ref().map_or(CREEPING_M_S, |f| f.impact.approach) {
                fastest = Some(Meeting { pair, states, touch, gap_m, impact });
            }
        }
        fastest
    }

    /// One contact: Routh's method.
    fn resolve_alone(&mut self, meeting: &Meeting, time_s: f64) {
        let Meeting { pair, states, touch, gap_m, impact } = meeting;
        let options = &self.world.options;
        let coefficients = self.world.coefficients(pair[0], pair[1]);
        let measured = options.restitution.restitution(coefficients.restitution, impact.approach);
        let restitution = hopping(measured, impact.approach);
        let impulse = impact.impulse(restitution, coefficients.friction, options.impact);
        let on_b = touch.normal_ab * impulse.normal + touch.normal_ab.perpendicular() * impulse.tangent;
        let bodies = pair.map(|i| &self.world.bodies[i]);
        let mut after = [
            struck(bodies[0], &states[0], touch.point, -on_b),
            struck(bodies[1], &states[1], touch.point, on_b),
        ];
        if *gap_m < -SUNK_M {
            // What sank in while it pressed is set apart again.
            let share = -gap_m / (bodies[0].inverse_mass + bodies[1].inverse_mass);
            after[0].position = after[0].position - touch.normal_ab * (share * bodies[0].inverse_mass);
            after[1].position += touch.normal_ab * (share * bodies[1].inverse_mass);
        }
        self.impacts += 1;
        if let Some(log) = &mut self.log {
            log.impact(self.world, (time_s, *pair), (touch, on_b), (states, &after));
        }
        if impact.approach < PRESSING_M_S {
            self.overlook(*pair, time_s, pressing_time_s(bodies, &after));
        }
        self.memory.changed.clear();
        for (&body, state) in pair.iter().zip(after) {
            if self.is_object(body) {
                self.memory.changed.push((body, state));
            }
        }
        self.let_go(time_s);
    }

    /// Several contacts that close fast: as springs.  Whether that moved the pair where it began.
    fn spring_together(&mut self, compliance: &Compliance, meeting: &Meeting, time_s: f64) -> bool {
        let end = self.memory.cluster.resolve(&meeting.impact, compliance, self.world.options.restitution);
        if end == End::Squeezed {
            // The arm gives up; the same contact comes again without its push.
            let blocked = self.block(time_s);
            if blocked {
                self.look(meeting.pair, time_s);
            }
            return blocked;
        }
        self.part(meeting.pair, time_s)
    }

    /// Several contacts that close slowly: bodies lean on each other, and are left alone for a while.  Whether that moved
    /// the pair where it began.
    fn press_together(&mut self, pair: [usize; 2], time_s: f64) -> bool {
        self.memory.cluster.press(self.world.options.restitution);
        let members = &self.memory.cluster.members;
        let bend: f64 =
            members.iter().map(|m| greatest_bend(&self.world.bodies[m.body], &m.after)).fold(0.0, f64::max);
        let while_s = PRESSING_S.min((SUNK_M / bend).sqrt());
        for k in 0..self.memory.cluster.contacts.len() {
            let [a, b] = self.memory.cluster.contacts[k].members.map(|i| self.memory.cluster.members[i].body);
            self.overlook([a.min(b), a.max(b)], time_s, while_s);
        }
        self.part(pair, time_s)
    }

    /// The members of a cluster go their ways; whether one of a pair does.
    fn part(&mut self, pair: [usize; 2], time_s: f64) -> bool {
        let no_room = self.memory.cluster.set_apart(SUNK_M) > NO_ROOM_M;
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
        let moved = self.memory.changed.iter().any(|c| pair.contains(&c.0));
        if moved {
            self.let_go(time_s);
        }
        if no_room {
            self.block(time_s);
        }
        moved
    }

    /// A striker that squeezes objects against something fixed stops; whether it did.
    fn block(&mut self, time_s: f64) -> bool {
        let striker = self.memory.cluster.members.iter().any(|m| m.body == STRIKER);
        let blocked = striker && matches!(self.phase, Phase::Forward | Phase::Back);
        if blocked {
            self.end_phase(time_s);
        }
        blocked
    }

    /// Finds the contacts that close together with a meeting's, which comes first, and all bodies that take part.
    fn gather(&mut self, meeting: &Meeting, reach_m: f64, time_s: f64) {
        self.memory.cluster.clear();
        for (&body, state) in meeting.pair.iter().zip(&meeting.states) {
            self.memory.cluster.members.push(Member::new(body, &self.world.bodies[body], state));
        }
        self.gather_pair(meeting, reach_m);
        let mut done = 0;
        while done < self.memory.cluster.members.len() {
            let Member { body, before, .. } = self.memory.cluster.members[done];
            if self.is_object(body) {
                self.gather_around((done, body, before), reach_m, time_s);
            }
            done += 1;
        }
    }

    /// The contacts of the two bodies that meet, the fastest first.
    fn gather_pair(&mut self, meeting: &Meeting, reach_m: f64) {
        let Meeting { pair, states, touch, .. } = meeting;
        let bodies = pair.map(|i| &self.world.bodies[i]);
        let coefficients = self.world.coefficients(pair[0], pair[1]);
        let contacts = &mut self.memory.cluster.contacts;
        for &(point, gap_m) in self.memory.points.iter().filter(|p| p.1 <= reach_m) {
            let both = ((bodies[0], &states[0]), (bodies[1], &states[1]));
            contacts.push(Contact::new((0, 1), both, (point, gap_m), coefficients));
            if point == *touch {
                let last = contacts.len() - 1;
                contacts.swap(0, last);
            }
        }
    }

    /// The contacts of one member with bodies that are no members yet, or that come later among them.
    fn gather_around(&mut self, (index, one, state): (usize, usize, State), reach_m: f64, time_s: f64) {
        self.find_near((one, &state), reach_m);
        let world = self.world;
        let body = &world.bodies[one];
        let Memory { cluster, near, motions, .. } = &mut *self.memory;
        let Cluster { members, contacts, .. } = cluster;
        for &other in near.iter() {
            let mut known = members.iter().position(|m| m.body == other);
            let fixed = other == STRIKER || other > world.objects;
            // Each pair once; that of the two that meet is known.
            if known.is_some_and(|k| k < index && !fixed || k + index == 1) {
                continue;
            }
            let there = known
                .map_or_else(|| motions[other].state(time_s, &world.bodies[other]), |k| members[k].before);
            let circles_m = body.plate.outer_radius_m + world.bodies[other].plate.outer_radius_m + reach_m;
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

    /// Finds all bodies whose way comes within reach of where one is now, in order.
    fn find_near(&mut self, (one, state): (usize, &State), reach_m: f64) {
        let radius_m = self.world.bodies[one].plate.outer_radius_m + reach_m;
        self.memory.near.clear();
        for k in 0..self.memory.neighbours.around(Circle { centre: state.position, radius_m }) {
            let other = self.memory.neighbours.found(k);
            if other != one && other < self.world.areas && !self.is_gone(other) {
                self.memory.near.push(other);
            }
        }
    }
}

/// For how long two bodies that press on each other can be left alone: friction and spin make them sink in by less than
/// [`SUNK_M`].
fn pressing_time_s(bodies: [&Body; 2], states: &[State; 2]) -> f64 {
    let bend: f64 = bodies.iter().zip(states).map(|(body, state)| greatest_bend(body, state)).sum();
    PRESSING_S.min((2.0 * SUNK_M / bend).sqrt())
}

/// How fast friction and spin can bend the way of a body's rim, at most (m/s2).
fn greatest_bend(body: &Body, state: &State) -> f64 {
    if body.is_fixed() {
        return 0.0;
    }
    let rate = state.yaw_rate_rad_s;
    body.grip_m_s2 + (body.spin_deceleration_rad_s2() + rate * rate) * body.plate.outer_radius_m
}
