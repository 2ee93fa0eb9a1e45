//! The joint states that a robot publishes, with the times at which they were measured.

use crate::motion::Motion;
use serde_json::Value;
use std::collections::VecDeque;
use tokio::time::Instant;

/// Number of readings kept.
const KEPT: usize = 3;
/// Largest age of a reading from which the arm's position now is extrapolated, and largest time between two readings that give
/// a velocity (s).
const FRESH_S: f64 = 0.15;
/// Largest ratio of a joint's speed to its planned one.
const FASTER: f64 = 1.1;
/// Noise of a joint angle (rad).
const NOISE_RAD: f64 = 0.005;
/// A joint slower than this needs no time to brake (rad/s).
const STILL_RAD_S: f64 = 0.05;
/// Largest deviation from the path of an arm that is brought to rest on it (rad).
const NEAR_PATH_RAD: f64 = 0.05;
const NS_PER_S: i64 = 1_000_000_000;
/// By how much a state may be younger than the robot's time that is taken after it: the clocks of two computers of one robot (s).
const CLOCK_ROUNDING_S: f64 = 0.05;
/// Limits of the time in which the arm is brought to rest (s): a shorter one is a step for the servo loop.
pub(super) const HOLD_S: [f64; 2] = [0.1, 0.5];

/// The joint angles of one message.
#[derive(Clone, Debug)]
struct Reading {
    /// The message's own time since the first one's (s).
    stamp_s: f64,
    q_rad: Vec<f64>,
    /// The velocities, if the message has them (rad/s).
    qd_rad_s: Option<Vec<f64>>,
}

/// The latest joint states of an arm.
///
/// A message counts once, and only if its stamp is later than all before. Its age follows from its stamp: the difference of the
/// clocks of the robot and of this computer is known to the shortest delay of all messages, so that a message that was held up is
/// known to be old. Where the robot's time is known ([`Self::synchronize`]), so is a delay that all messages share.
#[derive(Debug)]
pub(super) struct JointStates {
    joints: Vec<String>,
    origin: Instant,
    /// The first message's stamp (ns).
    first_ns: Option<i64>,
    /// Time of arrival since `origin` less the stamp, of the fastest message (s).
    least_delay_s: f64,
    readings: VecDeque<Reading>,
    /// The latest message, if its angles are no pose of this arm.
    invalid: Option<String>,
}

/// A pose in which the arm can be held, and the time in which it comes to rest there.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Hold {
    pub(super) q_rad: Vec<f64>,
    pub(super) after_s: f64,
}

impl JointStates {
    pub(super) fn new(joints: &[String]) -> Self {
        Self {
            joints: joints.to_vec(),
            origin: Instant::now(),
            first_ns: None,
            least_delay_s: f64::INFINITY,
            readings: VecDeque::new(),
            invalid: None,
        }
    }

    /// Takes a `JointState` message. Messages of other joints, without a stamp, and with a stamp that is not later than the
    /// latest one are ignored.
    pub(super) fn receive(&mut self, message: &Value) {
        let (Some(columns), Some(stamp_ns)) = (self.columns(message), stamp_ns(message)) else { return };
        let first_ns = *self.first_ns.get_or_insert(stamp_ns);
        let stamp_s = stamp_ns.saturating_sub(first_ns) as f64 * 1e-9;
        if self.readings.back().is_some_and(|latest| stamp_s <= latest.stamp_s) {
            return;
        }
        let row = |key: &str| -> Option<Vec<f64>> {
            let finite = |&column: &usize| message[key][column].as_f64().filter(|x| x.is_finite());
            columns.iter().map(finite).collect()
        };
        let Some(q_rad) = row("position") else {
            self.invalid = Some(message["position"].to_string());
            return;
        };
        self.invalid = None;
        self.least_delay_s = self.least_delay_s.min(self.origin.elapsed().as_secs_f64() - stamp_s);
        // An empty list of velocities is usual; one that is not whole is none.
        self.readings.push_back(Reading { stamp_s, q_rad, qd_rad_s: row("velocity") });
        if self.readings.len() > KEPT {
            self.readings.pop_front();
        }
    }

