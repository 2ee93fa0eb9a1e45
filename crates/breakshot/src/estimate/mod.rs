//! How do the objects slide and bounce?
//!
//! Sections 4.1 to 4.3 of the paper with the corrected equations: every clip is fitted as rest, slide, impact, slide,
//! rest; the fits of all clips together give friction, restitution and mass ratios with their uncertainty.

mod clip;
mod clip_fit;
mod exposure;
mod impact;
mod joint;
mod least_squares;
mod segment;
mod slide;
mod spread;
mod striker;
mod touch;

pub use impact::{Impact, Measured};
pub use slide::Motion;

use crate::cell::Cell;
use crate::detect::Tracks;
use crate::error::{Error, Result};
use crate::object::{self, Object, kind};
use crate::properties::Properties;
use crate::scene::Strike;
use crate::uncertain::Estimate;
use clip::{Cause, Path};
use clip_fit::Fitted;
use impact::{Contact, Party};
use joint::{Joint, Key, Readings};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
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

/// The most likely motion of one clip's bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipFit {
    /// The clip.
    pub name: String,
    /// One fit per object, in the order of the clip's objects.
    pub bodies: Vec<BodyFit>,
    /// All impacts, in order of time.
    pub impacts: Vec<Impact>,
    /// How far the sights of moving bodies lie from the fit (m, root mean square, both axes together).
    pub residual_rms_m: f64,
    /// What the user should know.
    pub remarks: Vec<String>,
}

/// One object of a fitted clip.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyFit {
    /// The object.
    pub object: String,
    /// Its friction against the table, if it slid.
    pub friction: Option<Measured>,
    path: Path,
}

impl BodyFit {
    /// Its fitted motion at a time of the clip; at the instant of an impact, the one after it.
    pub fn motion(&self, time_s: f64) -> Motion {
        self.path.motion(time_s)
    }
}

/// Friction, restitution and mass ratios from the tracks of all clips, and the fits that they rest on.
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
    if std::env::var("DBG").is_ok() {
        eprintln!(
            "exposure {found_frames:?} {:?}",
            (0..10)
                .map(|k| misfits.iter().map(|m| m.0[k]).sum::<f64>()
                    / misfits.iter().map(|m| m.1 as f64).sum::<f64>())
                .collect::<Vec<_>>()
        );
    }
    let fits: Vec<(ClipFit, Readings)> = first
        .par_iter()
        .zip(clips)
        .zip(&place_scales)
        .map(|(((fitted, run), clip), scale)| {
            let refined = fitted.refined(*scale, yaw_scale, exposure::settled(fitted, found_frames));
            second_fit(&refined, run.as_ref(), clip)
        })
        .collect();
    let readings: Vec<Readings> = fits.iter().map(|(_, r)| r.clone()).collect();
    let expected = joint::expected_frictions(&readings);
    let readings: Vec<Readings> = readings.iter().map(|r| r.given_friction(&expected)).collect();
    let joint = Joint::new(&readings, &reference);
    let clips: Vec<ClipFit> = fits.into_iter().map(|(fit, _)| fit).collect();
    Ok(Estimation { properties: properties(&joint, &clips, reference), clips })
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

fn second_fit(fitted: &Fitted, run: Option<&StrikerRun>, clip: &ClipTracks) -> (ClipFit, Readings) {
    let contacts = impact::contacts(fitted, run);
    let frictions: Vec<(usize, usize)> = (fitted.layout.bodies.iter().enumerate())
        .filter_map(|(k, slots)| slots.friction.map(|slot| (k, slot)))
        .collect();
    let (values, covariance) = fitted.propagated(|parameters| {
        let of_contacts = contacts.iter().flat_map(|c| c.values(fitted, parameters));
        frictions.iter().map(|(_, slot)| parameters[*slot]).chain(of_contacts).collect()
    });
    let std = |k: usize| covariance[(k, k)].max(0.0).sqrt();
    let first = |n: usize| frictions.len() + 3 * n;
    let mut bodies: Vec<BodyFit> = (fitted.model.bodies.iter().zip(&fitted.paths))
        .map(|(body, path)| BodyFit { object: body.object.clone(), friction: None, path: path.clone() })
        .collect();
    for (n, &(k, _)) in frictions.iter().enumerate() {
        bodies[k].friction = Some(Measured { value: values[n], std: std(n) });
    }
    let impacts = (contacts.iter().enumerate())
        .map(|(n, c)| c.impact(fitted, [std(first(n)), std(first(n) + 1), std(first(n) + 2)]))
        .collect();
    let readings = readings(fitted, &contacts, &frictions, (&values, &covariance));
    let fit = ClipFit {
        name: clip.name.clone(),
        bodies,
        impacts,
        residual_rms_m: residual_rms_m(fitted),
        remarks: fitted.remarks.clone(),
    };
    (fit, readings)
}

