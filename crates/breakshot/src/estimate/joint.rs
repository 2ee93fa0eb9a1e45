//! All clips at once: means over clips, masses that agree around every loop of pairs, and how their errors go together.

use super::impact::Measured;
use super::spread::{Group, Mean, Spread, quantile_95, spread};
use crate::properties::Covariance;
use crate::uncertain::Estimate;
use nalgebra::{DMatrix, DVector};
use std::collections::{BTreeMap, BTreeSet};

/// What a reading is a reading of.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Key {
    Friction(String),
    StrikerRestitution(String),
    /// Names in alphabetical order.
    Restitution(String, String),
    /// Logarithm of the mass of the first over the second, in alphabetical order.
    MassRatio(String, String),
}

/// What one clip tells: values and the covariance of their noise.
#[derive(Clone, Debug)]
pub(super) struct Readings {
    pub(super) keys: Vec<Key>,
    pub(super) values: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
}

/// The means of all quantities.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    pub(super) groups: BTreeMap<Key, (Group, Mean)>,
    /// The logarithm of every object's mass over the reference's, where pairs connect them.
    pub(super) log_masses: BTreeMap<String, Mean>,
    pub(super) covariance: Covariance,
}

impl Key {
    /// Its name in the covariance.
    fn name(&self) -> String {
        match self {
            Self::Friction(object) => format!("friction/{object}"),
            Self::StrikerRestitution(object) => format!("striker_restitution/{object}"),
            Self::Restitution(a, b) => format!("restitution/{a}/{b}"),
            Self::MassRatio(a, b) => format!("log_pair_mass_ratio/{a}/{b}"),
        }
    }

    fn kind(&self) -> usize {
        match self {
            Self::Friction(_) => 0,
            Self::StrikerRestitution(_) => 1,
            Self::Restitution(..) => 2,
            Self::MassRatio(..) => 3,
        }
    }
}

