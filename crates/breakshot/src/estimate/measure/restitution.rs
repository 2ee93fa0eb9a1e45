//! The restitution of an impact (Eq. 31 and 32), and whether the impact has a single one.

use super::contact::{Contact, MotionsAtImpact, Partner};
use crate::estimate::clip::fit::MotionFit;

/// An impulse within this fraction of the facing sides' length from one end, and within this number of its standard deviations, shows a
/// contact at that end alone: a small part of it at the other end, a moment later, changes the speed of separation much more.
const END_FRACTION: f64 = 0.08;
const END_STDS: f64 = 3.0;
/// A worse known impulse shows no end.
const WIDEST_END_FRACTION: f64 = 0.25;
/// Two ends that meet within this time (s) meet in one impact: contacts of hard objects last about twice as long.
const SIMULTANEOUS_S: f64 = 5e-4;
/// The additional standard deviation of the restitution of a double contact; the error is the same in every clip.
pub(crate) const DOUBLE_CONTACT_STD: f64 = 0.1;

/// The speed of separation over the speed of approach, of the contact points along the normal (Eq. 32; with the
/// striker's prescribed velocity, Eq. 31 as corrected).
pub(crate) fn restitution(contact: &Contact, motions: &MotionsAtImpact) -> f64 {
    let [before, after] = contact.relative_velocities(motions).map(|v| v.dot(contact.closest.normal_ab));
    -after / before
}

/// Moves the contact point of two facing sides to where the impulse acted, and marks a double contact: sides that met
/// first at one end and then at the other have no single restitution.
///
/// The torque of an impulse at the position s along the sides from the centroid, which is h from them, changes the angular
/// velocity by `dw = (h dv_t - s dv_n) / k^2` (k: radius of gyration, dv: change of the velocity along normal and sides). Contact
/// friction contributes the first term.
pub(crate) fn check_facing_sides(fitted: &MotionFit, contact: &mut Contact) {
    let Some(sides) = contact.closest.facing_sides else { return };
    let normal = contact.closest.normal_ab;
    let along = normal.perpendicular();
    let near = contact.closest.point.to_vec().dot(along);
    let length = sides.far_point.to_vec().dot(along) - near;

    // The point of action along the side, as the weighted mean over the bodies whose yaw is observed
    let bodies: Vec<(usize, usize)> = [(0, contact.a), (1, Partner::Body(contact.b))]
        .into_iter()
        .filter_map(|(side, partner)| match partner {
            Partner::Body(k) if fitted.model.bodies[k].yaw_observed => Some((side, k)),
            _ => None,
        })
        .collect();
    let (positions, covariance) = fitted.propagated(|parameters| {
        let motions = contact.motions(fitted, parameters);
        let position = |&(side, k): &(usize, usize)| {
            let spin_change = motions.after[side].spin_rad_s - motions.before[side].spin_rad_s;
            let torque = fitted.model.bodies[k].gyration_m.powi(2) * spin_change;
            let centroid = motions.after[side].pose.position;
            let height_m = (contact.closest.point - centroid).dot(normal);
            let change = motions.velocity_change(side);
            let lever_m = (height_m * change.dot(along) - torque) / change.dot(normal);
            centroid.to_vec().dot(along) + lever_m
        };
        bodies.iter().map(position).collect()
    });
    let weights: Vec<f64> =
        (0..positions.len()).map(|k| 1.0 / covariance[(k, k)].max(f64::MIN_POSITIVE)).collect();
    let weight: f64 = weights.iter().sum();
    let position = positions.iter().zip(&weights).map(|(p, w)| p * w).sum::<f64>() / weight;
    let fraction = (position - near) / length;
    let end_fraction = (END_STDS / (weight.sqrt() * length.abs())).clamp(END_FRACTION, WIDEST_END_FRACTION);

    // How long after the near end the far one would have met without an impact
    let motions = contact.motions(fitted, &fitted.minimum.parameters);
    let closing_m_s = -(motions.before[1].velocity_at(sides.far_point)
        - motions.before[0].velocity_at(sides.far_point))
    .dot(normal);
    let delay_s = sides.wedge_m / closing_m_s;
    let at_one_end = !(end_fraction..=1.0 - end_fraction).contains(&fraction);
    if fraction.is_finite() {
        // The end's own position is more accurate than that of the impulse.
        let acted = if at_one_end { fraction.clamp(0.0, 1.0).round() } else { fraction };
        contact.closest.point += along * (acted * length);
        if at_one_end {
            contact.closest.normal_ab = sides.end_normals_ab[usize::from(acted > 0.5)];
        }
    }
    let simultaneous = (0.0..SIMULTANEOUS_S).contains(&delay_s);
    if !fraction.is_finite() || !(at_one_end || simultaneous) {
        contact.is_double = true;
        contact.remarks.push(format!(
            "flat sides met at one end and {:.1} ms later at the other: no single restitution",
            delay_s * 1e3
        ));
    }
}
