//! The mean of repeated measurements that vary more than their noise explains: a random-effects model.
//!
//! A clip's value is the mean plus a variation from clip to clip plus noise of known variance.  The relative variation is
//! estimated from all groups of one kind together (the frictions of all objects, the restitutions of all pairs) by
//! restricted maximum likelihood (Harville 1977), and serves as a prior for groups with few clips (empirical Bayes).

use crate::estimate::clip::result::Measured;
use crate::estimate::measure::measurements::{Measurements, grouped};
use crate::estimate::measure::quantity::Quantity;
use crate::statistics::median;
use crate::uncertain::{Estimate, student_t_95};
use std::collections::{BTreeMap, BTreeSet};

/// The typical variation from clip to clip of the groups of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BetweenClipStd {
    /// Standard deviation from clip to clip over the scale of a group.
    pub(crate) relative: f64,
    /// Prior degrees of freedom: the number of repeats of one group that carry as much information as this pooled variance.
    pub(crate) degrees_of_freedom: f64,
}

impl BetweenClipStd {
    /// The same for a group with several values of one clip, where no other clips repeat: the variance of its values is known as well as that of two
    /// groups.
    pub(crate) fn for_group(self, group: &Group) -> Self {
        let is_unknown = self.degrees_of_freedom == 0.0 && group.values.len() > group.clips;
        if is_unknown { Self { degrees_of_freedom: ASSUMED_DEGREES_OF_FREEDOM, ..self } } else { self }
    }
}

/// Repeated measurements of one quantity.
#[derive(Clone, Debug, Default)]
pub(crate) struct Group {
    pub(crate) values: Vec<Measured>,
    /// Number of clips that the values come from.
    pub(crate) clips: usize,
    /// The value to which relative standard deviations refer.
    pub(crate) scale: f64,
}

/// Every quantity of one [kind](Quantity::kind): indices of the clip and within its measurements of its values, and their group.
pub(crate) fn groups_of_kind(
    clips: &[Measurements],
    kind: usize,
) -> impl Iterator<Item = (&Quantity, Vec<(usize, usize)>, Group)> {
    let of_kind = grouped(clips).into_iter().filter(move |(quantity, _)| quantity.kind() == kind);
    of_kind.map(|(quantity, indices)| {
        let group = Group::new(clips, quantity, &indices);
        (quantity, indices, group)
    })
}

/// The mean of a group.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mean {
    pub(crate) value: f64,
    pub(crate) standard_error: f64,
    pub(crate) degrees_of_freedom: f64,
    /// The weight of each value; the sum is 1.
    pub(crate) weights: Vec<f64>,
    /// Variance of the values over the variance that noise and variation from clip to clip explain.
    pub(crate) dispersion: f64,
}

/// Largest prior degrees of freedom, because the variances of real groups are never all equal.
const MAX_DEGREES_OF_FREEDOM: f64 = 12.0;
/// Prior degrees of freedom where too few groups repeat to compare their variances: the standard deviations of two groups
/// differ by about a factor of 1.5.
const ASSUMED_DEGREES_OF_FREEDOM: f64 = 6.0;
/// Upper end of the search for the relative standard deviation, ...
const MAX_RELATIVE_STD: f64 = 1.0;
/// ... the number of its steps, each by this factor, and that of its refinements by two thirds.
const STEPS: f64 = 48.0;
const STEP: f64 = 1.25;
const REFINEMENTS: usize = 60;
/// Number of groups that the assumed prior degrees of freedom are worth: the variances of three or four groups seem to differ or to agree by chance.
const ASSUMED_GROUPS: f64 = 4.0;
/// From this number of groups the most deviating one is left out of the comparison of their variances.
const MANY_GROUPS: usize = 6;
/// Values of a group that are further apart than this (standard deviations, root mean square) contradict each other, ...
const CONTRADICTING_STDS: f64 = 6.0;
/// ... if at least this many repeats of the other groups show the variation from clip to clip.
const SHOWING_REPEATS: f64 = 2.0;
/// Smallest scale, for quantities near zero.
const MIN_SCALE: f64 = 1e-3;

