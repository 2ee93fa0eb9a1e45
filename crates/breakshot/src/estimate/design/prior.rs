//! Means and joint covariance of all parameters of a simulation, as far as they are known before the next clip.

use crate::estimate::measure::quantity::Quantity;
use crate::object::{Object, pair_key};
use crate::properties::{ContactFriction, Properties, PropertyGroup};
use crate::uncertain::Estimate;
use nalgebra::DMatrix;

/// A parameter of a simulation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Parameter {
    Friction(String),
    StrikerRestitution(String),
    /// Names in alphabetical order.
    Restitution(String, String),
    /// Logarithm of the mass over that of the reference object.
    LogMass(String),
    ContactFriction,
    StrikerContactFriction,
}

/// A Gaussian distribution of all parameters; those that no clip measures have a wide prior.
#[derive(Clone, Debug)]
pub(crate) struct Prior {
    pub(crate) parameters: Vec<Parameter>,
    pub(crate) covariance: DMatrix<f64>,
    /// The means, with assumed values where no clip measures a parameter.
    pub(crate) properties: Properties,
}

/// Standard deviations before any clip: friction of dry wood or plastic, any restitution, densities within a factor of two.
const FRICTION_STD: f64 = 0.15;
const RESTITUTION_STD: f64 = Estimate::UNIFORM_STD;
const LOG_MASS_STD: f64 = std::f64::consts::LN_2;

impl Prior {
    /// The distribution of the parameters of these objects.
    ///
    /// The restitution between copies of one object is included if it is known or `copies` is set.
    pub(crate) fn new(properties: &Properties, objects: &[Object], copies: bool) -> Self {
        let mut names: Vec<String> = objects.iter().map(|o| o.name.clone()).collect();
        names.sort_unstable();
        let meets_itself =
            |name: &String| copies || properties.restitution.contains_key(&pair_key(name, name));
        let kinds: Vec<(String, bool)> = names.iter().map(|n| (n.clone(), meets_itself(n))).collect();
        let mut known = Properties { evidence: None, ..properties.completed(objects, &kinds).into_owned() };
        let contact = &mut known.contact_friction;
        contact.objects.get_or_insert(ContactFriction::assumed());
        contact.striker.get_or_insert(ContactFriction::assumed());

        let mut parameters = Vec::new();
        for (k, (name, meets_itself)) in kinds.iter().enumerate() {
            parameters.push(Parameter::Friction(name.clone()));
            parameters.push(Parameter::StrikerRestitution(name.clone()));
            if *name != properties.reference {
                parameters.push(Parameter::LogMass(name.clone()));
            }
            let others = kinds[k..].iter().filter(|(other, _)| other != name || *meets_itself);
            parameters.extend(others.map(|(other, _)| Parameter::Restitution(name.clone(), other.clone())));
        }
        parameters.extend([Parameter::ContactFriction, Parameter::StrikerContactFriction]);
        let stds: Vec<f64> = parameters.iter().map(|p| p.standard_error(&known)).collect();
        let covariance = covariance(properties, &parameters, &stds);
        Self { parameters, covariance, properties: known }
    }

    /// The properties with these parameters changed by index, limited to possible values, and the changes that were made.
    pub(crate) fn changed(&self, changes: &[(usize, f64)]) -> (Properties, Vec<f64>) {
        let mut properties = self.properties.clone();
        let made =
            changes.iter().map(|&(k, change)| self.parameters[k].change(&mut properties, change)).collect();
        (properties, made)
    }

    /// Standard deviation of parameter `k`.
    pub(crate) fn std(&self, k: usize) -> f64 {
        self.covariance[(k, k)].max(0.0).sqrt()
    }

    /// The row of the measurement matrix of a quantity: indices of parameters with factors; empty if it depends on none.
    pub(crate) fn row(&self, quantity: &Quantity) -> Vec<(usize, f64)> {
        let at = |wanted: Parameter, factor: f64| {
            self.parameters.iter().position(|p| *p == wanted).map(|k| (k, factor))
        };
        match quantity {
            Quantity::Friction(a) => at(Parameter::Friction(a.clone()), 1.0).into_iter().collect(),
            Quantity::StrikerRestitution(a) => {
                at(Parameter::StrikerRestitution(a.clone()), 1.0).into_iter().collect()
            }
            Quantity::Restitution(a, b) => {
                at(Parameter::Restitution(a.clone(), b.clone()), 1.0).into_iter().collect()
            }
            Quantity::MassRatio(a, b) if a == b => Vec::new(),
            Quantity::MassRatio(a, b) => {
                let masses = [(a, 1.0), (b, -1.0)];
                masses.into_iter().filter_map(|(name, f)| at(Parameter::LogMass(name.clone()), f)).collect()
            }
        }
    }
}

