//! What does one clip measure?
//!
//! From the fitted motion of one clip (`clip`) to its frictions, restitutions, mass ratios and contact frictions, with the
//! covariance that the noise of the tracks gives them.  Impacts between more than two bodies, or whose partner is
//! unknown, are reported but measure nothing (`screening`).

pub(crate) mod contact;
pub(crate) mod contact_friction;
pub(crate) mod impulse_ratio;
pub(crate) mod matrix_serde;
pub(crate) mod measurements;
pub(crate) mod propagation;
pub(crate) mod quantity;
pub(crate) mod restitution;
pub(crate) mod screening;
pub(crate) mod sliding;

use crate::estimate::clip::exposure::ExposureChi2;
use crate::estimate::clip::fit::{MotionFit, NoiseStatistics};
use crate::estimate::clip::initial_guess::frame_s;
use crate::estimate::clip::result::{BodyFit, ClipFit, Measured};
use crate::estimate::clip::{ClipEstimate, consistency, impact_windows};
use crate::estimate::clip_tracks::ClipTracks;
use crate::object::kind;
use crate::statistics::median;
use contact_friction::ObliqueImpact;
use measurements::Measurements;
use propagation::FitMeasurements;
use serde::{Deserialize, Serialize};
use sliding::drag::{self, Drag};
use sliding::support::{self, ClipSupport};
use sliding::tilt::ClipTilt;
use std::collections::BTreeMap;

/// What one clip measures by itself, before it is compared and combined with other clips.
///
/// Serialized as the `told` of a clip in the evidence of `properties.json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ClipMeasurements {
    /// The clip's name.
    #[serde(skip)]
    pub(crate) name: String,
    /// Its objects; a second copy has a name of its own (`a#2`).
    #[serde(skip)]
    pub(crate) objects: Vec<String>,
    /// Frictions, restitutions and logarithms of mass ratios with their covariance.
    #[serde(rename = "readings")]
    pub(crate) measurements: Measurements,
    /// The speed-dependent fraction of each sliding body's deceleration.
    pub(crate) drags: Vec<Drag>,
    /// How strongly the table brakes the spins that the clip shows.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) supports: Vec<ClipSupport>,
    /// What the curves of the slides show of a tilted table; absent where friction is not Coulomb's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) tilt: Option<ClipTilt>,
    /// The objects whose deceleration is not Coulomb's in this clip.
    #[serde(rename = "uneven", default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) non_coulomb: Vec<String>,
    /// Ratios of tangential to normal impulse, which measure contact friction.
    #[serde(rename = "grazings")]
    pub(crate) oblique_impacts: Vec<ObliqueImpact>,
    /// Of the first fit, whose weights are the noise that the tracks claim.
    pub(crate) noise: NoiseStatistics,
    /// Of the first fit, see [`exposure`](crate::estimate::clip::exposure).
    #[serde(rename = "misfits")]
    pub(crate) chi2_by_exposure: ExposureChi2,
    /// Frame rate and noise of the clip.
    #[serde(rename = "seen")]
    pub(crate) recording: Recording,
    /// Warnings for the user.
    pub(crate) remarks: Vec<String>,
}

/// Frame rate and noise of a clip, as its fit found them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Recording {
    /// The median time between two frames (s).
    pub(crate) frame_s: f64,
    /// The standard deviation of a position's noise along each axis (m).
    #[serde(rename = "place_std_m")]
    pub(crate) position_std_m: f64,
    /// The standard deviation of a yaw's noise (rad).
    pub(crate) yaw_std_rad: f64,
}

impl Recording {
    fn new(fitted: &MotionFit) -> Self {
        let bodies = &fitted.model.bodies;
        let observations = bodies.iter().flat_map(|b| &b.observations).filter(|o| !o.excluded);
        Self {
            frame_s: frame_s(bodies),
            position_std_m: median(observations.map(|o| o.std_m)).unwrap_or(0.0),
            yaw_std_rad: fitted.model.yaw_std_rad,
        }
    }
}

