//! The pose of the table in the robot's base frame, from table points touched by the tip.

use super::model::frame::rpy_rad;
use super::model::serial_arm::Arm;
use crate::cell::Transform;
use crate::error::{Error, Result};
use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

/// One touched point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TouchedPoint {
    /// The point in the table frame, for example a tag's centre (m).
    pub table_m: [f64; 2],
    /// The joint angles of the touch (rad).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub q_rad: Option<Vec<f64>>,
    /// The same in degrees, as most teach pendants show them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub q_deg: Option<Vec<f64>>,
    /// Alternatively, the tip in the robot's base frame as reported by the robot (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_m: Option<[f64; 3]>,
}

/// The fitted pose of the table with its residuals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct BaseRegistration {
    /// The table frame in the robot's base frame.
    pub base_from_table: Transform,
    /// The distance of each touched point from its fitted position (mm).
    pub residuals_mm: Vec<f64>,
    /// The root mean square of the residuals (mm).
    pub rms_mm: f64,
}

/// Fits the rigid transform from the table points to the tip's positions (least squares; Kabsch 1976).
///
/// # Errors
/// Fewer than three touched points, all on one line, or one without a tip position or 100 m away.
pub fn base_registration(arm: &Arm, touches: &[TouchedPoint]) -> Result<BaseRegistration> {
    if touches.len() < 3 {
        let needed = "three or more touched points, not on one line";
        return Err(Error::invalid("touches", "count", touches.len(), needed));
    }
    let table: Vec<Vector3<f64>> =
        touches.iter().map(|touch| Vector3::new(touch.table_m[0], touch.table_m[1], 0.0)).collect();
    let base =
        touches.iter().enumerate().map(|(k, touch)| touch.tip_m(arm, k)).collect::<Result<Vec<_>>>()?;
    for (k, (table, base)) in table.iter().zip(&base).enumerate() {
        for (what, point) in [("table_m", table), ("the tip", base)] {
            if !point.iter().all(|x| x.abs() <= FARTHEST_M) {
                let found = format!("{:?}", point.as_slice());
                let needed = format!("numbers of at most {FARTHEST_M} m");
                return Err(Error::invalid(format!("touches[{k}]"), what, found, needed));
            }
        }
    }
    let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let (table_mean, base_mean) = (mean(&table), mean(&base));
    let mut covariance = Matrix3::zeros();
    for (table, base) in table.iter().zip(&base) {
        covariance += (base - base_mean) * (table - table_mean).transpose();
    }
    let svd = covariance.svd(true, true);
    // Points on a line do not determine the rotation about it.
    if svd.singular_values[1] < LINE_FRACTION * svd.singular_values[0] || svd.singular_values[0] <= 0.0 {
        return Err(Error::invalid("touches", "points", "on one line", "points that span the table"));
    }
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return Err(Error::invalid("touches", "points", "not numbers", "points that span the table"));
    };
    let mirror = Vector3::new(1.0, 1.0, (u * v_t).determinant().signum());
    let rotation = Rotation3::from_matrix_unchecked(u * Matrix3::from_diagonal(&mirror) * v_t);
    let shift = base_mean - rotation * table_mean;
    let residuals_mm: Vec<f64> =
        table.iter().zip(&base).map(|(table, base)| (rotation * table + shift - base).norm() * 1e3).collect();
    let square = residuals_mm.iter().map(|r| r * r).sum::<f64>() / residuals_mm.len() as f64;
    let base_from_table = Transform { position_m: shift.into(), rpy_rad: rpy_rad(&rotation) };
    Ok(BaseRegistration { base_from_table, residuals_mm, rms_mm: square.sqrt() })
}

/// No arm or table is as large (m); numbers that are none are not within it either.
const FARTHEST_M: f64 = 100.0;
/// Largest ratio of the second to the first singular value of points on one line.
const LINE_FRACTION: f64 = 1e-3;

