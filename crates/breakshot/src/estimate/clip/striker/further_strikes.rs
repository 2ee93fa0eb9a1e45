//! The striker after its first impact: it may catch up with the body that it has struck, hit it again, or push it.

use super::path::StrikerPath;
use crate::estimate::clip::fit::{EVENT_GAIN, MotionFit, STRIKE_GAIN, STRUCK_AGAIN_M, best_start};
use crate::estimate::clip::initial_guess::{InitialGuess, frame_s};
use crate::estimate::clip::motion_model::{Cause, Event, MotionModel};
use crate::estimate::closest_points::closest_points;

/// A body nearer to the striker than this may be hit by it again, where its motion is fitted as if it were not: a mean of those before and
/// after (m).
pub(crate) const APPROACHED_M: f64 = 0.006;
/// A body nearer than this to the striker that has approached it until it retracts may have been pushed (m).
const NEARLY_CAUGHT_M: f64 = 1.5e-3;
/// Where an impact is missing, the fitted motion is off by some millimetres: a body nearer than this has not parted from the striker (m).
const NOT_PARTED_M: f64 = 0.01;
/// A body that has not parted is hit again no earlier than this many frames after the strike: at least one position shows the motion between.
const LEAST_FRAMES_APART: f64 = 1.5;
/// A second impact is tried at most at this many frames in which the striker is still near.
const MOST_NEAR_FRAMES: usize = 5;
/// Number of positions after a strike that show its instant and the velocity, where the instant is not known otherwise.
pub(crate) const POSITIONS_AFTER_STRIKE: usize = 2;
/// Most impacts of the striker on one body; more are a push.
const MOST_STRIKES: usize = 3;

/// The striker's first impact.
#[derive(Clone, Copy)]
struct FirstStrike {
    body: usize,
    time_s: f64,
    /// The striker's distance from its start (m).
    distance_m: f64,
    /// When the striker retracts (s).
    turns_s: f64,
}

impl MotionFit {
    /// The first impact, if it is the striker's.
    fn first_strike(&self, striker: &StrikerPath) -> Option<FirstStrike> {
        let (event, time_s) =
            self.timed_events().next().filter(|(event, _)| event.cause == Cause::Striker)?;
        let body = event.members[0];
        let at_impact = self.placed(body, self.paths[body].motion_before(time_s).pose);
        let distance_m = striker.distance_to_contact_m(at_impact)?;
        Some(FirstStrike { body, time_s, distance_m, turns_s: time_s + striker.turns_after_s(distance_m) })
    }

    /// The gap between the striker and a body at a time (m), if the first impact is the striker's; 0 if they overlap.
    pub(crate) fn striker_gap_m(&self, striker: &StrikerPath, body: usize, time_s: f64) -> Option<f64> {
        let first = self.first_strike(striker)?;
        Some(self.gap_after_m(striker, first, body, time_s))
    }

    /// The same where the first impact is known.
    fn gap_after_m(&self, striker: &StrikerPath, first: FirstStrike, body: usize, time_s: f64) -> f64 {
        let outline = striker.outline_at(striker.distance_at_m(first.distance_m, time_s - first.time_s));
        let other = self.placed(body, self.paths[body].motion(time_s).pose);
        closest_points(outline, other).map_or(0.0, |c| c.gap_m)
    }

    /// The fit with further impacts of the striker on the body that it has struck, where it comes near again and the observations demand one.
    pub(crate) fn with_further_strikes(self, striker: &StrikerPath) -> Self {
        let mut fitted = self;
        for _ in 1..MOST_STRIKES {
            match fitted.with_another_strike(striker) {
                Some(better) => fitted = better,
                None => break,
            }
        }
        fitted
    }

    /// The fit with one more impact of the striker when it is nearest to the struck body again, or, where they hardly part, when it is near.
    fn with_another_strike(&self, striker: &StrikerPath) -> Option<Self> {
        let approach =
            self.approach_of_striker(striker).and_then(|at| self.with_approached_strike(striker, at));
        approach.or_else(|| {
            let mut near = self.times_near_striker(striker).into_iter();
            let demanded = |at| {
                self.with_strike_at(striker, at)
                    .filter(|(trial, strike)| self.is_improved_by(trial, *strike, EVENT_GAIN))
            };
            near.find_map(|at| {
                demanded(at).map(|(trial, _)| trial).filter(Self::shows_motion_between_strikes)
            })
        })
    }

