//! Mass ratios from weighed masses, and the errors of estimated ratios.

use crate::object::{self, Object};

/// The weighed mass of `a` over that of `b`; none unless both were weighed.
pub(super) fn weighed_ratio(objects: &[Object], a: &str, b: &str) -> Option<f64> {
    let mass_kg = |name| object::find(objects, name, "report").ok()?.mass_kg;
    Some(mass_kg(a)? / mass_kg(b)?)
}

/// The weighed mass ratio of a pair `a/b`.
pub(super) fn weighed_pair_ratio(objects: &[Object], pair: &str) -> Option<f64> {
    let (a, b) = pair.split_once('/')?;
    weighed_ratio(objects, a, b)
}

/// The relative error of an estimated value (%).
pub(super) fn error_percent(estimated: f64, weighed: f64) -> f64 {
    (estimated / weighed - 1.0) * 100.0
}