impl TouchedPoint {
    /// The tip's position (m, base frame).
    fn tip_m(&self, arm: &Arm, number: usize) -> Result<Vector3<f64>> {
        let owner = format!("touches[{number}]");
        if let Some(base_m) = self.base_m {
            return Ok(base_m.into());
        }
        let from_deg = |q: &Vec<f64>| q.iter().map(|angle| angle.to_radians()).collect();
        let Some(angles) = self.q_rad.clone().or(self.q_deg.as_ref().map(from_deg)) else {
            return Err(Error::invalid(owner, "the tip", "missing", "`q_rad`, `q_deg` or `base_m`"));
        };
        if angles.len() != arm.joint_count() {
            let needed = format!("{}, one per joint", arm.joint_count());
            return Err(Error::invalid(owner, "angles", angles.len(), needed));
        }
        Ok(arm.tip(&angles).translation.vector)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::arm::model::frame::frame;

    fn touched(table_m: [f64; 2], tip: Vector3<f64>) -> TouchedPoint {
        TouchedPoint { table_m, q_rad: None, q_deg: None, base_m: Some(tip.into()) }
    }

    #[test]
    fn a_touched_point_without_numbers_is_refused() {
        for wrong in [f64::NAN, f64::INFINITY, 1e200] {
            let good =
                [[0.1, 0.1], [-0.1, 0.1], [0.1, -0.1]].map(|p| touched(p, Vector3::new(p[0], p[1], 0.0)));
            assert!(base_registration(&arm(), &good).is_ok());
            let mut tip = good.clone();
            tip[1].base_m = Some([wrong, 0.1, 0.0]);
            let mut table = good;
            table[2].table_m[1] = wrong;
            for (touches, named) in [(tip, "touches[1]"), (table, "touches[2]")] {
                let said = base_registration(&arm(), &touches).expect_err("no numbers").to_string();
                assert!(said.contains(named) && said.contains("100 m"), "{said}");
            }
        }
    }

    fn arm() -> Arm {
        Arm::built_in("indy7").expect("built in")
    }

    const POINTS: [[f64; 2]; 4] = [[-0.4, -0.2], [0.4, -0.2], [0.4, 0.2], [-0.3, 0.25]];

    #[test]
    fn exact_touches_recover_the_pose_of_a_tilted_table() {
        let (position_m, rpy) = ([0.5, -0.1, 0.03], [0.01, -0.02, 1.6]);
        let truth = frame(position_m, rpy);
        let touches: Vec<TouchedPoint> = POINTS
            .iter()
            .map(|&[x, y]| touched([x, y], (truth * nalgebra::Point3::new(x, y, 0.0)).coords))
            .collect();
        let fit = base_registration(&arm(), &touches).expect("four points");
        for k in 0..3 {
            let off = (fit.base_from_table.position_m[k] - position_m[k]).abs();
            assert!(off < 1e-12, "position {k} off by {off} m");
            let off = (fit.base_from_table.rpy_rad[k] - rpy[k]).abs();
            assert!(off < 1e-12, "angle {k} off by {off} rad");
        }
        assert!(fit.rms_mm < 1e-9, "{} mm", fit.rms_mm);
    }

    #[test]
    fn a_wrong_touch_increases_the_residuals() {
        let mut touches: Vec<TouchedPoint> =
            POINTS.iter().map(|&[x, y]| touched([x, y], Vector3::new(x, y, 0.0))).collect();
        touches[2].base_m = Some([0.4, 0.2, 0.004]);
        let fit = base_registration(&arm(), &touches).expect("four points");
        assert!(fit.rms_mm > 0.5 && fit.rms_mm < 4.0, "{} mm", fit.rms_mm);
    }

    #[test]
    fn touches_on_one_line_are_refused() {
        let touches: Vec<TouchedPoint> = (0..4)
            .map(|k| touched([0.1 * f64::from(k), 0.0], Vector3::new(0.1 * f64::from(k), 0.0, 0.0)))
            .collect();
        let message = base_registration(&arm(), &touches).expect_err("a line").to_string();
        assert!(message.contains("on one line"), "{message}");
    }

    #[test]
    fn joint_angles_and_reported_positions_give_the_same_pose() {
        let arm = arm();
        let poses = [
            [0.0, -0.3, -1.5, 0.0, -1.2, 0.0],
            [0.5, -0.4, -1.4, 0.1, -1.2, 0.0],
            [-0.4, -0.2, -1.7, 0.0, -1.0, 0.3],
        ];
        let by = |with_angles: bool| {
            let touches: Vec<TouchedPoint> = poses
                .iter()
                .zip(POINTS)
                .map(|(pose, table_m)| {
                    let by_angles =
                        TouchedPoint { table_m, q_rad: Some(pose.to_vec()), q_deg: None, base_m: None };
                    if with_angles { by_angles } else { touched(table_m, arm.tip(pose).translation.vector) }
                })
                .collect();
            base_registration(&arm, &touches).expect("three points")
        };
        assert_eq!(by(true), by(false));
    }
}
