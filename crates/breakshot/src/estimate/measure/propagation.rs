//! The measurements of one motion fit, with their joint covariance by linear error propagation.

use super::contact::{self, Contact, Partner};
use super::measurements::Measurements;
use super::quantity::Quantity;
use super::sliding::tilt::{ClipTilt, TiltEffect};
use super::{impulse_ratio, restitution, screening};
use crate::estimate::clip::fit::MotionFit;
use crate::estimate::clip::result::{Impact, Measured};
use crate::estimate::clip::striker::path::StrikerPath;
use crate::object::kind;
use nalgebra::{DMatrix, DVector};
use std::collections::{BTreeMap, BTreeSet};

/// What one motion fit measures.
pub(crate) struct FitMeasurements {
    pub(crate) impacts: Vec<Impact>,
    pub(crate) contacts: Vec<Contact>,
    /// The friction of each body; `None` for one that does not slide.
    pub(crate) frictions: Vec<Option<Measured>>,
    pub(crate) measurements: Measurements,
    /// What the fit shows of a tilted table.
    pub(crate) tilt: Option<ClipTilt>,
}

/// Values, the covariance of their noise, and their change by a slope of one along x and y.
struct Propagated {
    values: Vec<f64>,
    covariance: DMatrix<f64>,
    by_slope: DMatrix<f64>,
}

/// Values of one contact: time (s), restitution, logarithm of the mass ratio.
const CONTACT_VALUES: usize = 3;

impl FitMeasurements {
    pub(crate) fn new(fitted: &MotionFit, striker: Option<&StrikerPath>) -> Self {
        let mut contacts = contact::contacts(fitted, striker);
        let without_friction = screening::screen(fitted, striker, &mut contacts);
        let indices = &fitted.layout.bodies;
        let shown = |k: &usize| indices[*k].friction.is_some() && !without_friction.contains(k);
        let sliding: Vec<usize> = (0..indices.len()).filter(shown).collect();
        let (values, slopes) = fitted.slopes(|parameters| {
            let of_contacts = contacts.iter().flat_map(|c| contact_values(c, fitted, parameters));
            let frictions = sliding.iter().filter_map(|&k| indices[k].friction.map(|f| parameters[f]));
            frictions.chain(of_contacts).collect()
        });
        let covariance = &slopes * &fitted.minimum.covariance * slopes.transpose();
        let effect = TiltEffect::new(fitted);
        let by_slope = slopes * &effect.shifts;
        let std = |k: usize| covariance[(k, k)].max(0.0).sqrt();
        let mut frictions = vec![None; indices.len()];
        for (n, &k) in sliding.iter().enumerate() {
            frictions[k] = Some(Measured { value: values[n], std: std(n) });
        }
        let impacts = (contacts.iter().enumerate()).map(|(n, contact)| {
            let at = sliding.len() + CONTACT_VALUES * n;
            impact(contact, fitted, [at, at + 1, at + 2].map(|k| Measured { value: values[k], std: std(k) }))
        });
        let impacts = impacts.collect();
        let propagated = Propagated { values, covariance, by_slope };
        let measurements = measurements(fitted, &contacts, &sliding, &propagated);
        Self { impacts, contacts, frictions, measurements, tilt: effect.tilt }
    }
}

/// Time (s), restitution, and logarithm of the mass ratio of a contact for these parameters of the fit.
fn contact_values(contact: &Contact, fitted: &MotionFit, parameters: &[f64]) -> [f64; CONTACT_VALUES] {
    let motions = contact.motions(fitted, parameters);
    let log_ratio = if contact.mass_ratio { impulse_ratio::log_ratio(contact, &motions) } else { 0.0 };
    [parameters[contact.time_index], restitution::restitution(contact, &motions), log_ratio]
}

