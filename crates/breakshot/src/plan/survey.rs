//! What are strikes from all around worth?  A map of a scene, and what a model that shall propose strikes can learn from.

use super::options::{Aim, Options};
use super::robust::evaluate::{expected_singulated, part, verdicts};
use super::robust::goal_margin::{Judge, Verdict};
use super::robust::scenarios::possible_worlds;
use super::robust::strike_grid::{Candidate, Range, reachable};
use crate::error::Result;
use crate::physics::{self, World};
use crate::properties::Properties;
use crate::scene::{Scene, Strike};

/// A strike, and what becomes of the goal after it.
#[derive(Clone, Debug, PartialEq)]
pub struct Surveyed {
    /// What it aims at.
    pub aim: Aim,
    /// The strike itself.
    pub strike: Strike,
    /// The part of the possible worlds in which it fulfils the goal.
    pub success_probability: f64,
    /// How many objects it singulates, on average.
    pub expected_singulated: f64,
}

/// Judges strikes, at most so many and evenly chosen of all that the striker can make, in so many possible worlds.
///
/// All are judged in the same worlds; the same seed gives the same bits on any number of threads.
///
/// # Errors
/// A scene that cannot be simulated.
pub fn survey(
    scene: &Scene,
    properties: &Properties,
    options: &Options,
    (strikes, samples): (usize, usize),
) -> Result<Vec<Surveyed>> {
    let nominal = World::new(scene, properties, &physics::Options::default())?;
    let judge = Judge::new(scene)?;
    let (all, _) = reachable(scene, &Range::new(scene)?, (options, usize::MAX));
    let count = strikes.min(all.len());
    let chosen = (0..count).map(|k| &all[k * all.len() / count]);
    let worlds = possible_worlds((scene, properties, &nominal), options, (options.seed, samples), None)?;
    let surveyed = |Candidate { aim, strike, .. }: &Candidate| {
        let verdicts = verdicts(strike, &worlds, &judge);
        Surveyed {
            aim: aim.clone(),
            strike: strike.clone(),
            success_probability: part(&verdicts, Verdict::fulfilled),
            expected_singulated: expected_singulated(&verdicts),
        }
    };
    Ok(chosen.map(surveyed).collect())
}
