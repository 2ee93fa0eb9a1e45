//! Strike after strike on one world, with memory that is used again; many strikes side by side.

use super::rollout::{Memory, Rollout};
use super::trajectory::Log;
use super::world::World;
use crate::error::Result;
use crate::geometry::Pose;
use crate::scene::Strike;
use rayon::prelude::*;

/// What a strike leads to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Where each object comes to rest, in the order of [`World::names`].
    pub poses: Vec<Pose>,
    /// When everything is at rest (s after the striker starts).
    pub duration_s: f64,
    /// How many impacts there were.
    pub impacts: usize,
    /// Which objects have fallen off the table, in the order of [`World::names`]; their poses are those at the edge.
    pub fallen: Vec<bool>,
    /// Whether it was followed to the end; if not, the poses are those where it was given up.
    pub complete: bool,
}

impl Outcome {
    /// A number that changes with any bit of the answer (FNV-1a over the bits of poses and duration).
    pub fn bit_hash(&self) -> u64 {
        let numbers = self.poses.iter().flat_map(|p| [p.position.x, p.position.y, p.yaw_rad]);
        let bytes = numbers.chain([self.duration_s]).flat_map(|n| n.to_bits().to_le_bytes());
        bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
    }
}

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
