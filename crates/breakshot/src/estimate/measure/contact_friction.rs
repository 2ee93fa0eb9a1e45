//! Friction between objects, or between an object and the striker, in one oblique impact.
//!
//! If the contact points still slide over each other when the impact ends, the tangential impulse is the coefficient of
//! friction times the normal one; if they stick, it is less and gives only a lower bound of the coefficient.

use super::contact::{Contact, Partner};
use crate::estimate::clip::fit::MotionFit;
use crate::estimate::clip::result::Measured;
use serde::{Deserialize, Serialize};

/// Tangential over normal impulse of one impact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ObliqueImpact {
    /// Whether the striker is a partner.
    pub(crate) with_striker: bool,
    /// The measured ratio, positive against the slip.
    #[serde(rename = "seen")]
    pub(crate) impulse_ratio: Measured,
    /// The ratio that would have ended the slip.
    #[serde(rename = "to_stick")]
    pub(crate) sticking_ratio: f64,
}

/// The standard deviation of the ratio due to rocking and uneven faces.
const MODEL_STD: f64 = 0.01;

/// The impulse ratio of an impact; `None` without a normal from the outlines or a single restitution.
///
/// Masses enter through the ratio of the impact's own velocity changes.
pub(crate) fn oblique_impact(fitted: &MotionFit, contact: &Contact) -> Option<ObliqueImpact> {
    if !contact.normal_from_outlines || !contact.restitution || contact.both_ends {
        return None;
    }
    let normal = contact.closest.normal_ab;
    let along = normal.perpendicular();
    let motions = contact.motions(fitted, &fitted.minimum.parameters);
    let slip = contact.relative_velocities(&motions)[0].dot(along);
    let (values, covariance) = fitted.propagated(|parameters| {
        let change = contact.motions(fitted, parameters).velocity_change(1);
        vec![change.dot(along) / change.dot(normal)]
    });

    // Changes of the contact points' relative tangential velocity per tangential and normal impulse over the mass of b
    let (mut tangential, mut coupling) = (0.0, 0.0);
    let mut add = |k: usize, side: usize, mass_b_over: f64| {
        let lever = contact.closest.point - motions.before[side].pose.position;
        let (n, t) = (lever.dot(normal), lever.dot(along));
        let squared = fitted.model.bodies[k].gyration_m.powi(2);
        tangential += mass_b_over * (1.0 + n * n / squared);
        coupling -= mass_b_over * n * t / squared;
    };
    add(contact.b, 1, 1.0);
    if let Partner::Body(a) = contact.a {
        let [change_a, change_b] =
            [0, 1].map(|side| motions.velocity_change(side).dot(contact.impulse_direction));
        add(a, 0, -change_a / change_b);
    }

    let sticking_ratio = (slip / motions.velocity_change(1).dot(normal) - coupling) / tangential;
    let (value, std) = (values[0] * sticking_ratio.signum(), covariance[(0, 0)].sqrt().hypot(MODEL_STD));
    let with_striker = contact.a == Partner::Striker;
    (value.is_finite() && std.is_finite() && sticking_ratio.is_finite()).then(|| ObliqueImpact {
        with_striker,
        impulse_ratio: Measured { value, std },
        sticking_ratio: sticking_ratio.abs(),
    })
}
