//! Is the ending of a run true, and did the arm stop in time?

use super::super::simulated::mock::mishap::{Injection, Mishap};
use super::super::simulated::mock::simulated_arm::Played;
use super::super::simulated::{COMMAND, Interrupt, Run};
use crate::motion::{Motion, Motions, largest_difference};
use crate::progress::OFF_PATH_RAD;
use crate::{Ending, Fault};
use std::time::Duration;
use tokio::time::Instant;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Outcome {
    Struck,
    Stopped,
    /// Refused, or the robot could not be reached: nothing moved after that.
    Refused,
}

/// What is known of a run.
pub(super) struct Verdict {
    pub(super) outcome: Outcome,
    /// How long the arm moved after the mishap, until it began to brake (s): of the runs that were stopped.
    pub(super) moved_s: f64,
    /// Whether no stop took effect, or each was held up: the arm was beyond the driver's reach.
    pub(super) unreachable: bool,
    /// What the run got wrong.
    pub(super) wrong: Option<String>,
}

/// Largest time for which the arm moves after something is amiss, before it brakes; and until a stop is sent (s).
const LONGEST_S: f64 = 0.2;
/// Largest difference of a joint from where a motion was to end (rad).
const SAME_RAD: f64 = 0.01;
/// Largest motion of an arm that is said to rest (rad): twice the noise that the driver allows for.
const REST_RAD: f64 = 2e-3;
/// The requests that stop the arm.
const STOPS: [&str; 2] = ["StopMotion request", "cancel_action_goal request"];
/// A time that is clocks' rounding (s).
const ROUNDING_S: f64 = 2e-3;

impl Verdict {
    pub(super) fn of(run: &Run, injection: Option<&Injection>, interrupt: Interrupt) -> Self {
        // A trajectory of two rows is a stop: the arm braking onto its path.
        let motions: Vec<&Played> = run.played.iter().filter(|played| played.rows() > 2).collect();
        let goal = |kind: &str| kind == "send_action_goal request" || kind == "MoveJointTraj request";
        let amiss = match interrupt {
            Some((count, after)) => motions.get(count - 1).map(|played| played.begun + after),
            // A motion that arrives wrong is amiss where it leaves the path.
            None if injection.is_some_and(|injection| goal(&injection.kind)) => {
                departure(&motions, run.ended)
            }
            // Wrong joint angles are amiss where they are not on the path.
            None if !run.misreported.is_empty() => {
                run.misreported.iter().find(|(_, off_rad)| *off_rad > OFF_PATH_RAD).map(|(at, _)| *at)
            }
            None => run.happened,
        };
        let (outcome, fault) = match &run.ending {
            Ok(Ending::Struck { .. }) => (Outcome::Struck, None),
            Ok(Ending::Stopped { fault, .. }) => (Outcome::Stopped, Some(fault)),
            _ => (Outcome::Refused, None),
        };
        let moved_s = match (outcome, amiss) {
            (Outcome::Stopped, Some(amiss)) => {
                motions.iter().map(|played| moved_s(played, amiss, run.ended)).sum()
            }
            _ => 0.0,
        };
        let unreachable = moved_s > 0.0 && (is_unreachable(run) || injection.is_some_and(delays_stops));
        let wrong = wrong(run, &motions, outcome).or_else(|| match (unreachable, fault, amiss) {
            (false, _, _) if moved_s > LONGEST_S + ROUNDING_S => {
                Some(format!("the arm moved for {moved_s:.3} s"))
            }
            (true, Some(fault), Some(amiss)) => {
                let dead = injection.is_some_and(|injection| injection.kind == "*" && injection.lasting);
                too_late(run, fault, amiss, dead)
            }
            _ => None,
        });
        Self { outcome, moved_s, unreachable, wrong }
    }
}

/// When the first motion that is not as planned leaves the path.
fn departure(motions: &[&Played], ended: Instant) -> Option<Instant> {
    let planned = Motions::of(&COMMAND).expect("a whole command");
    motions.iter().zip(planned.all()).find_map(|(played, motion)| {
        let until = played.stopped.or(played.ended).unwrap_or(ended);
        let lasts_ms = until.saturating_duration_since(played.begun).as_millis() as u64;
        let off_rad = |ms: u64| motion.off_path(&played.at_s(ms as f64 * 1e-3)).1;
        let first_ms = (0..=lasts_ms).step_by(5).find(|&ms| off_rad(ms) > OFF_PATH_RAD)?;
        Some(played.begun + Duration::from_millis(first_ms))
    })
}

/// How long an arm moved after an instant, until it braked or ended (s).
fn moved_s(played: &Played, after: Instant, ended: Instant) -> f64 {
    let until = played.stopped.or(played.ended).unwrap_or(ended.max(after));
    until.saturating_duration_since(played.begun.max(after)).as_secs_f64()
}

/// Whether the arm moved on to the end of its motion: no stop has reached the controller, or none could be carried out because
/// the cancellation is ignored and the arm's position is not known.
fn is_unreachable(run: &Run) -> bool {
    run.played.last().is_some_and(|played| played.stopped.is_none())
}

/// Whether every request of a stop is held up: the arm moves until it arrives.
fn delays_stops(injection: &Injection) -> bool {
    let is_stop = STOPS.contains(&injection.kind.as_str()) || injection.kind == "*";
    is_stop && injection.lasting && matches!(injection.mishap, Mishap::Late(_))
}

/// Where no stop takes effect, it must at least have been sent in time; over a dead link the mock does not see it, and the loss
/// must have been found in time.
fn too_late(run: &Run, fault: &Fault, amiss: Instant, dead: bool) -> Option<String> {
    let sent = run.seen.iter().find(|message| STOPS.contains(&message.kind.as_str()));
    let after_s = match (sent, fault) {
        (Some(sent), _) => sent.at.saturating_duration_since(amiss).as_secs_f64(),
        (None, Fault::LostLink { silent_s, .. }) if dead => *silent_s,
        _ => f64::INFINITY,
    };
    (after_s > LONGEST_S + ROUNDING_S).then(|| format!("the stop was sent after {after_s:.3} s"))
}

/// What a run claims that is not so.
fn wrong(run: &Run, motions: &[&Played], outcome: Outcome) -> Option<String> {
    match (&run.ending, outcome) {
        (_, Outcome::Struck) => {
            let planned = Motions::of(&COMMAND).expect("a whole command");
            let planned: Vec<&Motion> = planned.all().collect();
            let is_made = |(played, motion): (&&Played, &&Motion)| {
                let [from, to] = played.ends();
                let same = |one: &[f64], other: &[f64]| largest_difference(one, other).1 <= SAME_RAD;
                played.is_whole() && same(from, motion.start()) && same(to, motion.end())
            };
            let whole: Vec<&&Played> = motions.iter().filter(|played| played.is_whole()).collect();
            let all = whole.len() == planned.len() && whole.into_iter().zip(&planned).all(is_made);
            (!all).then(|| format!("it was not struck: {} motions", motions.len()))
        }
        (Ok(Ending::Stopped { stop, .. }), _) if stop.at_rest_after_s.is_none() => None,
        _ => {
            let moved_rad = run.moved_afterwards_rad;
            (moved_rad > REST_RAD).then(|| format!("the arm is said to rest and moves {moved_rad:.3} rad"))
        }
    }
}
