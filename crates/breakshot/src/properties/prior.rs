//! Which values are assumed for properties that no clip measured?
//!
//! A missing value is uncertain, not impossible: it is predicted from the measured ones with the spread that they show among each
//! other (`mixed_model`). Restitutions share one effect per object, so that an object's pairs tell about its restitution against the
//! striker; friction and density are exchangeable among the objects, on a logarithmic scale. Weighed masses are used where both
//! the object and the reference were weighed. Assumed values are independent of each other.

use super::Properties;
use super::mixed_model::{FittedModel, MixedModel, NO_EFFECTS, Normal, Observation, Terms};
use super::support;
use crate::error::Result;
use crate::object::{Object, kind, pair_key};
use crate::scene::Scene;
use crate::statistics::sorted_by_value;
use crate::uncertain::{Estimate, Z_95};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A group of values in `properties.json`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PropertyGroup {
    /// Friction against the table, by object.
    Friction,
    /// Restitution against the striker, by object.
    StrikerRestitution,
    /// Restitution of a pair.
    Restitution,
    /// Mass over the reference object's mass, by object.
    MassRatio,
}

impl PropertyGroup {
    /// All groups.
    pub(crate) const ALL: [Self; 4] =
        [Self::Friction, Self::StrikerRestitution, Self::Restitution, Self::MassRatio];

    /// The quantity in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::StrikerRestitution => "striker restitution",
            Self::Restitution => "restitution",
            Self::MassRatio => "mass ratio",
        }
    }

    /// The clip that measures the quantity of an object or pair.
    pub(super) fn clip(self, name: &str, reference: &str) -> String {
        match self {
            Self::Friction => format!("a clip in which `{name}` slides"),
            Self::StrikerRestitution => format!("a clip in which the robot strikes `{name}`"),
            Self::Restitution => "a clip of the pair".into(),
            Self::MassRatio => format!("clips of impacts that connect `{name}` with `{reference}`"),
        }
    }

    pub(super) fn of(self, properties: &mut Properties) -> &mut BTreeMap<String, Estimate> {
        match self {
            Self::Friction => &mut properties.friction,
            Self::StrikerRestitution => &mut properties.striker_restitution,
            Self::Restitution => &mut properties.restitution,
            Self::MassRatio => &mut properties.mass_ratio,
        }
    }

    /// The name of an entry in the covariance of the properties.
    pub(crate) fn covariance_name(self, name: &str) -> String {
        match self {
            Self::Friction => format!("friction/{name}"),
            Self::StrikerRestitution => format!("striker_restitution/{name}"),
            Self::Restitution => format!("restitution/{name}"),
            Self::MassRatio => format!("log_mass_ratio/{name}"),
        }
    }
}

/// A value that is assumed because no clip measured it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Assumption {
    /// The group of the value.
    pub quantity: PropertyGroup,
    /// The object or pair.
    pub name: String,
    /// The assumed mean.
    pub mean: f64,
    /// 95 % interval of the value.
    pub interval_95: [f64; 2],
    /// What the value is inferred from, a phrase.
    pub from: String,
    /// The clip that would measure it, a phrase.
    pub clip: String,
}

impl std::fmt::Display for Assumption {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let [low, high] = self.interval_95;
        write!(
            f,
            "{} of `{}` was not measured; assumed {:.3} ({low:.3} to {high:.3}) from {}; it would be measured by {}",
            self.quantity.words(),
            self.name,
            self.mean,
            self.from,
            self.clip
        )
    }
}

/// Friction: dry wood, plastic and metal on a table; a factor of two about the mean is one standard deviation before any clip.
const FRICTION: MixedModel = MixedModel {
    group_mean: Normal { mean: LOG_TYPICAL_FRICTION, std: 0.5 },
    effect_stds: &[0.0],
    residual_stds: &[0.05, 0.1, 0.2, 0.3, 0.4, 0.5],
};
/// Logarithm of 0.3.
const LOG_TYPICAL_FRICTION: f64 = -1.203_972_804_325_936;

/// Restitution: any value from 0 to 1 is equally likely before any clip, which has this mean and standard deviation.
const RESTITUTION: MixedModel = MixedModel {
    group_mean: Normal { mean: 0.5, std: Estimate::UNIFORM_STD },
    effect_stds: &[0.0, 0.05, 0.1, 0.15, 0.2],
    residual_stds: &[0.02, 0.05, 0.1, 0.15, 0.2],
};
/// Groups of restitutions.
const WITH_STRIKER: usize = 0;
const BETWEEN_OBJECTS: usize = 1;

