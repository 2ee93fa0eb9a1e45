//! Dynamics (Eq. 2 to 5): mass matrix, inverse dynamics, effective mass.

use super::kinematics::point_acceleration;
use super::model::serial_arm::Arm;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// A joint's axis and origin, and the force and moment that its link needs, in base axes (forward pass of Newton-Euler).
struct LinkLoad {
    axis: Vector3<f64>,
    origin: Vector3<f64>,
    com: Vector3<f64>,
    force: Vector3<f64>,
    moment: Vector3<f64>,
}

impl Arm {
    /// The mass matrix M of `torque = M qdd + ...` (kg m2), with the rotor inertias.
    pub fn mass_matrix(&self, angles_rad: &[f64]) -> DMatrix<f64> {
        let frames = self.link_frames(angles_rad);
        let count = frames.len();
        let mut mass = DMatrix::zeros(count, count);
        for (k, frame) in frames.iter().enumerate() {
            let body = self.moving_inertia(k).transformed(frame);
            let jacobian = self.jacobian_at(&frames, &body.com_m, k + 1);
            for i in 0..=k {
                let momentum = jacobian.fixed_view::<3, 1>(0, i) * body.mass_kg;
                let angular_momentum = body.inertia_kg_m2 * jacobian.fixed_view::<3, 1>(3, i);
                for j in 0..=i {
                    let term = momentum.dot(&jacobian.fixed_view::<3, 1>(0, j))
                        + angular_momentum.dot(&jacobian.fixed_view::<3, 1>(3, j));
                    mass[(i, j)] += term;
                    if i != j {
                        mass[(j, i)] += term;
                    }
                }
            }
            mass[(k, k)] += self.links[k].joint.armature_kg_m2;
        }
        mass
    }

    /// The joint torques for given joint accelerations, with gravity (N m); recursive Newton-Euler algorithm.
    pub fn torques(
        &self,
        angles_rad: &[f64],
        speeds_rad_s: &[f64],
        accelerations_rad_s2: &[f64],
    ) -> DVector<f64> {
        let loads = self.link_loads(angles_rad, speeds_rad_s, accelerations_rad_s2);
        let mut torques = DVector::zeros(loads.len());
        // Backward pass: accumulate force and moment from the tip to the base.
        let (mut force, mut moment, mut at) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        for (k, link) in loads.iter().enumerate().rev() {
            moment +=
                (at - link.origin).cross(&force) + link.moment + (link.com - link.origin).cross(&link.force);
            force += link.force;
            at = link.origin;
            torques[k] =
                link.axis.dot(&moment) + self.links[k].joint.armature_kg_m2 * accelerations_rad_s2[k];
        }
        torques
    }

    /// Forward pass: the force and the moment about the centre of mass that each link's motion needs.
    fn link_loads(
        &self,
        angles_rad: &[f64],
        speeds_rad_s: &[f64],
        accelerations_rad_s2: &[f64],
    ) -> Vec<LinkLoad> {
        let frames = self.link_frames(angles_rad);
        let (mut angular_velocity, mut angular_acceleration) = (Vector3::zeros(), Vector3::zeros());
        // Gravity is equivalent to an upward acceleration of the base.
        let (mut origin_acceleration, mut origin) = (-self.gravity_m_s2, Vector3::zeros());
        let links = frames.iter().enumerate().map(|(k, frame)| {
            origin_acceleration += point_acceleration(
                &angular_velocity,
                &angular_acceleration,
                &(frame.translation.vector - origin),
            );
            origin = frame.translation.vector;
            let axis = frame.rotation * self.links[k].joint.axis.into_inner();
            angular_acceleration +=
                axis * accelerations_rad_s2[k] + angular_velocity.cross(&axis) * speeds_rad_s[k];
            angular_velocity += axis * speeds_rad_s[k];
            let body = self.moving_inertia(k).transformed(frame);
            let acceleration = origin_acceleration
                + point_acceleration(&angular_velocity, &angular_acceleration, &(body.com_m - origin));
            let angular_momentum = body.inertia_kg_m2 * angular_velocity;
            LinkLoad {
                axis,
                origin,
                com: body.com_m,
                force: acceleration * body.mass_kg,
                moment: body.inertia_kg_m2 * angular_acceleration + angular_velocity.cross(&angular_momentum),
            }
        });
        links.collect()
    }

