//! All bodies of a clip and the striker, advanced in small time steps.
//!
//! The integrator is slow and simple, and has no code in common with the estimator or the simulator of the library.

use super::body::{Body, STEP_S};
use super::impact::{StrikerState, Variation, collide, strike};
use super::truth::TrueModel;
use crate::geometry::Vec2;
use crate::scene::{RETRACT_PAST_START_M, Strike};

/// Radius of the striker (m).
pub(super) const STRIKER_RADIUS_M: f64 = 0.015;
/// Speed at which the striker draws back (m/s).
pub(super) const RETRACT_M_S: f64 = 0.15;

/// The poses of one body at every time step.
#[derive(Clone, Debug)]
pub(super) struct PoseHistory {
    pub(super) object: String,
    pub(super) yaw_visible: bool,
    /// x (m), y (m), yaw (rad), `STEP_S` apart.
    pub(super) poses: Vec<[f64; 3]>,
}

/// The bodies on the table and the strike.
pub(super) struct World {
    pub(super) bodies: Vec<Body>,
    pub(super) strike: Strike,
    /// The time at which the striker starts to move (s).
    pub(super) strike_start_s: f64,
}

impl World {
    /// The poses of all bodies over `duration_s`; `variation` draws the random factors of every possible impact.
    pub(super) fn run(
        &mut self,
        model: &TrueModel,
        duration_s: f64,
        mut variation: impl FnMut() -> Variation,
    ) -> Vec<PoseHistory> {
        let mut histories: Vec<PoseHistory> = (self.bodies.iter())
            .map(|b| PoseHistory { object: b.object.clone(), yaw_visible: b.yaw_visible, poses: Vec::new() })
            .collect();
        let mut factors = variation();
        for step in 0..(duration_s / STEP_S) as usize {
            for (history, body) in histories.iter_mut().zip(&self.bodies) {
                history.poses.push([body.position.x, body.position.y, body.yaw_rad]);
            }
            self.bodies.iter_mut().for_each(Body::slide);
            let striker = self.striker((step + 1) as f64 * STEP_S);
            for body in &mut self.bodies {
                if strike(&striker, body, model, factors) {
                    factors = variation();
                }
            }
            for second in 1..self.bodies.len() {
                for first in 0..second {
                    let (head, tail) = self.bodies.split_at_mut(second);
                    if collide(&mut head[first], &mut tail[0], model, factors) {
                        factors = variation();
                    }
                }
            }
        }
        histories
    }

    /// Position and velocity of the striker: out along the heading, a stop, and back past the start.
    fn striker(&self, time_s: f64) -> StrikerState {
        let along = Vec2::from_heading(self.strike.heading_rad);
        let elapsed_s = time_s - self.strike_start_s;
        let out_s = self.strike.travel_m / self.strike.speed_m_s;
        let back_m = self.strike.travel_m - RETRACT_M_S * (elapsed_s - out_s);
        let (distance_m, speed_m_s) = match elapsed_s {
            t if t <= 0.0 => (0.0, 0.0),
            t if t < out_s => (t * self.strike.speed_m_s, self.strike.speed_m_s),
            _ if back_m > -RETRACT_PAST_START_M => (back_m, -RETRACT_M_S),
            _ => (-RETRACT_PAST_START_M, 0.0),
        };
        StrikerState {
            radius_m: STRIKER_RADIUS_M,
            position: self.strike.start_m + along * distance_m,
            velocity: along * speed_m_s,
        }
    }
}
