//! Inverse kinematics: the joint angles for a given tip frame.
//!
//! Damped least squares (Levenberg-Marquardt) with a damping proportional to the squared error, so that the last steps
//! converge quadratically (Sugihara, IEEE T-RO 2011), from a sequence of start poses.

use super::kinematics::twist;
use super::model::frame::Frame;
use super::model::serial_arm::Arm;
use crate::geometry::wrapped_rad;
use nalgebra::{Matrix6, SMatrix, SVector, Vector6};
use std::f64::consts::TAU;

/// Largest error of a solution, the norm of its twist to the target (m and rad).
const TOLERANCE: f64 = 1e-10;
/// Largest number of steps per start pose.
const STEPS_PER_START: usize = 25;
/// Number of steps within which the squared error must halve. With these numbers all of ten thousand random poses of an
/// Indy 7 are found, after 18 steps each; without this rule and with 40 steps per start, after 28.
const PATIENCE: usize = 8;
/// Number of start poses before a target counts as out of reach.
const STARTS: u32 = 60;
/// Largest joint step (rad), for which the linear model is valid.
const STEP_LIMIT_RAD: f64 = 1.0;
/// Damping per squared error: small enough for fast last steps, large enough to pass singular configurations.
const DAMPING: f64 = 0.05;
/// Smallest damping, for a singular Jacobian; it changes the last steps by less than the tolerance.
const SMALLEST_DAMPING: f64 = 1e-14;
/// Joints with a smaller range are clamped to it; the others are wrapped by full revolutions at the end (rad).
const CLAMPED_RANGE_RAD: f64 = 0.9 * TAU;
/// Largest difference of a joint angle between equal poses (rad).
const SAME_POSE_RAD: f64 = 1e-4;

/// The Jacobian's columns; zero for a missing or fixed joint.
type Columns = SMatrix<f64, 6, 7>;

impl Arm {
    /// Joint angles at which the tip frame is `target`, near `start_rad` if possible (rad); `None` if no start pose converges
    /// within the joints' ranges.
    pub fn inverse(&self, target: &Frame, start_rad: &[f64]) -> Option<Vec<f64>> {
        self.descend(target, start_rad.to_vec(), None)
            .or_else(|| (0..STARTS).find_map(|k| self.descend(target, self.start_pose(k), None)))
    }

    /// The solutions for a target, each branch once, in a fixed order (rad); for seven joints, some of infinitely many.
    pub fn branches(&self, target: &Frame) -> Vec<Vec<f64>> {
        let mut found: Vec<Vec<f64>> = Vec::new();
        for angles in self.solutions(target) {
            let is_known = |known: &Vec<f64>| {
                known.iter().zip(&angles).all(|(a, b)| wrapped_rad(a - b).abs() < SAME_POSE_RAD)
            };
            if !found.iter().any(is_known) {
                found.push(angles);
            }
        }
        found
    }

    /// The solution from every start pose that leads to one, computed when it is asked for; the same branch can come several times.
    pub(crate) fn solutions(&self, target: &Frame) -> impl Iterator<Item = Vec<f64>> {
        (0..STARTS).filter_map(|k| self.descend(target, self.start_pose(k), None))
    }

    /// Iterates from a start pose to the target; `None` without convergence. The joint `fixed_joint` does not move.
    pub(crate) fn descend(
        &self,
        target: &Frame,
        mut angles: Vec<f64>,
        fixed_joint: Option<usize>,
    ) -> Option<Vec<f64>> {
        let mut squares = [f64::INFINITY; PATIENCE];
        for n in 0..STEPS_PER_START {
            let frames = self.link_frames(&angles);
            let tip = self.tip_of(&frames);
            let error = twist(&tip, target);
            if error.norm() < TOLERANCE {
                return self.within_ranges(angles);
            }
            let square = error.norm_squared();
            if square > 0.5 * std::mem::replace(&mut squares[n % PATIENCE], square) {
                return None;
            }
            let mut columns = self.columns(&frames, &tip, fixed_joint);
            let damping = DAMPING * square + SMALLEST_DAMPING;
            let mut step = damped_step(&columns, &error, damping)?;
            // A joint at the end of its range whose step leads outward is excluded; the others are solved again.
            let is_held = |k: usize, step: f64| {
                let [low, high] = self.links[k].joint.range_rad;
                high - low < CLAMPED_RANGE_RAD
                    && ((angles[k] <= low && step < 0.0) || (angles[k] >= high && step > 0.0))
            };
            if (0..angles.len()).any(|k| is_held(k, step[k])) {
                for k in (0..angles.len()).filter(|&k| is_held(k, step[k])) {
                    columns.column_mut(k).fill(0.0);
                }
                step = damped_step(&columns, &error, damping)?;
            }
            let scale = (STEP_LIMIT_RAD / step.amax()).min(1.0);
            for (k, angle) in angles.iter_mut().enumerate() {
                let [low, high] = self.links[k].joint.range_rad;
                *angle += scale * step[k];
                if high - low < CLAMPED_RANGE_RAD {
                    *angle = angle.clamp(low, high);
                }
            }
        }
        None
    }

    /// The Jacobian's columns; zero for the joint `fixed_joint`.
    fn columns(&self, frames: &[Frame], tip: &Frame, fixed_joint: Option<usize>) -> Columns {
        let mut columns = Columns::zeros();
        for (k, frame) in frames.iter().enumerate().filter(|(k, _)| Some(*k) != fixed_joint) {
            columns.set_column(k, &self.column(frame, &tip.translation.vector, k));
        }
        columns
    }

