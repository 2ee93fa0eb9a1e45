//! The covariance of the lens, from what parts of the film change.

use super::bundle::{Fit, parameters, scaled_inverse};
use nalgebra::{DMatrix, DVector};

/// Number of parts of a film, at most: each is long against the time in which a hand moves the board noticeably.
const PARTS: usize = 12;

/// The covariance of a lens's parameters.
pub(super) struct LensCovariance {
    pub(super) matrix: DMatrix<f64>,
    /// Degrees of freedom of the standard errors: one less than the parts of the film.
    pub(super) freedom: usize,
}

/// The covariance of the parameters by the jackknife over parts of the film: each is left out in turn, with one Newton step of
/// the equations from which the poses are eliminated (Efron and Stein, 1981; of blocks: Künsch, 1989).
///
/// The errors of a view's corners have common causes (blur, light), and so have those of successive views, which look alike and
/// whose coding is common: a covariance of independent corners would ignore that. `None` where without a part
/// a parameter is undetermined.
pub(super) fn of_the_lens(fit: &Fit) -> Option<LensCovariance> {
    let n = parameters(&fit.lens).len();
    let blocks = fit.blocks(&(0..n).collect::<Vec<_>>())?;
    let parts = PARTS.min(blocks.len());
    let mut sums = vec![(DMatrix::zeros(n, n), DVector::zeros(n)); parts];
    for (k, block) in blocks.iter().enumerate() {
        let (normal, gradient) = block.reduced(0.0)?;
        let part = &mut sums[k * parts / blocks.len()];
        part.0 += normal;
        part.1 += gradient;
    }
    let total = sums.iter().fold(DMatrix::zeros(n, n), |sum, (normal, _)| sum + normal);
    let mut matrix = DMatrix::zeros(n, n);
    for (normal, gradient) in &sums {
        let change = scaled_inverse(&(&total - normal))? * gradient;
        matrix += &change * change.transpose();
    }
    let count = parts as f64;
    Some(LensCovariance { matrix: matrix * ((count - 1.0) / count), freedom: parts - 1 })
}
