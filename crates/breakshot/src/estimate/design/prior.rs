//! Means and joint covariance of all parameters of a simulation, as far as they are known before the next clip.

use crate::estimate::measure::quantity::Quantity;
use crate::object::{Object, pair_key};
use crate::properties::Properties;
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
    /// The means, with default values where no clip measures a parameter.
    pub(crate) properties: Properties,
}

/// Default means and standard deviations of parameters that no clip measures: friction of dry wood or plastic with half of it as
/// standard deviation, any restitution, masses of equal density within a factor of two, the contact friction that the
/// estimate assumes.
const FRICTION: [f64; 2] = [0.3, 0.15];
const RESTITUTION: f64 = 0.5;
const LOG_MASS_STD: f64 = std::f64::consts::LN_2;
const CONTACT_FRICTION: [f64; 2] = [0.2, 0.1];

impl Prior {
    /// The distribution of the parameters of these objects.
    ///
    /// The restitution between copies of one object is included if it is known or `copies` is set.
    pub(crate) fn new(properties: &Properties, objects: &[Object], copies: bool) -> Self {
        let mut names: Vec<&Object> = objects.iter().collect();
        names.sort_by(|p, q| p.name.cmp(&q.name));
        let mut prior = Self {
            parameters: Vec::new(),
            covariance: DMatrix::zeros(0, 0),
            properties: Properties { evidence: None, ..properties.clone() },
        };
        let mut stds = Vec::new();
        let reference = names.iter().find(|o| o.name == properties.reference).copied();
        for (k, object) in names.iter().enumerate() {
            let name = object.name.clone();
            prior.friction(&name, &mut stds);
            prior.restitution(Parameter::StrikerRestitution(name.clone()), &mut stds);
            if name != properties.reference {
                prior.mass(object, reference, &mut stds);
            }
            for other in &names[k..] {
                let known = properties.restitution.contains_key(&pair_key(&name, &other.name));
                if other.name != name || copies || known {
                    prior.restitution(Parameter::Restitution(name.clone(), other.name.clone()), &mut stds);
                }
            }
        }
        prior.contact_friction(&mut stds);
        prior.covariance = covariance(properties, &prior.parameters, &stds);
        prior
    }

    fn friction(&mut self, name: &str, stds: &mut Vec<f64>) {
        let known = &mut self.properties.friction;
        let typical = mean(known.values()).unwrap_or(FRICTION[0]);
        let entry = known.entry(name.into()).or_insert(default_estimate(typical, FRICTION[1]));
        stds.push(entry.standard_error);
        self.parameters.push(Parameter::Friction(name.into()));
    }

    fn restitution(&mut self, parameter: Parameter, stds: &mut Vec<f64>) {
        let (known, key) = match &parameter {
            Parameter::Restitution(a, b) => (&mut self.properties.restitution, format!("{a}/{b}")),
            Parameter::StrikerRestitution(a) => (&mut self.properties.striker_restitution, a.clone()),
            _ => return,
        };
        let typical = mean(known.values().filter(|e| e.n > 0)).unwrap_or(RESTITUTION);
        let entry = known.entry(key).or_insert(Estimate::assumed(typical));
        stds.push(entry.standard_error);
        self.parameters.push(parameter);
    }

    fn mass(&mut self, object: &Object, reference: Option<&Object>, stds: &mut Vec<f64>) {
        let volume = |o: &Object| o.shape.area_m2() * o.height_m;
        let guess = reference.map_or(1.0, |r| volume(object) / volume(r));
        let known = &mut self.properties.mass_ratio;
        let entry = known.entry(object.name.clone()).or_insert(default_estimate(guess, guess * LOG_MASS_STD));
        stds.push(entry.standard_error / entry.mean);
        self.parameters.push(Parameter::LogMass(object.name.clone()));
        let unit = self.properties.reference.clone();
        self.properties.mass_ratio.entry(unit).or_insert(Estimate::exact(1.0));
    }

    fn contact_friction(&mut self, stds: &mut Vec<f64>) {
        let [value, std] = CONTACT_FRICTION;
        let contact = &mut self.properties.contact_friction;
        for (slot, parameter) in [
            (&mut contact.objects, Parameter::ContactFriction),
            (&mut contact.striker, Parameter::StrikerContactFriction),
        ] {
            stds.push(slot.get_or_insert(default_estimate(value, std)).standard_error);
            self.parameters.push(parameter);
        }
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
            Self::Friction(a) => format!("friction/{a}"),
            Self::StrikerRestitution(a) => format!("striker_restitution/{a}"),
            Self::Restitution(a, b) => format!("restitution/{a}/{b}"),
            Self::LogMass(a) => format!("log_mass_ratio/{a}"),
            Self::ContactFriction => "contact_friction/objects".into(),
            Self::StrikerContactFriction => "contact_friction/striker".into(),
        }
    }

    /// Standard deviation of the prior before any clip.
    fn prior_std(&self, properties: &Properties) -> f64 {
        match self {
            Self::Friction(a) => properties.friction.get(a).map_or(FRICTION[1], |e| e.mean.max(FRICTION[1])),
            Self::StrikerRestitution(_) | Self::Restitution(..) => {
                Estimate::assumed(RESTITUTION).standard_error
            }
            Self::LogMass(_) => LOG_MASS_STD,
            Self::ContactFriction | Self::StrikerContactFriction => CONTACT_FRICTION[1],
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

fn mean<'a>(estimates: impl Iterator<Item = &'a Estimate>) -> Option<f64> {
    let all: Vec<f64> = estimates.map(|e| e.mean).collect();
    (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
}

fn default_estimate(mean: f64, std: f64) -> Estimate {
    let interval_95 = [mean - 2.0 * std, mean + 2.0 * std];
    Estimate { mean, std: None, standard_error: std, interval_95, n: 0 }
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
