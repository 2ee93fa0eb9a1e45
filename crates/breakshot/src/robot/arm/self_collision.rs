//! The distances between the parts of an arm.

use super::model::capsule::Capsule;
use super::model::serial_arm::Arm;
use nalgebra::Vector3;

/// The closest pair of parts: 0 is the base, followed by the links and the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Closest {
    pub(crate) parts: (usize, usize),
    pub(crate) gap_m: f64,
}

/// The pairs of an arm's parts that must not touch.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SelfCollision {
    pairs: Vec<(usize, usize)>,
    tool_radius_m: f64,
}

/// Number of poses that are tested for parts that overlap by design.
const POSES: u32 = 200;
/// Parts that overlap in more than this fraction of the poses overlap by design, because their shapes are approximate.
const BY_DESIGN: f64 = 0.5;

impl SelfCollision {
    /// All pairs except neighbours and those that nearly always overlap.
    pub(crate) fn of(arm: &Arm, tool_radius_m: f64) -> Self {
        let parts = arm.joint_count() + 2;
        let all = (0..parts).flat_map(|i| (i + 2..parts).map(move |j| (i, j)));
        let everything = Self { pairs: all.collect(), tool_radius_m };
        let poses: Vec<Vec<Vec<Capsule>>> =
            (0..POSES).map(|k| everything.shapes(arm, &arm.start_pose(k))).collect();
        let overlaps = |&(i, j): &(usize, usize)| {
            let count = poses.iter().filter(|shapes| least_gap_m(&shapes[i], &shapes[j]) < 0.0).count();
            count as f64 > BY_DESIGN * f64::from(POSES)
        };
        let pairs = everything.pairs.iter().copied().filter(|pair| !overlaps(pair)).collect();
        Self { pairs, tool_radius_m }
    }

    /// The closest pair at a pose; `None` for an arm without pairs.
    pub(crate) fn closest(&self, arm: &Arm, angles_rad: &[f64]) -> Option<Closest> {
        let shapes = self.shapes(arm, angles_rad);
        let gaps = self
            .pairs
            .iter()
            .map(|&(i, j)| Closest { parts: (i, j), gap_m: least_gap_m(&shapes[i], &shapes[j]) });
        gaps.min_by(|a, b| a.gap_m.total_cmp(&b.gap_m))
    }

    /// The shapes of all parts in the base frame.
    fn shapes(&self, arm: &Arm, angles_rad: &[f64]) -> Vec<Vec<Capsule>> {
        let mut shapes = vec![arm.base.capsules.clone()];
        shapes.extend(arm.link_capsules(angles_rad));
        shapes.push(arm.tool_capsule(angles_rad, self.tool_radius_m).into_iter().collect());
        shapes
    }
}

fn least_gap_m(some: &[Capsule], others: &[Capsule]) -> f64 {
    let gaps = some.iter().flat_map(|one| others.iter().map(|other| one.gap_m(other)));
    gaps.fold(f64::INFINITY, f64::min)
}

impl Arm {
    /// The links' collision shapes in the base frame.
    pub fn link_capsules(&self, angles_rad: &[f64]) -> Vec<Vec<Capsule>> {
        let frames = self.link_frames(angles_rad);
        let links = self.links.iter().zip(&frames);
        links
            .map(|(link, frame)| link.capsules.iter().map(|capsule| capsule.transformed(frame)).collect())
            .collect()
    }

    /// The tool's collision shape in the base frame; `None` if the tip is the flange.
    pub fn tool_capsule(&self, angles_rad: &[f64], radius_m: f64) -> Option<Capsule> {
        if self.tool.offset_m.norm() <= 0.0 {
            return None;
        }
        let tool = Capsule { from_m: Vector3::zeros(), to_m: self.tool.offset_m, radius_m };
        Some(tool.transformed(&self.flange_frame(angles_rad)))
    }

    /// The name of a part: 0 is the base, followed by the links and the tool.
    pub(crate) fn part_name(&self, part: usize) -> &str {
        match part.checked_sub(1) {
            None => &self.base.name,
            Some(link) => self.links.get(link).map_or("tool", |link| &link.name),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arm_folded_onto_itself_collides() {
        let arm = Arm::built_in("indy7").expect("built in");
        let monitor = SelfCollision::of(&arm, 0.02);
        let home = [0.0, -15.0, -90.0, 0.0, -75.0, 0.0].map(f64::to_radians);
        let folded = [0.0, 0.0, -175.0, 0.0, 100.0, 0.0].map(f64::to_radians);
        let gap_m = |angles: &[f64]| monitor.closest(&arm, angles).expect("pairs").gap_m;
        assert!(gap_m(&home) > 0.02, "at home the parts are {} m apart", gap_m(&home));
        assert!(gap_m(&folded) < 0.0, "folded, they are {} m apart", gap_m(&folded));
    }
}