    /// The same pose with every joint wrapped into its range by full revolutions; `None` if that is impossible.
    fn within_ranges(&self, mut angles: Vec<f64>) -> Option<Vec<f64>> {
        for (angle, link) in angles.iter_mut().zip(&self.links) {
            *angle = wrapped_rad(*angle);
            let [low, high] = link.joint.range_rad;
            if *angle < low {
                *angle += TAU;
            } else if *angle > high {
                *angle -= TAU;
            }
            if !(low..=high).contains(angle) {
                return None;
            }
        }
        Some(angles)
    }

    /// The `k`-th start pose of a quasi-random sequence that fills the joints' ranges uniformly (Roberts' R sequence).
    pub(crate) fn start_pose(&self, k: u32) -> Vec<f64> {
        let ratio = roberts_ratio(self.links.len());
        let mut step = 1.0;
        let poses = self.links.iter().map(|link| {
            step /= ratio;
            let fraction = (0.5 + step * f64::from(k)).fract();
            let [low, high] = link.joint.range_rad;
            let (low, high) = (low.max(-TAU / 2.0), high.min(TAU / 2.0));
            low + fraction * (high - low)
        });
        poses.collect()
    }

    /// The joint velocities and accelerations for a given velocity and acceleration of the tip (rad/s, rad/s2).
    ///
    /// `fixed_joint` is the index of a joint of a seven-joint arm that is held fixed. `None` at a singular configuration.
    pub fn joint_rates(
        &self,
        angles_rad: &[f64],
        velocity: &Vector6<f64>,
        acceleration: &Vector6<f64>,
        fixed_joint: Option<usize>,
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let jacobian = self.jacobian(angles_rad);
        let moving: Vec<usize> = (0..self.joint_count()).filter(|&k| Some(k) != fixed_joint).collect();
        let square = Matrix6::from_fn(|i, j| jacobian[(i, moving[j])]);
        let factor = square.lu();
        let scattered = |values: &Vector6<f64>| {
            let mut all = vec![0.0; self.joint_count()];
            moving.iter().zip(values.iter()).for_each(|(&k, &value)| all[k] = value);
            all
        };
        let speeds = scattered(&factor.solve(velocity)?);
        let rest = acceleration - self.velocity_product(angles_rad, &speeds);
        let accelerations = scattered(&factor.solve(&rest)?);
        Some((speeds, accelerations))
    }
}

/// The step of damped least squares: `J' (J J' + damping E)^-1 error`.
fn damped_step(columns: &Columns, error: &Vector6<f64>, damping: f64) -> Option<SVector<f64, 7>> {
    let normal = columns * columns.transpose() + Matrix6::identity() * damping;
    Some(columns.tr_mul(&normal.cholesky()?.solve(error)))
}

/// The generator of Roberts' sequence in `dimensions`: the root of x^(d+1) = x + 1.
fn roberts_ratio(dimensions: usize) -> f64 {
    let power = 1.0 / (dimensions as f64 + 1.0);
    (0..30).fold(1.5, |x: f64, _| (1.0 + x).powf(power))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;
    use proptest::prelude::*;

    fn pose() -> impl Strategy<Value = Vec<f64>> {
        proptest::collection::vec(-1.0..1.0_f64, 6)
    }

    proptest! {
        #[test]
        fn the_inverse_recovers_the_tip_frame_of_any_pose(parts in pose()) {
            let arm = Arm::built_in("indy7").expect("built in");
            let angles: Vec<f64> = parts.iter().zip(&arm.links).map(|(x, link)| x * link.joint.range_rad[1]).collect();
            let target = arm.tip(&angles);
            let found = arm.inverse(&target, &[0.0; 6]);
            prop_assert!(found.is_some(), "{:?} rad was not found", angles);
            let found = found.expect("just checked");
            let error = twist(&arm.tip(&found), &target).norm();
            prop_assert!(error < 1e-9, "the tip is off by {error}");
            for (angle, link) in found.iter().zip(&arm.links) {
                let [low, high] = link.joint.range_rad;
                prop_assert!((low..=high).contains(angle), "{} is at {angle} rad", link.joint.name);
            }
        }
    }

    #[test]
    fn every_branch_meets_the_target_and_differs_from_the_others() {
        let arm = Arm::built_in("indy7").expect("built in");
        let target = arm.tip(&[0.1, -0.7, -1.9, 0.2, -0.6, 0.3]);
        let branches = arm.branches(&target);
        assert!(branches.len() >= 4, "{} branches", branches.len());
        for angles in &branches {
            let error = twist(&arm.tip(angles), &target).norm();
            assert!(error < 1e-9, "the tip is off by {error}");
        }
    }

    #[test]
    fn a_target_out_of_reach_is_not_found() {
        let arm = Arm::built_in("indy7").expect("built in");
        assert_eq!(arm.inverse(&Frame::translation(3.0, 0.0, 0.5), &[0.0; 6]), None);
    }

    #[test]
    fn joint_rates_reproduce_the_tips_motion() {
        let arm = Arm::built_in("indy7").expect("built in");
        let angles = [0.4, -0.7, -1.1, 0.3, 0.9, -1.4];
        let velocity = Vector6::new(0.3, -0.2, 0.1, 0.4, 0.0, -0.5);
        let acceleration = Vector6::new(1.0, 2.0, -3.0, 0.5, 0.7, -0.1);
        let (speeds, accelerations) =
            arm.joint_rates(&angles, &velocity, &acceleration, None).expect("regular");
        let jacobian = arm.jacobian(&angles);
        let error = (&jacobian * DVector::from_row_slice(&speeds) - velocity).amax();
        assert!(error < 1e-12, "velocity off by {error}");
        let back =
            &jacobian * DVector::from_row_slice(&accelerations) + arm.velocity_product(&angles, &speeds);
        assert!((back - acceleration).amax() < 1e-12, "acceleration off by {}", (back - acceleration).amax());
    }
}
