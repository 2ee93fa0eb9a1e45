//! How do the objects slide and bounce?
//!
//! Sections 4.1 to 4.3 of the paper with the corrected equations, in three steps:
//!
//! 1. `clip`: the tracks of one clip give the motion that fits them best: rest, slide, impact, slide, rest.
//! 2. `measure`: the fitted motion gives frictions, restitutions and mass ratios with their covariance.
//! 3. `joint`: the measurements of all clips give the [`Properties`] with their covariance; clips that contradict the
//!    others are left out.
//!
//! `design` answers which clips to film next.

mod clip;
mod clip_tracks;
mod closest_points;
mod design;
#[cfg(test)]
mod few_positions_tests;
mod joint;
mod measure;
#[cfg(test)]
mod pushed_tests;
#[cfg(test)]
mod struck_again_tests;
#[cfg(test)]
mod support_tests;
#[cfg(test)]
mod table_tests;
#[cfg(test)]
mod unobserved_tests;

pub use clip::result::{BodyFit, ClipFit, Impact, Measured};
pub use clip::sliding::MotionState;
pub use clip_tracks::ClipTracks;
pub use design::experiment::{Experiment, Setup};
pub use design::simulated_clip::{SimulatedCamera, simulated_clip};
pub use design::{
    Advice, AdviceOptions, AdvisedClip, Draws, StruckPile, UncertaintyReduction, advice, prediction_error_m,
    predictive_std_m, struck_piles,
};
pub use joint::clip_values::{ClipValue, clip_values};

use crate::cell::Cell;
use crate::error::{Error, Result};
use crate::object::{self, Object};
use crate::properties::Properties;
use crate::statistics::median;
use crate::warning::Warning;
use clip::fit::{NoiseStatistics, VarianceRatio};
use clip::{ClipEstimate, exposure};
use joint::conditioning::frictions_of_other_clips;
use joint::frame_rate;
use joint::properties;
use joint::record;
use measure::ClipMeasurements;
use rayon::prelude::*;

/// How to estimate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// The object whose mass is the unit; by default the alphabetically first one.
    pub reference: Option<String>,
}

/// The properties, and the fitted motion of every clip.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Estimation {
    /// Friction, restitution, mass ratios.
    pub properties: Properties,
    /// One fit per clip, in the order of the clips.
    pub clips: Vec<ClipFit>,
    /// The warnings of the properties, each with its cause and its clip.
    pub warnings: Vec<Warning>,
}

/// Friction, restitution and mass ratios from the tracks of all clips, and the fits of the clips.
///
/// A quantity that no clip supports is absent and listed in the warnings; a clip that contradicts the others or the
/// model is named there and left out.
///
/// ```
/// use breakshot::estimate::{Options, estimation};
/// use breakshot::synthetic::campaign::{CampaignSpec, campaign};
///
/// // Clips of two objects, whose tracks are drawn from known properties.
/// let spec = CampaignSpec { objects: 2, ..CampaignSpec::default() };
/// let drawn = campaign(&spec, 1);
/// let found = estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default())?.properties;
///
/// let (ratio, truth) = (found.mass_ratio["b"].mean, drawn.truth.mass_ratio["b"]);
/// assert!((ratio / truth - 1.0).abs() < 0.05, "mass of b over mass of a: {ratio}, not {truth} (no unit)");
/// # Ok::<(), breakshot::Error>(())
/// ```
///
/// # Errors
/// No clip at all, two clips of the same motion, a track of an unknown object, a reference that is not an object.
pub fn estimation(
    clips: &[ClipTracks],
    cell: &Cell,
    objects: &[Object],
    options: &Options,
) -> Result<Estimation> {
    combined(&[], clips, cell, objects, &reference(objects, options)?)
}

/// The properties from the stored measurements of the old clips and the tracks of the new ones.
///
/// The result is that of all clips at once, except that the fits of the old clips keep the noise level and the exposure
/// that the old clips gave by themselves.
///
/// # Errors
/// As [`estimation`]; also another cell, reference or outline than the old clips had, and a clip given twice.
pub fn updated(
    old: &Properties,
    clips: &[ClipTracks],
    cell: &Cell,
    objects: &[Object],
    options: &Options,
) -> Result<Estimation> {
    let earlier = record::earlier(old, clips, cell, objects, options.reference.as_deref())?;
    let all = record::all_objects(old.evidence.as_ref(), objects);
    let mut estimation = combined(&earlier, clips, cell, &all, &old.reference)?;
    if let (Some(now), Some(then)) = (&mut estimation.properties.evidence, &old.evidence) {
        now.clips.splice(0..0, then.clips.iter().cloned());
    }
    Ok(estimation)
}