impl Group {
    /// The measurements of one quantity, given by indices of the clip and within its measurements.
    pub(crate) fn new(clips: &[Measurements], quantity: &Quantity, indices: &[(usize, usize)]) -> Self {
        let values: Vec<Measured> = indices.iter().map(|&(clip, k)| clips[clip].measured(k)).collect();
        let scale = match quantity {
            // A difference of logarithms is relative already.
            Quantity::MassRatio(..) => 1.0,
            _ => median(values.iter().map(|m| m.value.abs())).unwrap_or(0.0).max(MIN_SCALE),
        };
        let clips = indices.iter().map(|(clip, _)| clip).collect::<BTreeSet<_>>().len();
        Self { values, clips, scale }
    }

    /// The same with the mean of the values of each clip in their place, given the indices of the clips and within their measurements.
    pub(crate) fn with_one_value_per_clip(&self, indices: &[(usize, usize)]) -> Self {
        let mut of_clips: BTreeMap<usize, Vec<Measured>> = BTreeMap::new();
        for (&(clip, _), value) in indices.iter().zip(&self.values) {
            of_clips.entry(clip).or_default().push(*value);
        }
        let mean = |values: Vec<Measured>| {
            let of_clip = Self { values, ..Self::default() };
            let total: f64 = of_clip.weights(0.0).iter().sum();
            Measured { value: of_clip.moments(0.0).0, std: total.powf(-0.5) }
        };
        Self { values: of_clips.into_values().map(mean).collect(), ..self.clone() }
    }

    /// Inverse variances of the values: noise plus a relative standard deviation from clip to clip.
    pub(super) fn weights(&self, relative: f64) -> Vec<f64> {
        let between = relative * self.scale;
        self.values.iter().map(|m| 1.0 / (m.std * m.std + between * between).max(f64::MIN_POSITIVE)).collect()
    }

    /// The weighted mean, and the weighted sum of squares about it.
    fn moments(&self, relative: f64) -> (f64, f64) {
        let weights = self.weights(relative);
        let total: f64 = weights.iter().sum();
        let mean = self.values.iter().zip(&weights).map(|(m, w)| m.value * w).sum::<f64>() / total;
        (mean, self.values.iter().zip(&weights).map(|(m, w)| w * (m.value - mean).powi(2)).sum())
    }

    fn degrees_of_freedom(&self) -> f64 {
        self.values.len().saturating_sub(1) as f64
    }

    /// The mean, weighted by the inverse variances; `None` without values.
    ///
    /// The standard error contains the dispersion, which is drawn towards 1 by the prior degrees of freedom.
    pub(crate) fn mean(&self, between: BetweenClipStd) -> Option<Mean> {
        if self.values.is_empty() {
            return None;
        }
        let (value, squares) = self.moments(between.relative);
        let degrees_of_freedom = between.degrees_of_freedom + self.degrees_of_freedom();
        let dispersion = if degrees_of_freedom > 0.0 {
            (between.degrees_of_freedom + squares) / degrees_of_freedom
        } else {
            1.0
        };
        let weights = self.weights(between.relative);
        let total: f64 = weights.iter().sum();
        let standard_error = (dispersion / total).sqrt();
        let weights = weights.iter().map(|w| w / total).collect();
        Some(Mean { value, standard_error, degrees_of_freedom, weights, dispersion })
    }
}

impl Mean {
    /// Half the width of the 95 % interval.
    pub(crate) fn half_width(&self) -> f64 {
        quantile_95(self.degrees_of_freedom) * self.standard_error
    }

    /// The standard deviation of the values with the weights of the mean; `None` for a single value.
    pub(crate) fn std(&self, group: &Group) -> Option<f64> {
        let squares: f64 =
            group.values.iter().zip(&self.weights).map(|(m, w)| w * (m.value - self.value).powi(2)).sum();
        let squared_weights: f64 = self.weights.iter().map(|w| w * w).sum();
        (group.values.len() > 1).then(|| (squares / (1.0 - squared_weights).max(f64::MIN_POSITIVE)).sqrt())
    }

    /// The mean with its 95 % interval.
    pub(crate) fn estimate(&self, group: &Group) -> Estimate {
        let half = self.half_width();
        Estimate {
            mean: self.value,
            std: self.std(group),
            standard_error: self.standard_error,
            interval_95: [self.value - half, self.value + half],
            n: group.clips,
        }
    }
}

