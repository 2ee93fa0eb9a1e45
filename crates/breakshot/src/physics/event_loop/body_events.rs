//! What happens to a body by itself?
//!
//! Its centre passes the table's edge, and it falls; a stretch of its bent way ends, and it goes on; or it enters an area to keep out of, which is reported and stops nothing.

use crate::geometry::{Point, Pose, Vec2};
use crate::physics::event_loop::Rollout;
use crate::physics::output::trajectory::EventKind;
use crate::physics::sliding::motion::{Law, Motion};

/// Something that will happen to a body by itself, unless it is hit before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Appointment {
    /// When (s).
    pub(crate) time_s: f64,
    /// The body.
    pub(crate) body: usize,
    /// Whether it falls; else it goes on.
    falls: bool,
}

impl Rollout<'_> {
    /// What will happen next to any body by itself.
    pub(super) fn next_appointment(&self) -> Option<Appointment> {
        if self.world.edge.is_empty() && !self.world.bends {
            return None;
        }
        let all = self.memory.appointments.iter().flatten();
        all.min_by(|a, b| a.time_s.total_cmp(&b.time_s)).copied()
    }

    /// Finds out what will happen to a body on a new way.
    pub(super) fn appoint(&mut self, body: usize, motion: &Motion) {
        if self.world.edge.is_empty() && !self.world.bends
            || !self.is_object(body)
            || self.memory.fallen[body]
        {
            return;
        }
        let way_m = (motion.end.position - motion.start.position).length();
        let fall = way_to_edge_m(&self.world.edge, motion.start.position, motion.direction)
            .filter(|&m| m <= way_m)
            .and_then(|m| motion.time_of_way_s(m, motion.start_s, &self.world.bodies[body]));
        let onward = motion.is_bent().then_some(Appointment { time_s: motion.stop_s, body, falls: false });
        self.memory.appointments[body] =
            fall.map(|time_s| Appointment { time_s, body, falls: true }).or(onward);
    }

    /// An appointment's time has come: the body falls or goes on.
    pub(super) fn keep(&mut self, appointment: &Appointment) {
        let &Appointment { time_s, body, falls } = appointment;
        let mut state = self.memory.motions[body].state(time_s, &self.world.bodies[body]);
        self.memory.appointments[body] = None;
        if !falls {
            if let Law::Bent { onward } = self.memory.motions[body].law {
                state.velocity = onward;
            }
            self.memory.changed.clear();
            self.memory.changed.push((body, state));
            self.let_go(time_s);
            return;
        }
        if let Some(log) = &mut self.log {
            log.note(self.world, time_s, (EventKind::Fallen, &[body]), &state);
        }
        self.memory.fallen[body] = true;
        self.set(body, Motion::rest(Pose { position: state.position, yaw_rad: state.yaw_rad }, time_s));
    }

    /// A body enters an area.
    pub(super) fn enter(&mut self, pair: [usize; 2], time_s: f64) {
        self.memory.entered.push(pair);
        let state = self.memory.motions[pair[0]].state(time_s, &self.world.bodies[pair[0]]);
        if let Some(log) = &mut self.log {
            log.note(self.world, time_s, (EventKind::Entered, &pair), &state);
        }
    }
}

/// How far it is along a unit vector to where it leaves a counter-clockwise outline (m).
fn way_to_edge_m(outline: &[Point], from: Point, along: Vec2) -> Option<f64> {
    let mut nearest: Option<f64> = None;
    for (k, &corner) in outline.iter().enumerate() {
        let side = outline[(k + 1) % outline.len()] - corner;
        let (outwards, there) = (along.cross(side), corner - from);
        let (way_m, part) = (there.cross(side) / outwards, there.cross(along) / outwards);
        if outwards > 0.0 && way_m >= 0.0 && (0.0..=1.0).contains(&part) && nearest.is_none_or(|n| way_m < n)
        {
            nearest = Some(way_m);
        }
    }
    nearest
}
