//! Capsules in space: how far apart, how high above the table.

use super::Frame;
use super::model::{Arm, Capsule};
use nalgebra::Vector3;

impl Capsule {
    /// The same capsule in another frame.
    #[must_use]
    pub fn seen_from(&self, other_from_own: &Frame) -> Self {
        let to = |point: &Vector3<f64>| other_from_own.rotation * point + other_from_own.translation.vector;
        Self { from_m: to(&self.from_m), to_m: to(&self.to_m), radius_m: self.radius_m }
    }

    /// The free space to another one (m), negative if they overlap.
    pub fn gap_m(&self, other: &Self) -> f64 {
        segment_distance_m((&self.from_m, &self.to_m), (&other.from_m, &other.to_m))
            - self.radius_m
            - other.radius_m
    }
}

/// How far apart two segments are (m): the clamped closest points (Ericson, Real-Time Collision Detection, 5.1.9).
fn segment_distance_m(
    (p, p_end): (&Vector3<f64>, &Vector3<f64>),
    (q, q_end): (&Vector3<f64>, &Vector3<f64>),
) -> f64 {
    let (along_p, along_q, between) = (p_end - p, q_end - q, p - q);
    let (a, e, b) = (along_p.norm_squared(), along_q.norm_squared(), along_p.dot(&along_q));
    let (c, f) = (along_p.dot(&between), along_q.dot(&between));
    let share = |over: f64, under: f64| if under > 0.0 { (over / under).clamp(0.0, 1.0) } else { 0.0 };
    let mut s = share(b * f - c * e, a * e - b * b);
    let mut t = if e > 0.0 { (b * s + f) / e } else { 0.0 };
    if !(0.0..=1.0).contains(&t) || e <= 0.0 {
        t = t.clamp(0.0, 1.0);
        s = share(b * t - c, a);
    }
    (p + along_p * s - (q + along_q * t)).norm()
}

/// Which two parts of an arm come closest: 0 is the base, then the links, then the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Closest {
    pub(super) parts: (usize, usize),
    pub(super) gap_m: f64,
}

/// The pairs of an arm's parts that must stay apart.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SelfCollision {
    pairs: Vec<(usize, usize)>,
    tool_radius_m: f64,
}

/// Poses tried to learn which parts overlap by design.
const POSES: u32 = 200;
/// Parts that overlap in more than this share of all poses do so by design: their shapes are rough, not the arm
/// broken.
const BY_DESIGN: f64 = 0.5;

impl SelfCollision {
    /// The pairs to watch: all but neighbours and those that nearly always overlap.
    pub(super) fn of(arm: &Arm, tool_radius_m: f64) -> Self {
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

    /// The pair that comes closest at a pose; `None` for an arm without pairs.
    pub(super) fn closest(&self, arm: &Arm, angles_rad: &[f64]) -> Option<Closest> {
        let shapes = self.shapes(arm, angles_rad);
        let gaps = self
            .pairs
            .iter()
            .map(|&(i, j)| Closest { parts: (i, j), gap_m: least_gap_m(&shapes[i], &shapes[j]) });
        gaps.min_by(|a, b| a.gap_m.total_cmp(&b.gap_m))
    }

    /// The shapes of all parts in the base's frame.
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
    /// What the links fill, in the base's frame.
    pub fn link_capsules(&self, angles_rad: &[f64]) -> Vec<Vec<Capsule>> {
        let frames = self.link_frames(angles_rad);
        let links = self.links.iter().zip(&frames);
        links
            .map(|(link, frame)| link.capsules.iter().map(|capsule| capsule.seen_from(frame)).collect())
            .collect()
    }

    /// What the tool fills, in the base's frame; nothing if the tip is the flange.
    pub fn tool_capsule(&self, angles_rad: &[f64], radius_m: f64) -> Option<Capsule> {
        if self.tool.offset_m.norm() <= 0.0 {
            return None;
        }
        let tool = Capsule { from_m: Vector3::zeros(), to_m: self.tool.offset_m, radius_m };
        Some(tool.seen_from(&self.flange_frame(angles_rad)))
    }

    /// What a part of the arm is called: 0 is the base, then the links, then the tool.
    pub(super) fn part_name(&self, part: usize) -> &str {
        match part.checked_sub(1) {
            None => &self.base.name,
            Some(link) => self.links.get(link).map_or("tool", |link| &link.name),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn segment() -> impl Strategy<Value = [f64; 6]> {
        proptest::array::uniform6(-1.0..1.0_f64)
    }

    fn capsule([a, b, c, d, e, f]: [f64; 6]) -> Capsule {
        Capsule { from_m: Vector3::new(a, b, c), to_m: Vector3::new(d, e, f), radius_m: 0.1 }
    }

    proptest! {
        #[test]
        fn no_two_points_of_two_segments_are_nearer_than_their_gap(
            one in segment(), other in segment(), s in 0.0..1.0_f64, t in 0.0..1.0_f64,
        ) {
            let (one, other) = (capsule(one), capsule(other));
            let at = |capsule: &Capsule, part: f64| capsule.from_m.lerp(&capsule.to_m, part);
            let apart = (at(&one, s) - at(&other, t)).norm() - 0.2;
            let gap = one.gap_m(&other);
            prop_assert!(gap <= apart + 1e-12, "gap {gap} m, but two points are {apart} m apart");
            prop_assert!((gap - other.gap_m(&one)).abs() < 1e-12, "the gap depends on the order");
        }
    }

    #[test]
    fn crossed_and_parallel_segments_have_the_known_distance() {
        let x = capsule([-1.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        for (other, expected_m) in [
            ([0.0, -1.0, 0.5, 0.0, 1.0, 0.5], 0.5),
            ([-1.0, 0.3, 0.0, 1.0, 0.3, 0.0], 0.3),
            ([2.0, 0.0, 0.0, 3.0, 0.0, 0.0], 1.0),
            ([0.0, 0.0, 0.7, 0.0, 0.0, 0.7], 0.7),
        ] {
            let gap = x.gap_m(&capsule(other)) + 0.2;
            assert!((gap - expected_m).abs() < 1e-12, "{gap} m, not {expected_m} m");
        }
    }

    #[test]
    fn an_arm_folded_onto_itself_is_seen() {
        let arm = Arm::built_in("indy7").expect("built in");
        let watch = SelfCollision::of(&arm, 0.02);
        let home = [0.0, -15.0, -90.0, 0.0, -75.0, 0.0].map(f64::to_radians);
        let folded = [0.0, 0.0, -175.0, 0.0, 100.0, 0.0].map(f64::to_radians);
        let gap_m = |angles: &[f64]| watch.closest(&arm, angles).expect("pairs").gap_m;
        assert!(gap_m(&home) > 0.02, "at home the parts are {} m apart", gap_m(&home));
        assert!(gap_m(&folded) < 0.0, "folded, they are {} m apart", gap_m(&folded));
    }
}
