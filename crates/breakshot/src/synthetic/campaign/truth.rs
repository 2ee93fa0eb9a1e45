//! Random objects and their true properties.

use super::spec::CampaignSpec;
use super::support::support_m;
use crate::geometry::Vec2;
use crate::object::{Marker, Object, Shape, pair_key};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;

/// The true values of what an estimate of the campaign measures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Friction coefficient against the table, by object.
    pub friction: BTreeMap<String, f64>,
    /// Coefficient of restitution against the striker, by object.
    pub striker_restitution: BTreeMap<String, f64>,
    /// Coefficient of restitution of a pair, by [`pair_key`].
    pub restitution: BTreeMap<String, f64>,
    /// Mass over the mass of the first object, by object.
    pub mass_ratio: BTreeMap<String, f64>,
    /// Mean distance of the support from the centroid over that of an even weight, by object.
    pub support: BTreeMap<String, f64>,
    /// Friction coefficient of contacts between objects.
    pub contact_friction: f64,
    /// Friction coefficient of contacts between an object and the striker.
    pub striker_friction: f64,
    /// Gravity's component along the table over gravity, along x and y.
    pub slope: [f64; 2],
}

/// Everything on which the simulated motion depends.
#[derive(Clone, Debug, Default)]
pub(super) struct TrueModel {
    pub(super) truth: Truth,
    pub(super) masses_kg: BTreeMap<String, f64>,
    /// Points on which each object presses, in its frame (m).
    pub(super) supports_m: BTreeMap<String, Vec<Vec2>>,
    /// Largest fraction of contact friction that acts along the vertical (see `impact`).
    pub(super) pressing_level: f64,
    /// Relative loss of apparent mass of the taller body of a pair because it rocks, by [`pair_key`].
    pub(super) rocking: BTreeMap<String, f64>,
    /// See [`CampaignSpec::pressed_ahead`].
    pub(super) pressed_ahead: f64,
}

/// A random object: the `k`-th of a campaign, named `a`, `b`, ...
pub(super) fn object(k: usize, spec: &CampaignSpec, random: &mut Pcg64Mcg) -> Object {
    const EVERY_THIRD: usize = 3;
    let square = k % EVERY_THIRD == EVERY_THIRD - 1;
    let radius_m = random.random_range(0.025..0.04);
    let shape =
        if square { Shape::Rectangle { size_m: [1.6 * radius_m; 2] } } else { Shape::Disc { radius_m } };
    let bar = Shape::Rectangle { size_m: [0.018, 0.009] };
    let marker = if square || spec.bar_markers { bar } else { Shape::Disc { radius_m: 0.01 } };
    let name = char::from(b'a' + (k % 26) as u8).to_string();
    let marker = Some(Marker::centred(marker));
    Object { name, shape, height_m: random.random_range(0.025..0.05), marker, mass_kg: None, support: None }
}

/// Random properties of these objects, on the supports and the table of the specification.
pub(super) fn model(objects: &[Object], spec: &CampaignSpec, random: &mut Pcg64Mcg) -> TrueModel {
    let mut truth = Truth {
        contact_friction: random.random_range(0.1..0.3),
        striker_friction: random.random_range(0.1..0.3),
        slope: spec.slope,
        ..Truth::default()
    };
    // The square of a uniform number: weak pressing is the common case, full contact friction along the vertical a rare one.
    let pressing_level = random.random_range(0.0f64..1.0).powi(2);
    let mut masses_kg = BTreeMap::new();
    for object in objects {
        // Masses like those of the paper's objects: 8 to 143 g.
        let mass_kg = random.random_range(0.008f64.ln()..0.143f64.ln()).exp();
        masses_kg.insert(object.name.clone(), mass_kg);
        truth.friction.insert(object.name.clone(), random.random_range(0.15..0.4));
        truth.striker_restitution.insert(object.name.clone(), random.random_range(0.4..0.75));
    }
    let unit_kg = masses_kg.get(&objects[0].name).copied().unwrap_or(1.0);
    truth.mass_ratio = masses_kg.iter().map(|(name, kg)| (name.clone(), kg / unit_kg)).collect();
    let mut rocking = BTreeMap::new();
    for (k, one) in objects.iter().enumerate() {
        for other in &objects[k..] {
            let key = pair_key(&one.name, &other.name);
            truth.restitution.insert(key.clone(), random.random_range(0.35..0.85));
            // An exponential distribution: a rocking body seems lighter, never heavier, and few pairs rock much.  The estimator has another distribution
            // and another law, so that the coverage of mass ratios is a result and not an input.
            rocking.insert(key, -spec.rocking * (1.0 - random.random_range(0.0f64..1.0)).ln());
        }
    }
    let mut supports_m = BTreeMap::new();
    for object in objects {
        let towards_rim = if spec.drawn_supports { random.random_range(0.0..1.0) } else { 0.0 };
        let points = support_m(&object.shape, towards_rim);
        truth
            .support
            .insert(object.name.clone(), mean_arm_m(&points) / mean_arm_m(&support_m(&object.shape, 0.0)));
        supports_m.insert(object.name.clone(), points);
    }
    TrueModel { truth, masses_kg, supports_m, pressing_level, rocking, pressed_ahead: spec.pressed_ahead }
}

/// The mean distance of points from the centroid (m).
fn mean_arm_m(points: &[Vec2]) -> f64 {
    points.iter().map(|p| p.length()).sum::<f64>() / points.len() as f64
}

/// A standard normal number.
pub(super) fn normal(random: &mut Pcg64Mcg) -> f64 {
    StandardNormal.sample(random)
}