fn residual_rms_m(fitted: &Fitted) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for (body, path) in fitted.model.bodies.iter().zip(&fitted.paths) {
        for sight in body.sights.iter().filter(|s| !s.ignored) {
            if sight.time_s > path.onset_s() && sight.time_s < path.stop_s() {
                squares += (sight.position - path.motion(sight.time_s).pose.position).length_squared();
                count += 1.0;
            }
        }
    }
    if count > 0.0 { f64::sqrt(squares / count) } else { 0.0 }
}

/// What a clip tells, by quantity.
fn readings(
    fitted: &Fitted,
    contacts: &[Contact],
    frictions: &[(usize, usize)],
    (values, covariance): (&[f64], &DMatrix<f64>),
) -> Readings {
    let name = |k: usize| kind(&fitted.model.bodies[k].object).to_owned();
    // Where the value stands, what it is, and its sign: the ratio of b to a is the negative logarithm.
    let mut chosen: Vec<(usize, Key, f64)> = Vec::new();
    for (n, &(k, _)) in frictions.iter().enumerate() {
        chosen.push((n, Key::Friction(name(k)), 1.0));
    }
    for (n, contact) in contacts.iter().enumerate() {
        let (restitution, ratio) = (frictions.len() + 3 * n + 1, frictions.len() + 3 * n + 2);
        match contact.a {
            Party::Striker if contact.restitution => {
                chosen.push((restitution, Key::StrikerRestitution(name(contact.b)), 1.0));
            }
            Party::Body(a) => {
                let (one, other) = (name(a), name(contact.b));
                // Two copies: the struck one, which the clip names first, over the other.
                let forward = one < other || (one == other && a < contact.b);
                let (one, other) = if one <= other { (one, other) } else { (other, one) };
                if contact.restitution {
                    chosen.push((restitution, Key::Restitution(one.clone(), other.clone()), 1.0));
                }
                if contact.mass_ratio {
                    chosen.push((ratio, Key::MassRatio(one, other), if forward { 1.0 } else { -1.0 }));
                }
            }
            _ => {}
        }
    }
    chosen.retain(|(k, ..)| values[*k].is_finite() && covariance[(*k, *k)].is_finite());
    let size = chosen.len();
    Readings {
        keys: chosen.iter().map(|c| c.1.clone()).collect(),
        values: DVector::from_fn(size, |r, _| chosen[r].2 * values[chosen[r].0]),
        covariance: DMatrix::from_fn(size, size, |r, c| {
            chosen[r].2 * chosen[c].2 * covariance[(chosen[r].0, chosen[c].0)]
        }),
    }
}

fn properties(joint: &Joint, clips: &[ClipFit], reference: String) -> Properties {
    let mut properties = Properties { version: 1, reference: reference.clone(), ..Properties::default() };
    for (key, (group, mean)) in &joint.groups {
        match key {
            Key::Friction(object) => properties.friction.insert(object.clone(), mean.estimate(group)),
            Key::StrikerRestitution(object) => {
                properties.striker_restitution.insert(object.clone(), mean.estimate(group))
            }
            Key::Restitution(a, b) => properties.restitution.insert(format!("{a}/{b}"), mean.estimate(group)),
            Key::MassRatio(a, b) => {
                let estimate = joint::exponential(mean, group.std(), group.values.len());
                properties.pair_mass_ratio.insert(format!("{a}/{b}"), estimate)
            }
        };
    }
    properties.mass_ratio.insert(reference, Estimate::exact(1.0));
    for (object, mean) in &joint.log_masses {
        properties.mass_ratio.insert(object.clone(), joint::exponential(mean, None, 0));
    }
    properties.covariance = joint.covariance.clone();
    for clip in clips {
        let of_impacts = clip.impacts.iter().flat_map(|i| &i.remarks);
        properties
            .warnings
            .extend(clip.remarks.iter().chain(of_impacts).map(|r| format!("{}: {r}", clip.name)));
    }
    let _ = Cause::Unknown;
    properties
}
