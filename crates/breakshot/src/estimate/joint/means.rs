//! The means of all quantities over all clips, and their joint covariance.

use super::mass_network::{
    ASSUMED_FRICTION_DIFFERENCE, MassNetwork, SystematicErrors, systematic_covariance,
    variation_of_mass_ratios,
};
use super::random_effects::{
    BetweenClipStd, Group, Mean, between_clip_std_with_prior, groups_of_kind, quantile_95,
};
use super::sliding::tilt::Slope;
use crate::estimate::clip::result::Measured;
use crate::estimate::measure::impulse_ratio::vertical_impulse_std;
use crate::estimate::measure::measurements::{Measurements, grouped};
use crate::estimate::measure::quantity::{KINDS, Quantity};
use crate::ordered_map::map_of;
use crate::properties::{Covariance, PropertyGroup};
use crate::uncertain::Estimate;
use nalgebra::{DMatrix, DVector, Vector2};
use std::collections::BTreeMap;

/// The means of all quantities.
#[derive(Clone, Debug)]
pub(crate) struct JointMeans {
    pub(crate) groups: BTreeMap<Quantity, (Group, Mean)>,
    /// The logarithm of the mass ratio of every object that a chain of pairs connects with the reference.
    pub(crate) log_masses: BTreeMap<String, Mean>,
    pub(crate) covariance: Covariance,
}

impl JointMeans {
    /// The means over all clips; mass ratios refer to the object `reference`.  `slope` is the tilt for which the measurements are
    /// corrected.
    pub(crate) fn new(
        clips: &[Measurements],
        reference: &str,
        contact_friction: Measured,
        slope: Option<&Slope>,
    ) -> Self {
        // Means of every quantity by itself
        let indices = grouped(clips);
        let all = map_of(indices.iter().map(|(quantity, i)| (*quantity, Group::new(clips, quantity, i))));
        let typical = between_clip_stds(clips);
        let of_double_contacts = between_clip_std_of(clips, Quantity::RESTITUTION, |_| true);
        let mut groups = map_of(all.into_iter().filter_map(|(quantity, group)| {
            let is_double = |&(clip, k): &(usize, usize)| clips[clip].double_contact[k];
            let has_double = indices[quantity].iter().any(is_double);
            let typical = if has_double { of_double_contacts } else { typical[quantity.kind()] };
            let mean = group.mean(typical.for_group(&group))?;
            Some((quantity.clone(), (group, mean)))
        }));
        let frictions = map_of(groups.iter().filter_map(|(quantity, (_, mean))| match quantity {
            Quantity::Friction(object) => Some((object.clone(), mean.value)),
            _ => None,
        }));

        // Masses from all pairs, and the systematic errors that repetitions do not reduce
        let masses = MassNetwork::new(&groups, reference);
        let errors = SystematicErrors {
            pair_std: masses.pair_std,
            vertical_impulse_std: vertical_impulse_std(contact_friction),
        };
        let shifts = masses.common_shifts(&frictions, reference, errors.vertical_impulse_std);

        // Covariance
        let mut base = base_covariance(clips, &indices, &groups);
        if let Some(slope) = slope {
            add_slope_error(slope, clips, &indices, &mut groups, &mut base);
        }
        let quantities: Vec<&Quantity> = groups.keys().collect();
        let full = transformed_covariance(&quantities, &base, &masses, errors.pair_std, &shifts);
        let log_masses = masses.means(&full);
        let covariance = named_covariance(&quantities, &masses, &full);
        add_systematic_errors(&mut groups, &frictions, errors);
        Self { groups, log_masses, covariance }
    }
}

/// The typical standard deviation from clip to clip of every kind of quantity. Restitutions of double contacts, which are no single values, say
/// nothing about the others.
pub(crate) fn between_clip_stds(clips: &[Measurements]) -> [BetweenClipStd; KINDS] {
    let is_single = |&(clip, k): &(usize, usize)| !clips[clip].double_contact[k];
    std::array::from_fn(|kind| match kind {
        Quantity::MASS_RATIO => variation_of_mass_ratios(clips),
        _ => between_clip_std_of(clips, kind, is_single),
    })
}

/// The typical standard deviation from clip to clip of those values of one kind that count. Restitutions of several impacts in one clip, of which the later
/// ones are slow, are one value: how they differ is no variation of the other pairs.
fn between_clip_std_of(
    clips: &[Measurements],
    kind: usize,
    counts: impl Fn(&(usize, usize)) -> bool,
) -> BetweenClipStd {
    let groups = groups_of_kind(clips, kind).map(|(quantity, mut indices, _)| {
        indices.retain(&counts);
        let group = Group::new(clips, quantity, &indices);
        if kind == Quantity::RESTITUTION { group.with_one_value_per_clip(&indices) } else { group }
    });
    between_clip_std_with_prior(&groups.collect::<Vec<_>>())
}

