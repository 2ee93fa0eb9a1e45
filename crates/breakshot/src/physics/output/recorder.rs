//! Which events, motions and energies of a rollout are recorded?

use crate::geometry::Vec2;
use crate::physics::impact::island::Island;
use crate::physics::impact::routh::ContactPoint;
use crate::physics::output::near_miss::{PairMargin, smallest_gap};
use crate::physics::output::outcome::Outcome;
use crate::physics::output::segments::segments;
use crate::physics::output::thinning::Thinned;
use crate::physics::output::trajectory::{Energy, Event, EventKind, Trajectory};
use crate::physics::sliding::body::{Body, STRIKER};
use crate::physics::sliding::motion::{Motion, State};
use crate::physics::world::World;
use std::collections::BTreeMap;

/// Largest number of segments of a trajectory: about twenty megabytes as JSON.
const MOST_SEGMENTS: usize = 40_000;
/// Largest number of events of a trajectory: about ten megabytes as JSON.
const MOST_EVENTS: usize = 10_000;

/// Two bodies at an impact, with their states before and after it.
pub(crate) struct ImpactRecord<'a> {
    pub(crate) time_s: f64,
    pub(crate) bodies: [usize; 2],
    pub(crate) contact_point: &'a ContactPoint,
    /// Impulse on the second body (N s).
    pub(crate) impulse: Vec2,
    pub(crate) before: &'a [State; 2],
    pub(crate) after: &'a [State; 2],
}

impl ImpactRecord<'_> {
    /// Work of the striker on the other body (J); zero for two objects.
    pub(crate) fn striker_work_j(&self) -> f64 {
        striker_work_j(self.bodies, self.before.map(|state| state.velocity), self.impulse)
    }
}

/// Work of a striker of prescribed velocity in an impact of two bodies with these velocities before it (J), from the impulse on the second one.
pub(crate) fn striker_work_j(bodies: [usize; 2], before: [Vec2; 2], impulse: Vec2) -> f64 {
    match bodies {
        [STRIKER, _] => impulse.dot(before[0]),
        [_, STRIKER] => -impulse.dot(before[1]),
        _ => 0.0,
    }
}

/// An event of one body that is no impact.
pub(crate) struct SingleBodyEvent<'a> {
    pub(crate) time_s: f64,
    pub(crate) kind: EventKind,
    /// The body, and the keep-out area that it enters.
    pub(crate) bodies: &'a [usize],
    pub(crate) state: &'a State,
}

/// Records a rollout while it runs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recorder {
    /// All motions of each body, in the order of time.
    motions: Vec<Vec<Motion>>,
    events: Vec<Event>,
    energy: Energy,
    /// The hit of smallest overlap so far.
    smallest_hit: Option<PairMargin>,
}

impl Recorder {
    /// Starts with the first motion of each body.
    pub(crate) fn start(&mut self, motions: &[Motion]) {
        self.motions = motions.iter().map(|m| vec![*m]).collect();
    }

    /// Records the next motion of a body.
    pub(crate) fn motion(&mut self, body: usize, motion: &Motion) {
        self.motions[body].push(*motion);
    }

    /// Records an impact of two bodies alone.
    pub(crate) fn impact(&mut self, world: &World, impact: &ImpactRecord) {
        let mut loss_j = impact.striker_work_j();
        for (&index, (before, after)) in impact.bodies.iter().zip(impact.before.iter().zip(impact.after)) {
            if index != STRIKER {
                let body = &world.bodies[index];
                loss_j += kinetic_energy_j(body, before) - kinetic_energy_j(body, after);
            }
        }
        self.push_impact(world, impact, loss_j);
    }

    fn push_impact(&mut self, world: &World, impact: &ImpactRecord, loss_j: f64) {
        self.energy.impact_loss_j += loss_j;
        let &ImpactRecord { time_s, bodies, before, .. } = impact;
        self.smallest_hit =
            PairMargin::smaller(self.smallest_hit, PairMargin::of_hit(world, time_s, bodies, before));
        self.events.push(event(world, impact, loss_j));
    }

    /// Records that the first body fell off the table, or that it entered the second one, a keep-out area.
    pub(crate) fn body_event(&mut self, world: &World, body_event: &SingleBodyEvent) {
        let &SingleBodyEvent { time_s, kind, bodies, state } = body_event;
        if kind == EventKind::Fallen {
            self.energy.fallen_j += kinetic_energy_j(&world.bodies[bodies[0]], state);
        }
        self.events.push(Event {
            time_s,
            kind,
            bodies: bodies.iter().map(|&b| world.name(b)).collect(),
            point_m: state.position,
            normal: Vec2::ZERO,
            impulse_n_s: Vec2::ZERO,
            velocities_before_m_s: vec![state.velocity],
            velocities_after_m_s: vec![state.velocity],
            yaw_rates_before_rad_s: vec![state.yaw_rate_rad_s],
            yaw_rates_after_rad_s: vec![state.yaw_rate_rad_s],
            loss_j: 0.0,
        });
    }

    /// Records each contact of an island as an impact, with the velocities before and after all of them.
    pub(crate) fn island(&mut self, world: &World, time_s: f64, island: &Island) {
        for contact in island.contacts.iter().filter(|contact| contact.impulse.normal > 0.0) {
            let members = contact.members.map(|i| &island.members[i]);
            let (before, after) = (members.map(|m| m.before), members.map(|m| m.after));
            let impact = ImpactRecord {
                time_s,
                bodies: members.map(|m| m.body),
                contact_point: &contact.point,
                impulse: contact.impulse_on_b(),
                before: &before,
                after: &after,
            };
            self.push_impact(world, &impact, contact.loss_j);
        }
    }