/// Logarithm of the density, about that of the first object.
const LOG_DENSITY: [&[f64]; 2] = [&[0.0], &[0.05, 0.1, 0.2, 0.4, 0.6, 0.8]];
/// The mean density differs from that of the first object by a factor of two in one standard deviation.
const LOG_DENSITY_STD: f64 = std::f64::consts::LN_2;
/// Relative standard deviation of a ratio of weighed masses.
const WEIGHING_STD: f64 = 0.01;

impl Properties {
    /// The properties with assumed values for everything that a simulation of the scene needs and no clip measured.
    ///
    /// The assumed values are listed in [`Properties::assumed`].
    ///
    /// # Errors
    /// An object of the scene that is not among its kinds of objects.
    ///
    /// # Examples
    /// ```
    /// use breakshot::cell::{Cell, Striker, Workspace};
    /// use breakshot::geometry::Point;
    /// use breakshot::object::{Object, Shape};
    /// use breakshot::properties::Properties;
    /// use breakshot::scene::{Placed, Scene};
    /// use breakshot::uncertain::Estimate;
    ///
    /// let disc = |name: &str| {
    ///     let shape = Shape::Disc { radius_m: 0.04 };
    ///     Object { name: name.into(), shape, height_m: 0.03, marker: None, mass_kg: None, support: None }
    /// };
    /// let cell = Cell::from_above(1000.0, Workspace::centred([1.0, 0.8]), Striker::rod(0.015, [0.05, 1.0]));
    /// let placed = vec![Placed { object: "c".into(), position_m: Point::ORIGIN, yaw_rad: 0.0 }];
    /// let scene = Scene::new(cell, vec![disc("a"), disc("b"), disc("c")], placed)?;
    /// let each = |a, b| [("a".to_owned(), Estimate::exact(a)), ("b".to_owned(), Estimate::exact(b))].into();
    /// let measured = Properties { reference: "a".into(), friction: each(0.2, 0.3), ..Properties::default() };
    ///
    /// let completed = measured.completed_for(&scene)?;
    /// let friction = completed.friction("c")?;
    /// assert!(friction.mean > 0.2 && friction.mean < 0.3 && friction.interval_95[0] < 0.2);
    /// assert_eq!(completed.assumed.len(), 3, "friction, mass, and restitution against the striker");
    /// # Ok::<(), breakshot::Error>(())
    /// ```
    pub fn completed_for(&self, scene: &Scene) -> Result<Cow<'_, Self>> {
        for placed in &scene.placed {
            scene.object(&placed.object)?;
        }
        Ok(self.completed(&scene.objects, &scene.kinds()))
    }

    /// The assumed values that matter for a scene.
    pub(crate) fn assumed_for(&self, scene: &Scene) -> Vec<Assumption> {
        let placed = |name: &str| scene.placed.iter().any(|p| kind(&p.object) == name);
        self.assumed.iter().filter(|a| a.name.split('/').all(placed)).cloned().collect()
    }

    /// The properties with assumed values for these kinds (name, and whether there are copies) where no clip measured them.
    pub(crate) fn completed(&self, objects: &[Object], kinds: &[(String, bool)]) -> Cow<'_, Self> {
        let missing = self.missing(kinds);
        let supports = support::inferred(self, objects, kinds);
        if missing.is_empty() && supports.is_empty() {
            return Cow::Borrowed(self);
        }
        let mut completed = self.values();
        completed.covariance = self.covariance.clone();
        completed.assumed.clone_from(&self.assumed);
        completed.support.extend(supports);
        let predictor = Predictor::new(self, objects, kinds);
        for (group, name) in missing {
            let prediction = predictor.prediction(group, &name);
            completed.assume(group, &name, prediction.estimate, prediction.from);
        }
        Cow::Owned(completed)
    }

    /// Adds an assumed value; its covariance with other values is removed.
    pub(super) fn assume(&mut self, group: PropertyGroup, name: &str, estimate: Estimate, from: String) {
        let Estimate { mean, interval_95, .. } = estimate;
        group.of(self).insert(name.to_owned(), estimate);
        self.covariance.remove(&group.covariance_name(name));
        if group == PropertyGroup::MassRatio && name == self.reference {
            // The unit of mass is a definition, not an assumption.
            return;
        }
        let clip = group.clip(name, &self.reference);
        self.assumed.push(Assumption {
            quantity: group,
            name: name.to_owned(),
            mean,
            interval_95,
            from,
            clip,
        });
    }

    /// The entries that a simulation of these kinds needs and that are absent.
    fn missing(&self, kinds: &[(String, bool)]) -> Vec<(PropertyGroup, String)> {
        let mut missing = Vec::new();
        for (k, (name, has_copies)) in kinds.iter().enumerate() {
            let of_objects =
                PropertyGroup::ALL.into_iter().filter(|group| *group != PropertyGroup::Restitution);
            let absent = of_objects.filter(|group| !self.group(*group).contains_key(name));
            missing.extend(absent.map(|group| (group, name.clone())));
            let others = kinds[k..].iter().filter(|(other, _)| other != name || *has_copies);
            let pairs = others.map(|(other, _)| pair_key(name, other));
            let unmeasured = pairs.filter(|pair| !self.restitution.contains_key(pair));
            missing.extend(unmeasured.map(|pair| (PropertyGroup::Restitution, pair)));
        }
        missing
    }
}

