//! How did the objects of one clip move?
//!
//! The motion of a clip is fitted to its tracks as a whole: rest, slide, impact, slide, rest.  If a body decelerates
//! otherwise than by Coulomb friction, the motion is fitted in short windows around the impacts instead.

pub(crate) mod added_parameters;
pub(crate) mod consistency;
pub(crate) mod exposure;
pub(crate) mod fit;
pub(crate) mod impact_windows;
pub(crate) mod initial_guess;
pub(crate) mod least_squares;
pub(crate) mod motion_model;
pub(crate) mod result;
pub(crate) mod sliding;
pub(crate) mod striker;

use crate::cell::Cell;
use crate::error::Result;
use crate::estimate::clip_tracks::ClipTracks;
use crate::object::{self, Object};
use exposure::ExposureChi2;
use fit::{MotionFit, NoiseStatistics};
use initial_guess::InitialGuess;
use motion_model::Exposure;
use result::Measured;
use std::collections::BTreeMap;
use striker::path::StrikerPath;

/// The fitted motion of one clip.
#[derive(Clone, Debug)]
pub(crate) struct ClipEstimate {
    /// The fit of the whole clip.
    pub(crate) whole: MotionFit,
    /// Fits of short windows around the impacts; empty unless a body decelerates otherwise than by Coulomb friction.
    windows: Vec<MotionFit>,
    /// The striker's prescribed motion; `None` in a clip without a strike.
    pub(crate) striker: Option<StrikerPath>,
}

impl ClipEstimate {
    /// The first fit, weighted by the noise that the tracks claim.
    ///
    /// # Errors
    /// A track of an object that is not among `objects`.
    pub(crate) fn new(clip: &ClipTracks, cell: &Cell, objects: &[Object]) -> Result<Self> {
        let kinds = (clip.tracks.tracks.iter())
            .map(|track| object::find(objects, &track.object, &clip.name))
            .collect::<Result<Vec<_>>>()?;
        let striker = clip.strike.as_ref().map(|strike| StrikerPath::new(&cell.striker, strike));
        let mut bodies = initial_guess::bodies(&clip.tracks.tracks, &kinds);
        let unbinned = bodies.clone();
        let specified = exposure::specified(cell, initial_guess::frame_s(&bodies));
        let exposure = initial_guess::bin(&mut bodies).map_or(specified, Exposure::Known);
        let guess = InitialGuess::new(bodies, striker.as_ref(), exposure);
        let mut whole = MotionFit::new(guess, striker.as_ref());
        whole.non_coulomb |= !impact_windows::non_coulomb_bodies(&whole).is_empty();
        let windows = if whole.non_coulomb {
            impact_windows::fits(unbinned, striker.as_ref(), specified)
        } else {
            Vec::new()
        };
        Ok(Self { whole, windows, striker })
    }

    /// The fits that describe the impacts: that of the whole clip, or those of the windows.
    pub(crate) fn impact_fits(&self) -> &[MotionFit] {
        if self.whole.non_coulomb { &self.windows } else { std::slice::from_ref(&self.whole) }
    }

    /// Squared residuals over the variances that the tracks claim, summed over the fits that describe the impacts.
    pub(crate) fn noise(&self) -> NoiseStatistics {
        let fits = self.impact_fits().iter();
        fits.fold(NoiseStatistics::default(), |sum, fit| NoiseStatistics {
            position: sum.position.plus(fit.noise.position),
            yaw: sum.yaw.plus(fit.noise.yaw),
        })
    }

    /// The standard deviation of the noise of a yaw with which the fits weight it (rad).
    pub(crate) fn yaw_std_rad(&self) -> f64 {
        self.whole.model.yaw_std_rad
    }

    /// For every candidate exposure the chi-square of the frames around impacts.
    pub(crate) fn chi2_by_exposure(&self, position_scale: f64) -> ExposureChi2 {
        if self.whole.non_coulomb {
            ExposureChi2::default()
        } else {
            exposure::chi2_by_exposure(&self.whole, position_scale)
        }
    }

    /// The final fits, with the noise and the exposure (in frames) that all clips together give.
    ///
    /// The scales multiply the standard deviations of positions and yaws.
    pub(crate) fn refitted(&self, position_scale: f64, yaw_scale: f64, exposure_frames: Option<f64>) -> Self {
        let refitted = |fit: &MotionFit| {
            fit.refitted(position_scale, yaw_scale, exposure::resolved(fit, exposure_frames))
        };
        let (whole, windows) = if self.whole.non_coulomb {
            let whole = self.whole.with_noise_scaled(position_scale, yaw_scale);
            (whole, self.windows.iter().map(refitted).collect())
        } else {
            (refitted(&self.whole), Vec::new())
        };
        Self { whole, windows, striker: self.striker.clone() }
    }

    /// The fit with the frictions that other clips let expect of each object as priors; `None` if it has none, or friction is not Coulomb's.
    pub(crate) fn with_expected_frictions(&self, expected: &BTreeMap<String, Measured>) -> Option<Self> {
        if self.whole.non_coulomb {
            return None;
        }
        let whole = self.whole.with_expected_frictions(expected)?;
        Some(Self { whole, windows: Vec::new(), striker: self.striker.clone() })
    }
}
