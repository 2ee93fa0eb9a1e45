//! The identified parameters of the objects: friction, restitution, mass ratios (`properties.json`).

pub(crate) mod evidence;
mod mixed_model;
mod prior;
pub(crate) mod support;
pub(crate) mod tangential;
mod tilt;

use crate::error::{Error, Result};
use crate::geometry::Vec2;
use crate::object::{kind, pair_key};
use crate::properties::evidence::Evidence;
use crate::uncertain::Estimate;
use crate::warning::{GroupedWarnings, Warning, WarningGroup};
pub use prior::{Assumption, PropertyGroup};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use support::SUPPORT;
pub use tangential::{SlipDamping, TangentialDamping, TangentialRestitution};
pub use tilt::Tilt;

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
    #[serde(default, skip_serializing_if = "tangential::is_unknown")]
    pub tangential_restitution: TangentialRestitution,
    /// The damping of the slip at the contacts of impacts, where tangential restitution depends on the restitution.
    #[serde(default, skip_serializing_if = "tangential::is_unknown")]
    pub tangential_damping: TangentialDamping,
    /// Where the weight acts: the mean distance of an object's support from its centroid over that of a weight spread uniformly
    /// under its outline, by object; it scales the braking of the spin.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub support: BTreeMap<String, Estimate>,
    /// The tilt of the table; `None` if no film shows one or excludes one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tilt: Option<Tilt>,
    /// The joint covariance of the values above.
    #[serde(default)]
    pub covariance: Covariance,
    /// Quantities without data, and clips that look inconsistent.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// The causes of the warnings, in their order ([`crate::warning::by_cause`]).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub causes: Vec<WarningGroup>,
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

