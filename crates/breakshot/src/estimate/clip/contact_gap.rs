//! Do two bodies touch when they are fitted to hit each other?
//!
//! Positions alone date an impact between two frames that are far apart badly, and a later impact of the same bodies can be taken
//! for an earlier one with other frictions. The outlines decide: bodies that hit each other touch.

use super::fit::MotionFit;
use super::motion_model::{Cause, Event};
use crate::estimate::closest_points::{PlacedShape, closest_points};

/// Outlines that are farther apart at an impact than this (m) do not touch: rulers and cameras are more accurate.
pub(crate) const MAX_GAP_M: f64 = 0.003;
/// A nearer approach has to be nearer by this factor.
const NEARER: f64 = 0.5;

impl MotionFit {
    /// The gap between the outlines of two bodies at a time (m); 0 if they overlap.
    fn gap_m(&self, [a, b]: [usize; 2], time_s: f64) -> f64 {
        let placed = |k: usize| PlacedShape {
            shape: &self.model.bodies[k].shape,
            pose: self.paths[k].motion_before(time_s).pose,
        };
        closest_points(placed(a), placed(b)).map_or(0.0, |closest| closest.gap_m)
    }

    /// The observation's time at which two bodies approach each other most, while no other impact of theirs comes between it and
    /// `time_s` (s); `None` if they touch at `time_s`, or come no nearer.
    pub(super) fn nearer_approach_s(&self, event: &Event, time_s: f64) -> Option<f64> {
        let &[a, b] = &event.members[..] else { return None };
        let gap_m = self.gap_m([a, b], time_s);
        if event.cause != Cause::Contact || gap_m < MAX_GAP_M {
            return None;
        }
        let times = self
            .model
            .events
            .iter()
            .zip(&self.layout.events)
            .filter(|(other, _)| other.members.contains(&a) || other.members.contains(&b));
        let times: Vec<f64> = times.map(|(_, indices)| self.minimum.parameters[indices.time]).collect();
        let after_s = times.iter().copied().filter(|&t| t < time_s).fold(f64::NEG_INFINITY, f64::max);
        let before_s = times.iter().copied().filter(|&t| t > time_s).fold(f64::INFINITY, f64::min);
        let stop_s = self.paths[a].stop_s().max(self.paths[b].stop_s()).min(before_s);
        let observed = self.model.bodies[b].observations.iter().map(|o| o.time_s);
        let gaps = observed.filter(|t| (after_s..stop_s).contains(t)).map(|t| (self.gap_m([a, b], t), t));
        // Of equal gaps the first: bodies that touch may stay together.
        let nearest = gaps.min_by(|p, q| p.0.total_cmp(&q.0))?;
        (nearest.0 < NEARER * gap_m).then_some(nearest.1)
    }

    /// Two bodies that are fitted to hit each other, again, with their outlines apart: their indices, the time (s) and the gap (m).
    pub(super) fn hit_without_contact(&self) -> Option<([usize; 2], f64, f64)> {
        let later = self.model.events.iter().zip(&self.layout.events).filter_map(|(event, indices)| {
            let &[a, b] = &event.members[..] else { return None };
            let time_s = self.minimum.parameters[indices.time];
            let both_move = [a, b].iter().all(|&k| self.paths[k].onset_s() < time_s);
            (event.cause == Cause::Contact && both_move).then_some(([a, b], time_s))
        });
        later
            .map(|(pair, time_s)| (pair, time_s, self.gap_m(pair, time_s)))
            .find(|&(.., gap_m)| gap_m > MAX_GAP_M)
    }
}
