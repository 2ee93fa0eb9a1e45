//! How would the fit respond to one more cause of motion?  Score tests: the other parameters are adapted to first order.

use super::fit::{MotionFit, PositionRow};
use crate::geometry::Vec2;
use nalgebra::{DMatrix, DVector};

/// What the residuals of all bodies say about causes of motion that no parameter describes.
#[derive(Clone, Debug)]
pub(crate) struct AddedCauses {
    /// Information about their sizes, the other parameters adapted.
    pub(crate) information: DMatrix<f64>,
    /// The information times the sizes with the least loss.
    pub(crate) gradient: DVector<f64>,
    /// The change of each parameter (row) per size of each cause (column).
    pub(crate) shifts: DMatrix<f64>,
}

impl MotionFit {
    /// The decrease of the loss if the positions were displaced by `lever` times a velocity and the other parameters were
    /// adapted to first order (a score test), and that velocity.
    pub(super) fn score(&self, rows: &[PositionRow], lever: impl Fn(f64) -> f64) -> (f64, Vec2) {
        let mut gain = 0.0;
        let mut jump = [0.0; 2];
        for (axis, jump) in [Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)].into_iter().zip(&mut jump) {
            if let Some((value, variance)) = self.added_parameter(rows, |t| axis * lever(t)) {
                gain += value * value / variance;
                *jump = value;
            }
        }
        (gain, jump.into())
    }

    /// The value of an additional parameter that displaces body `k` by `displacement` per unit, and its standard deviation,
    /// with the other parameters adapted to first order.
    pub(crate) fn response(&self, k: usize, displacement: impl Fn(f64) -> Vec2) -> Option<(f64, f64)> {
        let mut row = 0;
        let rows = (0..=k).map(|j| self.position_rows(j, &mut row)).last()?;
        let (value, variance) = self.added_parameter(&rows, displacement)?;
        Some((value, variance.sqrt()))
    }

    /// The value of an additional parameter that displaces the positions of `rows` by `displacement` per unit, and its
    /// variance; `None` if the other parameters can produce the same displacement.
    fn added_parameter(
        &self,
        rows: &[PositionRow],
        displacement: impl Fn(f64) -> Vec2,
    ) -> Option<(f64, f64)> {
        /// A smaller fraction of the information left by the other parameters is rounding.
        const ROUNDING: f64 = 1e-9;
        let minimum = &self.minimum;
        let mut cross = DVector::zeros(minimum.parameters.len());
        let (mut own, mut gradient) = (0.0, 0.0);
        for &PositionRow { row, time_s, std_m } in rows {
            let slope: [f64; 2] = (displacement(time_s) / -std_m).into();
            let weight = minimum.weights[row];
            for (axis, slope) in slope.into_iter().enumerate() {
                own += weight * slope * slope;
                gradient += weight * slope * minimum.residuals[row].value[axis];
                for (column, sum) in cross.iter_mut().enumerate() {
                    *sum += weight * slope * minimum.jacobian[(2 * row + axis, column)];
                }
            }
        }
        let free = own - (cross.transpose() * &minimum.covariance * &cross)[(0, 0)];
        (free > ROUNDING * own && free > 0.0).then(|| (-gradient / free, 1.0 / free))
    }

    /// What the residuals say about `count` causes; `displace` writes by how much each of them, per unit, displaces a body at a time (s).
    pub(crate) fn added_causes(
        &self,
        count: usize,
        displace: impl Fn(usize, f64, &mut [Vec2]),
    ) -> AddedCauses {
        let minimum = &self.minimum;
        let mut cross = DMatrix::zeros(minimum.parameters.len(), count);
        let (mut own, mut gradient) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let (mut displaced, mut slopes) = (vec![Vec2::ZERO; count], DVector::zeros(count));
        let mut row = 0;
        for body in 0..self.model.bodies.len() {
            for PositionRow { row, time_s, std_m } in self.position_rows(body, &mut row) {
                displaced.fill(Vec2::ZERO);
                displace(body, time_s, &mut displaced);
                let weight = minimum.weights[row];
                for axis in 0..2 {
                    for (slope, &displaced) in slopes.iter_mut().zip(&displaced) {
                        *slope = <[f64; 2]>::from(displaced / -std_m)[axis];
                    }
                    own.ger(weight, &slopes, &slopes, 1.0);
                    gradient.axpy(-weight * minimum.residuals[row].value[axis], &slopes, 1.0);
                    let jacobian = minimum.jacobian.row(2 * row + axis);
                    for (column, slope) in slopes.iter().enumerate().filter(|(_, slope)| **slope != 0.0) {
                        for (parameter, derivative) in jacobian.iter().enumerate() {
                            cross[(parameter, column)] += weight * slope * derivative;
                        }
                    }
                }
            }
        }
        let shifts = -(&minimum.covariance * &cross);
        let information = own + cross.transpose() * &shifts;
        AddedCauses { information, gradient, shifts }
    }
}
