//! Joint paths sampled every 2 ms: straight lines of the tip and straight lines in joint space, joined at rest.

use super::failure::{Attempted, Failure, SearchStage};
use super::limit_monitor::{LimitMonitor, PathConstraints};
use super::limits::{LimitCheck, LimitedQuantity};
use super::profile::{Profile, ProfileLimits};
use super::safety::SLOW_M_S;
use crate::robot::arm::joint_state::JointState;
use crate::robot::arm::model::serial_arm::Arm;
use crate::robot::phase::{Phase, PhaseName};
use nalgebra::{Vector3, Vector6};
use std::collections::BTreeMap;

/// Time between two samples (s), at most the 2 ms at which the limits are checked.
const PERIOD_S: f64 = 0.002;
/// Fraction of the joints' speed limits used by a joint-space motion.
const JOINT_MOVE_FRACTION: f64 = 0.3;
/// Duration of the ramps of a joint-space motion (s).
const JOINT_MOVE_RAMP_S: f64 = 0.4;
/// Largest difference between a joint angle and its extrapolation from the previous sample (rad); a larger one is a jump to
/// another branch of the inverse kinematics.
const BRANCH_JUMP_RAD: f64 = 0.02;
/// Speeds tried for the straight transfers, as fractions of the usual one.
const TRANSFER_SPEED_FRACTIONS: [f64; 3] = [1.0, 0.5, 0.2];

/// A straight motion of the tip without rotation.
pub(crate) struct TipLine {
    /// The displacement in the base frame (m).
    pub(crate) to_m: Vector3<f64>,
    /// The distance along the line over time.
    pub(crate) profile: Profile,
    /// The joint of a seven-joint arm that is held fixed.
    pub(crate) fixed_joint: Option<usize>,
}

/// Phases joined at rest, starting at the home pose.
pub(crate) struct JointPath<'a> {
    constraints: &'a PathConstraints<'a>,
    home: &'a [f64],
    phases: Vec<Phase>,
    ends_s: f64,
    /// The checks of the phases so far.
    monitor: LimitMonitor<'a>,
}

/// The joint states of a phase with their times since its start (s).
pub(crate) type Samples = Vec<(f64, JointState)>;

/// The phases of a path that keeps all limits, and the worst check of each quantity.
pub(crate) struct CheckedPath {
    pub(crate) phases: Vec<Phase>,
    pub(crate) worst: BTreeMap<LimitedQuantity, LimitCheck>,
}

impl<'a> JointPath<'a> {
    pub(crate) fn new(constraints: &'a PathConstraints<'a>, home: &'a [f64]) -> Self {
        Self { constraints, home, phases: Vec::new(), ends_s: 0.0, monitor: constraints.monitor() }
    }

    /// The joint angles at the current end of the path (rad).
    pub(crate) fn end(&self) -> &[f64] {
        let last = self.phases.last().and_then(|phase| phase.q_rad.last());
        last.map_or(self.home, |angles| angles)
    }

    /// The time at the current end of the path (s).
    pub(crate) fn ends_s(&self) -> f64 {
        self.ends_s
    }

