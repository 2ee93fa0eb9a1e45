//! When and where do two bodies touch?
//!
//! Discs: the first root of a polynomial in time, or of the distance moved (`discs`).  All other pairs: first the circles
//! around them (`bounding_circles`), then conservative advancement (`conservative_advancement`): from instant to instant, each
//! the latest time up to which a separating line is known to keep the two apart.  Every answer is a lower bound of the time of
//! impact; a search that runs out of steps answers "not before".

mod bounding_circles;
pub(crate) mod broadphase;
pub(crate) mod compound_shape;
mod conservative_advancement;
pub(crate) mod convex_decomposition;
mod discs;
pub(crate) mod distance;
pub(crate) mod manifold;
mod roots;
pub(crate) mod separating_axis;
pub(crate) mod time_of_impact;

use separating_axis::Feature;
use time_of_impact::{ContactSearch, MovingBody, TimeOfImpact};

/// A first bound of the next contact of two bodies from a time on, at a low cost; [`time_of_impact()`] refines it.
///
/// A sustained contact is ignored until `ignored_until_s`.
pub(crate) fn lower_bound(a: MovingBody, b: MovingBody, from_s: f64, ignored_until_s: f64) -> TimeOfImpact {
    if a.motion.stop_s <= from_s && b.motion.stop_s <= from_s {
        return TimeOfImpact::Never;
    }
    if a.body.shape.is_disc && b.body.shape.is_disc {
        return discs::first_contact(a, b, from_s, ignored_until_s);
    }
    bounding_circles::lower_bound(a, b, from_s)
}

/// The next contact of two bodies; the search ends where it is found or is known to be later than the end of the search.
///
/// `hint` is the feature that separated the two bodies before, if known; it is updated.
pub(crate) fn time_of_impact(search: ContactSearch, hint: &mut Option<Feature>) -> TimeOfImpact {
    let [a, b] = search.bodies;
    if a.body.shape.is_disc && b.body.shape.is_disc {
        return discs::first_contact(a, b, search.from_s, search.ignored_until_s);
    }
    conservative_advancement::first_contact(search, hint)
}