/// Adds the error of the table's slope, which all clips have in common, to the means and their covariance.
fn add_slope_error(
    slope: &Slope,
    clips: &[Measurements],
    indices: &BTreeMap<&Quantity, Vec<(usize, usize)>>,
    groups: &mut BTreeMap<Quantity, (Group, Mean)>,
    base: &mut DMatrix<f64>,
) {
    let by_slope = |(quantity, (_, mean)): (&Quantity, &(Group, Mean))| {
        indices[quantity].iter().zip(&mean.weights).fold(Vector2::zeros(), |sum, (&(clip, k), weight)| {
            sum + Vector2::from(clips[clip].by_slope(k)) * *weight
        })
    };
    let by_slope: Vec<Vector2<f64>> = groups.iter().map(by_slope).collect();
    for (r, of_r) in by_slope.iter().enumerate() {
        for (c, of_c) in by_slope.iter().enumerate() {
            base[(r, c)] += (of_r.transpose() * slope.covariance * of_c)[(0, 0)];
        }
    }
    for (k, (_, mean)) in groups.values_mut().enumerate() {
        mean.standard_error = base[(k, k)].sqrt();
    }
}

/// Adds the errors that are equal in all clips of a pair to the standard errors of the pairs' mass ratios.
fn add_systematic_errors(
    groups: &mut BTreeMap<Quantity, (Group, Mean)>,
    frictions: &BTreeMap<String, f64>,
    errors: SystematicErrors,
) {
    for (quantity, (_, mean)) in groups {
        if let Quantity::MassRatio(a, b) = quantity {
            let difference = match (frictions.get(a), frictions.get(b)) {
                _ if a == b => 0.0,
                (Some(a), Some(b)) => a - b,
                _ => ASSUMED_FRICTION_DIFFERENCE,
            };
            let vertical = errors.vertical_impulse_std * difference;
            mean.standard_error = mean.standard_error.hypot(errors.pair_std).hypot(vertical);
        }
    }
}

/// The covariance of the means of all quantities: the noise of different quantities of one clip is correlated.
fn base_covariance(
    clips: &[Measurements],
    indices: &BTreeMap<&Quantity, Vec<(usize, usize)>>,
    groups: &BTreeMap<Quantity, (Group, Mean)>,
) -> DMatrix<f64> {
    let quantities: Vec<&Quantity> = groups.keys().collect();
    // For every quantity and clip: the index of each measurement, and its weight in the mean.
    let weights: Vec<BTreeMap<usize, Vec<(usize, f64)>>> = quantities
        .iter()
        .map(|quantity| {
            let mut by_clip: BTreeMap<usize, Vec<(usize, f64)>> = BTreeMap::new();
            for (&(clip, k), weight) in indices[*quantity].iter().zip(&groups[*quantity].1.weights) {
                by_clip.entry(clip).or_default().push((k, *weight));
            }
            by_clip
        })
        .collect();
    DMatrix::from_fn(quantities.len(), quantities.len(), |r, c| {
        let (mean_r, mean_c) = (&groups[quantities[r]].1, &groups[quantities[c]].1);
        if r == c {
            return mean_r.standard_error.powi(2);
        }
        let mut sum = 0.0;
        for (clip, of_r) in &weights[r] {
            for &(k, weight_r) in of_r {
                for &(l, weight_c) in weights[c].get(clip).into_iter().flatten() {
                    sum += weight_r * weight_c * clips[*clip].covariance[(k, l)];
                }
            }
        }
        sum * (mean_r.dispersion * mean_c.dispersion).sqrt()
    })
}

/// Indices of the quantities that appear in the result as they are: all but the mass ratios of pairs.
fn direct(quantities: &[&Quantity]) -> Vec<usize> {
    (0..quantities.len()).filter(|&k| !matches!(quantities[k], Quantity::MassRatio(..))).collect()
}

