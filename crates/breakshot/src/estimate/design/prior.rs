//! What is known of every number that a simulation needs: means, and how their errors go together.

use crate::estimate::measure::quantity::Quantity;
use crate::object::{Object, pair_key};
use crate::properties::Properties;
use crate::uncertain::Estimate;
use nalgebra::DMatrix;

/// One number that a simulation needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Parameter {
    Friction(String),
    StrikerRestitution(String),
    /// Names in alphabetical order.
    Restitution(String, String),
    /// Logarithm of the mass over the reference's.
    LogMass(String),
    ContactFriction,
    StrikerContactFriction,
}

/// Means and covariance; what no clip told has a wide prior.
#[derive(Clone, Debug)]
pub(crate) struct Belief {
    pub(crate) quantities: Vec<Parameter>,
    pub(crate) covariance: DMatrix<f64>,
    /// The means, with stand-ins for what no clip told.
    pub(crate) properties: Properties,
}

/// What stands in where nothing was filmed: any restitution, friction as of dry wood or plastic give or take half of it,
/// masses as of the same material within a factor of two, contact friction as everywhere in the estimate.
const FRICTION: [f64; 2] = [0.3, 0.15];
const RESTITUTION: f64 = 0.5;
const LOG_MASS_STD: f64 = std::f64::consts::LN_2;
const CONTACT_FRICTION: [f64; 2] = [0.2, 0.1];

impl Belief {
    /// What the properties say of these objects, each with its own copies too where the restitution of copies is known or
    /// `copies` asks for it.
    pub(crate) fn new(properties: &Properties, objects: &[Object], copies: bool) -> Self {
        let mut names: Vec<&Object> = objects.iter().collect();
        names.sort_by(|p, q| p.name.cmp(&q.name));
        let mut belief = Self {
            quantities: Vec::new(),
            covariance: DMatrix::zeros(0, 0),
            properties: Properties { evidence: None, ..properties.clone() },
        };
        let mut stds = Vec::new();
        let reference = names.iter().find(|o| o.name == properties.reference).copied();
        for (k, object) in names.iter().enumerate() {
            let name = object.name.clone();
            belief.friction(&name, &mut stds);
            belief.restitution(Parameter::StrikerRestitution(name.clone()), &mut stds);
            if name != properties.reference {
                belief.mass(object, reference, &mut stds);
            }
            for other in &names[k..] {
                let known = properties.restitution.contains_key(&pair_key(&name, &other.name));
                if other.name != name || copies || known {
                    belief.restitution(Parameter::Restitution(name.clone(), other.name.clone()), &mut stds);
                }
            }
        }
        belief.contact_friction(&mut stds);
        belief.covariance = covariance(properties, &belief.quantities, &stds);
        belief
    }

    fn friction(&mut self, name: &str, stds: &mut Vec<f64>) {
        let known = &mut self.properties.friction;
        let typical = mean(known.values()).unwrap_or(FRICTION[0]);
        let entry = known.entry(name.into()).or_insert(stand_in(typical, FRICTION[1]));
        stds.push(entry.standard_error);
        self.quantities.push(Parameter::Friction(name.into()));
    }

    fn restitution(&mut self, quantity: Parameter, stds: &mut Vec<f64>) {
        let (known, key) = match &quantity {
            Parameter::Restitution(a, b) => (&mut self.properties.restitution, format!("{a}/{b}")),
            Parameter::StrikerRestitution(a) => (&mut self.properties.striker_restitution, a.clone()),
            _ => return,
        };
        let typical = mean(known.values().filter(|e| e.n > 0)).unwrap_or(RESTITUTION);
        let entry = known.entry(key).or_insert(Estimate::assumed(typical));
        stds.push(entry.standard_error);
        self.quantities.push(quantity);
    }

    fn mass(&mut self, object: &Object, reference: Option<&Object>, stds: &mut Vec<f64>) {
        let volume = |o: &Object| o.shape.area_m2() * o.height_m;
        let guess = reference.map_or(1.0, |r| volume(object) / volume(r));
        let known = &mut self.properties.mass_ratio;
        let entry = known.entry(object.name.clone()).or_insert(stand_in(guess, guess * LOG_MASS_STD));
        stds.push(entry.standard_error / entry.mean);
        self.quantities.push(Parameter::LogMass(object.name.clone()));
        let unit = self.properties.reference.clone();
        self.properties.mass_ratio.entry(unit).or_insert(Estimate::exact(1.0));
    }