    /// The fit with one more impact of the striker on a body to which it comes near again at about a time (s), if the observations demand one.
    /// Few positions show the motion between two impacts of a slow striker: how much each changes the velocity stays uncertain.
    fn with_approached_strike(&self, striker: &StrikerPath, at: (usize, f64)) -> Option<Self> {
        let (trial, strike) = self.with_strike_at(striker, at)?;
        let is_demanded = self.is_improved_by(&trial, strike, EVENT_GAIN)
            || trial.shows_motion_between_strikes() && self.is_explained_by(&trial, strike, STRIKE_GAIN);
        is_demanded.then_some(trial)
    }

    /// The fit with one more impact of the striker on a body at about a time (s), if they touch then; and the index of the impact with the body.
    fn with_strike_at(
        &self,
        striker: &StrikerPath,
        (body, time_s): (usize, f64),
    ) -> Option<(Self, (usize, usize))> {
        let mut events: Vec<(Event, f64)> =
            self.timed_events().map(|(event, t)| (event.clone(), t)).collect();
        let at = self.events_before(time_s);
        events.insert(at, (Event { cause: Cause::Striker, members: vec![body] }, time_s));
        let (events, times_s): (Vec<Event>, Vec<f64>) = events.into_iter().unzip();
        let model = MotionModel { events, ..self.model.clone() };
        let trial = best_start(InitialGuess::from_times(model, &times_s));
        let at_s = trial.minimum.parameters[trial.layout.events[at].time];
        let touches = trial.striker_gap_m(striker, body, at_s).is_some_and(|gap_m| gap_m < STRUCK_AGAIN_M);
        touches.then_some((trial, (at, body)))
    }

    /// Whether a position shows the motion between any two impacts of the striker; otherwise any error of a position after a strike is
    /// explained by a second one.
    fn shows_motion_between_strikes(&self) -> bool {
        let times: Vec<f64> = self.strike_times_s().collect();
        let least_s = LEAST_FRAMES_APART * frame_s(&self.model.bodies);
        times.windows(2).all(|pair| pair[1] - pair[0] > least_s)
    }

    /// The fit in which successive impacts of the striker on a body have one restitution, and the body moves as far as the striker between them,
    /// where a single position shows that motion: it shows either the instant of the first impact or the velocity.
    pub(crate) fn with_one_restitution(self, striker: &StrikerPath) -> Self {
        let parameters = &self.minimum.parameters;
        let has_few_positions = |(k, times): &(usize, [usize; 2])| {
            let [from_s, to_s] = times.map(|t| parameters[t]);
            let observations = self.model.bodies[*k].observations.iter();
            observations.filter(|o| !o.excluded && (from_s..to_s).contains(&o.time_s)).count()
                < POSITIONS_AFTER_STRIKE
        };
        if self.non_coulomb || !self.model.repeated_strikes(&self.layout).iter().any(has_few_positions) {
            return self;
        }
        let model = MotionModel { repeated_striker: Some(striker.velocity()), ..self.model.clone() };
        Self { remarks: self.remarks.clone(), ..Self::run(model, self.minimum.parameters.clone()) }
    }

