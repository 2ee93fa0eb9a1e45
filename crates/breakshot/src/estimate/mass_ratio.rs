//! Mass ratios: of one impact (Eq. 33 and 34 as corrected), and of all objects from all pairs.

use super::clip_fit::Fitted;
use super::contact::{Around, Contact};
use super::impact::Measured;
use super::reading::Key;
use super::spread::{Group, Mean};
use nalgebra::{DMatrix, DVector};
use std::collections::{BTreeMap, BTreeSet};

/// The impulses on two bodies are opposite within this angle (rad), and within this many deviations.
const OPPOSITE_RAD: f64 = 0.15;
const OPPOSITE_STDS: f64 = 6.0;

/// The logarithm of mass a over mass b: the velocity changes of the centroids along the impulse are as the inverse
/// masses.  Restitution and inertia cancel.
pub(super) fn log_ratio(contact: &Contact, around: &Around) -> f64 {
    let [a, b] = [0, 1].map(|side| around.jump(side).dot(contact.impulse));
    (-b / a).ln()
}

/// The impulses on the two bodies must be opposite.
pub(super) fn check_momentum(fitted: &Fitted, contact: &mut Contact, a: usize) {
    let along = contact.impulse;
    let around = contact.around(fitted, &fitted.minimum.parameters);
    if around.jump(0).dot(along) >= 0.0 || around.jump(1).dot(along) <= 0.0 {
        let names = [a, contact.b].map(|k| fitted.model.bodies[k].object.clone());
        let [a, b] = names;
        contact.leave_out(format!("momentum does not add up: `{a}` and `{b}` were pushed the same way"));
        return;
    }
    let (angles, covariance) = fitted.propagated(|parameters| {
        let around = contact.around(fitted, parameters);
        let slope = |side: usize| along.cross(around.jump(side)) / along.dot(around.jump(side));
        vec![slope(1) - slope(0)]
    });
    let (angle_rad, std_rad) = (angles[0].atan().abs(), covariance[(0, 0)].sqrt());
    if angle_rad > OPPOSITE_RAD && angle_rad > OPPOSITE_STDS * std_rad {
        contact.leave_out(format!(
            "momentum does not add up: the impulses are {:.0} degrees from opposite",
            angle_rad.to_degrees()
        ));
    }
}

/// Which share of contact friction is expected to act along the vertical: the taller body rocks forward when it
/// strikes, its face moves down, presses the struck body onto the table and lifts its own.
///
/// The table's friction takes `share x contact friction x friction` of the impulse more from the one and less from
/// the other, at once: the ratio of the velocity changes is off by that times the difference of the two frictions.
/// The share lies between none and all where the taller strikes; which way friction acts is open where the shorter does.
pub(super) fn pressing(fitted: &Fitted, contact: &Contact, a: usize) -> f64 {
    /// Heights that differ by less than this (relative) are alike.
    const ALIKE: f64 = 0.1;
    let around = contact.around(fitted, &fitted.minimum.parameters);
    let a_strikes = around.before[0].velocity.length() >= around.before[1].velocity.length();
    let [height_a, height_b] = [a, contact.b].map(|k| fitted.model.bodies[k].height_m);
    let (striking, struck) = if a_strikes { (height_a, height_b) } else { (height_b, height_a) };
    let taller = (striking - struck) / striking.min(struck);
    MEAN_SHARE * f64::midpoint(1.0, (taller / ALIKE).clamp(-1.0, 1.0))
}

/// A share between none and all: its mean and standard deviation.
const MEAN_SHARE: f64 = 0.5;
const SHARE_STD: f64 = 0.29;

/// How uncertain the vertical part of the impulse is, over the horizontal one.
pub(super) fn pressing_std(contact_friction: Measured) -> f64 {
    (contact_friction.value * SHARE_STD).hypot(contact_friction.std * MEAN_SHARE)
}

/// The logarithms of the masses over the reference's, as a linear function of those of the pairs' ratios.
#[derive(Clone, Debug)]
pub(super) struct Masses {
    pub(super) objects: Vec<String>,
    pub(super) pairs: Vec<Key>,
    /// One row per object, one column per pair.
    pub(super) from_pairs: DMatrix<f64>,
    pub(super) values: DVector<f64>,
    /// What every pair is off by, beyond what its clips' scatter tells, so that loops of pairs close (log, std).
    pub(super) misfit: f64,
    /// What moves all masses at once (log, std).
    pub(super) shifts: Vec<f64>,
    pub(super) freedom: f64,
}

