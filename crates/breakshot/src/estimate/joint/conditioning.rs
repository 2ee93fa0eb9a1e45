//! What the other clips say about one of them: its impacts are measured better if its frictions and its strikes are known.
//!
//! The velocities before and after an impact follow from few positions.  Their errors are correlated with those of the friction and of the striker
//! restitution that the same positions give, and both are known from other clips, up to the variation from clip to clip.

use super::outliers;
use super::random_effects::{between_clip_std_with_prior, groups_of_kind};
use crate::estimate::clip::result::Measured;
use crate::estimate::measure::ClipMeasurements;
use crate::estimate::measure::measurements::Measurements;
use crate::estimate::measure::quantity::Quantity;
use std::collections::BTreeMap;

/// Values that a clip is expected to have, each with its index in the clip.
type Expected = Vec<(usize, Measured)>;

/// The measurements of each clip, conditioned on what the other clips say: restitutions and mass ratios on the frictions, then restitutions of pairs
/// and mass ratios on the restitution between striker and object.
pub(crate) fn conditioned_on_other_clips(clips: &[Measurements]) -> Vec<Measurements> {
    let is_friction = |quantity: &Quantity| matches!(quantity, Quantity::Friction(_));
    let is_of_striker = |quantity: &Quantity| matches!(quantity, Quantity::StrikerRestitution(_));
    let conditioned = |clips: &[Measurements], kind: usize, is_updated: &dyn Fn(&Quantity) -> bool| {
        let expected = expected_of_other_clips(clips, kind);
        clips.iter().zip(&expected).map(|(clip, e)| clip.conditioned(e, is_updated)).collect::<Vec<_>>()
    };
    let clips = conditioned(clips, Quantity::FRICTION, &|q| !is_friction(q));
    conditioned(&clips, Quantity::STRIKER_RESTITUTION, &|q| !is_friction(q) && !is_of_striker(q))
}

/// For each clip the values of one [kind](Quantity::kind) that its other clips let expect; none of a quantity that no other clip measures.
fn expected_of_other_clips(clips: &[Measurements], kind: usize) -> Vec<Expected> {
    let mut expected = vec![Expected::new(); clips.len()];
    for (_, repeated) in repeated_of_kind(clips, kind) {
        for &(clip, k) in &repeated.indices {
            expected[clip].extend(repeated.expected_in(clip).map(|value| (k, value)));
        }
    }
    expected
}

/// For each clip the friction of each object that the other clips let expect.
pub(crate) fn frictions_of_other_clips(clips: &[&ClipMeasurements]) -> Vec<BTreeMap<String, Measured>> {
    let names: Vec<String> = clips.iter().map(|clip| clip.name.clone()).collect();
    let measurements: Vec<Measurements> = clips.iter().map(|clip| clip.measurements.clone()).collect();
    let (kept, _) = outliers::without_outliers(&measurements, &names);
    let mut expected = vec![BTreeMap::new(); clips.len()];
    for (quantity, repeated) in repeated_of_kind(&kept, Quantity::FRICTION) {
        let Quantity::Friction(object) = quantity else { continue };
        for (clip, expected) in expected.iter_mut().enumerate() {
            expected.extend(repeated.expected_in(clip).map(|friction| (object.clone(), friction)));
        }
    }
    expected
}

/// The values of one quantity in all clips.
struct Repeated {
    /// Indices of the clip and within its measurements.
    indices: Vec<(usize, usize)>,
    values: Vec<f64>,
    /// The inverse variance of each value.
    weights: Vec<f64>,
    between_variance: f64,
    /// Variance of the values over the one that noise and variation from clip to clip explain.
    dispersion: f64,
}

/// The values of every quantity of one [kind](Quantity::kind).
fn repeated_of_kind(clips: &[Measurements], kind: usize) -> impl Iterator<Item = (&Quantity, Repeated)> {
    let groups: Vec<_> = groups_of_kind(clips, kind).collect();
    let typical =
        between_clip_std_with_prior(&groups.iter().map(|(.., group)| group.clone()).collect::<Vec<_>>());
    groups.into_iter().filter_map(move |(quantity, indices, group)| {
        let repeated = Repeated {
            indices,
            values: group.values.iter().map(|m| m.value).collect(),
            weights: group.weights(typical.relative),
            between_variance: (typical.relative * group.scale).powi(2),
            dispersion: group.mean(typical)?.dispersion,
        };
        Some((quantity, repeated))
    })
}

impl Repeated {
    /// The value that the other clips let expect in this one; `None` if they have none.
    ///
    /// The standard deviation is that of a clip's value about the mean of the other clips.
    fn expected_in(&self, clip: usize) -> Option<Measured> {
        let all = self.indices.iter().zip(&self.weights).zip(&self.values);
        let others = || all.clone().filter(|((index, _), _)| index.0 != clip);
        let total: f64 = others().map(|((_, weight), _)| weight).sum();
        let sum: f64 = others().map(|((_, weight), value)| weight * value).sum();
        let variance = self.dispersion * (self.between_variance + 1.0 / total);
        (total > 0.0).then(|| Measured { value: sum / total, std: variance.sqrt() })
    }
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
        let conditioned = conditioned_on_other_clips(&clips);
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
        assert_eq!(conditioned_on_other_clips(&clips)[0].values, clips[0].values);
        assert_eq!(conditioned_on_other_clips(&clips)[0].covariance, clips[0].covariance);
    }
}
