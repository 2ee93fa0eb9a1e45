//! What does the simulator know about a body: outline, inertia and friction against the table?

use crate::geometry::{Pose, Vec2};
use crate::physics::contact::compound_shape::CompoundShape;
use crate::physics::sliding::limit_surface::{LimitSurface, SupportCoefficients};
use crate::physics::sliding::patch_friction::Spin;
use crate::physics::sliding::slide_curve::SlideCurve;
use std::sync::Arc;

/// The striker's index among the bodies of a world.
pub(crate) const STRIKER: usize = 0;

/// A rigid body of a world; striker and walls have an inverse mass of zero.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Body {
    /// The outline that other bodies collide with.
    pub(crate) shape: Arc<CompoundShape>,
    /// Pose at the start of every strike.
    pub(crate) pose: Pose,
    /// 1 / mass (1/kg, or over the reference object's mass).
    pub(crate) inverse_mass: f64,
    /// 1 / moment of inertia about the centroid.
    pub(crate) inverse_inertia: f64,
    /// Friction coefficient times gravity: deceleration of a slide without spin (m/s2).
    pub(crate) friction_deceleration_m_s2: f64,
    /// Radius of the uniform disc that has the same friction torque as the support (m).
    pub(crate) patch_radius_m: f64,
    /// Coupled sliding and spinning on a round patch.
    pub(crate) curve: Arc<SlideCurve>,
    /// Friction force and torque where a round patch is not good enough.
    pub(crate) limit_surface: Option<Arc<LimitSurface>>,
    /// Gravity's component along a tilted table, zero on a level one (m/s2).
    pub(crate) tilt_m_s2: Vec2,
    /// Row in the table of pair coefficients.
    pub(crate) kind: usize,
}

impl Body {
    /// Angular deceleration of a body that spins without sliding, the greatest possible one (rad/s2).
    pub(crate) fn spin_deceleration_rad_s2(&self) -> f64 {
        self.friction_deceleration_m_s2 * self.curve.spin_deceleration() / self.patch_radius_m
    }

    /// Whether its slides can be curved: not round patches on a level table.
    pub(crate) fn has_curved_paths(&self) -> bool {
        self.limit_surface.is_some() || self.tilt_m_s2 != Vec2::ZERO
    }

    /// Acceleration (m/s2) and angular acceleration (rad/s2) by friction and tilt, at a velocity and a yaw rate (rad/s).
    pub(crate) fn accelerations(
        &self,
        spin: Spin,
        velocity: Vec2,
        yaw_rad: f64,
        yaw_rate: f64,
    ) -> (Vec2, f64) {
        let support = self.support_coefficients();
        let (friction, turning) = match &self.limit_surface {
            Some(limit_surface) if spin == Spin::Coupled => {
                limit_surface.accelerations(&support, velocity, yaw_rad, yaw_rate)
            }
            _ => support.on_round_patch(spin, velocity, yaw_rate),
        };
        (friction + self.tilt_m_s2, turning)
    }

    /// Whether impulses leave its velocity unchanged.
    pub(crate) fn is_fixed(&self) -> bool {
        self.inverse_mass == 0.0
    }

    /// The coefficients that scale the limit surface to this body.
    pub(crate) fn support_coefficients(&self) -> SupportCoefficients {
        SupportCoefficients {
            friction_deceleration_m_s2: self.friction_deceleration_m_s2,
            patch_radius_m: self.patch_radius_m,
            // kappa = (radius of gyration / R)^2, so that R inverse_inertia / inverse_mass = 1 / (kappa R).
            inverse_kappa_radius_per_m: self.patch_radius_m * self.inverse_inertia / self.inverse_mass,
        }
    }
}
