//! Motions sampled every 2 ms: straight lines of the tip, straight moves of the joints, one after the other.

use super::failure::{Attempted, Failure, Stage};
use super::limits::{Check, Quantity};
use super::profile::{self, Profile};
use super::safety::SLOW_M_S;
use super::search::Attempt;
use crate::robot::arm::joint_state::JointState;
use crate::robot::arm::model::serial_arm::Arm;
use crate::robot::phase::{Phase, PhaseName};
use nalgebra::{Vector3, Vector6};
use std::collections::BTreeMap;

/// Between two samples (s); at most the 2 ms that the checks promise.
const PERIOD_S: f64 = 0.002;
/// A joint move uses this much of the joints' speeds, and takes this long to gain them (s).
const JOINT_MOVE_SHARE: f64 = 0.3;
const JOINT_MOVE_RAMP_S: f64 = 0.4;
/// Between two samples a joint may be off its own speed's prediction by this (rad); more is a flip to another branch.
const FLIP_RAD: f64 = 0.02;
/// Speeds tried for the slow straight parts, as a share of the usual one.
const SLOWER: [f64; 3] = [1.0, 0.5, 0.2];

/// A straight motion of the tip without turning.
pub(crate) struct Line {
    /// Its way in the base's frame.
    pub(crate) to_m: Vector3<f64>,
    pub(crate) profile: Profile,
    pub(crate) still: Option<usize>,
}

/// Phases put one after the other.
pub(crate) struct Path<'a> {
    attempt: &'a Attempt<'a>,
    phases: Vec<Phase>,
    ends_s: f64,
}

/// Times since the phase's start and the arm then.
pub(crate) type Samples = Vec<(f64, JointState)>;

impl<'a> Path<'a> {
    pub(crate) fn new(attempt: &'a Attempt<'a>) -> Self {
        Self { attempt, phases: Vec::new(), ends_s: 0.0 }
    }

    /// The joint angles at the end so far.
    pub(crate) fn end(&self) -> &[f64] {
        let last = self.phases.last().and_then(|phase| phase.q_rad.last());
        last.map_or(&self.attempt.home, |angles| angles)
    }

    pub(crate) fn append(&mut self, name: PhaseName, samples: Samples) {
        let mut phase = Phase {
            name,
            time_s: Vec::new(),
            q_rad: Vec::new(),
            qd_rad_s: Vec::new(),
            qdd_rad_s2: Vec::new(),
        };
        for (time_s, state) in samples {
            phase.time_s.push(self.ends_s + time_s);
            phase.q_rad.push(state.q_rad);
            phase.qd_rad_s.push(state.qd_rad_s);
            phase.qdd_rad_s2.push(state.qdd_rad_s2);
        }
        self.ends_s = phase.span_s()[1];
        self.phases.push(phase);
    }

    /// Follows a line by inverse kinematics from where the arm is.
    pub(crate) fn line(&self, from: &[f64], line: &Line) -> Attempted<Samples> {
        let arm = &self.attempt.station.arm;
        let start = arm.tip(from);
        let direction = line.to_m.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        let mut samples: Samples = Vec::new();
        for (time_s, step_s) in instants(line.profile.duration_s()) {
            let along = line.profile.at(time_s);
            let mut target = start;
            target.translation.vector += direction * along.position;
            let guess = match samples.last() {
                Some((_, state)) => ahead(state, step_s),
                None => from.to_vec(),
            };
            let lost = || {
                let reason = format!("the line leaves the arm's reach after {:.3} m", along.position);
                Failure::new(Stage::Strike, reason)
            };
            let q_rad = arm.descend(&target, guess.clone(), line.still).ok_or_else(lost)?;
            if let Some(k) = (0..q_rad.len()).find(|&k| (q_rad[k] - guess[k]).abs() > FLIP_RAD) {
                let joint = &arm.links[k].joint.name;
                return Err(Failure::new(
                    Stage::Strike,
                    format!("joint `{joint}` would have to flip to follow the line"),
                ));
            }
            let twist = |size: f64| {
                let v = direction * size;
                Vector6::new(v.x, v.y, v.z, 0.0, 0.0, 0.0)
            };
            let rates = arm.joint_rates(&q_rad, &twist(along.speed), &twist(along.acceleration), line.still);
            let (qd_rad_s, qdd_rad_s2) = rates.ok_or_else(lost)?;
            samples.push((time_s, JointState { q_rad, qd_rad_s, qdd_rad_s2 }));
        }
        Ok(samples)
    }

    /// A slow straight motion; slower still if a joint asks for it.
    pub(crate) fn straight(
        &mut self,
        name: PhaseName,
        (to_m, usual): (Vector3<f64>, profile::Limits),
        still: Option<usize>,
    ) -> Attempted<()> {
        let mut nearest = Failure::new(Stage::Way, "the arm cannot come down straight");
        for share in SLOWER {
            let limits = profile::Limits { speed: usual.speed * share, ..usual };
            let line = Line { to_m, profile: Profile::rest_to_rest(to_m.norm(), &limits), still };
            let samples = self.line(self.end(), &line)?;
            match self.check_alone(name, &samples, Stage::Way) {
                Ok(()) => {
                    self.append(name, samples);
                    return Ok(());
                }
                Err(failure) => nearest = nearest.better(failure),
            }
        }
        Err(nearest)
    }

