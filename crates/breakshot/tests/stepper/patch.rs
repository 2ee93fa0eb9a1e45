//! Friction of the table on a body that slides and spins: tabulated once by quadrature over a uniform round patch.

use super::{Body, GRAVITY_M_S2};
use std::f64::consts::TAU;

/// Force over mu m g and torque over mu m g R, by the ratio of speed to rim speed.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    table: Vec<[f64; 2]>,
}

/// Rows of the table, uniform in ratio / (1 + ratio).
const ROWS: usize = 512;
/// Rings and sectors of the patch.
const RINGS: usize = 200;
const SECTORS: usize = 180;

impl Patch {
    pub(crate) fn new() -> Self {
        static TABLE: std::sync::OnceLock<Vec<[f64; 2]>> = std::sync::OnceLock::new();
        Self { table: TABLE.get_or_init(|| (0..=ROWS).map(row).collect()).clone() }
    }

    fn force_and_torque(&self, speed: f64, rim_speed: f64) -> [f64; 2] {
        let at = speed / (speed + rim_speed) * ROWS as f64;
        let k = (at as usize).min(ROWS - 1);
        let fraction = at - k as f64;
        [0, 1].map(|c| self.table[k][c] + fraction * (self.table[k + 1][c] - self.table[k][c]))
    }

    /// Brakes a body for a time step (midpoint rule).  Friction stops the body and never reverses its motion.
    pub(crate) fn rub(&self, body: &mut Body, step_s: f64) {
        let [vx, vy, w] = body.speed;
        let (v, grip) = (vx.hypot(vy), body.friction * GRAVITY_M_S2);
        // The disc with the same greatest torque: 2/3 of its radius is its mean arm.
        let radius_m = 1.5 * body.mean_arm_m;
        let yaw_deceleration = grip * body.mass_kg * radius_m * radius_m / body.inertia_kg_m2;
        let rim = w.abs() * radius_m;
        if v == 0.0 && rim == 0.0 {
            return;
        }
        let slope = |v: f64, rim: f64| {
            let [force, torque] = self.force_and_torque(v, rim);
            [grip * force, yaw_deceleration * torque]
        };
        let [force, torque] = slope(v, rim);
        let (v_mid, rim_mid) = ((v - 0.5 * step_s * force).max(0.0), (rim - 0.5 * step_s * torque).max(0.0));
        let [force, torque] = if v_mid + rim_mid > 0.0 { slope(v_mid, rim_mid) } else { [force, torque] };
        let left = |speed: f64, loss: f64| if speed > loss { 1.0 - loss / speed } else { 0.0 };
        let (slide, spin) = (left(v, step_s * force), left(rim, step_s * torque));
        body.speed = [vx * slide, vy * slide, w * spin];
    }
}

/// Sums over the patch, which moves along x at speed u and rotates with rim speed 1 - u, u the fraction of the row.
fn row(k: usize) -> [f64; 2] {
    let (speed, rim_speed) = (k as f64 / ROWS as f64, 1.0 - k as f64 / ROWS as f64);
    if rim_speed == 0.0 {
        return [1.0, 0.0];
    }
    let (mut force, mut torque) = (0.0, 0.0);
    for i in 0..RINGS {
        let r = (i as f64 + 0.5) / RINGS as f64;
        for j in 0..SECTORS {
            let (sin, cos) = ((j as f64 + 0.5) / SECTORS as f64 * TAU).sin_cos();
            let (vx, vy) = (speed - rim_speed * r * sin, rim_speed * r * cos);
            let weight = 2.0 * r / (RINGS * SECTORS) as f64 / vx.hypot(vy);
            force += weight * vx;
            torque += weight * r * (cos * vy - sin * vx);
        }
    }
    [force, torque]
}
