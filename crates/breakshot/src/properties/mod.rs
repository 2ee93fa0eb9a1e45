//! The identified parameters of the objects: friction, restitution, mass ratios (`properties.json`).

pub(crate) mod evidence;
mod mixed_model;
mod prior;

use crate::error::{Error, Result};
use crate::object::{kind, pair_key};
use crate::properties::evidence::Evidence;
use crate::uncertain::Estimate;
pub use prior::{Assumption, PropertyGroup};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The physical properties of every object and pair that was filmed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Properties {
    /// The file format's version.
    pub version: u32,
    /// The object whose mass is the unit of mass.
    pub reference: String,
    /// Coulomb friction coefficient against the table, by object.
    pub friction: BTreeMap<String, Estimate>,
    /// Coefficient of restitution against the striker, by object.
    pub striker_restitution: BTreeMap<String, Estimate>,
    /// Coefficient of restitution of a pair, by [`pair_key`].
    pub restitution: BTreeMap<String, Estimate>,
    /// Mass over the reference object's mass, by object, from all clips jointly.
    pub mass_ratio: BTreeMap<String, Estimate>,
    /// `a/b`: mass of a over mass of b, from the clips of that pair alone (Table 1).
    pub pair_mass_ratio: BTreeMap<String, Estimate>,
    /// Friction coefficients of contacts between objects and with the striker.
    pub contact_friction: ContactFriction,
    /// Tangential restitution at the contacts of impacts.
    #[serde(default, skip_serializing_if = "TangentialRestitution::is_unknown")]
    pub tangential_restitution: TangentialRestitution,
    /// The joint covariance of the values above.
    #[serde(default)]
    pub covariance: Covariance,
    /// Quantities without data, and clips that look inconsistent.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// The values above that are assumed, because no clip measured them ([`Properties::completed_for`]).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumed: Vec<Assumption>,
    /// The measurements of each clip, for estimates that add later clips.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evidence: Option<Evidence>,
}

/// Coulomb friction at the contacts of impacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactFriction {
    /// Between objects.
    #[serde(default)]
    pub objects: Option<Estimate>,
    /// Between an object and the striker.
    #[serde(default)]
    pub striker: Option<Estimate>,
}

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
    pub const RANGE: [f64; 2] = [-0.6, 0.5];

    fn is_unknown(&self) -> bool {
        self.objects.is_none() && self.striker.is_none()
    }
}

impl ContactFriction {
    /// A coefficient that was not measured is uniform between zero and this: dry wood, plastic and metal.
    pub const MOST_ASSUMED: f64 = 0.4;

    /// The prior density of the estimate, not normalized: that distribution, with a tail for rubber and rough faces.
    pub(crate) fn prior_density(friction: f64) -> f64 {
        const TAIL: f64 = 0.1;
        (-(friction - Self::MOST_ASSUMED).max(0.0) / TAIL).exp()
    }

    /// That distribution, in the estimate, in simulations and in plans alike.
    pub const fn assumed() -> Estimate {
        Estimate {
            mean: 0.5 * Self::MOST_ASSUMED,
            std: None,
            standard_error: Self::MOST_ASSUMED * Estimate::UNIFORM_STD,
            interval_95: [0.025 * Self::MOST_ASSUMED, 0.975 * Self::MOST_ASSUMED],
            n: 0,
        }
    }
}

/// A covariance matrix with named rows and columns.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Covariance {
    /// The quantity of each row and column, such as `friction/a`, `striker_restitution/a`, `restitution/a/b`, `log_mass_ratio/b`.
    pub names: Vec<String>,
    /// The matrix, row by row.
    pub matrix: Vec<Vec<f64>>,
}

impl Covariance {
    /// Removes a quantity with its row and column.
    pub(crate) fn remove(&mut self, name: &str) {
        let Some(index) = self.names.iter().position(|n| n == name) else { return };
        self.names.remove(index);
        if index < self.matrix.len() {
            self.matrix.remove(index);
        }
        for row in self.matrix.iter_mut().filter(|row| index < row.len()) {
            row.remove(index);
        }
    }
}

impl Properties {
    /// The values of a group.
    pub(crate) fn group(&self, group: PropertyGroup) -> &BTreeMap<String, Estimate> {
        match group {
            PropertyGroup::Friction => &self.friction,
            PropertyGroup::StrikerRestitution => &self.striker_restitution,
            PropertyGroup::Restitution => &self.restitution,
            PropertyGroup::MassRatio => &self.mass_ratio,
        }
    }

    /// Removes a value and its covariance.
    pub(crate) fn remove(&mut self, group: PropertyGroup, name: &str) {
        group.of(self).remove(name);
        self.covariance.remove(&group.covariance_name(name));
    }

    /// The values alone, which are cheap to copy.
    pub(crate) fn values(&self) -> Self {
        Self {
            version: self.version,
            reference: self.reference.clone(),
            friction: self.friction.clone(),
            striker_restitution: self.striker_restitution.clone(),
            restitution: self.restitution.clone(),
            mass_ratio: self.mass_ratio.clone(),
            pair_mass_ratio: BTreeMap::new(),
            contact_friction: self.contact_friction,
            tangential_restitution: self.tangential_restitution,
            covariance: Covariance::default(),
            warnings: Vec::new(),
            assumed: Vec::new(),
            evidence: None,
        }
    }

