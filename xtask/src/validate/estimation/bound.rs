//! How small could the errors be at best?  The Cramer-Rao bound that the noise of the positions sets.
//!
//! The fit of a clip gives the smallest standard deviation that an unbiased estimate of its quantities can have: the inverse
//! of the Fisher information in its positions, at the noise level that the clips themselves show.  The information of all
//! clips adds up.  Variation of the objects' behaviour from clip to clip is not included.

use breakshot::estimate::{ClipFit, Measured};
use breakshot::object::{kind, pair_key};
use nalgebra::DMatrix;
use std::collections::{BTreeMap, BTreeSet};

/// The smallest possible standard deviation of every quantity, by name; of mass ratios it is relative.
#[derive(Default)]
pub(crate) struct Bounds {
    pub(crate) friction: BTreeMap<String, f64>,
    pub(crate) striker_restitution: BTreeMap<String, f64>,
    pub(crate) restitution: BTreeMap<String, f64>,
    pub(crate) pair_mass_ratio: BTreeMap<String, f64>,
    pub(crate) mass_ratio: BTreeMap<String, f64>,
}

/// Mean absolute value of a standard normal error: sqrt(2 / pi).
pub(crate) const MEAN_PER_STD: f64 = 0.797_884_560_802_865_4;

/// The bounds of all quantities from the fits of all clips, masses relative to `reference`.
pub(crate) fn bounds(fits: &[ClipFit], reference: &str) -> Bounds {
    let mut information = [const { BTreeMap::<String, f64>::new() }; 4];
    let mut add = |which: usize, name: String, measured: Option<Measured>| {
        if let Some(Measured { std, .. }) = measured.filter(|m| m.std > 0.0 && m.std.is_finite()) {
            *information[which].entry(name).or_default() += 1.0 / (std * std);
        }
    };
    for fit in fits {
        for body in &fit.bodies {
            add(0, kind(&body.object).into(), body.friction);
        }
        for impact in &fit.impacts {
            match impact.a.as_deref() {
                Some("striker") => add(1, kind(&impact.b).into(), impact.restitution),
                Some(a) => {
                    add(2, pair_key(kind(a), kind(&impact.b)), impact.restitution);
                    let relative = |m: Measured| Measured { value: 1.0, std: m.std / m.value };
                    add(3, pair_key(kind(a), kind(&impact.b)), impact.mass_ratio.map(relative));
                }
                None => {}
            }
        }
    }
    let mass_ratio = masses(&information[3], reference);
    let [friction, striker_restitution, restitution, pair_mass_ratio] = information.map(|of_kind| {
        of_kind.into_iter().map(|(name, information)| (name, information.sqrt().recip())).collect()
    });
    Bounds { friction, striker_restitution, restitution, pair_mass_ratio, mass_ratio }
}

/// Bounds of the logarithms of all masses over the reference's, from the information about each pair's logarithmic ratio.
fn masses(pairs: &BTreeMap<String, f64>, reference: &str) -> BTreeMap<String, f64> {
    let split = |key: &String| key.split_once('/').map(|(a, b)| (a.to_owned(), b.to_owned()));
    let ends: BTreeSet<String> = pairs.keys().filter_map(split).flat_map(|(a, b)| [a, b]).collect();
    let objects: Vec<String> = ends.into_iter().filter(|o| o != reference).collect();
    let mut information = DMatrix::<f64>::zeros(objects.len(), objects.len());
    for (key, weight) in pairs {
        let Some((a, b)) = split(key).filter(|(a, b)| a != b) else { continue };
        let [i, j] = [a, b].map(|name| objects.iter().position(|o| *o == name));
        for (k, l) in [(i, i), (j, j), (i, j), (j, i)] {
            if let (Some(k), Some(l)) = (k, l) {
                information[(k, l)] += if k == l { *weight } else { -weight };
            }
        }
    }
    let Some(factor) = information.cholesky() else { return BTreeMap::new() };
    let covariance = factor.inverse();
    objects.into_iter().enumerate().map(|(k, object)| (object, covariance[(k, k)].sqrt())).collect()
}
