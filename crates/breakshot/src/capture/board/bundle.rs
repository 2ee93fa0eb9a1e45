//! Intrinsics, distortion and the board's poses that fit the measured corners best.
//!
//! Least squares of the reprojection errors (Levenberg-Marquardt) in which the poses are eliminated from the normal equations
//! (Schur complement); each view is weighted by its own noise, and corners far off do not count (Tukey's weights).

use crate::capture::camera::{Extrinsics, Projection};
use crate::capture::lens::Lens;
use crate::capture::pose::{self, Correspondence, FreeParameters};
use crate::cell::Distortion;
use crate::geometry::{Pixel, Point};
use crate::statistics::median;
use nalgebra::{DMatrix, DVector, Matrix6, Rotation3, Vector3, Vector6};

/// A corner of a tag on the board and in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) point: Point,
    pub(super) pixel: Pixel,
}

/// The corners of each view.
pub(super) type Observations = Vec<Vec<Corner>>;

/// A view in the fit.
pub(super) struct FittedView {
    pub(super) corners: Vec<Corner>,
    pub(super) pose: Extrinsics,
    /// The weight of each corner: 1 over the variance of its coordinates (1/px²), 0 for an outlier.
    pub(super) weights: Vec<f64>,
}

/// The result.
pub(super) struct Fit {
    pub(super) lens: Lens,
    pub(super) views: Vec<FittedView>,
}

/// Step of numerical derivatives, relative to the focal length for focal lengths: see `pose`.
const SMALL: f64 = 1e-6;
/// Largest number of steps.
const MOST_STEPS: usize = 60;
/// Relative decrease of the sum of squares below which the fit has converged.
const CONVERGED: f64 = 1e-10;
/// Damping at which no step decreases the sum of squares any more.
const MOST_DAMPING: f64 = 1e10;
/// Number of fits with new weights after each.
const REWEIGHTED: usize = 4;
/// Distance beyond which a corner does not count, in standard deviations of a coordinate: with normal errors one in 10^8 lies there.
const TUKEY: f64 = 6.0;
/// Median of the squared distance in the plane, in variances of a coordinate: 2 ln 2.
const MEDIAN_SQUARED: f64 = 1.386_294_361_119_890_6;
/// Smallest noise of a view (px), so that no view of few corners rules.
const LEAST_NOISE_PX: f64 = 0.01;

/// fx fy cx cy and the coefficients.
pub(super) fn parameters(lens: &Lens) -> Vec<f64> {
    let ([fx, fy], [cx, cy]) = (lens.focal_px(), lens.center_px());
    [&[fx, fy, cx, cy], lens.distortion().coefficients()].concat()
}

/// The lens of the same model with these parameters; `None` for a focal length that is not positive.
fn lens_of(lens: &Lens, parameters: &[f64]) -> Option<Lens> {
    let [fx, fy, cx, cy, ref coefficients @ ..] = *parameters else { return None };
    let distortion = Distortion::new(lens.distortion().model(), coefficients).ok()?;
    (fx > 0.0 && fy > 0.0 && fx.is_finite() && fy.is_finite() && cx.is_finite() && cy.is_finite())
        .then(|| Lens::new([fx, fy], [cx, cy], distortion))
}

/// The lenses whose parameter `k` is larger and smaller by a small step, and the step.
pub(super) fn neighbours(lens: &Lens, k: usize) -> Option<([Lens; 2], f64)> {
    let mut values = parameters(lens);
    let step = if k < 4 { SMALL * values[0] } else { SMALL };
    let value = values[k];
    let mut moved = |by: f64| {
        values[k] = value + by;
        lens_of(lens, &values)
    };
    Some(([moved(step)?, moved(-step)?], step))
}

pub(super) fn pixel(lens: &Lens, pose: &Extrinsics, point: Point) -> Option<Pixel> {
    let p = pose.rotation() * Vector3::new(point.x, point.y, 0.0) + pose.translation_m();
    (p.z > 0.0).then(|| lens.pixel_from_ray([p.x / p.z, p.y / p.z])).flatten()
}

fn moved(pose: &Extrinsics, by: &Vector6<f64>) -> Extrinsics {
    let small = Rotation3::new(Vector3::new(by[0], by[1], by[2]));
    Extrinsics::new(&(small.matrix() * pose.rotation()), &(pose.translation_m() + by.fixed_rows::<3>(3)))
}

/// The normal equations of one view: of the lens, of its pose, and between them.
pub(super) struct Block {
    pub(super) lens: DMatrix<f64>,
    pub(super) mixed: DMatrix<f64>,
    pub(super) pose: Matrix6<f64>,
    pub(super) lens_gradient: DVector<f64>,
    pub(super) pose_gradient: Vector6<f64>,
}

