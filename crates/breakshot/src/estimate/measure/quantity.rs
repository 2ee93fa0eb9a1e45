//! What one clip tells of each quantity, and how the errors go together.

use super::contact::{Contact, Party};
use super::impulse_ratio;
use super::restitution::MET_TWICE_STD;
use crate::estimate::clip::fit::Fitted;
use crate::estimate::clip::result::Measured;
use crate::estimate::joint::matrix_serde;
use crate::object::kind;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// What a reading is a reading of.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub(crate) enum Key {
    Friction(String),
    StrikerRestitution(String),
    /// Names in alphabetical order.
    Restitution(String, String),
    /// Logarithm of the mass of the first over the second, in alphabetical order.
    MassRatio(String, String),
}

/// Quantities of one kind vary alike from clip to clip.
pub(crate) const KINDS: usize = 4;

/// What one clip tells: values and the covariance of their noise.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Readings {
    pub(crate) keys: Vec<Key>,
    #[serde(with = "matrix_serde::vector")]
    pub(crate) values: DVector<f64>,
    #[serde(with = "matrix_serde::matrix")]
    pub(crate) covariance: DMatrix<f64>,
    /// For each mass ratio: which share of contact friction is expected to act upwards, see [`impulse_ratio::pressing`].
    pub(crate) pressing: Vec<f64>,
    /// Restitutions of flat sides that met twice, by place.
    pub(crate) met_twice: Vec<bool>,
}

impl Key {
    /// The kind of mass ratios.
    pub(crate) const MASS_RATIO: usize = 3;

    pub(crate) fn kind(&self) -> usize {
        match self {
            Self::Friction(_) => 0,
            Self::StrikerRestitution(_) => 1,
            Self::Restitution(..) => 2,
            Self::MassRatio(..) => Self::MASS_RATIO,
        }
    }

    /// Its name in the covariance.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Friction(object) => format!("friction/{object}"),
            Self::StrikerRestitution(object) => format!("striker_restitution/{object}"),
            Self::Restitution(a, b) => format!("restitution/{a}/{b}"),
            Self::MassRatio(a, b) => format!("log_pair_mass_ratio/{a}/{b}"),
        }
    }

    /// The quantity that this would be if two objects had each other's names, and the value's sign then.
    pub(crate) fn swapped(&self, one: &str, other: &str) -> (Self, f64) {
        let swap = |name: &String| match name.as_str() {
            n if n == one => other.to_owned(),
            n if n == other => one.to_owned(),
            n => n.to_owned(),
        };
        let ordered = |a: String, b: String| if a <= b { (a, b, 1.0) } else { (b, a, -1.0) };
        match self {
            Self::Friction(object) => (Self::Friction(swap(object)), 1.0),
            Self::StrikerRestitution(object) => (Self::StrikerRestitution(swap(object)), 1.0),
            Self::Restitution(a, b) => {
                let (a, b, _) = ordered(swap(a), swap(b));
                (Self::Restitution(a, b), 1.0)
            }
            Self::MassRatio(a, b) => {
                let (a, b, sign) = ordered(swap(a), swap(b));
                (Self::MassRatio(a, b), sign)
            }
        }
    }
}

impl From<Key> for String {
    fn from(key: Key) -> Self {
        key.name()
    }
}

impl TryFrom<String> for Key {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let parts: Vec<&str> = name.split('/').collect();
        match parts[..] {
            ["friction", object] => Ok(Self::Friction(object.into())),
            ["striker_restitution", object] => Ok(Self::StrikerRestitution(object.into())),
            ["restitution", a, b] => Ok(Self::Restitution(a.into(), b.into())),
            ["log_pair_mass_ratio", a, b] => Ok(Self::MassRatio(a.into(), b.into())),
            _ => Err(format!("`{name}` is no quantity")),
        }
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Friction(object) => write!(f, "friction of `{object}`"),
            Self::StrikerRestitution(object) => write!(f, "restitution of `{object}` against the striker"),
            Self::Restitution(a, b) => write!(f, "restitution of `{a}/{b}`"),
            Self::MassRatio(a, b) => write!(f, "mass ratio `{a}/{b}`"),
        }
    }
}

