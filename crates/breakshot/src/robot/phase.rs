//! The phases of a command: joint angles over time, from rest to rest.

use super::arm::joint_state::JointState;
use serde::{Deserialize, Serialize};

/// The name of a phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PhaseName {
    /// From home to the pose above the start of the run-up.
    Approach,
    /// Vertically down to the start of the run-up.
    Lower,
    /// Run-up, constant speed through the contact, stop.
    Strike,
    /// Back along the same line.
    DrawBack,
    /// Vertically up.
    Raise,
    /// Back home.
    Home,
}

/// A joint path from rest to rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Phase {
    /// Its name.
    pub name: PhaseName,
    /// Time since the command's start (s), at most 2 ms apart.
    pub time_s: Vec<f64>,
    /// Joint angles at these times (rad).
    pub q_rad: Vec<Vec<f64>>,
    /// Joint velocities (rad/s).
    pub qd_rad_s: Vec<Vec<f64>>,
    /// Joint accelerations (rad/s2).
    pub qdd_rad_s2: Vec<Vec<f64>>,
}

impl PhaseName {
    /// All phases in order.
    pub const ALL: [Self; 6] =
        [Self::Approach, Self::Lower, Self::Strike, Self::DrawBack, Self::Raise, Self::Home];

    /// The name in messages.
    pub fn label(self) -> &'static str {
        match self {
            Self::Approach => "approach",
            Self::Lower => "lowering",
            Self::Strike => "strike",
            Self::DrawBack => "drawing back",
            Self::Raise => "raising",
            Self::Home => "return home",
        }
    }
}

impl Phase {
    /// Its start and end time (s).
    pub fn span_s(&self) -> [f64; 2] {
        [self.time_s.first().copied().unwrap_or(0.0), self.time_s.last().copied().unwrap_or(0.0)]
    }

    /// The joint state at a time (s), clamped to the phase.
    ///
    /// Interpolates between samples with the quintic polynomial that matches their angles, velocities and accelerations.
    pub fn at(&self, time_s: f64) -> JointState {
        let last = self.time_s.len().saturating_sub(1);
        let k = self.time_s.partition_point(|&t| t <= time_s).clamp(1, last.max(1)) - 1;
        if last == 0 {
            return self.sample(0);
        }
        let step_s = self.time_s[k + 1] - self.time_s[k];
        let fraction = ((time_s - self.time_s[k]) / step_s).clamp(0.0, 1.0);
        let joints = 0..self.q_rad[k].len();
        let states: Vec<[f64; 3]> = joints
            .map(|joint| {
                let end =
                    |k: usize| [self.q_rad[k][joint], self.qd_rad_s[k][joint], self.qdd_rad_s2[k][joint]];
                quintic(end(k), end(k + 1), step_s, fraction)
            })
            .collect();
        let column = |k: usize| states.iter().map(|state| state[k]).collect();
        JointState { q_rad: column(0), qd_rad_s: column(1), qdd_rad_s2: column(2) }
    }

    pub(crate) fn sample(&self, k: usize) -> JointState {
        JointState {
            q_rad: self.q_rad[k].clone(),
            qd_rad_s: self.qd_rad_s[k].clone(),
            qdd_rad_s2: self.qdd_rad_s2[k].clone(),
        }
    }

    /// The joint states every `period_s` (s), from the first to the last instant.
    pub fn resampled(&self, period_s: f64) -> Vec<JointState> {
        let [start_s, end_s] = self.span_s();
        let count = ((end_s - start_s) / period_s).ceil() as usize;
        (0..=count).map(|k| self.at(start_s + period_s * k as f64)).collect()
    }
}

/// Value, slope and curvature at a fraction of a step, from the same three numbers at both ends.
fn quintic(from: [f64; 3], to: [f64; 3], step: f64, fraction: f64) -> [f64; 3] {
    let (a, b, c) = (from[0], from[1] * step, from[2] * step * step / 2.0);
    let (p, v, w) = (to[0] - a - b - c, to[1] * step - b - 2.0 * c, to[2] * step * step - 2.0 * c);
    let (d, e, f) = (10.0 * p - 4.0 * v + w / 2.0, -15.0 * p + 7.0 * v - w, 6.0 * p - 3.0 * v + w / 2.0);
    let u = fraction;
    let value = a + u * (b + u * (c + u * (d + u * (e + u * f))));
    let slope = b + u * (2.0 * c + u * (3.0 * d + u * (4.0 * e + u * 5.0 * f)));
    let curvature = 2.0 * c + u * (6.0 * d + u * (12.0 * e + u * 20.0 * f));
    [value, slope / step, curvature / (step * step)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint that follows sin(t), sampled every 20 ms.
    fn sine() -> Phase {
        let times: Vec<f64> = (0..=50).map(|k| f64::from(k) * 0.02).collect();
        let column = |f: fn(f64) -> f64| times.iter().map(|&t| vec![f(t)]).collect::<Vec<_>>();
        Phase {
            name: PhaseName::Strike,
            q_rad: column(f64::sin),
            qd_rad_s: column(f64::cos),
            qdd_rad_s2: column(|t| -t.sin()),
            time_s: times,
        }
    }

    #[test]
    fn the_interpolation_between_samples_is_smooth() {
        let phase = sine();
        for state in (0..=4000).map(|k| f64::from(k) * 0.000_25).map(|t| (t, phase.at(t))) {
            let (t, JointState { q_rad, qd_rad_s, qdd_rad_s2 }) = state;
            assert!((q_rad[0] - t.sin()).abs() < 1e-12, "{t} s: {} rad", q_rad[0]);
            assert!((qd_rad_s[0] - t.cos()).abs() < 1e-9, "{t} s: {} rad/s", qd_rad_s[0]);
            assert!((qdd_rad_s2[0] + t.sin()).abs() < 1e-6, "{t} s: {} rad/s2", qdd_rad_s2[0]);
        }
    }

    #[test]
    fn resampling_ends_at_the_last_instant() {
        let phase = sine();
        let states = phase.resampled(0.0003);
        assert_eq!(states.len(), 3335);
        assert_eq!(states[3334].q_rad[0], 1.0_f64.sin());
        assert_eq!(phase.at(7.0).q_rad[0], 1.0_f64.sin());
        assert_eq!(phase.at(-1.0).q_rad[0], 0.0);
    }
}
