//! One clip, fitted: as a whole, or, if something else than Coulomb friction slows its bodies, around its impacts.

pub(crate) mod consistency;
pub(crate) mod exposure;
pub(crate) mod fit;
pub(crate) mod impact_windows;
pub(crate) mod initial_guess;
pub(crate) mod least_squares;
pub(crate) mod motion_model;
pub(crate) mod result;
pub(crate) mod sliding;
pub(crate) mod striker_path;
#[cfg(test)]
mod support_tests;

use super::ClipTracks;
use crate::cell::Cell;
use crate::error::Result;
use crate::estimate::joint::record::{Record, Seen};
use crate::estimate::measure::contact::Contact;
use crate::estimate::measure::quantity::Readings;
use crate::estimate::measure::{contact, contact_friction, friction, screening};
use crate::object::{self, Object, kind};
use exposure::Misfits;
use fit::{Fitted, Noise};
use initial_guess::Draft;
use motion_model::Exposure;
use result::{BodyFit, ClipFit, Impact, Measured};
use striker_path::StrikerRun;

/// A clip's fits.
#[derive(Clone, Debug)]
pub(crate) struct Story {
    whole: Fitted,
    /// Around the impacts; empty if the whole tells them.
    parts: Vec<Fitted>,
    run: Option<StrikerRun>,
}

/// What one fit tells.
struct Told {
    impacts: Vec<Impact>,
    contacts: Vec<Contact>,
    /// By body.
    frictions: Vec<Option<Measured>>,
    readings: Readings,
}

impl Story {
    /// The first fit, from the sights of this clip alone.
    pub(crate) fn new(clip: &ClipTracks, cell: &Cell, objects: &[Object]) -> Result<Self> {
        let kinds = (clip.tracks.tracks.iter())
            .map(|track| object::find(objects, &track.object, &clip.name))
            .collect::<Result<Vec<_>>>()?;
        let run = clip.strike.as_ref().map(|strike| StrikerRun::new(&cell.striker, strike));
        let mut bodies = initial_guess::bodies(&clip.tracks.tracks, &kinds);
        let all = bodies.clone();
        let told = exposure::told(cell, initial_guess::frame_s(&bodies));
        let exposure = initial_guess::bin(&mut bodies).map_or(told, Exposure::Known);
        let mut whole = Fitted::new(Draft::new(bodies, run.as_ref(), exposure), run.as_ref());
        whole.uneven |= !impact_windows::unevenly_slowed(&whole).is_empty();
        let parts =
            if whole.uneven { impact_windows::around_impacts(all, run.as_ref(), told) } else { Vec::new() };
        Ok(Self { whole, parts, run })
    }

    /// The fits that tell of impacts.
    fn tellers(&self) -> &[Fitted] {
        if self.whole.uneven { &self.parts } else { std::slice::from_ref(&self.whole) }
    }

    /// How large the residuals are against what the tracks claim.
    pub(crate) fn noise(&self) -> Noise {
        let add = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
        self.tellers().iter().fold(Noise::default(), |sum, f| Noise {
            place: add(sum.place, f.noise.place),
            yaw: add(sum.yaw, f.noise.yaw),
        })
    }

    /// What the fits take for the noise of a yaw (rad).
    pub(crate) fn yaw_std_rad(&self) -> f64 {
        self.whole.model.yaw_std_rad
    }

    /// How badly each exposure explains the frames around impacts.
    pub(crate) fn misfits(&self, place_scale: f64) -> Misfits {
        if self.whole.uneven { Misfits::default() } else { exposure::misfits(&self.whole, place_scale) }
    }

    /// The fits again, with what all clips together tell about noise and shutter.
    pub(crate) fn refined(&self, place_scale: f64, yaw_scale: f64, found_frames: Option<f64>) -> Self {
        let refined =
            |fit: &Fitted| fit.refined(place_scale, yaw_scale, exposure::settled(fit, found_frames));
        if self.whole.uneven {
            let whole = self.whole.noisier(place_scale, yaw_scale);
            return Self { whole, parts: self.parts.iter().map(refined).collect(), run: self.run.clone() };
        }
        Self { whole: refined(&self.whole), parts: Vec::new(), run: self.run.clone() }
    }

