//! What does this strike do to this pile?
//!
//! An event-driven simulation in the plane: bodies slide under Coulomb friction in closed form (`sliding`), the time of the next
//! impact is a root (`contact`), and an impact is resolved by Routh's method with Stronge's restitution (`impact`).  The
//! `event_loop` connects the three; `output` is what a caller gets.
//!
//! [`trajectory()`] returns everything about one strike; a [`World`] and a [`Simulator`] simulate many strikes at a low cost.

mod bodies;
mod contact;
mod event_loop;
mod impact;
pub(crate) mod mass_unit;
mod options;
mod output;
mod pair_coefficients;
mod rotation;
mod simulator;
pub(crate) mod sliding;
#[cfg(test)]
mod tilt_tests;
mod world;

pub use event_loop::striker::AfterStrike;
pub use impact::compliant::{Compliance, ContactForce, Stiffness};
pub use impact::pair_impact::{ImpactBody, PairImpact};
pub use impact::routh::{ImpactLaw, RestitutionLaw};
pub use options::{MultipleImpact, Options, Pressing};
pub use output::mjcf::{Mjcf, mjcf};
pub use output::near_miss::NearMiss;
pub use output::outcome::Outcome;
pub use output::trajectory::{Energy, Event, EventKind, Segment, Trajectory};
pub use simulator::{Simulator, rollouts};
pub use sliding::limit_surface::Surface;
pub use sliding::patch_friction::{GRAVITY_M_S2, Spin};
pub use world::{Perturbation, World};

use crate::error::Result;
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use output::recorder::Recorder;

/// Simulates one strike and records all events, motions and energies.
///
/// Properties that no clip measured have their assumed means ([`Properties::completed_for`]).
///
/// # Errors
/// Impossible input, objects that overlap, a striker that starts inside one.
pub fn trajectory(
    scene: &Scene,
    properties: &Properties,
    strike: &Strike,
    options: &Options,
) -> Result<Trajectory> {
    World::new(scene, properties, options)?.trajectory(strike)
}

impl World {
    /// As [`trajectory()`], in a world that has been validated.
    ///
    /// # Errors
    /// An impossible strike, a striker that starts inside an object.
    pub fn trajectory(&self, strike: &Strike) -> Result<Trajectory> {
        let mut recorder = Recorder::default();
        let outcome = Simulator::new().recorded(self, strike, Some(&mut recorder))?;
        Ok(recorder.trajectory(self, &outcome))
    }
}
