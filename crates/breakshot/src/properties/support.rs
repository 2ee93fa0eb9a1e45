//! Where does the weight of an object act on the table?
//!
//! The support ratio of an object is the mean distance of its support from its centroid over that of a weight spread uniformly under
//! the outline: 1 for even pressure, 1.5 for a disc on its rim, less than 1 on feet near the middle.  It scales the braking of the
//! spin.  The spin of a disc with a round marker is never seen: its ratio is inferred from the other objects' by how far towards
//! the rim they press.

use super::mixed_model::{MixedModel, NO_EFFECTS, Normal, Observation};
use super::{Domain, Properties};
use crate::object::{Object, Shape};
use crate::uncertain::{Estimate, Z_95};

/// The ratios that are possible: feet within a twentieth of the mean distance, and corners of the longest outlines.
pub(super) const SUPPORT: Domain = Domain {
    contains: |v| (LEAST..=MOST).contains(&v),
    description: "a ratio from 0.05 to 5 of the mean distances from the centroid",
};
const LEAST: f64 = 0.05;
const MOST: f64 = 5.0;
/// An interval that reaches further than this factor from the mean says no more than what is assumed without films.
const MAX_FACTOR: f64 = 2.0;

/// How far towards its rim an object presses: 0 for an even weight, 1 for one on rim or corners.  Both ends are equally likely
/// before any film, and feet inside are possible.
const RIM_FRACTION: MixedModel = MixedModel {
    group_mean: Normal { mean: 0.5, std: 0.5 },
    effect_stds: &[0.0],
    residual_stds: &[0.05, 0.1, 0.2, 0.3, 0.5],
};

/// Whether the clips say more about a ratio than what is assumed without them.
pub(crate) fn is_known(ratio: &Estimate) -> bool {
    let [low, high] = ratio.interval_95;
    low * MAX_FACTOR >= ratio.mean && high <= MAX_FACTOR * ratio.mean && (SUPPORT.contains)(ratio.mean)
}

/// A drawn or inferred ratio within the possible ones.
pub(crate) fn possible(ratio: f64) -> f64 {
    ratio.clamp(LEAST, MOST)
}

/// The ratio of an object whose weight acts on its rim, or at its corners.
fn rim_ratio(shape: &Shape) -> f64 {
    let corners = shape.corners();
    let rim_m = if corners.is_empty() {
        shape.outer_radius_m()
    } else {
        corners.iter().map(|c| c.to_vec().length()).sum::<f64>() / corners.len() as f64
    };
    rim_m / shape.mean_arm_m()
}

/// The support ratio of each of these objects that has neither a measured one nor a given support: `n` is zero.
///
/// Nothing is inferred from properties without any measured ratio.
pub(super) fn inferred(
    measured: &Properties,
    objects: &[Object],
    kinds: &[(String, bool)],
) -> Vec<(String, Estimate)> {
    let shape = |name: &str| objects.iter().find(|o| o.name == name).map(|o| &o.shape);
    let observation = |(name, ratio): (&String, &Estimate)| {
        let reach = rim_ratio(shape(name)?) - 1.0;
        let (value, standard_error) = ((ratio.mean - 1.0) / reach, ratio.standard_error / reach);
        Some(Observation { terms: NO_EFFECTS, value, standard_error })
    };
    let observations: Vec<Observation> =
        measured.support.iter().filter(|(_, ratio)| ratio.n > 0).filter_map(observation).collect();
    let unknown = |name: &&String| {
        let given = objects.iter().any(|o| o.name == **name && o.support.is_some());
        !given && !measured.support.contains_key(*name)
    };
    let mut unknown = kinds.iter().map(|(name, _)| name).filter(unknown).peekable();
    if observations.is_empty() || unknown.peek().is_none() {
        return Vec::new();
    }
    let fraction = RIM_FRACTION.fitted(observations).prediction(&NO_EFFECTS);
    let ratio = |name: &String| {
        let reach = rim_ratio(shape(name)?) - 1.0;
        let (mean, std) = (possible(1.0 + fraction.mean * reach), fraction.std * reach);
        let interval_95 = [-Z_95, Z_95].map(|z| possible(mean + z * std));
        Some((name.clone(), Estimate { mean, std: None, standard_error: std, interval_95, n: 0 }))
    };
    unknown.filter_map(ratio).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn object(name: &str, shape: Shape) -> Object {
        Object { name: name.into(), shape, height_m: 0.03, marker: None, mass_kg: None, support: None }
    }

    fn objects() -> Vec<Object> {
        vec![
            object("disc", Shape::Disc { radius_m: 0.03 }),
            object("square", Shape::Rectangle { size_m: [0.05, 0.05] }),
            object("bar", Shape::Rectangle { size_m: [0.08, 0.04] }),
        ]
    }

    fn with_ratios(ratios: &[(&str, f64)]) -> Properties {
        let ratio = |mean: f64| Estimate {
            mean,
            std: None,
            standard_error: 0.02,
            interval_95: [mean - 0.04, mean + 0.04],
            n: 5,
        };
        let support = ratios.iter().map(|&(name, mean)| (name.to_owned(), ratio(mean))).collect();
        Properties { support, ..Properties::default() }
    }

    #[test]
    fn a_disc_beside_objects_on_their_corners_slides_on_its_rim() {
        let kinds = [("disc".to_owned(), false)];
        let corners = |name: usize| rim_ratio(&objects()[name].shape);
        let found =
            inferred(&with_ratios(&[("square", corners(1)), ("bar", corners(2))]), &objects(), &kinds);
        let [(name, ratio)] = &found[..] else { panic!("{found:?}") };
        assert!(name == "disc" && (ratio.mean - 1.5).abs() < 0.05 && ratio.n == 0, "{ratio:?}");
        let [low, high] = ratio.interval_95;
        assert!(low < 1.45 && high > 1.52, "{ratio:?}");
        let even = inferred(&with_ratios(&[("square", 1.0), ("bar", 1.0)]), &objects(), &kinds);
        assert!((even[0].1.mean - 1.0).abs() < 0.05, "{even:?}");
    }

    #[test]
    fn nothing_is_inferred_without_films_or_where_the_support_is_given() {
        let kinds = [("disc".to_owned(), false)];
        assert!(inferred(&Properties::default(), &objects(), &kinds).is_empty());
        let mut given = objects();
        given[0].support = Some(crate::object::Support::Gradient(crate::geometry::Vec2::ZERO));
        assert!(inferred(&with_ratios(&[("square", 1.8)]), &given, &kinds).is_empty());
    }
}
