//! Which friction force and torque act on a body whose support is no round patch?
//!
//! Coulomb friction is summed over the support: `F = -mu m g sum w_i u_i / |u_i|`, where `u_i` is the velocity of the i-th
//! pressure point and `w_i` its fraction of the weight (the paper's non-uniform pressure distribution).  Force and torque are
//! the same for all velocities of one direction in (vx, vy, R omega): they form the limit surface (Goyal, Ruina and
//! Papadopoulos 1991; Howe and Cutkosky 1996).  It is tabulated over the ratio of sliding to spinning and the direction of
//! sliding, both in the body's frame.

use crate::error::bounds::angle;
use crate::error::{Error, Result};
use crate::geometry::Vec2;
use crate::object::{Shape, Support};
use crate::physics::rotation::{Rotation, length};
use crate::physics::sliding::patch_friction::{Spin, patch_force_and_torque};
use crate::physics::sliding::pressure::{is_elongated, pressure_points};
use std::f64::consts::{FRAC_PI_2, TAU};

/// How the friction coefficient of the table depends on speed and direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Relative growth of the friction with speed (s/m).
    pub growth_s_m: f64,
    /// Heading of the table's grain (rad).
    pub grain_rad: f64,
    /// Friction across the grain over friction along it.
    pub across: f64,
}

impl Default for Surface {
    /// Coulomb's law: the same friction in all directions and at all speeds.
    fn default() -> Self {
        Self { growth_s_m: 0.0, grain_rad: 0.0, across: 1.0 }
    }
}

impl Surface {
    pub(crate) fn check(&self) -> Result<()> {
        let owner = "options: surface";
        angle(owner, "grain_rad", self.grain_rad)?;
        if !(self.growth_s_m > -1.0 && self.growth_s_m <= MOST_GROWTH_S_M) {
            let needed = format!("above -1 s/m, at most {MOST_GROWTH_S_M} s/m");
            return Err(Error::invalid(owner, "growth_s_m", self.growth_s_m, needed));
        }
        if !ACROSS.contains(&self.across) {
            let needed = format!("a positive number (from {} to {})", ACROSS.start(), ACROSS.end());
            return Err(Error::invalid(owner, "across", self.across, needed));
        }
        Ok(())
    }
}

/// The largest growth of friction (s/m): at the fastest strike it has two hundred times its value at rest.
const MOST_GROWTH_S_M: f64 = 10.0;
/// The friction across the grain over that along it: a factor of a hundred is more than any cloth or brushed sheet has.
const ACROSS: std::ops::RangeInclusive<f64> = 0.01..=100.0;

/// Cells of the table over the ratio of spinning to sliding, and over the direction of sliding.
const RATIOS: usize = 24;
const DIRECTIONS: usize = 32;

/// The limit surface of one kind of body: force over mu m g and torque over mu m g R.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LimitSurface {
    table: Vec<[f64; 3]>,
    surface: Surface,
    /// Unit vector along the grain.
    grain: Vec2,
    /// Whether a slide without spin is straight and stays without spin.
    pub(crate) is_straight_without_spin: bool,
}

/// The coefficients of a body that convert the dimensionless limit surface into accelerations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SupportCoefficients {
    /// Friction coefficient times gravity (m/s2).
    pub(crate) friction_deceleration_m_s2: f64,
    /// Radius R of the uniform disc that has the same friction torque (m).
    pub(crate) patch_radius_m: f64,
    /// `1 / (kappa R)`, kappa the squared radius of gyration over R^2 (1/m).
    pub(crate) inverse_kappa_radius_per_m: f64,
}

impl SupportCoefficients {
    /// Acceleration (m/s2) and angular acceleration (rad/s2) by friction on a round patch (Farkas et al. 2003).
    pub(crate) fn on_round_patch(&self, spin: Spin, velocity: Vec2, yaw_rate: f64) -> (Vec2, f64) {
        let (speed, rim_speed) = (length(velocity), yaw_rate.abs() * self.patch_radius_m);
        let [force, torque] = match spin {
            Spin::Coupled if rim_speed > 0.0 => patch_force_and_torque(speed / rim_speed),
            _ => [1.0, if rim_speed > 0.0 { patch_force_and_torque(0.0)[1] } else { 0.0 }],
        };
        let braking = self.friction_deceleration_m_s2;
        let along = velocity.direction().unwrap_or(Vec2::ZERO);
        let turning = torque * braking * self.inverse_kappa_radius_per_m;
        (along * (-force * braking), -turning.copysign(yaw_rate))
    }
}