impl Readings {
    /// The readings after what all clips tell about friction: noise in it and in the others goes together.
    ///
    /// `expected` gives mean and spread of a friction, where known.
    pub(super) fn given_friction(&self, expected: &BTreeMap<String, Measured>) -> Self {
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
}

/// All values of each quantity, with the clip and the place in its readings.
fn grouped(clips: &[Readings]) -> BTreeMap<&Key, Vec<(usize, usize)>> {
    let mut places: BTreeMap<&Key, Vec<(usize, usize)>> = BTreeMap::new();
    for (clip, readings) in clips.iter().enumerate() {
        for (k, key) in readings.keys.iter().enumerate() {
            places.entry(key).or_default().push((clip, k));
        }
    }
    places
}

fn measured(clips: &[Readings], (clip, k): (usize, usize)) -> Measured {
    Measured { value: clips[clip].values[k], std: clips[clip].covariance[(k, k)].max(0.0).sqrt() }
}

fn group(clips: &[Readings], key: &Key, places: &[(usize, usize)]) -> Group {
    let values: Vec<Measured> = places.iter().map(|&p| measured(clips, p)).collect();
    let scale = match key {
        // Masses do not vary, and a logarithm is relative as it is.
        Key::MassRatio(..) => 1.0,
        _ => super::segment::median(values.iter().map(|m| m.value.abs())).max(1e-3),
    };
    Group { values, scale }
}

/// Mean and spread of the friction of every object that enough clips show.
pub(super) fn expected_frictions(clips: &[Readings]) -> BTreeMap<String, Measured> {
    let places = grouped(clips);
    let groups: Vec<(&String, Group)> = (places.iter())
        .filter_map(|(key, places)| match key {
            Key::Friction(object) => Some((object, group(clips, key, places))),
            _ => None,
        })
        .collect();
    let typical = spread(&groups.iter().map(|(_, g)| g.clone()).collect::<Vec<_>>());
    groups
        .iter()
        .filter(|(_, group)| group.values.len() >= 3)
        .filter_map(|(object, group)| {
            let mean = group.mean(typical)?;
            let spread = typical.relative * group.scale * mean.dispersion.sqrt();
            Some(((*object).clone(), Measured { value: mean.value, std: spread.hypot(mean.standard_error) }))
        })
        .collect()
}

impl Joint {
    /// The means over all clips, with the object whose mass is the unit.
    pub(super) fn new(clips: &[Readings], reference: &str) -> Self {
        let places = grouped(clips);
        let all: BTreeMap<&Key, Group> = places.iter().map(|(key, p)| (*key, group(clips, key, p))).collect();
        let mut typical = [Spread { relative: 0.0, freedom: 0.0 }; 4];
        for (kind, typical) in typical.iter_mut().enumerate() {
            let alike: Vec<Group> =
                all.iter().filter(|(k, _)| k.kind() == kind).map(|(_, g)| g.clone()).collect();
            *typical = spread(&alike);
        }
        let groups: BTreeMap<Key, (Group, Mean)> = all
            .into_iter()
            .filter_map(|(key, group)| {
                let mean = group.mean(typical[key.kind()])?;
                Some((key.clone(), (group, mean)))
            })
            .collect();
        let keys: Vec<&Key> = groups.keys().collect();
        let base = base_covariance(clips, &places, &groups);
        let masses = Masses::new(&groups, reference);
        let covariance = covariance(&keys, &base, &masses);
        let log_masses = masses.means(&base, &keys);
        Self { groups, log_masses, covariance }
    }
}

/// The covariance of all means: within a clip the noise of different quantities goes together.
fn base_covariance(
    clips: &[Readings],
    places: &BTreeMap<&Key, Vec<(usize, usize)>>,
    groups: &BTreeMap<Key, (Group, Mean)>,
) -> DMatrix<f64> {
    let keys: Vec<&Key> = groups.keys().collect();
    let shares: Vec<BTreeMap<usize, Vec<(usize, f64)>>> = keys
        .iter()
        .map(|key| {
            let mut by_clip: BTreeMap<usize, Vec<(usize, f64)>> = BTreeMap::new();
            for (&(clip, k), share) in places[*key].iter().zip(&groups[*key].1.shares) {
                by_clip.entry(clip).or_default().push((k, *share));
            }
            by_clip
        })
        .collect();
    DMatrix::from_fn(keys.len(), keys.len(), |r, c| {
        let (mean_r, mean_c) = (&groups[keys[r]].1, &groups[keys[c]].1);
        if r == c {
            return mean_r.standard_error.powi(2);
        }
        let mut sum = 0.0;
        for (clip, mine) in &shares[r] {
            for &(k, share) in mine {
                for &(l, other) in shares[c].get(clip).into_iter().flatten() {
                    sum += share * other * clips[*clip].covariance[(k, l)];
                }
            }
        }
        sum * (mean_r.dispersion * mean_c.dispersion).sqrt()
    })
}

/// The logarithms of the masses as a linear function of those of the pairs' ratios.
struct Masses {
    objects: Vec<String>,
    pairs: Vec<Key>,
    /// One row per object, one column per pair.
    from_pairs: DMatrix<f64>,
    values: DVector<f64>,
    /// How much the loops disagree, in variances, and the degrees of freedom.
    dispersion: f64,
    freedom: f64,
}

impl Masses {
    /// Weighted least squares on the logarithms; objects that no chain of pairs connects with the reference are left out.
    fn new(groups: &BTreeMap<Key, (Group, Mean)>, reference: &str) -> Self {
        let pairs: Vec<(&Key, &str, &str, &Mean)> = groups
            .iter()
            .filter_map(|(key, (_, mean))| match key {
                Key::MassRatio(a, b) if a != b => Some((key, a.as_str(), b.as_str(), mean)),
                _ => None,
            })
            .collect();
        let links: Vec<(&str, &str)> = pairs.iter().map(|p| (p.1, p.2)).collect();
        let objects: Vec<String> =
            connected(reference, &links).into_iter().filter(|o| o != reference).collect();
        let column = |name: &str| objects.iter().position(|o| o == name);
        let known = |name: &str| name == reference || column(name).is_some();
        let pairs: Vec<_> = pairs.into_iter().filter(|(_, a, b, _)| known(a) && known(b)).collect();
        let mut design = DMatrix::zeros(pairs.len(), objects.len());
        for (row, (_, a, b, _)) in pairs.iter().enumerate() {
            if let Some(c) = column(a) {
                design[(row, c)] = 1.0;
            }
            if let Some(c) = column(b) {
                design[(row, c)] = -1.0;
            }
        }
        let weights =
            DVector::from_iterator(pairs.len(), pairs.iter().map(|p| p.3.standard_error.max(1e-9).powi(-2)));
        let ratios = DVector::from_iterator(pairs.len(), pairs.iter().map(|p| p.3.value));
        let weighted = DMatrix::from_fn(pairs.len(), objects.len(), |r, c| weights[r] * design[(r, c)]);
        let normal = design.tr_mul(&weighted);
        let inverse =
            normal.cholesky().map_or_else(|| DMatrix::zeros(objects.len(), objects.len()), |f| f.inverse());
        let from_pairs = inverse * weighted.transpose();
        let values = &from_pairs * &ratios;
        let misfit = &ratios - &design * &values;
        let squares: f64 = misfit.iter().zip(weights.iter()).map(|(m, w)| w * m * m).sum();
        let loops = pairs.len() as f64 - objects.len() as f64;
        let clips: f64 = pairs.iter().map(|p| p.3.freedom).sum();
        let pairs = pairs.into_iter().map(|p| p.0.clone()).collect();
        // Loops that do not close widen the masses; that they close by luck does not narrow them.
        let dispersion = if loops > 0.0 { (squares / loops).max(1.0) } else { 1.0 };
        Self { objects, pairs, from_pairs, values, dispersion, freedom: clips }
    }