impl Parameter {
    /// Its name in the covariance of the properties.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Friction(a) => PropertyGroup::Friction.covariance_name(a),
            Self::StrikerRestitution(a) => PropertyGroup::StrikerRestitution.covariance_name(a),
            Self::Restitution(a, b) => PropertyGroup::Restitution.covariance_name(&format!("{a}/{b}")),
            Self::LogMass(a) => PropertyGroup::MassRatio.covariance_name(a),
            Self::ContactFriction => "contact_friction/objects".into(),
            Self::StrikerContactFriction => "contact_friction/striker".into(),
        }
    }

    /// The standard error of its value; that of the logarithm for a mass.
    fn standard_error(&self, properties: &Properties) -> f64 {
        let known = match self {
            Self::Friction(a) => properties.friction.get(a),
            Self::StrikerRestitution(a) => properties.striker_restitution.get(a),
            Self::Restitution(a, b) => properties.restitution.get(&format!("{a}/{b}")),
            Self::LogMass(a) => {
                return properties.mass_ratio.get(a).map_or(LOG_MASS_STD, |e| e.standard_error / e.mean);
            }
            Self::ContactFriction => properties.contact_friction.objects.as_ref(),
            Self::StrikerContactFriction => properties.contact_friction.striker.as_ref(),
        };
        known.map_or(self.prior_std(properties), |e| e.standard_error)
    }

    /// Standard deviation of the prior before any clip.
    fn prior_std(&self, properties: &Properties) -> f64 {
        match self {
            Self::Friction(a) => {
                properties.friction.get(a).map_or(FRICTION_STD, |e| e.mean.max(FRICTION_STD))
            }
            Self::StrikerRestitution(_) | Self::Restitution(..) => RESTITUTION_STD,
            Self::LogMass(_) => LOG_MASS_STD,
            Self::ContactFriction | Self::StrikerContactFriction => ContactFriction::assumed().standard_error,
        }
    }

    /// The objects to which it belongs.
    pub(crate) fn objects(&self) -> Vec<&str> {
        match self {
            Self::Friction(a) | Self::StrikerRestitution(a) | Self::LogMass(a) => vec![a],
            Self::Restitution(a, b) => vec![a, b],
            Self::ContactFriction | Self::StrikerContactFriction => Vec::new(),
        }
    }

    /// Changes the mean within its possible values; returns the change that was made.
    fn change(&self, properties: &mut Properties, change: f64) -> f64 {
        /// Smallest friction with which objects come to rest.
        const LEAST_FRICTION: f64 = 0.01;
        let shift = |estimate: Option<&mut Estimate>, least: f64, most: f64| {
            estimate.map_or(0.0, |e| {
                let before = e.mean;
                e.mean = (before + change).clamp(least.min(before), most.max(before));
                e.mean - before
            })
        };
        match self {
            Self::Friction(a) => shift(properties.friction.get_mut(a), LEAST_FRICTION, f64::MAX),
            Self::StrikerRestitution(a) => shift(properties.striker_restitution.get_mut(a), 0.0, 1.0),
            Self::Restitution(a, b) => shift(properties.restitution.get_mut(&format!("{a}/{b}")), 0.0, 1.0),
            Self::LogMass(a) => properties.mass_ratio.get_mut(a).map_or(0.0, |e| {
                e.mean *= change.exp();
                change
            }),
            Self::ContactFriction => shift(properties.contact_friction.objects.as_mut(), 0.0, f64::MAX),
            Self::StrikerContactFriction => {
                shift(properties.contact_friction.striker.as_mut(), 0.0, f64::MAX)
            }
        }
    }
}

/// The covariance of the parameters: that of the properties, and independent priors for what it does not contain.
fn covariance(properties: &Properties, parameters: &[Parameter], stds: &[f64]) -> DMatrix<f64> {
    let known = |parameter: &Parameter| match parameter {
        Parameter::Friction(a) => properties.friction.contains_key(a),
        Parameter::StrikerRestitution(a) => properties.striker_restitution.contains_key(a),
        Parameter::Restitution(a, b) => properties.restitution.contains_key(&format!("{a}/{b}")),
        Parameter::LogMass(a) => properties.mass_ratio.contains_key(a),
        _ => false,
    };
    let index = |parameter: &Parameter| {
        let name = parameter.name();
        let found = properties.covariance.names.iter().position(|n| *n == name);
        found.filter(|_| known(parameter))
    };
    let indices: Vec<Option<usize>> = parameters.iter().map(index).collect();
    let matrix = &properties.covariance.matrix;
    let estimated =
        DMatrix::from_fn(parameters.len(), parameters.len(), |r, c| match (indices[r], indices[c]) {
            (Some(p), Some(q)) => matrix.get(p).and_then(|row| row.get(q)).copied().unwrap_or(0.0),
            _ if r == c => stds[r].powi(2),
            _ => 0.0,
        });
    // The product of estimate and prior: a poor measurement does not leave a parameter less certain than the prior does.
    let prior = DMatrix::from_diagonal(&nalgebra::DVector::from_fn(parameters.len(), |k, _| {
        if indices[k].is_some() { parameters[k].prior_std(properties).powi(2) } else { UNBOUND_VARIANCE }
    }));
    match (&estimated + prior).cholesky() {
        Some(factor) => {
            let product = &estimated - &estimated * factor.solve(&estimated);
            (&product + product.transpose()) * 0.5
        }
        None => estimated,
    }
}

/// Variance that has no effect, for parameters whose prior is already in the first factor.
const UNBOUND_VARIANCE: f64 = 1e12;