/// Two-sided 95 % quantile of Student's t distribution, between whole degrees of freedom interpolated over their inverse; that of the normal
/// distribution below one degree of freedom.
pub(crate) fn quantile_95(degrees_of_freedom: f64) -> f64 {
    const NORMAL: f64 = 1.96;
    if degrees_of_freedom < 1.0 {
        return NORMAL;
    }
    let fewer = degrees_of_freedom.floor();
    let [wide, narrow] = [fewer, fewer + 1.0].map(|degrees| student_t_95(degrees as usize));
    let part = (1.0 - fewer / degrees_of_freedom) * (fewer + 1.0);
    wide + part * (narrow - wide)
}

/// The typical variation from clip to clip by [restricted maximum likelihood](most_likely_std). A group whose values contradict each other says nothing about the others; its own
/// dispersion widens its interval.
pub(crate) fn between_clip_std(groups: &[Group]) -> BetweenClipStd {
    let mut groups = groups.to_vec();
    while let Some(contradicting) = most_contradicting(&groups) {
        groups.remove(contradicting);
    }
    typical(&groups)
}

/// The group whose values deviate the most from each other, if they do by more than [`CONTRADICTING_STDS`] with the variation of the other
/// groups.
fn most_contradicting(groups: &[Group]) -> Option<usize> {
    let deviation_stds = |k: usize| {
        let others: Vec<Group> = [&groups[..k], &groups[k + 1..]].concat();
        let repeats = repeats(&others);
        if repeats < SHOWING_REPEATS || groups[k].values.len() < 2 {
            return 0.0;
        }
        let relative = with_prior(most_likely_std(&others), repeats);
        (groups[k].squares(relative) / groups[k].degrees_of_freedom()).sqrt()
    };
    let deviations = (0..groups.len()).map(|k| (k, deviation_stds(k)));
    let (k, stds) = deviations.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (stds > CONTRADICTING_STDS).then_some(k)
}

/// The typical variation of these groups, whether or not their values contradict each other.
fn typical(groups: &[Group]) -> BetweenClipStd {
    if repeats(groups) == 0.0 {
        return BetweenClipStd { relative: 0.0, degrees_of_freedom: 0.0 };
    }
    let relative = most_likely_std(groups);
    BetweenClipStd { relative, degrees_of_freedom: prior_degrees_of_freedom(groups, relative) }
}

/// The relative standard deviation from clip to clip of the highest restricted likelihood (Harville 1977).
///
/// The likelihood weighs a squared deviation by what the value says about the variation: one noisy value that is a few standard deviations off changes
/// little, whereas the sum of squares (Paule and Mandel 1982) would ask for a variation of the accurate values that they do not show.
fn most_likely_std(groups: &[Group]) -> f64 {
    let likelihood = |relative: f64| groups.iter().map(|g| g.log_likelihood(relative)).sum::<f64>();
    // The likelihood may have two maxima: that of a grid is refined.
    let at = |k: f64| if k > 0.0 { MAX_RELATIVE_STD * STEP.powf(k - STEPS) } else { 0.0 };
    let steps = (0..=STEPS as usize).map(|k| k as f64);
    let best = steps.max_by(|a, b| likelihood(at(*a)).total_cmp(&likelihood(at(*b)))).unwrap_or(0.0);
    let [mut low, mut high] = [at(best - 1.0), at((best + 1.0).min(STEPS))];
    for _ in 0..REFINEMENTS {
        let third = (high - low) / 3.0;
        if likelihood(low + third) < likelihood(high - third) { low += third } else { high -= third }
    }
    if best == 0.0 && likelihood(0.0) >= likelihood(low) { 0.0 } else { f64::midpoint(low, high) }
}

/// The least relative standard deviation up to [`MAX_RELATIVE_STD`] that is not too small, by bisection.
pub(super) fn least_std(is_too_small: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, MAX_RELATIVE_STD);
    if !is_too_small(low) {
        return low;
    }
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if is_too_small(middle) { low = middle } else { high = middle }
    }
    high
}