    fn contact_friction(&mut self, stds: &mut Vec<f64>) {
        let [value, std] = CONTACT_FRICTION;
        let contact = &mut self.properties.contact_friction;
        for (slot, quantity) in [
            (&mut contact.objects, Parameter::ContactFriction),
            (&mut contact.striker, Parameter::StrikerContactFriction),
        ] {
            stds.push(slot.get_or_insert(stand_in(value, std)).standard_error);
            self.quantities.push(quantity);
        }
    }

    /// The properties with these changes of the quantities (of logarithms where they are logarithms), kept possible; and the
    /// changes that were.
    pub(crate) fn moved(&self, changes: &[(usize, f64)]) -> (Properties, Vec<f64>) {
        let mut properties = self.properties.clone();
        let done =
            changes.iter().map(|&(k, change)| self.quantities[k].change(&mut properties, change)).collect();
        (properties, done)
    }

    /// One standard deviation of every quantity.
    pub(crate) fn std(&self, k: usize) -> f64 {
        self.covariance[(k, k)].max(0.0).sqrt()
    }

    /// What a clip's reading is a linear function of: quantities with their factors; none if it tells nothing new.
    pub(crate) fn row(&self, key: &Quantity) -> Vec<(usize, f64)> {
        let at = |wanted: Parameter, factor: f64| {
            self.quantities.iter().position(|q| *q == wanted).map(|k| (k, factor))
        };
        match key {
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
    /// As the covariance of the properties calls it.
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

    /// One standard deviation before anything is filmed.
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

    /// The objects without which it does not matter.
    pub(crate) fn objects(&self) -> Vec<&str> {
        match self {
            Self::Friction(a) | Self::StrikerRestitution(a) | Self::LogMass(a) => vec![a],
            Self::Restitution(a, b) => vec![a, b],
            Self::ContactFriction | Self::StrikerContactFriction => Vec::new(),
        }
    }

    /// Changes the mean, as far as it stays possible; gives the change that was.
    fn change(&self, properties: &mut Properties, change: f64) -> f64 {
        /// Friction of an object that still comes to rest.
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

fn stand_in(mean: f64, std: f64) -> Estimate {
    let interval_95 = [mean - 2.0 * std, mean + 2.0 * std];
    Estimate { mean, std: None, standard_error: std, interval_95, n: 0 }
}

/// The properties' covariance in the order of the quantities; independent priors for what it does not hold.
fn covariance(properties: &Properties, quantities: &[Parameter], stds: &[f64]) -> DMatrix<f64> {
    let known = |quantity: &Parameter| match quantity {
        Parameter::Friction(a) => properties.friction.contains_key(a),
        Parameter::StrikerRestitution(a) => properties.striker_restitution.contains_key(a),
        Parameter::Restitution(a, b) => properties.restitution.contains_key(&format!("{a}/{b}")),
        Parameter::LogMass(a) => properties.mass_ratio.contains_key(a),
        _ => false,
    };
    let place = |quantity: &Parameter| {
        let name = quantity.name();
        let found = properties.covariance.names.iter().position(|n| *n == name);
        found.filter(|_| known(quantity))
    };
    let places: Vec<Option<usize>> = quantities.iter().map(place).collect();
    let matrix = &properties.covariance.matrix;
    let told = DMatrix::from_fn(quantities.len(), quantities.len(), |r, c| match (places[r], places[c]) {
        (Some(p), Some(q)) => matrix.get(p).and_then(|row| row.get(q)).copied().unwrap_or(0.0),
        _ if r == c => stds[r].powi(2),
        _ => 0.0,
    });
    // A clip that tells next to nothing leaves no quantity less sure than a prior does: both together.
    let prior = DMatrix::from_diagonal(&nalgebra::DVector::from_fn(quantities.len(), |k, _| {
        if places[k].is_some() { quantities[k].prior_std(properties).powi(2) } else { UNBOUND_VARIANCE }
    }));
    match (&told + prior).cholesky() {
        Some(factor) => {
            let both = &told - &told * factor.solve(&told);
            (&both + both.transpose()) * 0.5
        }
        None => told,
    }
}

/// What has its prior already gets no second one.
const UNBOUND_VARIANCE: f64 = 1e12;
