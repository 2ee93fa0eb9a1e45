//! How many kilograms is a mass ratio of one?

use crate::object::Object;
use crate::properties::Properties;
use crate::scene::Scene;

/// The mass of the reference object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum MassUnit {
    /// From the objects that were weighed (kg).
    Weighed(f64),
    /// From the objects' volumes and an assumed density, as no object was weighed (kg).
    Assumed(f64),
}

/// Density of an object of unknown mass (kg/m3): between wood (400 to 700), solid plastics (900 to 1,400) and aluminium (2,700).
pub(crate) const ASSUMED_DENSITY_KG_M3: f64 = 1000.0;

impl MassUnit {
    /// The mean of mass over mass ratio over the weighed objects; over all objects with their assumed masses if none was
    /// weighed.
    pub(crate) fn of(scene: &Scene, properties: &Properties) -> Self {
        let mean = |mass_kg: &dyn Fn(&Object) -> Option<f64>| {
            let per_ratio = |object| Some(mass_kg(object)? / properties.mass_ratio(&object.name).ok()?.mean);
            let all: Vec<f64> = scene.objects.iter().filter_map(per_ratio).collect();
            (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
        };
        let by_volume =
            |object: &Object| Some(object.shape.area_m2() * object.height_m * ASSUMED_DENSITY_KG_M3);
        match mean(&|object| object.mass_kg) {
            Some(kg) => Self::Weighed(kg),
            None => Self::Assumed(mean(&by_volume).unwrap_or(1.0)),
        }
    }

    /// The mass (kg).
    pub(crate) fn kg(self) -> f64 {
        match self {
            Self::Weighed(kg) | Self::Assumed(kg) => kg,
        }
    }
}
