//! The support of each object over all clips: how strongly the table brakes its spin.

use crate::estimate::clip::result::Measured;
use crate::estimate::joint::means::exponential;
use crate::estimate::joint::random_effects::{Group, between_clip_std_with_prior};
use crate::estimate::measure::sliding::support::ClipSupport;
use crate::properties::support;
use crate::statistics::median;
use crate::uncertain::Estimate;
use std::collections::{BTreeMap, BTreeSet};

/// A clip whose value is this many standard deviations off the median of its object is left out: the body rocks, or meets
/// something during its spin.
const OUTLIER_STDS: f64 = 6.0;
/// A deviation of the logarithm below this is never one of an outlier.
const LEAST_DEVIATION: f64 = 0.1;
/// Standard deviation of the logarithm that no repetition reduces: a round patch stands for the support.  That of a ring appears up to
/// 8 % smaller than the ring's mean lever arm says (by quadrature, from pure sliding to pure spinning), others less.
const PATCH_STD: f64 = 0.04;
/// Number of clips from which the median shows which one is wrong.
const CLIPS_NEEDED: usize = 3;

/// The support ratio of each object whose spin the clips show.
pub(crate) fn supports<'a>(clips: impl Iterator<Item = &'a [ClipSupport]>) -> BTreeMap<String, Estimate> {
    // The values of each object, with the number of their clip: two copies in one clip are two values.
    let mut values: BTreeMap<&str, Vec<(usize, Measured)>> = BTreeMap::new();
    for (number, clip) in clips.enumerate() {
        for found in clip {
            values.entry(&found.object).or_default().push((number, found.log_ratio));
        }
    }
    let groups: BTreeMap<&str, Group> = values.into_iter().map(|(name, of)| (name, group(of))).collect();
    let typical = between_clip_std_with_prior(&groups.values().cloned().collect::<Vec<_>>());
    let estimate = |(name, group): (&str, Group)| {
        let mut mean = group.mean(typical)?;
        mean.standard_error = mean.standard_error.hypot(PATCH_STD);
        let estimate = exponential(&mean, mean.std(&group), group.clips);
        support::is_known(&estimate).then(|| (name.to_owned(), estimate))
    };
    groups.into_iter().filter_map(estimate).collect()
}

/// The values of one object without outliers.
fn group(mut values: Vec<(usize, Measured)>) -> Group {
    if values.len() >= CLIPS_NEEDED {
        let centre = median(values.iter().map(|(_, m)| m.value)).unwrap_or(0.0);
        let deviation = |m: &Measured| (m.value - centre).abs();
        let spread = median(values.iter().map(|(_, m)| deviation(m))).unwrap_or(0.0) / NORMAL_MEDIAN;
        let most = |m: &Measured| (OUTLIER_STDS * m.std.hypot(spread)).max(LEAST_DEVIATION);
        values.retain(|(_, m)| deviation(m) <= most(m));
    }
    let clips = values.iter().map(|(number, _)| number).collect::<BTreeSet<_>>().len();
    Group { values: values.into_iter().map(|(_, m)| m).collect(), clips, scale: 1.0 }
}

/// Median absolute deviation of a standard normal variable.
const NORMAL_MEDIAN: f64 = 0.6745;

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(object: &str, value: f64, std: f64) -> Vec<ClipSupport> {
        vec![ClipSupport { object: object.into(), log_ratio: Measured { value, std } }]
    }

    #[test]
    fn repeated_clips_give_their_mean_ratio_and_one_wrong_clip_does_not_move_it() {
        let mut clips: Vec<_> =
            [0.38, 0.40, 0.42, 0.41, 0.39].iter().map(|&value| clip("a", value, 0.02)).collect();
        let ratio = |clips: &[Vec<ClipSupport>]| supports(clips.iter().map(Vec::as_slice))["a"];
        let before = ratio(&clips);
        assert!((before.mean - 0.4f64.exp()).abs() < 0.01 && before.n == 5, "{before:?}");
        clips.push(clip("a", -1.5, 0.02));
        let after = ratio(&clips);
        assert!((after.mean / before.mean - 1.0).abs() < 0.03, "{before:?}, then {after:?}");
    }

    #[test]
    fn a_support_that_the_clips_leave_open_is_not_given() {
        assert!(supports([clip("a", 0.1, 0.49)].iter().map(Vec::as_slice)).is_empty());
    }
}
