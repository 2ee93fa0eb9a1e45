//! Which strikes can the cell's arm execute, and how heavy is its tip? (rule vi of section 5)
//!
//! Reach and speed at the contact exclude most of the lines that the arm cannot follow.  The best strikes that remain are given to the
//! path search of [`robot::command()`](crate::robot::command()), so that a planned strike is one for which a joint path within all limits exists.

use super::options::Options;
use crate::error::Result;
use crate::geometry::Point;
use crate::physics;
use crate::robot::{Answer, Capability, FASTEST_M_S, Limits, MountedArm};
use crate::scene::{Scene, Strike};

/// The obstacle of a strike out of the arm's reach.
pub(crate) const OUT_OF_REACH: &str = "the arm's reach";

/// The arm of a scene's cell.
pub(crate) struct CellArm<'a> {
    scene: &'a Scene,
    mounted: MountedArm,
    limits: Limits,
}

impl<'a> CellArm<'a> {
    /// The arm of the scene's cell; `None` without one, with one whose base pose is unknown, and where the options leave it out.
    ///
    /// # Errors
    /// An arm that cannot be read.
    pub(crate) fn of(scene: &'a Scene, options: &Options) -> Result<Option<Self>> {
        let known = scene.cell.robot.as_ref().is_some_and(|robot| robot.base_from_table.is_some());
        if options.any_arm || !known {
            return Ok(None);
        }
        let mounted = MountedArm::of_cell(&scene.cell)?;
        Ok(Some(Self { scene, mounted, limits: Limits::default() }))
    }

    /// The arm's name.
    pub(crate) fn name(&self) -> String {
        self.mounted.arm().name.clone()
    }

    /// The laws of a simulation in which impacts slow the striker as this arm holds it.
    fn laws(&self) -> physics::Options {
        let striker_mass_kg = self.mounted.striker_mass_kg(self.scene);
        physics::Options {
            striker_mass_kg,
            apparent_striker_restitution: striker_mass_kg.is_some(),
            ..physics::Options::default()
        }
    }

    /// The tip's speed within the limits and its effective mass at a contact along a heading (rad); `None` out of reach.
    pub(crate) fn capability(&self, contact_m: Point, heading_rad: f64) -> Option<Capability> {
        let Capability { speed_m_s, effective_mass_kg } = self.mounted.capability(contact_m, heading_rad)?;
        let speed_m_s = (speed_m_s * self.limits.speed_fraction).min(FASTEST_M_S);
        Some(Capability { speed_m_s, effective_mass_kg })
    }

    /// The largest speed (m/s) within the limits at a contact along a heading (rad), or one that is at least `wanted_m_s`; zero out of reach.
    pub(crate) fn speed_m_s(&self, contact_m: Point, heading_rad: f64, wanted_m_s: f64) -> f64 {
        let fraction = self.limits.speed_fraction;
        self.mounted.reachable_speed_m_s(contact_m, heading_rad, wanted_m_s, fraction).min(FASTEST_M_S)
    }

    /// How the arm executes a strike.
    pub(crate) fn execution(&self, strike: &Strike) -> Execution {
        match self.mounted.command(&self.scene.cell, strike, Some(self.scene), &self.limits) {
            Ok(Answer::Ready(command)) => {
                command.overshoot_m().map_or(Execution::AsPlanned, Execution::Overshoot)
            }
            Ok(Answer::Refused(refusal)) => Execution::Refused(refusal.reason),
            Err(error) => Execution::Refused(error.to_string()),
        }
    }

    /// The reason for which the arm cannot execute a strike; `None` if it can.
    pub(crate) fn refusal(&self, strike: &Strike) -> Option<String> {
        match self.execution(strike) {
            Execution::Refused(reason) => Some(reason),
            Execution::AsPlanned | Execution::Overshoot(_) => None,
        }
    }
}

/// How an arm executes a planned strike.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Execution {
    /// It ends where the strike was planned to end.
    AsPlanned,
    /// It needs a softer stop and ends this far past the planned end (m).
    Overshoot(f64),
    /// It cannot, for this reason.
    Refused(String),
}

/// The laws of a plan's simulations: with the arm's effective mass, or with a striker that impacts do not slow.
pub(crate) fn laws_with(arm: Option<&CellArm>) -> physics::Options {
    arm.map_or_else(physics::Options::default, CellArm::laws)
}

/// The laws with which a strike in this scene is planned: impacts slow the striker if the cell's arm has known rotor inertias and base pose.
///
/// # Errors
/// An arm that cannot be read.
pub fn laws(scene: &Scene) -> Result<physics::Options> {
    Ok(laws_with(CellArm::of(scene, &Options::default())?.as_ref()))
}
