//! What happens, event by event, until everything is at rest?
//!
//! The loop takes the earliest prediction; a contact is resolved, a lower bound is refined.  Bodies with new states are
//! released and their next contacts predicted.  Between two events nothing is integrated: every motion has a closed form.

pub(crate) mod body_events;
pub(crate) mod event_queue;
pub(crate) mod impact_events;
#[cfg(test)]
mod reversal_tests;
pub(crate) mod rollout;
pub(crate) mod striker;

use crate::geometry::Pose;
use crate::physics::output::outcome::Outcome;
use crate::physics::output::recorder::SingleBodyEvent;
use crate::physics::output::trajectory::EventKind;
use crate::physics::sliding::body::STRIKER;
use crate::physics::sliding::motion::{Motion, SpeedLaw};
use body_events::{BodyEvent, ScheduledEvent};
use rollout::Rollout;
use striker::Phase;

/// Bound of the number of steps: a rollout takes a few hundred, a pile pushed across the table some ten thousand.
const MOST_STEPS: usize = 2_000_000;
/// Bound of the number of impacts: the longest pushes of piles in the lab have some thousands.
const MOST_IMPACTS: usize = 100_000;

impl Rollout<'_> {
    /// Runs the strike until everything is at rest.
    pub(crate) fn outcome(mut self) -> Outcome {
        let (mut steps, mut complete) = (0, true);
        self.predict_contacts(STRIKER, 0.0);
        loop {
            // The next event that is certain: the end of the striker's phase, or an event of a single body
            let phase_end_s = match self.phase {
                Phase::Forward | Phase::Retract => self.memory.motions[STRIKER].stop_s,
                Phase::Stopped | Phase::Lifted => f64::INFINITY,
            };
            let scheduled = self.next_scheduled();
            let certain_s = phase_end_s.min(scheduled.map_or(f64::INFINITY, |event| event.time_s));

            // A contact at the same instant as the end of a phase is later than it.
            steps += 1;
            let Some((prediction, next_s)) = self.memory.queue.pop(certain_s.next_down()) else {
                if steps > MOST_STEPS && certain_s < f64::INFINITY {
                    complete = false;
                    self.freeze(certain_s);
                    break;
                }
                match scheduled {
                    Some(event) if event.time_s <= phase_end_s => self.process(&event),
                    _ if phase_end_s < f64::INFINITY => self.end_phase(phase_end_s),
                    _ => break,
                }
                continue;
            };

            // The earliest prediction
            let time_s = prediction.time_s;
            if steps > MOST_STEPS || self.impacts > MOST_IMPACTS {
                complete = false;
                self.freeze(time_s);
                break;
            }
            let pair = prediction.bodies.map(|i| i as usize);
            if !prediction.is_contact {
                self.refine(pair, &prediction, next_s.min(certain_s));
            } else if pair[1] >= self.world.areas {
                self.enter_area(pair, time_s);
            } else {
                self.resolve_contact(pair, time_s);
            }
        }
        let motions = &self.memory.motions;
        Outcome {
            poses: self.world.body_of.iter().map(|&b| motions[b].end).collect(),
            duration_s: motions.iter().map(|m| m.stop_s).fold(0.0, f64::max),
            impacts: self.impacts,
            striker_work_j: self.striker_work_j,
            fallen: self.world.body_of.iter().map(|&b| self.memory.fallen[b]).collect(),
            complete,
        }
    }

    /// Stops every body at its present pose.
    fn freeze(&mut self, time_s: f64) {
        for body in 0..self.memory.motions.len() {
            let state = self.memory.motions[body].state(time_s, &self.world.bodies[body]);
            let pose = Pose { position: state.position, yaw_rad: state.yaw_rad };
            self.set_motion(body, Motion::rest(pose, time_s));
        }
    }

    /// The earliest scheduled event of a single body.
    fn next_scheduled(&self) -> Option<ScheduledEvent> {
        if self.world.edge.is_empty() && !self.world.has_curved_paths {
            return None;
        }
        let all = self.memory.scheduled.iter().flatten();
        all.min_by(|a, b| a.time_s.total_cmp(&b.time_s)).copied()
    }

    /// Processes a scheduled event: the body falls, or the next piece of its curved path begins.
    fn process(&mut self, event: &ScheduledEvent) {
        let &ScheduledEvent { time_s, body, event } = event;
        let mut state = self.memory.motions[body].state(time_s, &self.world.bodies[body]);
        self.memory.scheduled[body] = None;
        if event == BodyEvent::NextPiece {
            if let SpeedLaw::Piece { next_velocity } = self.memory.motions[body].law {
                state.velocity = next_velocity;
            }
            self.memory.changed.clear();
            self.memory.changed.push((body, state));
            self.release(time_s);
            return;
        }
        if let Some(recorder) = &mut self.recorder {
            let fallen = SingleBodyEvent { time_s, kind: EventKind::Fallen, bodies: &[body], state: &state };
            recorder.body_event(self.world, &fallen);
        }
        self.memory.fallen[body] = true;
        let pose = Pose { position: state.position, yaw_rad: state.yaw_rad };
        self.set_motion(body, Motion::rest(pose, time_s));
    }

    /// Records that a body enters a keep-out area, which changes nothing.
    fn enter_area(&mut self, pair: [usize; 2], time_s: f64) {
        self.memory.entered.push(pair);
        let state = self.memory.motions[pair[0]].state(time_s, &self.world.bodies[pair[0]]);
        if let Some(recorder) = &mut self.recorder {
            let entered = SingleBodyEvent { time_s, kind: EventKind::Entered, bodies: &pair, state: &state };
            recorder.body_event(self.world, &entered);
        }
    }
}
