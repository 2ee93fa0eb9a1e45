//! What is sent in one piece: a motion from rest to rest.

use breakshot::robot::{Command, JointState, Phase, PhaseName};

/// A motion from rest to rest, sent as a whole and watched until it ends.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Motion {
    /// What it is for, in words.
    pub(crate) name: &'static str,
    /// Its samples; times count from the command's start.
    pub(crate) phase: Phase,
}

/// The motions of a strike: what comes before it, the strike itself, what comes after.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Motions {
    pub(crate) before: Vec<Motion>,
    /// The stroke and the way back in one: the striker must not linger where objects roll.
    pub(crate) strike: Motion,
    pub(crate) after: Vec<Motion>,
}

impl Motions {
    /// `None` for a command that lacks a phase or has an empty one.
    pub(crate) fn of(command: &Command) -> Option<Self> {
        let one = |name: PhaseName| {
            let phase = command.phase(name).filter(|phase| phase.time_s.len() > 1)?;
            Some(Motion { name: name.text(), phase: phase.clone() })
        };
        let mut strike = one(PhaseName::Strike)?;
        let back = one(PhaseName::DrawBack)?.phase;
        // The first instant of the way back is the last one of the stroke.
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

    /// All of them in their order.
    pub(crate) fn all(&self) -> impl Iterator<Item = &Motion> {
        self.before.iter().chain(std::iter::once(&self.strike)).chain(&self.after)
    }
}

impl Motion {
    /// How long it takes (s).
    pub(crate) fn duration_s(&self) -> f64 {
        let [from_s, to_s] = self.phase.span_s();
        to_s - from_s
    }

    /// The arm so long after its start.
    pub(crate) fn at(&self, since_start_s: f64) -> JointState {
        self.phase.at(self.phase.span_s()[0] + since_start_s)
    }

    /// The joint angles it starts from.
    pub(crate) fn start(&self) -> &[f64] {
        &self.phase.q_rad[0]
    }

    /// The joint angles it ends at.
    pub(crate) fn end(&self) -> &[f64] {
        &self.phase.q_rad[self.phase.q_rad.len() - 1]
    }

    /// How far these joint angles are from the path, wherever along it: the joint that is farthest off, and by how much
    /// (rad).
    pub(crate) fn off_path(&self, q_rad: &[f64]) -> (usize, f64) {
        let distances = self.phase.q_rad.iter().map(|sample| farthest(sample, q_rad));
        distances.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY))
    }
}

/// The joint in which two poses differ most, and by how much (rad).
pub(crate) fn farthest(one: &[f64], other: &[f64]) -> (usize, f64) {
    let apart = one.iter().zip(other).map(|(a, b)| (a - b).abs()).enumerate();
    apart.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY))
}