    fn means(&self, base: &DMatrix<f64>, keys: &[&Key]) -> BTreeMap<String, Mean> {
        let selected = self.selected(keys);
        let covariance = &selected * base * selected.transpose();
        (self.objects.iter().enumerate())
            .map(|(k, object)| {
                let standard_error = (covariance[(k, k)] * self.dispersion).max(0.0).sqrt();
                let mean = Mean {
                    value: self.values[k],
                    standard_error,
                    freedom: self.freedom,
                    shares: Vec::new(),
                    dispersion: self.dispersion,
                };
                (object.clone(), mean)
            })
            .collect()
    }

    /// The same linear function, of all means.
    fn selected(&self, keys: &[&Key]) -> DMatrix<f64> {
        let mut selected = DMatrix::zeros(self.objects.len(), keys.len());
        for (column, pair) in self.pairs.iter().enumerate() {
            if let Some(place) = keys.iter().position(|k| *k == pair) {
                selected.column_mut(place).copy_from(&self.from_pairs.column(column));
            }
        }
        selected
    }
}

/// All that a chain of pairs connects with `start`.
fn connected(start: &str, pairs: &[(&str, &str)]) -> BTreeSet<String> {
    let mut reached = BTreeSet::from([start.to_owned()]);
    loop {
        let before = reached.len();
        for &(a, b) in pairs {
            if reached.contains(a) || reached.contains(b) {
                reached.insert(a.to_owned());
                reached.insert(b.to_owned());
            }
        }
        if reached.len() == before {
            return reached;
        }
    }
}

/// The named covariance: frictions and restitutions as they are, masses from their pairs.
fn covariance(keys: &[&Key], base: &DMatrix<f64>, masses: &Masses) -> Covariance {
    let kept: Vec<usize> = (0..keys.len()).filter(|&k| !matches!(keys[k], Key::MassRatio(..))).collect();
    let size = kept.len() + masses.objects.len();
    let mut transform = DMatrix::zeros(size, keys.len());
    for (row, &k) in kept.iter().enumerate() {
        transform[(row, k)] = 1.0;
    }
    let selected = masses.selected(keys) * masses.dispersion.sqrt();
    for row in 0..masses.objects.len() {
        transform.row_mut(kept.len() + row).copy_from(&selected.row(row));
    }
    let full = &transform * base * transform.transpose();
    let names = kept.iter().map(|&k| keys[k].name());
    let masses = masses.objects.iter().map(|o| format!("log_mass_ratio/{o}"));
    Covariance {
        names: names.chain(masses).collect(),
        matrix: (0..size).map(|r| (0..size).map(|c| full[(r, c)]).collect()).collect(),
    }
}

/// The estimate of `exp` of a mean.
pub(super) fn exponential(mean: &Mean, std: Option<f64>, n: usize) -> Estimate {
    let (value, half) = (mean.value.exp(), quantile_95(mean.freedom) * mean.standard_error);
    Estimate {
        mean: value,
        std: std.map(|s| s * value),
        standard_error: mean.standard_error * value,
        interval_95: [value * (-half).exp(), value * half.exp()],
        n,
    }
}
