//! How long does the striker take to reach the struck object?
//!
//! A film in which the arm hides the striker shows all the same when the arm begins to move, and the struck object shows the instant of the
//! impact. The distance between the given start and the place of contact over that time is the striker's mean speed.

use crate::estimate::{ClipFit, ClipTracks};
use crate::uncertain::Measured;

/// The standard deviation of the distance from the given start to the place of contact (m): of the start and of both outlines.
const DISTANCE_STD_M: f64 = 5e-4;

/// Largest standard deviation of a mean speed by the instant of the first motion: two frames before the impact.
const MOST_COMMON_STD: f64 = 0.075;

/// A mean speed from the first motion to the impact.
#[derive(Clone, Copy)]
pub(super) struct MeanSpeed {
    /// Its logarithm over the given speed.
    pub log_ratio: Measured,
    /// The part of the standard deviation that may be the same in all films: that of the instant at which the motion begins.
    pub common_std: f64,
    /// The distance from the given start to the place of contact (m).
    pub distance_m: f64,
}

impl MeanSpeed {
    /// The part of the standard deviation that differs from film to film.
    pub(super) fn own_std(&self) -> f64 {
        own_std(self.log_ratio.std, self.common_std)
    }
}

/// The part of a standard deviation beside one that is common to several values.
pub(super) fn own_std(std: f64, common_std: f64) -> f64 {
    (std.powi(2) - common_std.powi(2)).max(0.0).sqrt()
}

/// The mean speed with which the striker reaches the struck object; `None` if the film does not show when it begins to move or when it strikes.
pub(super) fn mean_speed(clip: &ClipTracks, fit: &ClipFit) -> Option<MeanSpeed> {
    let (strike, onset_s) = (clip.strike.as_ref()?, clip.tracks.striker_onset_s?);
    let impact = fit.impacts.first()?;
    let distance_m = impact.striker_distance_m?;
    let duration_s = impact.time.value - onset_s.value;
    let common_std = onset_s.std / duration_s;
    let frame_s = 1.0 / clip.frame_rate_hz()?;
    // Where the impact measures nothing, the fitted one may be a frame too early.
    let instant_std_s = impact.time.std.hypot(if impact.restitution.is_some() { 0.0 } else { frame_s });
    let std = (DISTANCE_STD_M / distance_m).hypot(instant_std_s / duration_s).hypot(common_std);
    let value = (distance_m / duration_s / strike.speed_m_s).ln();
    // A motion that is seen only at the impact is that of the struck object.
    let is_known = duration_s > 0.0 && common_std < MOST_COMMON_STD && value.is_finite() && std.is_finite();
    is_known.then_some(MeanSpeed { log_ratio: Measured { value, std }, common_std, distance_m })
}
