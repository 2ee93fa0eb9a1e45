//! The motions of a command: joint paths from rest to rest, each sent to the robot as a whole.

use breakshot::robot::{Command, JointState, Phase, PhaseName};

/// A joint path from rest to rest, sent as a whole and monitored until its end.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Motion {
    /// Its name in messages and in the log.
    pub(crate) name: &'static str,
    /// Its samples; times count from the start of the command.
    pub(crate) phase: Phase,
}

/// The motions before the strike, the strike, and the motions after it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Motions {
    pub(crate) before: Vec<Motion>,
    /// The stroke and the draw-back in one motion: objects may roll into a striker that waits between them.
    pub(crate) strike: Motion,
    pub(crate) after: Vec<Motion>,
}

impl Motions {
    /// The motions of a command; `None` if a phase is missing or has fewer than two samples.
    pub(crate) fn of(command: &Command) -> Option<Self> {
        let one = |name: PhaseName| {
            let phase = command.phase(name).filter(|phase| phase.time_s.len() > 1)?;
            Some(Motion { name: name.label(), phase: phase.clone() })
        };
        let mut strike = one(PhaseName::Strike)?;
        let back = one(PhaseName::DrawBack)?.phase;
        // The first sample of the draw-back repeats the last one of the stroke.
        strike.phase.time_s.extend_from_slice(&back.time_s[1..]);
        strike.phase.q_rad.extend_from_slice(&back.q_rad[1..]);
        strike.phase.qd_rad_s.extend_from_slice(&back.qd_rad_s[1..]);
        strike.phase.qdd_rad_s2.extend_from_slice(&back.qdd_rad_s2[1..]);
        Some(Self {
            before: vec![one(PhaseName::Approach)?, one(PhaseName::Lower)?],
            strike,
            after: vec![one(PhaseName::Raise)?, one(PhaseName::Home)?],
        })
    }

    /// All motions in order.
    pub(crate) fn all(&self) -> impl Iterator<Item = &Motion> {
        self.before.iter().chain(std::iter::once(&self.strike)).chain(&self.after)
    }
}

impl Motion {
    /// Its duration (s).
    pub(crate) fn duration_s(&self) -> f64 {
        let [from_s, to_s] = self.phase.span_s();
        to_s - from_s
    }

    /// The joint state at a time since the motion's start.
    pub(crate) fn at(&self, since_start_s: f64) -> JointState {
        self.phase.at(self.phase.span_s()[0] + since_start_s)
    }

    /// The joint angles at the start (rad).
    pub(crate) fn start(&self) -> &[f64] {
        &self.phase.q_rad[0]
    }

    /// The joint angles at the end (rad).
    pub(crate) fn end(&self) -> &[f64] {
        &self.phase.q_rad[self.phase.q_rad.len() - 1]
    }

    /// The sample of the path that is nearest to joint angles (rad).
    pub(crate) fn nearest(&self, q_rad: &[f64]) -> Option<&[f64]> {
        let distance_rad = |sample: &&Vec<f64>| largest_difference(sample, q_rad).1;
        let nearest = self.phase.q_rad.iter().min_by(|a, b| distance_rad(a).total_cmp(&distance_rad(b)));
        nearest.map(Vec::as_slice)
    }

    /// The distance of joint angles from the nearest sample of the path, whenever it is passed: the index of the joint with
    /// the largest deviation, and that deviation (rad).
    pub(crate) fn off_path(&self, q_rad: &[f64]) -> (usize, f64) {
        let distances = self.phase.q_rad.iter().map(|sample| largest_difference(sample, q_rad));
        distances.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY))
    }
}

/// The joint in which two poses differ most, and the difference (rad).
///
/// Poses of different lengths, and angles that are not numbers, differ without bound.
pub(crate) fn largest_difference(one: &[f64], other: &[f64]) -> (usize, f64) {
    if one.len() != other.len() {
        return (0, f64::INFINITY);
    }
    let apart = one.iter().zip(other).map(|(a, b)| (a - b).abs()).enumerate();
    apart.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY))
}
