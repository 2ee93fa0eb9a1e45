//! How to plan: which algorithm, which arm, how exactly things are known.

use crate::geometry::Point;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};

/// Which algorithm plans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The paper's feedback on the speed.
    #[default]
    Paper,
    /// The strike that works most probably, over all that is not known exactly.
    Robust,
}

/// The striker's effective mass (kg) in Eq. 8, by the touched point and the heading (rad); zero where the arm cannot strike.
pub type EffectiveMass<'a> = dyn Fn(Point, f64) -> f64 + Sync + 'a;

/// Strikes worth judging besides those from all around: what experience or a learned model proposes for a scene.
pub type Proposals<'a> = dyn Fn(&Scene) -> Vec<Aim> + Sync + 'a;

/// How to plan.
#[derive(Clone, Copy, Default)]
pub struct Options<'a> {
    /// Which algorithm.
    pub method: Method,
    /// The arm's impulse geometry; without it the striker counts as infinitely heavy.
    pub effective_mass_kg: Option<&'a EffectiveMass<'a>>,
    /// What else to judge; only `Robust` asks.
    pub proposals: Option<&'a Proposals<'a>>,
    /// How well the pile is seen and the strike carried out; only `Robust` asks.
    pub scatter: Scatter,
    /// The seed of all draws; only `Robust` draws.
    pub seed: u64,
}

/// How well the pile is seen and how well an arm does what it is told: one standard deviation each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// Of an object's place, along each axis (m).
    pub position_m: f64,
    /// Of an object's yaw (rad).
    pub yaw_rad: f64,
    /// Of the strike's speed, relative.
    pub speed: f64,
    /// Of the strike's heading (rad).
    pub heading_rad: f64,
}

impl Default for Scatter {
    /// A camera that sees a millimetre and a degree, an arm that keeps two parts in a hundred and a degree: what a strike has to bear to
    /// be called reliable.
    fn default() -> Self {
        Self { position_m: 1e-3, yaw_rad: 0.0175, speed: 0.02, heading_rad: 0.0175 }
    }
}

/// What a strike aims at, apart from where it starts.
#[derive(Clone, Debug, PartialEq)]
pub struct Aim {
    /// The object to touch first: its index in the scene's `placed`.
    pub object: usize,
    /// The direction (rad).
    pub heading_rad: f64,
    /// How far to the left of the object's centroid the striker's centre passes (m).
    pub offset_m: f64,
    /// The speed (m/s).
    pub speed_m_s: f64,
    /// How far the striker runs on after it touched the object (m).
    pub follow_through_m: f64,
}