    /// The trajectory of the recorded rollout.
    pub(crate) fn trajectory(mut self, world: &World, outcome: &Outcome) -> Trajectory {
        let closest = PairMargin::smaller(self.smallest_hit, smallest_gap(world, &self.motions, outcome));
        let mut motions = BTreeMap::new();
        let mut deviation_m = 0.0f64;
        for body in 0..=world.objects {
            let list = &self.motions[body];
            let mut written = Thinned::new(MOST_SEGMENTS / (world.objects + 1));
            for (k, motion) in list.iter().enumerate() {
                let until_s = list.get(k + 1).map_or(f64::INFINITY, |next| next.start_s);
                let end_s = until_s.min(outcome.duration_s.max(motion.start_s));
                written.extend(segments(motion, end_s, &world.bodies[body]));
                let state = motion.state(until_s.min(motion.stop_s), &world.bodies[body]);
                let start = motion.state(motion.start_s, &world.bodies[body]);
                if body != STRIKER {
                    let tilt_work_j = tilt_work_j(&world.bodies[body], state.position - start.position);
                    self.energy.tilt_work_j += tilt_work_j;
                    self.energy.friction_loss_j += tilt_work_j
                        + kinetic_energy_j(&world.bodies[body], &start)
                        - kinetic_energy_j(&world.bodies[body], &state);
                }
            }
            deviation_m = deviation_m.max(written.deviation_m);
            motions.insert(world.name(body), written.segments);
        }
        let mut notes = world.notes.clone();
        for (name, _) in world.names.iter().zip(&outcome.fallen).filter(|(_, fallen)| **fallen) {
            notes.push(format!("`{name}` fell off the table"));
        }
        if !outcome.complete {
            notes.push(format!(
                "given up after {:.3} s, after {} impacts: the poses are those at that time; a shorter travel, a faster strike or less \
                 friction needs fewer",
                outcome.duration_s, outcome.impacts
            ));
        }
        if deviation_m > 0.0 {
            notes.push(format!(
                "the motion has too many segments: at most {MOST_SEGMENTS} are written, within {:.3} mm of it",
                deviation_m * 1e3
            ));
        }
        let left_out = keep_strongest(&mut self.events);
        if left_out > 0 {
            notes.push(format!(
                "the {left_out} weakest of the events are left out; the energies contain them"
            ));
        }
        Trajectory {
            version: 1,
            final_poses: world.by_name(&outcome.poses),
            duration_s: outcome.duration_s,
            events: self.events,
            energy: Energy { striker_work_j: outcome.striker_work_j, ..self.energy },
            motions,
            closest_near_miss: closest.map(|c| c.named(world)),
            notes,
            complete: outcome.complete,
            assumed: world.assumed.to_vec(),
        }
    }
}

/// Leaves the [`MOST_EVENTS`] events of the strongest impulses, and how many are left out. What is not an impact stays.
fn keep_strongest(events: &mut Vec<Event>) -> usize {
    let left_out = events.len().saturating_sub(MOST_EVENTS);
    if left_out > 0 {
        let strength = |event: &Event| match event.kind {
            EventKind::Impact => event.impulse_n_s.length(),
            EventKind::Fallen | EventKind::Entered => f64::INFINITY,
        };
        let mut order: Vec<usize> = (0..events.len()).collect();
        order.sort_by(|&i, &j| strength(&events[j]).total_cmp(&strength(&events[i])));
        order.truncate(MOST_EVENTS);
        order.sort_unstable();
        *events = order.into_iter().map(|k| events[k].clone()).collect();
    }
    left_out
}

fn event(world: &World, impact: &ImpactRecord, loss_j: f64) -> Event {
    Event {
        time_s: impact.time_s,
        kind: EventKind::Impact,
        bodies: impact.bodies.iter().map(|&b| world.name(b)).collect(),
        point_m: impact.contact_point.point,
        normal: impact.contact_point.normal_ab,
        impulse_n_s: impact.impulse,
        velocities_before_m_s: impact.before.iter().map(|s| s.velocity).collect(),
        velocities_after_m_s: impact.after.iter().map(|s| s.velocity).collect(),
        yaw_rates_before_rad_s: impact.before.iter().map(|s| s.yaw_rate_rad_s).collect(),
        yaw_rates_after_rad_s: impact.after.iter().map(|s| s.yaw_rate_rad_s).collect(),
        loss_j,
    }
}

/// Work of gravity along the table on a body (J); zero on a level table, and for a fixed body.
fn tilt_work_j(body: &Body, way: Vec2) -> f64 {
    if body.is_fixed() { 0.0 } else { body.tilt_m_s2.dot(way) / body.inverse_mass }
}

/// Kinetic energy of a body (J); zero for a fixed one.
fn kinetic_energy_j(body: &Body, state: &State) -> f64 {
    if body.is_fixed() {
        return 0.0;
    }
    0.5 * (state.velocity.length_squared() / body.inverse_mass
        + state.yaw_rate_rad_s * state.yaw_rate_rad_s / body.inverse_inertia)
}