impl Block {
    /// The block of a view; the lens has the parameters `free` and their neighbours.
    pub(super) fn of(view: &FittedView, lens: &Lens, around: &[([Lens; 2], f64)]) -> Option<Self> {
        let n = around.len();
        let mut block = Self {
            lens: DMatrix::zeros(n, n),
            mixed: DMatrix::zeros(n, 6),
            pose: Matrix6::zeros(),
            lens_gradient: DVector::zeros(n),
            pose_gradient: Vector6::zeros(),
        };
        let poses: Vec<[Extrinsics; 2]> =
            (0..6).map(|k| [SMALL, -SMALL].map(|step| moved(&view.pose, &(Vector6::ith(k, step))))).collect();
        let (mut by_lens, mut by_pose) = (DMatrix::zeros(2, n), nalgebra::SMatrix::<f64, 2, 6>::zeros());
        for (corner, &weight) in view.corners.iter().zip(&view.weights).filter(|(_, weight)| **weight > 0.0) {
            let predicted = pixel(lens, &view.pose, corner.point)?;
            let residual = nalgebra::Vector2::new(corner.pixel.x - predicted.x, corner.pixel.y - predicted.y);
            for (k, ([up, down], step)) in around.iter().enumerate() {
                let (up, down) =
                    (pixel(up, &view.pose, corner.point)?, pixel(down, &view.pose, corner.point)?);
                by_lens[(0, k)] = (up.x - down.x) / (2.0 * step);
                by_lens[(1, k)] = (up.y - down.y) / (2.0 * step);
            }
            for (k, [up, down]) in poses.iter().enumerate() {
                let (up, down) = (pixel(lens, up, corner.point)?, pixel(lens, down, corner.point)?);
                by_pose[(0, k)] = (up.x - down.x) / (2.0 * SMALL);
                by_pose[(1, k)] = (up.y - down.y) / (2.0 * SMALL);
            }
            block.lens += by_lens.transpose() * &by_lens * weight;
            block.mixed += by_lens.transpose() * by_pose * weight;
            block.pose += by_pose.transpose() * by_pose * weight;
            block.lens_gradient += by_lens.transpose() * residual * weight;
            block.pose_gradient += by_pose.transpose() * residual * weight;
        }
        Some(block)
    }

    /// What the view adds to the normal equations of the lens alone, its pose being eliminated: matrix and gradient.
    pub(super) fn reduced(&self, damping: f64) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let pose = self.damped_pose(damping)?;
        let mut normal = self.lens.clone();
        for k in 0..normal.nrows() {
            normal[(k, k)] *= 1.0 + damping;
        }
        Some((
            normal - &self.mixed * pose * self.mixed.transpose(),
            &self.lens_gradient - &self.mixed * (pose * self.pose_gradient),
        ))
    }

    /// The inverse of the pose's part.
    fn damped_pose(&self, damping: f64) -> Option<Matrix6<f64>> {
        let mut pose = self.pose;
        for k in 0..6 {
            pose[(k, k)] *= 1.0 + damping;
        }
        pose.try_inverse()
    }

    fn pose_step(&self, lens_step: &DVector<f64>, damping: f64) -> Option<Vector6<f64>> {
        let rest = self.pose_gradient - self.mixed.transpose() * lens_step;
        Some(self.damped_pose(damping)? * Vector6::from_column_slice(rest.as_slice()))
    }
}

/// The solution of symmetric equations whose unknowns have different scales.
pub(super) fn scaled_inverse(normal: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale: Vec<f64> = normal.diagonal().iter().map(|v| v.sqrt()).collect();
    let n = normal.nrows();
    let scaled = DMatrix::from_fn(n, n, |i, k| normal[(i, k)] / (scale[i] * scale[k]));
    let inverse = scaled.cholesky()?.inverse();
    let inverse = DMatrix::from_fn(n, n, |i, k| inverse[(i, k)] / (scale[i] * scale[k]));
    inverse.iter().all(|v| v.is_finite()).then_some(inverse)
}

/// The weighted sum of squares; `None` for a corner that the lens does not show.
fn cost(lens: &Lens, views: &[FittedView]) -> Option<f64> {
    let mut sum = 0.0;
    for view in views {
        for (corner, weight) in view.corners.iter().zip(&view.weights).filter(|(_, weight)| **weight > 0.0) {
            let predicted = pixel(lens, &view.pose, corner.point)?;
            sum += weight * predicted.distance_px(corner.pixel).powi(2);
        }
    }
    sum.is_finite().then_some(sum)
}

impl Fit {
    /// The blocks of all views, by the parameters with these indices.
    pub(super) fn blocks(&self, free: &[usize]) -> Option<Vec<Block>> {
        let around: Vec<_> = free.iter().map(|&k| neighbours(&self.lens, k)).collect::<Option<_>>()?;
        self.views.iter().map(|view| Block::of(view, &self.lens, &around)).collect()
    }