    /// The mobility `J M^-1 J'` of the tip's point (1/kg, base axes). Its value along a unit vector is the inverse of the
    /// effective mass in that direction (Eq. 8).
    ///
    /// `None` if the mass matrix is not positive definite, which is impossible for a physical arm.
    pub fn tip_mobility(&self, angles_rad: &[f64]) -> Option<Matrix3<f64>> {
        let jacobian = self.jacobian(angles_rad);
        let point = jacobian.fixed_rows::<3>(0);
        let factor = self.mass_matrix(angles_rad).cholesky()?;
        let mobility = point * factor.solve(&point.transpose());
        let mobility = Matrix3::from_iterator(mobility.iter().copied());
        Some((mobility + mobility.transpose()) / 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::arm::model::serial_arm::Tool;

    const ANGLES: [f64; 6] = [0.4, -0.7, -1.1, 0.3, 0.9, -1.4];
    const SPEEDS: [f64; 6] = [1.0, -0.5, 0.8, 2.0, -1.5, 0.7];
    const STILL: [f64; 6] = [0.0; 6];

    fn arm() -> Arm {
        let tool = Tool { offset_m: Vector3::new(0.0, 0.02, 0.2), mass_kg: 0.5 };
        let arm = Arm::built_in("indy7").and_then(|arm| arm.with_tool(tool)).expect("built in");
        arm.with_armature(&[0.3, 0.3, 0.2, 0.1, 0.1, 0.05]).expect("six numbers")
    }

    #[test]
    fn the_columns_of_the_mass_matrix_are_the_torques_of_unit_accelerations() {
        let arm = arm();
        let mass = arm.mass_matrix(&ANGLES);
        let held = arm.torques(&ANGLES, &STILL, &STILL);
        for k in 0..6 {
            let mut unit = STILL;
            unit[k] = 1.0;
            let error = (arm.torques(&ANGLES, &STILL, &unit) - &held - mass.column(k)).amax();
            assert!(error < 1e-12, "column {k}: off by {error} kg m2");
        }
    }

    /// Kinetic and potential energy together (J).
    fn energy_j(arm: &Arm, angles: &[f64], speeds: &[f64]) -> f64 {
        let qd = DVector::from_row_slice(speeds);
        let frames = arm.link_frames(angles);
        let height = |k: usize| {
            let body = arm.moving_inertia(k).transformed(&frames[k]);
            -body.mass_kg * arm.gravity_m_s2.dot(&body.com_m)
        };
        0.5 * qd.dot(&(arm.mass_matrix(angles) * &qd)) + (0..6).map(height).sum::<f64>()
    }

    #[test]
    fn the_power_of_the_torques_is_the_change_of_energy() {
        let arm = arm();
        let accelerations = [3.0, -2.0, 1.0, -4.0, 2.5, 5.0];
        let at = |t: f64| -> (Vec<f64>, Vec<f64>) {
            let angle = |k: usize| ANGLES[k] + t * SPEEDS[k] + t * t / 2.0 * accelerations[k];
            ((0..6).map(angle).collect(), (0..6).map(|k| SPEEDS[k] + t * accelerations[k]).collect())
        };
        let step_s = 1e-5;
        let ((q_ahead, qd_ahead), (q_behind, qd_behind)) = (at(step_s), at(-step_s));
        let change_w =
            (energy_j(&arm, &q_ahead, &qd_ahead) - energy_j(&arm, &q_behind, &qd_behind)) / (2.0 * step_s);
        let power_w = arm.torques(&ANGLES, &SPEEDS, &accelerations).dot(&DVector::from_row_slice(&SPEEDS));
        assert!(
            (change_w - power_w).abs() < 1e-6,
            "energy changes by {change_w} W, torques give {power_w} W"
        );
    }

    #[test]
    fn an_arm_that_hangs_in_no_gravity_needs_no_torque_to_rest() {
        let mut arm = arm();
        arm.gravity_m_s2 = Vector3::zeros();
        assert!(arm.torques(&ANGLES, &STILL, &STILL).amax() == 0.0);
    }

    /// From pinocchio 4.1 on the URDF with the same numbers, flange, no tool, angles 0 -15 -90 0 -75 0 degrees (kg).
    const HOME_DEG: [f64; 6] = [0.0, -15.0, -90.0, 0.0, -75.0, 0.0];
    const HOME_KG: [f64; 3] = [0.79961239, 1.41032128, 3.84357631];
    const HOME_PUBLISHED_KG: [f64; 3] = [1.24008098, 2.33414517, 4.54862465];

    #[test]
    fn the_effective_masses_of_the_indy_are_those_of_pinocchio() {
        for (name, reference_kg) in [("indy7", HOME_KG), ("indy7_published", HOME_PUBLISHED_KG)] {
            let arm = Arm::built_in(name).expect("built in");
            let mobility = arm.tip_mobility(&HOME_DEG.map(f64::to_radians)).expect("positive definite");
            for (k, reference_kg) in reference_kg.into_iter().enumerate() {
                let mass_kg = 1.0 / mobility[(k, k)];
                assert!(
                    (mass_kg - reference_kg).abs() < 1e-8,
                    "{name}, axis {k}: {mass_kg}, not {reference_kg} kg"
                );
            }
        }
    }

    #[test]
    fn rotors_make_the_tip_heavier() {
        let bare = Arm::built_in("indy7").expect("built in");
        let geared = bare.clone().with_armature(&[0.3, 0.3, 0.3, 0.075, 0.075, 0.075]).expect("six numbers");
        let mass_kg = |arm: &Arm| {
            1.0 / arm.tip_mobility(&HOME_DEG.map(f64::to_radians)).expect("positive definite")[(0, 0)]
        };
        let (bare, geared) = (mass_kg(&bare), mass_kg(&geared));
        assert!((geared - 2.08).abs() < 0.005, "{bare} kg without, {geared} kg with rotors");
    }
}
