//! A rigid body that slides on the table in small time steps.

use super::truth::TrueModel;
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{Object, Shape};
use crate::physics::GRAVITY_M_S2;
use std::collections::BTreeMap;

/// The time step of the motion (s).
pub(super) const STEP_S: f64 = 2.5e-4;

/// A body and its motion, in the table frame.
#[derive(Clone, Debug)]
pub(super) struct Body {
    pub(super) object: String,
    pub(super) shape: Shape,
    pub(super) height_m: f64,
    pub(super) mass_kg: f64,
    inertia_kg_m2: f64,
    friction: f64,
    /// Gravity's component along the table (m/s2).
    downhill_m_s2: Vec2,
    /// Points of the support in the body's frame; each carries the same fraction of the weight while the body does not slide.
    support_m: Vec<Vec2>,
    /// How far ahead of the centroid the body presses on the table while it slides (m).
    ahead_m: f64,
    pub(super) yaw_visible: bool,
    pub(super) position: Point,
    pub(super) yaw_rad: f64,
    pub(super) velocity: Vec2,
    pub(super) yaw_rate_rad_s: f64,
}

impl Body {
    /// A body at rest; `friction_scale` multiplies its true friction in this clip.
    pub(super) fn new(
        name: String,
        object: &Object,
        model: &TrueModel,
        pose: Pose,
        friction_scale: f64,
    ) -> Self {
        let of = |values: &BTreeMap<String, f64>| values.get(&object.name).copied().unwrap_or(f64::NAN);
        let mass_kg = of(&model.masses_kg);
        let friction = of(&model.truth.friction) * friction_scale;
        Self {
            object: name,
            shape: object.shape.clone(),
            height_m: object.height_m,
            mass_kg,
            inertia_kg_m2: mass_kg * object.shape.radius_of_gyration_m().powi(2),
            friction,
            downhill_m_s2: Vec2::from(model.truth.slope) * GRAVITY_M_S2,
            support_m: model.supports_m.get(&object.name).cloned().unwrap_or_default(),
            ahead_m: model.pressed_ahead * friction * object.height_m / 2.0,
            yaw_visible: !matches!(object.feature().shape, Shape::Disc { .. }),
            position: pose.position,
            yaw_rad: pose.yaw_rad,
            velocity: Vec2::ZERO,
            yaw_rate_rad_s: 0.0,
        }
    }

    /// Velocity of a material point (m/s).
    pub(super) fn velocity_at(&self, point: Point) -> Vec2 {
        self.velocity + (point - self.position).perpendicular() * self.yaw_rate_rad_s
    }

    /// Acceleration (m/s^2) and angular acceleration (rad/s^2) by friction and gravity, at this motion.
    fn acceleration(&self, velocity: Vec2, yaw_rate_rad_s: f64) -> (Vec2, f64) {
        let (braking, turning) = self.deceleration(velocity, yaw_rate_rad_s);
        (braking + self.downhill_m_s2, turning)
    }

    /// Acceleration (m/s^2) and angular acceleration (rad/s^2) by Coulomb friction of the support, at this motion.
    fn deceleration(&self, velocity: Vec2, yaw_rate_rad_s: f64) -> (Vec2, f64) {
        let braking_m_s2 = self.friction * GRAVITY_M_S2;
        if yaw_rate_rad_s == 0.0 {
            return (velocity.direction().map_or(Vec2::ZERO, |d| d * -braking_m_s2), 0.0);
        }
        // In the body's frame the support points are constant.
        let own = velocity.rotated(-self.yaw_rad);
        let (mut force, mut torque) = (Vec2::ZERO, 0.0);
        let ahead = own.direction().unwrap_or_default();
        let squares_m2: f64 = self.support_m.iter().map(|arm| arm.dot(ahead).powi(2)).sum();
        let per_m = self.ahead_m * self.support_m.len() as f64 / squares_m2.max(f64::MIN_POSITIVE);
        for arm in &self.support_m {
            let slip = own + arm.perpendicular() * yaw_rate_rad_s;
            let speed = slip.length_squared().sqrt();
            if speed > 0.0 {
                let pressure = 1.0 + per_m * arm.dot(ahead);
                force -= slip * (pressure / speed);
                torque -= arm.cross(slip) * (pressure / speed);
            }
        }
        let force = force.rotated(self.yaw_rad);
        let per_point = braking_m_s2 / self.support_m.len() as f64;
        (force * per_point, torque * per_point * self.mass_kg / self.inertia_kg_m2)
    }

    /// One step of sliding (midpoint rule).  Friction stops a body and never reverses it.
    pub(super) fn slide(&mut self) {
        if self.velocity == Vec2::ZERO && self.yaw_rate_rad_s == 0.0 {
            return;
        }
        let loss_m_s = self.friction * GRAVITY_M_S2 * STEP_S;
        let rim_m_s = self.yaw_rate_rad_s.abs() * (self.inertia_kg_m2 / self.mass_kg).sqrt();
        // Translation and rotation end together (Farkas et al. 2003), within one step.
        if self.velocity.length() <= loss_m_s && rim_m_s <= 2.0 * loss_m_s {
            self.position += self.velocity * (self.velocity.length() / (2.0 * loss_m_s) * STEP_S);
            (self.velocity, self.yaw_rate_rad_s) = (Vec2::ZERO, 0.0);
            return;
        }
        let half_s = STEP_S / 2.0;
        let (linear, angular) = self.acceleration(self.velocity, self.yaw_rate_rad_s);
        let (linear, angular) =
            self.acceleration(self.velocity + linear * half_s, self.yaw_rate_rad_s + angular * half_s);
        let (velocity, rate) = (self.velocity + linear * STEP_S, self.yaw_rate_rad_s + angular * STEP_S);
        self.position += (self.velocity + velocity) * half_s;
        self.yaw_rad += (self.yaw_rate_rad_s + rate) * half_s;
        (self.velocity, self.yaw_rate_rad_s) = (velocity, rate);
    }

    /// Inverse inertia at a point: the velocity change of the point per unit impulse (1/kg), normal to normal, tangent to
    /// tangent, and normal to tangent, if the body had the mass `mass_kg`.
    pub(super) fn inverse_inertia(&self, point: Point, n: Vec2, t: Vec2, mass_kg: f64) -> [f64; 3] {
        let arm = point - self.position;
        let (a, b) = (arm.cross(n), arm.cross(t));
        let inertia = self.inertia_kg_m2 * mass_kg / self.mass_kg;
        [1.0 / mass_kg + a * a / inertia, 1.0 / mass_kg + b * b / inertia, a * b / inertia]
    }

    /// Applies an impulse (N s) at a point as if the body had the mass `mass_kg`.
    pub(super) fn apply(&mut self, point: Point, impulse: Vec2, mass_kg: f64) {
        let inertia = self.inertia_kg_m2 * mass_kg / self.mass_kg;
        self.velocity += impulse / mass_kg;
        self.yaw_rate_rad_s += (point - self.position).cross(impulse) / inertia;
    }
}
