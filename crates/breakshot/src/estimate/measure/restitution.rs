//! Restitution of an impact (Eq. 31 and 32), and whether the impact has a single one.

use super::contact::{Around, Contact, Party};
use crate::estimate::clip::fit::Fitted;

/// Faces that met at a point nearer to one end than this part of their length met at that end.
const ONE_END: f64 = 0.25;
/// Two ends that meet within this time (s) meet in one impact: contacts of hard objects last about twice as long.
const AT_ONCE_S: f64 = 5e-4;

/// The speed of separation over the speed of approach, of the contact points along the normal (Eq. 32; with the
/// striker's prescribed velocity, Eq. 31 as corrected).
pub(crate) fn restitution(contact: &Contact, around: &Around) -> f64 {
    let [before, after] = around.relative_at(contact).map(|v| v.dot(contact.touch.normal_ab));
    -after / before
}

/// Flat sides that met first at one end and then at the other have no single restitution.
///
/// Where the impulse acted follows from the change of spin: its lever arm is `k^2 dw / dv`.
pub(crate) fn check_faces(fitted: &Fitted, contact: &mut Contact) {
    let Some(face) = contact.touch.face else { return };
    let normal = contact.touch.normal_ab;
    let along = normal.perpendicular();
    let near = contact.touch.point.to_vec().dot(along);
    let length = face.far_point.to_vec().dot(along) - near;
    let sides: Vec<(usize, usize)> = [(0, contact.a), (1, Party::Body(contact.b))]
        .into_iter()
        .filter_map(|(side, party)| match party {
            Party::Body(k) if fitted.model.bodies[k].sees_yaw => Some((side, k)),
            _ => None,
        })
        .collect();
    let (places, covariance) = fitted.propagated(|parameters| {
        let around = contact.around(fitted, parameters);
        let place = |&(side, k): &(usize, usize)| {
            let turn = around.after[side].spin_rad_s - around.before[side].spin_rad_s;
            let lever = fitted.model.bodies[k].gyration_m.powi(2) * turn / around.jump(side).dot(normal);
            around.after[side].pose.position.to_vec().dot(along) - lever
        };
        sides.iter().map(place).collect()
    });
    let weights: Vec<f64> =
        (0..places.len()).map(|k| 1.0 / covariance[(k, k)].max(f64::MIN_POSITIVE)).collect();
    let place = places.iter().zip(&weights).map(|(p, w)| p * w).sum::<f64>() / weights.iter().sum::<f64>();
    let part = (place - near) / length;
    // How long after the near end the far one would have met, had the bodies gone on.
    let around = contact.around(fitted, &fitted.minimum.parameters);
    let closing_m_s = -(around.before[1].velocity_at(face.far_point)
        - around.before[0].velocity_at(face.far_point))
    .dot(normal);
    let delay_s = face.wedge_m / closing_m_s;
    if part.is_finite() {
        contact.touch.point += along * (part * length);
    }
    let at_one_end = !(ONE_END..=1.0 - ONE_END).contains(&part);
    let at_once = (0.0..AT_ONCE_S).contains(&delay_s);
    if !part.is_finite() || !(at_one_end || at_once) {
        contact.met_twice = true;
        contact.remarks.push(format!(
            "flat sides met at one end and {:.1} ms later at the other: no single restitution",
            delay_s * 1e3
        ));
    }
}

/// How far the restitution of sides that met twice may be off, in every clip alike.
pub(crate) const MET_TWICE_STD: f64 = 0.1;
