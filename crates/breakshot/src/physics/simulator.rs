//! Where does everything come to rest, strike after strike on one world?

use crate::error::Result;
use crate::physics::event_loop::rollout::{Memory, Rollout};
use crate::physics::output::outcome::Outcome;
use crate::physics::output::recorder::Recorder;
use crate::physics::world::World;
use crate::scene::Strike;
use rayon::prelude::*;

/// A simulator whose working memory is reused from rollout to rollout.
#[derive(Clone, Debug, Default)]
pub struct Simulator {
    memory: Memory,
}

impl Simulator {
    /// A simulator with empty memory.
    pub fn new() -> Self {
        Self::default()
    }

    /// Simulates one strike.
    ///
    /// # Errors
    /// An impossible strike, a striker that starts inside something.
    pub fn run(&mut self, world: &World, strike: &Strike) -> Result<Outcome> {
        self.recorded(world, strike, None)
    }

    pub(crate) fn recorded(
        &mut self,
        world: &World,
        strike: &Strike,
        recorder: Option<&mut Recorder>,
    ) -> Result<Outcome> {
        world.check_strike(strike)?;
        Ok(Rollout::new(world, strike, &mut self.memory, recorder).outcome())
    }
}

/// The outcomes of many strikes, simulated in parallel; they are the same for any number of threads.
pub fn rollouts(world: &World, strikes: &[Strike]) -> Vec<Result<Outcome>> {
    strikes.par_iter().map_init(Simulator::new, |simulator, strike| simulator.run(world, strike)).collect()
}
