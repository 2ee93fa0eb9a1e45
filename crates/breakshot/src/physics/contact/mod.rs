//! When will two bodies touch?
//!
//! Discs: the first root of a polynomial in time, or of their way (`discs`).  All others: first the circles around them
//! (`bounding_circles`), then conservative advancement (`conservative_advancement`), from time to time the latest instant up to which a line is known
//! to keep the two apart.  A search that has gone far enough answers "not before", never "not at all".

mod bounding_circles;
pub(crate) mod broadphase;
pub(crate) mod compound_shape;
mod conservative_advancement;
pub(crate) mod convex_decomposition;
mod discs;
mod manifold;
mod roots;
mod separating_axis;

pub(crate) use manifold::contact_points;
pub(crate) use separating_axis::{Feature, witness};

use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::Motion;

/// A body on its way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mover<'a> {
    pub(crate) body: &'a Body,
    pub(crate) motion: &'a Motion,
}

/// What is known about the next contact of two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Outlook {
    /// As they move now, they never touch.
    Never,
    /// They touch at this time (s).
    Touch(f64),
    /// They do not touch before this time (s); ask again then.
    NotBefore(f64),
}

/// Closer than this bodies touch (m): a fiftieth of the shortest wavelength of light.
pub(crate) const CONTACT_GAP_M: f64 = 1e-8;
/// Below this approach speed a contact presses rather than hits (m/s).
pub(crate) const PRESSING_M_S: f64 = 3e-3;
/// A pressing contact is looked at again after this time (s): approaching at the pressing speed and braked by friction
/// and spin, bodies sink into each other by less than two micrometres.
pub(crate) const PRESSING_S: f64 = 4e-4;

/// A first look at the next contact of two bodies from a time on; what costs more is left to [`closer_look`].
///
/// Contacts that press are overlooked until `pressing_s`.
pub(crate) fn first_look(a: Mover, b: Mover, from_s: f64, pressing_s: f64) -> Outlook {
    if a.motion.stop_s <= from_s && b.motion.stop_s <= from_s {
        return Outlook::Never;
    }
    if a.body.plate.is_disc && b.body.plate.is_disc {
        return discs::first_contact(a, b, from_s, pressing_s);
    }
    bounding_circles::first_look(a, b, from_s)
}

/// The next contact from a time on, followed until it is found or lies beyond `until_s`.
///
/// `hint` is the feature that kept the two apart before, if any; it is updated.
pub(crate) fn closer_look(
    pair: (Mover, Mover),
    (from_s, until_s): (f64, f64),
    pressing_s: f64,
    hint: &mut Option<Feature>,
) -> Outlook {
    let (a, b) = pair;
    if a.body.plate.is_disc && b.body.plate.is_disc {
        return discs::first_contact(a, b, from_s, pressing_s);
    }
    conservative_advancement::first_contact(pair, (from_s, until_s), pressing_s, hint)
}

/// How long `gap + change t - bend t^2 / 2` stays positive (s); `gap` positive.
pub(crate) fn time_apart_s(gap_m: f64, change_m_s: f64, bend_m_s2: f64) -> f64 {
    let square = change_m_s * change_m_s + 2.0 * bend_m_s2 * gap_m;
    if square < 0.0 {
        return f64::INFINITY;
    }
    let root = square.sqrt();
    if change_m_s > 0.0 {
        return if bend_m_s2 > 0.0 { (change_m_s + root) / bend_m_s2 } else { f64::INFINITY };
    }
    let below = root - change_m_s;
    if below > 0.0 { 2.0 * gap_m / below } else { f64::INFINITY }
}