/// The typical variation from clip to clip with a prior that has the weight of one repeat, so that a campaign without
/// repeats does not claim that clips agree to within their noise.
pub(crate) fn between_clip_std_with_prior(groups: &[Group]) -> BetweenClipStd {
    let found = between_clip_std(groups);
    let repeats = repeats(groups);
    let relative = with_prior(found.relative, repeats);
    // By the prior one or two groups are not much more variable than their repeats show.
    let is_from_prior = repeats > 0.0 && !is_comparable(groups);
    let degrees_of_freedom =
        if is_from_prior { ASSUMED_DEGREES_OF_FREEDOM } else { found.degrees_of_freedom };
    BetweenClipStd { relative, degrees_of_freedom }
}

/// The number of values of the groups beyond the first one of each.
pub(crate) fn repeats<'a>(groups: impl IntoIterator<Item = &'a Group>) -> f64 {
    groups.into_iter().map(Group::degrees_of_freedom).sum()
}

/// A relative standard deviation from clip to clip that this number of repeats shows, with a prior that has the weight of one.
pub(crate) fn with_prior(relative: f64, repeats: f64) -> f64 {
    /// Relative standard deviation of repeated slides and impacts on a real table: some per cent.
    const PRIOR_STD: f64 = 0.05;
    ((repeats * relative.powi(2) + PRIOR_STD.powi(2)) / (repeats + 1.0)).sqrt()
}

impl Group {
    /// The restricted log-likelihood of a relative standard deviation from clip to clip, up to a constant; 0 for a single value.
    fn log_likelihood(&self, relative: f64) -> f64 {
        if self.values.len() < 2 {
            return 0.0;
        }
        let weights = self.weights(relative);
        let log_determinant = weights.iter().map(|w| w.ln()).sum::<f64>() - weights.iter().sum::<f64>().ln();
        (log_determinant - self.moments(relative).1) / 2.0
    }

    /// The weighted sum of squares about the mean; 0 for a single value.
    fn squares(&self, relative: f64) -> f64 {
        if self.values.len() < 2 { 0.0 } else { self.moments(relative).1 }
    }
}

/// Whether enough groups repeat to compare their variances.
fn is_comparable(groups: &[Group]) -> bool {
    groups.iter().filter(|g| g.values.len() > 1).count() > 2
}