/// Predicts missing values from measured ones.
struct Predictor<'a> {
    reference: &'a str,
    /// The kinds of objects there are; their volumes tell masses.
    objects: &'a [Object],
    log_friction: FittedModel<'a>,
    restitution: FittedModel<'a>,
    log_density: FittedModel<'a>,
}

/// A predicted value and what it is inferred from.
struct Prediction {
    estimate: Estimate,
    from: String,
}

impl<'a> Predictor<'a> {
    /// The measured values that concern these kinds come first: the number of observations is bounded.
    fn new(measured: &'a Properties, objects: &'a [Object], kinds: &[(String, bool)]) -> Self {
        let is_placed = |name: &str| kinds.iter().any(|(kind, _)| kind == name);
        let log_observation = |estimate: &Estimate, log_unit: f64| {
            let (value, standard_error) =
                (estimate.mean.ln() - log_unit, estimate.standard_error / estimate.mean);
            let usable = value.is_finite() && standard_error.is_finite();
            usable.then_some(Observation { terms: NO_EFFECTS, value, standard_error })
        };
        let friction = measured.friction.values().filter_map(|e| log_observation(e, 0.0)).collect();

        let observation = |group, objects, e: &Estimate| Observation {
            terms: Terms { group, objects },
            value: e.mean,
            standard_error: e.standard_error,
        };
        let with_striker = measured.striker_restitution.iter();
        let mut restitution: Vec<Observation> =
            with_striker.map(|(name, e)| observation(WITH_STRIKER, vec![name.as_str()], e)).collect();
        restitution.extend(measured.restitution.iter().filter_map(|(pair, e)| {
            let (a, b) = pair.split_once('/')?;
            Some(observation(BETWEEN_OBJECTS, vec![a, b], e))
        }));
        let strangers = |o: &Observation| o.terms.objects.iter().filter(|name| !is_placed(name)).count();
        let restitution = sorted_by_value(restitution, |o| strangers(o) as f64);

        let reference = measured.reference.as_str();
        let log_volume = |name: &str| log_volume(objects, name);
        let others = measured.mass_ratio.iter().filter(|(name, _)| *name != reference);
        let density: Vec<Observation> = std::iter::once((reference, &UNIT))
            .chain(others.map(|(name, e)| (name.as_str(), e)))
            .filter_map(|(name, e)| log_observation(e, log_volume(name)?))
            .collect();
        let first = kinds.first().and_then(|(name, _)| log_volume(name)).unwrap_or(0.0);
        let group_mean = Normal { mean: density.first().map_or(-first, |o| o.value), std: LOG_DENSITY_STD };
        let [effect_stds, residual_stds] = LOG_DENSITY;
        Self {
            reference,
            objects,
            log_friction: FRICTION.fitted(friction),
            restitution: RESTITUTION.fitted(restitution),
            log_density: MixedModel { group_mean, effect_stds, residual_stds }.fitted(density),
        }
    }

    fn prediction(&self, group: PropertyGroup, name: &str) -> Prediction {
        match group {
            PropertyGroup::Friction => Prediction {
                estimate: log_normal(self.log_friction.prediction(&NO_EFFECTS)),
                from: from(&[(self.log_friction.count(0), OBJECTS)]),
            },
            PropertyGroup::StrikerRestitution => {
                self.restitution(&Terms { group: WITH_STRIKER, objects: vec![name] })
            }
            PropertyGroup::Restitution => {
                let (a, b) = name.split_once('/').unwrap_or((name, name));
                self.restitution(&Terms { group: BETWEEN_OBJECTS, objects: vec![a, b] })
            }
            PropertyGroup::MassRatio => self.mass_ratio(name),
        }
    }

