//! Nonlinear least squares with few parameters: Levenberg-Marquardt with a robust loss.

use nalgebra::{DMatrix, DVector};

/// One or two residuals over their standard deviations, with a common robust weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Residual {
    pub(crate) value: [f64; 2],
    /// Whether the loss is robust, as of a measurement that may be an outlier; a prior is quadratic.
    pub(crate) robust: bool,
}

/// A minimum of the loss.
#[derive(Clone, Debug)]
pub(crate) struct Minimum {
    pub(crate) parameters: Vec<f64>,
    pub(crate) loss: f64,
    pub(crate) residuals: Vec<Residual>,
    /// The weight of each residual in the robust loss, 1 for a quadratic one.
    pub(crate) weights: Vec<f64>,
    /// The derivatives of the residuals by the parameters, two rows per residual.
    pub(crate) jacobian: DMatrix<f64>,
    /// The covariance of the parameters, if the standard deviations of the residuals are as claimed.
    pub(crate) covariance: DMatrix<f64>,
}

/// The scale of the soft-L1 loss in standard deviations: beyond it the loss grows linearly.  Costs 2 % of efficiency for
/// normal noise.
const ROBUST_SCALE: f64 = 3.0;
const ITERATIONS: usize = 60;
/// With more damping than this the steps are too short to lower the loss.
const MAX_DAMPING: f64 = 1e9;
/// The iteration ends when a step lowers the loss by less than this fraction of the tolerance.
const MIN_PROGRESS: f64 = 1e-3;
/// Tolerance of a final fit: the iteration ends when a full step would lower the loss by less than this; the parameters are
/// then within a hundredth of their standard deviations of the minimum.
pub(crate) const FINAL: f64 = 1e-4;
/// Tolerance while the sequence of impacts is not yet decided.
pub(crate) const INTERMEDIATE: f64 = 1e-2;
/// Tolerance for comparing initial guesses, whose losses differ by many variances.
pub(crate) const COARSE: f64 = 1.0;

impl Residual {
    /// Its contribution to the loss: squared, or soft-L1 if robust.
    pub(crate) fn loss(&self) -> f64 {
        self.loss_and_weight().0
    }

    /// Its contribution to the loss, and its weight in the normal equations.
    fn loss_and_weight(&self) -> (f64, f64) {
        let squared = self.value[0].powi(2) + self.value[1].powi(2);
        if !self.robust {
            return (squared, 1.0);
        }
        let scale = ROBUST_SCALE * ROBUST_SCALE;
        let root = (1.0 + squared / scale).sqrt();
        (2.0 * scale * (root - 1.0), 1.0 / root)
    }
}

/// Residuals as a function of the parameters.
pub(crate) trait Problem {
    /// All residuals.
    fn residuals(&self, parameters: &[f64]) -> Vec<Residual>;

    /// Calls `changed` with the index and value of every residual that may depend on the parameter at `column`.
    fn residuals_of(&self, parameters: &[f64], column: usize, changed: impl FnMut(usize, Residual));
}

/// The minimum of the loss that Levenberg-Marquardt reaches from `start`.
///
/// `steps` are the parameters' steps for central differences.  If the normal equations are singular, the covariance is NaN.
pub(crate) fn minimum(start: Vec<f64>, steps: &[f64], tolerance: f64, problem: &impl Problem) -> Minimum {
    let residuals = |parameters: &[f64]| problem.residuals(parameters);
    let total = |all: &[Residual]| all.iter().map(Residual::loss).sum::<f64>();
    let mut parameters = start;
    let mut current = residuals(&parameters);
    let mut loss = total(&current);
    let mut damping = 1e-3;
    for _ in 0..ITERATIONS {
        let (normal, gradient, _) = normal_equations(&parameters, steps, problem, &current);
        // The decrease of the loss by a full step if the residuals were linear
        let decrease = normal.clone().cholesky().map(|factor| gradient.dot(&factor.solve(&gradient)));
        if decrease.is_some_and(|decrease| decrease < tolerance) {
            break;
        }

        // The first step that lowers the loss, with more damping after each that does not
        let mut improved = None;
        while improved.is_none() && damping < MAX_DAMPING {
            let mut damped = normal.clone();
            for k in 0..damped.nrows() {
                damped[(k, k)] *= 1.0 + damping;
            }
            let trial = damped.cholesky().map(|factor| {
                let step = factor.solve(&gradient);
                parameters.iter().zip(step.iter()).map(|(p, s)| p - s).collect::<Vec<_>>()
            });
            improved = trial.and_then(|trial| {
                let values = residuals(&trial);
                let trial_loss = total(&values);
                (trial_loss < loss).then_some((trial, values, trial_loss))
            });
            damping *= if improved.is_some() { 0.2 } else { 5.0 };
        }
        let Some((trial, values, trial_loss)) = improved else { break };
        let change = loss - trial_loss;
        (parameters, current, loss) = (trial, values, trial_loss);
        damping = damping.max(1e-9);
        if change < tolerance * MIN_PROGRESS {
            break;
        }
    }

    // The covariance at the minimum
    let (normal, _, jacobian) = normal_equations(&parameters, steps, problem, &current);
    let size = normal.nrows();
    let covariance = normal
        .cholesky()
        .map_or_else(|| DMatrix::from_element(size, size, f64::NAN), |factor| factor.inverse());
    let weights = current.iter().map(|r| r.loss_and_weight().1).collect();
    Minimum { parameters, loss, residuals: current, weights, jacobian, covariance }
}