    /// What the clip's final fits tell.
    pub(crate) fn told(&self, clip: &ClipTracks) -> (ClipFit, Record) {
        let (whole, run) = (&self.whole, self.run.as_ref());
        let tellers = self.tellers();
        let told: Vec<Told> = tellers.iter().map(|fitted| Told::new(fitted, run)).collect();
        let frictions = told.first().filter(|_| !whole.uneven).map(|t| t.frictions.as_slice());
        let bodies =
            whole.model.bodies.iter().zip(&whole.paths).enumerate().map(|(k, (body, path))| BodyFit {
                object: body.object.clone(),
                friction: frictions.and_then(|f| f[k]),
                path: path.clone(),
            });
        let uneven = if whole.uneven { impact_windows::unevenly_slowed(whole) } else { Vec::new() };
        let slowed = uneven.iter().map(|object| {
            format!("friction of `{object}` is left out: its deceleration is not Coulomb's in this clip")
        });
        let fit = ClipFit {
            name: clip.name.clone(),
            bodies: bodies.collect(),
            impacts: told.iter().flat_map(|t| t.impacts.iter().cloned()).collect(),
            residual_rms_m: whole.residual_rms_m(),
            remarks: whole.remarks.iter().cloned().chain(slowed).collect(),
        };
        let of_impacts = fit.impacts.iter().flat_map(|i| &i.remarks);
        let upset = consistency::contradiction(whole, run.is_some());
        let remarks = upset.iter().chain(&fit.remarks).chain(of_impacts).cloned().collect();
        let readings: Vec<Readings> = told.iter().map(|t| t.readings.clone()).collect();
        let grazings = tellers.iter().zip(&told).flat_map(|(fitted, told)| {
            told.contacts.iter().filter_map(|c| contact_friction::grazing(fitted, c))
        });
        let record = Record {
            name: clip.name.clone(),
            objects: fit.bodies.iter().map(|b| b.object.clone()).collect(),
            readings: Readings::joined(&readings),
            drags: if whole.uneven { Vec::new() } else { friction::drags(whole) },
            uneven: uneven.iter().map(|object| kind(object).to_owned()).collect(),
            grazings: grazings.collect(),
            noise: whole.noise,
            misfits: Misfits::default(),
            seen: Seen::new(whole),
            remarks,
        };
        // Nothing of a clip whose story does not hold together is averaged in.
        let record = if upset.is_some() { record.silenced() } else { record };
        (fit, record)
    }
}

impl Told {
    fn new(fitted: &Fitted, run: Option<&StrikerRun>) -> Self {
        let mut contacts = contact::contacts(fitted, run);
        screening::leave_out(fitted, &mut contacts);
        let slots = &fitted.layout.bodies;
        let slid: Vec<usize> = (0..slots.len()).filter(|&k| slots[k].friction.is_some()).collect();
        let (values, covariance) = fitted.propagated(|parameters| {
            let of_contacts = contacts.iter().flat_map(|c| c.values(fitted, parameters));
            slid.iter().filter_map(|&k| slots[k].friction.map(|f| parameters[f])).chain(of_contacts).collect()
        });
        let std = |k: usize| covariance[(k, k)].max(0.0).sqrt();
        let mut frictions = vec![None; slots.len()];
        for (n, &k) in slid.iter().enumerate() {
            frictions[k] = Some(Measured { value: values[n], std: std(n) });
        }
        let impacts = (contacts.iter().enumerate()).map(|(n, contact)| {
            let at = slid.len() + 3 * n;
            contact.impact(fitted, [at, at + 1, at + 2].map(std))
        });
        let impacts = impacts.collect();
        let readings = Readings::new(fitted, &contacts, &slid, (&values, &covariance));
        Self { impacts, contacts, frictions, readings }
    }
}