/// The covariance of the result: frictions and restitutions directly, then the logarithms of the masses, which are linear
/// functions of those of the pairs.
///
/// `base` is the covariance of all quantities, `pair_std` the additional error of every pair, `shifts` the common error of
/// all masses.
fn transformed_covariance(
    quantities: &[&Quantity],
    base: &DMatrix<f64>,
    masses: &MassNetwork,
    pair_std: f64,
    shifts: &[f64],
) -> DMatrix<f64> {
    let direct = direct(quantities);
    let size = direct.len() + masses.objects.len();
    let column = |pair: &Quantity| quantities.iter().position(|q| *q == pair);
    let columns: Vec<usize> = masses.pairs.iter().filter_map(column).collect();
    let mut widened = base.clone();
    for &pair in &columns {
        for &other in &columns {
            widened[(pair, other)] += systematic_covariance(quantities[pair], quantities[other], pair_std);
        }
    }
    let mut transform = DMatrix::zeros(size, quantities.len());
    for (row, &k) in direct.iter().enumerate() {
        transform[(row, k)] = 1.0;
    }
    for (row, _) in masses.objects.iter().enumerate() {
        for (from, &pair) in columns.iter().enumerate() {
            transform[(direct.len() + row, pair)] = masses.from_pairs[(row, from)];
        }
    }
    let mut common = DVector::zeros(size);
    for (row, shift) in shifts.iter().enumerate() {
        common[direct.len() + row] = *shift;
    }
    &transform * widened * transform.transpose() + &common * common.transpose()
}

/// The covariance with the names of its rows.
fn named_covariance(quantities: &[&Quantity], masses: &MassNetwork, full: &DMatrix<f64>) -> Covariance {
    let size = full.nrows();
    let direct = direct(quantities).into_iter().map(|k| quantities[k].name());
    let objects = masses.objects.iter().map(|o| PropertyGroup::MassRatio.covariance_name(o));
    let matrix = (0..size).map(|r| (0..size).map(|c| full[(r, c)]).collect()).collect();
    Covariance { names: direct.chain(objects).collect(), matrix }
}

/// The estimate of the exponential of a mean, for example of a mass ratio from its logarithm.
///
/// `std` is the standard deviation of the logarithm from clip to clip; `n` the number of clips.
pub(crate) fn exponential(mean: &Mean, std: Option<f64>, n: usize) -> Estimate {
    let (value, half) = (mean.value.exp(), quantile_95(mean.degrees_of_freedom) * mean.standard_error);
    Estimate {
        mean: value,
        std: std.map(|s| s * value),
        standard_error: mean.standard_error * value,
        interval_95: [value * (-half).exp(), value * half.exp()],
        n,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A clip that measures one restitution with a standard deviation of 0.01.
    fn clip([a, b]: [&str; 2], restitution: f64, is_double: bool) -> Measurements {
        Measurements {
            quantities: vec![Quantity::Restitution(a.into(), b.into())],
            values: DVector::from_vec(vec![restitution]),
            covariance: DMatrix::from_vec(1, 1, vec![1e-4]),
            vertical_fractions: vec![0.0],
            double_contact: vec![is_double],
            by_slope: Vec::new(),
        }
    }

    #[test]
    fn impacts_of_one_clip_that_contradict_each_other_do_not_widen_other_restitutions() {
        let of_pair = |values: &[f64]| {
            let repeated = values.iter().map(|value| clip(["a", "b"], *value, false));
            let repeated = Measurements {
                quantities: repeated.clone().flat_map(|m| m.quantities).collect(),
                values: DVector::from_row_slice(values),
                covariance: DMatrix::identity(values.len(), values.len()) * 1e-4,
                vertical_fractions: vec![0.0; values.len()],
                double_contact: vec![false; values.len()],
                by_slope: Vec::new(),
            };
            let clips = [repeated, clip(["a", "c"], 0.65, false)];
            let joint = JointMeans::new(&clips, "a", Measured { value: 0.15, std: 0.05 }, None);
            let half = |b: &str| joint.groups[&Quantity::Restitution("a".into(), b.into())].1.half_width();
            [half("b"), half("c")]
        };
        let ([_, alone], [repeated, other]) = (of_pair(&[0.4]), of_pair(&[0.4, 0.47, 0.72]));
        assert_eq!(other, alone);
        assert!(repeated > 0.1, "{repeated}");
    }

    #[test]
    fn double_contacts_that_contradict_each_other_do_not_widen_other_restitutions() {
        let others =
            [clip(["a", "b"], 0.61, false), clip(["a", "b"], 0.612, false), clip(["b", "d"], 0.7, false)];
        let of_pair = |clips: &[Measurements], a: &str, b: &str| {
            let joint = JointMeans::new(clips, "a", Measured { value: 0.15, std: 0.05 }, None);
            joint.groups[&Quantity::Restitution(a.into(), b.into())].1.half_width()
        };
        let doubles = [clip(["a", "c"], 0.63, true), clip(["a", "c"], 1.06, true)];
        let all = [others.as_slice(), &doubles].concat();
        assert_eq!(of_pair(&all, "b", "d"), of_pair(&others, "b", "d"));
        let of_doubles = of_pair(&all, "a", "c");
        assert!(of_doubles > 0.3, "{of_doubles}");
    }
}
