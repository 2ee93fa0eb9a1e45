//! How long was the shutter open?
//!
//! A moving marker is seen at its mean place over the exposure.  Between impacts that is the place at mid-exposure; a
//! frame whose exposure holds an impact is off, by up to some tenths of a millimetre, and so tells the exposure.

use super::fit::Fitted;
use super::initial_guess::frame_s;
use super::motion_model::{Exposure, Model};
use crate::cell::Cell;

/// Exposures that are tried, in frames.
const TRIED_FRAMES: [f64; 10] = [0.0, 0.0625, 0.125, 0.1875, 0.25, 0.3125, 0.375, 0.5, 0.7, 0.9];
/// For every tried exposure its sum of squares, and the number of frames.
pub(crate) type Misfits = ([f64; TRIED_FRAMES.len()], usize);
/// Fewer frames around impacts than this leave the exposure open.
const FRAMES_NEEDED: usize = 8;
/// The exposure is believed if its mean squared residual around impacts is below this many variances.
const BELIEVED: f64 = 6.0;
/// As long as a shutter is usually open if nobody says (frames).
const LONGEST_FRAMES: f64 = 0.5;

/// The exposure that the cell gives; else the frames around impacts count less.
pub(crate) fn told(cell: &Cell, frame_s: f64) -> Exposure {
    cell.camera.exposure_s.map_or(Exposure::UpTo(LONGEST_FRAMES * frame_s), Exposure::Known)
}

/// How badly each of the tried exposures explains a clip's frames around impacts: sums of squares over variances,
/// bounded for outliers, and how many frames there are.
pub(crate) fn misfits(fitted: &Fitted, place_scale: f64) -> Misfits {
    /// A frame that fits none of them says nothing beyond this.
    const MOST: f64 = 25.0;
    let Model { bodies, exposure, .. } = &fitted.model;
    if matches!(exposure, Exposure::Known(_)) {
        return Misfits::default();
    }
    let frame_s = frame_s(bodies);
    let mut squares = [0.0; TRIED_FRAMES.len()];
    let mut frames = 0;
    for (body, path) in bodies.iter().zip(&fitted.paths) {
        let near = |t: f64| path.impacts_s().any(|at| (at - t).abs() < frame_s / 4.0);
        for sight in body.sights.iter().filter(|s| !s.ignored && near(s.time_s)) {
            frames += 1;
            for (sum, tried) in squares.iter_mut().zip(TRIED_FRAMES) {
                let place = path.mean_pose(sight.time_s, tried * frame_s).position;
                let off = (sight.position - place).length() / (sight.std_m * place_scale);
                *sum += (off * off / 2.0).min(MOST);
            }
        }
    }
    (squares, frames)
}

/// The exposure that explains the frames around all impacts best, in frames; `None` if none explains them.
pub(crate) fn found_frames(misfits: &[Misfits]) -> Option<f64> {
    let frames: usize = misfits.iter().map(|(_, n)| n).sum();
    let total = |k: usize| misfits.iter().map(|(squares, _)| squares[k]).sum::<f64>();
    let best = (0..TRIED_FRAMES.len()).min_by(|&p, &q| total(p).total_cmp(&total(q)))?;
    let believed = frames >= FRAMES_NEEDED && total(best) < BELIEVED * frames as f64;
    believed.then_some(TRIED_FRAMES[best])
}

/// The exposure for the final fit of a clip.
pub(crate) fn settled(fitted: &Fitted, found_frames: Option<f64>) -> Exposure {
    match (fitted.model.exposure, found_frames) {
        (Exposure::UpTo(_), Some(frames)) => Exposure::Known(frames * frame_s(&fitted.model.bodies)),
        (exposure, _) => exposure,
    }
}
