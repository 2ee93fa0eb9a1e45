//! Mass, centre of mass and inertia tensor of a link, and whether they are physically possible.

use super::frame::Frame;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// The inertial parameters of a rigid body, in its link's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkInertia {
    /// The mass (kg).
    pub mass_kg: f64,
    /// The centre of mass (m).
    pub com_m: Vector3<f64>,
    /// The inertia tensor about the centre of mass, along the link's axes (kg m2). Products of inertia have the tensor's
    /// sign, `ixy` = -integral of xy dm, as in URDF.
    pub inertia_kg_m2: Matrix3<f64>,
}

impl LinkInertia {
    /// Zero mass.
    pub fn none() -> Self {
        Self { mass_kg: 0.0, com_m: Vector3::zeros(), inertia_kg_m2: Matrix3::zeros() }
    }

    /// The same body, expressed in another frame.
    #[must_use]
    pub fn transformed(&self, other_from_own: &Frame) -> Self {
        let rotation = other_from_own.rotation.matrix();
        Self {
            mass_kg: self.mass_kg,
            com_m: other_from_own.rotation * self.com_m + other_from_own.translation.vector,
            inertia_kg_m2: rotation * self.inertia_kg_m2 * rotation.transpose(),
        }
    }

    /// Both bodies rigidly joined (parallel axis theorem).
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

/// The parallel axis term: the increase of the inertia tensor at a distance from the centre of mass (kg m2).
fn parallel_axis(mass_kg: f64, offset_m: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * offset_m.norm_squared() - offset_m * offset_m.transpose()) * mass_kg
}

/// Converts a tensor about the link's origin with positive products of inertia to one about the centre of mass: negates the
/// products, then subtracts the parallel axis term.
pub(crate) fn about_com(tensor: &Matrix3<f64>, mass_kg: f64, com_m: &Vector3<f64>) -> Matrix3<f64> {
    let diagonal = Matrix3::from_diagonal(&tensor.diagonal());
    diagonal * 2.0 - tensor - parallel_axis(mass_kg, com_m)
}

/// Largest plausible fraction of the Bhatia-Davis bound: at 1 all mass is concentrated at the link's two ends; links with a
/// heavy motor at either end reach about 0.7.
const PLAUSIBLE_FRACTION: f64 = 0.85;
/// Largest relative violation of the triangle inequality by rounding: moments are published to about eight digits.
const TRIANGLE_SLACK: f64 = 1e-6;

/// The reason for which a body inside the box from `low` to `high` (m, link axes) is impossible or implausible; `None` if it
/// is plausible.
pub(crate) fn implausibility(body: &LinkInertia, low: &Vector3<f64>, high: &Vector3<f64>) -> Option<String> {
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
    let fraction = (0..3).map(|k| body.inertia_kg_m2[(k, k)] / bound[k]).fold(0.0, f64::max);
    if fraction <= PLAUSIBLE_FRACTION {
        return None;
    }
    let moved =
        LinkInertia { inertia_kg_m2: about_com(&body.inertia_kg_m2, body.mass_kg, &body.com_m), ..*body };
    let hint = if is_plausible(&moved, low, high) {
        "; it is plausible as a tensor about the link's origin with positive products, so it was probably \
         exported in that form"
    } else {
        ""
    };
    let gyration_m = (most / body.mass_kg).sqrt();
    let comparison = if fraction > 1.0 { "more than" } else { "nearly" };
    Some(format!(
        "its radius of gyration, {gyration_m:.3} m, is {comparison} the largest possible one for a body of its size ({:.0} % of the \
         bound){hint}",
        100.0 * fraction
    ))
}

fn is_plausible(body: &LinkInertia, low: &Vector3<f64>, high: &Vector3<f64>) -> bool {
    let moments = SymmetricEigen::new(body.inertia_kg_m2).eigenvalues;
    let bound = moment_bound(body, low, high);
    moments.min() > 0.0
        && moments.max() <= (moments.sum() - moments.max()) * (1.0 + TRIANGLE_SLACK)
        && (0..3).all(|k| body.inertia_kg_m2[(k, k)] <= PLAUSIBLE_FRACTION * bound[k])
}

/// The largest moments of inertia about x, y, z of a mass inside a box, given its centre of mass: along each axis the
/// variance is at most (high - mean)(mean - low) (Bhatia and Davis, 2000).
fn moment_bound(body: &LinkInertia, low: &Vector3<f64>, high: &Vector3<f64>) -> Vector3<f64> {
    let spread = (high - body.com_m).component_mul(&(body.com_m - low)) * body.mass_kg;
    Vector3::new(spread.y + spread.z, spread.x + spread.z, spread.x + spread.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding error of a few products of numbers near one.
    const TIGHT: f64 = 1e-12;

    fn rod(mass_kg: f64, length_m: f64) -> LinkInertia {
        let moment = mass_kg * length_m * length_m / 12.0;
        let inertia_kg_m2 = Matrix3::from_diagonal(&Vector3::new(moment * 0.01, moment, moment));
        LinkInertia { mass_kg, com_m: Vector3::new(length_m / 2.0, 0.0, 0.0), inertia_kg_m2 }
    }

    #[test]
    fn two_joined_half_rods_have_the_inertia_of_the_whole_rod() {
        let half = LinkInertia {
            inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(0.0, 1.0, 1.0)),
            ..rod(1.0, 1.0)
        };
        let half = LinkInertia { inertia_kg_m2: half.inertia_kg_m2 / 12.0, ..half };
        let shift = Frame::translation(1.0, 0.0, 0.0);
        let whole = half.joined(&half.transformed(&shift));
        assert!((whole.com_m.x - 1.0).abs() < TIGHT, "centre at {} m", whole.com_m.x);
        let moment = whole.inertia_kg_m2[(1, 1)];
        assert!((moment - 2.0 * 4.0 / 12.0).abs() < TIGHT, "moment {moment} kg m2");
    }

    #[test]
    fn a_tensor_about_the_origin_with_positive_products_is_converted_to_the_centre_of_mass() {
        let body = LinkInertia {
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
        assert_eq!(implausibility(&rod(2.0, 1.0), &low, &high), None);
        let mut at_end = rod(2.0, 1.0);
        at_end.inertia_kg_m2 += parallel_axis(2.0, &at_end.com_m);
        let sentence = implausibility(&at_end, &low, &high).expect("a reason");
        assert!(sentence.contains("link's origin"), "{sentence}");
    }

    #[test]
    fn moments_that_violate_the_triangle_inequality_are_implausible() {
        let inertia_kg_m2 = Matrix3::from_diagonal(&Vector3::new(0.1, 0.1, 0.3));
        let body = LinkInertia { mass_kg: 1.0, com_m: Vector3::zeros(), inertia_kg_m2 };
        let sentence =
            implausibility(&body, &Vector3::repeat(-1.0), &Vector3::repeat(1.0)).expect("a reason");
        assert!(sentence.contains("exceeds the sum"), "{sentence}");
    }
}