impl Readings {
    /// The readings of a fitted clip; `values` and `covariance` hold the frictions of `frictions`' bodies, then time,
    /// restitution and logarithm of the mass ratio of each contact.
    pub(crate) fn new(
        fitted: &Fitted,
        contacts: &[Contact],
        frictions: &[usize],
        (values, covariance): (&[f64], &DMatrix<f64>),
    ) -> Self {
        let name = |k: usize| kind(&fitted.model.bodies[k].object).to_owned();
        // Where the value stands, what it is, and its sign: the ratio of b to a is the negative logarithm.
        let mut chosen: Vec<(usize, Key, f64)> = Vec::new();
        let mut presses: BTreeMap<usize, f64> = BTreeMap::new();
        let mut met_twice: BTreeSet<usize> = BTreeSet::new();
        for (n, &k) in frictions.iter().enumerate() {
            chosen.push((n, Key::Friction(name(k)), 1.0));
        }
        for (n, contact) in contacts.iter().enumerate() {
            let (restitution, ratio) = (frictions.len() + 3 * n + 1, frictions.len() + 3 * n + 2);
            let b = name(contact.b);
            if contact.met_twice {
                met_twice.insert(restitution);
            }
            match contact.a {
                Party::Striker if contact.restitution => {
                    chosen.push((restitution, Key::StrikerRestitution(b), 1.0));
                }
                Party::Body(a) => {
                    // Two copies: the struck one, which the clip names first, over the other.
                    let forward = name(a) < b || (name(a) == b && a < contact.b);
                    let (one, other) = if name(a) <= b { (name(a), b) } else { (b, name(a)) };
                    if contact.restitution {
                        chosen.push((restitution, Key::Restitution(one.clone(), other.clone()), 1.0));
                    }
                    if contact.mass_ratio {
                        chosen.push((ratio, Key::MassRatio(one, other), if forward { 1.0 } else { -1.0 }));
                        presses.insert(ratio, impulse_ratio::pressing(fitted, contact, a));
                    }
                }
                _ => {}
            }
        }
        chosen.retain(|(k, ..)| values[*k].is_finite() && covariance[(*k, *k)].is_finite());
        let size = chosen.len();
        Self {
            keys: chosen.iter().map(|c| c.1.clone()).collect(),
            pressing: chosen.iter().map(|c| presses.get(&c.0).copied().unwrap_or(0.0)).collect(),
            met_twice: chosen.iter().map(|c| met_twice.contains(&c.0)).collect(),
            values: DVector::from_fn(size, |r, _| chosen[r].2 * values[chosen[r].0]),
            covariance: DMatrix::from_fn(size, size, |r, c| {
                chosen[r].2 * chosen[c].2 * covariance[(chosen[r].0, chosen[c].0)]
            }),
        }
    }

    /// The readings of parts of a clip that were fitted each by itself.
    pub(crate) fn joined(parts: &[Self]) -> Self {
        let size = parts.iter().map(|p| p.keys.len()).sum();
        let mut covariance = DMatrix::zeros(size, size);
        let mut at = 0;
        for part in parts {
            let n = part.keys.len();
            covariance.view_mut((at, at), (n, n)).copy_from(&part.covariance);
            at += n;
        }
        Self {
            keys: parts.iter().flat_map(|p| p.keys.iter().cloned()).collect(),
            values: DVector::from_iterator(size, parts.iter().flat_map(|p| p.values.iter().copied())),
            covariance,
            pressing: parts.iter().flat_map(|p| p.pressing.iter().copied()).collect(),
            met_twice: parts.iter().flat_map(|p| p.met_twice.iter().copied()).collect(),
        }
    }

    /// Whether every key has a value and a row of covariance, all of them numbers.
    pub(crate) fn is_sound(&self) -> bool {
        let n = self.keys.len();
        let sizes = [self.values.len(), self.pressing.len(), self.met_twice.len()];
        sizes == [n; 3]
            && self.covariance.shape() == (n, n)
            && self.values.iter().chain(self.covariance.iter()).all(|v| v.is_finite())
    }

    /// One reading, with the deviation of its noise.
    pub(crate) fn measured(&self, k: usize) -> Measured {
        Measured { value: self.values[k], std: self.covariance[(k, k)].max(0.0).sqrt() }
    }

