//! What does this strike do to this pile?
//!
//! An event-driven simulation in the plane: bodies slide under Coulomb friction in closed form (`evolve`), the instant of
//! the next impact is a root (`contact`), an impact is resolved by Routh's method with Stronge's restitution (`resolve`).
//!
//! [`trajectory()`] tells everything about one strike; a [`World`] and a [`Simulator`] do many strikes quickly.

mod contact;
mod event_loop;
mod impact;
mod output;
mod rotation;
mod simulator;
pub(crate) mod sliding;
mod world;

pub use event_loop::striker::{AfterStrike, RETRACT_PAST_START_M};
pub use impact::island::{Compliance, ContactForce, Stiffness};
pub use impact::pair_impact::{Encounter, Mover};
pub use impact::routh::{ImpactLaw, RestitutionLaw};
pub use output::mjcf::{Mjcf, mjcf};
pub use output::near_miss::Graze;
pub use output::outcome::Outcome;
pub use output::trajectory::{Energy, Event, EventKind, Segment, Trajectory};
pub use simulator::{Simulator, rollouts};
pub use sliding::limit_surface::{Pressure, Surface};
pub use sliding::motion::Spin;
pub use world::World;

use crate::error::{Error, Result};
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use output::trajectory::Log;
use std::collections::BTreeMap;

/// Standard gravity as the estimates use it (m/s2).
pub const GRAVITY_M_S2: f64 = 9.81;

/// How to simulate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// When an impact ends.
    pub impact: ImpactLaw,
    /// How restitution depends on speed.
    pub restitution: RestitutionLaw,
    /// How contacts that close together are resolved.
    pub touching: Touching,
    /// Whether sliding and spinning act on each other.
    pub spin: Spin,
    /// Where kinds of objects press on the table, if not evenly.
    pub pressure: BTreeMap<String, Pressure>,
    /// How the table's friction depends on speed and direction.
    pub surface: Surface,
    /// What the striker does after it stops.
    pub after_strike: AfterStrike,
    /// The striker's effective mass in the direction of the strike (kg, Eq. 8); none: the arm does not give way.
    pub striker_mass_kg: Option<f64>,
}

/// How contacts that close together are resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Touching {
    /// Together, as springs: the answer does not depend on any order.
    Compliant(Compliance),
    /// One after the other, the earliest first.
    Pairwise,
}

impl Default for Touching {
    fn default() -> Self {
        Self::Compliant(Compliance::default())
    }
}

impl Options {
    fn check(&self) -> Result<()> {
        for (kind, pressure) in &self.pressure {
            pressure.check(kind)?;
        }
        self.surface.check()?;
        if let Some(mass_kg) = self.striker_mass_kg {
            crate::object::positive("options", "striker_mass_kg", mass_kg)?;
        }
        let (speed, exponent) = match self.restitution {
            RestitutionLaw::Constant => return Ok(()),
            RestitutionLaw::Power { reference_speed_m_s, exponent } => (reference_speed_m_s, exponent),
            RestitutionLaw::Viscoelastic { reference_speed_m_s } => (reference_speed_m_s, 0.2),
        };
        crate::object::positive("options", "restitution.reference_speed_m_s", speed)?;
        if !(0.0..=1.0).contains(&exponent) {
            return Err(Error::invalid("options", "restitution.exponent", exponent, "a number from 0 to 1"));
        }
        Ok(())
    }
}

/// Simulates one strike.
///
/// # Errors
/// Objects that overlap, a striker that starts inside one, properties that were never measured.
pub fn trajectory(
    scene: &Scene,
    properties: &Properties,
    strike: &Strike,
    options: &Options,
) -> Result<Trajectory> {
    let world = World::new(scene, properties, options)?;
    let mut log = Log::default();
    let outcome = Simulator::new().logged(&world, strike, Some(&mut log))?;
    Ok(log.trajectory(&world, &outcome))
}
