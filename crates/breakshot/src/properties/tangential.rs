//! How much of the slip is left after an impact whose contact points stick?
//!
//! Two laws are possible.  Tangential restitution is a constant of the contacts (Walton and Braun 1986), or the slip is damped at
//! a rate in proportion to that of the approach (Haff and Werner 1986), so that of a slip s the part `e^p` remains in an impact
//! with restitution e.  The films decide; a mean of both laws is simulated, and plans draw one of them.

use super::{Domain, FRACTION, Properties};
use crate::error::{Error, Result};
use crate::uncertain::Estimate;
use serde::{Deserialize, Serialize};

/// The part of the slip that springs back in an impact whose contact points stick (Walton and Braun 1986; Foerster et al.
/// 1994): 0 if sticking only ends the slip, positive for elastic contacts, negative where contacts creep and some slip remains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TangentialRestitution {
    /// Between objects.
    #[serde(default)]
    pub objects: Option<Estimate>,
    /// Between an object and the striker.
    #[serde(default)]
    pub striker: Option<Estimate>,
}

impl TangentialRestitution {
    /// A tangential restitution that was not measured is zero with this standard deviation.
    pub const ASSUMED_STD: f64 = 0.3;
    /// The values that are considered possible.
    pub const RANGE: [f64; 2] = [-0.9, 0.5];

    /// # Errors
    /// A value outside -1..1.
    pub(super) fn check(&self, file: &str) -> Result<()> {
        for (name, estimate) in [("objects", self.objects), ("striker", self.striker)] {
            if let Some(estimate) = estimate {
                TANGENTIAL.check(&format!("{file}: tangential_restitution of {name}"), &estimate)?;
            }
        }
        Ok(())
    }
}

/// The damping of the slip in impacts whose contact points stick, where it follows the restitution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TangentialDamping {
    /// Between objects.
    #[serde(default)]
    pub objects: Option<SlipDamping>,
    /// Between an object and the striker.
    #[serde(default)]
    pub striker: Option<SlipDamping>,
}

impl TangentialDamping {
    pub(super) fn exact(self) -> Self {
        let exact = |damping: SlipDamping| {
            let exponent = Estimate::exact(damping.exponent.mean);
            SlipDamping { exponent, ..damping }
        };
        Self { objects: self.objects.map(exact), striker: self.striker.map(exact) }
    }

    /// # Errors
    /// A probability outside 0..1, an exponent that is not positive.
    pub(super) fn check(&self, file: &str) -> Result<()> {
        for (name, damping) in [("objects", self.objects), ("striker", self.striker)] {
            let Some(SlipDamping { probability, exponent }) = damping else { continue };
            let owner = format!("{file}: tangential_damping of {name}");
            if !(FRACTION.contains)(probability) {
                return Err(Error::invalid(owner, "probability", probability, FRACTION.description));
            }
            EXPONENT.check(&owner, &exponent)?;
        }
        Ok(())
    }
}

/// The law that of a slip s the part `e^p` remains (Haff and Werner 1986).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SlipDamping {
    /// The probability that this law holds, and not a constant tangential restitution.
    pub probability: f64,
    /// The exponent p; its logarithm has the relative standard error.
    pub exponent: Estimate,
}

impl SlipDamping {
    /// The least and the largest exponent before any film: 95 % of a logarithmic normal distribution.
    const ASSUMED: [f64; 2] = [0.42, 9.6];

    /// What is assumed without films: both laws are equally likely, and the rates of damping about equal.
    pub const fn assumed() -> Self {
        let exponent =
            Estimate { mean: 2.0, std: None, standard_error: 1.6, interval_95: Self::ASSUMED, n: 0 };
        Self { probability: 0.5, exponent }
    }

    /// Tangential restitution in an impact with this restitution.
    pub(crate) fn restitution_at(exponent: f64, restitution: f64) -> f64 {
        -restitution.clamp(0.0, 1.0).powf(exponent)
    }
}

const TANGENTIAL: Domain =
    Domain { contains: |v| (-1.0..=1.0).contains(&v), description: "a number from -1 to 1" };
const EXPONENT: Domain =
    Domain { contains: |v| (0.01..=100.0).contains(&v), description: "a number from 0.01 to 100" };

/// Whether a group of values is left out of a file: nothing in it was measured.
pub(super) fn is_unknown<T: Default + PartialEq>(values: &T) -> bool {
    *values == T::default()
}

/// The laws of one kind of contact.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TangentialLaw {
    pub(crate) constant: Option<Estimate>,
    pub(crate) damping: Option<SlipDamping>,
}

impl TangentialLaw {
    /// The mean tangential restitution of impacts with this restitution; zero without any measurement.
    pub(crate) fn mean_at(&self, restitution: f64) -> f64 {
        let constant = self.constant.map_or(0.0, |e| e.mean);
        self.damping.map_or(constant, |SlipDamping { probability, exponent }| {
            let damped = SlipDamping::restitution_at(exponent.mean, restitution);
            probability * damped + (1.0 - probability) * constant
        })
    }
}

impl Properties {
    /// The laws of contacts between objects.
    pub(crate) fn tangential_law(&self) -> TangentialLaw {
        TangentialLaw {
            constant: self.tangential_restitution.objects,
            damping: self.tangential_damping.objects,
        }
    }

    /// The laws of contacts with the striker.
    pub(crate) fn tangential_law_of_striker(&self) -> TangentialLaw {
        TangentialLaw {
            constant: self.tangential_restitution.striker,
            damping: self.tangential_damping.striker,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_lies_between_both_laws() {
        let constant = Some(Estimate::exact(-0.1));
        let exponent = Estimate::exact(2.0);
        let with =
            |probability| TangentialLaw { constant, damping: Some(SlipDamping { probability, exponent }) };
        assert_eq!(TangentialLaw { constant, damping: None }.mean_at(0.6), -0.1);
        assert_eq!(with(0.0).mean_at(0.6), -0.1);
        assert!((with(1.0).mean_at(0.6) + 0.36).abs() < 1e-15);
        assert!((with(0.5).mean_at(0.6) + 0.23).abs() < 1e-15);
        assert_eq!(TangentialLaw::default().mean_at(0.6), 0.0);
    }

    #[test]
    fn copies_and_files_keep_the_damping() {
        let exponent = Estimate { standard_error: 0.4, ..Estimate::exact(1.5) };
        let damping = SlipDamping { probability: 0.7, exponent };
        let properties = Properties {
            version: 1,
            tangential_damping: TangentialDamping { objects: Some(damping), striker: None },
            ..Properties::default()
        };
        assert_eq!(properties.values().tangential_damping, properties.tangential_damping);
        let text = serde_json::to_string(&properties).expect("numbers");
        assert_eq!(serde_json::from_str::<Properties>(&text).expect("a file"), properties);
        let exact = properties.exact().tangential_damping.objects.expect("kept");
        assert_eq!((exact.probability, exact.exponent), (0.7, Estimate::exact(1.5)));
    }

    #[test]
    fn impossible_damping_is_refused() {
        let damping = |probability, exponent| TangentialDamping {
            objects: Some(SlipDamping { probability, exponent: Estimate::exact(exponent) }),
            striker: None,
        };
        assert!(damping(0.5, 2.0).check("file").is_ok());
        for (wrong, field) in [(damping(1.5, 2.0), "probability"), (damping(0.5, 0.0), "mean")] {
            let error = wrong.check("file").expect_err("impossible").to_string();
            assert!(error.contains("tangential_damping of objects") && error.contains(field), "{error}");
        }
    }
}