    /// All joints together, straight in joint space; if something is in the way, over the pose `via`.
    pub(crate) fn joint_move(
        &mut self,
        name: PhaseName,
        from: &[f64],
        (via, to): (&[f64], &[f64]),
    ) -> Attempted<()> {
        let straight = self.attempt.joint_samples(from, to);
        let Err(failure) = self.check_alone(name, &straight, Stage::Way) else {
            self.append(name, straight);
            return Ok(());
        };
        let mut over = self.attempt.joint_samples(from, via);
        let half_s = over.last().map_or(0.0, |(time_s, _)| *time_s);
        let rest = self.attempt.joint_samples(via, to);
        over.extend(rest.into_iter().skip(1).map(|(time_s, state)| (half_s + time_s, state)));
        self.check_alone(name, &over, Stage::Way).map_err(|other| failure.better(other))?;
        self.append(name, over);
        Ok(())
    }

    /// An error if a phase by itself breaks a limit.
    pub(crate) fn check_alone(&self, name: PhaseName, samples: &Samples, stage: Stage) -> Attempted<()> {
        let mut watch = self.attempt.watch();
        for (time_s, state) in samples {
            watch.look(name, *time_s, state);
        }
        watch.broken().map_or(Ok(()), |check| Err(Failure::of_check(stage, check)))
    }

    /// The phases, if all of them keep all limits.
    pub(crate) fn checked(self) -> Attempted<(Vec<Phase>, BTreeMap<Quantity, Check>)> {
        let mut watch = self.attempt.watch();
        for phase in &self.phases {
            for (k, &time_s) in phase.time_s.iter().enumerate() {
                watch.look(phase.name, time_s, &phase.sample(k));
            }
        }
        if let Some(check) = watch.broken() {
            return Err(Failure::of_check(Stage::Whole, check));
        }
        let worst = watch.worst;
        Ok((self.phases, worst))
    }
}

impl Attempt<'_> {
    /// A straight move in joint space, slow enough for every joint and for the tip.
    fn joint_samples(&self, from: &[f64], to: &[f64]) -> Samples {
        let arm = &self.station.arm;
        let way: Vec<f64> = from.iter().zip(to).map(|(from, to)| to - from).collect();
        let speed = share_per_s(arm, JOINT_MOVE_SHARE.min(self.limits.speed_share), (from, &way));
        let limits = profile::Limits {
            speed,
            acceleration: speed / JOINT_MOVE_RAMP_S * 2.0,
            jerk: speed / JOINT_MOVE_RAMP_S.powi(2) * 4.0,
        };
        let profile = Profile::rest_to_rest(1.0, &limits);
        let scaled = |factor: f64| way.iter().map(|part| part * factor).collect::<Vec<_>>();
        let samples = instants(profile.duration_s()).map(|(time_s, _)| {
            let along = profile.at(time_s);
            let q_rad = from.iter().zip(&way).map(|(from, part)| from + part * along.position).collect();
            let state =
                JointState { q_rad, qd_rad_s: scaled(along.speed), qdd_rad_s2: scaled(along.acceleration) };
            (time_s, state)
        });
        samples.collect()
    }
}

/// The share of a joint move that may pass per second.
fn share_per_s(arm: &Arm, speed_share: f64, (from, way): (&[f64], &[f64])) -> f64 {
    /// Places on the way at which the tip's speed is looked at.
    const STEPS: u32 = 32;
    let joints = way.iter().zip(&arm.links);
    let by_joint = joints.map(|(part, link)| speed_share * link.joint.speed_rad_s / part.abs());
    let by_tip = (0..=STEPS).map(|k| {
        let part = f64::from(k) / f64::from(STEPS);
        let q_rad = from.iter().zip(way).map(|(from, way)| from + way * part).collect();
        let state = JointState { q_rad, qd_rad_s: way.to_vec(), qdd_rad_s2: Vec::new() };
        SLOW_M_S / arm.tip_velocity(&state).norm()
    });
    // A move of no length takes no time at any speed.
    by_joint.chain(by_tip).fold(FASTEST_SHARE, f64::min)
}

/// For a move of nearly no length (1/s).
const FASTEST_SHARE: f64 = 2.0;

/// The instants of a phase and the steps before them (s): evenly spaced, from start to end.
fn instants(duration_s: f64) -> impl Iterator<Item = (f64, f64)> {
    let count = (duration_s / PERIOD_S).ceil().max(1.0);
    let step_s = duration_s / count;
    (0..=count as usize).map(move |k| (step_s * k as f64, step_s))
}

/// Where the joints will be a step later.
fn ahead(state: &JointState, step_s: f64) -> Vec<f64> {
    let rates = state.qd_rad_s.iter().zip(&state.qdd_rad_s2);
    state.q_rad.iter().zip(rates).map(|(q, (qd, qdd))| q + step_s * (qd + step_s * qdd / 2.0)).collect()
}