/// Largest number of quantities in a covariance: sixty objects with all their pairs.
const MOST_QUANTITIES: usize = 2000;
/// Relative error of covariances that were rounded when they were written.
const ROUNDING: f64 = 1e-6;

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
    /// Checks that this is a covariance: one row and column for each name, symmetric, without negative variances.
    ///
    /// # Errors
    /// What is wrong first, with the names concerned.
    pub fn check(&self, file: &str) -> Result<()> {
        let (owner, n) = (format!("{file}: covariance"), self.names.len());
        if n > MOST_QUANTITIES {
            let needed = format!("at most {MOST_QUANTITIES}");
            return Err(Error::invalid(owner, "the number of names", n, needed));
        }
        let distinct: std::collections::BTreeSet<&String> = self.names.iter().collect();
        if distinct.len() != n {
            return Err(Error::invalid(owner, "names", "a name given twice", "every quantity once"));
        }
        if self.matrix.len() != n || self.matrix.iter().any(|row| row.len() != n) {
            let widths: Vec<usize> = self.matrix.iter().map(Vec::len).filter(|&width| width != n).collect();
            let found = format!("of {} rows, {} of them not of {n} columns", self.matrix.len(), widths.len());
            return Err(Error::invalid(owner, "matrix", found, format!("{n} rows and columns, as names")));
        }
        for (i, row) in self.matrix.iter().enumerate() {
            if !(row[i].is_finite() && row[i] >= 0.0) {
                let what = format!("variance of `{}`", self.names[i]);
                return Err(Error::invalid(owner, what, row[i], "a finite number, zero or more"));
            }
            for (j, &value) in row[..i].iter().enumerate() {
                let (mirrored, scale) = (self.matrix[j][i], (row[i] * self.matrix[j][j]).sqrt());
                // A comparison with a number that is not finite fails.
                if !((value - mirrored).abs() <= ROUNDING * scale && value.abs() <= (1.0 + ROUNDING) * scale)
                {
                    let what = format!("covariance of `{}` and `{}`", self.names[i], self.names[j]);
                    let found = format!("{value} and, mirrored, {mirrored}");
                    let needed = format!("twice the same number, of at most {scale:.3e}");
                    return Err(Error::invalid(owner, what, found, needed));
                }
            }
        }
        match self.first_impossible() {
            None => Ok(()),
            Some(k) => {
                let found = format!("not positive from the row of `{}` on", self.names[k]);
                Err(Error::invalid(owner, "matrix", found, "a positive semidefinite matrix"))
            }
        }
    }

    /// The row at which Cholesky's factorization of the correlations, with a little more variance, fails.
    fn first_impossible(&self) -> Option<usize> {
        let n = self.names.len();
        let deviations: Vec<f64> = (0..n).map(|i| self.matrix[i][i].sqrt()).collect();
        let mut factor: Vec<Vec<f64>> = Vec::with_capacity(n);
        for i in 0..n {
            let mut row = Vec::with_capacity(i + 1);
            let mut rest = 1.0 + ROUNDING;
            for (j, above) in factor.iter().enumerate() {
                let scale = deviations[i] * deviations[j];
                let correlation = if scale > 0.0 { self.matrix[i][j] / scale } else { 0.0 };
                let known: f64 = row.iter().zip(above).map(|(a, b)| a * b).sum();
                let entry: f64 = (correlation - known) / above[j];
                rest -= entry * entry;
                row.push(entry);
            }
            if rest.is_nan() || rest <= 0.0 {
                return Some(i);
            }
            row.push(rest.sqrt());
            factor.push(row);
        }
        None
    }

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

    /// The same means without uncertainty.
    pub(crate) fn exact(mut self) -> Self {
        let groups = [
            &mut self.friction,
            &mut self.striker_restitution,
            &mut self.restitution,
            &mut self.mass_ratio,
            &mut self.support,
        ];
        let (contacts, tangential) = (&mut self.contact_friction, &mut self.tangential_restitution);
        let of_contacts =
            [&mut contacts.objects, &mut contacts.striker, &mut tangential.objects, &mut tangential.striker];
        let of_objects = groups.into_iter().flat_map(BTreeMap::values_mut);
        for estimate in of_objects.chain(of_contacts.into_iter().flatten()) {
            *estimate = Estimate::exact(estimate.mean);
        }
        self.tangential_damping = self.tangential_damping.exact();
        self.tilt = self.tilt.map(Tilt::exact);
        self
    }

    /// Replaces the warnings and their causes.
    pub(crate) fn set_warnings(&mut self, warnings: Vec<Warning>) {
        let grouped = GroupedWarnings::from(warnings);
        (self.warnings, self.causes) = (grouped.lines, grouped.causes);
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
            tangential_damping: self.tangential_damping,
            support: self.support.clone(),
            tilt: self.tilt,
            covariance: Covariance::default(),
            warnings: Vec::new(),
            causes: Vec::new(),
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
    /// Restitution outside 0..1, friction that no table has, masses not above zero, numbers that are not finite, impossible
    /// uncertainties, a matrix that is no covariance.
    pub fn check(&self, file: &str) -> Result<()> {
        FRICTION.check_group(file, "friction", &self.friction)?;
        FRACTION.check_group(file, "striker_restitution", &self.striker_restitution)?;
        FRACTION.check_group(file, "restitution", &self.restitution)?;
        POSITIVE.check_group(file, "mass_ratio", &self.mass_ratio)?;
        POSITIVE.check_group(file, "pair_mass_ratio", &self.pair_mass_ratio)?;
        let ContactFriction { objects, striker } = self.contact_friction;
        for (name, estimate) in [("objects", objects), ("striker", striker)] {
            if let Some(estimate) = estimate {
                CONTACT_FRICTION.check(&format!("{file}: contact_friction of {name}"), &estimate)?;
            }
        }
        self.tangential_restitution.check(file)?;
        self.tangential_damping.check(file)?;
        SUPPORT.check_group(file, "support", &self.support)?;
        if let Some(tilt) = &self.tilt {
            tilt.check(file)?;
        }
        self.covariance.check(file)
    }

    /// Gravity's component along the table over gravity; zero for a table that is level or whose tilt no film shows.
    pub(crate) fn slope(&self) -> Vec2 {
        self.tilt.as_ref().filter(|tilt| !tilt.level).map_or(Vec2::ZERO, Tilt::slope)
    }

    /// The support ratio of an object; `None` if no film shows how any spin is braked.
    pub(crate) fn support(&self, object: &str) -> Option<&Estimate> {
        self.support.get(kind(object))
    }
}

/// The values that a quantity can have.
struct Domain {
    contains: fn(f64) -> bool,
    description: &'static str,
}

/// Masses that differ more than a grain of sand and a car are no masses of objects on one table.
const POSITIVE: Domain =
    Domain { contains: |v| (1e-6..=1e6).contains(&v), description: "a positive number (from 1e-6 to 1e6)" };
const FRACTION: Domain =
    Domain { contains: |v| (0.0..=1.0).contains(&v), description: "a number from 0 to 1" };
/// Rubber has 3. Above, a push takes millions of steps.
const FRICTION: Domain =
    Domain { contains: |v| v > 0.0 && v <= 10.0, description: "a coefficient above 0, at most 10" };
const CONTACT_FRICTION: Domain =
    Domain { contains: |v| (0.0..=10.0).contains(&v), description: "a coefficient from 0 to 10" };

impl Domain {
    /// An error that names the first entry whose mean is outside or whose uncertainty is impossible.
    fn check_group(&self, file: &str, group: &str, values: &BTreeMap<String, Estimate>) -> Result<()> {
        values
            .iter()
            .try_for_each(|(name, estimate)| self.check(&format!("{file}: {group} of `{name}`"), estimate))
    }

    fn check(&self, owner: &str, estimate: &Estimate) -> Result<()> {
        if !(self.contains)(estimate.mean) {
            return Err(Error::invalid(owner, "mean", estimate.mean, self.description));
        }
        estimate.check_uncertainty(owner)
    }
}
