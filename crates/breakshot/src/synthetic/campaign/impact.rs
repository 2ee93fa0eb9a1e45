//! Instantaneous impacts: Newton's restitution along the normal, Coulomb friction along the tangent.
//!
//! Two effects of the third dimension change the masses that a pair seems to have.  Both follow laws of this module's own,
//! which differ on purpose from the estimator's corrections (`estimate::measure::impulse_ratio`) and from its allowance for
//! rocking (`estimate::joint`): if both sides shared a formula, intervals of mass ratios would cover the truth by construction.
//!
//! - Pressing: a body that strikes a lower one tilts forward, its face moves down, and contact friction presses the struck
//!   body onto the table and lifts the striking one.  Here the vertical fraction of contact friction grows with the
//!   difference of the centres' heights and saturates; the estimator expects a fraction that is linear in the relative
//!   difference of heights, and half of contact friction on average.
//! - Rocking: the taller body takes up part of its momentum as rotation about a horizontal axis, so it seems lighter.  Here the
//!   loss is one-sided and varies from impact to impact; the estimator allows for a symmetric, constant error of each pair.

use super::body::Body;
use super::support::half_width_m;
use super::truth::TrueModel;
use crate::geometry::{Point, Vec2};
use crate::object::{Shape, kind, pair_key};

/// Random factors of one impact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Variation {
    /// Factor of the restitution.
    pub(super) restitution: f64,
    /// Factor of the loss of mass by rocking.
    pub(super) rocking: f64,
}

/// A contact of two bodies: unit normal from the first to the second, and the common point.
struct Contact {
    normal_ab: Vec2,
    point: Point,
}

/// The striker: a disc whose motion is given.
#[derive(Clone, Copy, Debug)]
pub(super) struct StrikerState {
    pub(super) radius_m: f64,
    pub(super) position: Point,
    pub(super) velocity: Vec2,
}

/// Lets the striker push a body if the two touch and approach each other; whether they did.
pub(super) fn strike(
    striker: &StrikerState,
    body: &mut Body,
    model: &TrueModel,
    variation: Variation,
) -> bool {
    let Some(contact) = disc_contact(striker.position, striker.radius_m, body) else { return false };
    let relative = striker.velocity - body.velocity_at(contact.point);
    if relative.dot(contact.normal_ab) <= 0.0 {
        return false;
    }
    let tangent = contact.normal_ab.perpendicular();
    let inverse = body.inverse_inertia(contact.point, contact.normal_ab, tangent, body.mass_kg);
    let restitution = model.truth.striker_restitution.get(kind(&body.object)).copied().unwrap_or(f64::NAN);
    let [n, t] = impulses(
        [relative.dot(contact.normal_ab), relative.dot(tangent)],
        inverse,
        restitution * variation.restitution,
        model.truth.striker_friction,
    );
    body.apply(contact.point, contact.normal_ab * n + tangent * t, body.mass_kg);
    true
}

/// Lets two bodies collide if they touch and approach each other; whether they did.  Squares do not collide with squares.
pub(super) fn collide(a: &mut Body, b: &mut Body, model: &TrueModel, variation: Variation) -> bool {
    let contact = match (&a.shape, &b.shape) {
        (Shape::Disc { radius_m }, _) => disc_contact(a.position, *radius_m, b),
        (_, Shape::Disc { radius_m }) => disc_contact(b.position, *radius_m, a)
            .map(|contact| Contact { normal_ab: -contact.normal_ab, ..contact }),
        _ => None,
    };
    let Some(contact) = contact else { return false };
    let relative = a.velocity_at(contact.point) - b.velocity_at(contact.point);
    if relative.dot(contact.normal_ab) <= 0.0 {
        return false;
    }
    let tangent = contact.normal_ab.perpendicular();
    let [mass_a, mass_b] = apparent_masses_kg(a, b, model, variation.rocking);
    let (of_a, of_b) = (
        a.inverse_inertia(contact.point, contact.normal_ab, tangent, mass_a),
        b.inverse_inertia(contact.point, contact.normal_ab, tangent, mass_b),
    );
    let key = pair_key(kind(&a.object), kind(&b.object));
    let restitution = model.truth.restitution.get(&key).copied().unwrap_or(f64::NAN);
    let [n, t] = impulses(
        [relative.dot(contact.normal_ab), relative.dot(tangent)],
        [0, 1, 2].map(|k| of_a[k] + of_b[k]),
        restitution * variation.restitution,
        model.truth.contact_friction,
    );
    let impulse = contact.normal_ab * n + tangent * t;
    a.apply(contact.point, -impulse, mass_a);
    b.apply(contact.point, impulse, mass_b);
    true
}

