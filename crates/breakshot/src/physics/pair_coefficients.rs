//! Which restitution and contact friction has each pair of kinds of bodies?

use crate::error::Result;
use crate::object::kind;
use crate::properties::tangential::TangentialLaw;
use crate::properties::{ContactFriction, Properties};
use crate::scene::Scene;
use crate::uncertain::Estimate;

/// What an impact of one pair depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Coefficients {
    pub(crate) restitution: f64,
    /// Contact friction.
    pub(crate) friction: f64,
    pub(crate) tangential_restitution: f64,
}

/// The kinds of bodies in a scene: row 0 is the striker, then the kinds of objects, then the walls.
#[derive(Clone, Debug, Default)]
pub(crate) struct Kinds {
    /// Kinds of placed objects in alphabetical order, and whether more than one copy is placed.
    objects: Vec<(String, bool)>,
    /// Restitution of each wall.
    walls: Vec<f64>,
}

impl Kinds {
    pub(crate) fn of(scene: &Scene) -> Self {
        Self { objects: scene.kinds(), walls: scene.walls.iter().map(|wall| wall.restitution).collect() }
    }

    /// Rows of the table.
    pub(crate) fn count(&self) -> usize {
        1 + self.objects.len() + self.walls.len()
    }

    /// The row of an object of the scene.
    pub(crate) fn row_of_object(&self, object: &str) -> usize {
        1 + self.objects.iter().position(|(name, _)| name == kind(object)).unwrap_or(0)
    }

    /// The row of a wall.
    pub(crate) fn row_of_wall(&self, wall: usize) -> usize {
        1 + self.objects.len() + wall
    }

    /// The symmetric table of coefficients, row by row; adds a note for each coefficient that is assumed.
    ///
    /// `reference_per_striker_mass` is the reference object's mass over the striker's, if the striker's restitutions are apparent ones
    /// ([`Options`](crate::physics::Options)), else zero.
    ///
    /// # Errors
    /// A restitution that was never measured.
    pub(crate) fn table(
        &self,
        properties: &Properties,
        reference_per_striker_mass: f64,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Coefficients>> {
        let count = self.count();
        let mut table = vec![Coefficients::default(); count * count];
        let mut put = |i: usize, k: usize, coefficients: Coefficients| {
            table[i * count + k] = coefficients;
            table[k * count + i] = coefficients;
        };
        let mut mean_or_assumed = |estimate: Option<Estimate>, between: &str| {
            estimate.map_or_else(
                || {
                    let assumed = ContactFriction::assumed().mean;
                    notes.push(format!("contact friction {between} was never measured: taken as {assumed}"));
                    assumed
                },
                |e| e.mean,
            )
        };
        let coefficients = |friction: f64, tangential: TangentialLaw| {
            move |restitution: f64| Coefficients {
                restitution,
                friction,
                tangential_restitution: tangential.mean_at(restitution),
            }
        };
        let friction = mean_or_assumed(properties.contact_friction.objects, "between objects");
        let between_objects = coefficients(friction, properties.tangential_law());
        let friction = mean_or_assumed(properties.contact_friction.striker, "with the striker");
        let with_striker = coefficients(friction, properties.tangential_law_of_striker());
        for (i, (one, has_copies)) in self.objects.iter().enumerate() {
            let apparent = properties.striker_restitution(one)?.mean;
            let restitution = match reference_per_striker_mass {
                0.0 => apparent,
                per_striker => {
                    let mass_ratio = properties.mass_ratio(one)?.mean * per_striker;
                    ((1.0 + apparent) * (1.0 + mass_ratio) - 1.0).min(1.0)
                }
            };
            put(0, 1 + i, with_striker(restitution));
            for (k, (other, _)) in self.objects.iter().enumerate().skip(i) {
                if i != k || *has_copies {
                    put(1 + i, 1 + k, between_objects(properties.restitution(one, other)?.mean));
                }
            }
            for (w, restitution) in self.walls.iter().enumerate() {
                put(1 + i, self.row_of_wall(w), between_objects(*restitution));
            }
        }
        if !self.walls.is_empty() {
            notes.push("walls are taken to have the contact friction of objects".into());
        }
        Ok(table)
    }
}
