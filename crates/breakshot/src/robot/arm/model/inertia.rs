//! Rigid bodies: mass, centre of mass, inertia tensor, and whether such a body can exist.

use super::frame::Frame;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// A rigid body in the frame of the link that carries it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Its mass (kg).
    pub mass_kg: f64,
    /// Its centre of mass (m).
    pub com_m: Vector3<f64>,
    /// Its inertia tensor about the centre of mass, along the link's axes (kg m2); products of inertia carry the
    /// tensor's sign, `ixy` = -integral of xy dm, as in URDF.
    pub inertia_kg_m2: Matrix3<f64>,
}

impl Body {
    /// No body at all.
    pub fn none() -> Self {
        Self { mass_kg: 0.0, com_m: Vector3::zeros(), inertia_kg_m2: Matrix3::zeros() }
    }

    /// The same body described in another frame.
    #[must_use]
    pub fn seen_from(&self, other_from_own: &Frame) -> Self {
        let turn = other_from_own.rotation.matrix();
        Self {
            mass_kg: self.mass_kg,
            com_m: other_from_own.rotation * self.com_m + other_from_own.translation.vector,
            inertia_kg_m2: turn * self.inertia_kg_m2 * turn.transpose(),
        }
    }

    /// Both bodies as one, rigidly joined (parallel axis theorem).
    #[must_use]
    pub fn joined(&self, other: &Self) -> Self {
        let mass_kg = self.mass_kg + other.mass_kg;
        if mass_kg <= 0.0 {
            return *self;
        }
        let com_m = (self.com_m * self.mass_kg + other.com_m * other.mass_kg) / mass_kg;
        let inertia_kg_m2 = [self, other].iter().fold(Matrix3::zeros(), |sum, body| {
            sum + body.inertia_kg_m2 + parallel_axis(body.mass_kg, &(body.com_m - com_m))
        });
        Self { mass_kg, com_m, inertia_kg_m2 }
    }
}

/// What a body's inertia grows by when its axis moves away from the centre of mass (kg m2).
fn parallel_axis(mass_kg: f64, way_m: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * way_m.norm_squared() - way_m * way_m.transpose()) * mass_kg
}

/// The tensor about the centre of mass of one that was taken about the link's origin with positive products
/// of inertia: products change sign, then the parallel axis term goes.
pub(crate) fn about_com(tensor: &Matrix3<f64>, mass_kg: f64, com_m: &Vector3<f64>) -> Matrix3<f64> {
    let diagonal = Matrix3::from_diagonal(&tensor.diagonal());
    diagonal * 2.0 - tensor - parallel_axis(mass_kg, com_m)
}

/// The share of the Bhatia-Davis bound that a real link stays below: at 1 all its mass would sit at its two ends; links
/// with a heavy motor at either end reach about 0.7.
const PLAUSIBLE_SHARE: f64 = 0.85;
/// Moments of inertia are published to about eight digits; a triangle violated by less is rounding.
const TRIANGLE_SLACK: f64 = 1e-6;

/// What is impossible or implausible about a body that fills no more than the box from `low` to `high` (m, in the
/// link's axes): one sentence, or nothing.
pub(crate) fn doubt(body: &Body, low: &Vector3<f64>, high: &Vector3<f64>) -> Option<String> {
    if body.mass_kg <= 0.0 {
        return Some(format!("its mass is {} kg", body.mass_kg));
    }
    let moments = SymmetricEigen::new(body.inertia_kg_m2).eigenvalues;
    let (least, sum) = (moments.min(), moments.sum());
    if least <= 0.0 {
        return Some(format!(
            "its inertia tensor has the principal moment {least:.3e} kg m2, not above zero"
        ));
    }
    let most = moments.max();
    if most > (sum - most) * (1.0 + TRIANGLE_SLACK) {
        return Some(format!(
            "its largest principal moment, {most:.3e} kg m2, exceeds the sum of the other two, {:.3e}",
            sum - most
        ));
    }
    let bound = moment_bound(body, low, high);
    let share = (0..3).map(|k| body.inertia_kg_m2[(k, k)] / bound[k]).fold(0.0, f64::max);
    if share <= PLAUSIBLE_SHARE {
        return None;
    }
    let moved = Body { inertia_kg_m2: about_com(&body.inertia_kg_m2, body.mass_kg, &body.com_m), ..*body };
    let hint = if share > PLAUSIBLE_SHARE && doubt_free(&moved, low, high) {
        "; it would be possible as a tensor about the link's origin with positive products, so it was probably \
         exported that way"
    } else {
        ""
    };
    let gyration_m = (most / body.mass_kg).sqrt();
    let verdict = if share > 1.0 { "more than" } else { "nearly" };
    Some(format!(
        "its radius of gyration, {gyration_m:.3} m, is {verdict} what a body of its size can have ({:.0} % of the \
         bound){hint}",
        100.0 * share
    ))
}