    /// Takes the robot's time, requested and received at these instants; returns the delay of the fastest message (s), or `None`
    /// if the messages' stamps do not count from that clock.
    pub(super) fn synchronize(&mut self, robot_ns: i64, [requested, received]: [Instant; 2]) -> Option<f64> {
        let robot_s = robot_ns.saturating_sub(self.first_ns?) as f64 * 1e-9;
        // The robot's clock was read before its time was received: no message is later than this delay shows.
        let fastest_s = (received - self.origin).as_secs_f64() - robot_s;
        let delay_s = self.least_delay_s - fastest_s;
        let round_trip_s = (received - requested).as_secs_f64();
        // No message is older than its subscription.
        let possible_s = -round_trip_s - CLOCK_ROUNDING_S..=(received - self.origin).as_secs_f64();
        if !possible_s.contains(&delay_s) {
            return None;
        }
        self.least_delay_s = self.least_delay_s.min(fastest_s);
        Some(delay_s.max(0.0))
    }

    /// The columns of this arm's joints, in any order; `None` if one is missing.
    fn columns(&self, message: &Value) -> Option<Vec<usize>> {
        let names = message["name"].as_array()?;
        self.joints.iter().map(|joint| names.iter().position(|name| name == joint)).collect()
    }

    /// The latest joint angles (rad) and their age (s); `None` before the first message.
    ///
    /// # Errors
    /// The latest message's positions, if they are no pose of this arm.
    pub(super) fn latest(&self) -> Result<Option<(Vec<f64>, f64)>, String> {
        if let Some(found) = &self.invalid {
            return Err(found.clone());
        }
        Ok(self.readings.back().map(|reading| (reading.q_rad.clone(), self.age_s(reading))))
    }

    fn age_s(&self, reading: &Reading) -> f64 {
        (self.origin.elapsed().as_secs_f64() - reading.stamp_s - self.least_delay_s).max(0.0)
    }

    /// The longest time between two of the latest messages (s); `None` before there are enough.
    pub(super) fn period_s(&self) -> Option<f64> {
        let stamps = || self.readings.iter().map(|reading| reading.stamp_s);
        let gaps = stamps().skip(1).zip(stamps()).map(|(later, earlier)| later - earlier);
        (self.readings.len() == KEPT).then(|| gaps.fold(0.0, f64::max))
    }

    /// Where the arm comes to rest if it brakes now as hard as in this motion; `None` if that cannot be derived from fresh
    /// readings that agree with each other and with the motion.
    pub(super) fn hold(&self, motion: &Motion) -> Option<Hold> {
        let (latest, before) = (self.readings.back()?, self.readings.iter().rev().nth(1)?);
        let (age_s, step_s) = (self.age_s(latest), latest.stamp_s - before.stamp_s);
        if self.invalid.is_some() || age_s > FRESH_S || step_s > FRESH_S {
            return None;
        }
        let phase = &motion.phase;
        let most =
            |rows: &[Vec<f64>], k: usize| rows.iter().fold(0.0, |most: f64, row| most.max(row[k].abs()));
        let mut velocity = Vec::new();
        let mut after_s = HOLD_S[0];
        for k in 0..latest.q_rad.len() {
            let (fastest, hardest) = (most(&phase.qd_rad_s, k), most(&phase.qdd_rad_s2, k));
            let mean = (latest.q_rad[k] - before.q_rad[k]) / step_s;
            let noise = 2.0 * NOISE_RAD / step_s;
            let reported = latest.qd_rad_s.as_ref().map_or(mean, |qd| qd[k]);
            if mean.abs() > FASTER * fastest + noise || (reported - mean).abs() > hardest * step_s + noise {
                return None;
            }
            if reported.abs() > STILL_RAD_S {
                after_s = after_s.max((reported.abs() / hardest.max(f64::MIN_POSITIVE)).min(HOLD_S[1]));
            }
            velocity.push(reported);
        }
        if motion.off_path(&latest.q_rad).1 > NEAR_PATH_RAD {
            return None;
        }
        let rests = latest.q_rad.iter().zip(&velocity).map(|(q, v)| q + v * (age_s + after_s / 2.0));
        // A pose of the checked path: never beyond its end, or beyond the point where it turns back.
        let q_rad = motion.nearest(&rests.collect::<Vec<f64>>())?.to_vec();
        Some(Hold { q_rad, after_s })
    }
}

/// A message's `header.stamp` (ns); `None` without one, or at zero.
fn stamp_ns(message: &Value) -> Option<i64> {
    time_ns(&message["header"]["stamp"]).filter(|ns| *ns != 0)
}

/// A `builtin_interfaces/Time` since its epoch (ns); `None` if it is none, or lies before it.
pub(super) fn time_ns(time: &Value) -> Option<i64> {
    let nanosec = time["nanosec"].as_i64().filter(|ns| (0..NS_PER_S).contains(ns))?;
    let sec = time["sec"].as_i64().filter(|sec| *sec >= 0)?;
    sec.checked_mul(NS_PER_S)?.checked_add(nanosec)
}
