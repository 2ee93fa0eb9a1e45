//! Friction where objects touch each other or the striker, from off-centre impacts.
//!
//! If the contact points still slide over each other when the impact ends, the tangential impulse is the coefficient of
//! friction times the normal one; if they stick, it is less and tells only a lower bound.

use super::contact::{Contact, Party};
use crate::estimate::clip::fit::Fitted;
use crate::estimate::clip::result::Measured;
use crate::estimate::joint::random_effects::{Group, spread};
use crate::uncertain::Estimate;
use serde::{Deserialize, Serialize};

/// Tangential over normal impulse of one impact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Grazing {
    pub(crate) with_striker: bool,
    /// As seen, positive against the slip.
    pub(crate) seen: Measured,
    /// As large as it would have to be to end the slip.
    pub(crate) to_stick: f64,
}

/// The points surely slid if it would have taken this many times the friction to stop them.
const SURELY_SLID: f64 = 1.3;
/// Rocking and uneven faces change the tangential impulse by about this part of the normal one.
const MODEL_STD: f64 = 0.01;
const IMPACTS_NEEDED: usize = 3;
/// A coefficient known no better than this (relative) is not worth giving.
const WORST_KNOWN: f64 = 0.25;

/// What an impact tells about contact friction; the mass ratio is the impact's own.
pub(crate) fn grazing(fitted: &Fitted, contact: &Contact) -> Option<Grazing> {
    if !contact.normal_seen || !contact.restitution || contact.met_twice {
        return None;
    }
    let (normal, along) = (contact.touch.normal_ab, contact.touch.normal_ab.perpendicular());
    let around = contact.around(fitted, &fitted.minimum.parameters);
    let slip = around.relative_at(contact)[0].dot(along);
    let (values, covariance) = fitted.propagated(|parameters| {
        let jump = contact.around(fitted, parameters).jump(1);
        vec![jump.dot(along) / jump.dot(normal)]
    });
    // Velocity changes of the contact points per impulse over the mass of b.
    let mut tangential = 0.0;
    let mut coupling = 0.0;
    let mut add = |k: usize, side: usize, mass_b_over: f64| {
        let lever = contact.touch.point - around.before[side].pose.position;
        let (n, t) = (lever.dot(normal), lever.dot(along));
        let squared = fitted.model.bodies[k].gyration_m.powi(2);
        tangential += mass_b_over * (1.0 + n * n / squared);
        coupling -= mass_b_over * n * t / squared;
    };
    add(contact.b, 1, 1.0);
    if let Party::Body(a) = contact.a {
        let [jump_a, jump_b] = [0, 1].map(|side| around.jump(side).dot(contact.impulse));
        add(a, 0, -jump_a / jump_b);
    }
    let to_stick = (slip / around.jump(1).dot(normal) - coupling) / tangential;
    let seen =
        Measured { value: values[0] * to_stick.signum(), std: covariance[(0, 0)].sqrt().hypot(MODEL_STD) };
    let with_striker = contact.a == Party::Striker;
    (seen.value.is_finite() && seen.std.is_finite() && to_stick.is_finite()).then(|| Grazing {
        with_striker,
        seen,
        to_stick: to_stick.abs(),
    })
}

/// The coefficient that explains all impacts, if enough of them surely slid.
pub(crate) fn coefficient(all: &[Grazing]) -> Option<Estimate> {
    let loss = |friction: f64| -> f64 {
        all.iter()
            .map(|g| ((g.seen.value - friction.min(g.to_stick)) / g.seen.std).powi(2).min(OUTLIER))
            .sum()
    };
    let best = (0..=MOST_TRIED).map(|k| f64::from(k) * STEP).min_by(|p, q| loss(*p).total_cmp(&loss(*q)))?;
    let values: Vec<Measured> =
        all.iter().filter(|g| g.to_stick > SURELY_SLID * best).map(|g| g.seen).collect();
    if best == 0.0 || values.len() < IMPACTS_NEEDED {
        return None;
    }
    let group = Group { values, scale: best };
    let mean = group.mean(spread(std::slice::from_ref(&group)))?;
    let known = mean.value > 0.0 && mean.half_width() < WORST_KNOWN * mean.value;
    known.then(|| mean.estimate(&group))
}

/// Coefficients up to 1.5 are tried in steps of a thousandth.
const STEP: f64 = 1e-3;
const MOST_TRIED: u32 = 1500;
/// No impact counts more than one that is five deviations off.
const OUTLIER: f64 = 25.0;
