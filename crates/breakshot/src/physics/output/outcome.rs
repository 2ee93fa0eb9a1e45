//! What is the result of a strike, without its events?

use crate::geometry::Pose;

/// The poses after a strike.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Final pose of each object, in the order of [`World::names`](crate::physics::World::names).
    pub poses: Vec<Pose>,
    /// Time at which everything is at rest (s after the striker starts).
    pub duration_s: f64,
    /// Number of impacts.
    pub impacts: usize,
    /// Work of the striker on the objects (J, or per mass of the reference object if that was not weighed).
    pub striker_work_j: f64,
    /// Whether each object has fallen off the table, in the same order; its pose is then the one at the edge.
    pub fallen: Vec<bool>,
    /// Whether everything came to rest within the bound of steps; if not, the poses are those at the last step.
    pub complete: bool,
}

impl Outcome {
    /// A hash of every bit of poses and duration (FNV-1a), to compare results exactly.
    pub fn bit_hash(&self) -> u64 {
        let numbers = self.poses.iter().flat_map(|p| [p.position.x, p.position.y, p.yaw_rad]);
        let bytes = numbers.chain([self.duration_s]).flat_map(|n| n.to_bits().to_le_bytes());
        bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
    }
}
