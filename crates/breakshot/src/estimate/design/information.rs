//! Which information would a candidate clip add?
//!
//! Every candidate is simulated with the estimated properties and fitted like a filmed clip.  The covariance of the fit at the
//! learned noise, plus the variation from clip to clip, gives a linear measurement model for the update of the prior.

use super::experiment::{Experiment, Setup};
use super::prior::{Parameter, Prior};
use super::sensitivity::fastest_m_s;
use super::simulated_clip::SimulatedCamera;
use crate::error::Result;
use crate::estimate::clip::ClipEstimate;
use crate::estimate::clip::exposure;
use crate::estimate::joint::mass_network;
use crate::estimate::joint::means;
use crate::estimate::measure::measurements::Measurements;
use crate::estimate::measure::quantity::{KINDS, Quantity};
use crate::estimate::measure::restitution::DOUBLE_CONTACT_STD;
use crate::estimate::measure::{self, ClipMeasurements};
use crate::object::kind;
use crate::statistics::median;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// An experiment and its measurement model: the measurements are `rows` times the parameters, plus noise.
pub(crate) struct CandidateClip {
    pub(crate) experiment: Experiment,
    /// How often it has been advised.
    pub(crate) advised: usize,
    rows: DMatrix<f64>,
    /// Covariance of the noise.
    noise: DMatrix<f64>,
}

/// Camera noise and variation from clip to clip, as the earlier clips show them.
pub(crate) struct LearnedNoise {
    pub(crate) camera: SimulatedCamera,
    exposure_frames: Option<f64>,
    /// Relative standard deviation from clip to clip, by kind of quantity.
    between_clip_stds: [f64; KINDS],
    /// Standard deviation of the logarithm of a pair's mass ratio that no repetition reduces.
    pair_std: f64,
}

/// Candidate speeds as fractions of the speed at which the struck object stays in its half of the workspace.
const SPEED_FRACTIONS: [f64; 2] = [0.6, 1.0];
/// Offsets of off-centre experiments as fractions of the sum of both outer radii; they have the full speed.  The contact points
/// of discs slide to the end of the impact, which measures contact friction, only if the offset is large.
const OFFSET_FRACTIONS: [f64; 2] = [0.5, 0.8];
/// Assumed relative standard deviation from clip to clip where there are no repeats.
const ASSUMED_BETWEEN_CLIP_STD: f64 = 0.03;
/// Contact points certainly slide if sticking would take this many times the friction.
const CERTAINLY_SLIDING: f64 = 1.3;
/// Standard deviation of contact friction from one oblique impact; the estimator needs several impacts that agree.
const OBLIQUE_IMPACT_STD: f64 = 0.05;

impl LearnedNoise {
    /// Medians over the earlier clips.
    pub(crate) fn new(clips: &[ClipMeasurements]) -> Self {
        let recordings = || clips.iter().map(|clip| &clip.recording);
        let camera = SimulatedCamera {
            frame_rate_hz: 1.0 / median(recordings().map(|r| r.frame_s)).unwrap_or(0.0).max(1e-4),
            position_std_m: median(recordings().map(|r| r.position_std_m)).unwrap_or(0.0).max(1e-7),
            yaw_std_rad: median(recordings().map(|r| r.yaw_std_rad)).unwrap_or(0.0),
            seed: None,
        };
        let chi2_by_exposure: Vec<_> = clips.iter().map(|c| c.chi2_by_exposure).collect();
        let measurements: Vec<Measurements> = clips.iter().map(|c| c.measurements.clone()).collect();
        let between_clip_stds = means::between_clip_stds(&measurements).map(|found| {
            let repeats = found.degrees_of_freedom > 0.0;
            if repeats { found.relative } else { ASSUMED_BETWEEN_CLIP_STD }
        });
        Self {
            camera,
            exposure_frames: exposure::best_frames(&chi2_by_exposure),
            between_clip_stds,
            pair_std: mass_network::pair_std(&measurements),
        }
    }
}

/// All candidate experiments: every object alone, and into every other one (and into a copy of itself, for kinds in `copies`),
/// slow and fast, central and off centre.
pub(crate) fn experiments(prior: &Prior, setup: Setup, copies: &BTreeSet<String>) -> Vec<Experiment> {
    let Setup { cell, objects } = setup;
    let mut all = Vec::new();
    for object in objects {
        let fastest = fastest_m_s(prior, cell, &object.name);
        let experiment = |into: Option<String>, fraction: f64, offset_m: f64| {
            // Rounded to 1 mm/s and 0.1 mm, the accuracy of a robot and a ruler.
            let speed_m_s = (fastest * fraction * 1e3).round() / 1e3;
            Experiment {
                strike: object.name.clone(),
                into,
                speed_m_s,
                offset_m: (offset_m * 1e4).round() / 1e4,
            }
        };
        let others = objects.iter().filter(|o| o.name != object.name || copies.contains(&o.name));
        let names = others
            .map(|o| if o.name == object.name { (format!("{}#2", o.name), o) } else { (o.name.clone(), o) });
        all.extend(SPEED_FRACTIONS.map(|fraction| experiment(None, fraction, 0.0)));
        for (name, other) in names {
            all.extend(SPEED_FRACTIONS.map(|fraction| experiment(Some(name.clone()), fraction, 0.0)));
            let reach_m = object.shape.outer_radius_m() + other.shape.outer_radius_m();
            all.extend(
                OFFSET_FRACTIONS.map(|fraction| experiment(Some(name.clone()), 1.0, fraction * reach_m)),
            );
        }
    }
    all
}