/// Prior degrees of freedom of the typical variance: many if the groups' variances differ no more than by chance.
///
/// The mean square of a group over its expectation is chi-square distributed over its degrees of freedom f, with variance
/// 2 / f.  If the true variances of the groups differ, that variance is larger by 2 / d, and d is the result: the mean over the groups and
/// [`ASSUMED_GROUPS`] with the assumed d.  Of many groups the most deviating one is left out; its own dispersion widens its interval.
///
/// One or two groups are too few for that.  Then the variance from clip to clip is as uncertain as its repeats make it, in so far as it
/// contributes to the variance of a value (Satterthwaite 1946), and the groups' own variances differ.
fn prior_degrees_of_freedom(groups: &[Group], relative: f64) -> f64 {
    let squares: Vec<(f64, f64)> = (groups.iter().filter(|g| g.values.len() > 1))
        .map(|g| (g.moments(relative).1 / g.degrees_of_freedom(), g.degrees_of_freedom()))
        .collect();
    if squares.is_empty() {
        return 0.0;
    }
    if !is_comparable(groups) {
        let part = |group: &Group| {
            let between = (relative * group.scale).powi(2);
            let noise = median(group.values.iter().map(|m| m.std * m.std)).unwrap_or(0.0);
            between / (between + noise).max(f64::MIN_POSITIVE)
        };
        let part = median(groups.iter().filter(|g| g.values.len() > 1).map(part)).unwrap_or(1.0);
        let repeats: f64 = squares.iter().map(|(_, f)| f).sum();
        return 1.0 / (part.powi(2) / repeats + 1.0 / ASSUMED_DEGREES_OF_FREEDOM);
    }
    let mut excesses: Vec<f64> = squares.iter().map(|(s, f)| (s - 1.0).powi(2) - 2.0 / f).collect();
    excesses.sort_unstable_by(f64::total_cmp);
    if excesses.len() >= MANY_GROUPS {
        excesses.pop();
    }
    let assumed = ASSUMED_GROUPS * 2.0 / ASSUMED_DEGREES_OF_FREEDOM;
    let excess = (excesses.iter().sum::<f64>() + assumed) / (excesses.len() as f64 + ASSUMED_GROUPS);
    if excess <= 2.0 / MAX_DEGREES_OF_FREEDOM { MAX_DEGREES_OF_FREEDOM } else { 2.0 / excess }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(values: &[(f64, f64)]) -> Group {
        Group {
            values: values.iter().map(|&(value, std)| Measured { value, std }).collect(),
            clips: values.len(),
            scale: 1.0,
        }
    }

    #[test]
    fn equal_noise_gives_the_arithmetic_mean_and_students_interval() {
        let group = group(&[(1.0, 0.1), (2.0, 0.1), (3.0, 0.1)]);
        let mean =
            group.mean(BetweenClipStd { relative: 1.0, degrees_of_freedom: 0.0 }).expect("three values");
        let estimate = mean.estimate(&group);
        assert!(
            (estimate.mean - 2.0).abs() < 1e-12
                && (estimate.standard_error - 1.0 / 3f64.sqrt()).abs() < 1e-12
        );
        assert!((estimate.interval_95[1] - 2.0 - 4.302_652_73 / 3f64.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn a_noisy_clip_has_less_weight() {
        let mean = group(&[(1.0, 0.01), (2.0, 1.0)])
            .mean(BetweenClipStd { relative: 0.0, degrees_of_freedom: 0.0 })
            .expect("two");
        assert!((mean.value - 1.0).abs() < 1e-3, "{}", mean.value);
    }

    #[test]
    fn the_common_variation_of_all_groups_is_found() {
        // Values at -1, 0, 1 times 0.2: a variance of 0.04.
        let groups: Vec<_> =
            (0..5).map(|k| group(&[-0.2, 0.0, 0.2].map(|d| (f64::from(k) + d, 1e-6)))).collect();
        let found = between_clip_std(&groups);
        assert!((found.relative - 0.2).abs() < 1e-6, "{}", found.relative);
        assert_eq!(found.degrees_of_freedom, MAX_DEGREES_OF_FREEDOM);
    }

    #[test]
    fn a_noisy_value_a_few_standard_deviations_off_hardly_changes_the_variation() {
        // With 0.05 from clip to clip the last value of the first group is 3 standard deviations off.
        let groups = [
            group(&[(1.03, 0.004), (0.98, 0.004), (1.02, 0.004), (1.55, 0.17)]),
            group(&[(0.95, 0.01), (1.0, 0.01)]),
            group(&[(1.05, 0.01), (1.0, 0.01)]),
        ];
        let with = between_clip_std(&groups).relative;
        let mut accurate = groups;
        accurate[0].values.pop();
        let without = between_clip_std(&accurate).relative;
        assert!((0.02..0.05).contains(&without) && with < 1.5 * without, "{without}, with it {with}");
    }

    #[test]
    fn two_values_that_contradict_each_other_do_not_widen_other_groups() {
        let agreeing: Vec<_> =
            (0..3).map(|_| group(&[0.97, 1.0, 1.03].map(|value| (value, 0.005)))).collect();
        let contradicting = group(&[(0.98, 0.005), (0.1, 0.02)]);
        let all = [agreeing.as_slice(), &[contradicting]].concat();
        let (with, without) = (between_clip_std(&all), between_clip_std(&agreeing));
        assert_eq!(with, without);
        let estimate = |k: usize| {
            let group: &Group = &all[k];
            group.mean(with).expect("values").estimate(group)
        };
        let [low, high] = estimate(0).interval_95;
        assert!(high - low < 0.1, "{low} to {high}");
        let [low, high] = estimate(3).interval_95;
        assert!(high - low > 0.5, "{low} to {high}");
    }

    #[test]
    fn a_quantity_without_repeats_is_less_certain_than_its_measurement() {
        let groups: Vec<_> = (1..4).map(|k| group(&[(f64::from(k), 1e-6)])).collect();
        let with_prior = between_clip_std_with_prior(&groups);
        let half = groups[0].mean(with_prior).expect("a value").half_width();
        assert!((0.05..0.2).contains(&half), "{half} of 1");
    }

    /// A triangle is hit on a side or near a corner, with two restitutions; the clips of two discs agree.
    #[test]
    fn values_that_contradict_each_other_leave_those_of_other_objects_certain() {
        let of = |values: &[(f64, f64)], scale: f64| Group { scale, ..group(values) };
        let triangle = of(&[(0.39, 0.002), (0.64, 0.02), (0.58, 0.006), (0.39, 0.004)], 0.485);
        let discs =
            [of(&[(0.774, 0.014), (0.760, 0.005), (0.756, 0.003)], 0.76), of(&[(0.723, 0.001)], 0.723)];
        let half = |k: usize, groups: &[Group]| {
            groups[k].mean(between_clip_std_with_prior(groups)).expect("a value").half_width()
        };
        let [first, second] = discs.clone();
        let with_triangle = [first, second, triangle];
        assert!(half(1, &with_triangle) < 1.2 * half(1, &discs), "{} of 0.723", half(1, &with_triangle));
        assert!(half(2, &with_triangle) > 0.05, "{} of 0.49", half(2, &with_triangle));
    }

    #[test]
    fn two_noisy_clips_are_more_certain_than_one() {
        let width = |groups: &[Group]| {
            let with_prior = between_clip_std_with_prior(groups);
            groups[0].mean(with_prior).expect("a value").half_width()
        };
        let one = width(&[group(&[(0.43, 0.035)]), group(&[(0.66, 0.035)])]);
        let two = width(&[group(&[(0.42, 0.035), (0.46, 0.035)]), group(&[(0.66, 0.035)])]);
        assert!(two < one, "{two} from two, {one} from one");
    }

    #[test]
    fn many_repeats_outweigh_the_prior() {
        let groups: Vec<_> =
            (0..50).map(|k| group(&[-0.02, 0.0, 0.02].map(|d| (f64::from(k) + d, 1e-6)))).collect();
        let with_prior = between_clip_std_with_prior(&groups).relative;
        assert!((with_prior / 0.02 - 1.0).abs() < 0.05, "{with_prior}");
    }

    #[test]
    fn one_of_three_groups_that_deviates_leaves_the_others_an_interval() {
        let groups = [
            group(&[(1.0, 0.01), (1.02, 0.01)]),
            group(&[(1.0, 0.01), (1.01, 0.01)]),
            group(&[(1.0, 0.01), (1.25, 0.01)]),
            group(&[(1.0, 0.01)]),
        ];
        let half = groups[3].mean(between_clip_std_with_prior(&groups)).expect("a value").half_width();
        assert!((0.1..0.5).contains(&half), "{half} of 1");
    }

    #[test]
    fn quantiles_are_continuous_in_the_degrees_of_freedom() {
        for k in 1..12 {
            let (at, after) = (quantile_95(f64::from(k)), quantile_95(f64::from(k) + 1e-9));
            assert!((at - student_t_95(k as usize)).abs() < 1e-12 && (at - after).abs() < 1e-6, "{k}");
            assert!(quantile_95(f64::from(k) + 1.0 - 1e-9) - student_t_95(k as usize + 1) < 1e-6);
        }
    }

    #[test]
    fn one_deviating_group_does_not_remove_the_prior_of_the_others() {
        let alike = (0..9).map(|k| group(&[-0.03, 0.01, 0.02].map(|d| (f64::from(k) + d, 0.02))));
        let mut groups: Vec<_> = alike.collect();
        let before = between_clip_std(&groups).degrees_of_freedom;
        groups.push(group(&[(1.0, 0.02), (1.4, 0.02)]));
        let after = between_clip_std(&groups).degrees_of_freedom;
        assert!(before > 6.0 && after > 6.0, "{before} without it, {after} with it");
    }

    #[test]
    fn values_that_agree_within_their_noise_have_no_variation_from_clip_to_clip() {
        let groups = vec![group(&[(1.0, 0.1), (1.05, 0.1), (0.95, 0.1)])];
        assert!(between_clip_std(&groups).relative < 1e-9);
    }
}