fn doubt_free(body: &Body, low: &Vector3<f64>, high: &Vector3<f64>) -> bool {
    let moments = SymmetricEigen::new(body.inertia_kg_m2).eigenvalues;
    let bound = moment_bound(body, low, high);
    moments.min() > 0.0
        && moments.max() <= (moments.sum() - moments.max()) * (1.0 + TRIANGLE_SLACK)
        && (0..3).all(|k| body.inertia_kg_m2[(k, k)] <= PLAUSIBLE_SHARE * bound[k])
}

/// The largest moments of inertia about x, y, z that mass inside a box can have, given its centre of mass: along each
/// axis the variance is at most (high - mean)(mean - low) (Bhatia and Davis, 2000).
fn moment_bound(body: &Body, low: &Vector3<f64>, high: &Vector3<f64>) -> Vector3<f64> {
    let spread = (high - body.com_m).component_mul(&(body.com_m - low)) * body.mass_kg;
    Vector3::new(spread.y + spread.z, spread.x + spread.z, spread.x + spread.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of a few products of numbers near one.
    const TIGHT: f64 = 1e-12;

    fn rod(mass_kg: f64, length_m: f64) -> Body {
        let moment = mass_kg * length_m * length_m / 12.0;
        let inertia_kg_m2 = Matrix3::from_diagonal(&Vector3::new(moment * 0.01, moment, moment));
        Body { mass_kg, com_m: Vector3::new(length_m / 2.0, 0.0, 0.0), inertia_kg_m2 }
    }

    #[test]
    fn two_half_rods_joined_are_the_whole_rod() {
        let half =
            Body { inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(0.0, 1.0, 1.0)), ..rod(1.0, 1.0) };
        let half = Body { inertia_kg_m2: half.inertia_kg_m2 / 12.0, ..half };
        let shift = Frame::translation(1.0, 0.0, 0.0);
        let whole = half.joined(&half.seen_from(&shift));
        assert!((whole.com_m.x - 1.0).abs() < TIGHT, "centre at {} m", whole.com_m.x);
        let moment = whole.inertia_kg_m2[(1, 1)];
        assert!((moment - 2.0 * 4.0 / 12.0).abs() < TIGHT, "moment {moment} kg m2");
    }

    #[test]
    fn a_tensor_about_the_origin_with_positive_products_is_brought_to_the_centre() {
        let body = Body {
            mass_kg: 3.0,
            com_m: Vector3::new(-0.2, 0.05, 0.1),
            inertia_kg_m2: Matrix3::new(0.02, 0.003, -0.004, 0.003, 0.03, 0.001, -0.004, 0.001, 0.04),
        };
        let about_origin = body.inertia_kg_m2 + parallel_axis(body.mass_kg, &body.com_m);
        let positive_products = Matrix3::from_diagonal(&about_origin.diagonal()) * 2.0 - about_origin;
        let back = about_com(&positive_products, body.mass_kg, &body.com_m);
        let error = (back - body.inertia_kg_m2).amax();
        assert!(error < TIGHT, "off by {error} kg m2");
    }

    #[test]
    fn a_rod_is_plausible_and_its_tensor_about_the_end_is_not() {
        let (low, high) = (Vector3::new(0.0, -0.05, -0.05), Vector3::new(1.0, 0.05, 0.05));
        assert_eq!(doubt(&rod(2.0, 1.0), &low, &high), None);
        let mut at_end = rod(2.0, 1.0);
        at_end.inertia_kg_m2 += parallel_axis(2.0, &at_end.com_m);
        let sentence = doubt(&at_end, &low, &high).expect("a doubt");
        assert!(sentence.contains("link's origin"), "{sentence}");
    }

    #[test]
    fn a_plate_thinner_than_nothing_is_refused() {
        let inertia_kg_m2 = Matrix3::from_diagonal(&Vector3::new(0.1, 0.1, 0.3));
        let body = Body { mass_kg: 1.0, com_m: Vector3::zeros(), inertia_kg_m2 };
        let sentence = doubt(&body, &Vector3::repeat(-1.0), &Vector3::repeat(1.0)).expect("a doubt");
        assert!(sentence.contains("exceeds the sum"), "{sentence}");
    }
}
