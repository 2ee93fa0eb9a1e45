//! Which joint angles bring the tip to a given frame.
//!
//! Damped least squares (Levenberg-Marquardt) with a damping that goes with the error, so that the last steps converge
//! quadratically (Sugihara, IEEE T-RO 2011), from one start pose after the other.

use super::kinematics::twist;
use super::model::frame::Frame;
use super::model::serial_arm::Arm;
use crate::geometry::wrapped_rad;
use nalgebra::{Matrix6, SMatrix, SVector, Vector6};
use std::f64::consts::TAU;

/// How well a pose must meet the target: metres and radians together.
const TOLERANCE: f64 = 1e-10;
/// A start from which this many steps do not arrive will not.
const STEPS_PER_START: usize = 25;
/// A walk that has not halved its squared error within so many steps leads nowhere.  Of ten thousand random poses of an Indy 7 all
/// are found with these numbers, after 18 steps each; without this rule and with 40 steps a start, after 28.
const PATIENCE: usize = 8;
/// Starts tried before a target counts as out of reach.
const STARTS: u32 = 60;
/// The most a joint may turn in one step (rad): beyond, the linear model means nothing.
const STEP_LIMIT_RAD: f64 = 1.0;
/// Damping per squared error; small enough not to slow the last steps, large enough to pass singular poses.
const DAMPING: f64 = 0.05;
/// Damping that stays, against a Jacobian without inverse; it changes the last steps by less than the tolerance.
const LEAST_DAMPING: f64 = 1e-14;
/// A joint with less range than this is held at its stops; with more, whole turns bring it back in the end (rad).
const TURNING_RAD: f64 = 0.9 * TAU;
/// Poses that differ by less in every joint are one (rad).
const SAME_POSE_RAD: f64 = 1e-4;

/// The Jacobian's columns; a joint that an arm does not have, or that stands still, has a column of zeros.
type Columns = SMatrix<f64, 6, 7>;

impl Arm {
    /// The joint angles (rad) that bring the tip to `target`, near `start_rad` if there are any; `None` if no start
    /// leads there within the joints' ranges.
    pub fn inverse(&self, target: &Frame, start_rad: &[f64]) -> Option<Vec<f64>> {
        self.descend(target, start_rad.to_vec(), None)
            .or_else(|| (0..STARTS).find_map(|k| self.descend(target, self.start_pose(k), None)))
    }

    /// The different ways to bring the tip to `target`: each branch once, in a fixed order; for seven joints
    /// some of endlessly many.
    pub fn branches(&self, target: &Frame) -> Vec<Vec<f64>> {
        let mut found: Vec<Vec<f64>> = Vec::new();
        for k in 0..STARTS {
            let Some(angles) = self.descend(target, self.start_pose(k), None) else { continue };
            let is_known = |known: &Vec<f64>| {
                known.iter().zip(&angles).all(|(a, b)| wrapped_rad(a - b).abs() < SAME_POSE_RAD)
            };
            if !found.iter().any(is_known) {
                found.push(angles);
            }
        }
        found
    }

    /// Walks from a start pose to the target, or gives up; the joint `still` does not move.
    pub(crate) fn descend(
        &self,
        target: &Frame,
        mut angles: Vec<f64>,
        still: Option<usize>,
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
            let mut columns = self.columns(&frames, &tip, still);
            let damping = DAMPING * square + LEAST_DAMPING;
            let mut step = damped_step(&columns, &error, damping)?;
            // A joint at its stop that is pushed against it takes no part: the others must do without.
            let is_held = |k: usize, step: f64| {
                let [low, high] = self.links[k].joint.range_rad;
                high - low < TURNING_RAD
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
                if high - low < TURNING_RAD {
                    *angle = angle.clamp(low, high);
                }
            }
        }
        None
    }

    /// How the tip moves with each joint; the joint `still` does not move.
    fn columns(&self, frames: &[Frame], tip: &Frame, still: Option<usize>) -> Columns {
        let mut columns = Columns::zeros();
        for (k, frame) in frames.iter().enumerate().filter(|(k, _)| Some(*k) != still) {
            columns.set_column(k, &self.column(frame, &tip.translation.vector, k));
        }
        columns
    }

    /// The same pose with every joint inside its range, if full turns can do that.
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

    /// The `k`-th of a sequence of poses that fill the joints' ranges evenly (Roberts' R sequence).
    pub(crate) fn start_pose(&self, k: u32) -> Vec<f64> {
        let ratio = roberts_ratio(self.links.len());
        let mut step = 1.0;
        let poses = self.links.iter().map(|link| {
            step /= ratio;
            let part = (0.5 + step * f64::from(k)).fract();
            let [low, high] = link.joint.range_rad;
            let (low, high) = (low.max(-TAU / 2.0), high.min(TAU / 2.0));
            low + part * (high - low)
        });
        poses.collect()
    }

    /// The joint speeds and accelerations (rad/s, rad/s2) with which the tip has a given velocity and acceleration.
    ///
    /// `still` names a joint of a seven-joint arm that stands still meanwhile.  `None` at a singular pose.
    pub fn joint_rates(
        &self,
        angles_rad: &[f64],
        velocity: &Vector6<f64>,
        acceleration: &Vector6<f64>,
        still: Option<usize>,
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let jacobian = self.jacobian(angles_rad);
        let moving: Vec<usize> = (0..self.joint_count()).filter(|&k| Some(k) != still).collect();
        let square = Matrix6::from_fn(|i, j| jacobian[(i, moving[j])]);
        let factor = square.lu();
        let spread = |values: &Vector6<f64>| {
            let mut all = vec![0.0; self.joint_count()];
            moving.iter().zip(values.iter()).for_each(|(&k, &value)| all[k] = value);
            all
        };
        let speeds = spread(&factor.solve(velocity)?);
        let rest = acceleration - self.velocity_product(angles_rad, &speeds);
        let accelerations = spread(&factor.solve(&rest)?);
        Some((speeds, accelerations))
    }
}

/// The step of damped least squares: `J' (J J' + damping E)^-1 error`.
fn damped_step(columns: &Columns, error: &Vector6<f64>, damping: f64) -> Option<SVector<f64, 7>> {
    let normal = columns * columns.transpose() + Matrix6::identity() * damping;
    Some(columns.tr_mul(&normal.cholesky()?.solve(error)))
}

/// The number whose powers fill `dimensions` evenly: the root of x^(d+1) = x + 1.
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
        fn the_tip_goes_where_some_pose_had_it(parts in pose()) {
            let arm = Arm::built_in("indy7").expect("built in");
            let angles: Vec<f64> = parts.iter().zip(&arm.links).map(|(x, link)| x * link.joint.range_rad[1]).collect();
            let target = arm.tip(&angles);
            let found = arm.inverse(&target, &[0.0; 6]);
            prop_assert!(found.is_some(), "{:?} rad was not found again", angles);
            let found = found.expect("just checked");
            let error = twist(&arm.tip(&found), &target).norm();
            prop_assert!(error < 1e-9, "the tip is off by {error}");
            for (angle, link) in found.iter().zip(&arm.links) {
                let [low, high] = link.joint.range_rad;
                prop_assert!((low..=high).contains(angle), "{} stands at {angle} rad", link.joint.name);
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
    fn joint_rates_give_back_the_tips_motion() {
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