    /// The lens and the poses after a step; `None` where the equations cannot be solved.
    fn stepped(&self, blocks: &[Block], free: &[usize], damping: f64) -> Option<(Lens, Vec<Extrinsics>)> {
        let n = free.len();
        let (mut normal, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for block in blocks {
            let (matrix, vector) = block.reduced(damping)?;
            normal += matrix;
            gradient += vector;
        }
        let step = scaled_inverse(&normal)? * gradient;
        let mut values = parameters(&self.lens);
        for (&k, by) in free.iter().zip(step.iter()) {
            values[k] += by;
        }
        let poses = blocks
            .iter()
            .zip(&self.views)
            .map(|(block, view)| block.pose_step(&step, damping).map(|by| moved(&view.pose, &by)));
        Some((lens_of(&self.lens, &values)?, poses.collect::<Option<_>>()?))
    }

    /// Least squares with the present weights.
    fn refine(&mut self, free: &[usize]) -> Option<()> {
        let mut damping = 1e-3;
        let mut before = cost(&self.lens, &self.views)?;
        for _ in 0..MOST_STEPS {
            let blocks = self.blocks(free)?;
            let mut after = before;
            while damping < MOST_DAMPING {
                if let Some((lens, poses)) = self.stepped(&blocks, free, damping) {
                    let old: Vec<_> = self.views.iter().map(|view| view.pose).collect();
                    for (view, pose) in self.views.iter_mut().zip(poses) {
                        view.pose = pose;
                    }
                    if let Some(sum) = cost(&lens, &self.views).filter(|sum| *sum <= before) {
                        (self.lens, after) = (lens, sum);
                        damping = (damping / 10.0).max(1e-12);
                        break;
                    }
                    for (view, pose) in self.views.iter_mut().zip(old) {
                        view.pose = pose;
                    }
                }
                damping *= 10.0;
            }
            let done = damping >= MOST_DAMPING || before - after <= CONVERGED * before;
            before = after;
            if done {
                break;
            }
        }
        Some(())
    }

    /// New weights: the noise of each view from the median of its errors, and Tukey's weights beyond it.
    fn reweight(&mut self) {
        for view in &mut self.views {
            let errors: Vec<f64> = view
                .corners
                .iter()
                .map(|c| pixel(&self.lens, &view.pose, c.point).map_or(f64::MAX, |p| p.distance_px(c.pixel)))
                .collect();
            let count = errors.len() as f64;
            // A pose takes six of the view's coordinates.
            let freedom = count / (count - 3.0).max(1.0);
            let middle = median(errors.iter().map(|e| e * e)).unwrap_or(0.0);
            let variance = (middle / MEDIAN_SQUARED * freedom).max(LEAST_NOISE_PX.powi(2));
            let weight = |error: f64| {
                let relative = error * error / (TUKEY * TUKEY * variance);
                if relative < 1.0 { (1.0 - relative).powi(2) / variance } else { 0.0 }
            };
            view.weights = errors.into_iter().map(weight).collect();
        }
    }
}

/// The view's pose under a lens.
fn posed(lens: &Lens, corners: &[Corner]) -> Option<pose::PoseFit> {
    let correspondences: Vec<_> = corners
        .iter()
        .map(|corner| Correspondence { point: corner.point, pixel: corner.pixel, std_px: 1.0 })
        .collect();
    pose::pose(lens, &correspondences, FreeParameters::Pose)
}

/// How badly a lens fits views with poses of their own: the sum of their median squared errors (px²); `None` if it shows none of them.
pub(super) fn pose_cost(lens: &Lens, all: &[Vec<Corner>]) -> Option<f64> {
    let costs: Vec<f64> = all
        .iter()
        .map(|corners| posed(lens, corners).map_or(f64::MAX, |fit| fit.chi2 / corners.len() as f64))
        .collect();
    median(costs).filter(|cost| *cost < f64::MAX)
}

/// The lens and the poses that fit the corners best, from a first lens; `None` where they do not determine them.
pub(super) fn fitted(start: &Lens, all: Observations) -> Option<Fit> {
    let views = all.into_iter().filter_map(|corners| {
        let Projection::Space { pose, .. } = posed(start, &corners)?.projection else { return None };
        let weights = vec![1.0; corners.len()];
        Some(FittedView { corners, pose, weights })
    });
    let mut fit = Fit { lens: start.clone(), views: views.collect() };
    let count = parameters(start).len();
    // First focal lengths, centre and the two leading coefficients: the others follow from near the solution.
    fit.reweight();
    fit.refine(&(0..6).collect::<Vec<_>>())?;
    for _ in 0..REWEIGHTED {
        fit.reweight();
        fit.refine(&(0..count).collect::<Vec<_>>())?;
    }
    Some(fit)
}
