//! The mass ratio of one impact (Eq. 33 and 34 as corrected).

use super::contact::{Around, Contact};
use crate::estimate::clip::fit::Fitted;
use crate::estimate::clip::result::Measured;

/// The impulses on two bodies are opposite within this angle (rad), and within this many deviations.
const OPPOSITE_RAD: f64 = 0.15;
const OPPOSITE_STDS: f64 = 6.0;

/// The logarithm of mass a over mass b: the velocity changes of the centroids along the impulse are as the inverse
/// masses.  Restitution and inertia cancel.
pub(crate) fn log_ratio(contact: &Contact, around: &Around) -> f64 {
    let [a, b] = [0, 1].map(|side| around.jump(side).dot(contact.impulse));
    (-b / a).ln()
}

/// The impulses on the two bodies must be opposite.
pub(crate) fn check_momentum(fitted: &Fitted, contact: &mut Contact, a: usize) {
    let along = contact.impulse;
    let around = contact.around(fitted, &fitted.minimum.parameters);
    if around.jump(0).dot(along) >= 0.0 || around.jump(1).dot(along) <= 0.0 {
        let names = [a, contact.b].map(|k| fitted.model.bodies[k].object.clone());
        let [a, b] = names;
        contact.leave_out(format!("momentum does not add up: `{a}` and `{b}` were pushed the same way"));
        return;
    }
    let (angles, covariance) = fitted.propagated(|parameters| {
        let around = contact.around(fitted, parameters);
        let slope = |side: usize| along.cross(around.jump(side)) / along.dot(around.jump(side));
        vec![slope(1) - slope(0)]
    });
    let (angle_rad, std_rad) = (angles[0].atan().abs(), covariance[(0, 0)].sqrt());
    if angle_rad > OPPOSITE_RAD && angle_rad > OPPOSITE_STDS * std_rad {
        contact.leave_out(format!(
            "momentum does not add up: the impulses are {:.0} degrees from opposite",
            angle_rad.to_degrees()
        ));
    }
}

/// Which share of contact friction is expected to act along the vertical: the taller body rocks forward when it
/// strikes, its face moves down, presses the struck body onto the table and lifts its own.
///
/// The table's friction takes `share x contact friction x friction` of the impulse more from the one and less from
/// the other, at once: the ratio of the velocity changes is off by that times the difference of the two frictions.
/// The share lies between none and all where the taller strikes; which way friction acts is open where the shorter does.
pub(crate) fn pressing(fitted: &Fitted, contact: &Contact, a: usize) -> f64 {
    /// Heights that differ by less than this (relative) are alike.
    const ALIKE: f64 = 0.1;
    let around = contact.around(fitted, &fitted.minimum.parameters);
    let a_strikes = around.before[0].velocity.length() >= around.before[1].velocity.length();
    let [height_a, height_b] = [a, contact.b].map(|k| fitted.model.bodies[k].height_m);
    let (striking, struck) = if a_strikes { (height_a, height_b) } else { (height_b, height_a) };
    let taller = (striking - struck) / striking.min(struck);
    MEAN_SHARE * f64::midpoint(1.0, (taller / ALIKE).clamp(-1.0, 1.0))
}

/// A share between none and all: its mean and standard deviation.
const MEAN_SHARE: f64 = 0.5;
const SHARE_STD: f64 = 0.29;

/// How uncertain the vertical part of the impulse is, over the horizontal one.
pub(crate) fn pressing_std(contact_friction: Measured) -> f64 {
    (contact_friction.value * SHARE_STD).hypot(contact_friction.std * MEAN_SHARE)
}