/// An error unless [`updated`] would accept clips of these names, filmed in this cell; needs no film.
///
/// # Errors
/// Properties without evidence; another cell, reference or outline than the old clips had; the name of an old clip.
pub fn check_update(
    old: &Properties,
    names: &[&str],
    cell: &Cell,
    objects: &[Object],
    options: &Options,
) -> Result<()> {
    record::check_basis(old, names, cell, objects, options.reference.as_deref()).map(|_| ())
}

/// The estimate from the measurements of earlier clips and the tracks of new ones; its evidence holds the new ones only.
fn combined(
    earlier: &[ClipMeasurements],
    clips: &[ClipTracks],
    cell: &Cell,
    objects: &[Object],
    reference: &str,
) -> Result<Estimation> {
    if clips.is_empty() {
        return Err(Error::invalid("estimate", "clips", "none", "the tracks of at least one clip"));
    }

    record::check_distinct(clips)?;

    // First fits, and what all clips together show of noise and exposure
    let first: Vec<ClipEstimate> =
        clips.par_iter().map(|clip| ClipEstimate::new(clip, cell, objects)).collect::<Result<_>>()?;
    let noises: Vec<NoiseStatistics> =
        earlier.iter().map(|r| r.noise).chain(first.iter().map(ClipEstimate::noise)).collect();
    let (position_scales, yaw_scale) = noise_scales(&noises);
    let position_scales = &position_scales[earlier.len()..];
    let chi2: Vec<_> = first
        .iter()
        .zip(position_scales)
        .map(|(estimate, scale)| estimate.chi2_by_exposure(*scale))
        .collect();
    let all_chi2: Vec<_> = earlier.iter().map(|r| r.chi2_by_exposure).chain(chi2.iter().copied()).collect();
    let exposure_frames = exposure::best_frames(&all_chi2);

    // Final fits and their measurements
    let (refitted, (fits, own)): (Vec<ClipEstimate>, (Vec<ClipFit>, Vec<ClipMeasurements>)) =
        (first.par_iter().zip(clips).zip(position_scales).zip(chi2))
            .map(|(((estimate, clip), scale), chi2_by_exposure)| {
                let refitted = estimate.refitted(*scale, yaw_scale, exposure_frames);
                let (fit, measured) = measure::measured(&refitted, clip);
                let noise = estimate.noise();
                (refitted, (fit, ClipMeasurements { noise, chi2_by_exposure, ..measured }))
            })
            .unzip();

    // The same near the frictions that the other clips let expect
    let expected = frictions_of_other_clips(&earlier.iter().chain(&own).collect::<Vec<_>>());
    let new: Vec<ClipMeasurements> =
        (own.into_par_iter().zip(&refitted).zip(clips).zip(&expected[earlier.len()..]))
            .map(|(((own, refitted), clip), expected)| measure::measured_near(expected, refitted, clip, own))
            .collect();

    // All clips together
    let evidence = record::evidence(&new, clips, cell, objects)?;
    let all: Vec<&ClipMeasurements> = earlier.iter().chain(&new).collect();
    let (mut properties, mut warnings) = properties::properties(&all, objects, reference);
    warnings.extend(frame_rate::warnings(&new, clips));
    properties.set_warnings(warnings.clone());
    properties.evidence = Some(evidence);
    Ok(Estimation { properties, clips: fits, warnings })
}

fn reference(objects: &[Object], options: &Options) -> Result<String> {
    match &options.reference {
        Some(name) => Ok(object::find(objects, name, "estimate: reference")?.name.clone()),
        None => (objects.iter().map(|o| o.name.clone()).min())
            .ok_or_else(|| Error::invalid("estimate", "objects", "none", "at least one object")),
    }
}

/// Factors between the actual standard deviation of the noise and the one that the tracks claim: of the positions of each
/// clip, and of all yaws.
///
/// A clip's factor is drawn towards the median of all clips, so that one with few residuals gets nearly that.
fn noise_scales(noises: &[NoiseStatistics]) -> (Vec<f64>, f64) {
    /// The median over all clips has the weight of this many residuals of the clip's own.
    const MEDIAN_WEIGHT: f64 = 20.0;
    let typical = |ratio: &dyn Fn(&NoiseStatistics) -> VarianceRatio| {
        let all = noises.iter().map(ratio).filter(|ratio| ratio.freedom > 2.0);
        let value = median(all.map(|ratio| ratio.squares / ratio.freedom)).unwrap_or(0.0);
        if value > 0.0 { value } else { 1.0 }
    };
    let position = typical(&|noise| noise.position);
    let yaw = typical(&|noise| noise.yaw);
    let scales = noises.iter().map(|noise| {
        let VarianceRatio { squares, freedom } = noise.position;
        ((MEDIAN_WEIGHT * position + squares) / (MEDIAN_WEIGHT + freedom)).sqrt()
    });
    (scales.collect(), yaw.sqrt())
}
