//! What all clips say about one of them: its impacts are measured better if its frictions and its strikes are known.
//!
//! The velocities before and after an impact follow from few positions.  Their errors are correlated with those of the friction and of the striker
//! restitution that the same positions give, and both are known from other clips, up to the variation from clip to clip.

use super::random_effects::{between_clip_std_with_prior, groups_of_kind};
use crate::estimate::clip::result::Measured;
use crate::estimate::measure::measurements::Measurements;
use crate::estimate::measure::quantity::Quantity;
use std::collections::BTreeMap;

/// Values that a clip is expected to have, each with its index in the clip.
type Expected = Vec<(usize, Measured)>;

/// The measurements of each clip, conditioned on what all clips say: restitutions and mass ratios on the frictions, then restitutions of pairs and mass
/// ratios on the restitution between striker and object.
///
/// `frictions` holds the mean friction of an object and its standard deviation from clip to clip, where known.
pub(crate) fn conditioned_on_all_clips(
    clips: &[Measurements],
    frictions: &BTreeMap<String, Measured>,
) -> Vec<Measurements> {
    let is_friction = |quantity: &Quantity| matches!(quantity, Quantity::Friction(_));
    let is_of_striker = |quantity: &Quantity| matches!(quantity, Quantity::StrikerRestitution(_));
    let clips: Vec<Measurements> = clips
        .iter()
        .map(|clip| clip.conditioned(&expected_frictions(clip, frictions), |quantity| !is_friction(quantity)))
        .collect();
    let strikes = expected_strikes(&clips);
    let is_of_pair = |quantity: &Quantity| !is_friction(quantity) && !is_of_striker(quantity);
    clips.iter().zip(&strikes).map(|(clip, expected)| clip.conditioned(expected, is_of_pair)).collect()
}

/// The frictions of a clip that are known.
fn expected_frictions(clip: &Measurements, frictions: &BTreeMap<String, Measured>) -> Expected {
    let known = clip.quantities.iter().enumerate().filter_map(|(k, quantity)| match quantity {
        Quantity::Friction(object) => frictions.get(object).map(|friction| (k, *friction)),
        _ => None,
    });
    known.collect()
}

/// For each clip the restitutions against the striker that its other clips let expect; none of an object that the striker hits in no other clip.
///
/// The standard deviation is that of a clip's value about the mean of the other clips.
fn expected_strikes(clips: &[Measurements]) -> Vec<Expected> {
    let groups: Vec<_> = groups_of_kind(clips, Quantity::STRIKER_RESTITUTION).collect();
    let typical =
        between_clip_std_with_prior(&groups.iter().map(|(.., group)| group.clone()).collect::<Vec<_>>());
    let mut expected = vec![Expected::new(); clips.len()];
    for (_, indices, group) in &groups {
        let Some(mean) = group.mean(typical) else { continue };
        let weights = group.weights(typical.relative);
        let between = typical.relative * group.scale;
        for &(clip, k) in indices {
            let others = || {
                let all = indices.iter().zip(&weights).zip(&group.values);
                all.filter(|((index, _), _)| index.0 != clip)
                    .map(|((_, weight), value)| (*weight, value.value))
            };
            let total: f64 = others().map(|(weight, _)| weight).sum();
            if total > 0.0 {
                let value = others().map(|(weight, value)| weight * value).sum::<f64>() / total;
                let std = (mean.dispersion * (between * between + 1.0 / total)).sqrt();
                expected[clip].push((k, Measured { value, std }));
            }
        }
    }
    expected
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A clip that measures the striker restitution of `a` and the mass ratio of `a` and `b` with errors of one cause.
    fn clip(error: f64, std: f64) -> Measurements {
        const RESTITUTION: f64 = 0.6;
        const LOG_RATIO: f64 = 0.3;
        /// Change of the mass ratio per change of the restitution.
        const SLOPE: f64 = -3.0;
        let slopes = DVector::from_vec(vec![1.0, SLOPE]);
        Measurements {
            quantities: vec![
                Quantity::StrikerRestitution("a".into()),
                Quantity::MassRatio("a".into(), "b".into()),
            ],
            values: DVector::from_vec(vec![RESTITUTION, LOG_RATIO]) + &slopes * error,
            covariance: DMatrix::from_diagonal_element(2, 2, 1e-8)
                + &slopes * slopes.transpose() * (std * std),
            vertical_fractions: vec![0.0; 2],
            double_contact: vec![false; 2],
            by_slope: Vec::new(),
        }
    }

    #[test]
    fn a_strike_that_other_clips_know_corrects_the_mass_ratio_of_its_clip() {
        let clips = [clip(0.09, 0.06), clip(0.001, 0.002), clip(-0.002, 0.002), clip(0.001, 0.002)];
        let conditioned = conditioned_on_all_clips(&clips, &BTreeMap::new());
        let errors: Vec<f64> = conditioned.iter().map(|clip| clip.values[1] - 0.3).collect();
        // The first one was off by 0.27; what remains is the variation from clip to clip that is assumed.
        assert!(errors[0].abs() < 0.06, "{errors:?}");
        assert!(conditioned[0].measured(1).std < 0.5 * clips[0].measured(1).std);
        for (after, before) in conditioned.iter().zip(&clips) {
            assert_eq!(after.values[0], before.values[0], "the restitution stays as the clip measures it");
            assert!(after.covariance.clone().symmetric_eigenvalues().min() > 0.0);
        }
        // Those that are certain by themselves hardly change.
        assert!(errors[1..].iter().all(|error| error.abs() < 0.008), "{errors:?}");
    }

    #[test]
    fn a_strike_that_no_other_clip_measures_changes_nothing() {
        let clips = [clip(0.09, 0.06)];
        assert_eq!(conditioned_on_all_clips(&clips, &BTreeMap::new())[0].values, clips[0].values);
        assert_eq!(conditioned_on_all_clips(&clips, &BTreeMap::new())[0].covariance, clips[0].covariance);
    }
}