/// The candidate clips of these experiments, without those whose objects leave the workspace or that measure nothing.
pub(crate) fn candidates(
    prior: &Prior,
    setup: Setup,
    learned: &LearnedNoise,
    experiments: Vec<Experiment>,
) -> Vec<CandidateClip> {
    let candidate =
        |experiment: Experiment| CandidateClip::new(prior, setup, learned, experiment).ok().flatten();
    experiments.into_par_iter().filter_map(candidate).collect()
}

impl CandidateClip {
    fn new(
        prior: &Prior,
        setup: Setup,
        learned: &LearnedNoise,
        experiment: Experiment,
    ) -> Result<Option<Self>> {
        let clip = experiment.simulated_clip("advice", setup, &prior.properties, &learned.camera)?;
        let last_samples = clip.tracks.tracks.iter().filter_map(|t| t.samples.last());
        if !last_samples.into_iter().all(|s| setup.cell.workspace.contains(s.position())) {
            return Ok(None);
        }
        let estimate = ClipEstimate::new(&clip, setup.cell, setup.objects)?;
        let yaw_scale = learned.camera.yaw_std_rad / estimate.yaw_std_rad();
        let scale = if yaw_scale > 0.0 { yaw_scale } else { 1.0 };
        let refitted = estimate.refitted(1.0, scale, learned.exposure_frames);
        let measured = measure::measured(&refitted, &clip).1;
        Ok(Self::from_measurements(prior, learned, experiment, &measured))
    }

    /// The linear measurement model of a simulated clip; `None` if it measures no parameter.
    fn from_measurements(
        prior: &Prior,
        learned: &LearnedNoise,
        experiment: Experiment,
        measured: &ClipMeasurements,
    ) -> Option<Self> {
        // The parameters that are measured, with factors
        let measurements = &measured.measurements;
        let linear: Vec<(usize, Vec<(usize, f64)>)> = (measurements.quantities.iter().enumerate())
            .map(|(k, quantity)| (k, prior.row(quantity)))
            .filter(|(_, row)| !row.is_empty())
            .collect();
        let oblique_impacts = measured.oblique_impacts.iter().filter_map(|impact| {
            let parameter = if impact.with_striker {
                Parameter::StrikerContactFriction
            } else {
                Parameter::ContactFriction
            };
            let contact = &prior.properties.contact_friction;
            let friction = if impact.with_striker { contact.striker } else { contact.objects }?.mean;
            let slides = impact.sticking_ratio > CERTAINLY_SLIDING * friction;
            let index = prior.parameters.iter().position(|p| *p == parameter)?;
            slides.then_some((index, impact.impulse_ratio.std))
        });
        let oblique_impacts: Vec<(usize, f64)> = oblique_impacts.collect();

        // Rows and noise
        let size = linear.len() + oblique_impacts.len();
        let mut rows = DMatrix::zeros(size, prior.parameters.len());
        let mut noise = DMatrix::zeros(size, size);
        for (r, (k, row)) in linear.iter().enumerate() {
            for &(column, factor) in row {
                rows[(r, column)] += factor;
            }
            for (c, (l, _)) in linear.iter().enumerate() {
                noise[(r, c)] = measurements.covariance[(*k, *l)];
            }
            noise[(r, r)] += learned.variance(&measurements.quantities[*k], measurements.values[*k]);
            if measurements.double_contact[*k] {
                noise[(r, r)] += DOUBLE_CONTACT_STD.powi(2);
            }
        }
        for (n, (index, std)) in oblique_impacts.iter().enumerate() {
            rows[(linear.len() + n, *index)] = 1.0;
            noise[(linear.len() + n, linear.len() + n)] = std * std + OBLIQUE_IMPACT_STD.powi(2);
        }
        (size > 0).then_some(Self { experiment, advised: 0, rows, noise })
    }

    /// The covariance of the parameters after this clip has been filmed: the measurement update of a Kalman filter.
    ///
    /// `None` if the covariance of the innovation is not positive definite.
    pub(crate) fn after(&self, covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let cross = &self.rows * covariance;
        let factor = (&cross * self.rows.transpose() + &self.noise).cholesky()?;
        let reduction = cross.tr_mul(&factor.solve(&cross));
        let after = covariance - reduction;
        Some((&after + after.transpose()) * 0.5)
    }
}

impl LearnedNoise {
    /// Variance of the difference between the value of one clip and the mean of all clips, without the noise of the track.
    fn variance(&self, quantity: &Quantity, value: f64) -> f64 {
        let relative = self.between_clip_stds[quantity.kind()];
        match quantity {
            Quantity::MassRatio(..) => relative.powi(2) + self.pair_std.powi(2),
            _ => (relative * value).powi(2),
        }
    }
}

/// The kinds of objects of which a second copy is among these names.
pub(crate) fn copies<'a>(names: impl Iterator<Item = &'a str>) -> BTreeSet<String> {
    names.filter(|name| name.contains('#')).map(|name| kind(name).to_owned()).collect()
}