/// One pair's logarithm of the mass of the first over the second.
struct Pair<'a> {
    key: &'a Key,
    first: &'a str,
    second: &'a str,
    mean: &'a Mean,
}

impl Masses {
    /// Weighted least squares on the logarithms; objects that no chain of pairs connects with the reference are left
    /// out.
    pub(super) fn new(groups: &BTreeMap<Key, (Group, Mean)>, reference: &str) -> Self {
        let mut pairs: Vec<Pair> = groups
            .iter()
            .filter_map(|(key, (_, mean))| match key {
                Key::MassRatio(a, b) if a != b => Some(Pair { key, first: a, second: b, mean }),
                _ => None,
            })
            .collect();
        let reached = connected(reference, &pairs);
        pairs.retain(|p| reached.contains(p.first));
        let objects: Vec<String> = reached.into_iter().filter(|o| o != reference).collect();
        let design = design(&pairs, &objects);
        let ratios = DVector::from_iterator(pairs.len(), pairs.iter().map(|p| p.mean.value));
        let variances: Vec<f64> = pairs.iter().map(|p| p.mean.standard_error.powi(2)).collect();
        let loops = pairs.len().saturating_sub(objects.len()) as f64;
        let solved = |misfit: f64| {
            let weights: Vec<f64> =
                variances.iter().map(|v| 1.0 / (v + misfit * misfit).max(f64::MIN_POSITIVE)).collect();
            let from_pairs = inverse_of(&design, &weights);
            let values = &from_pairs * &ratios;
            let off = &ratios - &design * &values;
            let squares: f64 = off.iter().zip(&weights).map(|(m, w)| w * m * m).sum();
            (from_pairs, values, squares)
        };
        let misfit = smallest_misfit(loops, |misfit| solved(misfit).2);
        let (from_pairs, values, _) = solved(misfit);
        let freedom = pairs.iter().map(|p| p.mean.freedom).sum();
        let pairs = pairs.into_iter().map(|p| p.key.clone()).collect();
        let shifts = vec![0.0; objects.len()];
        Self { objects, pairs, from_pairs, values, misfit, shifts, freedom }
    }
}

/// The least misfit of every pair that lets the loops close as well as chance would.
fn smallest_misfit(loops: f64, squares: impl Fn(f64) -> f64) -> f64 {
    const LARGEST: f64 = 1.0;
    if loops < 1.0 || squares(0.0) <= loops {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, LARGEST);
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        if squares(middle) > loops { low = middle } else { high = middle }
    }
    high
}

/// +1 for the first object of a pair, -1 for the second.
fn design(pairs: &[Pair], objects: &[String]) -> DMatrix<f64> {
    DMatrix::from_fn(pairs.len(), objects.len(), |row, column| {
        let object = objects[column].as_str();
        f64::from(u8::from(pairs[row].first == object)) - f64::from(u8::from(pairs[row].second == object))
    })
}

/// What takes the pairs' logarithms to the objects'.
fn inverse_of(design: &DMatrix<f64>, weights: &[f64]) -> DMatrix<f64> {
    let weighted = DMatrix::from_fn(design.nrows(), design.ncols(), |r, c| weights[r] * design[(r, c)]);
    let normal = design.tr_mul(&weighted);
    let size = normal.nrows();
    let inverse = normal.cholesky().map_or_else(|| DMatrix::zeros(size, size), |factor| factor.inverse());
    inverse * weighted.transpose()
}

/// All that a chain of pairs connects with `start`.
fn connected(start: &str, pairs: &[Pair]) -> BTreeSet<String> {
    let mut reached = BTreeSet::from([start.to_owned()]);
    loop {
        let before = reached.len();
        for pair in pairs {
            if reached.contains(pair.first) || reached.contains(pair.second) {
                reached.insert(pair.first.to_owned());
                reached.insert(pair.second.to_owned());
            }
        }
        if reached.len() == before {
            return reached;
        }
    }
}
