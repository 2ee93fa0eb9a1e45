//! Strike after strike on one world, with memory that is used again; many strikes side by side.

use super::world::World;
use crate::error::Result;
use crate::physics::event_loop::{Memory, Rollout};
use crate::physics::output::outcome::Outcome;
use crate::physics::output::trajectory::Log;
use crate::scene::Strike;
use rayon::prelude::*;

/// Memory that is used again from rollout to rollout.
#[derive(Clone, Debug, Default)]
pub struct Simulator {
    memory: Memory,
}

impl Simulator {
    /// A simulator with no memory yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Simulates one strike.
    ///
    /// # Errors
    /// A strike that cannot be, a striker that starts inside something.
    pub fn run(&mut self, world: &World, strike: &Strike) -> Result<Outcome> {
        self.logged(world, strike, None)
    }

    pub(crate) fn logged(
        &mut self,
        world: &World,
        strike: &Strike,
        log: Option<&mut Log>,
    ) -> Result<Outcome> {
        world.check_strike(strike)?;
        Ok(Rollout::new(world, strike, &mut self.memory, log).outcome())
    }
}

/// The outcomes of many strikes, computed side by side; the answers are the same for any number of threads.
pub fn rollouts(world: &World, strikes: &[Strike]) -> Vec<Result<Outcome>> {
    strikes.par_iter().map_init(Simulator::new, |simulator, strike| simulator.run(world, strike)).collect()
}
