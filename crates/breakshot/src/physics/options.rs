//! Which laws does a simulation follow?

use crate::error::bounds::positive;
use crate::error::{Error, Result};
use crate::physics::contact::time_of_impact::SUSTAINED_CONTACT_M_S;
use crate::physics::event_loop::striker::AfterStrike;
use crate::physics::impact::compliant::Compliance;
use crate::physics::impact::routh::{ImpactLaw, RestitutionLaw};
use crate::physics::sliding::limit_surface::Surface;
use crate::physics::sliding::patch_friction::Spin;

/// How to simulate; the default is what planning and verification use.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Condition at which an impact ends.
    pub impact: ImpactLaw,
    /// Dependence of restitution on the impact speed.
    pub restitution: RestitutionLaw,
    /// Resolution of contacts that close at the same time.
    pub multiple_impact: MultipleImpact,
    /// Whether sliding and spinning affect each other.
    pub spin: Spin,
    /// Dependence of the table's friction on speed and direction.
    pub surface: Surface,
    /// What the striker does after it stops.
    pub after_strike: AfterStrike,
    /// Effective mass of the striker in the direction of the strike (kg, Eq. 8); none: impacts do not slow the arm.
    pub striker_mass_kg: Option<f64>,
    /// Whether the striker's restitution is the apparent one, learned from films as if impacts had not slowed the striker.
    ///
    /// A striker of the mass above gets the restitution with which a free object leaves as in the films,
    /// `(1 + e) (1 + m / striker_mass_kg) - 1`, at most 1 (Eq. 8).
    pub apparent_striker_restitution: bool,
    /// How exactly pushes are simulated.
    pub pressing: Pressing,
}

/// How exactly contacts are simulated whose bodies press on each other, as in a push: such a contact is a series of small impacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pressing {
    /// Bodies part at 3 mm/s at least, or elastically at a smaller approach speed: no impact gains energy.
    #[default]
    Fine,
    /// Bodies part at 15 mm/s at least: fewer impacts, each of which can gain 0.1 mJ per kilogram.
    Coarse,
}

/// Least speed at which bodies part in coarse pushes (m/s): gaps of some 40 um open between a striker and the object that it pushes.
const COARSE_REBOUND_M_S: f64 = 0.015;

impl Pressing {
    /// Least speed at which bodies part (m/s).
    pub(crate) fn least_rebound_m_s(self) -> f64 {
        match self {
            Self::Fine => SUSTAINED_CONTACT_M_S,
            Self::Coarse => COARSE_REBOUND_M_S,
        }
    }

    /// The restitution of an impact with a measured one at an approach speed.
    pub(crate) fn restitution(self, measured: f64, approach_m_s: f64) -> f64 {
        let least = self.least_rebound_m_s() / approach_m_s;
        match self {
            Self::Fine => measured.max(least).min(1.0),
            Self::Coarse => measured.max(least),
        }
    }
}

/// Resolution of contacts that close at the same time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MultipleImpact {
    /// All together, as springs: the result does not depend on any order.
    Compliant(Compliance),
    /// One pair after the other, the earliest first.
    Pairwise,
}

impl Default for MultipleImpact {
    fn default() -> Self {
        Self::Compliant(Compliance::default())
    }
}

impl Options {
    /// An error that names the option unless every number is possible.
    pub(crate) fn check(&self) -> Result<()> {
        self.surface.check()?;
        if let Some(mass_kg) = self.striker_mass_kg {
            positive("options", "striker_mass_kg", mass_kg)?;
        }
        let (speed, exponent) = match self.restitution {
            RestitutionLaw::Constant => return Ok(()),
            RestitutionLaw::Power { reference_speed_m_s, exponent } => (reference_speed_m_s, exponent),
            RestitutionLaw::Viscoelastic { reference_speed_m_s } => (reference_speed_m_s, 0.2),
        };
        positive("options", "restitution.reference_speed_m_s", speed)?;
        if !(0.0..=1.0).contains(&exponent) {
            return Err(Error::invalid("options", "restitution.exponent", exponent, "a number from 0 to 1"));
        }
        Ok(())
    }
}