impl LimitSurface {
    /// The limit surface of a shape; none if the round patch is as good.
    pub(crate) fn new(
        shape: &Shape,
        support: Option<&Support>,
        surface: Surface,
        patch_radius_m: f64,
    ) -> Option<Self> {
        let isotropic = surface == Surface::default();
        if isotropic && support.is_none() && !is_elongated(shape) {
            return None;
        }
        let points = pressure_points(shape, support);
        let mut table = Vec::with_capacity((RATIOS + 1) * DIRECTIONS);
        for i in 0..=RATIOS {
            let spin = Vec2::from_heading(FRAC_PI_2 * i as f64 / RATIOS as f64);
            for k in 0..DIRECTIONS {
                let velocity = Vec2::from_heading(TAU * k as f64 / DIRECTIONS as f64) * spin.y;
                table.push(friction_on_points(&points, velocity, spin.x / patch_radius_m, patch_radius_m));
            }
        }
        let is_straight_without_spin = isotropic && !matches!(support, Some(Support::Gradient(_)));
        let grain = Vec2::from_heading(surface.grain_rad);
        Some(Self { table, surface, grain, is_straight_without_spin })
    }

    /// Force over mu m g in the body's frame and torque over mu m g R, by bilinear interpolation, at a velocity in the
    /// body's frame and a rim speed R omega.
    fn friction(&self, velocity: Vec2, rim_speed: f64) -> [f64; 3] {
        // Reversing all velocities reverses force and torque: the table holds positive spin only.
        let sign = if rim_speed < 0.0 { -1.0 } else { 1.0 };
        let velocity = velocity * sign;
        let ratio = length(velocity).atan2(rim_speed.abs()) / FRAC_PI_2 * RATIOS as f64;
        let heading = velocity.y.atan2(velocity.x).rem_euclid(TAU) / TAU * DIRECTIONS as f64;
        let (i, k) = ((ratio as usize).min(RATIOS - 1), heading as usize % DIRECTIONS);
        let (x, y) = (ratio - i as f64, (heading - heading.floor()).clamp(0.0, 1.0));
        let cell = |i: usize, k: usize| &self.table[i * DIRECTIONS + k % DIRECTIONS];
        let corners = [cell(i, k), cell(i, k + 1), cell(i + 1, k), cell(i + 1, k + 1)];
        let weights = [(1.0 - x) * (1.0 - y), (1.0 - x) * y, x * (1.0 - y), x * y];
        [0, 1, 2].map(|c| sign * corners.iter().zip(weights).map(|(v, weight)| v[c] * weight).sum::<f64>())
    }

    /// Acceleration (m/s2) and angular acceleration (rad/s2) by friction, at a velocity and a yaw rate (rad/s).
    pub(crate) fn accelerations(
        &self,
        support: &SupportCoefficients,
        velocity: Vec2,
        yaw_rad: f64,
        yaw_rate: f64,
    ) -> (Vec2, f64) {
        let rotation = Rotation::new(yaw_rad);
        let rim_speed = yaw_rate * support.patch_radius_m;
        let [fx, fy, torque] = self.friction(rotation.apply_inverse(velocity), rim_speed);
        let force = rotation.apply(Vec2::new(fx, fy));
        let surface = &self.surface;
        let across = force - self.grain * force.dot(self.grain);
        let force = force + across * (surface.across - 1.0);
        let torque = torque * 0.5 * (1.0 + surface.across);
        let speed_squared = velocity.length_squared() + rim_speed * rim_speed;
        let deceleration =
            support.friction_deceleration_m_s2 * (1.0 + surface.growth_s_m * speed_squared.sqrt()).max(0.0);
        (force * deceleration, torque * deceleration * support.inverse_kappa_radius_per_m)
    }
}

/// Friction on points that move with a velocity and a yaw rate: force over mu m g, and torque over mu m g R.
pub(crate) fn friction_on_points(
    points: &[(Vec2, f64)],
    velocity: Vec2,
    yaw_rate: f64,
    radius_m: f64,
) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (p, weight) in points {
        let slip = velocity + p.perpendicular() * yaw_rate;
        let speed = length(slip);
        if speed > 0.0 {
            let force = slip * (-weight / speed);
            sum[0] += force.x;
            sum[1] += force.y;
            sum[2] += p.cross(force) / radius_m;
        }
    }
    sum
}