    fn restitution(&self, wanted: &Terms) -> Prediction {
        let [pairs, struck] = [BETWEEN_OBJECTS, WITH_STRIKER].map(|group| self.restitution.count(group));
        let Normal { mean, std } = self.restitution.prediction(wanted);
        let (mean, std) = (mean.clamp(0.0, 1.0), std.min(Estimate::UNIFORM_STD));
        let interval_95 = [(mean - Z_95 * std).max(0.0), (mean + Z_95 * std).min(1.0)];
        Prediction {
            estimate: Estimate { mean, std: None, standard_error: std, interval_95, n: 0 },
            from: from(&[(pairs, PAIRS), (struck, STRUCK)]),
        }
    }

    fn mass_ratio(&self, name: &str) -> Prediction {
        if name == self.reference {
            return Prediction { estimate: UNIT, from: "the definition of the unit".into() };
        }
        let weighed = |name: &str| self.objects.iter().find(|o| o.name == name).and_then(|o| o.mass_kg);
        if let Some((mass_kg, unit_kg)) = weighed(name).zip(weighed(self.reference)) {
            let ratio = Normal { mean: (mass_kg / unit_kg).ln(), std: WEIGHING_STD };
            return Prediction { estimate: log_normal(ratio), from: "the weighed masses".into() };
        }
        let density = self.log_density.prediction(&NO_EFFECTS);
        let own = log_volume(self.objects, name).unwrap_or(0.0);
        Prediction {
            estimate: log_normal(Normal { mean: density.mean + own, ..density }),
            from: "its volume and ".to_owned() + &from(&[(self.log_density.count(0), OBJECTS)]),
        }
    }
}

/// The mass ratio of the reference object.
const UNIT: Estimate = Estimate::exact(1.0);

/// Logarithm of the volume of a kind of object (m3); `None` for an unknown one.
fn log_volume(objects: &[Object], name: &str) -> Option<f64> {
    objects.iter().find(|o| o.name == name).map(|o| (o.shape.area_m2() * o.height_m).ln())
}

/// The estimate of a quantity whose logarithm has this distribution: its median, and its standard deviation to first order.
fn log_normal(log: Normal) -> Estimate {
    let mean = log.mean.exp();
    let interval_95 = [-Z_95, Z_95].map(|z| (log.mean + z * log.std).exp());
    Estimate { mean, std: None, standard_error: mean * log.std, interval_95, n: 0 }
}

/// Sorts of measured values: one, and many.
const OBJECTS: [&str; 2] = ["object", "objects"];
const PAIRS: [&str; 2] = ["pair", "pairs"];
const STRUCK: [&str; 2] = ["object against the striker", "objects against the striker"];

