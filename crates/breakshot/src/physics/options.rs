//! Which laws does a simulation follow?

use crate::error::{Error, Result};
use crate::object::positive;
use crate::physics::contact::time_of_impact::SUSTAINED_CONTACT_M_S;
use crate::physics::event_loop::striker::AfterStrike;
use crate::physics::impact::compliant::Compliance;
use crate::physics::impact::routh::{ImpactLaw, RestitutionLaw};
use crate::physics::sliding::limit_surface::Surface;
use crate::physics::sliding::motion::Spin;

/// How to simulate; the default is what planning and verification use.
#[derive(Clone, Debug, PartialEq)]
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
    /// Least speed at which bodies part after an impact (m/s), or that of their approach if it is smaller.
    ///
    /// A push is a series of small impacts: twice this speed means half as many of them, and gaps four times as wide.
    pub least_rebound_m_s: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            impact: ImpactLaw::default(),
            restitution: RestitutionLaw::default(),
            multiple_impact: MultipleImpact::default(),
            spin: Spin::default(),
            surface: Surface::default(),
            after_strike: AfterStrike::default(),
            striker_mass_kg: None,
            apparent_striker_restitution: false,
            least_rebound_m_s: SUSTAINED_CONTACT_M_S,
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
        positive("options", "least_rebound_m_s", self.least_rebound_m_s)?;
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
