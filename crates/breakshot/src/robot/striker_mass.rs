//! How heavy is the striker on the arm's tip?

use super::arm::mounted_arm::MountedArm;
use crate::geometry::{Point, Vec2};
use crate::scene::Scene;
use std::f64::consts::TAU;

/// Number of headings over which the mobility is averaged.
const HEADINGS: u32 = 24;

impl MountedArm {
    /// The effective mass (kg, Eq. 8) of a striker on the arm's tip, for strikes on the placed objects.
    ///
    /// The mobility (1/kg) is averaged over all headings in which the tip reaches the objects' mean position: impacts depend on the
    /// mobility, and by far less on its variation over headings than on the objects' masses.  `None` for an arm of unknown rotor
    /// inertias (its effective mass is a lower bound only), an empty table, and a pile out of reach.
    pub(crate) fn striker_mass_kg(&self, scene: &Scene) -> Option<f64> {
        if !self.arm.has_rotor_inertias() || scene.placed.is_empty() {
            return None;
        }
        let sum = scene.placed.iter().fold(Vec2::ZERO, |sum, placed| sum + placed.position_m.to_vec());
        let middle = Point::ORIGIN + sum / scene.placed.len() as f64;
        let headings = (0..HEADINGS).map(|k| TAU * f64::from(k) / f64::from(HEADINGS));
        let tips = headings.filter_map(|heading_rad| self.capability(middle, heading_rad));
        let mobilities: Vec<f64> = tips.map(|tip| 1.0 / tip.effective_mass_kg).collect();
        let mean_per_kg = mobilities.iter().sum::<f64>() / mobilities.len() as f64;
        (mean_per_kg > 0.0).then(|| 1.0 / mean_per_kg)
    }
}
