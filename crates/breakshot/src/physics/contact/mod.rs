//! When will two bodies touch?
//!
//! Discs that do not spin: the first root of a polynomial (`discs`).  All others: conservative advancement (`advance`),
//! time after time the latest instant up to which a line is known to keep the two apart.  A search that has used its
//! budget answers "not before", never "not at all".

mod advance;
mod discs;
mod manifold;
mod witness;

pub(crate) use manifold::contact_points;
pub(crate) use witness::{nearest, witness};

use advance::first_contact_convex;
use discs::first_contact_discs;

use super::body::Body;
use super::evolve::{Law, Motion};

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
    /// They touch at this time.
    Touch(f64),
    /// They do not touch before this time; ask again then.
    NotBefore(f64),
}

/// The first contact of two bodies from a time on, as they move now.
pub(crate) fn first_contact(a: Mover, b: Mover, from_s: f64) -> Outlook {
    if a.motion.stop_s <= from_s && b.motion.stop_s <= from_s {
        return Outlook::Never;
    }
    if let (Some(ra), Some(rb)) = (a.body.plate.disc_radius_m(), b.body.plate.disc_radius_m())
        && !matches!(a.motion.law, Law::Curved { .. })
        && !matches!(b.motion.law, Law::Curved { .. })
    {
        return first_contact_discs(a.motion, b.motion, ra + rb, from_s)
            .map_or(Outlook::Never, Outlook::Touch);
    }
    first_contact_convex(a, b, from_s)
}
