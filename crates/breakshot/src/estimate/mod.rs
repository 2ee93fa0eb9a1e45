//! How do the objects slide and bounce?
//!
//! Sections 4.1 to 4.3 of the paper with the corrected equations.  Every clip is fitted as rest, slide, impact, slide,
//! rest, or right around its impacts alone (`clip`); what its impacts tell (`measure`) is weighed against the other
//! clips, and all clips together give friction, restitution and mass ratios with their uncertainty (`joint`).

mod clip;
mod closest_points;
mod design;
mod joint;
mod measure;

pub use clip::result::{BodyFit, ClipFit, Impact, Measured};
pub use clip::sliding::Motion;
pub use design::experiment::Shot;
pub use design::simulated_clip::{Filming, staged};
pub use design::{
    Advice, AdviceOptions, Advised, StruckPile, advice, prediction_error_m, predictive_spread_m, struck_piles,
};
pub use joint::clip_values::{ClipValue, clip_values};

use crate::cell::Cell;
use crate::detect::Tracks;
use crate::error::{Error, Result};
use crate::object::{self, Object};
use crate::properties::Properties;
use crate::scene::Strike;
use clip::fit::Noise;
use clip::{Story, exposure, initial_guess};
use joint::properties;
use joint::record::{self, Record};
use rayon::prelude::*;

/// The tracks of one clip and what the robot was told in it.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipTracks {
    /// The clip's name, as messages call it.
    pub name: String,
    /// Its objects, the struck one first.
    pub objects: Vec<String>,
    /// The strike; none if the objects were set in motion otherwise.
    pub strike: Option<Strike>,
    /// Where the objects were.
    pub tracks: Tracks,
}

/// How to estimate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// The object whose mass is the unit; the first one in the alphabet if not given.
    pub reference: Option<String>,
}

/// The properties, and the fit of every clip that they rest on.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimation {
    /// Friction, restitution, mass ratios.
    pub properties: Properties,
    /// One fit per clip, in the order of the clips.
    pub clips: Vec<ClipFit>,
}

/// Friction, restitution and mass ratios from the tracks of all clips, and the fits that they rest on.
///
/// A quantity that no clip supports is absent and listed in the warnings; a clip that contradicts the others or the
/// model is named there and left out.
///
/// # Errors
/// No clip at all, an object that is not known, a reference that is no object.
pub fn estimation(
    clips: &[ClipTracks],
    cell: &Cell,
    objects: &[Object],
    options: &Options,
) -> Result<Estimation> {
    joint(&[], clips, (cell, objects), &reference(objects, options)?)
}

/// The properties after more clips, without the films of those that the old properties rest on.
///
/// The old evidence is heard again together with the new clips: the result is that of all clips at once, but that the old
/// clips' fits keep the level of noise, and the exposure, that the old clips had agreed on among themselves.
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
    let earlier = record::earlier(old, clips, (cell, objects), options)?;
    let all = record::all_objects(old.evidence.as_ref(), objects);
    let mut estimation = joint(&earlier, clips, (cell, &all), &old.reference)?;
    if let (Some(now), Some(then)) = (&mut estimation.properties.evidence, &old.evidence) {
        now.clips.splice(0..0, then.clips.iter().cloned());
    }
    Ok(estimation)
}

/// An error unless clips of these names, filmed in this cell, may join the old properties: to ask before any film is read.
///
/// # Errors
/// Properties without evidence; another cell, reference or outline than the old clips had; a name that is known.
pub fn check_update(
    old: &Properties,
    names: &[&str],
    (cell, objects): (&Cell, &[Object]),
    options: &Options,
) -> Result<()> {
    record::check_basis(old, names, (cell, objects), options).map(|_| ())
}

/// Earlier clips by their records and new clips by their tracks; the evidence holds the new ones.
fn joint(
    earlier: &[Record],
    clips: &[ClipTracks],
    (cell, objects): (&Cell, &[Object]),
    reference: &str,
) -> Result<Estimation> {
    if clips.is_empty() {
        return Err(Error::invalid("estimate", "clips", "none", "the tracks of at least one clip"));
    }
    let first: Vec<Story> =
        clips.par_iter().map(|clip| Story::new(clip, cell, objects)).collect::<Result<_>>()?;
    let noises: Vec<Noise> = earlier.iter().map(|r| r.noise).chain(first.iter().map(Story::noise)).collect();
    let (place_scales, yaw_scale) = noise_scales(&noises);
    let place_scales = &place_scales[earlier.len()..];
    let misfits: Vec<_> = first.iter().zip(place_scales).map(|(s, scale)| s.misfits(*scale)).collect();
    let all_misfits: Vec<_> = earlier.iter().map(|r| r.misfits).chain(misfits.iter().copied()).collect();
    let found_frames = exposure::found_frames(&all_misfits);
    let (fits, new): (Vec<ClipFit>, Vec<Record>) =
        (first.par_iter().zip(clips).zip(place_scales).zip(misfits))
            .map(|(((story, clip), scale), misfits)| {
                let (fit, record) = story.refined(*scale, yaw_scale, found_frames).told(clip);
                (fit, Record { noise: story.noise(), misfits, ..record })
            })
            .unzip();
    let evidence = record::evidence(&new, clips, cell, objects)?;
    let records: Vec<&Record> = earlier.iter().chain(&new).collect();
    let mut properties = properties::properties(&records, objects, reference);
    properties.evidence = Some(evidence);
    Ok(Estimation { properties, clips: fits })
}

fn reference(objects: &[Object], options: &Options) -> Result<String> {
    match &options.reference {
        Some(name) => Ok(object::find(objects, name, "estimate: reference")?.name.clone()),
        None => (objects.iter().map(|o| o.name.clone()).min())
            .ok_or_else(|| Error::invalid("estimate", "objects", "none", "at least one object")),
    }
}

/// By how much the noise of each clip's places exceeds the claimed one, and of all yaws; clips with few moving sights
/// lean on the others.
fn noise_scales(noises: &[Noise]) -> (Vec<f64>, f64) {
    /// The common noise counts as much as this many residuals of the clip's own.
    const COMMON: f64 = 20.0;
    let typical = |sums: &dyn Fn(&Noise) -> [f64; 2]| {
        let all = noises.iter().map(sums).filter(|[_, freedom]| *freedom > 2.0);
        let value = initial_guess::median(all.map(|[squares, freedom]| squares / freedom));
        if value > 0.0 { value } else { 1.0 }
    };
    let place = typical(&|n| n.place);
    let yaw = typical(&|n| n.yaw);
    let scales = noises.iter().map(|noise| {
        let [squares, freedom] = noise.place;
        ((COMMON * place + squares) / (COMMON + freedom)).sqrt()
    });
    (scales.collect(), yaw.sqrt())
}