    /// Appends a phase with its checks.
    pub(crate) fn append(&mut self, name: PhaseName, samples: Samples, checks: LimitMonitor<'a>) {
        self.monitor.merge(checks);
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

    /// The samples of a straight motion of the tip from joint angles `from`, by inverse kinematics.
    pub(crate) fn line(&self, from: &[f64], line: &TipLine) -> Attempted<Samples> {
        let arm = self.constraints.arm;
        let start = arm.tip(from);
        let direction = line.to_m.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        let mut samples: Samples = Vec::new();
        for (time_s, step_s) in instants(line.profile.duration_s()) {
            // Target pose
            let along = line.profile.at(time_s);
            let mut target = start;
            target.translation.vector += direction * along.position;

            // Joint angles, on the same branch as the sample before
            let guess = match samples.last() {
                Some((_, state)) => extrapolated(state, step_s),
                None => from.to_vec(),
            };
            let unreachable = || {
                let reason = format!("the line leaves the arm's reach after {:.3} m", along.position);
                Failure::new(SearchStage::Strike, reason)
            };
            let q_rad = arm.descend(&target, guess.clone(), line.fixed_joint).ok_or_else(unreachable)?;
            if let Some(k) = (0..q_rad.len()).find(|&k| (q_rad[k] - guess[k]).abs() > BRANCH_JUMP_RAD) {
                let joint = &arm.links[k].joint.name;
                let reason = format!("joint `{joint}` would have to jump to another branch on the line");
                return Err(Failure::new(SearchStage::Strike, reason));
            }

            // Joint velocities and accelerations
            let twist = |size: f64| {
                let v = direction * size;
                Vector6::new(v.x, v.y, v.z, 0.0, 0.0, 0.0)
            };
            let (velocity, acceleration) = (twist(along.speed), twist(along.acceleration));
            let rates = arm.joint_rates(&q_rad, &velocity, &acceleration, line.fixed_joint);
            let (qd_rad_s, qdd_rad_s2) = rates.ok_or_else(unreachable)?;
            samples.push((time_s, JointState { q_rad, qd_rad_s, qdd_rad_s2 }));
        }
        Ok(samples)
    }

    /// Appends a straight transfer of the tip; reduces its speed if a limit requires it.
    pub(crate) fn append_line(
        &mut self,
        name: PhaseName,
        to_m: Vector3<f64>,
        usual: ProfileLimits,
        fixed_joint: Option<usize>,
    ) -> Attempted<()> {
        let mut nearest = Failure::new(SearchStage::Transfer, "the arm has no straight vertical transfer");
        for fraction in TRANSFER_SPEED_FRACTIONS {
            let limits = ProfileLimits { speed: usual.speed * fraction, ..usual };
            let line = TipLine { to_m, profile: Profile::rest_to_rest(to_m.norm(), &limits), fixed_joint };
            let samples = self.line(self.end(), &line)?;
            match self.check_phase(name, &samples, SearchStage::Transfer) {
                Ok(checks) => {
                    self.append(name, samples, checks);
                    return Ok(());
                }
                Err(failure) => nearest = nearest.better(failure),
            }
        }
        Err(nearest)
    }

    /// Appends a joint-space motion between two poses: direct, or over the pose `via` if the direct one breaks a limit.
    pub(crate) fn append_joint_move(
        &mut self,
        name: PhaseName,
        from: &[f64],
        via: &[f64],
        to: &[f64],
    ) -> Attempted<()> {
        let direct = self.joint_move(from, to);
        let failure = match self.check_phase(name, &direct, SearchStage::Transfer) {
            Ok(checks) => {
                self.append(name, direct, checks);
                return Ok(());
            }
            Err(failure) => failure,
        };
        let mut detour = self.joint_move(from, via);
        let half_s = detour.last().map_or(0.0, |(time_s, _)| *time_s);
        let rest = self.joint_move(via, to);
        detour.extend(rest.into_iter().skip(1).map(|(time_s, state)| (half_s + time_s, state)));
        let checks = self.check_phase(name, &detour, SearchStage::Transfer);
        let checks = checks.map_err(|other| failure.better(other))?;
        self.append(name, detour, checks);
        Ok(())
    }

    /// The checks of a phase that begins where the path ends.
    ///
    /// # Errors
    /// The most exceeded limit.
    pub(crate) fn check_phase(
        &self,
        name: PhaseName,
        samples: &Samples,
        stage: SearchStage,
    ) -> Attempted<LimitMonitor<'a>> {
        let mut monitor = self.constraints.monitor();
        for (time_s, state) in samples {
            monitor.record(name, self.ends_s + *time_s, state);
        }
        if let Some(check) = monitor.broken() {
            return Err(Failure::of_check(stage, check));
        }
        Ok(monitor)
    }

