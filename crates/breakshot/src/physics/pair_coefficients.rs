//! Which restitution and contact friction has each pair of kinds of bodies?

use crate::error::Result;
use crate::object::kind;
use crate::properties::{ContactFriction, Properties};
use crate::scene::Scene;
use crate::uncertain::Estimate;

/// Restitution and contact friction of one pair.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Coefficients {
    pub(crate) restitution: f64,
    pub(crate) friction: f64,
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
    /// # Errors
    /// A restitution that was never measured.
    pub(crate) fn table(
        &self,
        properties: &Properties,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Coefficients>> {
        let count = self.count();
        let mut table = vec![Coefficients::default(); count * count];
        let mut put = |i: usize, k: usize, restitution: f64, friction: f64| {
            table[i * count + k] = Coefficients { restitution, friction };
            table[k * count + i] = Coefficients { restitution, friction };
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
        let friction = mean_or_assumed(properties.contact_friction.objects, "between objects");
        let striker_friction = mean_or_assumed(properties.contact_friction.striker, "with the striker");
        for (i, (one, has_copies)) in self.objects.iter().enumerate() {
            put(0, 1 + i, properties.striker_restitution(one)?.mean, striker_friction);
            for (k, (other, _)) in self.objects.iter().enumerate().skip(i) {
                if i != k || *has_copies {
                    put(1 + i, 1 + k, properties.restitution(one, other)?.mean, friction);
                }
            }
            for (w, restitution) in self.walls.iter().enumerate() {
                put(1 + i, self.row_of_wall(w), *restitution, friction);
            }
        }
        if !self.walls.is_empty() {
            notes.push("walls are taken to have the contact friction of objects".into());
        }
        Ok(table)
    }
}
