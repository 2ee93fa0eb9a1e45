//! Which physical laws does a simulation follow, if not the default ones, and what is assumed where nothing was measured?

use breakshot::physics::{
    AfterStrike, ImpactLaw, MultipleImpact, Options, Pressing, RestitutionLaw, Surface,
};
use clap::{Args, ValueEnum};

/// The laws of a simulation; without flags they are those of planning and verification.
#[derive(Debug, Args)]
pub(crate) struct LawArgs {
    /// Condition at which an impact ends.
    #[arg(long, value_name = "LAW", value_enum, default_value = "stronge")]
    impact_law: ImpactLawName,
    /// Dependence of restitution on the impact speed.
    #[arg(long, value_name = "LAW", value_enum, default_value = "constant")]
    restitution_law: RestitutionLawName,
    /// Impact speed (m/s) at which the restitution was measured, for `--restitution-law power` and `viscoelastic`.
    #[arg(
        long,
        value_name = "V",
        required_if_eq_any([("restitution_law", "power"), ("restitution_law", "viscoelastic")])
    )]
    reference_speed_m_s: Option<f64>,
    /// Exponent of `--restitution-law power`, 0 to 1.
    #[arg(long, value_name = "X", default_value_t = 0.25)]
    restitution_exponent: f64,
    /// Resolution of impacts that happen at the same time.
    #[arg(long, value_name = "LAW", value_enum, default_value = "compliant")]
    multiple_impact: MultipleImpactName,
    /// Effective mass of the striker (kg); without it impacts slow the striker only if the cell gives the rotor inertias of its arm.
    #[arg(long, value_name = "M")]
    striker_mass_kg: Option<f64>,
    /// How exactly pushes are simulated.
    #[arg(long, value_name = "HOW", value_enum, default_value = "fine")]
    pressing: PressingName,
    /// Relative growth of the table's friction with speed (s/m).
    #[arg(long, value_name = "G", default_value_t = 0.0, allow_negative_numbers = true)]
    friction_growth_s_m: f64,
    /// Friction across the table's grain over friction along it.
    #[arg(long, value_name = "RATIO", default_value_t = 1.0)]
    friction_across_grain: f64,
    /// Heading of the table's grain (rad).
    #[arg(long, value_name = "RAD", default_value_t = 0.0, allow_negative_numbers = true)]
    grain_rad: f64,
    /// What the striker does after it stops.
    #[arg(long, value_name = "MOTION", value_enum, default_value = "retract")]
    after_strike: AfterStrikeName,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ImpactLawName {
    /// Work regained = e^2 times work of compression.
    Stronge,
    /// Impulse regained = e times impulse of compression.
    Poisson,
    /// Separation speed = e times approach speed.
    Newton,
    /// Eq. 17 to 23 of the paper as printed.
    Paper,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum RestitutionLawName {
    /// The measured restitution at every speed.
    Constant,
    /// e (v / V)^-X, at most 1.
    Power,
    /// 1 - (1 - e) (v / V)^(1/5).
    Viscoelastic,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum MultipleImpactName {
    /// All contacts together, as springs.
    Compliant,
    /// One pair after the other, the earliest first.
    Pairwise,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum PressingName {
    /// Bodies that press on each other part at 3 mm/s.
    Fine,
    /// They part at 15 mm/s, as while a robust plan searches: quicker, less exact.
    Coarse,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum AfterStrikeName {
    /// It draws back along the line of the strike.
    Retract,
    /// It is lifted off the table.
    Lift,
}

impl LawArgs {
    /// The options of the simulation beside those of planning; the library checks their numbers.
    pub(crate) fn options(&self, planning: Options) -> Options {
        let reference_speed_m_s = self.reference_speed_m_s.unwrap_or(f64::NAN);
        Options {
            impact: match self.impact_law {
                ImpactLawName::Stronge => ImpactLaw::Stronge,
                ImpactLawName::Poisson => ImpactLaw::Poisson,
                ImpactLawName::Newton => ImpactLaw::Newton,
                ImpactLawName::Paper => ImpactLaw::Paper,
            },
            restitution: match self.restitution_law {
                RestitutionLawName::Constant => RestitutionLaw::Constant,
                RestitutionLawName::Power => {
                    RestitutionLaw::Power { reference_speed_m_s, exponent: self.restitution_exponent }
                }
                RestitutionLawName::Viscoelastic => RestitutionLaw::Viscoelastic { reference_speed_m_s },
            },
            multiple_impact: match self.multiple_impact {
                MultipleImpactName::Compliant => MultipleImpact::default(),
                MultipleImpactName::Pairwise => MultipleImpact::Pairwise,
            },
            striker_mass_kg: self.striker_mass_kg.or(planning.striker_mass_kg),
            apparent_striker_restitution: self.striker_mass_kg.is_none()
                && planning.apparent_striker_restitution,
            pressing: match self.pressing {
                PressingName::Fine => Pressing::Fine,
                PressingName::Coarse => Pressing::Coarse,
            },
            surface: Surface {
                growth_s_m: self.friction_growth_s_m,
                grain_rad: self.grain_rad,
                across: self.friction_across_grain,
            },
            after_strike: match self.after_strike {
                AfterStrikeName::Retract => AfterStrike::Retract,
                AfterStrikeName::Lift => AfterStrike::Lift,
            },
            ..planning
        }
    }
}

/// Values for quantities that were not measured.
#[derive(Debug, Args)]
pub(crate) struct Assumptions {
    /// Restitution (0 to 1) of pairs without a measured one, the striker included; inferred from the measured ones if not given.
    #[arg(long, value_name = "E")]
    pub(crate) assume_restitution: Option<f64>,
}