impl ClipMeasurements {
    /// The same clip without its measurements; name, noise and remarks stay.
    fn without_data(self) -> Self {
        let measurements = self.measurements.retained(|_| false);
        let (drags, supports, tilt) = (Vec::new(), Vec::new(), None);
        let (non_coulomb, oblique_impacts) = (Vec::new(), Vec::new());
        Self { measurements, drags, supports, tilt, non_coulomb, oblique_impacts, ..self }
    }
}

/// The measurements of a clip for the motion that agrees with the frictions which other clips let expect: where few positions show the motion, the
/// other values are far from linear functions of its frictions.
///
/// `own` are the measurements without these; what they say about frictions and slides stays.
pub(crate) fn measured_near(
    expected: &BTreeMap<String, Measured>,
    estimate: &ClipEstimate,
    clip: &ClipTracks,
    own: ClipMeasurements,
) -> ClipMeasurements {
    let Some(estimate) = estimate.with_expected_frictions(expected) else { return own };
    let (_, near) = measured(&estimate, clip);
    match own.measurements.linearized_at(&near.measurements) {
        Some(measurements) => ClipMeasurements { measurements, oblique_impacts: near.oblique_impacts, ..own },
        None => own,
    }
}

/// The fitted motion of a clip for the user, and its measurements for the estimate over all clips.
///
/// An inconsistent clip contributes no measurements.
pub(crate) fn measured(estimate: &ClipEstimate, clip: &ClipTracks) -> (ClipFit, ClipMeasurements) {
    let (whole, striker) = (&estimate.whole, estimate.striker.as_ref());
    let fits = estimate.impact_fits();
    let by_fit: Vec<FitMeasurements> = fits.iter().map(|fit| FitMeasurements::new(fit, striker)).collect();

    // The fitted motion
    let frictions = by_fit.first().filter(|_| !whole.non_coulomb).map(|m| m.frictions.as_slice());
    let bodies = whole.model.bodies.iter().zip(&whole.paths).enumerate().map(|(k, (body, path))| BodyFit {
        object: body.object.clone(),
        friction: frictions.and_then(|f| f[k]),
        path: path.clone(),
    });
    let non_coulomb = if whole.non_coulomb { impact_windows::non_coulomb_bodies(whole) } else { Vec::new() };
    let excluded_frictions = non_coulomb.iter().map(|object| {
        format!("friction of `{object}` is left out: its deceleration is not Coulomb's in this clip")
    });
    let fit = ClipFit {
        name: clip.name.clone(),
        bodies: bodies.collect(),
        impacts: by_fit.iter().flat_map(|m| m.impacts.iter().cloned()).collect(),
        residual_rms_m: whole.residual_rms_m(),
        remarks: whole.remarks.iter().cloned().chain(excluded_frictions).collect(),
    };

    // The measurements
    let inconsistency = consistency::inconsistency(whole, striker.is_some());
    let of_impacts = fit.impacts.iter().flat_map(|i| &i.remarks);
    let remarks = inconsistency.iter().chain(&fit.remarks).chain(of_impacts).cloned().collect();
    let measurements: Vec<Measurements> = by_fit.iter().map(|m| m.measurements.clone()).collect();
    let oblique_impacts = fits.iter().zip(&by_fit).flat_map(|(fitted, of_fit)| {
        of_fit.contacts.iter().filter_map(|c| contact_friction::oblique_impact(fitted, &of_fit.contacts, c))
    });
    let measured = ClipMeasurements {
        name: clip.name.clone(),
        objects: fit.bodies.iter().map(|b| b.object.clone()).collect(),
        measurements: Measurements::joined(&measurements),
        drags: if whole.non_coulomb { Vec::new() } else { drag::drags(whole) },
        supports: if whole.non_coulomb { Vec::new() } else { support::supports(whole) },
        tilt: by_fit.first().filter(|_| !whole.non_coulomb).and_then(|m| m.tilt),
        non_coulomb: non_coulomb.iter().map(|object| kind(object).to_owned()).collect(),
        oblique_impacts: oblique_impacts.collect(),
        noise: whole.noise,
        chi2_by_exposure: ExposureChi2::default(),
        recording: Recording::new(whole),
        remarks,
    };
    (fit, if inconsistency.is_some() { measured.without_data() } else { measured })
}
