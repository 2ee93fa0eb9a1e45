//! What size does an object's outline have in the image, if the given one fits nothing?
//!
//! Outlines are measured by hand, sometimes between the wrong edges. Sizes around the given one are tried, and of those at which the outline
//! is about as visible as at the best one, the one that the edges enlarge or shrink least is taken.

use super::edge_fit::OutlineFit;
use crate::object::{Object, Shape};

/// Largest error of a given size, and step of the search, as fractions of it.
const LARGEST_ERROR: f64 = 0.1;
const STEP: f64 = 0.01;
/// Fits whose visibility differs by less are equally good.
const EQUALLY_VISIBLE: f64 = 0.05;

/// The factor of the given size at which `fit` fits best; `None` if no size near the given one is found.
///
/// `in_given_size` is the fit at the factor 1.
pub(in crate::detect) fn factor(
    in_given_size: Option<OutlineFit>,
    fit: impl Fn(f64) -> Option<OutlineFit>,
) -> Option<f64> {
    let steps = (LARGEST_ERROR / STEP).round() as i32;
    let other_factors = (-steps..=steps).filter(|&k| k != 0).map(|k| 1.0 + f64::from(k) * STEP);
    let other_fits = other_factors.filter_map(|factor| Some((factor, fit(factor)?)));
    let fits: Vec<(f64, OutlineFit)> =
        in_given_size.map(|fit| (1.0, fit)).into_iter().chain(other_fits).collect();
    let best = fits.iter().map(|(_, fit)| fit.visible_fraction).fold(0.0, f64::max);
    let visible = fits.iter().filter(|(_, fit)| fit.visible_fraction > best - EQUALLY_VISIBLE);
    let (factor, _) =
        visible.min_by(|(_, a), (_, b)| a.enlargement_px.abs().total_cmp(&b.enlargement_px.abs()))?;
    Some(*factor)
}

/// The beginning of a warning that the outline of an object has another size than the given one.
pub(in crate::detect) const OUTLINE_SIZE: &str = "the outline of";

/// The warning about an object whose outline has this size.
pub(in crate::detect) fn warning(given: &Object, factor: f64) -> String {
    let (percent, larger) = (100.0 * (factor - 1.0).abs(), if factor > 1.0 { "larger" } else { "smaller" });
    let size = |shape: &Shape| match shape {
        Shape::Disc { radius_m } => format!("radius {:.1} mm", 1e3 * radius_m),
        Shape::Rectangle { size_m: [a, b] } => format!("{:.1} x {:.1} mm", 1e3 * a, 1e3 * b),
        Shape::Polygon { .. } => format!("outer radius {:.1} mm", 1e3 * shape.outer_radius_m()),
    };
    let (seen, known) = (size(&given.shape.scaled(factor)), size(&given.shape));
    let name = &given.name;
    format!(
        "{OUTLINE_SIZE} `{name}` is {percent:.0} % {larger} in the film than given: {seen} instead of {known}; it is tracked so, correct it \
         in objects.toml"
    )
}
