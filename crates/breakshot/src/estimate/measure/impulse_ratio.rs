//! The mass ratio of one impact, from the ratio of the velocity changes (Eq. 33 and 34 as corrected).

use super::contact::{Contact, MotionsAtImpact};
use crate::estimate::clip::fit::MotionFit;
use crate::estimate::clip::result::Measured;

/// The impulses on two bodies are opposite within this angle (rad), or within this many standard deviations.
const OPPOSITE_RAD: f64 = 0.15;
const OPPOSITE_STDS: f64 = 6.0;
/// Mean and standard deviation of the fraction of contact friction that acts vertically: any value between none and all
/// is equally likely.
const MEAN_VERTICAL_FRACTION: f64 = 0.5;
const VERTICAL_FRACTION_STD: f64 = 0.29;

/// The logarithm of mass a over mass b: the velocity changes of the centroids along the impulse are inversely
/// proportional to the masses.  Restitution and moments of inertia cancel.
pub(crate) fn log_ratio(contact: &Contact, motions: &MotionsAtImpact) -> f64 {
    let [a, b] = [0, 1].map(|side| motions.velocity_change(side).dot(contact.impulse_direction));
    (-b / a).ln()
}

/// Excludes the contact of bodies `a` and b unless the impulses on them are opposite; whether they are.
pub(crate) fn check_momentum(fitted: &MotionFit, contact: &mut Contact, a: usize) -> bool {
    let along = contact.impulse_direction;
    let motions = contact.motions(fitted, &fitted.minimum.parameters);
    if motions.velocity_change(0).dot(along) >= 0.0 || motions.velocity_change(1).dot(along) <= 0.0 {
        let [a, b] = [a, contact.b].map(|k| fitted.model.bodies[k].object.clone());
        contact.exclude(format!(
            "momentum is not conserved: the impulses on `{a}` and `{b}` have the same direction"
        ));
        return false;
    }
    let (angles, covariance) = fitted.propagated(|parameters| {
        let motions = contact.motions(fitted, parameters);
        let slope = |side: usize| {
            let change = motions.velocity_change(side);
            along.cross(change) / along.dot(change)
        };
        vec![slope(1) - slope(0)]
    });
    let (angle_rad, std_rad) = (angles[0].atan().abs(), covariance[(0, 0)].sqrt());
    let are_opposite = angle_rad <= OPPOSITE_RAD || angle_rad <= OPPOSITE_STDS * std_rad;
    if !are_opposite {
        contact.exclude(format!(
            "momentum is not conserved: the impulses are {:.0} degrees from opposite",
            angle_rad.to_degrees()
        ));
    }
    are_opposite
}

/// The fraction of contact friction that is expected to act along the vertical in an impact of bodies `a` and b.
///
/// A taller striking body rocks forward: its face moves down, presses the struck body onto the table and lifts its own.
/// The table's friction then takes `fraction x contact friction x friction` of the impulse more from one body and less
/// from the other within the impact, and the ratio of the velocity changes is off by that times the difference of the two
/// frictions.  The fraction lies between none and all where the taller body strikes; where the shorter one does, the
/// direction of the friction is unknown and the expected fraction is zero.
pub(crate) fn vertical_fraction(fitted: &MotionFit, contact: &Contact, a: usize) -> f64 {
    /// Relative difference of the heights from which on one body counts as fully taller.
    const TALLER: f64 = 0.1;
    let motions = contact.motions(fitted, &fitted.minimum.parameters);
    let a_strikes = motions.before[0].velocity.length() >= motions.before[1].velocity.length();
    let [height_a, height_b] = [a, contact.b].map(|k| fitted.model.bodies[k].height_m);
    let (striking, struck) = if a_strikes { (height_a, height_b) } else { (height_b, height_a) };
    let taller = (striking - struck) / striking.min(struck);
    MEAN_VERTICAL_FRACTION * f64::midpoint(1.0, (taller / TALLER).clamp(-1.0, 1.0))
}

/// The standard deviation of the vertical part of the impulse over the horizontal one.
pub(crate) fn vertical_impulse_std(contact_friction: Measured) -> f64 {
    (contact_friction.value * VERTICAL_FRACTION_STD).hypot(contact_friction.std * MEAN_VERTICAL_FRACTION)
}
