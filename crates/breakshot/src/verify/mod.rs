//! Did the strike happen as predicted?
//!
//! Section 6 of the paper: the pairwise distances after a strike, measured in the film and predicted by the simulation
//! (Fig. 17).
//!
//! The prediction starts from the poses of the scene file, as the plan did.  The first frames of the film measure how
//! far the objects were from these poses; a warning names every object for which the difference matters.

mod alignment;
mod approach;
#[cfg(test)]
mod approach_tests;
mod compare;
mod departure;
#[cfg(test)]
mod departure_tests;
mod observed;
mod report;
mod sizes;
mod spread;
mod strike_gaps;
#[cfg(test)]
mod strike_gaps_tests;
mod striker;
#[cfg(test)]
mod striker_tests;
mod table_axes;

pub use observed::{Observed, ObservedPose};
pub use report::{
    Alignment, DistanceErrors, Divergence, GoalCheck, GoalChecks, ObjectDifference, PairDifference, Report,
    SimulatedImpact, Summary,
};

use crate::cell::Cell;
use crate::error::Result;
use crate::estimate::{ClipTracks, Estimation};
use crate::geometry::Pose;
use crate::object::Object;
use crate::scene::Scene;
use crate::warning::Warning;
use approach::MeanSpeed;
use std::collections::BTreeMap;

/// Compares the predicted final poses of the objects of a scene with the observed ones.
///
/// ```
/// use breakshot::geometry::{Point, Pose};
/// use breakshot::scene::Scene;
/// use breakshot::verify::{Observed, ObservedPose, comparison};
///
/// let scene: Scene = serde_json::from_str(r#"{
///     "cell": {"camera": {"scale_px_per_m": 1000.0}, "workspace": {"min_m": [-0.3, -0.3], "max_m": [0.3, 0.3]},
///         "striker": {"shape": {"disc": {"radius_m": 0.015}}, "height_m": 0.08, "speed_range_m_s": [0.05, 1.0]}},
///     "objects": [{"name": "a", "shape": {"disc": {"radius_m": 0.03}}, "height_m": 0.03}],
///     "observed_unix_s": null, "placed": [{"object": "a", "position_m": [0.0, 0.0]}],
///     "walls": [], "keep_out": [], "goal": {}}"#).unwrap();
/// let at = |x_m: f64| ("a".to_owned(), ObservedPose { position: Point::new(x_m, 0.0), yaw_rad: None });
/// let observed = Observed { before: [at(0.0)].into(), after: [at(0.098)].into(), ..Observed::default() };
/// let predicted = [("a".to_owned(), Pose::new(0.1, 0.0, 0.0))].into();
/// let report = comparison(&scene, &predicted, &observed).unwrap();
/// let error_m = report.summary.worst_position_error_m;
/// assert!((error_m - 0.002).abs() < 1e-9, "{error_m} m between the predicted and the observed position");
/// ```
///
/// # Errors
/// An object of the scene without a predicted pose or without a track.
pub fn comparison(scene: &Scene, predicted: &BTreeMap<String, Pose>, observed: &Observed) -> Result<Report> {
    compare::report(scene, predicted, observed)
}

/// Warnings about a campaign whose files do not fit its films: strikers that are seen to move otherwise than given, given strikes that send
/// the struck objects elsewhere, or not so fast, a table frame of the robot with other axes, tags whose sizes do not fit the distances of their
/// centres, outlines that do not touch when the objects meet or are struck, and films that begin after the strike.
///
/// `estimation` is that of the clips.
pub fn campaign_warnings(
    clips: &[ClipTracks],
    estimation: &Estimation,
    cell: &Cell,
    objects: &[Object],
) -> Vec<Warning> {
    let sizes = sizes::findings(clips, &estimation.clips, objects);
    let known = departure::Known { cell, objects, properties: &estimation.properties };
    let cut = departure::cut_films(clips, &estimation.clips);
    let is_cut = |clip: &ClipTracks| cut.iter().any(|warning| warning.clip.as_ref() == Some(&clip.name));
    let mut departing = departure::departing(clips, known);
    departing.retain(|departing| !is_cut(departing.clip));
    // With wrong axes every strike is wrong.
    if let Some(axes) = table_axes::warning(&departing, known) {
        return [vec![axes], sizes.warnings].concat();
    }
    let fits = clips.iter().zip(&estimation.clips);
    let mean_speeds: Vec<Option<MeanSpeed>> =
        fits.map(|(clip, fit)| approach::mean_speed(clip, fit)).collect();
    let striker = striker::findings(clips, &mean_speeds, sizes.scale_error);
    let departures = departure::warnings(&departing, known, &striker);
    let gaps = if sizes.scale_error.is_some() {
        Vec::new()
    } else {
        strike_gaps::warnings(clips, &estimation.clips, objects, &striker)
    };
    [striker.warnings, departures, sizes.warnings, gaps, cut].concat()
}
