//! How strongly the table brakes the spin of a body in one clip.

use crate::estimate::clip::fit::MotionFit;
use crate::estimate::clip::motion_model::{Body, BodyIndices, LOG_PATCH_STD};
use crate::estimate::clip::result::Measured;
use crate::object::kind;
use serde::{Deserialize, Serialize};

/// What one clip shows of the support of one object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ClipSupport {
    pub(crate) object: String,
    /// The logarithm of the mean lever arm of the weight over that of a weight spread uniformly under the outline.
    pub(crate) log_ratio: Measured,
}

/// The support of every body whose spin its clip shows better than nothing.
///
/// The fit draws the logarithm towards zero by its prior; what the clip alone shows is the fitted value without that prior.
pub(crate) fn supports(fitted: &MotionFit) -> Vec<ClipSupport> {
    let minimum = &fitted.minimum;
    let of_body = |(body, indices): (&Body, &BodyIndices)| {
        let index = indices.patch?;
        let fitted = Measured {
            value: minimum.parameters[index],
            std: minimum.covariance[(index, index)].max(0.0).sqrt(),
        };
        let object = kind(&body.object).to_owned();
        Some(ClipSupport { object, log_ratio: without_prior(fitted)? })
    };
    fitted.model.bodies.iter().zip(&fitted.layout.bodies).filter_map(of_body).collect()
}

/// The likelihood's mean and standard deviation from those of the posterior; `None` if the prior weighs more than the clip.
fn without_prior(fitted: Measured) -> Option<Measured> {
    let prior = LOG_PATCH_STD.powi(-2);
    let both = fitted.std.powi(-2);
    let clip = both - prior;
    let found = Measured { value: fitted.value * both / clip, std: clip.powf(-0.5) };
    (clip > prior && found.value.is_finite() && found.std.is_finite()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_clip_shows_and_the_prior_make_the_fitted_value() {
        let shown = Measured { value: 0.4, std: 0.2 };
        let (clip, prior) = (shown.std.powi(-2), LOG_PATCH_STD.powi(-2));
        let fitted = Measured { value: shown.value * clip / (clip + prior), std: (clip + prior).powf(-0.5) };
        let found = without_prior(fitted).expect("more than the prior");
        assert!((found.value - 0.4).abs() < 1e-12 && (found.std - 0.2).abs() < 1e-12, "{found:?}");
        assert_eq!(without_prior(Measured { value: 0.0, std: 0.45 }), None, "the prior weighs more");
    }
}