    /// The phases with the worst check of each quantity, of a path whose phases were all checked.
    pub(crate) fn checked(self) -> CheckedPath {
        CheckedPath { phases: self.phases, worst: self.monitor.worst }
    }

    /// The samples of a straight line in joint space, within the speed limits of the joints and of the tip.
    fn joint_move(&self, from: &[f64], to: &[f64]) -> Samples {
        let constraints = self.constraints;
        let offsets: Vec<f64> = from.iter().zip(to).map(|(from, to)| to - from).collect();
        let speed_fraction = JOINT_MOVE_FRACTION.min(constraints.limits.speed_fraction);
        let speed = fraction_per_s(constraints.arm, speed_fraction, from, &offsets);
        let limits = ProfileLimits {
            speed,
            acceleration: speed / JOINT_MOVE_RAMP_S * 2.0,
            jerk: speed / JOINT_MOVE_RAMP_S.powi(2) * 4.0,
        };
        let profile = Profile::rest_to_rest(1.0, &limits);
        let scaled = |factor: f64| offsets.iter().map(|offset| offset * factor).collect::<Vec<_>>();
        let samples = instants(profile.duration_s()).map(|(time_s, _)| {
            let along = profile.at(time_s);
            let q_rad = from.iter().zip(&offsets).map(|(from, offset)| from + offset * along.position);
            let (qd_rad_s, qdd_rad_s2) = (scaled(along.speed), scaled(along.acceleration));
            (time_s, JointState { q_rad: q_rad.collect(), qd_rad_s, qdd_rad_s2 })
        });
        samples.collect()
    }
}

/// The largest speed of a joint-space motion as a fraction of its length per second (1/s), by joints and tip.
fn fraction_per_s(arm: &Arm, speed_fraction: f64, from: &[f64], offsets: &[f64]) -> f64 {
    let joints = offsets.iter().zip(&arm.links);
    let by_joint = joints.map(|(offset, link)| speed_fraction * link.joint.speed_rad_s / offset.abs());
    let by_tip = std::iter::once(SLOW_M_S / tip_travel_m(arm, from, offsets));
    // A motion of zero length has no limit of its own.
    by_joint.chain(by_tip).fold(LARGEST_FRACTION_PER_S, f64::min)
}

/// The largest speed of the tip per fraction of a joint-space motion (m): of the whole motion in one second (m/s).
pub(crate) fn tip_travel_m(arm: &Arm, from: &[f64], offsets: &[f64]) -> f64 {
    /// Number of intervals between the poses at which the tip's speed is computed.
    const STEPS: u32 = 32;
    let speeds = (0..=STEPS).map(|k| {
        let fraction = f64::from(k) / f64::from(STEPS);
        let q_rad = from.iter().zip(offsets).map(|(from, offset)| from + offset * fraction).collect();
        let state = JointState { q_rad, qd_rad_s: offsets.to_vec(), qdd_rad_s2: Vec::new() };
        arm.tip_velocity(&state).norm()
    });
    speeds.fold(0.0, f64::max)
}

/// Upper bound for motions of nearly zero length (1/s).
const LARGEST_FRACTION_PER_S: f64 = 2.0;

/// The sample times of a phase from start to end, uniformly spaced, each with the step (s).
fn instants(duration_s: f64) -> impl Iterator<Item = (f64, f64)> {
    let count = (duration_s / PERIOD_S).ceil().max(1.0);
    let step_s = duration_s / count;
    (0..=count as usize).map(move |k| (step_s * k as f64, step_s))
}

/// The joint angles one step later at constant acceleration (rad).
fn extrapolated(state: &JointState, step_s: f64) -> Vec<f64> {
    let rates = state.qd_rad_s.iter().zip(&state.qdd_rad_s2);
    state.q_rad.iter().zip(rates).map(|(q, (qd, qdd))| q + step_s * (qd + step_s * qdd / 2.0)).collect()
}