/// What a value is inferred from, by the number of measured values of each sort.
fn from(sorts: &[(usize, [&str; 2])]) -> String {
    let counted = sorts.iter().filter(|(count, _)| *count > 0);
    let words: Vec<String> = counted
        .map(|(count, [one, many])| format!("{count} {}", if *count == 1 { one } else { many }))
        .collect();
    if words.is_empty() { "no measurement".into() } else { words.join(" and ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::Shape;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    const NAMES: [&str; 5] = ["a", "b", "c", "d", "e"];

    fn estimate(mean: f64) -> Estimate {
        let interval_95 = [0.98 * mean, 1.02 * mean];
        Estimate { mean, std: Some(0.02 * mean), standard_error: 0.01 * mean, interval_95, n: 5 }
    }

    /// Discs of 30 to 50 mm.
    fn objects() -> Vec<Object> {
        let disc = |(k, name): (usize, &&str)| {
            let shape = Shape::Disc { radius_m: 0.03 + 0.005 * k as f64 };
            Object { name: (*name).into(), shape, height_m: 0.03, marker: None, mass_kg: None, support: None }
        };
        NAMES.iter().enumerate().map(disc).collect()
    }

    fn kinds() -> Vec<(String, bool)> {
        NAMES.iter().map(|name| ((*name).to_owned(), false)).collect()
    }

    /// Properties of a drawn cell; effects are uniform, which the model does not assume.
    fn drawn(seed: u64) -> Properties {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut within = |low: f64, high: f64| rng.random_range(low..high);
        let mut properties = Properties { version: 1, reference: "a".into(), ..Properties::default() };
        let (friction, restitution, spread) = (within(0.15, 0.5), within(0.3, 0.7), within(0.02, 0.15));
        let effects: Vec<f64> = NAMES.iter().map(|_| within(-spread, spread)).collect();
        let volumes: Vec<f64> = objects().iter().map(|o| o.shape.area_m2()).collect();
        for (k, name) in NAMES.iter().enumerate() {
            let own = |mean: f64| ((*name).to_owned(), estimate(mean));
            properties.friction.extend([own(friction * within(0.7, 1.4))]);
            properties.striker_restitution.extend([own(restitution + effects[k] + within(-0.03, 0.03))]);
            let density = if k == 0 { 1.0 } else { within(0.6, 1.6) };
            properties.mass_ratio.extend([own(density * volumes[k] / volumes[0])]);
            for (i, other) in NAMES.iter().enumerate().skip(k + 1) {
                let mean = restitution + effects[k] + effects[i] + within(-0.03, 0.03);
                properties.restitution.insert(pair_key(name, other), estimate(mean));
            }
        }
        properties
    }

    #[test]
    fn intervals_hold_what_was_left_out() {
        let (mut held, mut trials, mut lengths) = (0, 0, 0.0);
        for seed in 0..40 {
            let complete = drawn(seed);
            for (group, name) in Properties::default().missing(&kinds()) {
                let mut lacking = complete.clone();
                let truth = group.of(&mut lacking).remove(&name).expect("an entry").mean;
                if group == PropertyGroup::MassRatio && name == "a" {
                    continue;
                }
                let completed = lacking.completed(&objects(), &kinds());
                let [assumed] = &completed.assumed[..] else { panic!("{:?}", completed.assumed) };
                let [low, high] = assumed.interval_95;
                assert!(low <= assumed.mean && assumed.mean <= high, "{assumed}");
                (held, trials) = (held + usize::from((low..=high).contains(&truth)), trials + 1);
                lengths += (high - low) / assumed.mean;
            }
        }
        let (coverage, length) = (f64::from(held as u32) / f64::from(trials), lengths / f64::from(trials));
        assert!((0.93..=0.995).contains(&coverage), "{coverage} of {trials}");
        assert!(length < 1.0, "{length}");
    }

    #[test]
    fn an_object_that_was_never_filmed_has_every_property_and_the_others_keep_theirs() {
        let mut lacking = drawn(1);
        for group in PropertyGroup::ALL {
            group.of(&mut lacking).retain(|name, _| !name.contains('c'));
        }
        let completed = lacking.completed(&objects(), &kinds());
        assert_eq!(completed.assumed.len(), 3 + 4);
        assert!(completed.missing(&kinds()).is_empty());
        assert_eq!(completed.friction["a"], lacking.friction["a"]);
        completed.check("completed").expect("possible values");
        assert!(
            matches!(completed.completed(&objects(), &kinds()), Cow::Borrowed(_)),
            "nothing is missing now"
        );
        // The mass follows from the volume: the radius is 40 mm, that of the reference object 30 mm.
        assert!(completed.mass_ratio["c"].mean > 1.0, "{:?}", completed.mass_ratio["c"]);
    }

    #[test]
    fn without_any_measurement_every_value_is_wide() {
        let nothing = Properties { version: 1, reference: "a".into(), ..Properties::default() };
        let completed = nothing.completed(&objects(), &kinds());
        completed.check("completed").expect("possible values");
        let [low, high] = completed.friction["b"].interval_95;
        assert!(low < 0.12 && high > 0.7, "{low} to {high}");
        let [low, high] = completed.striker_restitution["b"].interval_95;
        assert!(low < 0.05 && high > 0.95, "{low} to {high}");
        assert_eq!(completed.mass_ratio["a"], Estimate::exact(1.0));
        let unit = |a: &Assumption| a.quantity == PropertyGroup::MassRatio && a.name == "a";
        assert!(!completed.assumed.iter().any(unit), "the unit of mass is not assumed");
    }

    #[test]
    fn weighed_masses_replace_the_prior_of_the_density() {
        let mut lacking = drawn(2);
        lacking.mass_ratio.remove("b");
        let mut objects = objects();
        (objects[0].mass_kg, objects[1].mass_kg) = (Some(0.2), Some(0.5));
        let ratio = lacking.completed(&objects, &kinds()).mass_ratio["b"];
        assert!((ratio.mean - 2.5).abs() < 1e-12 && ratio.standard_error < 0.03, "{ratio:?}");
    }

    #[test]
    fn the_covariance_forgets_what_is_assumed() {
        let mut lacking = drawn(3);
        lacking.covariance = super::super::Covariance {
            names: vec!["friction/a".into(), "friction/b".into()],
            matrix: vec![vec![1.0, 2.0], vec![3.0, 4.0]],
        };
        lacking.friction.remove("a");
        let covariance = lacking.completed(&objects(), &kinds()).covariance.clone();
        assert_eq!((covariance.names, covariance.matrix), (vec!["friction/b".to_owned()], vec![vec![4.0]]));
    }
}