/// `JᵀWJ`, `JᵀWr` and `J` (central differences).
fn normal_equations(
    parameters: &[f64],
    steps: &[f64],
    problem: &impl Problem,
    current: &[Residual],
) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>) {
    let jacobian = jacobian(parameters, steps, problem, current.len());
    let mut weighted = jacobian.clone();
    let mut values = DVector::zeros(2 * current.len());
    for (k, residual) in current.iter().enumerate() {
        let weight = residual.loss_and_weight().1;
        for axis in 0..2 {
            values[2 * k + axis] = residual.value[axis];
            weighted.row_mut(2 * k + axis).scale_mut(weight);
        }
    }
    (product(&jacobian, &weighted), weighted.tr_mul(&values), jacobian)
}

/// `JᵀWJ` from `J` and `WJ`, skipping blocks of rows in which a parameter has no effect.
fn product(jacobian: &DMatrix<f64>, weighted: &DMatrix<f64>) -> DMatrix<f64> {
    const ROWS: usize = 16;
    let (rows, columns) = jacobian.shape();
    if rows == 0 {
        return DMatrix::zeros(columns, columns);
    }
    let [own, other]: [Vec<&[f64]>; 2] =
        [jacobian, weighted].map(|matrix| matrix.as_slice().chunks(rows).collect());
    let affected =
        |column: &&[f64]| column.chunks(ROWS).map(|block| block.iter().any(|v| *v != 0.0)).collect();
    let nonzero: Vec<Vec<bool>> = own.iter().map(affected).collect();
    let mut product = DMatrix::zeros(columns, columns);
    for c in 0..columns {
        for r in 0..=c {
            let blocks = own[r].chunks(ROWS).zip(other[c].chunks(ROWS));
            let both = nonzero[r].iter().zip(&nonzero[c]).map(|(r, c)| *r && *c);
            let sum = blocks.zip(both).filter(|(_, both)| *both).map(|((a, b), _)| dot(a, b)).sum();
            product[(r, c)] = sum;
            product[(c, r)] = sum;
        }
    }
    product
}

/// The scalar product in four independent sums, which a processor adds in parallel.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (fours_a, fours_b) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = fours_a.remainder().iter().zip(fours_b.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; 4];
    for (a, b) in fours_a.zip(fours_b) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

fn jacobian(parameters: &[f64], steps: &[f64], problem: &impl Problem, count: usize) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(2 * count, parameters.len());
    let mut moved = parameters.to_vec();
    for (column, step) in steps.iter().enumerate() {
        for (to, sign) in [(parameters[column] + step, 1.0), (parameters[column] - step, -1.0)] {
            moved[column] = to;
            problem.residuals_of(&moved, column, |k, residual| {
                for axis in 0..2 {
                    jacobian[(2 * k + axis, column)] += sign * residual.value[axis] / (2.0 * step);
                }
            });
        }
        moved[column] = parameters[column];
    }
    jacobian
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A problem in which every residual may depend on every parameter.
    struct Plain<F>(F);

    impl<F: Fn(&[f64]) -> Vec<Residual>> Problem for Plain<F> {
        fn residuals(&self, parameters: &[f64]) -> Vec<Residual> {
            self.0(parameters)
        }

        fn residuals_of(&self, parameters: &[f64], _: usize, mut changed: impl FnMut(usize, Residual)) {
            self.0(parameters).into_iter().enumerate().for_each(|(k, r)| changed(k, r));
        }
    }

    fn least(start: Vec<f64>, residuals: impl Fn(&[f64]) -> Vec<Residual>) -> Minimum {
        let steps = vec![1e-6; start.len()];
        minimum(start, &steps, 1e-20, &Plain(residuals))
    }

    fn line(data: &[(f64, f64)]) -> Minimum {
        least(vec![0.0, 0.0], |p| {
            data.iter().map(|&(x, y)| Residual { value: [y - p[0] - p[1] * x, 0.0], robust: true }).collect()
        })
    }

    #[test]
    fn a_straight_line_is_fitted_exactly_with_the_textbook_covariance() {
        let data: Vec<_> = (0..5).map(|k| (f64::from(k), 2.0 + 0.5 * f64::from(k))).collect();
        let fit = line(&data);
        assert!((fit.parameters[0] - 2.0).abs() < 1e-8 && (fit.parameters[1] - 0.5).abs() < 1e-8);
        // Variance of the slope: 1 / sum (x - 2)^2 = 1 / 10.
        assert!((fit.covariance[(1, 1)] - 0.1).abs() < 1e-6, "{}", fit.covariance[(1, 1)]);
    }

    #[test]
    fn an_outlier_of_a_hundred_deviations_moves_a_line_by_less_than_two() {
        let mut data: Vec<_> = (0..21).map(|k| (f64::from(k), 1.0)).collect();
        data[10].1 += 100.0;
        assert!((line(&data).parameters[0] - 1.0).abs() < 2.0);
    }

    #[test]
    fn a_parameter_without_any_residual_stays_finite() {
        let fit = least(vec![1.0, 1.0], |p| vec![Residual { value: [p[0] - 3.0, 0.0], robust: false }]);
        assert!(fit.parameters.iter().all(|p| p.is_finite()));
    }
}
