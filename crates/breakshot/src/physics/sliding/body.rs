//! What is a body to the simulator: outline, inertia, grip of the table.

use crate::geometry::Pose;
use crate::physics::contact::compound_shape::Plate;
use crate::physics::sliding::limit_surface::Hold;
use crate::physics::sliding::slide_curve::SlideCurve;
use std::sync::Arc;

/// A body of the world; a striker and a wall have no inverse mass.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Body {
    /// Its outline.
    pub(crate) plate: Arc<Plate>,
    /// Where it lies at first.
    pub(crate) pose: Pose,
    /// One over its mass (1/kg, or one over reference masses).
    pub(crate) inverse_mass: f64,
    /// One over its moment of inertia about the centroid.
    pub(crate) inverse_inertia: f64,
    /// Friction times gravity: deceleration of a slide without spin (m/s2).
    pub(crate) grip_m_s2: f64,
    /// Radius of the uniform disc whose friction torque the support has (m).
    pub(crate) patch_radius_m: f64,
    /// How it slides and spins.
    pub(crate) curve: Arc<SlideCurve>,
    /// How the table holds it where its support is no round patch.
    pub(crate) hold: Option<Arc<Hold>>,
    /// Its row in the table of pair coefficients.
    pub(crate) kind: usize,
}

impl Body {
    /// Deceleration of a spin in place, the greatest there is (rad/s2).
    pub(crate) fn spin_deceleration_rad_s2(&self) -> f64 {
        self.grip_m_s2 * self.curve.spin_deceleration() / self.patch_radius_m
    }

    /// Whether an impact cannot move it.
    pub(crate) fn is_fixed(&self) -> bool {
        self.inverse_mass == 0.0
    }
}