/// The masses (kg) with which free bodies would change their velocities as these two do.
fn apparent_masses_kg(a: &Body, b: &Body, model: &TrueModel, rocking_factor: f64) -> [f64; 2] {
    /// Difference of the centres' heights at which half of the largest pressing acts (m).
    const HALF_LEVER_M: f64 = 0.003;
    let a_strikes = a.velocity.length() >= b.velocity.length();
    let (striking, struck) = if a_strikes { (a.height_m, b.height_m) } else { (b.height_m, a.height_m) };
    let lever_m = (striking - struck) / 2.0;
    // Positive where the taller body strikes: the struck body is pressed down, the striking one is lifted.
    let pressing = model.pressing_level * lever_m / (lever_m.abs() + HALF_LEVER_M);
    let key = pair_key(kind(&a.object), kind(&b.object));
    let rocking = rocking_factor * model.rocking.get(&key).copied().unwrap_or(0.0);
    let apparent = |body: &Body, other: &Body| {
        let friction = model.truth.friction.get(kind(&body.object)).copied().unwrap_or(0.0);
        // The table's friction takes this fraction of the contact impulse at once.
        let taken = pressing * model.truth.contact_friction * friction;
        let loss = if body.height_m > other.height_m { rocking } else { 0.0 };
        body.mass_kg * (1.0 - loss) / (1.0 - taken)
    };
    [apparent(a, b), apparent(b, a)]
}

/// Impulses on the second body along the normal and the tangent (N s).
///
/// `relative` is the velocity of the first body's contact point relative to the second's, along normal and tangent;
/// `inverse_inertia` the sum of both bodies'.  The contact sticks within the friction cone and slides at its edge.
fn impulses(relative: [f64; 2], inverse_inertia: [f64; 3], restitution: f64, friction: f64) -> [f64; 2] {
    let [approach, slip] = relative;
    let [normal, tangent, coupling] = inverse_inertia;
    let wanted = approach * (1.0 + restitution);
    let det = normal * tangent - coupling * coupling;
    let stick = [(wanted * tangent - slip * coupling) / det, (slip * normal - wanted * coupling) / det];
    if stick[1].abs() <= friction * stick[0] {
        return stick;
    }
    let slope = friction * slip.signum();
    let n = wanted / (normal + slope * coupling);
    [n, slope * n]
}

/// The contact of a disc with a body, if they touch.
fn disc_contact(centre: Point, radius_m: f64, body: &Body) -> Option<Contact> {
    let from_body = centre - body.position;
    if let Shape::Disc { radius_m: other } = body.shape {
        let normal_ab = (-from_body).direction()?;
        let touches = from_body.length() <= radius_m + other;
        return touches.then(|| Contact { normal_ab, point: centre + normal_ab * radius_m });
    }
    let half = half_width_m(&body.shape);
    let local = from_body.rotated(-body.yaw_rad);
    let nearest = Vec2::new(local.x.clamp(-half, half), local.y.clamp(-half, half));
    let normal_ab = (nearest - local).direction()?.rotated(body.yaw_rad);
    let touches = (local - nearest).length() <= radius_m;
    touches.then(|| Contact { normal_ab, point: body.position + nearest.rotated(body.yaw_rad) })
}
