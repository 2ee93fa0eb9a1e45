//! All clips at once: means over clips, masses that agree around every loop of pairs, and how their errors go together.

pub(crate) mod clip_values;
pub(crate) mod contact_friction;
pub(crate) mod friction;
pub(crate) mod mass_network;
pub(crate) mod outliers;
pub(crate) mod properties;
pub(crate) mod random_effects;
pub(crate) mod record;
#[cfg(test)]
pub(crate) mod update_tests;

use crate::estimate::clip::result::Measured;
use crate::estimate::measure::impulse_ratio::vertical_impulse_std;
use crate::estimate::measure::measurements::{Measurements, grouped};
use crate::estimate::measure::quantity::{KINDS, Quantity};
use crate::properties::Covariance;
use crate::uncertain::Estimate;
use mass_network::Masses;
use nalgebra::{DMatrix, DVector};
use random_effects::{Group, Mean, Spread, guessed_spread, quantile_95, spread};
use std::collections::BTreeMap;

/// The means of all quantities.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) groups: BTreeMap<Quantity, (Group, Mean)>,
    /// The logarithm of every object's mass over the reference's, where pairs connect them.
    pub(crate) log_masses: BTreeMap<String, Mean>,
    pub(crate) covariance: Covariance,
}

/// Bodies rock after an impact, and exchange impulse with the table within it: every pair's mass ratio is off by about
/// this part, whatever its clips agree on.
const ROCKING_STD: f64 = 0.005;

impl Joint {
    /// The means over all clips, with the object whose mass is the unit.
    pub(crate) fn new(clips: &[Measurements], reference: &str, contact_friction: Measured) -> Self {
        let places = grouped(clips);
        let all: BTreeMap<&Quantity, Group> =
            places.iter().map(|(key, p)| (*key, Group::of(clips, key, p))).collect();
        let mut typical = [Spread { relative: 0.0, freedom: 0.0 }; KINDS];
        for (kind, typical) in typical.iter_mut().enumerate() {
            let alike: Vec<Group> =
                all.iter().filter(|(k, _)| k.kind() == kind).map(|(_, g)| g.clone()).collect();
            // A mass is the same in all clips.
            *typical = if kind == Quantity::MASS_RATIO { spread(&alike) } else { guessed_spread(&alike) };
        }
        let mut groups: BTreeMap<Quantity, (Group, Mean)> = all
            .into_iter()
            .filter_map(|(key, group)| {
                let mean = group.mean(typical[key.kind()])?;
                Some((key.clone(), (group, mean)))
            })
            .collect();
        let frictions: BTreeMap<String, f64> = (groups.iter())
            .filter_map(|(key, (_, mean))| match key {
                Quantity::Friction(object) => Some((object.clone(), mean.value)),
                _ => None,
            })
            .collect();
        let mut masses = Masses::new(&groups, reference);
        let misfit = masses.misfit.max(ROCKING_STD);
        let pressing = vertical_impulse_std(contact_friction);
        let base = base_covariance(clips, &places, &groups);
        // What is common to all pairs shifts the masses as the frictions differ; loops of pairs do not show it.
        let shift = |object: &str| {
            let friction = |name: &str| frictions.get(name).copied();
            Some(pressing * (friction(object)? - friction(reference)?))
        };
        masses.shifts =
            masses.objects.iter().map(|o| shift(o).unwrap_or(pressing * ASSUMED_DIFFERENCE)).collect();
        masses.misfit = misfit;
        let keys: Vec<&Quantity> = groups.keys().collect();
        let (covariance, log_masses) = covariance(&keys, &base, &masses);
        widen_pairs(&mut groups, &frictions, misfit, pressing);
        Self { groups, log_masses, covariance }
    }
}

/// By how much the frictions of two objects differ if nobody knows.
const ASSUMED_DIFFERENCE: f64 = 0.1;

/// What a pair's own clips cannot tell widens its interval too.
fn widen_pairs(
    groups: &mut BTreeMap<Quantity, (Group, Mean)>,
    frictions: &BTreeMap<String, f64>,
    misfit: f64,
    pressing: f64,
) {
    for (key, (_, mean)) in groups {
        if let Quantity::MassRatio(a, b) = key
            && a != b
        {
            let difference = match (frictions.get(a), frictions.get(b)) {
                (Some(a), Some(b)) => a - b,
                _ => ASSUMED_DIFFERENCE,
            };
            mean.standard_error = mean.standard_error.hypot(misfit).hypot(pressing * difference);
        }
    }
}

/// The covariance of all means: within a clip the noise of different quantities goes together.
fn base_covariance(
    clips: &[Measurements],
    places: &BTreeMap<&Quantity, Vec<(usize, usize)>>,
    groups: &BTreeMap<Quantity, (Group, Mean)>,
) -> DMatrix<f64> {
    let keys: Vec<&Quantity> = groups.keys().collect();
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

/// The named covariance, frictions and restitutions as they are, masses from their pairs; and the masses' means.
fn covariance(
    keys: &[&Quantity],
    base: &DMatrix<f64>,
    masses: &Masses,
) -> (Covariance, BTreeMap<String, Mean>) {
    let kept: Vec<usize> = (0..keys.len()).filter(|&k| !matches!(keys[k], Quantity::MassRatio(..))).collect();
    let size = kept.len() + masses.objects.len();
    let column = |pair: &Quantity| keys.iter().position(|k| *k == pair);
    let columns: Vec<usize> = masses.pairs.iter().filter_map(column).collect();
    let mut widened = base.clone();
    for &pair in &columns {
        widened[(pair, pair)] += masses.misfit * masses.misfit;
    }
    let mut transform = DMatrix::zeros(size, keys.len());
    for (row, &k) in kept.iter().enumerate() {
        transform[(row, k)] = 1.0;
    }
    for (row, _) in masses.objects.iter().enumerate() {
        for (from, &pair) in columns.iter().enumerate() {
            transform[(kept.len() + row, pair)] = masses.from_pairs[(row, from)];
        }
    }
    let mut shifts = DVector::zeros(size);
    for (row, shift) in masses.shifts.iter().enumerate() {
        shifts[kept.len() + row] = *shift;
    }
    let full = &transform * widened * transform.transpose() + &shifts * shifts.transpose();
    let means = masses.objects.iter().enumerate().map(|(k, object)| {
        let place = kept.len() + k;
        let mean = Mean {
            value: masses.values[k],
            standard_error: full[(place, place)].max(0.0).sqrt(),
            freedom: masses.freedom,
            shares: Vec::new(),
            dispersion: 1.0,
        };
        (object.clone(), mean)
    });
    let log_masses = means.collect();
    let names = kept.iter().map(|&k| keys[k].name());
    let objects = masses.objects.iter().map(|o| format!("log_mass_ratio/{o}"));
    let matrix = (0..size).map(|r| (0..size).map(|c| full[(r, c)]).collect()).collect();
    (Covariance { names: names.chain(objects).collect(), matrix }, log_masses)
}

/// The estimate of `exp` of a mean.
pub(crate) fn exponential(mean: &Mean, std: Option<f64>, n: usize) -> Estimate {
    let (value, half) = (mean.value.exp(), quantile_95(mean.freedom) * mean.standard_error);
    Estimate {
        mean: value,
        std: std.map(|s| s * value),
        standard_error: mean.standard_error * value,
        interval_95: [value * (-half).exp(), value * half.exp()],
        n,
    }
}