    /// The times of the striker's impacts (s).
    fn strike_times_s(&self) -> impl Iterator<Item = f64> + '_ {
        self.timed_events().filter(|(event, _)| event.cause == Cause::Striker).map(|(_, t)| t)
    }

    /// The time of the striker's last impact (s).
    fn last_strike_s(&self) -> Option<f64> {
        self.strike_times_s().last()
    }

    /// The struck body, and when the striker comes nearest to it between their last impact and its retraction (s); `None` if that is not
    /// near.
    fn approach_of_striker(&self, striker: &StrikerPath) -> Option<(usize, f64)> {
        let (first, last_s) = (self.first_strike(striker)?, self.last_strike_s()?);
        let FirstStrike { body, turns_s, .. } = first;
        let gaps: Vec<(f64, f64)> = (self.model.bodies[body].observations.iter())
            .map(|observation| observation.time_s)
            .filter(|t| (last_s..turns_s).contains(t))
            .chain([turns_s])
            .map(|t| (t, self.gap_after_m(striker, first, body, t)))
            .collect();
        // First they part.
        let furthest = (0..gaps.len()).max_by(|&p, &q| gaps[p].1.total_cmp(&gaps[q].1))?;
        let nearest = gaps[furthest + 1..].iter().min_by(|p, q| p.1.total_cmp(&q.1));
        nearest.filter(|(_, gap_m)| *gap_m < APPROACHED_M).map(|(t, _)| (body, *t))
    }

    /// The struck body, and instants after the striker's last impact and before its retraction at which it is still near (s); none unless the
    /// observations demand an impact.  A corner of a body that spins comes near before the body has parted from the striker.
    fn times_near_striker(&self, striker: &StrikerPath) -> Vec<(usize, f64)> {
        let (Some(first), Some(last_s)) = (self.first_strike(striker), self.last_strike_s()) else {
            return Vec::new();
        };
        let FirstStrike { body, turns_s, .. } = first;
        let frame_s = frame_s(&self.model.bodies);
        let until_s = turns_s.min(self.next_event_s(body, last_s));
        let near: Vec<(usize, f64)> = (self.model.bodies[body].observations.iter())
            .map(|observation| observation.time_s)
            .filter(|t| (last_s + frame_s..until_s - frame_s / 2.0).contains(t))
            .take_while(|t| self.gap_after_m(striker, first, body, *t) < NOT_PARTED_M)
            .take(MOST_NEAR_FRAMES)
            .map(|t| (body, t))
            .collect();
        // The scores of all instants take longer than the gaps of a few.
        if near.is_empty() || self.demanded_jump().is_none() { Vec::new() } else { near }
    }

    /// The fit without the struck body's observations after the striker catches up with it and pushes it.
    pub(crate) fn until_pushed(self, striker: &StrikerPath) -> Self {
        // In an oblique impact the striker passes the body: the outlines would have to overlap for this long.
        const PUSH_FRAMES: f64 = 1.0;
        let (Some(first), Some(last_s)) = (self.first_strike(striker), self.last_strike_s()) else {
            return self;
        };
        let FirstStrike { body: struck, turns_s, .. } = first;
        let frame_s = frame_s(&self.model.bodies);
        let gap_m = |t: f64| self.gap_after_m(striker, first, struck, t);
        let touches = |t: f64| gap_m(t) <= 0.0;
        // A fit to the motion before and after a short push keeps the body just ahead of the striker, and deviates from both.
        let deviates = self.noise.position.squares > self.noise.position.freedom;
        let is_nearly_caught = deviates
            && turns_s > last_s + frame_s
            && gap_m(turns_s) < NEARLY_CAUGHT_M
            && gap_m(turns_s) < gap_m(turns_s - frame_s);

        // The instant at which the push begins
        let push = (self.model.bodies[struck].observations.iter())
            .map(|s| s.time_s)
            .filter(|t| *t > last_s + frame_s)
            .find(|t| touches(*t) && touches(*t + PUSH_FRAMES * frame_s));
        let nearly_caught_s = is_nearly_caught.then_some(turns_s);
        let Some(push_s) = push.map(|t| t - frame_s).or(nearly_caught_s) else { return self };
        let non_coulomb = self.non_coulomb;
        let mut model = self.model.clone();
        for observation in model.bodies[struck].observations.iter_mut().filter(|s| s.time_s > push_s) {
            observation.excluded = true;
        }

        // The impacts without the struck body after that
        let object = model.bodies[struck].object.clone();
        let mut times = Vec::new();
        let mut events = Vec::new();
        for (event, indices) in model.events.iter().zip(&self.layout.events) {
            let time_s = self.minimum.parameters[indices.time];
            let mut event = event.clone();
            if time_s > push_s {
                event.members.retain(|m| *m != struck);
                event.cause = Cause::Unknown;
            }
            if !event.members.is_empty() {
                events.push(event);
                times.push(time_s);
            }
        }
        model.events = events;
        let mut fitted = Self { non_coulomb, ..best_start(InitialGuess::from_times(model, &times)) };
        fitted.remarks.push(format!(
            "the striker catches up with `{object}` at {push_s:.3} s and pushes it: its motion after that is left out"
        ));
        fitted
    }
}