    /// Friction of an object against the table.
    ///
    /// # Errors
    /// The quantity was not measured.
    pub fn friction(&self, object: &str) -> Result<&Estimate> {
        self.friction
            .get(kind(object))
            .ok_or_else(|| self.not_measured(PropertyGroup::Friction, kind(object)))
    }

    /// Mass of an object over the reference object's mass.
    ///
    /// # Errors
    /// The quantity was not measured.
    pub fn mass_ratio(&self, object: &str) -> Result<&Estimate> {
        self.mass_ratio
            .get(kind(object))
            .ok_or_else(|| self.not_measured(PropertyGroup::MassRatio, kind(object)))
    }

    /// Restitution of an object against the striker.
    ///
    /// # Errors
    /// The quantity was not measured.
    pub fn striker_restitution(&self, object: &str) -> Result<&Estimate> {
        let found = self.striker_restitution.get(kind(object));
        found.ok_or_else(|| self.not_measured(PropertyGroup::StrikerRestitution, kind(object)))
    }

    /// Restitution of a pair of objects.
    ///
    /// # Errors
    /// The quantity was not measured.
    pub fn restitution(&self, one: &str, other: &str) -> Result<&Estimate> {
        let key = pair_key(one, other);
        self.restitution.get(&key).ok_or_else(|| self.not_measured(PropertyGroup::Restitution, &key))
    }

    fn not_measured(&self, group: PropertyGroup, name: &str) -> Error {
        let clip = group.clip(name, &self.reference);
        let needed = format!("{clip}, or an entry `{name}` in `{}`", group.words().replace(' ', "_"));
        Error::NotMeasured { name: name.to_owned(), quantity: group.words(), needed }
    }

    /// Assumes `restitution` for every pair of `objects` that was not measured, the striker included.
    ///
    /// # Errors
    /// A restitution outside 0..1.
    pub fn assume_restitution(&mut self, objects: &[String], restitution: f64) -> Result<()> {
        if !(0.0..=1.0).contains(&restitution) {
            return Err(Error::invalid("assumed", "restitution", restitution, "a number from 0 to 1"));
        }
        let mut absent = std::collections::BTreeSet::new();
        for (k, one) in objects.iter().enumerate() {
            absent.insert((PropertyGroup::StrikerRestitution, kind(one).to_owned()));
            let pairs =
                objects[k + 1..].iter().map(|other| (PropertyGroup::Restitution, pair_key(one, other)));
            absent.extend(pairs);
        }
        absent.retain(|(group, name)| match group {
            PropertyGroup::StrikerRestitution => !self.striker_restitution.contains_key(name),
            _ => !self.restitution.contains_key(name),
        });
        for (group, name) in absent {
            self.assume(group, &name, Estimate::assumed(restitution), "the value given by hand".into());
        }
        Ok(())
    }

    /// Checks that every value is physically possible; errors name the entry.
    ///
    /// # Errors
    /// Restitution outside 0..1, negative friction, masses not above zero, numbers that are not finite.
    pub fn check(&self, file: &str) -> Result<()> {
        POSITIVE.check_group(file, "friction", &self.friction)?;
        FRACTION.check_group(file, "striker_restitution", &self.striker_restitution)?;
        FRACTION.check_group(file, "restitution", &self.restitution)?;
        POSITIVE.check_group(file, "mass_ratio", &self.mass_ratio)?;
        POSITIVE.check_group(file, "pair_mass_ratio", &self.pair_mass_ratio)?;
        for (name, estimate) in
            [("objects", self.contact_friction.objects), ("striker", self.contact_friction.striker)]
        {
            if let Some(estimate) = estimate
                && !(estimate.mean >= 0.0 && estimate.mean.is_finite())
            {
                let owner = format!("{file}: contact_friction of {name}");
                return Err(Error::invalid(owner, "mean", estimate.mean, "zero or more"));
            }
        }
        let TangentialRestitution { objects, striker } = self.tangential_restitution;
        for (name, estimate) in [("objects", objects), ("striker", striker)] {
            if let Some(estimate) = estimate
                && !(-1.0..=1.0).contains(&estimate.mean)
            {
                let owner = format!("{file}: tangential_restitution of {name}");
                return Err(Error::invalid(owner, "mean", estimate.mean, "a number from -1 to 1"));
            }
        }
        Ok(())
    }
}

/// The values that a quantity can have.
struct Domain {
    contains: fn(f64) -> bool,
    description: &'static str,
}

const POSITIVE: Domain = Domain { contains: |v| v > 0.0 && v.is_finite(), description: "a positive number" };
const FRACTION: Domain =
    Domain { contains: |v| (0.0..=1.0).contains(&v), description: "a number from 0 to 1" };

impl Domain {
    /// An error that names the first entry whose mean is outside.
    fn check_group(&self, file: &str, group: &str, values: &BTreeMap<String, Estimate>) -> Result<()> {
        match values.iter().find(|(_, estimate)| !(self.contains)(estimate.mean)) {
            Some((name, estimate)) => {
                let owner = format!("{file}: {group} of `{name}`");
                Err(Error::invalid(owner, "mean", estimate.mean, self.description))
            }
            None => Ok(()),
        }
    }
}