/// The impact for the user, from the values of [`contact_values`].
fn impact(contact: &Contact, fitted: &MotionFit, values: [Measured; CONTACT_VALUES]) -> Impact {
    let [time, restitution, log_ratio] = values;
    let motions = contact.motions(fitted, &fitted.minimum.parameters);
    let name = |k: usize| fitted.model.bodies[k].object.clone();
    let ratio = log_ratio.value.exp();
    Impact {
        time,
        a: match contact.a {
            Partner::Striker => Some("striker".into()),
            Partner::Body(k) => Some(name(k)),
            Partner::Unknown => None,
        },
        b: name(contact.b),
        normal_ab: contact.closest.normal_ab,
        point: contact.closest.point,
        gap_m: contact.closest.gap_m,
        striker_distance_m: contact.striker_distance_m,
        before: motions.before,
        after: motions.after,
        restitution: contact.restitution.then_some(restitution),
        mass_ratio: contact.mass_ratio.then_some(Measured { value: ratio, std: log_ratio.std * ratio }),
        remarks: contact.remarks.clone(),
    }
}

/// The measurements of a fit.
///
/// `propagated` holds the frictions of the bodies in `sliding`, then the [`contact_values`] of each contact.
fn measurements(
    fitted: &MotionFit,
    contacts: &[Contact],
    sliding: &[usize],
    propagated: &Propagated,
) -> Measurements {
    let Propagated { values, covariance, by_slope } = propagated;
    let name = |k: usize| kind(&fitted.model.bodies[k].object).to_owned();
    // Index among the values, quantity, and sign: the ratio of b to a is the negative logarithm.
    let mut chosen: Vec<(usize, Quantity, f64)> = Vec::new();
    let mut vertical_fractions: BTreeMap<usize, f64> = BTreeMap::new();
    let mut double_contacts: BTreeSet<usize> = BTreeSet::new();
    for (n, &k) in sliding.iter().enumerate() {
        chosen.push((n, Quantity::Friction(name(k)), 1.0));
    }
    for (n, contact) in contacts.iter().enumerate() {
        let at = sliding.len() + CONTACT_VALUES * n;
        let (restitution, ratio) = (at + 1, at + 2);
        let b = name(contact.b);
        if contact.is_double {
            double_contacts.insert(restitution);
        }
        match contact.a {
            Partner::Striker if contact.restitution => {
                chosen.push((restitution, Quantity::StrikerRestitution(b), 1.0));
            }
            Partner::Body(a) => {
                // Of two copies: the struck one, which the clip names first, over the other.
                let forward = name(a) < b || (name(a) == b && a < contact.b);
                let (one, other) = if name(a) <= b { (name(a), b) } else { (b, name(a)) };
                if contact.restitution {
                    chosen.push((restitution, Quantity::Restitution(one.clone(), other.clone()), 1.0));
                }
                if contact.mass_ratio {
                    chosen.push((ratio, Quantity::MassRatio(one, other), if forward { 1.0 } else { -1.0 }));
                    vertical_fractions.insert(ratio, impulse_ratio::vertical_fraction(fitted, contact, a));
                }
            }
            _ => {}
        }
    }
    chosen.retain(|(k, ..)| values[*k].is_finite() && covariance[(*k, *k)].is_finite());

    let size = chosen.len();
    Measurements {
        quantities: chosen.iter().map(|c| c.1.clone()).collect(),
        vertical_fractions: (chosen.iter().map(|c| vertical_fractions.get(&c.0).copied().unwrap_or(0.0)))
            .collect(),
        double_contact: chosen.iter().map(|c| double_contacts.contains(&c.0)).collect(),
        by_slope: (chosen.iter().map(|c| [0, 1].map(|axis| c.2 * by_slope[(c.0, axis)]))).collect(),
        values: DVector::from_fn(size, |r, _| chosen[r].2 * values[chosen[r].0]),
        covariance: DMatrix::from_fn(size, size, |r, c| {
            chosen[r].2 * chosen[c].2 * covariance[(chosen[r].0, chosen[c].0)]
        }),
    }
}
