//! The mean of repeated measurements that scatter more than their own noise says.
//!
//! Every clip's value has its own noise, and the quantity itself varies from clip to clip.  Groups of the same kind
//! (the friction of every object, the restitution of every pair) vary alike: the typical spread of all groups
//! steadies the spread of one group with few clips (an empirical Bayes estimate of the variance).

use crate::estimate::clip::result::Measured;
use crate::estimate::measure::measurements::Measurements;
use crate::estimate::measure::quantity::Quantity;
use crate::statistics::median;
use crate::uncertain::{Estimate, student_t_95};

/// The typical spread of groups of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spread {
    /// One standard deviation from clip to clip, over the group's scale.
    pub(crate) relative: f64,
    /// For how many clips this knowledge stands in a group of its own.
    pub(crate) freedom: f64,
}

/// Repeated measurements of one quantity.
#[derive(Clone, Debug, Default)]
pub(crate) struct Group {
    pub(crate) values: Vec<Measured>,
    /// What a relative spread of 1 means for this quantity.
    pub(crate) scale: f64,
}

/// A group's mean.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mean {
    pub(crate) value: f64,
    pub(crate) standard_error: f64,
    pub(crate) freedom: f64,
    /// The share of each value; they sum to 1.
    pub(crate) shares: Vec<f64>,
    /// By how much the values scatter more than spread and noise let expect (variance).
    pub(crate) dispersion: f64,
}

/// No kind of group is steadier than if this many clips had told its spread: groups do differ.
const MOST_FREEDOM: f64 = 12.0;
const LARGEST_SPREAD: f64 = 1.0;
/// Enough groups to leave one out.
const MANY_GROUPS: usize = 6;
/// A quantity near zero has no relative spread to speak of.
const SMALLEST_SCALE: f64 = 1e-3;

impl Group {
    /// The measurements at these places of the clips.
    pub(crate) fn of(clips: &[Measurements], key: &Quantity, places: &[(usize, usize)]) -> Self {
        let values: Vec<Measured> = places.iter().map(|&(clip, k)| clips[clip].measured(k)).collect();
        let scale = match key {
            // A logarithm is relative as it is.
            Quantity::MassRatio(..) => 1.0,
            _ => median(values.iter().map(|m| m.value.abs())).unwrap_or(0.0).max(SMALLEST_SCALE),
        };
        Self { values, scale }
    }

    fn weights(&self, relative: f64) -> Vec<f64> {
        let spread = relative * self.scale;
        self.values.iter().map(|m| 1.0 / (m.std * m.std + spread * spread).max(f64::MIN_POSITIVE)).collect()
    }

    /// The weighted mean, and the weighted sum of squares about it.
    fn moments(&self, relative: f64) -> (f64, f64) {
        let weights = self.weights(relative);
        let total: f64 = weights.iter().sum();
        let mean = self.values.iter().zip(&weights).map(|(m, w)| m.value * w).sum::<f64>() / total;
        (mean, self.values.iter().zip(&weights).map(|(m, w)| w * (m.value - mean).powi(2)).sum())
    }

    fn freedom(&self) -> f64 {
        self.values.len().saturating_sub(1) as f64
    }

    /// The mean, weighted by noise and spread; `None` without values.
    pub(crate) fn mean(&self, spread: Spread) -> Option<Mean> {
        if self.values.is_empty() {
            return None;
        }
        let (value, squares) = self.moments(spread.relative);
        let freedom = spread.freedom + self.freedom();
        let dispersion = if freedom > 0.0 { (spread.freedom + squares) / freedom } else { 1.0 };
        let weights = self.weights(spread.relative);
        let total: f64 = weights.iter().sum();
        let shares = weights.iter().map(|w| w / total).collect();
        Some(Mean { value, standard_error: (dispersion / total).sqrt(), freedom, shares, dispersion })
    }
}

impl Mean {
    /// Half the width of the 95 % interval.
    pub(crate) fn half_width(&self) -> f64 {
        quantile_95(self.freedom) * self.standard_error
    }

    /// The standard deviation from clip to clip, each counting as much as it does in the mean; none of a single clip.
    pub(crate) fn std(&self, group: &Group) -> Option<f64> {
        let squares: f64 =
            group.values.iter().zip(&self.shares).map(|(m, s)| s * (m.value - self.value).powi(2)).sum();
        let alone: f64 = self.shares.iter().map(|s| s * s).sum();
        (group.values.len() > 1).then(|| (squares / (1.0 - alone).max(f64::MIN_POSITIVE)).sqrt())
    }

    /// As the outside sees it.
    pub(crate) fn estimate(&self, group: &Group) -> Estimate {
        let half = self.half_width();
        Estimate {
            mean: self.value,
            std: self.std(group),
            standard_error: self.standard_error,
            interval_95: [self.value - half, self.value + half],
            n: group.values.len(),
        }
    }
}

/// Student's quantile; a single value without any knowledge of spread is taken as normal.
pub(crate) fn quantile_95(freedom: f64) -> f64 {
    const NORMAL: f64 = 1.96;
    if freedom < 1.0 { NORMAL } else { student_t_95(freedom.floor() as usize) }
}

/// The typical spread of groups of one kind (Paule and Mandel's estimate over all groups), and how alike they are.
pub(crate) fn spread(groups: &[Group]) -> Spread {
    let freedom: f64 = groups.iter().map(Group::freedom).sum();
    if freedom == 0.0 {
        return Spread { relative: 0.0, freedom: 0.0 };
    }
    let excess = |relative: f64| groups.iter().map(|g| g.moments_squares(relative)).sum::<f64>() - freedom;
    // The sum of squares falls as the spread grows: bisection.
    let (mut low, mut high) = (0.0, LARGEST_SPREAD);
    if excess(low) <= 0.0 {
        high = 0.0;
    }
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if excess(middle) > 0.0 { low = middle } else { high = middle }
    }
    Spread { relative: high, freedom: likeness(groups, high) }
}

