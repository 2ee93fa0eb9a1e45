//! The coefficient of contact friction that explains the oblique impacts of all clips.

use super::random_effects::{Group, between_clip_std};
use crate::estimate::clip::result::Measured;
use crate::estimate::measure::contact_friction::ObliqueImpact;
use crate::uncertain::Estimate;

/// Contact points certainly slid if sticking would have taken this many times the friction.
const CERTAINLY_SLIDING: f64 = 1.3;
/// Fewer sliding impacts give no coefficient.
const MIN_IMPACTS: usize = 3;
/// The half width of the 95 % interval over the coefficient, above which no coefficient is given.
const MAX_RELATIVE_ERROR: f64 = 0.25;
/// Coefficients up to 1.5 are tried in steps of a thousandth.
const STEP: f64 = 1e-3;
const STEPS: u32 = 1500;
/// Squared deviations are bounded by those of an outlier of five standard deviations.
const MAX_SQUARED_DEVIATION: f64 = 25.0;

/// The coefficient that explains all impacts; `None` if too few of them certainly slid or it is too uncertain.
///
/// An impact whose contact points stick has the smaller ratio [`ObliqueImpact::sticking_ratio`].
pub(crate) fn coefficient(impacts: &[ObliqueImpact]) -> Option<Estimate> {
    let loss = |friction: f64| -> f64 {
        impacts
            .iter()
            .map(|i| {
                let deviation =
                    (i.impulse_ratio.value - friction.min(i.sticking_ratio)) / i.impulse_ratio.std;
                deviation.powi(2).min(MAX_SQUARED_DEVIATION)
            })
            .sum()
    };
    let best = (0..=STEPS).map(|k| f64::from(k) * STEP).min_by(|p, q| loss(*p).total_cmp(&loss(*q)))?;
    let sliding = impacts.iter().filter(|i| i.sticking_ratio > CERTAINLY_SLIDING * best);
    let values: Vec<Measured> = sliding.map(|i| i.impulse_ratio).collect();
    if best == 0.0 || values.len() < MIN_IMPACTS {
        return None;
    }
    let group = Group { values, scale: best };
    let mean = group.mean(between_clip_std(std::slice::from_ref(&group)))?;
    let accurate = mean.value > 0.0 && mean.half_width() < MAX_RELATIVE_ERROR * mean.value;
    accurate.then(|| mean.estimate(&group))
}
