//! What does a strike lead to?

use crate::geometry::Pose;

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
