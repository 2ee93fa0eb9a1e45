//! How do the objects slide and bounce?
//!
//! Sections 4.1 to 4.3 of the paper with the corrected equations.  Every clip is fitted as rest, slide, impact, slide,
//! rest (`segment`, `clip`, `clip_fit`); what its impacts tell (`contact`, `friction`, `restitution`, `mass_ratio`) is
//! weighed against the other clips (`doubt`, `spread`), and all clips together give friction, restitution and mass
//! ratios with their uncertainty (`joint`).

mod clip;
mod clip_fit;
mod contact;
mod contact_friction;
mod doubt;
mod exposure;
mod friction;
mod impact;
mod joint;
mod least_squares;
mod mass_ratio;
mod reading;
mod restitution;
mod segment;
mod slide;
mod spread;
mod striker;
mod summary;
mod touch;

pub use impact::{BodyFit, ClipFit, Impact, Measured};
pub use slide::Motion;

use crate::cell::Cell;
use crate::detect::Tracks;
use crate::error::{Error, Result};
use crate::object::{self, Object};
use crate::properties::Properties;
use crate::scene::Strike;
use clip_fit::Fitted;
use contact_friction::Grazing;
use friction::Drag;
use rayon::prelude::*;
use reading::Readings;
use segment::Draft;
use striker::StrikerRun;

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

/// What one clip tells before the others are heard.
struct Told {
    fit: ClipFit,
    readings: Readings,
    drags: Vec<Drag>,
    grazings: Vec<Grazing>,
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
    if clips.is_empty() {
        return Err(Error::invalid("estimate", "clips", "none", "the tracks of at least one clip"));
    }
    let reference = reference(objects, options)?;
    let first: Vec<(Fitted, Option<StrikerRun>)> =
        clips.par_iter().map(|clip| first_fit(clip, cell, objects)).collect::<Result<_>>()?;
    let (place_scales, yaw_scale) = noise_scales(&first);
    let misfits: Vec<_> =
        first.iter().zip(&place_scales).map(|((f, _), s)| exposure::misfits(f, *s)).collect();
    let found_frames = exposure::found_frames(&misfits);
    let told: Vec<Told> = (first.par_iter().zip(clips).zip(&place_scales))
        .map(|(((fitted, run), clip), scale)| {
            let exposure = exposure::settled(fitted, found_frames);
            told(&fitted.refined(*scale, yaw_scale, exposure), run.as_ref(), clip)
        })
        .collect();
    Ok(summary::estimation(told, objects, reference))
}

fn reference(objects: &[Object], options: &Options) -> Result<String> {
    match &options.reference {
        Some(name) => Ok(object::find(objects, name, "estimate: reference")?.name.clone()),
        None => (objects.iter().map(|o| o.name.clone()).min())
            .ok_or_else(|| Error::invalid("estimate", "objects", "none", "at least one object")),
    }
}

fn first_fit(clip: &ClipTracks, cell: &Cell, objects: &[Object]) -> Result<(Fitted, Option<StrikerRun>)> {
    let kinds = (clip.tracks.tracks.iter())
        .map(|track| object::find(objects, &track.object, &clip.name))
        .collect::<Result<Vec<_>>>()?;
    let run = clip.strike.as_ref().map(|strike| StrikerRun::new(&cell.striker, strike));
    let bodies = segment::bodies(&clip.tracks.tracks, &kinds);
    let exposure = exposure::told(cell, segment::frame_s(&bodies));
    let draft = Draft::new(bodies, run.as_ref(), exposure);
    Ok((Fitted::new(draft, run.as_ref()), run))
}

/// By how much the noise of each clip's places exceeds the claimed one, and of all yaws; clips with few moving sights
/// lean on the others.
fn noise_scales(fits: &[(Fitted, Option<StrikerRun>)]) -> (Vec<f64>, f64) {
    /// The common noise counts as much as this many residuals of the clip's own.
    const COMMON: f64 = 20.0;
    let typical = |sums: &dyn Fn(&Fitted) -> [f64; 2]| {
        let all = fits.iter().map(|(f, _)| sums(f)).filter(|[_, freedom]| *freedom > 2.0);
        let value = segment::median(all.map(|[squares, freedom]| squares / freedom));
        if value > 0.0 { value } else { 1.0 }
    };
    let place = typical(&|f| f.noise.place);
    let yaw = typical(&|f| f.noise.yaw);
    let scales = fits.iter().map(|(f, _)| {
        let [squares, freedom] = f.noise.place;
        ((COMMON * place + squares) / (COMMON + freedom)).sqrt()
    });
    (scales.collect(), yaw.sqrt())
}

/// What a clip's final fit tells.
fn told(fitted: &Fitted, run: Option<&StrikerRun>, clip: &ClipTracks) -> Told {
    let contacts = contact::contacts(fitted, run);
    let slots = &fitted.layout.bodies;
    let slid: Vec<usize> = (0..slots.len()).filter(|&k| slots[k].friction.is_some()).collect();
    let (values, covariance) = fitted.propagated(|parameters| {
        let of_contacts = contacts.iter().flat_map(|c| c.values(fitted, parameters));
        slid.iter().filter_map(|&k| slots[k].friction.map(|f| parameters[f])).chain(of_contacts).collect()
    });
    let std = |k: usize| covariance[(k, k)].max(0.0).sqrt();
    let mut bodies: Vec<BodyFit> = (fitted.model.bodies.iter().zip(&fitted.paths))
        .map(|(body, path)| BodyFit { object: body.object.clone(), friction: None, path: path.clone() })
        .collect();
    for (n, &k) in slid.iter().enumerate() {
        bodies[k].friction = Some(Measured { value: values[n], std: std(n) });
    }
    let impacts = (contacts.iter().enumerate()).map(|(n, contact)| {
        let at = slid.len() + 3 * n;
        contact.impact(fitted, [at, at + 1, at + 2].map(std))
    });
    let fit = ClipFit {
        name: clip.name.clone(),
        bodies,
        impacts: impacts.collect(),
        residual_rms_m: fitted.residual_rms_m(),
        remarks: fitted.remarks.clone(),
    };
    Told {
        fit,
        readings: Readings::new(fitted, &contacts, &slid, (&values, &covariance)),
        drags: friction::drags(fitted),
        grazings: contacts.iter().filter_map(|c| contact_friction::grazing(fitted, c)).collect(),
    }
}