/// The typical spread, joined with a guess of it that counts as one repetition: where nothing was filmed twice, clips do not
/// agree to within their noise for that.
pub(crate) fn guessed_spread(groups: &[Group]) -> Spread {
    /// Slides and impacts of the same things differ by some per cent on any real table.
    const USUAL: f64 = 0.05;
    let found = spread(groups);
    let repetitions: f64 = groups.iter().map(Group::freedom).sum();
    let variance = (repetitions * found.relative.powi(2) + USUAL.powi(2)) / (repetitions + 1.0);
    Spread { relative: variance.sqrt(), ..found }
}

impl Group {
    fn moments_squares(&self, relative: f64) -> f64 {
        if self.values.len() < 2 { 0.0 } else { self.moments(relative).1 }
    }
}

/// How many clips the typical spread is worth: many if the groups' spreads differ no more than chance lets them.
///
/// A group's mean square over its expectation is a chi-square over its freedom, f; if the groups' own spreads vary,
/// its variance exceeds 2/f by 2/d, and d is the answer.  Of many groups the one that is least like the others does not
/// speak for them: its own dispersion widens it.
fn likeness(groups: &[Group], relative: f64) -> f64 {
    let squares: Vec<(f64, f64)> = (groups.iter().filter(|g| g.values.len() > 1))
        .map(|g| (g.moments(relative).1 / g.freedom(), g.freedom()))
        .collect();
    if squares.len() < 3 {
        return 0.0;
    }
    let mut excesses: Vec<f64> = squares.iter().map(|(s, f)| (s - 1.0).powi(2) - 2.0 / f).collect();
    excesses.sort_by(f64::total_cmp);
    if excesses.len() >= MANY_GROUPS {
        excesses.pop();
    }
    let excess = excesses.iter().sum::<f64>() / excesses.len() as f64;
    if excess <= 2.0 / MOST_FREEDOM { MOST_FREEDOM } else { 2.0 / excess }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(values: &[(f64, f64)]) -> Group {
        Group { values: values.iter().map(|&(value, std)| Measured { value, std }).collect(), scale: 1.0 }
    }

    #[test]
    fn equal_noise_and_no_spread_give_the_plain_mean_and_students_interval() {
        let group = group(&[(1.0, 0.1), (2.0, 0.1), (3.0, 0.1)]);
        let mean = group.mean(Spread { relative: 1.0, freedom: 0.0 }).expect("three values");
        let estimate = mean.estimate(&group);
        assert!(
            (estimate.mean - 2.0).abs() < 1e-12
                && (estimate.standard_error - 1.0 / 3f64.sqrt()).abs() < 1e-12
        );
        assert!((estimate.interval_95[1] - 2.0 - 4.302_652_73 / 3f64.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn a_noisy_clip_counts_less() {
        let mean =
            group(&[(1.0, 0.01), (2.0, 1.0)]).mean(Spread { relative: 0.0, freedom: 0.0 }).expect("two");
        assert!((mean.value - 1.0).abs() < 1e-3, "{}", mean.value);
    }

    #[test]
    fn the_spread_of_all_groups_is_found() {
        // Values at -1, 0, 1 times 0.2: a variance of 0.04.
        let groups: Vec<_> =
            (0..5).map(|k| group(&[-0.2, 0.0, 0.2].map(|d| (f64::from(k) + d, 1e-6)))).collect();
        let found = spread(&groups);
        assert!((found.relative - 0.2).abs() < 1e-6, "{}", found.relative);
        assert_eq!(found.freedom, MOST_FREEDOM);
    }

    #[test]
    fn what_was_never_filmed_twice_is_not_known_as_well_as_its_clip_is_measured() {
        let groups: Vec<_> = (1..4).map(|k| group(&[(f64::from(k), 1e-6)])).collect();
        let guessed = guessed_spread(&groups);
        let half = groups[0].mean(guessed).expect("a value").half_width();
        assert!((0.05..0.2).contains(&half), "{half} of 1");
    }

    #[test]
    fn many_repetitions_leave_little_of_the_guess() {
        let groups: Vec<_> =
            (0..50).map(|k| group(&[-0.02, 0.0, 0.02].map(|d| (f64::from(k) + d, 1e-6)))).collect();
        let guessed = guessed_spread(&groups).relative;
        assert!((guessed / 0.02 - 1.0).abs() < 0.05, "{guessed}");
    }

    #[test]
    fn one_group_that_is_unlike_all_others_does_not_make_strangers_of_them() {
        let alike = (0..9).map(|k| group(&[-0.03, 0.01, 0.02].map(|d| (f64::from(k) + d, 0.02))));
        let mut groups: Vec<_> = alike.collect();
        let before = spread(&groups).freedom;
        groups.push(group(&[(1.0, 0.02), (1.4, 0.02)]));
        let after = spread(&groups).freedom;
        assert!(before > 6.0 && after > 6.0, "{before} without it, {after} with it");
    }

    #[test]
    fn values_that_agree_within_their_noise_have_no_spread() {
        let groups = vec![group(&[(1.0, 0.1), (1.05, 0.1), (0.95, 0.1)])];
        assert!(spread(&groups).relative < 1e-9);
    }
}
