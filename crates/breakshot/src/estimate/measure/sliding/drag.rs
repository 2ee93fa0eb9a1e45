//! How much of a body's deceleration depends on its speed, in one clip.

use crate::estimate::clip::fit::MotionFit;
use crate::estimate::clip::result::Measured;
use crate::geometry::Vec2;
use crate::object::kind;
use crate::physics::GRAVITY_M_S2;
use serde::{Deserialize, Serialize};

/// The part of an object's deceleration that is proportional to its speed, at its highest speed in one clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Drag {
    pub(crate) object: String,
    /// Over the constant part, which is Coulomb friction.
    #[serde(rename = "share")]
    pub(crate) fraction: Measured,
}

/// The drag of every body that slides, where its clip determines it.
///
/// A score test: how the fit's residuals respond to drag while the other parameters are adapted to first order.
pub(crate) fn drags(fitted: &MotionFit) -> Vec<Drag> {
    (0..fitted.model.bodies.len())
        .filter_map(|k| {
            let friction = fitted.minimum.parameters[fitted.layout.bodies[k].friction?];
            let legs = fitted.paths[k].legs();
            let speed_m_s = legs.iter().map(|leg| leg.velocity.length()).fold(0.0, f64::max);
            let deceleration = friction.abs() * GRAVITY_M_S2;
            // The displacement (m) by this time due to a drag of 1/s.
            let displacement = |time_s: f64| {
                legs.iter().fold(Vec2::ZERO, |sum, leg| {
                    let t = (time_s.min(leg.end_s) - leg.start_s).max(0.0);
                    let speed = leg.velocity.length();
                    let slowed = deceleration * t / (3.0 * speed.max(f64::MIN_POSITIVE));
                    sum - leg.velocity * (t * t / 2.0 * (1.0 - slowed))
                })
            };
            let (rate, std) = fitted.response(k, displacement)?;
            let per_rate = speed_m_s / deceleration.max(f64::MIN_POSITIVE);
            let fraction = Measured { value: rate * per_rate, std: std * per_rate };
            let object = kind(&fitted.model.bodies[k].object).to_owned();
            (fraction.value.is_finite() && fraction.std.is_finite()).then_some(Drag { object, fraction })
        })
        .collect()
}
