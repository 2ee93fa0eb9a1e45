//! How long was the shutter open?
//!
//! A moving marker is observed at its mean position over the exposure.  Between impacts that is the position at
//! mid-exposure; in a frame whose exposure contains an impact it differs by up to some tenths of a millimetre.  The frames
//! around the impacts of all clips therefore determine the exposure.
//!
//! They do so although the cell states it: where the velocity jumps, the image of a marker is no straight blur, and its position is
//! located between that at mid-exposure and the mean.  The stated exposure says which frames are uncertain for that.

use super::fit::MotionFit;
use super::initial_guess::frame_s;
use super::motion_model::{Exposure, MotionModel};
use crate::cell::Cell;
use serde::{Deserialize, Serialize};

/// Candidate exposures, in frames.
const CANDIDATE_FRAMES: [f64; 10] = [0.0, 0.0625, 0.125, 0.1875, 0.25, 0.3125, 0.375, 0.5, 0.7, 0.9];
const CANDIDATES: usize = CANDIDATE_FRAMES.len();
/// Fewer frames around impacts than this do not determine the exposure.
const MIN_FRAMES: usize = 8;
/// The best candidate is accepted if its mean squared residual around impacts is below this many variances.
const MAX_MEAN_CHI2: f64 = 6.0;
/// The longest exposure of usual cameras, assumed where the cell does not specify it (frames).
const LONGEST_FRAMES: f64 = 0.5;

/// How well each candidate exposure explains the frames around the impacts of a clip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "([f64; CANDIDATES], usize)", into = "([f64; CANDIDATES], usize)")]
pub(crate) struct ExposureChi2 {
    /// For each candidate the sum of squared residuals over their variances.
    chi2: [f64; CANDIDATES],
    /// The number of frames in the sums.
    frames: usize,
}

impl From<([f64; CANDIDATES], usize)> for ExposureChi2 {
    fn from((chi2, frames): ([f64; CANDIDATES], usize)) -> Self {
        Self { chi2, frames }
    }
}

impl From<ExposureChi2> for ([f64; CANDIDATES], usize) {
    fn from(value: ExposureChi2) -> Self {
        (value.chi2, value.frames)
    }
}

/// The exposure up to which frames around impacts are uncertain: as the cell states it, else half a frame; none in a cell without
/// camera, whose tracks are positions at instants.
pub(crate) fn specified(cell: &Cell, frame_s: f64) -> Exposure {
    if !cell.has_camera() {
        return Exposure::Known(0.0);
    }
    Exposure::UpTo(cell.camera.exposure_s.unwrap_or(LONGEST_FRAMES * frame_s))
}

/// For each candidate exposure the chi-square of a clip's frames around impacts, bounded for outliers.
///
/// No frames if the exposure is known.
pub(crate) fn chi2_by_exposure(fitted: &MotionFit, position_scale: f64) -> ExposureChi2 {
    /// A frame that contradicts all candidates must not outweigh the others.
    const MAX_CHI2: f64 = 25.0;
    let MotionModel { bodies, exposure, .. } = &fitted.model;
    let mut sums = ExposureChi2::default();
    if matches!(exposure, Exposure::Known(_)) {
        return sums;
    }
    let frame_s = frame_s(bodies);
    for (body, path) in bodies.iter().zip(&fitted.paths) {
        let near_impact = |t: f64| path.impacts_s().any(|at| (at - t).abs() < frame_s / 4.0);
        for observation in body.observations.iter().filter(|o| !o.excluded && near_impact(o.time_s)) {
            sums.frames += 1;
            for (sum, candidate) in sums.chi2.iter_mut().zip(CANDIDATE_FRAMES) {
                let position = path.mean_pose(observation.time_s, candidate * frame_s).position;
                let residual =
                    (observation.position - position).length() / (observation.std_m * position_scale);
                *sum += (residual * residual / 2.0).min(MAX_CHI2);
            }
        }
    }
    sums
}

/// The exposure (in frames) that explains the frames around the impacts of all clips best; `None` if too few frames
/// contain an impact or no candidate explains them.
pub(crate) fn best_frames(clips: &[ExposureChi2]) -> Option<f64> {
    let frames: usize = clips.iter().map(|clip| clip.frames).sum();
    let total = |k: usize| clips.iter().map(|clip| clip.chi2[k]).sum::<f64>();
    let best = (0..CANDIDATES).min_by(|&p, &q| total(p).total_cmp(&total(q)))?;
    let accepted = frames >= MIN_FRAMES && total(best) < MAX_MEAN_CHI2 * frames as f64;
    accepted.then_some(CANDIDATE_FRAMES[best])
}

/// The exposure for the final fit of a clip: as known for this clip, else as all clips together show it.
pub(crate) fn resolved(fitted: &MotionFit, best_frames: Option<f64>) -> Exposure {
    match (fitted.model.exposure, best_frames) {
        (Exposure::UpTo(_), Some(frames)) => Exposure::Known(frames * frame_s(&fitted.model.bodies)),
        (exposure, _) => exposure,
    }
}