    /// The readings that `keep` keeps.
    pub(crate) fn retained(&self, keep: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.keys.len()).filter(|k| keep(*k)).collect();
        Self {
            keys: kept.iter().map(|&k| self.keys[k].clone()).collect(),
            pressing: kept.iter().map(|&k| self.pressing[k]).collect(),
            met_twice: kept.iter().map(|&k| self.met_twice[k]).collect(),
            values: self.values.select_rows(&kept),
            covariance: self.covariance.select_rows(&kept).select_columns(&kept),
        }
    }

    /// The readings after what all clips tell about friction: noise in it and in the others goes together.
    ///
    /// `expected` gives mean and spread of a friction, where known.
    pub(crate) fn given_friction(&self, expected: &BTreeMap<String, Measured>) -> Self {
        let known: Vec<(usize, Measured)> = (self.keys.iter().enumerate())
            .filter_map(|(k, key)| match key {
                Key::Friction(object) => expected.get(object).map(|m| (k, *m)),
                _ => None,
            })
            .collect();
        let others: Vec<usize> =
            (0..self.keys.len()).filter(|k| !matches!(self.keys[*k], Key::Friction(_))).collect();
        let size = known.len();
        let own = DMatrix::from_fn(size, size, |r, c| {
            let spread = if r == c { known[r].1.std.powi(2) } else { 0.0 };
            self.covariance[(known[r].0, known[c].0)] + spread
        });
        let Some(factor) = own.cholesky() else { return self.clone() };
        let cross = DMatrix::from_fn(others.len(), size, |r, c| self.covariance[(others[r], known[c].0)]);
        let surprise = DVector::from_fn(size, |r, _| self.values[known[r].0] - known[r].1.value);
        let gain = factor.solve(&cross.transpose()).transpose();
        let change = &gain * surprise;
        let less = &gain * cross.transpose();
        let mut updated = self.clone();
        for (r, &k) in others.iter().enumerate() {
            updated.values[k] -= change[r];
            for (c, &l) in others.iter().enumerate() {
                updated.covariance[(k, l)] -= less[(r, c)];
            }
        }
        updated
    }

    /// The mass ratios without what the table takes from the impulses, see [`impulse_ratio::pressing`].
    pub(crate) fn without_pressing(
        &self,
        frictions: &BTreeMap<String, Measured>,
        contact_friction: f64,
    ) -> Self {
        let mut corrected = self.clone();
        for (k, key) in self.keys.iter().enumerate() {
            if let Key::MassRatio(a, b) = key
                && let (Some(a), Some(b)) = (frictions.get(a), frictions.get(b))
            {
                corrected.values[k] -= self.pressing[k] * contact_friction * (a.value - b.value);
            }
        }
        corrected
    }
}

/// Restitutions of flat sides that met twice, only where nothing better tells of the pair, and as uncertain as they are.
pub(crate) fn poor_ones_last(clips: &[Readings]) -> Vec<Readings> {
    let mut single: BTreeSet<Key> = BTreeSet::new();
    let mut poor: BTreeMap<Key, f64> = BTreeMap::new();
    for readings in clips {
        for (key, twice) in readings.keys.iter().zip(&readings.met_twice) {
            if *twice {
                *poor.entry(key.clone()).or_default() += 1.0;
            } else {
                single.insert(key.clone());
            }
        }
    }
    clips
        .iter()
        .map(|readings| {
            let keep = |k: usize| !readings.met_twice[k] || !single.contains(&readings.keys[k]);
            let mut kept = readings.retained(keep);
            for k in 0..kept.keys.len() {
                if kept.met_twice[k] {
                    // Off alike in all clips: their number does not help.
                    kept.covariance[(k, k)] += poor[&kept.keys[k]] * MET_TWICE_STD.powi(2);
                }
            }
            kept
        })
        .collect()
}

/// All readings of each quantity: the clip, and the place in its readings.
pub(crate) fn grouped(clips: &[Readings]) -> BTreeMap<&Key, Vec<(usize, usize)>> {
    let mut places: BTreeMap<&Key, Vec<(usize, usize)>> = BTreeMap::new();
    for (clip, readings) in clips.iter().enumerate() {
        for (k, key) in readings.keys.iter().enumerate() {
            places.entry(key).or_default().push((clip, k));
        }
    }
    places
}
